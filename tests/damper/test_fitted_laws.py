"""The knee law: bleed, knee and blow-off of each direction, known to the damper and not to the library."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper.compose import respond, steady_force
from pzd.damper.confounders import confounders, known, module_of
from pzd.damper.effect import arguments, functions
from pzd.damper.effects import library
from pzd.damper.fitted_laws import fitted_laws
from pzd.damper.fitted_laws.knee import NO_KNEE
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
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
