"""Every effect: its reference numbers, its neutral value, and that it is one file and found."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pzd.damper import effects
from pzd.damper.compose import respond
from pzd.damper.confounders import module_of
from pzd.damper.effect import LAWS, arguments, functions
from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion

NAMES = tuple(library())
TIME = np.arange(2000) * 1e-3


def motion() -> Motion:
    """Two sines, a voltage that swings and a temperature that rises."""
    omega = 2 * np.pi * np.array([1.5, 6.0])[:, None]
    x = (np.array([[0.02], [0.002]]) * np.sin(omega * TIME)).sum(0)
    v = (np.array([[0.02], [0.002]]) * omega * np.cos(omega * TIME)).sum(0)
    a = (-np.array([[0.02], [0.002]]) * omega**2 * np.sin(omega * TIME)).sum(0)
    return Motion(TIME, x, v, a, 75 + 60 * np.sin(2 * np.pi * 0.8 * TIME), 22 + 5 * TIME)


PLAIN = Damper(
    base=(
        BaseRow(voltage_V=0.0, T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),
        BaseRow(voltage_V=150.0, T0_N=1300.0, C_Ns_per_m=2500.0, k_N_per_m=4e5),
    ),
    reference_temperature_degC=22.0,
)

PRESENT = {
    "valve_lag": {"tau": 0.01},
    "piezo_hysteresis": {"r": 8.0},
    "temperature_drift": {"beta_T0": 0.01, "beta_C": 0.01},
    "lash": {"delta": 5e-4},
    "orifice_quadratic": {"q": 3000.0},
    "shear_thinning": {"n": 0.7},
    "relief_valve": {"F_r": 900.0, "C_r": 400.0},
    "rounded_yield": {"w_s": 0.02},
    "asymmetry": {"alpha": 0.1},
    "viscous_asymmetry": {"alpha_C": 0.2},
    "gas_spring": {"k_g": 3000.0},
    "preload_offset": {"F_0": 60.0},
    "fluid_inertia": {"m": 20.0},
    "stribeck_friction": {"F_s": 80.0, "v_s": 0.02},
    "end_stop": {"k_e": 1e6, "x_e": 0.015},
    "position_damping": {"c_p": -600.0, "x_p": 4e-3, "b_p": 8e-3},
    "cavitation": {"d_c": -2e-3, "F_c": 200.0},
    "frame_compliance": {"d_f": 1e-3, "F_f": 200.0},
    "mount_play": {"delta": 5e-4, "F_m": 80.0},
    "accumulator": {"F_g": 250.0, "L": 0.05},
    "bouc_wen": {"F_h": 150.0, "x_h": 2e-3, "sigma": 1.5},
    "second_branch": {"T0_2": 150.0, "k_2": 4e4},
    "sensor_delay": {"tau": 0.003},
}


def test_the_library_holds_the_effects_of_the_design_one_file_each() -> None:
    files = {p.stem for p in Path(effects.__file__).parent.glob("*.py")} - {"__init__"}
    assert files == set(NAMES) == set(PRESENT)


@pytest.mark.parametrize("name", NAMES)
def test_each_law_gives_its_reference_numbers(name: str) -> None:
    effect = library()[name]
    laws = [
        law for law_name, law in functions(effect, module_of(effect)).items() if LAWS[effect.place][law_name].suffices
    ]
    for given, expected in effect.tests:
        (law,) = [law for law in laws if set(arguments(law)) == set(given)]
        assert math.isclose(law(**given), expected, rel_tol=1e-12, abs_tol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_the_neutral_value_switches_each_effect_off(name: str) -> None:
    parameters = library()[name].parameters
    neutral = {p.name: p.neutral if p.admits(p.neutral) else p.high for p in parameters}
    np.testing.assert_allclose(
        respond(PLAIN.with_effect(name, neutral), motion()), respond(PLAIN, motion()), rtol=0, atol=1e-5
    )


@pytest.mark.parametrize("name", NAMES)
def test_each_effect_changes_the_force_visibly(name: str) -> None:
    plain, with_effect = respond(PLAIN, motion()), respond(PLAIN.with_effect(name, PRESENT[name]), motion())
    assert np.sqrt(np.mean((with_effect - plain) ** 2)) > 0.005 * np.max(np.abs(plain))


@pytest.mark.parametrize("name", NAMES)
def test_values_beyond_the_limits_are_refused_with_the_unit(name: str) -> None:
    parameter = library()[name].parameters[0]
    values = {**PRESENT[name], parameter.name: 10 * parameter.high + 1e12}
    with pytest.raises(ValueError, match=rf"{name}\.{parameter.name} must lie in .* {parameter.unit}"):
        PLAIN.with_effect(name, values)


def test_a_misspelt_effect_is_named_with_the_nearest_one() -> None:
    with pytest.raises(ValueError, match="did you mean gas_spring"):
        PLAIN.with_effect("gas_sprng", {"k_g": 1.0})


def test_a_parameter_by_voltage_is_linear_between_its_nodes() -> None:
    by_voltage = PLAIN.with_effect("preload_offset", {"F_0": (0.0, 150.0), "at_voltage_V": (0.0, 150.0)})
    extra = respond(by_voltage, motion()) - respond(PLAIN, motion())
    np.testing.assert_allclose(extra, motion().voltage, rtol=1e-9)
