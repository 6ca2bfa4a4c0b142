"""What changed is found by name and size, and what did not change is not blamed."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest
from states import (
    MOTIONS,
    SPEED,
    campaign,
    drawn_damper,
    found,
    inside,
    likelihood_between,
    names,
    names_told,
    scaled,
    sine,
    state_of,
)

from pzd.artefacts.changes import Change
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.changes.candidates import _counted_from
from pzd.diagnosis.changes.comparison import changes_between
from pzd.diagnosis.changes.quantities import is_determined, is_little, may_be_as_before
from pzd.diagnosis.changes.regression import SHARE_SCATTER, USUAL_SHARE, Scatter
from pzd.diagnosis.config import DiagnoseConfig
from pzd.fit.intervals import LEVEL
from pzd.identification.config import IdentifyConfig
from pzd.quantities import Control
from pzd.record import Record
from pzd.schema.errors import DataError

WIDE = ((0.5, 0.02), (1.0, 0.03), (2.0, 0.02), (2.0, 0.03), (3.5, 0.03))
"""Motions that reach beyond both knees."""


def test_the_same_damper_run_twice_did_not_change(rng: np.random.Generator) -> None:
    for draw in rng.spawn(3):
        damper = drawn_damper(draw)
        changes = found(campaign(damper, draw), campaign(damper, draw))
        assert (changes.verdict, names(changes)) == ("unchanged", [])
        assert {"T0", "C"} & {each.name for each in changes.unchanged}


@pytest.mark.parametrize(("parameter", "factor"), [("T0", 1.12), ("C", 0.85), ("k", 0.7)])
def test_a_parameter_that_changed_is_named_with_its_size(
    rng: np.random.Generator, parameter: str, factor: float
) -> None:
    column = {"T0": "T0_N", "C": "C_Ns_per_m", "k": "k_N_per_m"}[parameter]
    for draw in rng.spawn(2):
        damper = drawn_damper(draw)
        changes = found(campaign(damper, draw), campaign(scaled(damper, **{column: factor}), draw))
        if changes.difference.share_of_peak < 0.005:
            continue  # a rigid damper shows no spring, and one without friction no T0
        assert changes.verdict == "changed"
        assert names(changes) == [parameter]
        assert inside(changes.changes[0], factor, slack=2.0)
        assert changes.changes[0].share > 0.8
        assert changes.difference.explained > 0.95


EFFECTS: list[tuple[str, dict[str, float], float]] = [
    ("orifice_quadratic", {"q": 2500.0}, 0.1),
    ("lash", {"delta": 8e-4}, 0.1),
    ("asymmetry", {"alpha": 0.08}, 0.1),
    ("viscous_asymmetry", {"alpha_C": 0.15}, 0.1),
    ("gas_spring", {"k_g": 2500.0}, 0.1),
]


@pytest.mark.parametrize(("name", "values", "within"), EFFECTS, ids=[name for name, _, _ in EFFECTS])
def test_an_effect_that_is_newly_there_is_named_with_its_size(
    rng: np.random.Generator, name: str, values: dict[str, float], within: float
) -> None:
    damper = drawn_damper(rng)
    changes = found(campaign(damper, rng), campaign(damper.with_effect(name, values), rng))
    assert name in names_told(changes)
    mine = {c.parameter: c for c in changes.changes if c.name == name}
    for parameter, value in values.items():
        assert mine[parameter].to == pytest.approx(value, rel=within)
        assert mine[parameter].from_ == 0.0


def test_two_changes_at_once_are_both_named(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng)
    after = scaled(damper, T0_N=0.8).with_effect("gas_spring", {"k_g": 3000.0})
    changes = found(campaign(damper, rng), campaign(after, rng))
    assert set(names(changes)) == {"T0", "gas_spring"}
    assert changes.difference.explained > 0.95


def test_four_changes_at_once_are_all_named(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng)
    effects = {"gas_spring": {"k_g": 3000.0}, "orifice_quadratic": {"q": 2500.0}, "lash": {"delta": 8e-4}}
    after = scaled(damper, T0_N=0.8)
    for name, values in effects.items():
        after = after.with_effect(name, values)
    changes = found(campaign(damper, rng), campaign(after, rng))
    # A play in the frame may look like one in the damper; then it is said.
    assert {"T0", *effects} <= names_told(changes)
    assert changes.verdict == "changed" or "lash" in changes.rivals
    assert changes.difference.explained > 0.99
    assert len(names(changes)) == 1 + len(effects)


def test_what_the_recorded_temperature_did_is_told_with_t0_and_c_at_either(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng)

    def at(temperature: float, records: Iterable[Record]) -> list[Record]:
        return [replace(r, temperature=np.full(r.time.size, temperature)) for r in records]

    warm = at(45.0, campaign(scaled(damper, T0_N=0.9, C_Ns_per_m=0.8), rng))
    changes = found(at(20.0, campaign(damper, rng)), warm)
    assert names(changes) == ["temperature"], changes.reason
    assert changes.difference.explained > 0.98
    assert "45 degC instead of 20" in changes.reason
    assert "load_cell_gain" not in names_told(changes)


def test_a_gas_that_hardens_with_its_pressure_is_the_dampers_and_a_constant_alone_may_be_the_load_cells(
    rng: np.random.Generator,
) -> None:
    damper = drawn_damper(rng)
    before = campaign(damper, rng)
    preloaded = damper.with_effect("preload_offset", {"F_0": -60.0})
    alone = found(before, campaign(preloaded, rng))
    assert alone.verdict == "ambiguous"
    assert {"preload_offset", "load_cell_zero"} <= names_told(alone)
    gas = found(before, campaign(preloaded.with_effect("gas_spring", {"k_g": 1500.0}), rng))
    assert gas.verdict == "changed"
    assert {c.parameter: c.to for c in gas.changes}["F_0"] == pytest.approx(-60.0, abs=6.0)
    assert "load_cell_zero" not in names_told(gas)


def test_what_the_stand_did_is_not_laid_to_the_damper(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng).with_effect("preload_offset", {"F_0": 250.0})
    before, again = campaign(damper, rng), campaign(damper, rng)
    louder = found(before, [replace(r, force=1.03 * r.force) for r in again])
    assert names(louder) == [] or louder.verdict == "ambiguous"
    assert "load_cell_gain" in names_told(louder)
    later = found(before, [replace(r, force=np.interp(r.time - 0.003, r.time, r.force)) for r in again])
    assert "recorder_delay" in names_told(later)
    delay = next((c for c in later.changes if c.name == "recorder_delay"), None)
    assert delay is None or delay.to == pytest.approx(0.003, rel=0.1)


@pytest.mark.parametrize("parameters", [("T0_N", "C_Ns_per_m"), ("T0_N", "C_Ns_per_m", "k_N_per_m")])
def test_what_changed_together_by_more_than_a_gain_goes_is_the_dampers(
    parameters: tuple[str, ...], rng: np.random.Generator
) -> None:
    """A gain of 5 % takes up half of it, and no change of one parameter beside that leaves less."""
    for draw in rng.spawn(2):
        damper = drawn_damper(draw, voltages=(0.0,))
        changes = found(campaign(damper, draw), campaign(scaled(damper, **dict.fromkeys(parameters, 1.12)), draw))
        assert changes.verdict != "unchanged", changes.reason
        assert changes.difference.explained > 0.99
        assert {"T0", "C"} <= names_told(changes) or "load_cell_gain" not in names_told(changes)


@pytest.mark.parametrize(
    ("T0", "C", "k"),
    [(500.0, 3000.0, 1e9), (800.0, 0.0, 4e5), (0.0, 4000.0, 4e5), (800.0, 2000.0, 4e4)],
    ids=["rigid", "friction alone", "viscous alone", "hardly slipping"],
)
def test_a_larger_change_than_a_stand_makes_is_not_the_stands_at_any_end_of_the_element(
    T0: float, C: float, k: float, rng: np.random.Generator
) -> None:
    """The gain ended at its 5 %, the tests' own gains took the rest, and nothing of the damper had changed."""
    damper = Damper(base=(BaseRow(voltage_V=0.0, T0_N=T0, C_Ns_per_m=C, k_N_per_m=k),))
    larger = scaled(damper, T0_N=1.12, C_Ns_per_m=1.12, k_N_per_m=1.12)
    same, changed = (found(campaign(damper, rng), campaign(after, rng)) for after in (damper, larger))
    assert (same.verdict, names(same)) == ("unchanged", [])
    assert changed.verdict != "unchanged", changed.reason
    assert "load_cell_gain" not in names(changed, "stand")


