"""Published models are fitted and compared on the tests that diagnose keeps back, and on nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from synthetic import TWO, damper_of, sine, waveform

from pzd.damper.compose import respond
from pzd.damper.effects.bouc_wen import hysteresis_after
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.campaign import Campaign
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import assign_folds, cross_validation_of
from pzd.diagnosis.peer_comparison import HeldOutTests, PeerData, PeerFit, between_voltages, fit_peer
from pzd.diagnosis.peers import Peer, PeerForm, StrokeMotion, peers
from pzd.diagnosis.roles import split
from pzd.fit.cross_validation import PredictionError
from pzd.record import Array, Record
from pzd.signals.nuisance import NuisanceConfig

KWOK, BOUC_WEN = peers()["kwok"], peers()["bouc_wen"]
FORMS = [(peer, form) for peer in peers().values() for form in peer.forms]
TRUE = {"kwok": (1500.0, 800.0, 500.0, 40.0, 90.0, 0.6), "bouc_wen": (1500.0, 800.0, 500.0, 40.0, 900.0, 3.0)}
"""Of a small magneto-rheological damper."""
TESTS = ((0.5, 0.02), (1.0, 0.008), (2.0, 0.02))
THREE = (0.0, 50.0, 100.0)

each_form = pytest.mark.parametrize(
    ("peer", "form"), FORMS, ids=[f"{peer.name} {form.label}".strip() for peer, form in FORMS]
)


def motion(frequency: float, amplitude: float, cycles: int = 3, rate: float = 400.0) -> StrokeMotion:
    """A sine whose first cycle is there for a state to settle."""
    time = np.arange(0.0, (cycles + 1) / frequency, 1.0 / rate)
    x, v, _ = waveform(time, frequency, amplitude)
    return StrokeMotion(x, v, 1.0 / rate, round(rate / frequency))


def own_tests(peer: Peer, form: PeerForm, parameters: Array) -> list[PeerData]:
    """Tests of which the force is the peer's own."""
    found = []
    for frequency, amplitude in TESTS:
        moved = motion(frequency, amplitude)
        force = peer.force(form, moved, parameters)
        found.append(PeerData(moved, force, np.ones(force.size, dtype=np.bool_)))
    return found


# ---------------------------------------------------------------- the models


@each_form
def test_a_peer_finds_its_own_parameters_in_its_own_force(peer: Peer, form: PeerForm) -> None:
    true = np.array(TRUE[peer.name])
    found = fit_peer(peer, form, own_tests(peer, form, true))
    assert found.status == "converged"
    assert found.parameters == pytest.approx(true, rel=1e-3)
    assert found.error < 1e-8 * sum(float(t.force @ t.force) for t in own_tests(peer, form, true))


def test_the_loop_of_kwok_is_as_wide_as_delta_says_and_saturates_at_alpha() -> None:
    c, k, alpha, f0, _, delta = TRUE["kwok"]
    x = np.array([0.01, -0.01, 0.01, -0.01])
    v = np.array([0.0, 0.0, 2.0, -2.0])
    force = KWOK.force(KWOK.forms[0], StrokeMotion(x, v, 1e-3), np.array(TRUE["kwok"]))
    assert force[:2] == pytest.approx([f0 + s * (k * 0.01 + alpha * np.tanh(delta)) for s in (1, -1)])
    assert force[2:] == pytest.approx([f0 + s * (k * 0.01 + c * 2.0 + alpha) for s in (1, -1)])


