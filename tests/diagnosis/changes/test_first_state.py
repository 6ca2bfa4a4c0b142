"""How a change is found that depends on what the first state has, and how sure its size is by what is known of that."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from states import (
    FORCE,
    MOTIONS,
    SPEED,
    STROKE,
    campaign,
    drawn_damper,
    found,
    inside,
    names,
    names_told,
    scaled,
    state_of,
)

from pzd.damper.effect import Scales
from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.changes.candidates import Coordinate, FirstState, candidates, element_of
from pzd.diagnosis.changes.compared_tests import ModelError, comparisons_of
from pzd.diagnosis.changes.comparison import changes_between
from pzd.diagnosis.changes.findings import Findings, findings_between
from pzd.diagnosis.changes.quantities import _values
from pzd.diagnosis.changes.reason import beside_effects
from pzd.diagnosis.changes.regression import Fitted
from pzd.diagnosis.changes.selection import Search, _scaled
from pzd.diagnosis.changes.uncertainty import Uncertainty
from pzd.diagnosis.changes.verdict import changes_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.fit.intervals import LEVEL
from pzd.identification.config import IdentifyConfig
from pzd.quantities import Control
from pzd.record import Array, Record


def findings(rng: np.random.Generator, before: Damper, after: Damper, scatter: float = 0.002) -> Findings:
    states = (
        state_of("new", campaign(before, rng, scatter=scatter)),
        state_of("aged", campaign(after, rng, scatter=scatter)),
    )
    return findings_between(*states, DiagnoseConfig(), IdentifyConfig(), Control())


def through_first_state(found: Findings, fitted: Fitted) -> Array:
    columns = found.search.regression.columns(fitted.coordinates, fitted.values)
    return Uncertainty(found.search, fitted).through_first_state(columns)


@pytest.mark.parametrize("node", [None, 1])
def test_what_a_seal_rubs_and_what_the_flow_has_beside_it_move_alike(node: int | None) -> None:
    """A seal that one level shows and another does not: what is left of it there is T0."""
    rows = (BaseRow(voltage_V=u, T0_N=t, C_Ns_per_m=2000.0, k_N_per_m=1e6) for u, t in ((0.0, 0.0), (1.0, 20.0)))
    knee = {"beta": 0.0, "F_reb": 500.0, "C_reb": 500.0, "F_comp": 500.0, "C_comp": 500.0}
    damper = Damper(base=tuple(rows), effects={"knee": knee})
    damper = damper.with_effect("seal", {"F_s": (30.0, 10.0), "v_s": (1e-3, 1e-3), "at_voltage_V": (0.0, 1.0)})
    first = FirstState(damper, 1500.0, cast("Scales", None), 0.0)
    friction = Coordinate("T0", "T0", "damper", "N", 1.0, node)
    for x in (-1.0, -0.5, 0.2):
        changed = first.changed([friction], [x], None)
        rubs = [float(element_of(changed, voltage, None)[0]) for voltage in (0.0, 1.0)]
        assert rubs == pytest.approx([30.0 * (1.0 + x if node is None else 1.0), 30.0 * (1.0 + x)])


def test_an_exponent_of_the_viscous_force_is_as_open_as_the_damping_itself(rng: np.random.Generator) -> None:
    rows = (BaseRow(voltage_V=0.0, T0_N=0.3 * FORCE, C_Ns_per_m=0.7 * FORCE / SPEED, k_N_per_m=50.0 * FORCE / STROKE),)
    damper = Damper(base=rows)
    damper = damper.with_effect("orifice_quadratic", {"q": 1000.0})
    found = findings(rng, damper, damper.with_effect("shear_thinning", {"n": 0.85}))
    thinning = next(c for c in found.search.candidates if c.name == "shear_thinning")
    fitted = found.search.regression.fit((thinning,), np.array([-0.1]), found.best.scatter)
    known, covariance = Uncertainty(found.search, fitted).of_first_state
    damping = [c.name for c in known].index("C")
    # C w_r ((w/w_r)^n - w/w_r) is in proportion to C, and to 1 - n as long as that is small
    assert through_first_state(found, fitted)[0] == pytest.approx(
        abs(fitted.values[0]) * covariance[damping, damping] ** 0.5, rel=0.3
    )
    offset = next(c for c in found.search.candidates if c.name == "preload_offset")
    beside = found.search.regression.fit((offset,), np.array([0.1]), found.best.scatter)
    assert through_first_state(found, beside)[0] < 1e-3 * abs(beside.values[0])


def test_a_branch_of_another_size_has_the_same_shape(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng)
    found = findings(rng, damper, damper)
    branch = next(c for c in found.search.candidates if c.name == "second_branch")
    start, response = np.array(branch.starts[0]), found.search.regression.response
    smaller = _scaled(branch, start, np.array([0.25, 0.0, 0.0]))
    for one, other in zip(response.of(branch.coordinates, start.tolist()),
                          response.of(branch.coordinates, smaller.tolist()), strict=True):  # fmt: skip
        assert other == pytest.approx(0.25 * one, abs=1e-5 * FORCE)


def test_what_is_newly_there_adds_as_much_at_every_control_signal(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng)
    first = {"q": (500.0, 3000.0), "at_voltage_V": (0.0, 100.0)}
    second = {"q": (2500.0, 5000.0), "at_voltage_V": (0.0, 100.0)}
    effects = [damper.model_copy(update={"effects": {"orifice_quadratic": q}}) for q in (first, second)]
    before, after = (state_of(n, campaign(d, rng)) for n, d in zip(("new", "aged"), effects, strict=True))
    before = replace(before, damper=effects[0])
    changes = changes_between(before, after, DiagnoseConfig(), IdentifyConfig(), Control()).changes
    assert names(changes) == ["orifice_quadratic"]
    change = changes.changes[0]
    assert np.asarray(change.to) - np.asarray(change.from_) == pytest.approx([2000.0, 2000.0], rel=0.1)
    assert np.all(np.asarray(change.low95) <= second["q"])
    assert np.all(np.asarray(change.high95) >= second["q"])


def test_noise_alone_leaves_nothing_as_often_as_something(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng)
    search = findings(rng, damper, damper).search
    left = []
    for _ in range(40):
        noise = tuple(rng.standard_normal(c.variance.size) * np.sqrt(c.variance) for c in search.regression.comparisons)
        left.append(search.left(replace(search.nothing(), residuals=noise)))
    assert np.mean(np.array(left) == 0.0) > 0.4


def test_a_part_that_no_verdict_names_is_asked_last_where_the_first_state_has_it(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng)
    branch = {"T0_2": 0.1 * FORCE, "k_2": 5.0 * FORCE / STROKE}
    both = [
        damper.with_effect("second_branch", branch),
        damper.with_effect("second_branch", {**branch, "T0_2": 0.2 * FORCE}),
    ]
    before, after = (state_of(n, campaign(d, rng)) for n, d in zip(("new", "aged"), both, strict=True))
    before = replace(before, damper=both[0])
    found = findings_between(before, after, DiagnoseConfig(), IdentifyConfig(), Control())
    asked = candidates(found.first, found.comparisons)
    assert all(c.flexible for c in asked if c.name == "second_branch")
    assert not any(c.flexible for c in asked if c.name in ("T0", "C", "k"))
    assert "second_branch" in names_told(changes_of(found))


def test_a_valve_of_which_a_number_does_nothing_is_no_change_and_has_no_such_number(rng: np.random.Generator) -> None:
    """Open from the yield on, it is a smaller C: where it opens moves no force."""
    damper = drawn_damper(rng, (0.0,))
    halved = damper.model_copy(update={"base": (damper.base[0].model_copy(update={"C_Ns_per_m": 500.0}),)})
    found = findings(rng, damper, halved)
    search = found.search
    (valve,) = [c for c in search.candidates if c.name == "relief_valve"]
    opens, slope = valve.coordinates
    start = np.array([opens.low, np.log(500.0 / slope.scale)])
    fitted = search.regression.fit((valve,), start, found.best.scatter)
    assert not search._admissible(fitted, 0.0)
    assert _values(found, [(opens, opens.low, np.inf)])[2:] == (None, None, None)
    assert names(changes_of(found)) == ["C"]


@pytest.mark.parametrize("slope", [0.1, 0.25])
def test_a_valve_that_opens_just_above_the_yield_at_one_level_is_found_and_no_smaller_damping(
    slope: float, rng: np.random.Generator
) -> None:
    """From below the yield, where it opens does nothing, and no search finds the way to where it does."""
    for draw in rng.spawn(2):
        rows = [
            BaseRow(
                voltage_V=volts, T0_N=share * FORCE, C_Ns_per_m=0.4 * FORCE / SPEED, k_N_per_m=100.0 * FORCE / STROKE
            )
            for volts, share in ((0.0, 0.1), (100.0, 0.6))
        ]
        damper = Damper(base=tuple(rows))
        opened = damper.with_effect("relief_valve", {"F_r": 0.62 * FORCE, "C_r": slope * FORCE / SPEED})
        changes = found(campaign(damper, draw), campaign(opened, draw))
        assert names(changes) == ["relief_valve"]
        opens = next(c for c in changes.changes if c.parameter == "F_r")
        assert opens.to == pytest.approx(0.62 * FORCE, rel=0.02)


def test_a_valve_that_acts_at_the_middle_level_of_three_is_no_smaller_damping(rng: np.random.Generator) -> None:
    """At the lowest it stays shut, at the highest it is open from the yield on: a start is needed at each of them."""
    rows = [
        BaseRow(voltage_V=volts, T0_N=share * FORCE, C_Ns_per_m=0.1 * FORCE / SPEED, k_N_per_m=100.0 * FORCE / STROKE)
        for volts, share in ((0.0, 0.17), (100.0, 0.52), (200.0, 0.84))
    ]
    damper = Damper(base=tuple(rows))
    opened = damper.with_effect("relief_valve", {"F_r": 0.56 * FORCE, "C_r": 0.02 * FORCE / SPEED})
    changes = found(campaign(damper, rng), campaign(opened, rng))
    assert names(changes) == ["relief_valve"]
    opens = next(c for c in changes.changes if c.parameter == "F_r")
    assert opens.to == pytest.approx(0.56 * FORCE, rel=0.02)


@pytest.mark.parametrize(("friction", "damping"), [(1.15, 0.9), (1.2, 0.85), (0.85, 1.12)])
def test_more_friction_and_less_damping_are_both_found_though_they_nearly_cancel(
    friction: float, damping: float, rng: np.random.Generator
) -> None:
    """A seal that is worn in and an oil that is thinner: either alone leaves more than neither."""
    row = BaseRow(voltage_V=0.0, T0_N=0.4 * FORCE, C_Ns_per_m=0.6 * FORCE / SPEED, k_N_per_m=100.0 * FORCE / STROKE)
    damper = Damper(base=(row,))
    changes = found(campaign(damper, rng), campaign(scaled(damper, T0_N=friction, C_Ns_per_m=damping), rng))
    assert sorted(names(changes)) == ["C", "T0"]
    assert changes.verdict == "changed"
    for change, factor in zip(sorted(changes.changes, key=lambda c: c.name), (damping, friction), strict=True):
        assert change.to == pytest.approx(factor * change.from_, rel=0.03)


def test_a_smaller_damping_at_one_level_may_be_a_valve_that_opens_at_the_yield(rng: np.random.Generator) -> None:
    """At the other level, where it stays shut, C is the same."""
    rows = [
        BaseRow(voltage_V=volts, T0_N=share * FORCE, C_Ns_per_m=0.4 * FORCE / SPEED, k_N_per_m=100.0 * FORCE / STROKE)
        for volts, share in ((0.0, 0.1), (100.0, 0.6))
    ]
    smaller = (rows[0], rows[1].model_copy(update={"C_Ns_per_m": 0.85 * rows[1].C_Ns_per_m}))
    changes = found(campaign(Damper(base=tuple(rows)), rng), campaign(Damper(base=smaller), rng))
    assert changes.verdict == "ambiguous"
    assert {"C", "relief_valve"} <= names_told(changes)


def test_a_fit_that_is_known_is_of_the_change_that_is_asked_about_last(rng: np.random.Generator) -> None:
    """Whether it is large enough is asked of the last one, in whatever order both were first fitted."""
    damper = drawn_damper(rng, (0.0,))
    search = findings(rng, damper, damper.with_effect("gas_spring", {"k_g": 3000.0})).search
    nothing = search.nothing()
    spring, damping = (next(c for c in search.candidates if c.name == name) for name in ("gas_spring", "C"))
    first = search._fit((spring, damping), np.zeros(2), nothing.scatter)
    again = search._fit((damping, spring), np.zeros(2), nothing.scatter)
    assert (first.candidates, again.candidates) == ((spring, damping), (damping, spring))
    assert again.values.tolist() == first.values[::-1].tolist()
    assert again.bic == first.bic


@pytest.mark.parametrize("correlation", [0.0, 0.6, 0.95])
def test_a_force_without_a_name_moves_two_coordinates_as_far_as_they_are_told_apart(correlation: float) -> None:
    """Equation: 1/sqrt(1 - r^2) of two with correlation r."""
    columns = np.array([[1.0, correlation], [0.0, np.sqrt(1.0 - correlation**2)]]) * [3.0, 0.02]
    comparison = SimpleNamespace(peak=50.0)
    uncertainty = Uncertainty(
        cast("Search", SimpleNamespace(regression=SimpleNamespace(comparisons=(comparison,)))), cast("Fitted", None)
    )
    expected = 1.0 / np.sqrt(1.0 - correlation**2)
    assert uncertainty._told_apart([columns]) == pytest.approx([expected, expected], rel=0.03)


def test_a_valve_that_opens_between_two_starts_of_the_search_promises_what_it_explains(
    rng: np.random.Generator,
) -> None:
    """Its force is no straight line in where it opens, so that from 30 % off it would explain nothing."""
    row = BaseRow(voltage_V=0.0, T0_N=0.1 * FORCE, C_Ns_per_m=0.9 * FORCE / SPEED, k_N_per_m=100.0 * FORCE / STROKE)
    damper = Damper(base=(row,))
    opened = damper.with_effect("relief_valve", {"F_r": 0.4 * FORCE, "C_r": 0.65 * row.C_Ns_per_m})
    search = findings(rng, damper, opened).search
    nothing = search.nothing()
    (valve,) = [c for c in search.candidates if c.name == "relief_valve"]
    size = search.regression.likelihood.size
    (promise,) = search._promising(nothing, [valve], nothing.scatter)
    whitened = [
        W @ r for W, r in zip(search.regression.likelihood.whiteners(nothing.scatter), nothing.residuals, strict=True)
    ]
    assert promise.criterion - 2.0 * np.log(size) < 0.3 * sum(float(r @ r) for r in whitened)


def bypassed(damping: float, rng: np.random.Generator) -> tuple[Record, ...]:
    """Tests of a damper with a groove: less of C about the middle of the stroke, which no law of the library has."""
    row = BaseRow(voltage_V=0.0, T0_N=0.045 * FORCE, C_Ns_per_m=damping, k_N_per_m=100.0 * FORCE / STROKE)
    motions = [(f, 0.025) for f in (0.33, 0.65, 1.0, 1.3, 1.9, 2.6)] + [(3.0, 0.01), (5.0, 0.005)]
    tests = campaign(Damper(base=(row,)), rng, motions, noise=0.005)
    less = [0.36 * damping * np.exp(-((r.displacement / 0.01) ** 2)) * r.velocity for r in tests]
    return tuple(replace(r, force=r.force - f) for r, f in zip(tests, less, strict=True))


def test_a_tenth_less_of_a_damping_that_the_model_knows_in_part_is_no_new_valve(rng: np.random.Generator) -> None:
    """The tenth of what the model misses has the shape of no candidate, and a valve would take it up."""
    for draw in rng.spawn(2):
        changes = found(bypassed(FORCE / SPEED, draw), bypassed(0.9 * FORCE / SPEED, draw))
        assert set(names(changes)) <= {"C"}
        assert "C" in names_told(changes)
        for change in changes.changes:
            assert inside(change, 0.9)


def softly_opening(speed: float, rng: np.random.Generator) -> tuple[Record, ...]:
    """Tests of a damper whose valve opens about a speed, and not at once as that of the library does."""
    row = BaseRow(voltage_V=0.0, T0_N=0.05 * FORCE, C_Ns_per_m=FORCE / SPEED, k_N_per_m=100.0 * FORCE / STROKE)
    tests = campaign(Damper(base=(row,)), rng, [(0.65, 0.025), (1.3, 0.025), (1.9, 0.025), (3.0, 0.02)], noise=0.004)
    width = 0.05 * SPEED
    beyond = [width * np.logaddexp(0.0, (np.abs(r.velocity) - speed) / width) * np.sign(r.velocity) for r in tests]
    return tuple(replace(r, force=r.force - 0.6 * row.C_Ns_per_m * f) for r, f in zip(tests, beyond, strict=True))


def test_a_valve_that_opens_earlier_is_found_though_it_opens_softly(rng: np.random.Generator) -> None:
    """The corner of the library's valve has harmonics that the measured difference has not."""
    changes = found(softly_opening(0.5 * SPEED, rng), softly_opening(0.35 * SPEED, rng))
    assert "relief_valve" in names_told(changes)
    assert changes.verdict in ("changed", "ambiguous")