def test_how_small_a_change_would_be_hidden_by_the_noise_is_told(rng: np.random.Generator) -> None:
    """At 100 Hz one sample of a rigid damper lies in its jump: a sixth less of C hides beneath the scatter of that."""
    rigid = Damper(base=(BaseRow(voltage_V=0.0, T0_N=500.0, C_Ns_per_m=3000.0, k_N_per_m=1e9),))

    before, after = (
        [sine(damper, 0.0, 1.0, 0.02, rng, noise=0.003, scatter=0.0, rate=100.0)]
        for damper in (rigid, scaled(rigid, C_Ns_per_m=0.85))
    )
    changes = found(before, after)
    assert changes.verdict == "unchanged", changes.reason
    assert "of peak would not be seen beneath the noise" in changes.reason
    assert "C" not in {each.name for each in changes.unchanged}


def test_a_gain_of_the_load_cell_cannot_be_told_from_all_of_t0_c_and_k_at_one_level(rng: np.random.Generator) -> None:
    for draw in rng.spawn(3):
        damper = drawn_damper(draw, voltages=(0.0,))
        before, again = campaign(damper, draw), campaign(damper, draw)
        changes = found(before, [replace(r, force=1.03 * r.force) for r in again])
        assert changes.verdict == "ambiguous", changes.reason
        assert {"load_cell_gain", "T0", "C"} <= names_told(changes)
        assert not {each.name for each in changes.unchanged} & names_told(changes)