@pytest.mark.parametrize("n", [1, 2])
@pytest.mark.parametrize("sigma", [0.5, 1.0, 4.0])
def test_the_hysteresis_is_that_of_bouc_and_wen_up_to_its_ultimate_force(n: int, sigma: float) -> None:
    """Held to the equation as Wen states it, A, beta and gamma free, by a solver that knows no closed form."""
    A, total = 1.7, 3.0e4 if n == 2 else 300.0
    gamma, beta = sigma * total, (1.0 - sigma) * total
    ultimate = (A / (beta + gamma)) ** (1.0 / n)
    frequency, amplitude = 1.0, 0.02
    w = 2.0 * np.pi * frequency

    def rate(t: float, z: Array) -> Array:
        v = amplitude * w * np.cos(w * t)
        return np.asarray(A * v - gamma * abs(v) * abs(z) ** (n - 1) * z - beta * v * abs(z) ** n)

    time = np.arange(0.0, 2.0, 1e-3)
    solved = solve_ivp(rate, (0.0, 2.0), [0.0], t_eval=time, rtol=1e-10, atol=1e-12 * ultimate, max_step=2e-3)
    x, v, _ = waveform(time, frequency, amplitude)
    form = next(form for form in BOUC_WEN.forms if form.label == f"n = {n}")
    z = form.columns(StrokeMotion(x, v, 1e-3), np.array([A / ultimate, sigma]))[:, 2]
    assert ultimate * z == pytest.approx(solved.y[0], abs=1e-4 * ultimate)
    assert np.max(z) == pytest.approx(1.0, abs=1e-2)
    assert hysteresis_after(0.0, 1.0, A / ultimate, sigma, n) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("form", BOUC_WEN.forms, ids=lambda form: form.label)
def test_the_hysteresis_knows_the_way_and_not_the_speed(form: PeerForm) -> None:
    slow, shape = motion(0.5, 0.01), np.array([400.0, 2.0])
    fast = replace(slow, velocity=10.0 * slow.velocity, step=0.1 * slow.step)
    assert form.columns(fast, shape)[:, 2] == pytest.approx(form.columns(slow, shape)[:, 2], abs=1e-12)


@pytest.mark.parametrize("form", BOUC_WEN.forms, ids=lambda form: form.label)
@pytest.mark.parametrize("sigma", [0.5, 1.0, 30.0])
def test_a_closed_loop_of_the_hysteresis_takes_up_energy(form: PeerForm, sigma: float) -> None:
    moved = motion(1.0, 0.01, cycles=1)
    z = form.columns(moved, np.array([300.0, sigma]))[:, 2]
    work = float(np.trapezoid(z, moved.displacement[moved.settling :]))
    assert 0.0 < work <= 4.0 * 0.01  # that of a dry friction of 1 N


def test_parameters_are_linear_between_voltages_and_constant_beyond() -> None:
    fits = {U: PeerFit(np.array([U, 10.0 - U]), 0.0, "converged") for U in (1.0, 3.0)}
    assert between_voltages(fits, 2.5) == pytest.approx([2.5, 7.5])
    assert between_voltages(fits, 9.0) == pytest.approx([3.0, 7.0])


# ---------------------------------------------------------------- the comparison


def kept_back_tests(records: Sequence[Record], voltages: Sequence[float] = TWO) -> HeldOutTests:
    cleaned = clean(records)
    return HeldOutTests(cleaned, assign_folds(cleaned, damper_of(voltages)))


def test_no_peer_is_fitted_to_a_held_out_test(rng: np.random.Generator) -> None:
    records = [sine(damper_of(TWO), U, f, x, rng, cycles=3, rate=200.0) for U in TWO for f, x in TESTS]
    other = [replace(records[0], force=-3.0 * records[0].force), *records[1:]]
    before, after = kept_back_tests(records), kept_back_tests(other)
    (fold,) = (fold for fold in before.folds.folds if fold[0].any())
    form = KWOK.forms[0]
    for group in range(len(TWO)):
        same = before.fitted(KWOK, form, group, fold).parameters
        assert after.fitted(KWOK, form, group, fold).parameters == pytest.approx(same, rel=1e-12)
    seen = before.fitted(KWOK, form, 0, before.folds.no_samples).parameters
    assert after.fitted(KWOK, form, 0, after.folds.no_samples).parameters != pytest.approx(seen, rel=0.1)


