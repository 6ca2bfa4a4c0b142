"""Effects that look alike: the test that tells them apart does, and what says the same by more numbers is no rival."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from synthetic import TWO, all_but, campaign_of, damper_of, diagnosed, sines

from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.campaign import evidence_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit.least_squares import fit, refit, standard_errors
from pzd.diagnosis.search.acceptance import SelectionStep, distinct, has_come_down_to, rivals_of
from pzd.diagnosis.search.candidates import candidate, converged
from pzd.diagnosis.search.determination import nearly_others
from pzd.diagnosis.search.forward_selection import reweighted, swap_step
from pzd.record import Array, Record

ONE_STROKE = ((0.5, 0.02), (2.0, 0.02))
SEVERAL = ((0.5, 0.005), (0.5, 0.03), (2.0, 0.01), (2.0, 0.03))
TOLD_APART: dict[str, tuple[dict[str, float], tuple[str, ...]]] = {
    "accumulator": ({"F_g": 250.0, "L": 0.08}, ("gas_spring", "preload_offset", "end_stop")),
    "cavitation": ({"d_c": 2e-3, "F_c": 200.0}, ("lash", "asymmetry", "frame_compliance")),
    "frame_compliance": ({"d_f": 2e-3, "F_f": 200.0}, ("lash", "cavitation", "rounded_yield")),
}


@pytest.mark.parametrize("name", TOLD_APART)
def test_tests_of_several_strokes_and_speeds_tell_an_effect_from_its_nearest_neighbours(
    name: str, rng: np.random.Generator
) -> None:
    values, neighbours = TOLD_APART[name]
    records = sines(damper_of(TWO, **{name: values}), rng, TWO, jitter=0.005, tests=SEVERAL, cycles=4, noise=5e-3)
    told = diagnosed(records, forbid=all_but(name, *neighbours)).diagnosis
    assert (told.verdict, told.effects) == ("named", (name,)), told.reason


@pytest.mark.parametrize(
    ("true", "values", "limit"),
    [("gas_spring", {"k_g": 8000.0}, "second_branch"), ("lash", {"delta": 1e-3}, "frame_compliance")],
)
def test_a_law_that_gives_the_same_force_by_more_numbers_is_no_rival(
    true: str, values: dict[str, float], limit: str, rng: np.random.Generator
) -> None:
    """A branch that just slips at the ends of the one stroke is a spring; a mount that gives way at once is a play."""
    records = sines(damper_of(TWO, **{true: values}), rng, TWO, tests=ONE_STROKE)
    whole = evidence_of(campaign_of(records), damper_of(TWO)).whole
    before = fit(whole, (), whole.start())
    chosen, other = (converged(whole, before, candidate(whole, before, library()[effect])) for effect in (true, limit))
    assert chosen.delta_bic < other.delta_bic < 0.9 * chosen.delta_bic
    lenient = DiagnoseConfig(rival_bic=-0.1 * chosen.delta_bic)
    assert rivals_of(chosen, (chosen, other), lenient) == ()
    assert rivals_of(other, (chosen, other), lenient) == (true,)
    # Nor does it take anything of the confidence.
    assert distinct(SelectionStep((chosen, other), true)) == [chosen]
    assert distinct(SelectionStep((other, chosen), limit)) == [other, chosen]


def test_a_gas_that_hardens_no_more_beside_a_spring_is_an_offset(rng: np.random.Generator) -> None:
    """Alone it stands for offset and spring; beside the spring that comes later it has a column of a hundred metres."""
    row = BaseRow(voltage_V=0.0, T0_N=60.0, C_Ns_per_m=1500.0, k_N_per_m=9e5)
    truth = Damper(base=(row,), effects={"preload_offset": {"F_0": -180.0}, "gas_spring": {"k_g": 1600.0}})
    records = sines(truth, rng, (0.0,), tests=((0.5, 0.02), (1.5, 0.02), (3.0, 0.02)), noise=4e-3, cycles=6)
    told = diagnosed(records, forbid=all_but("accumulator", "preload_offset", "gas_spring")).diagnosis
    assert (told.verdict, {*told.effects}) == ("named", {"preload_offset", "gas_spring"}), told.reason


@pytest.mark.parametrize(("pressed", "rivals"), [(8.0, ("lash",)), (200.0, ())])
def test_a_mount_that_gives_way_almost_at_once_may_be_a_play(
    pressed: float, rivals: tuple[str, ...], rng: np.random.Generator
) -> None:
    """Noise of 0.1 % tells them apart; but how a displacement was smoothed rounds the corner of a play as well."""
    truth = damper_of(TWO, frame_compliance={"d_f": 1e-3, "F_f": pressed})
    whole = evidence_of(campaign_of(sines(truth, rng, TWO, tests=SEVERAL, noise=1e-3)), damper_of(TWO)).whole
    before = fit(whole, (), whole.start())
    mount, play = (
        converged(whole, before, candidate(whole, before, library()[effect])) for effect in ("frame_compliance", "lash")
    )
    assert play.delta_bic - mount.delta_bic > DiagnoseConfig().rival_bic
    assert rivals_of(mount, (mount, play), DiagnoseConfig()) == rivals


@pytest.mark.parametrize(("pressed", "kept"), [(0.3, "lash"), (8.0, "frame_compliance")])
def test_a_mount_that_has_come_down_to_a_play_gives_its_place_to_it(
    pressed: float, kept: str, rng: np.random.Generator
) -> None:
    """Though the play may fit a little worse: a smoothed displacement rounds its corner, as a mount's is."""
    truth = damper_of(TWO, frame_compliance={"d_f": 1e-3, "F_f": pressed})
    whole = evidence_of(campaign_of(sines(truth, rng, TWO, tests=SEVERAL, noise=1e-4)), damper_of(TWO)).whole
    before = fit(whole, (), whole.start())
    mount, play = (
        converged(whole, before, candidate(whole, before, library()[effect])) for effect in ("frame_compliance", "lash")
    )
    assert has_come_down_to(mount, play) == (kept == "lash")
    assert not has_come_down_to(play, mount)
    only = DiagnoseConfig(forbid=all_but("lash", "frame_compliance"))
    step, chosen = swap_step(whole, before, mount.effect, mount.fitted, lambda _: None, only, 1)
    assert (chosen.effect, step.chosen) == (kept, kept)
    assert kept == "frame_compliance" or step.rivals == ()