def test_the_zero_of_the_displacement_changes_neither_gas_force_nor_spring(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng).with_effect("gas_spring", {"k_g": 4000.0})
    moved = [replace(r, displacement=r.displacement + 0.004) for r in campaign(damper, rng)]
    changes = found(campaign(damper, rng), moved)
    assert (changes.verdict, names(changes)) == ("unchanged", [])
    (zero,) = [c for c in changes.changes if c.name == "displacement_zero"]
    assert zero.to == pytest.approx(0.004, rel=0.01)


def test_what_the_model_misses_cancels_where_the_motions_are_equal(rng: np.random.Generator) -> None:
    """A law outside the library, of a tenth of the peak, in both states: T0 alone is named, with its size."""

    def outside(records: tuple[Record, ...]) -> list[Record]:
        return [
            replace(r, force=r.force + 200.0 * np.sin(400.0 * r.displacement) * np.tanh(8.0 * r.velocity))
            for r in records
        ]

    damper = drawn_damper(rng)
    changes = found(outside(campaign(damper, rng)), outside(campaign(scaled(damper, T0_N=1.15), rng)))
    assert (changes.verdict, names(changes), changes.compared) == ("changed", ["T0"], "cycles")


def test_motions_that_were_not_run_before_are_compared_through_the_model(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng)
    other = campaign(scaled(damper, C_Ns_per_m=1.3), rng, motions=((1.3, 0.02), (1.7, 0.03)))
    changes = found(campaign(damper, rng), other)
    assert (changes.compared, names(changes)) == ("model", ["C"])
    some = campaign(scaled(damper, C_Ns_per_m=1.3), rng, motions=((0.5, 0.02), (1.7, 0.03)))
    assert found(campaign(damper, rng), some).compared == "both"


def test_states_without_a_repeating_test_are_refused_with_what_to_do(rng: np.random.Generator) -> None:
    damper: Damper = drawn_damper(rng)
    records = campaign(damper, rng, motions=((2.0, 0.02),))
    wandering = [replace(r, displacement=0.02 * np.cumsum(rng.standard_normal(r.time.size)) / 30.0) for r in records]
    with pytest.raises(DataError, match=r"aged: no test repeats.*run a sine"):
        found(records, wandering)


def test_the_result_does_not_hang_on_the_order_of_the_tests(
    rng: np.random.Generator, seeds: Callable[[int], list[int]]
) -> None:
    damper = drawn_damper(rng)
    before, after = campaign(damper, rng), campaign(scaled(damper, T0_N=1.2), rng)
    forward, backward = found(before, after), found(before[::-1], after[::-1])
    assert names(forward) == names(backward)
    assert forward.changes[0].to == pytest.approx(backward.changes[0].to, rel=1e-3)


def test_what_all_tests_share_is_none_of_their_own(rng: np.random.Generator) -> None:
    """A gain of every test's own goes; the same gain in all of them stays, but for what chance may give."""
    damper = drawn_damper(rng)
    likelihood = likelihood_between(campaign(damper, rng), campaign(damper, rng))
    scatter = Scatter(USUAL_SHARE, 0.0)
    gains = [scatter.tests * columns[:, 1] for columns in likelihood.columns]
    sides = [1.0 if i % 2 else -1.0 for i in range(len(gains))]
    for signs, most in ((sides, 0.1), ([1.0] * len(gains), 1.0)):
        residuals = [2.5 * sign * gain for sign, gain in zip(signs, gains, strict=True)]
        left = [r - own for r, own in zip(residuals, likelihood.own_of_tests(residuals, scatter), strict=True)]
        shares = [np.linalg.norm(rest) / np.linalg.norm(r) for rest, r in zip(left, residuals, strict=True)]
        assert max(shares) <= most
    chance = LEVEL / np.sqrt(len(gains))
    assert shares == pytest.approx([1.0 - chance / 2.5] * len(shares), abs=0.05)


def test_the_scatter_is_as_likely_by_determinant_and_inverse_of_the_covariance(rng: np.random.Generator) -> None:
    """-2 ln L of a normal density, its matrix written out."""
    damper = drawn_damper(rng)
    likelihood = likelihood_between(campaign(damper, rng), campaign(damper, rng))
    scatters = [Scatter(0.3, 0.0), Scatter(1.0, 0.2), Scatter(0.5, 0.1, 0.15)]
    residuals = [rng.standard_normal(c.difference.size) for c in likelihood.comparisons]
    for scatter, found_here in zip(scatters, likelihood.deviances(residuals, scatters), strict=True):
        direct = (np.log(scatter.tests / USUAL_SHARE) / SHARE_SCATTER) ** 2
        for i, (r, A) in enumerate(zip(residuals, likelihood.columns, strict=True)):
            J = likelihood.comparisons[i].jumps
            V = np.diag(likelihood.diagonals(i, [scatter])[0]) + scatter.tests**2 * A @ A.T + J @ J.T
            direct += r @ np.linalg.solve(V, r) + np.linalg.slogdet(V)[1]
        assert found_here == pytest.approx(direct, rel=1e-7)