def outside(damper: Damper, rng: np.random.Generator, motions: tuple[tuple[float, float], ...]) -> list[Record]:
    """Tests of a damper with a law beside it that is not in the library, of a tenth of the peak."""
    records = campaign(damper, rng, motions)
    shape = [200.0 * np.sin(400.0 * r.displacement) * np.tanh(8.0 * r.velocity) for r in records]
    return [replace(r, force=r.force + f) for r, f in zip(records, shape, strict=True)]


def carried(draw: np.random.Generator, motions: tuple[tuple[float, float], ...]) -> list[float]:
    """Mean square that is missed of the first harmonic of motions that were not run before, in squared peaks."""
    damper = drawn_damper(draw, (0.0,))
    before, after = state_of("new", outside(damper, draw, MOTIONS)), state_of("aged", outside(damper, draw, motions))
    never = ModelError(np.inf, np.zeros(1))  # the damper alone says nothing
    compared = comparisons_of(before, after, IdentifyConfig(), DiagnoseConfig().nuisance, never)
    return [float(c.missed[1]) / c.peak**2 for c in compared if c.missed is not None]


def test_the_nearer_the_motion_that_was_run_before_the_less_is_missed(rng: np.random.Generator) -> None:
    """By a linear variogram: in the mean square twice as much at twice the distance, here in frequency."""
    near, far = carried(rng, ((2.0 * np.exp(0.1), 0.02), (2.0 * np.exp(0.2), 0.02)))
    assert far / near == pytest.approx(2.0, rel=0.02)