def test_a_mount_that_has_given_way_before_the_oil_bears_may_be_a_play_lined_with_rubber(
    rng: np.random.Generator,
) -> None:
    truth = damper_of(TWO, frame_compliance={"d_f": 1e-3, "F_f": 24.0})
    records = sines(truth, rng, TWO, tests=SEVERAL, noise=1e-3)
    told = diagnosed(records, forbid=all_but("lash", "frame_compliance", "gas_spring")).diagnosis
    assert (told.verdict, told.effects, told.rivals) == ("ambiguous", ("frame_compliance",), ("lash",)), told.reason


PLAY = {"frame_compliance": {"d_f": 4e-4, "F_f": 4.0}}
C_ALONE = {"asymmetry": {"alpha": 0.2}, "preload_offset": {"F_0": -0.2 * 300.0}}


@pytest.mark.parametrize(
    ("effects", "k", "nearly"),
    [
        (PLAY, 2e5, {"frame_compliance": "lash"}),
        # A gas of exponent 1.38 leaves 2.5 % of its force beside one of 1.3, a gas of 1.0 -13 %, a zero anything.
        (
            {"accumulator": {"F_g": 400.0, "L": 0.08}, "preload_offset": {"F_0": 10.0}},
            1e6,
            {"preload_offset": "accumulator"},
        ),
        (
            {"accumulator": {"F_g": 400.0, "L": 0.08}, "preload_offset": {"F_0": -50.0}},
            1e6,
            {"preload_offset": "accumulator"},
        ),
        ({"accumulator": {"F_g": 400.0, "L": 0.08}, "preload_offset": {"F_0": 20.0}}, 1e6, {}),
        ({"accumulator": {"F_g": 400.0, "L": 0.08}, "preload_offset": {"F_0": 400.0}}, 1e6, {}),
        # Half of its way at 400 N: the mount is nearly all that gives.
        ({"frame_compliance": {"d_f": 4e-4, "F_f": 400.0}}, np.inf, {}),
        (C_ALONE, 2e5, {"preload_offset": "viscous_asymmetry"}),
        ({**C_ALONE, "preload_offset": {"F_0": 60.0}}, 2e5, {}),
        ({"preload_offset": {"F_0": 60.0}}, 2e5, {}),
    ],
)
def test_an_effect_is_nearly_another_one_by_its_values_and_what_stands_beside_it(
    effects: dict[str, dict[str, float]], k: float, nearly: dict[str, str]
) -> None:
    row = BaseRow(T0_N=300.0, C_Ns_per_m=2000.0, k_N_per_m=k)
    assert nearly_others(Damper(base=(row,), effects=effects), force=800.0) == nearly