def test_a_constant_alone_is_told_from_the_gas_with_the_load_cell_unloaded(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng)
    changes = found(campaign(damper, rng), campaign(damper.with_effect("preload_offset", {"F_0": -60.0}), rng))
    assert changes.verdict == "ambiguous"
    assert {"load_cell_zero", "preload_offset"} <= names_told(changes)
    assert changes.next_test is not None
    assert "unloaded" in changes.next_test.waveform
    assert {"load_cell_zero", "preload_offset"} <= set(changes.next_test.separates)


def test_a_fluid_that_thins_beside_a_yield_that_rounds_is_named(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng).with_effect("rounded_yield", {"w_s": 0.01})
    before = campaign(damper, rng)
    changes = found(before, campaign(damper.with_effect("shear_thinning", {"n": 0.8}), rng))
    assert "shear_thinning" in names_told(changes)


def test_hum_that_stands_in_every_cycle_hides_no_change(rng: np.random.Generator) -> None:
    """60 Hz is the twentieth harmonic of 3 Hz: no scatter of cycles tells of it, and it differs from run to run."""

    def humming(records: tuple[Record, ...]) -> list[Record]:
        phases = rng.uniform(0.0, 2.0 * np.pi, len(records))
        return [
            replace(r, force=r.force + 10.0 * np.sin(120.0 * np.pi * r.time + phase))
            for r, phase in zip(records, phases, strict=True)
        ]

    damper, motions = drawn_damper(rng), ((3.0, 0.01), (3.0, 0.02))
    before, after = (campaign(d, rng, motions) for d in (damper, scaled(damper, T0_N=1.03)))
    changes = found(humming(before), humming(after))
    assert names(changes) == names(found(before, after)) == ["T0"]
    assert changes.difference.left_N == pytest.approx(found(before, after).difference.left_N, rel=0.2)


def test_what_the_model_misses_is_carried_over_from_the_nearest_motion(rng: np.random.Generator) -> None:
    """In motions not run before, a damper alone lays what it misses to other laws than the one that changed."""

    def outside(records: tuple[Record, ...]) -> list[Record]:
        return [
            replace(r, force=r.force + 60.0 * np.sin(200.0 * r.displacement) * np.tanh(8.0 * r.velocity))
            for r in records
        ]

    for draw in rng.spawn(4):
        damper = drawn_damper(draw)
        after = campaign(scaled(damper, T0_N=1.15), draw, motions=((1.6, 0.02), (1.6, 0.028)))
        changes = found(outside(campaign(damper, draw)), outside(after))
        assert changes.compared == "model"
        assert "T0" in names_told(changes)
        assert names(changes) in ([], ["T0"])
        assert all(inside(change, 1.15) for change in changes.changes if change.name == "T0")


def test_a_yield_that_rounds_over_a_thousandth_of_the_speed_is_named(rng: np.random.Generator) -> None:
    """Its size enters by a logarithm alone: no linearised step from a hundred times as much tells of it."""
    row = BaseRow(voltage_V=0.0, T0_N=1400.0, C_Ns_per_m=1500.0, k_N_per_m=1.2e6)
    damper = Damper(base=(row,))
    rounded = damper.with_effect("rounded_yield", {"w_s": 1.5e-3 * SPEED})
    changes = found(campaign(damper, rng), campaign(rounded, rng))
    assert "rounded_yield" in names_told(changes)
    assert changes.changes[0].to == pytest.approx(1.5e-3 * SPEED, rel=0.3)


def test_a_stop_stands_where_it_is_whatever_middle_the_tests_have(rng: np.random.Generator) -> None:
    """Short strokes run beside the middle of the whole one, so that the mean of all tests lies elsewhere."""
    damper, values = drawn_damper(rng, voltages=(0.0,)), {"k_e": 2.0e6, "x_e": 0.02}

    def aside(records: tuple[Record, ...]) -> list[Record]:
        return [replace(r, displacement=r.displacement + 0.01 * (np.ptp(r.displacement) < 0.05)) for r in records]

    def stopped(r: Record) -> Record:
        beyond = np.maximum(np.abs(r.displacement) - values["x_e"], 0.0)
        return replace(r, force=r.force + values["k_e"] * beyond**2 * np.sign(r.displacement))

    after = [stopped(r) for r in aside(campaign(damper, rng))]
    changes = found(aside(campaign(damper, rng)), after)
    assert names(changes) == ["end_stop"]
    to = {c.parameter: c.to for c in changes.changes}
    assert to == pytest.approx(values, rel=0.1)


def test_a_bump_stop_acts_at_one_end_alone(rng: np.random.Generator) -> None:
    """By a law with a stop at either end 14.7 of 22 N had no name, and half of its force stood at the other end."""
    damper = drawn_damper(rng, voltages=(0.0,)).with_effect("gas_spring", {"k_g": 900.0})
    motions = (*MOTIONS, (1.0, 0.03))
    touched = [
        replace(record, force=record.force - 5e6 * np.maximum(-0.024 - record.displacement, 0.0) ** 2)
        for record in campaign(damper, rng, motions)
    ]
    changes = found(campaign(damper, rng, motions), touched)
    assert changes.verdict == "changed"
    assert names(changes) == ["end_stop"]
    assert "end_stop acts in compression alone" in changes.reason
    begins = next(change for change in changes.changes if change.parameter == "x_e")
    assert begins.to == pytest.approx(0.024, abs=3e-4)
    assert changes.difference.left_N < 0.15 * changes.difference.rms_N