def test_what_the_model_hides_is_told_by_a_motion_of_the_first_state_run_again(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng, (0.0,))
    states = (
        state_of("new", outside(damper, rng, MOTIONS)),
        state_of("aged", outside(damper, rng, ((1.0, 0.025), (1.3, 0.02)))),
    )
    changes = changes_between(*states, DiagnoseConfig(), IdentifyConfig(), Control()).changes
    assert names(changes) == []
    assert changes.next_test is not None
    assert changes.next_test.waveform.startswith("the motion of 0V-")
    again = state_of("aged", outside(damper, rng, MOTIONS))
    assert changes_between(states[0], again, DiagnoseConfig(), IdentifyConfig(), Control()).changes.next_test is None


def test_the_gas_of_an_accumulator_is_among_what_may_have_changed(rng: np.random.Generator) -> None:
    damper = drawn_damper(rng, (0.0,))
    found = findings(rng, damper, damper.with_effect("accumulator", {"F_g": 60.0, "L": 3.0 * STROKE}))
    assert "accumulator" in names_told(changes_of(found))


@pytest.mark.parametrize("there", [False, True])
def test_a_changed_effect_keeps_to_what_a_diagnosis_searches(there: bool, rng: np.random.Generator) -> None:
    """Gas that is compressed by more of its length than 1/1.5 has the pole of its law within what a car drives."""
    plain = drawn_damper(rng, (0.0,))
    known = {"accumulator": {"F_g": 60.0, "L": 3.0 * STROKE}, "frame_compliance": {"d_f": 1e-3, "F_f": 200.0}}
    before = plain.model_copy(update={"effects": known}) if there else plain
    found = findings(rng, before, plain)
    checked = 0
    for candidate in found.search.candidates:
        effect = library().get(candidate.name)
        for c in candidate.coordinates if effect is not None else ():
            search = effect.parameter(c.parameter).search
            least, most = search.within
            scale = search.scale(found.first.scales)
            ends = (c.start * np.exp(end) if c.logarithmic else c.start + end * c.scale for end in (c.low, c.high))
            if np.isfinite([least, most]).any() and candidate.name in known and c.node is None:
                low, high = (end / scale for end in ends)
                assert least - 1e-9 <= low <= high <= most + 1e-9, c
                checked += 1
    assert checked >= 2


