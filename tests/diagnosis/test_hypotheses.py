"""What is left of an unexplained gap is told as the shape that it has, where that predicts whole tests kept back."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from synthetic import TWO, all_but, campaign_of, damper_of, diagnosed, sines

from pzd.artefacts import Diagnosed, Hypotheses, HypothesisRow
from pzd.damper.effect import declared_effect
from pzd.diagnosis.campaign import evidence_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import CrossValidation, cross_validation_of
from pzd.diagnosis.fit.least_squares import fit
from pzd.diagnosis.hypotheses import hypotheses, proposal_of
from pzd.diagnosis.hypotheses.regression import residuals_of
from pzd.diagnosis.hypotheses.shapes import IN_ONE_UNIT, SHAPES, Signals, lagging, play
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.report.diagnosis_text import diagnosis_lines
from pzd.schema.errors import ConfigError

TESTS = ((0.5, 0.03), (1.0, 0.02), (1.0, 0.03), (2.0, 0.02))
Force = Callable[[Record], Array]


def records_with(force: Force, rng: np.random.Generator, jitter: float = 0.0) -> tuple[Record, ...]:
    """Tests at two voltages of a damper beside which another force acts."""
    plain = sines(damper_of(TWO), rng, TWO, tests=TESTS, cycles=4, noise=3e-3, colour=0.5, jitter=jitter)
    return tuple(replace(r, force=r.force + force(r)) for r in plain)


def fitted(records: tuple[Record, ...]) -> CrossValidation:
    """The tests, dealt into folds, and the plain damper fitted to them."""
    campaign = campaign_of(records)
    evidence = evidence_of(campaign, damper_of(TWO))
    plain = fit(evidence.whole, (), evidence.whole.start()).damper
    return cross_validation_of(campaign, plain, DiagnoseConfig().visible)


def told(records: tuple[Record, ...]) -> Hypotheses:
    """The hypotheses on what the plain damper, fitted to the records, leaves of them."""
    validation = fitted(records)
    return hypotheses(validation, validation.baseline, Control())


FORCES: dict[str, tuple[Force, float]] = {
    "|x| v": (lambda r: 15000.0 * np.abs(r.displacement) * r.velocity, 15000.0),
    "x v": (lambda r: -9000.0 * r.displacement * r.velocity, -9000.0),
    "x^2": (lambda r: 1.5e5 * r.displacement**2, 1.5e5),
    "x sign v": (lambda r: 2500.0 * r.displacement * np.tanh(r.velocity / 0.002), 2500.0),
    "sin 2 pi x/lambda": (lambda r: 60.0 * np.sin(2.0 * np.pi * r.displacement / 0.012), 60.0),
    "(x behind a play)/r": (lambda r: 80.0 * play(r.displacement, 0.009) / 0.009, 80.0),
}


IN_THE_GATE = ("|x| v", "x^2", "(x behind a play)/r")
"""One that needs the velocity, one that does not, and one that remembers."""


@pytest.mark.parametrize(
    "shape", [shape if shape in IN_THE_GATE else pytest.param(shape, marks=pytest.mark.ci) for shape in FORCES]
)
def test_the_shape_of_what_is_left_comes_first_with_its_coefficient_and_its_picture(
    shape: str, rng: np.random.Generator
) -> None:
    force, coefficient = FORCES[shape]
    found = told(records_with(force, rng))
    best = found.alone[0]
    assert best.shape == shape
    assert best.coefficient == pytest.approx(coefficient, rel=0.1)
    assert best.closes > 0.85
    assert best.W_s_after < 0.2 * best.W_s_before
    assert {p.voltage_V for p in found.points} == set(TWO)
    for p in found.points:
        if best.second_coefficient is None:  # a sine has the place of its zero besides
            assert p.fitted_N == pytest.approx(best.coefficient * p.value, rel=1e-6, abs=1e-9)
        assert abs(p.left_N - p.fitted_N) < 6.0


def test_projecting_out_friction_and_damping_does_not_bias_a_coefficient(rng: np.random.Generator) -> None:
    """An orifice is mostly taken up by T0 and C, so that its coefficient does not show in what is left."""
    found = told(records_with(lambda r: 1500.0 * np.abs(r.velocity) * r.velocity, rng))
    orifice = next(row for row in found.alone if row.shape == "|v| v")
    assert orifice.place <= 2
    assert orifice.coefficient == pytest.approx(1500.0, rel=0.1)


def test_a_shape_whose_sign_no_orifice_has_is_not_called_one(rng: np.random.Generator) -> None:
    found = told(records_with(lambda r: -900.0 * np.abs(r.velocity) * r.velocity, rng))
    row = next(row for row in found.alone if row.shape == "|v| v")
    assert row.coefficient < 0.0
    assert row.library is None
    assert "as a valve gives that opens" in row.physics


def test_gain_offset_and_delay_of_a_test_are_projected_out(rng: np.random.Generator) -> None:
    """By their priors: a gain of 2 % counts as one square of noise, however many samples show it."""
    validation = fitted(records_with(lambda r: np.zeros(r.time.size), rng))
    test = residuals_of(validation, validation.baseline).tests[0]
    by_own = test.nuisances
    counted = np.diag(test.products(by_own, test.counts)) / test.noise
    assert np.all(counted <= 1.0)
    assert np.all(np.sum(by_own[test.counts] ** 2, axis=0) > 50.0 * test.noise)


@pytest.mark.ci
def test_gains_of_single_tests_hide_no_shape_and_make_none(rng: np.random.Generator) -> None:
    force, coefficient = FORCES["x v"]
    best = told(records_with(force, rng, jitter=0.02)).alone[0]
    assert (best.shape, best.coefficient) == ("x v", pytest.approx(coefficient, rel=0.1))
    assert told(records_with(lambda r: np.zeros(r.time.size), rng, jitter=0.02)).rows == ()


def test_noise_has_no_shape(rng: np.random.Generator) -> None:
    found = told(records_with(lambda r: np.zeros(r.time.size), rng))
    assert (found.sought, found.rows, found.points) == (True, (), ())


def test_a_shape_of_a_single_test_predicts_no_other_and_is_not_reported(rng: np.random.Generator) -> None:
    def in_one_test(r: Record) -> Array:
        amount = 15000.0 if r.name == "s150V-1Hz-30mm" else 0.0
        return np.asarray(amount * np.abs(r.displacement) * r.velocity)

    records = records_with(in_one_test, rng)
    assert sum(bool(np.any(in_one_test(r))) for r in records) == 1
    assert told(records).rows == ()


@pytest.mark.ci
def test_a_second_shape_is_reported_beside_the_first(rng: np.random.Generator) -> None:
    first, second = FORCES["|x| v"][0], FORCES["x^2"][0]
    found = told(records_with(lambda r: 2.0 * first(r) + second(r), rng))
    best, beside = found.alone[0], found.together[0]
    assert {best.shape, beside.shape} == {"|x| v", "x^2"}
    assert (beside.beside, beside.place) == (best.shape, 2)
    assert beside.closes > max(best.closes, 0.85)
    coefficient = {"|x| v": 2.0 * FORCES["|x| v"][1], "x^2": FORCES["x^2"][1]}[beside.shape]
    assert beside.coefficient == pytest.approx(coefficient, rel=0.1)


@pytest.fixture(scope="module")
def bypass_records(generator_for: Callable[[str], np.random.Generator]) -> tuple[Record, ...]:
    """Tests of a damper whose damping depends on position."""
    return records_with(FORCES["|x| v"][0], generator_for("test_hypotheses.py::bypass"))


@pytest.fixture(scope="module")
def bypass(bypass_records: tuple[Record, ...]) -> Diagnosed:
    """Their whole diagnosis, with one effect of the library to choose from."""
    return diagnosed(bypass_records, forbid=all_but("gas_spring"))


@pytest.mark.ci
def test_a_hypothesis_leaves_the_adopted_damper_unchanged(
    bypass: Diagnosed, bypass_records: tuple[Record, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pzd.diagnosis.workflow.hypotheses", lambda *_: Hypotheses())
    without = diagnosed(bypass_records, forbid=all_but("gas_spring"))
    for name, one in (("with", bypass), ("without", without)):
        (tmp_path / name).mkdir()
        one.write(tmp_path / name, Control())
    files = {path.name for path in (tmp_path / "without").iterdir()}
    assert files == {"diagnosis.json", "damper.yaml", "plain.yaml", "parameters.csv"}
    assert {path.name for path in (tmp_path / "with").iterdir()} - files == {"hypotheses.csv", "hypothesis.csv"}
    for name in files:
        assert (tmp_path / "with" / name).read_bytes() == (tmp_path / "without" / name).read_bytes()


def test_an_unexplained_verdict_tells_its_hypothesis_and_reads_it_back(bypass: Diagnosed, tmp_path: Path) -> None:
    assert bypass.diagnosis.verdict == "unexplained"
    bypass.write(tmp_path, Control())
    back = Diagnosed.read(tmp_path, Control())
    assert back.hypotheses == bypass.hypotheses
    lines = diagnosis_lines(back.diagnosis, Control(), hypotheses=back.hypotheses)
    (line,) = (line for line in lines if line.startswith("hypothesis: "))
    assert line.startswith("hypothesis: c |x| v, c = 1")
    assert "of the gap on tests kept back; damping that depends on position" in line


def row(shape: str, **changes: object) -> HypothesisRow:
    of = next((s for s in SHAPES if s.name == shape.removeprefix("U ")), SHAPES[0])
    usual: dict[str, object] = {
        "place": 1,
        "shape": shape,
        "beside": None,
        "coefficient": -3.5,
        "coefficient_low95": -4.0,
        "coefficient_high95": -3.0,
        "unit": of.unit,
        "second_coefficient": None,
        "parameter": of.parameter,
        "parameter_value": 0.012 if of.parameter else None,
        "parameter_unit": of.parameter_unit or None,
        "width_m": 0.009 if of.width else None,
        "closes": 0.9,
        "standard_errors": 4.0,
        "W_s_before": 0.002,
        "W_s_after": 0.0002,
        "physics": of.physics,
        "library": " or ".join(of.library) or None,
        "source": of.source,
    }
    return HypothesisRow.model_validate({**usual, **changes})


def loaded(name: str, text: str) -> ModuleType:
    module = ModuleType(name)
    exec(compile(text, f"{name}.py", "exec"), vars(module))  # the file that was proposed, as it stands
    return module


@pytest.mark.parametrize("shape", [s.name for s in SHAPES if s.law and not s.library])
def test_a_proposed_effect_file_keeps_to_the_rules_and_gives_the_force_of_its_shape(shape: str) -> None:
    of = next(s for s in SHAPES if s.name == shape)
    second = {"second_coefficient": 2.0} if shape.startswith("sin") else {}
    proposal = proposal_of([row(shape, **second)], "runs/bypass", 150.0)
    module = loaded(proposal.name, proposal.text)
    effect = declared_effect(module)
    assert effect.name == proposal.name
    assert effect.name.isidentifier()
    ((given, expected),) = effect.tests
    assert module.law(**given) == pytest.approx(expected, rel=1e-12)
    x, v, a = (given.get(name, 0.0) for name in ("x", "v", "a"))
    if of.parameter is None:
        hand = {"|x|": abs(x), "|v|": abs(v), "|a|": abs(a), "x": x, "v": v, "a": a, "x^2": x * x, "sign": 1.0}
        words = [word for word in shape.split() if word != "sign"]
        factors = [math.copysign(1.0, v) if shape.endswith("sign v") and w == "v" else hand.get(w) for w in words]
        known = [f for f in factors if f is not None]
        if len(known) == len(words):
            assert expected == pytest.approx(-3.5 * math.prod(known), rel=1e-12)


def test_what_the_library_has_or_no_effect_file_can_hold_is_passed_over_with_the_reason() -> None:
    rows = [row("x"), row("|F| F", place=2), row("|x| v", place=3)]
    proposal = proposal_of(rows, "runs/bypass", 150.0)
    assert proposal.name == "abs_x_v"
    assert "gas_spring of the library" in proposal.passed_over[0]
    assert "no function of x, v and a" in proposal.passed_over[1]
    with pytest.raises(ConfigError, match="no hypothesis that an effect file can hold"):
        proposal_of(rows[:2], "runs/bypass", 150.0)


def test_a_shape_that_goes_with_the_control_signal_is_looked_for_by_voltage() -> None:
    proposal = proposal_of(
        [row("U |x| v", coefficient=100.0, coefficient_low95=90.0, coefficient_high95=110.0)], "r", 150.0
    )
    (parameter,) = declared_effect(loaded(proposal.name, proposal.text)).parameters
    assert parameter.with_friction
    assert parameter.search.scale(None) * parameter.search.starts[0] == pytest.approx(100.0 * 150.0)  # type: ignore[arg-type]  # it asks for no scales


def test_every_shape_has_a_unit_of_its_own_and_says_what_has_it() -> None:
    names = [shape.name for shape in SHAPES]
    assert len(set(names)) == len(names)
    assert all(shape.unit in IN_ONE_UNIT and shape.physics and shape.source for shape in SHAPES)


def test_a_play_follows_the_rod_once_it_is_taken_up() -> None:
    x = np.concatenate([np.linspace(0.0, 0.03, 300), np.linspace(0.03, 0.0, 300)])
    ahead = play(x, 0.01)
    assert np.max(np.abs(ahead)) == pytest.approx(0.01)
    assert ahead[150] == pytest.approx(0.01)
    assert ahead[-1] == pytest.approx(-0.01)
    assert np.all(np.abs(np.diff(ahead)) <= np.abs(np.diff(x)) + 1e-15)


@pytest.mark.parametrize(("rises", "says"), [(1.0, "closes with the time in a stroke"), (-1.0, "opens with the time")])
def test_a_valve_that_closes_in_a_stroke_has_the_lag_above_zero_and_one_that_opens_below(
    rises: float, says: str
) -> None:
    """Strokes of one speed there and back, whose damping rises or falls from 3000 N s/m over some 30 ms."""
    t = np.arange(2000) / 1000.0
    v = np.where(t % 0.4 < 0.2, 0.1, -0.1)
    x = np.cumsum(v) / 1000.0
    force = (3000.0 - rises * 1000.0 * np.exp(-(t % 0.2) / 0.03)) * v
    zero = np.zeros(t.size)
    signals = Signals(t=t, x=x, v=v, a=zero, F=force, U=zero, T=zero, half_stroke=0.01)
    (lag,) = [shape for shape in SHAPES if shape.columns is lagging]
    column = dict(lag.columns(signals))[0.03]
    coefficient = float(np.linalg.lstsq(np.column_stack([v, column]), force, rcond=None)[0][1])
    assert np.sign(coefficient) == rises
    assert says in lag.physics_of(coefficient)