def test_a_gas_about_another_zero_is_the_same_gas(rng: np.random.Generator) -> None:
    """A stop at one end counts from a middle that lies off, and the gas has to count from there too."""
    gas = drawn_damper(rng, voltages=(0.0,)).with_effect("accumulator", {"F_g": 180.0, "L": 0.12})
    gas = gas.with_effect("gas_spring", {"k_g": 700.0})
    for zero in (-0.015, 0.02):
        moved = _counted_from(gas, zero)
        assert moved.zero_m == zero
        for x in (-0.03, 0.0, 0.025):
            motion = Motion(np.arange(3.0), np.full(3, x), np.zeros(3), np.zeros(3), np.zeros(3))
            forces = [respond(each, motion, 0.0)[-1] for each in (gas, moved)]
            assert forces[1] == pytest.approx(forces[0], rel=1e-9)


def stepped(damper: Damper, rng: np.random.Generator, frequency: float) -> Record:
    """A sine in which the control signal steps."""
    time, w = np.arange(0.0, 6.0, 1.0 / 500.0), 2.0 * np.pi * frequency
    x, v, a = 0.02 * np.sin(w * time), 0.02 * w * np.cos(w * time), -0.02 * w**2 * np.sin(w * time)
    voltage = np.where(time % 1.7 < 0.8, 0.0, 100.0)
    force = respond(damper, Motion(time, x, v, a, voltage))
    noise = 0.003 * float(np.max(np.abs(force))) * rng.standard_normal(time.size)
    return Record(f"steps at {frequency:g} Hz", None, time, x, v, a, force + noise, voltage)


@pytest.mark.parametrize(("lag", "verdict"), [(0.0, "unchanged"), (0.05, "unexplained")])
def test_what_shows_only_where_the_control_signal_moves_is_not_called_unchanged(
    lag: float, verdict: str, rng: np.random.Generator
) -> None:
    """No average cycle knows of a valve that became slow."""
    damper = drawn_damper(rng)
    slower = damper.with_effect("valve_lag", {"tau": lag}) if lag else damper
    after = [*campaign(damper, rng), stepped(slower, rng, 1.4)]
    changes = found([*campaign(damper, rng), stepped(damper, rng, 1.0)], after)
    assert (changes.verdict, names(changes)) == (verdict, []), changes.reason
    assert ("of the tests left out" in changes.reason) == (verdict == "unexplained")


def test_how_small_a_change_would_be_hidden_by_what_the_damper_misses_is_told(rng: np.random.Generator) -> None:
    """A spring that hardens with the cube is in no library; beside another motion it is no change, and hides one."""
    damper, other = drawn_damper(rng), ((0.7, 0.025), (1.6, 0.012), (2.6, 0.024))

    def hardening(size: float, motions: tuple[tuple[float, float], ...]) -> list[Record]:
        return [replace(r, force=r.force + size * (r.displacement / 0.03) ** 3) for r in campaign(damper, rng, motions)]

    plain, hard = (found(hardening(size, MOTIONS), hardening(size, other)) for size in (0.0, 60.0))
    assert plain.verdict == hard.verdict == "unchanged"
    assert "would not be seen" not in plain.reason
    assert "of peak would not be seen, since the damper of new misses as much" in hard.reason


@pytest.mark.parametrize("equal", [True, False])
def test_a_stop_that_no_test_reached_before_is_neither_new_nor_nothing(equal: bool, rng: np.random.Generator) -> None:
    """Tests of 25 mm cannot know of a stop at 26 mm, whether the others of them are run again or not."""
    damper = drawn_damper(rng, voltages=(0.0,)).with_effect("end_stop", {"k_e": 1.0e7, "x_e": 0.026})
    before, other = ((0.5, 0.02), (2.0, 0.02), (2.0, 0.025)), ((0.7, 0.018), (1.6, 0.022), (2.6, 0.015))
    after = (*(before if equal else other), (1.0, 0.03))
    changes = found(campaign(damper, rng, before), campaign(damper, rng, after))
    assert changes.verdict in ("ambiguous", "unexplained"), changes.reason
    assert names(changes) == []
    assert "0V-1Hz-30mm goes 30 mm from the middle, the tests of new 25 mm" in changes.reason
    reached = found(campaign(damper, rng), campaign(damper, rng, ((0.7, 0.025), (1.0, 0.03))))
    assert (reached.verdict, "from the middle" in reached.reason) == ("unchanged", False), reached.reason


def test_a_test_at_a_control_signal_that_the_first_state_has_not_seen_is_told(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng, voltages=(0.0, 50.0, 100.0))
    before = [r for r in campaign(damper, rng) if r.median_voltage() != 50.0]
    changes = found(before, campaign(damper, rng))
    assert "3 tests of aged left out: new was not tested at such a control signal" in changes.reason


