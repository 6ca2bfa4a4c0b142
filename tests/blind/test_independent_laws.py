"""The second generator integrates its laws to a known tolerance, and means by their names what the library means."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.blind.independent.kernel import Parameters, integrated
from pzd.blind.independent.laws import LAWS, delayed_force, drift_factor, lagged_signal, signal_with_play
from pzd.blind.independent.outside import OUTSIDE
from pzd.damper.compose import respond
from pzd.damper.effects import library, nameable
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.record import Array

LONGEST_STEP = 1.25e-4
"""Of the integration in every case [s]."""
T0, C, K = 300.0, 2700.0, 2e5
STROKE, OMEGA = 0.02, 2.0 * np.pi * 1.3
SPEED = STROKE * OMEGA
IN_KERNEL: dict[str, dict[str, float]] = {
    "asymmetry": {"alpha": 0.2},
    "end_stop": {"k_e": 5e6, "x_e": 0.014},
    "fluid_inertia": {"m": 30.0},
    "gas_spring": {"k_g": 5e3},
    "lash": {"delta": 1e-3},
    "orifice_quadratic": {"q": 2000.0},
    "preload_offset": {"F_0": 80.0},
    "relief_valve": {"F_r": 420.0, "C_r": 700.0},
    "rounded_yield": {"w_s": 0.02},
    "shear_thinning": {"n": 0.7},
    "second_branch": {"T0_2": 60.0, "k_2": 3e4},
    "stribeck_friction": {"F_s": 60.0, "v_s": 0.03},
    "accumulator": {"F_g": 80.0, "L": 0.05},
    "cavitation": {"d_c": -1.5e-3, "F_c": 100.0},
    "frame_compliance": {"d_f": 1e-3, "F_f": 100.0},
    "viscous_asymmetry": {"alpha_C": 0.2},
    "bouc_wen": {"F_h": 60.0, "x_h": 2e-3, "sigma": 1.5},
}
FORMS: dict[str, dict[str, float]] = {
    "frequency_dependent": {"bypass": 0.5, "bypass_lag": 0.1, "bypass_force": 400.0},
    "thixotropy": {"structure": 0.5, "rebuilding": 0.3, "breakdown": 200.0},
    "position_grooves": {"groove": 0.4, "groove_end": 0.01, "groove_run_out": 8e-4},
    "two_stage_blow_off": {"first_force": 400.0, "first_slope": 500.0, "second_force": 480.0, "second_slope": 5e3},
    "viscoelastic_mount": {"bushing_stiffness": 1e4, "bushing_time": 0.1},
    "aeration": {"fade": 0.3, "fade_time": 1.0},
    "late_filling": {"gap": 1e-3},
    "cubic_spring": {"cubic": 1e7},
    "smooth_pipe": {"duct": 1500.0},
    "polytropic_gas": {"charge": 300.0, "column": 0.08},
    "frame_stick_slip": {"mount_stiffness": 2e6, "mount_holds": 500.0, "mount_slides": 300.0},
}


def sine(step: float, seconds: float = 1.0) -> tuple[Array, tuple[Array, Array, Array]]:
    """Time and motion on a grid of half steps."""
    t = np.arange(2 * round(seconds / step) + 1) * 0.5 * step
    return t, (STROKE * np.sin(OMEGA * t), SPEED * np.cos(OMEGA * t), -SPEED * OMEGA * np.sin(OMEGA * t))


def force(step: float, **values: float) -> Array:
    t, motion = sine(step)
    ones = np.ones_like(t)
    return integrated(t, motion, (T0 * ones, C * ones, K * ones), Parameters(**values))


def test_every_name_of_a_verdict_has_a_law_and_every_law_is_tried_here() -> None:
    assert set(LAWS) == {name for name, effect in nameable().items() if not effect.beside_gas}
    integrated_laws = {name for name, law in {**LAWS, **OUTSIDE}.items() if law.place == "damper"}
    assert integrated_laws == {*IN_KERNEL, *FORMS}


def test_a_law_outside_is_described_by_effects_of_the_library() -> None:
    described = {name: set(law.described_by) for name, law in OUTSIDE.items()}
    assert {effect for effects in described.values() for effect in effects} <= set(library())
    assert described["second_branch"] == {"second_branch"}
    assert described["late_filling"] == {"lash", "cavitation"}
    assert described["thixotropy"] == set()


@pytest.mark.parametrize("name", [*IN_KERNEL, *(form for form in FORMS if form != "frame_stick_slip")])
def test_the_longest_step_costs_a_hundred_thousandth_of_the_force(name: str) -> None:
    values = {**IN_KERNEL, **FORMS}[name]
    fine = force(LONGEST_STEP / 8.0, **values)
    error = np.max(np.abs(force(LONGEST_STEP, **values) - fine[::8])) / np.max(np.abs(fine))
    assert error < 1e-5


def test_a_slip_of_the_mount_comes_at_the_step_in_which_it_begins() -> None:
    """Its instant is known to a step, within which the force falls by up to the step over the time of a slip."""
    fine = force(LONGEST_STEP / 8.0, **FORMS["frame_stick_slip"])
    error = force(LONGEST_STEP, **FORMS["frame_stick_slip"]) - fine[::8]
    assert np.sqrt(np.mean(error**2)) < 1e-3 * np.max(np.abs(fine))
    assert np.max(np.abs(fine - force(LONGEST_STEP / 8.0))) > 0.04 * np.max(np.abs(fine))


@pytest.mark.parametrize(("order", "name"), [(3.5, "rounded_yield"), (1.5, "orifice_quadratic")])
def test_smooth_laws_converge_with_the_fourth_order_and_kinks_with_the_second(order: float, name: str) -> None:
    fine = force(1e-5, **IN_KERNEL[name])
    errors = [
        np.max(np.abs(force(step, **IN_KERNEL[name]) - fine[:: round(step / 1e-5)])) for step in (1e-3, 5e-4, 2.5e-4)
    ]
    assert np.log2(errors[0] / errors[2]) / 2.0 > order


def test_the_flow_is_that_of_scipy() -> None:
    from scipy.integrate import solve_ivp

    def rate(t: float, y: Array) -> list[float]:
        spring = K * (STROKE * np.sin(OMEGA * t) - y[0])
        over, q = max(abs(spring) - T0, 0.0), 2000.0
        return [float(np.sign(spring) * (np.sqrt(C * C + 4.0 * q * over) - C) / (2.0 * q))]

    t, (x, _, _) = sine(LONGEST_STEP, 0.4)
    solved = solve_ivp(rate, (0.0, 0.4), [0.0], "DOP853", t[::2], rtol=1e-10, atol=1e-13, max_step=1e-4)
    expected = K * (x[::2] - solved.y[0])
    found = force(LONGEST_STEP, q=2000.0)[: expected.size]
    assert np.max(np.abs(found - expected)) < 1e-5 * np.max(np.abs(expected))


@pytest.mark.parametrize("name", IN_KERNEL)
def test_both_generators_mean_the_same_by_a_name(name: str) -> None:
    t, (x, v, a) = sine(LONGEST_STEP)
    rows = (BaseRow(T0_N=T0, C_Ns_per_m=C, k_N_per_m=K),)
    damper = Damper(base=rows, effects={name: dict(IN_KERNEL[name])})
    other = respond(damper, Motion(t[::2], x[::2], v[::2], a[::2]))
    own = force(LONGEST_STEP, **IN_KERNEL[name])
    # sign(v) at a reversal that falls on a sample may be either, and the oil may start from either end of a play
    late = t[::2] > 0.5
    steady = late & (np.abs(v[::2]) > 1e-6)
    assert np.max(np.abs(own - other)[steady]) < 1e-4 * np.max(np.abs(other))
    assert np.max(np.abs(own - force(LONGEST_STEP))[steady]) > 0.02 * np.max(np.abs(other))


def test_the_laws_of_drive_material_and_sensor_mean_the_same() -> None:
    step = 1e-3
    t = np.arange(0.0, 1.0, step)
    signal = 50.0 + 50.0 * np.sin(9.0 * t)
    rows = tuple(BaseRow(voltage_V=u, T0_N=u, C_Ns_per_m=1e6, k_N_per_m=1e12) for u in (0.0, 100.0))
    motion = Motion(t, 1e-9 * t, np.full_like(t, 1e-9), np.zeros_like(t), signal, 20.0 + 5.0 * t)
    drives = {"valve_lag": {"tau": 0.03}, "piezo_hysteresis": {"r": 8.0}}
    for name, values in drives.items():
        given = respond(Damper(base=rows, effects={name: dict(values)}), motion, 50.0)
        own = lagged_signal(signal, step, 0.03) if name == "valve_lag" else signal_with_play(signal, 8.0)
        assert np.max(np.abs(own - given)[5:]) < 0.5  # of 100 V: the oil spring follows within a sample or two
    assert drift_factor(np.array([43.0]), 23.0, 0.01)[0] == pytest.approx(np.exp(-0.2))
    late = delayed_force(t, np.sin(9.0 * t), 0.004)
    assert np.max(np.abs(late - np.sin(9.0 * (t - 0.004)))[5:]) < 1e-4