def test_friction_and_damping_are_told_beside_the_effects_that_they_stand_with() -> None:
    def told(effects: dict[str, dict[str, float]], *changed: str) -> list[str]:
        first, before = SimpleNamespace(damper=SimpleNamespace(effects=effects)), SimpleNamespace(name="new")
        return beside_effects(cast("Findings", SimpleNamespace(first=first, before=before)), changed)

    orifice = {"orifice_quadratic": {"q": 2000.0}, "gas_spring": {"k_g": 1000.0}}
    assert told(orifice, "T0", "lash") == ["T0 is that beside orifice_quadratic of new, not that of identify"]
    assert told(orifice, "T0", "C") == ["T0 and C are those beside orifice_quadratic of new, not those of identify"]
    assert told(orifice, "lash") == told({"gas_spring": {"k_g": 1000.0}}, "T0") == told({}, "C") == []


def test_what_has_no_name_leaves_open_what_did_not_change_and_so_does_what_was_too_small(
    rng: np.random.Generator,
) -> None:
    """All that is left may be of C; and T0 may have changed by what nobody sees, which looks like C."""
    damper = drawn_damper(rng, (0.0,))
    found = findings(rng, damper, damper)
    nothing = found.search.nothing()
    (damping,) = [c for c in found.search.candidates if c.name == "C"]
    quiet = Uncertainty(found.search, nothing).if_changed(damping)
    assert quiet.error > quiet.alone
    third = [
        0.01 * c.peak * (np.arange(r.size) == 3) for c, r in zip(found.comparisons, nothing.residuals, strict=True)
    ]
    left = replace(nothing, residuals=tuple(r + t for r, t in zip(nothing.residuals, third, strict=True)))
    loud = Uncertainty(found.search, left).if_changed(damping)
    assert loud.alone * loud.force > 0.9 * 0.01 / LEVEL
    assert loud.alone > quiet.alone