def test_a_test_in_which_the_control_signal_moves_is_left_out_and_told(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng, voltages=(0.0, 100.0))
    before, after = campaign(damper, rng), campaign(scaled(damper, T0_N=1.2), rng)
    moving = replace(after[0], name="steps", voltage=np.where(after[0].time % 1.7 < 0.8, 0.0, 100.0))
    changes = found(before, [*after, moving])
    assert names(changes) == ["T0"]
    assert "1 test of aged left out: the control signal moves in " in changes.reason
    assert "left out" not in found(before, after).reason


@pytest.mark.parametrize("equal", [True, False])
@pytest.mark.parametrize(("factor", "verdict"), [(1.0, "unchanged"), (0.9, "unexplained")])
def test_what_changed_at_one_control_signal_and_temperature_alone_is_not_called_unchanged(
    equal: bool, factor: float, verdict: str, rng: np.random.Generator
) -> None:
    """Over all tests it is too little to be seen, and neither T0, C nor k changed so at all temperatures."""
    conditions = [
        (BaseRow(voltage_V=u, T0_N=150.0 + 9.0 * u, C_Ns_per_m=(1700.0 + 6.0 * u) * warm, k_N_per_m=4e5), degC)
        for degC, warm in ((20.0, 1.0), (50.0, 0.7))
        for u in (0.0, 40.0, 80.0, 120.0)
    ]

    def tests(factor: float, motions: Iterable[tuple[float, float]]) -> list[Record]:
        made = []
        for row, degC in conditions:
            own = factor if (row.voltage_V, degC) == (120.0, 50.0) else 1.0
            damper = scaled(Damper(base=(row,)), C_Ns_per_m=own)
            for record in campaign(damper, rng, motions, 0.0, 0.001):
                warm = np.full(record.time.size, degC)
                made.append(replace(record, name=f"{record.name}-{degC:g}degC", temperature=warm))
        return made

    motions = ((0.5, 0.02), (2.0, 0.02))
    changes = found(tests(1.0, motions), tests(factor, motions if equal else ((0.8, 0.018), (1.7, 0.021))))
    assert changes.verdict == verdict
    assert ("at 120 V and 50 degC" in changes.reason) == (factor != 1.0)
    assert ("C" in {each.name for each in changes.unchanged}) == (factor == 1.0)


def test_a_thinner_oil_changes_every_number_of_the_knee_law_and_leaves_seal_and_gas(rng: np.random.Generator) -> None:
    row = BaseRow(T0_N=25.0, C_Ns_per_m=2200.0, k_N_per_m=3.8e6)
    law = {"beta": 0.33, "F_reb": 500.0, "C_reb": 800.0, "F_comp": 350.0, "C_comp": 450.0}
    beside = {"preload_offset": {"F_0": -180.0}, "gas_spring": {"k_g": 1500.0}}
    thinner = {name: value * (1.0 if name == "beta" else 0.88) for name, value in law.items()}
    thin = row.model_copy(update={"C_Ns_per_m": 0.88 * row.C_Ns_per_m})
    before = Damper(base=(row,), effects={"knee": law, **beside})
    after = Damper(base=(thin,), effects={"knee": thinner, **beside})
    changes = found(campaign(before, rng, WIDE), campaign(after, rng, WIDE), IdentifyConfig(law="knee"))
    assert changes.verdict == "changed"
    assert {(c.name, c.parameter) for c in changes.changes} == {
        ("C", "C"), ("knee", "F_reb"), ("knee", "C_reb"), ("knee", "F_comp"), ("knee", "C_comp")
    }  # fmt: skip
    assert all(change.to == pytest.approx(0.88 * change.from_, rel=0.02) for change in changes.changes)
    assert {"T0", "beta", "k_g", "F_0"} <= {each.parameter for each in changes.unchanged}


def test_of_a_law_in_which_one_side_changed_the_other_side_is_as_it_was(rng: np.random.Generator) -> None:
    row = BaseRow(T0_N=25.0, C_Ns_per_m=2200.0, k_N_per_m=3.8e6)
    law = {"beta": 0.33, "F_reb": 500.0, "C_reb": 800.0, "F_comp": 350.0, "C_comp": 450.0}
    shim = {**law, "F_comp": 280.0, "C_comp": 380.0}
    before, after = (campaign(Damper(base=(row,), effects={"knee": own}), rng, WIDE) for own in (law, shim))
    changes = found(before, after, IdentifyConfig(law="knee"))
    assert {(c.name, c.parameter) for c in changes.changes} == {("knee", "F_comp"), ("knee", "C_comp")}
    still = {each.parameter for each in changes.unchanged if each.name == "knee"}
    assert still == {"beta", "F_reb", "C_reb", "q_reb", "q_comp", "s_reb", "s_comp"}