def test_an_offset_that_goes_with_the_friction_may_be_an_asymmetry_of_it(rng: np.random.Generator) -> None:
    """T0 (1 + alpha sign(F)) beside C v: sign(F) T0 alpha sign(F) is a constant, and no gas knows the voltage."""
    damper = damper_of(TWO).with_effect("preload_offset", {"F_0": (0.12 * 301.0, 0.12 * 1325.0), "at_voltage_V": TWO})
    records = sines(damper, rng, TWO, tests=SEVERAL, noise=4e-3)
    told = diagnosed(records, forbid=all_but("preload_offset", "asymmetry", "gas_spring")).diagnosis
    assert (told.verdict, told.effects, told.rivals) == ("ambiguous", ("preload_offset",), ("asymmetry",)), told.reason


def test_a_mount_beside_a_play_may_be_its_faces_that_give(rng: np.random.Generator) -> None:
    damper = damper_of(TWO, lash={"delta": 1.5e-3}, frame_compliance={"d_f": 8e-4, "F_f": 160.0})
    records = sines(damper, rng, TWO, tests=SEVERAL, noise=3e-3, cycles=4)
    told = diagnosed(records, forbid=all_but("lash", "frame_compliance", "cavitation")).diagnosis
    assert told.verdict == "ambiguous", told.reason
    assert "lash" in {*told.effects, *told.rivals}


@pytest.mark.parametrize("name", ["frame_compliance", "cavitation"])
@pytest.mark.parametrize("k", [1e6, np.inf])
def test_a_mount_that_is_nearly_all_that_gives_is_found_however_stiff_the_oil_is(
    name: str, k: float, rng: np.random.Generator
) -> None:
    """Counted by the extension of the oil spring it had no length where 1/k = 0, and was a free play by its numbers."""
    values = {"frame_compliance": {"d_f": 2e-3, "F_f": 500.0}, "cavitation": {"d_c": 2e-3, "F_c": 500.0}}[name]
    truth = Damper(base=tuple(row.model_copy(update={"k_N_per_m": k}) for row in damper_of(TWO).base))
    records = sines(truth.with_effect(name, values), rng, TWO, tests=SEVERAL, noise=3e-3, cycles=4)
    found = diagnosed(records, forbid=all_but(name, "lash", "rounded_yield", "gas_spring"))
    told = found.diagnosis
    assert (told.verdict, told.effects, told.rivals) == ("named", (name,), ()), told.reason
    assert found.damper.effects[name] == pytest.approx(values, rel=0.02)