@pytest.mark.parametrize(
    ("effect", "parameter", "share"),
    [
        ("gas_spring", "k_g", 0.08),
        ("fluid_inertia", "m", 0.08),
        ("lash", "delta", 0.03),
        ("orifice_quadratic", "q", 0.1),
    ],
)
def test_an_effect_that_is_gone_ends_at_none_whatever_the_noise(
    effect: str, parameter: str, share: float, rng: np.random.Generator
) -> None:
    """A hair below it, where half of all noise puts the fit, nature has no value, and that was no change at all."""
    scale = {"k_g": FORCE / STROKE, "m": FORCE / 5.0, "delta": STROKE, "q": FORCE / SPEED**2}[parameter]
    for draw in rng.spawn(6):
        plain = drawn_damper(draw, voltages=(0.0,))
        damper = plain.with_effect(effect, {parameter: share * scale})
        before, after = (state_of(name, campaign(d, draw)) for name, d in (("new", damper), ("aged", plain)))
        known = replace(before, damper=damper)
        changes = changes_between(known, after, DiagnoseConfig(), IdentifyConfig(), Control()).changes
        assert effect in names_told(changes), changes.reason
        assert changes.verdict in ("changed", "ambiguous"), changes.reason
        gone = [change for change in changes.changes if change.name == effect]
        assert all(abs(change.to) <= max(change.high95 - change.to, 1e-9) for change in gone)