def peer_records(form: PeerForm, at: dict[float, Array], rng: np.random.Generator) -> list[Record]:
    """Tests of a damper that is a Bouc-Wen element, without noise."""
    found = []
    for U, parameters in at.items():
        for frequency, amplitude in TESTS:
            plain = sine(damper_of(), U, frequency, amplitude, rng, noise=0.0, cycles=4, rate=200.0)
            moved = StrokeMotion(plain.displacement, plain.velocity, 1.0 / plain.rate)
            found.append(replace(plain, force=BOUC_WEN.force(form, moved, parameters)))
    return found


def test_a_voltage_left_out_is_predicted_by_the_line_between_its_neighbours(rng: np.random.Generator) -> None:
    """A Bouc-Wen damper whose parameters are linear in the voltage; the form it has is found, too."""
    low, high = np.array(TRUE["bouc_wen"]), np.array([3000.0, 500.0, 900.0, 30.0, 600.0, 2.0])
    at = {U: low + U / 100.0 * (high - low) for U in THREE}
    tests = kept_back_tests(peer_records(BOUC_WEN.forms[1], at, rng), THREE)
    left_out = tests.interpolation_error(tests.law(BOUC_WEN), 1)
    form, _ = tests.best_form(BOUC_WEN, tests.folds.no_samples, range(3))
    assert form.label == "n = 2"
    assert left_out.records == tests.groups[1][1]
    assert left_out.criterion == pytest.approx(0.0, abs=1e-5)
    assert left_out.determination == pytest.approx(1.0, abs=1e-5)


def irregular(damper: Damper, voltage: float) -> Record:
    """A test that does not repeat: its ends are not judged."""
    time = np.arange(1200) / 200.0
    parts = [waveform(time, frequency, amplitude) for frequency, amplitude in ((0.5, 0.015), (1.37, 0.007))]
    x, v, a = (np.sum(channel, axis=0) for channel in zip(*parts, strict=True))
    U = np.full(time.size, voltage)
    return Record("irregular", None, time, x, v, a, respond(damper, Motion(time, x, v, a, U)), U)


def test_the_samples_compared_are_those_of_the_diagnosis(rng: np.random.Generator) -> None:
    """W_s and R2 of all tests together follow from the W_s of each, as diagnosis.json holds it."""
    damper = damper_of(TWO, preload_offset={"F_0": 80.0})
    records = [sine(damper, U, f, x, rng, cycles=3, rate=200.0) for U in TWO for f, x in TESTS]
    records.append(irregular(damper, TWO[0]))
    cleaned, plain = clean(records), damper_of(TWO)
    campaign = Campaign(cleaned, split(cleaned, None, 2.0), NuisanceConfig())
    validation = cross_validation_of(campaign, plain, DiagnoseConfig().visible)
    missed = validation.baseline_error()
    prediction = validation.prediction(missed, missed, validation.baseline_interpolation_error)
    assert prediction is not None
    W_s = {each.record: each.W_s_plain for each in prediction.by}
    R2 = {each.record: each.R2_plain for each in prediction.by}
    tests = HeldOutTests(cleaned, assign_folds(cleaned, plain))
    assert any(p.lead is None for p in cleaned)
    known = tests.known_error({i: W_s[p.record.name] for i, p in enumerate(cleaned)})
    assert known.criterion == pytest.approx(prediction.W_s_plain, rel=1e-9)
    assert [known.of_records([i]).determination for i in range(len(cleaned))] == pytest.approx(
        [R2[p.record.name] for p in cleaned], rel=1e-9
    )


def test_the_share_explained_is_1_of_a_perfect_prediction_and_0_of_the_mean_force(rng: np.random.Generator) -> None:
    force = 3.0 + rng.standard_normal(500)
    squares = float(force @ force), float(np.sum((force - force.mean()) ** 2))

    def missed(predicted: Array) -> PredictionError:
        residual = force - predicted
        return PredictionError((0,), *(np.array([value]) for value in (residual @ residual, *squares, 0.0)))

    assert missed(force).determination == 1.0
    assert missed(np.full(500, force.mean())).determination == pytest.approx(0.0, abs=1e-12)
    assert missed(np.zeros(500)).criterion == pytest.approx(1.0)