def test_a_pocket_is_searched_to_the_end_of_its_valley_where_the_weights_change(rng: np.random.Generator) -> None:
    """A stiff pocket shows d_c/s_c before either; nothing else is paid for the rest of the long way along."""
    row = BaseRow(T0_N=263.0, C_Ns_per_m=1473.0, k_N_per_m=1.9e6, voltage_V=0.0)
    truth = Damper(base=(row,), effects={"cavitation": {"d_c": 9.7e-4, "F_c": 1786.0}})
    plain = Damper(base=(row,))
    records = sines(truth, rng, (0.0,), tests=SEVERAL, noise=6e-3, colour=0.0)
    weigh = partial(evidence_of, campaign_of(records))
    evidence = weigh(plain)
    before = refit(evidence.whole, plain.with_effect("cavitation", {"d_c": 0.0043, "F_c": 8000.0}), evaluations=1)
    _, found = reweighted(weigh, evidence, before)
    errors = standard_errors(found)
    for parameter, error in zip(("d_c", "F_c"), errors, strict=True):
        true = truth.effects["cavitation"][parameter]
        assert abs(found.damper.effects["cavitation"][parameter] - true) < 3.5 * error < 0.5 * true


BESIDE: dict[str, dict[str, float]] = {
    "second_branch": {"T0_2": 60.0, "k_2": 3e4},
    "bouc_wen": {"F_h": 80.0, "x_h": 1.5e-3, "sigma": 2.0},
}


@pytest.mark.parametrize("name", BESIDE)
def test_a_branch_is_named_where_alone_it_leaves_nothing(name: str, rng: np.random.Generator) -> None:
    row = BaseRow(voltage_V=0.0, T0_N=80.0, C_Ns_per_m=1500.0, k_N_per_m=1e6)
    truth = Damper(base=(row,), effects={name: BESIDE[name]})
    found = diagnosed(sines(truth, rng, (0.0,), tests=SEVERAL, noise=3e-3, cycles=5, jitter=0.003))
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("named", (name,)), found.diagnosis.reason
    assert found.damper.effects[name] == pytest.approx(BESIDE[name], rel=0.05)


@pytest.mark.ci
def test_a_branch_beside_a_valve_is_named_where_the_two_leave_nothing(rng: np.random.Generator) -> None:
    """The valve alone closes a thirtieth of the gap, and the branch comes in as what predicts."""
    effects = {"relief_valve": {"F_r": 400.0, "C_r": 300.0}, "second_branch": {"T0_2": 60.0, "k_2": 3e4}}
    row = BaseRow(voltage_V=0.0, T0_N=60.0, C_Ns_per_m=1200.0, k_N_per_m=8e5)
    tests = ((0.5, 0.02), (1.0, 0.02), (2.0, 0.02), (3.0, 0.02), (5.0, 0.012))
    records = sines(Damper(base=(row,), effects=effects), rng, (0.0,), tests=tests, noise=3e-3, colour=0.0)
    told = diagnosed(records).diagnosis
    assert (told.verdict, {*told.effects}) == ("named", {*effects}), told.reason


def dahl(record: Record, force: float, stiffness: float) -> Array:
    """Friction of Dahl along a displacement: dF/dx = s (1 - F/F_0 sign(dx)), as no law of the library."""
    finer, found, at = 40, np.zeros(record.time.size), 0.0
    for _ in range(2):  # the first time to settle
        for i, step in enumerate(np.diff(record.displacement) / finer, start=1):
            for _ in range(finer):
                at += stiffness * step * (1.0 - at / force * np.sign(step))
            found[i] = at
    found[0] = found[1]
    return found


def test_a_friction_of_another_shape_is_no_branch(rng: np.random.Generator) -> None:
    row = BaseRow(voltage_V=0.0, T0_N=80.0, C_Ns_per_m=1500.0, k_N_per_m=1e6)
    plain = sines(Damper(base=(row,)), rng, (0.0,), tests=SEVERAL, noise=3e-3, cycles=5, jitter=0.003)
    told = diagnosed([replace(r, force=r.force + dahl(r, 60.0, 4e4)) for r in plain]).diagnosis
    assert told.verdict == "unexplained", told.reason


