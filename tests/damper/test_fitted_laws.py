"""The knee law, bleed, knee and blow-off of each direction, and its seal: known to the damper, not to the library."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from pzd.damper.compiled.columns import STROKE_AND_FLOW
from pzd.damper.compiled.kernels import K
from pzd.damper.compose import respond, steady_force
from pzd.damper.confounders import confounders, known, module_of
from pzd.damper.effect import arguments, functions
from pzd.damper.effects import library
from pzd.damper.fitted_laws import fitted_laws
from pzd.damper.fitted_laws.knee import NO_KNEE
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import constant_rows
from pzd.damper.path import Variables, march, march_sensitivities
from pzd.diagnosis.config import DiagnoseConfig

TIME = np.arange(1500) * 1e-3
PLAIN = Damper(base=(BaseRow(T0_N=35.0, C_Ns_per_m=2000.0, k_N_per_m=3e6),))
KNEE = {"beta": 0.4, "F_reb": 250.0, "C_reb": 600.0, "F_comp": 120.0, "C_comp": 350.0}
MIRRORED = {"beta": -0.4, "F_reb": 120.0, "C_reb": 350.0, "F_comp": 250.0, "C_comp": 600.0}


def motion(sign: float = 1.0) -> Motion:
    """A swing that is not symmetric, so that no direction stands for the other."""
    w = 2.0 * np.pi * np.array([[1.5], [4.0]])
    size = sign * np.array([[0.02], [0.004]])
    x, v, a = (
        (size * part).sum(axis=0) for part in (np.sin(w * TIME), w * np.cos(w * TIME), -(w**2) * np.sin(w * TIME))
    )
    return Motion(TIME, x, v, a)


def test_a_fitted_law_is_no_effect_of_the_library_and_a_config_cannot_force_it() -> None:
    assert set(known()) == {*library(), *confounders(), *fitted_laws()}
    assert not set(fitted_laws()) & {*library(), *confounders()}
    with pytest.raises(ValueError, match="no effect is called"):
        DiagnoseConfig(force=("knee",))


@pytest.mark.parametrize("name", fitted_laws())
def test_a_fitted_law_gives_its_reference_numbers(name: str) -> None:
    effect = fitted_laws()[name]
    laws = functions(effect, module_of(effect)).values()
    for given, expected in effect.tests:
        law = next(law for law in laws if set(arguments(law)) == set(given))  # a force stands before its slope
        assert law(**given) == pytest.approx(expected, rel=1e-12)


def test_the_steady_force_is_bleed_up_to_the_knee_and_blow_off_beyond_it_in_each_direction() -> None:
    damper, speeds = PLAIN.with_effect("knee", KNEE), np.array([0.02, 0.07, 0.3])
    knee = (250.0 - 35.0) / (1.4 * 2000.0)
    rebound = 35.0 + 2800.0 * np.minimum(speeds, knee) + 600.0 * np.maximum(speeds - knee, 0.0)
    np.testing.assert_allclose(steady_force(damper, None, None, speeds), rebound, rtol=1e-12)
    knee = (120.0 - 35.0) / (0.6 * 2000.0)
    compression = 35.0 + 1200.0 * np.minimum(speeds, knee) + 350.0 * np.maximum(speeds - knee, 0.0)
    np.testing.assert_allclose(steady_force(damper, None, None, -speeds), -compression, rtol=1e-12)


def test_a_square_bleed_adds_the_square_of_the_flow_up_to_the_knee_of_its_direction() -> None:
    squares = {**KNEE, "q_reb": 9000.0, "q_comp": 4000.0}
    damper = PLAIN.with_effect("knee", squares)
    np.testing.assert_allclose(
        steady_force(damper, None, None, np.array([0.05, -0.04])),
        [35.0 + 2800.0 * 0.05 + 9000.0 * 0.05**2, -(35.0 + 1200.0 * 0.04 + 4000.0 * 0.04**2)],
        rtol=1e-12,
    )
    # The knee is a force: with the square part it is reached at a lower speed, and the blow-off goes on from there.
    at = (-2800.0 + np.sqrt(2800.0**2 + 4.0 * 9000.0 * (250.0 - 35.0))) / (2.0 * 9000.0)
    np.testing.assert_allclose(steady_force(damper, None, None, np.array([0.5])), 250.0 + 600.0 * (0.5 - at), rtol=1e-9)


def test_a_square_bleed_alike_in_both_directions_is_an_orifice() -> None:
    alike = {"beta": 0.0, "F_reb": NO_KNEE, "C_reb": 1.0, "F_comp": NO_KNEE, "C_comp": 1.0}
    one = respond(PLAIN.with_effect("knee", {**alike, "q_reb": 3000.0, "q_comp": 3000.0}), motion())
    np.testing.assert_array_equal(respond(PLAIN.with_effect("orifice_quadratic", {"q": 3000.0}), motion()), one)


def test_a_damper_built_the_other_way_round_gives_the_mirrored_force_in_the_mirrored_motion() -> None:
    force = respond(PLAIN.with_effect("knee", KNEE), motion())
    other = respond(PLAIN.with_effect("knee", MIRRORED), motion(-1.0))
    np.testing.assert_allclose(other, -force, rtol=0, atol=1e-9 * np.max(np.abs(force)))
    assert np.max(np.abs(respond(PLAIN.with_effect("knee", MIRRORED), motion()) - force)) > 100.0


def test_a_knee_alike_in_both_directions_is_a_relief_valve() -> None:
    alike = {"beta": 0.0, "F_reb": 250.0, "C_reb": 600.0, "F_comp": 250.0, "C_comp": 600.0}
    valve = respond(PLAIN.with_effect("relief_valve", {"F_r": 250.0, "C_r": 600.0}), motion())
    np.testing.assert_array_equal(respond(PLAIN.with_effect("knee", alike), motion()), valve)


def test_without_knees_only_the_bleeds_differ() -> None:
    straight = {"beta": 0.4, "F_reb": NO_KNEE, "C_reb": 2800.0, "F_comp": NO_KNEE, "C_comp": 1200.0}
    speeds = np.array([-0.9, 0.9])
    found = steady_force(PLAIN.with_effect("knee", straight), None, None, speeds)
    np.testing.assert_allclose(found, [-35.0 - 1200.0 * 0.9, 35.0 + 2800.0 * 0.9], rtol=1e-12)


ROUND = {**KNEE, "s_reb": 40.0, "s_comp": 15.0}
CHANGED = ("F_reb", "C_reb", "s_reb", "F_comp", "C_comp", "s_comp")
FIRST_OF_FLOW = K + 1


def many_valves(speed: float, spread: float, middle: float = 250.0) -> float:
    """Force of a bleed of 2800 N s/m and of valves beside it whose opening forces are spread like the logistic law.

    Each adds a share of 1/600 - 1/2800 to the speed a newton: the sum over 1e5 of them, solved for the force.
    """
    quantiles = (np.arange(1e5) + 0.5) / 1e5
    opens = np.maximum(middle + spread * np.log(quantiles / (1.0 - quantiles)), 35.0)  # none below the friction

    def flow(force: float) -> float:
        more = float(np.mean(np.maximum(force - opens, 0.0)))
        return (force - 35.0) / 2800.0 + (1.0 / 600.0 - 1.0 / 2800.0) * more - speed

    return float(brentq(flow, 35.0, 5000.0))


@pytest.mark.parametrize("speed", [0.01, 0.06, 0.0768, 0.1, 0.4])
def test_a_round_knee_is_that_of_many_valves_whose_opening_forces_are_spread(speed: float) -> None:
    (force,) = steady_force(PLAIN.with_effect("knee", ROUND), None, None, np.array([speed]))
    assert force == pytest.approx(many_valves(speed, 40.0), rel=2e-3)  # less those that the friction holds shut
    (sharp,) = steady_force(PLAIN.with_effect("knee", KNEE), None, None, np.array([speed]))
    assert force < sharp


def test_the_smaller_the_spread_the_nearer_a_round_knee_to_the_sharp_one() -> None:
    speeds = np.array([0.02, (250.0 - 35.0) / 2800.0, 0.3, -(120.0 - 35.0) / 1200.0, -0.5])
    sharp = steady_force(PLAIN.with_effect("knee", KNEE), None, None, speeds)
    off = [
        np.max(
            np.abs(
                steady_force(PLAIN.with_effect("knee", {**KNEE, "s_reb": s, "s_comp": s}), None, None, speeds) - sharp
            )
        )
        for s in (4.0, 0.4, 0.04)
    ]
    assert off == pytest.approx([off[0], 0.1 * off[0], 0.01 * off[0]], rel=0.01)


def test_a_valve_that_is_flatter_when_shut_is_round_the_other_way() -> None:
    """A port that chokes: the blow-off is steeper than the bleed, and a round knee lies above the corner."""
    steep = {**KNEE, "C_reb": 9000.0}
    speeds = np.geomspace(1e-3, 0.1, 50)
    sharp = steady_force(PLAIN.with_effect("knee", steep), None, None, speeds)
    found = steady_force(PLAIN.with_effect("knee", {**steep, "s_reb": 40.0}), None, None, speeds)
    assert np.all(found > sharp)
    assert np.all(np.diff(found) > 0.0)


@pytest.mark.parametrize("square", [0.0, 9000.0])
def test_the_path_over_a_round_knee_converges_and_its_derivatives_are_those_of_the_force(square: float) -> None:
    law = {**ROUND, "q_reb": square, "q_comp": square}
    rows, moved = constant_rows(35.0, 2000.0, 3e6, {"knee": law})[0], motion()
    steps = np.array([1e-3])
    exact = march(moved.displacement, moved.velocity, steps, rows, 0.0, 1e-12)
    for tolerance in (1e-3, 1e-6):
        found = march(moved.displacement, moved.velocity, steps, rows, 0.0, tolerance)
        assert np.max(np.abs(found - exact)) <= tolerance * np.max(np.abs(exact))
    numbers = {"C": 1, **{name: FIRST_OF_FLOW + STROKE_AND_FLOW.index(("knee", name)) for name in ("beta", *CHANGED)}}
    variables = Variables(np.array(list(numbers.values())), np.eye(len(numbers))[np.newaxis], np.zeros(len(numbers)))
    given = moved.displacement, moved.velocity, steps, rows, 0.0, 1e-9
    for column, slope in zip(numbers.values(), march_sensitivities(*given, variables)[1].T, strict=True):
        nudge = np.zeros_like(rows)
        nudge[0, column] = 1e-5 * rows[0, column]
        ends = (march(moved.displacement, moved.velocity, steps, rows + s * nudge, 0.0, 1e-12) for s in (-1.0, 1.0))
        before, after = ends
        expected = (after - before) / (2.0 * nudge[0, column])
        assert np.linalg.norm(slope - expected) <= 5e-3 * np.linalg.norm(expected)


def test_a_seal_rubs_beside_the_oil_and_turns_round_with_the_rod() -> None:
    """The friction of the flow turns round later, when the oil spring has unloaded."""
    soft = Damper(base=(BaseRow(T0_N=0.0, C_Ns_per_m=2000.0, k_N_per_m=1e5),))
    moved = motion()
    rubs = respond(soft.with_effect("seal", {"F_s": 35.0, "v_s": 1e-3}), moved) - respond(soft, moved)
    np.testing.assert_allclose(rubs, 35.0 * np.tanh(moved.velocity / 1e-3), atol=1e-9)
    row = soft.base[0].model_copy(update={"T0_N": 35.0})
    flow = respond(soft.model_copy(update={"base": (row,)}), moved) - respond(soft, moved)
    assert np.max(np.abs(flow - rubs)) > 30.0