def test_a_gas_that_grew_is_told_with_the_gas_that_was_there(rng: np.random.Generator) -> None:
    """A constant and a stiffness that come newly beside an accumulator are no gas where there was none."""
    row = BaseRow(T0_N=60.0, C_Ns_per_m=1500.0, k_N_per_m=8e5)
    gas = Damper(base=(row,), effects={"accumulator": {"F_g": 150.0, "L": 0.22}})
    grown = {**gas.effects, "preload_offset": {"F_0": -60.0}, "gas_spring": {"k_g": 360.0}}
    first, second = (
        state_of(name, [sine(damper, None, f, x, rng, 0.001, 0.0) for f, x in MOTIONS])
        for name, damper in (("new", gas), ("aged", gas.model_copy(update={"effects": grown})))
    )
    changes = changes_between(replace(first, damper=gas), second, DiagnoseConfig(), IdentifyConfig(), Control()).changes
    assert set(names(changes)) == {"preload_offset", "gas_spring"}
    assert "preload_offset and gas_spring add to the gas of new, an accumulator with F_g = 150 N" in changes.reason


def change(name: str, low: float, parameter: str = "", share: float = 0.5) -> Change:
    return Change(name=name, parameter=parameter or name, of="damper", unit="N", from_=100.0, to=90.0, low95=low,
                  high95=105.0 if low < 100.0 else 120.0, share=share, reason="")  # fmt: skip


def test_what_the_tests_do_not_determine_is_not_as_it_was() -> None:
    """An interval over seven decades stood under `unchanged`, since it held what was before."""
    assert is_determined(change("knee", 80.0))
    assert not is_determined(change("knee", 0.05))


def test_a_little_change_is_believed_where_its_interval_leaves_out_what_was() -> None:
    """A gain of 4 (-18 to 10) % of no part of the difference was told as what the stand had done."""
    assert is_little([change("C", 80.0, share=0.01)], "C")
    assert not is_little([change("C", 80.0)], "C")
    unseen = change("knee", 80.0, "F_comp").model_copy(update={"to": None, "low95": None, "high95": None})
    assert may_be_as_before([unseen, change("knee", 80.0, "F_reb")]) == ["knee"]


def test_what_may_be_as_it_was_is_said_to_be_open() -> None:
    """Of a change all of whose intervals hold the first value, and of no other one."""
    assert may_be_as_before([change("C", 80.0), change("T0", 101.0)]) == ["C"]
    law = [change("second_branch", 80.0, "T0_2"), change("second_branch", 101.0, "k_2")]
    assert may_be_as_before(law) == []


JET = {"beta": 0.2, "F_reb": 640.0, "C_reb": 1400.0, "F_comp": 360.0, "C_comp": 840.0, "q_reb": 1.1e5, "q_comp": 5e4}
"""Knees behind bleeds through a jet."""


def test_a_needle_that_was_opened_changes_the_bleed_and_leaves_knees_and_seal(rng: np.random.Generator) -> None:
    row = BaseRow(T0_N=35.0, C_Ns_per_m=1000.0, k_N_per_m=1.5e6)
    opened = {**JET, "q_reb": JET["q_reb"] / 1.3**2, "q_comp": JET["q_comp"] / 1.3**2}
    before, after = (campaign(Damper(base=(row,), effects={"knee": own}), rng, WIDE) for own in (JET, opened))
    changes = found(before, after, IdentifyConfig(law="knee"))
    assert changes.verdict == "changed"
    assert {(c.name, c.parameter) for c in changes.changes} == {("knee", "q_reb"), ("knee", "q_comp")}
    assert all(change.to == pytest.approx(change.from_ / 1.3**2, rel=0.05) for change in changes.changes)
    assert {"T0", "F_reb", "C_reb", "F_comp", "C_comp"} <= {each.parameter for each in changes.unchanged}


@pytest.mark.parametrize("rubs", [16.0, 60.0])
def test_a_seal_that_rubs_less_or_more_changes_t0_and_the_knees_only_by_as_much(
    rubs: float, rng: np.random.Generator
) -> None:
    """It rubs beside the oil at every speed; a T0 that left the force of the knee as it was would end there."""
    row = BaseRow(T0_N=35.0, C_Ns_per_m=2200.0, k_N_per_m=3.8e6)
    law = {"beta": 0.33, "F_reb": 500.0, "C_reb": 800.0, "F_comp": 350.0, "C_comp": 450.0}
    lifted = {**law, "F_reb": 500.0 + rubs - 35.0, "F_comp": 350.0 + rubs - 35.0}
    new = row.model_copy(update={"T0_N": rubs})
    before = campaign(Damper(base=(row,), effects={"knee": law}), rng, WIDE)
    changes = found(
        before, campaign(Damper(base=(new,), effects={"knee": lifted}), rng, WIDE), IdentifyConfig(law="knee")
    )
    assert changes.verdict == "changed"
    (change,) = changes.changes
    assert change.name == "T0"
    assert change.to == pytest.approx(rubs, abs=3.0)