def test_what_rubber_gives_is_no_gas_spring_of_one_rate(rng: np.random.Generator) -> None:
    """A spring behind a dashpot (Maxwell): a spring and more damping, of another size at each frequency."""
    row = BaseRow(voltage_V=0.0, T0_N=110.0, C_Ns_per_m=170.0, k_N_per_m=6.6e5)
    frequencies, stiffness, relaxation = (0.5, 2.0), 150.0, 0.3
    tests = tuple((f, x) for f in frequencies for x in (0.01, 0.02))
    settings = {"noise": 2e-3, "colour": 0.0, "cycles": 10, "tests": tests}
    only = {"forbid": all_but("gas_spring", "preload_offset")}
    plain = sines(Damper(base=(row,)), rng, (0.0,), **settings)

    def beside(record: Record, f: float) -> Record:
        s = 2.0 * np.pi * f * relaxation
        rubber = stiffness * (s * s * record.displacement + relaxation * record.velocity) / (1.0 + s * s)
        return replace(record, force=record.force + rubber)

    rubber = [beside(record, f) for record, (f, _) in zip(plain, tests, strict=True)]
    told = diagnosed(rubber, **only).diagnosis
    assert told.verdict == "unexplained", told.reason
    assert "k_g of gas_spring differs by" in told.reason
    spring = Damper(base=(row,), effects={"gas_spring": {"k_g": 150.0}})
    told = diagnosed(sines(spring, rng, (0.0,), **settings), **only).diagnosis
    assert (told.verdict, told.effects) == ("named", ("gas_spring",)), told.reason


@pytest.mark.parametrize("alpha", [-0.15, 0.1])
@pytest.mark.parametrize(("true", "parameter"), [("viscous_asymmetry", "alpha_C"), ("asymmetry", "alpha")])
def test_damping_that_differs_between_the_directions_is_told_from_all_that_differs(
    true: str, parameter: str, alpha: float, rng: np.random.Generator
) -> None:
    """Between both lies alpha T0, which at two levels of T0 is no one constant beside the element."""
    records = sines(damper_of(TWO, **{true: {parameter: alpha}}), rng, TWO, tests=SEVERAL, cycles=4, noise=5e-3)
    told = diagnosed(records).diagnosis
    assert (told.verdict, told.effects) == ("named", (true,)), told.reason
    value = told.parameters[true][parameter]
    assert value.value == pytest.approx(alpha, abs=0.005)


@pytest.mark.parametrize("stiffness", [3e5, np.inf])
def test_without_friction_both_kinds_of_asymmetry_are_one(stiffness: float, rng: np.random.Generator) -> None:
    viscous = Damper(base=(BaseRow(T0_N=0.0, C_Ns_per_m=2500.0, k_N_per_m=stiffness),))
    records = sines(viscous.with_effect("asymmetry", {"alpha": 0.15}), rng, (0.0,), tests=SEVERAL, cycles=4, noise=5e-3)
    told = diagnosed(records).diagnosis
    assert (told.verdict, told.effects, told.rivals) == ("named", ("asymmetry",), ()), told.reason


def test_beside_a_constant_force_one_friction_leaves_open_which_asymmetry_it_is() -> None:
    one, two = damper_of((150.0,)), damper_of(TWO)
    effects = {"viscous_asymmetry": {"alpha_C": 0.2}, "preload_offset": {"F_0": 150.0}}
    assert nearly_others(one.model_copy(update={"effects": effects}), 2000.0)["viscous_asymmetry"] == "asymmetry"
    assert "viscous_asymmetry" not in nearly_others(two.model_copy(update={"effects": effects}), 2000.0)
    del effects["preload_offset"]
    assert nearly_others(one.model_copy(update={"effects": effects}), 2000.0) == {}
