"""The black box is an ARX model where nothing bends, predicts in free run, and sees no held-out test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from synthetic import TWO, damper_of, sine, sines, waveform

from pzd.diagnosis import narx
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.cross_validation import assign_folds
from pzd.diagnosis.fit.prediction import predicted_force
from pzd.diagnosis.narx import Order
from pzd.diagnosis.peer_comparison import UNSTABLE, BlackBox, HeldOutTests
from pzd.diagnosis.peers import StrokeMotion
from pzd.fit.cross_validation import PredictionError
from pzd.record import Array, Record

STEP = 0.005
ARX = Order(2, STEP, ())
TRUE = np.array([1.1, -0.4, 12.0, 900.0, 1500.0, -400.0, 250.0])
"""a1, a2, f0, k and the slopes of v0, v1, v2: poles at 0.55 +- 0.31 i."""
TESTS = ((0.5, 0.02), (1.0, 0.008), (2.0, 0.02), (3.0, 0.005))
MANY = (*TESTS, (1.5, 0.012), (2.5, 0.008), (4.0, 0.003), (5.0, 0.004))
"""A sine tells two numbers beside the mean force: so many that without two of them seven are determined."""
THREE = (0.0, 50.0, 100.0)


def motion(*parts: tuple[float, float], rate: float = 200.0, duration: float = 4.0) -> StrokeMotion:
    """Sines, each of a frequency [Hz] and an amplitude [m], one over the other."""
    time = np.arange(round(duration * rate)) / rate
    x, v, _ = (np.sum(channel, axis=0) for channel in zip(*(waveform(time, *part) for part in parts), strict=True))
    return StrokeMotion(x, v, 1.0 / rate)


def run(order: Order, coefficients: Array, moved: StrokeMotion, first: float = 0.0) -> Array:
    return narx.free_run(order, coefficients, moved, first, np.inf)


def factor(order: Order, moved: StrokeMotion, force: Array) -> Array:
    return narx.triangle(order, moved, force, np.ones(force.size, dtype=np.bool_))


# ---------------------------------------------------------------- the model


def test_a_linear_arx_system_is_recovered_and_then_run_freely_without_an_error() -> None:
    moved = [motion((0.5, 0.02), (1.3, 0.01), (3.1, 0.004)), motion((0.8, 0.015), (2.2, 0.006), (4.7, 0.002))]
    forces = [run(ARX, TRUE, each) for each in moved]
    found, error = narx.fit(narx.joined(factor(ARX, m, f) for m, f in zip(moved, forces, strict=True)))
    assert found == pytest.approx(TRUE, rel=1e-6)
    assert error < 1e-12 * sum(float(force @ force) for force in forces)
    other = motion((1.7, 0.03))
    assert run(ARX, found, other) == pytest.approx(run(ARX, TRUE, other), rel=1e-6, abs=1e-6)


def test_the_factors_of_two_tests_have_the_least_squares_of_both(rng: np.random.Generator) -> None:
    """Held to the columns written out, of a system with knots and noise, for which no fit is exact."""
    order = Order(1, STEP, (-0.05, 0.05))
    tests = [motion((0.5, 0.02), (1.3, 0.01)), motion((2.2, 0.006), (0.9, 0.01))]
    forces = [1e3 * np.tanh(each.velocity / 0.03) + rng.standard_normal(each.velocity.size) for each in tests]
    found, error = narx.fit(narx.joined(factor(order, m, f) for m, f in zip(tests, forces, strict=True)))
    rows = []
    for each, force in zip(tests, forces, strict=True):
        x, v, before = each.displacement[1:], each.velocity[1:], each.velocity[:-1]
        bent = [np.column_stack([u, np.clip(u + 0.05, 0, None), np.clip(u - 0.05, 0, None)]) for u in (v, before)]
        rows.append(np.column_stack([force[:-1], np.ones(x.size), x, *bent, force[1:]]))
    columns = np.concatenate(rows)
    solved, squares, *_ = np.linalg.lstsq(columns[:, :-1], columns[:, -1], rcond=None)
    assert found == pytest.approx(solved, rel=1e-6)
    assert error == pytest.approx(squares[0], rel=1e-9)


def test_the_free_run_of_one_pole_is_a_geometric_series() -> None:
    """At constant speed F_i = b v (1 - a^i)/(1 - a) + a^i F_0, i the steps of tau that have passed."""
    a, b, speed, first, lag = 0.9, 300.0, 0.1, 50.0, 3
    moved = StrokeMotion(np.zeros(60), np.full(60, speed), STEP / lag)
    force = run(Order(1, STEP, ()), np.array([a, 0.0, 0.0, b, 0.0]), moved, first)
    passed = np.arange(60) // lag + 1
    assert force == pytest.approx(b * speed * (1.0 - a**passed) / (1.0 - a) + a**passed * first)


def test_the_free_run_settles_to_the_transfer_function() -> None:
    """F/v = (b0 + b1 z^-1) / (1 - a1 z^-1 - a2 z^-2) at z = exp(i w tau)."""
    frequency, amplitude = 2.0, 0.01
    moved = motion((frequency, amplitude))
    coefficients = np.array([1.1, -0.4, 0.0, 0.0, 1500.0, -400.0, 0.0])
    late = np.exp(-2j * np.pi * frequency * STEP * np.arange(3))
    gain = (1500.0 * late[0] - 400.0 * late[1]) / (1.0 - 1.1 * late[1] + 0.4 * late[2])
    w, time = 2.0 * np.pi * frequency, np.arange(moved.velocity.size) * STEP
    settled = np.real(gain * amplitude * w * np.exp(1j * w * time))
    assert run(ARX, coefficients, moved)[200:] == pytest.approx(settled[200:], abs=1e-9 * np.abs(settled).max())


def test_a_faster_logger_gives_the_same_model_and_the_same_force() -> None:
    """tau is a time: of a logger five times as fast every fifth sample is the past, and no sample is lost."""
    slow, fast = (motion((0.5, 0.02), (1.3, 0.01), (3.1, 0.004), rate=rate) for rate in (200.0, 1000.0))
    assert run(ARX, TRUE, fast)[::5] == pytest.approx(run(ARX, TRUE, slow), abs=1e-9)
    force = run(ARX, TRUE, fast)
    found, _ = narx.fit(factor(ARX, fast, force))
    assert found == pytest.approx(TRUE, rel=1e-5)
    assert {order.step for order in narx.orders([slow, fast])} == {order.step for order in narx.orders([slow])}


def test_the_step_is_a_share_of_the_fastest_cycle_in_whole_samples() -> None:
    steps = {
        order.step for order in narx.orders([motion((2.0, 0.01), duration=8.0), motion((0.5, 0.01), duration=8.0)])
    }
    assert sorted(steps) == pytest.approx([0.01, 0.025, 0.05])  # a cycle of 0.5 s, of which 1/40 is 2.5 samples
    assert {order.step for order in narx.orders([motion((2.0, 0.01), rate=10.0, duration=8.0)])} == {0.1}


def test_the_knots_divide_the_samples_in_equal_parts_and_long_tests_weigh_no_more() -> None:
    slow, fast = motion((1.0, 0.01), duration=40.0), motion((1.0, 0.02), duration=4.0)
    knots = next(order.knots for order in narx.orders([slow, fast]) if len(order.knots) == 3)
    peaks = [2.0 * np.pi * 0.01, 2.0 * np.pi * 0.02]
    below = [np.mean([0.5 + np.arcsin(min(max(knot / peak, -1.0), 1.0)) / np.pi for peak in peaks]) for knot in knots]
    assert below == pytest.approx([0.25, 0.5, 0.75], abs=0.01)


@pytest.mark.parametrize(("poles", "stable"), [((0.99, 0.5), True), ((1.01, 0.5), False), ((-0.9, -1.1), False)])
def test_a_free_run_forgets_its_beginning_where_the_poles_say_so(poles: tuple[float, float], stable: bool) -> None:
    a1, a2 = sum(poles), -poles[0] * poles[1]
    coefficients = np.array([a1, a2, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert narx.is_stable(ARX, coefficients) is stable
    rest = StrokeMotion(np.zeros(3000), np.zeros(3000), STEP)
    end = abs(run(ARX, coefficients, rest, first=1.0)[-1])
    assert bool(end < 1e-9) is stable
    held = narx.free_run(ARX, 1e3 * coefficients, rest, 1.0, 50.0)  # beyond what a double holds
    assert np.max(np.abs(held)) == 50.0


def test_a_held_out_half_is_neither_fitted_nor_anybody_s_past() -> None:
    moved = motion((0.5, 0.02), (1.3, 0.01), (3.1, 0.004))
    force = run(ARX, TRUE, moved)
    seen = np.arange(force.size) >= force.size // 2
    spoilt = np.where(seen, force, 1e6)
    found, _ = narx.fit(narx.triangle(ARX, moved, spoilt, seen))
    assert found == pytest.approx(TRUE, rel=1e-5)
    nothing = narx.triangle(ARX, moved, force, np.zeros(force.size, dtype=np.bool_))
    assert narx.fit(nothing) == (pytest.approx(np.zeros(TRUE.size)), 0.0)


# ---------------------------------------------------------------- on the folds of the diagnosis


def held_out_tests(records: Sequence[Record], voltages: Sequence[float] = TWO) -> HeldOutTests:
    cleaned = clean(records)
    return HeldOutTests(cleaned, assign_folds(cleaned, damper_of(voltages)))


def arx_records(at: dict[float, Array], rng: np.random.Generator) -> list[Record]:
    """Tests of a damper that is an ARX system, without noise, long after it was started."""
    found = []
    for U, coefficients in at.items():
        for frequency, amplitude in MANY:
            plain = sine(damper_of(), U, frequency, amplitude, rng, noise=0.0, cycles=6, rate=200.0)
            time = plain.time[0] + np.arange(-400, plain.time.size) / plain.rate
            x, v, _ = waveform(time, frequency, amplitude)
            force = run(ARX, coefficients, StrokeMotion(x, v, STEP))[400:]
            found.append(replace(plain, force=force))
    return found


def test_held_out_tests_of_a_linear_system_are_predicted_to_the_last_digits(rng: np.random.Generator) -> None:
    tests = held_out_tests(arx_records({0.0: TRUE}, rng), (0.0,))
    box = BlackBox(tests)
    assert tests.held_out_error(box).criterion == pytest.approx(0.0, abs=1e-12)
    assert not box.unstable
    order, fits = box.best_order(None, (0,))
    assert (order.lags, order.step, order.knots) == (2, pytest.approx(STEP), ())
    assert fits[0.0].parameters == pytest.approx(TRUE, rel=1e-2)


def test_between_two_voltages_the_force_lies_between_those_of_its_neighbours(rng: np.random.Generator) -> None:
    """A damper whose force is linear in the voltage, of which the coefficients of no recursion are."""
    other = np.array([0.2, 0.3, 12.0, 300.0, 4000.0, 100.0, 0.0])
    low, high = arx_records({0.0: TRUE}, rng), arx_records({100.0: other}, rng)
    middle = [
        replace(one, name=f"middle {i}", force=0.5 * (one.force + two.force), voltage=np.full(one.time.size, 50.0))
        for i, (one, two) in enumerate(zip(low, high, strict=True))
    ]
    tests = held_out_tests([*low, *middle, *high], THREE)
    assert tests.interpolation_error(BlackBox(tests), 1).criterion == pytest.approx(0.0, abs=1e-12)


def test_neither_order_nor_coefficients_know_a_held_out_test(rng: np.random.Generator) -> None:
    records = [sine(damper_of(TWO), U, f, x, rng, cycles=3, rate=200.0) for U in TWO for f, x in TESTS]
    other = [replace(records[0], force=-3.0 * records[0].force), *records[1:]]
    before, after = held_out_tests(records), held_out_tests(other)
    (fold,) = (k for k, masks in enumerate(before.folds.folds) if masks[0].any())
    (order, fits), (same, refits) = (BlackBox(tests).best_order(fold, (0, 1)) for tests in (before, after))
    assert order == same
    for voltage in TWO:
        assert refits[voltage].parameters == pytest.approx(fits[voltage].parameters, rel=1e-12)
    _, seen = BlackBox(after).best_order(None, (0, 1))
    assert seen[TWO[0]].parameters.tolist() != fits[TWO[0]].parameters.tolist()


def test_where_nothing_is_missing_no_black_box_predicts_better_than_the_damper(rng: np.random.Generator) -> None:
    """What the true damper leaves is noise, and nobody predicts noise."""
    damper = damper_of(TWO)
    tests = held_out_tests(sines(damper, rng, TWO, cycles=4))
    error = tests.held_out_error(BlackBox(tests))
    true = PredictionError.concatenated(
        [
            tests.error(tests.all_samples, members, lambda i: predicted_force(damper, tests.cleaned[i]))
            for _, members in tests.groups
        ]
    )
    assert true.criterion is not None
    assert error.criterion is not None
    assert true.criterion < error.criterion < 1.0


def test_an_unstable_black_box_is_reported_and_its_force_stays_finite(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tests of a force that grows with every sample, whatever the motion: their ARX model grows without end."""
    monkeypatch.setattr(narx, "KNOTS", (0,))
    records = [sine(damper_of((0.0,)), 0.0, f, x, rng, noise=0.0, cycles=4, rate=200.0) for f, x in TESTS]
    growing = [replace(r, force=np.exp(3.0 * r.time) + 0.01 * rng.standard_normal(r.time.size)) for r in records]
    tests = held_out_tests(growing, (0.0,))
    box = BlackBox(tests)
    error = tests.held_out_error(box)
    assert np.isfinite(error.error).all()
    assert box.unstable == {record.name for record in growing}
    _, fits = box.best_order(None, (0,))
    assert fits[0.0].status == UNSTABLE


def test_two_tests_are_enough_to_choose_an_order_by_and_one_alone_is_halved(rng: np.random.Generator) -> None:
    for count in (1, 2):
        records = [sine(damper_of((0.0,)), 0.0, f, x, rng, cycles=6, rate=200.0) for f, x in TESTS[:count]]
        tests = held_out_tests(records, (0.0,))
        error = tests.held_out_error(BlackBox(tests))
        assert set(error.records) == set(range(count))
        assert np.isfinite(error.error).all()