def test_a_state_whose_two_directions_are_exchanged_is_asked_for_its_signs(rng: np.random.Generator) -> None:
    row = BaseRow(T0_N=35.0, C_Ns_per_m=2200.0, k_N_per_m=3.8e6)
    damper = Damper(base=(row,), effects={"knee": JET | {"beta": 0.33}, "preload_offset": {"F_0": -150.0}})
    before, after = (campaign(damper, rng, WIDE) for _ in range(2))
    turned = [replace(r, displacement=-r.displacement, velocity=-r.velocity, force=-r.force) for r in after]
    law = IdentifyConfig(law="knee")
    assert "with rebound and compression of aged exchanged" in found(before, turned, law).reason


def test_the_same_recordings_in_both_states_are_told(rng: np.random.Generator) -> None:
    tests = campaign(drawn_damper(rng), rng)
    changes = found(tests, tests)
    assert changes.verdict == "unchanged"
    assert "the tests of aged are those of new once more" in changes.reason
    assert "exchanged" not in changes.reason


def test_a_needle_of_one_side_changes_the_bleed_of_that_side(rng: np.random.Generator) -> None:
    row = BaseRow(T0_N=35.0, C_Ns_per_m=1000.0, k_N_per_m=1.5e6)
    beta = (0.8 * 1200.0 - 800.0) / (0.8 * 1200.0 + 800.0)  # rebound from 1200 N s/m to four fifths of it
    opened = row.model_copy(update={"C_Ns_per_m": 0.5 * (0.8 * 1200.0 + 800.0)})
    after = Damper(base=(opened,), effects={"knee": JET | {"beta": beta, "q_reb": JET["q_reb"] / 1.3**2}})
    before = campaign(Damper(base=(row,), effects={"knee": JET}), rng, WIDE)
    changes = found(before, campaign(after, rng, WIDE), IdentifyConfig(law="knee"))
    assert changes.verdict == "changed"
    told = {c.parameter: c for c in changes.changes}
    assert {"q_reb"} <= set(told) <= {"C", "beta", "q_reb"}
    assert told["q_reb"].to == pytest.approx(told["q_reb"].from_ / 1.3**2, rel=0.05)
    grown = re.findall(r"([+-][\d.]+) % in rebound and ([+-][\d.]+) % in compression at ([\d.]+) m/s", changes.reason)
    # By hand, of 395 and 1277 N: slow it is softer in rebound alone; fast, where the shims are open, hardly.
    (slow, fast) = (tuple(map(float, each)) for each in grown)
    assert slow == pytest.approx((-34.0, 0.0, 0.052), abs=1.5)
    assert fast == pytest.approx((-2.2, 0.0, 0.524), abs=0.5)


def test_a_friction_that_is_gone_is_none(rng: np.random.Generator) -> None:
    row = BaseRow(T0_N=60.0, C_Ns_per_m=2200.0, k_N_per_m=3.8e6)
    gone = row.model_copy(update={"T0_N": 0.0})
    before, after = (campaign(Damper(base=(each,)), rng, WIDE) for each in (row, gone))
    (change,) = found(before, after).changes
    assert (change.name, change.to, change.low95) == ("T0", 0.0, 0.0)
    assert isinstance(change.high95, float)
    assert change.high95 < 10.0


def shimmed(opens: float, rng: np.random.Generator) -> tuple[Record, ...]:
    """Tests of a race damper whose knees are round, its shims on the rebound side preloaded so much [N].

    Equation: |v| = F / (c sqrt(F + F_l)) + s ln(1 + exp((F - F_o) / F_s)), a jet and the shims beside each other
    """
    force = np.geomspace(1e-3, 5e3, 4000)

    def flow(c: float, opens: float, slope: float) -> np.ndarray:
        return force / (c * np.sqrt(force + 60.0)) + 40.0 / slope * np.logaddexp(0.0, (force - opens) / 40.0)

    made = []
    motions = campaign(Damper(base=(BaseRow(T0_N=1.0, C_Ns_per_m=1.0, k_N_per_m=1e6),)), rng, WIDE)
    for test in motions:
        v, x = test.velocity, test.displacement
        ways = (np.interp(np.abs(v), flow(*own), force) for own in ((300.0, opens, 1400.0), (250.0, 330.0, 1000.0)))
        oil = np.where(v > 0.0, next(ways), -next(ways))
        whole = oil + 40.0 * np.tanh(v / 2e-3) - 290.0 - 600.0 * x
        made.append(replace(test, force=1.003 ** rng.standard_normal() * whole + 3.0 * rng.standard_normal(v.size)))
    return tuple(made)


def test_shims_that_are_preloaded_move_the_knee_of_their_side_however_round_it_is(rng: np.random.Generator) -> None:
    changes = found(shimmed(520.0, rng), shimmed(600.0, rng), IdentifyConfig(law="knee"))
    assert changes.verdict in ("changed", "ambiguous"), changes.reason
    (told,) = (c for c in changes.changes if c.parameter == "F_reb")
    assert 0.5 * 80.0 < told.to - told.from_ < 1.5 * 80.0
    assert not {c.parameter for c in changes.changes} & {"F_comp", "C_comp", "q_comp"}
    assert all(c.of == "damper" for c in changes.changes)
