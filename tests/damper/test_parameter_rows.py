"""The effective voltage, and T0, C and k over voltage and temperature."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper.compiled.columns import STROKE_AND_FLOW
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import bingham_parameters, drive_row, effective_voltage, nodes_of, row_at

TIME = np.arange(0, 1, 1e-3)


def test_the_lag_follows_a_step_exponentially_and_a_ramp_late_by_tau() -> None:
    steps = np.array([1e-3])
    lag = drive_row({"valve_lag": {"tau": 0.05}})
    step = effective_voltage(np.where(TIME > 0, 100.0, 0.0), steps, lag)
    np.testing.assert_allclose(step[200], 100 * (1 - np.exp(-(0.2 - 5e-4) / 0.05)), rtol=1e-5)
    ramp = effective_voltage(100 * TIME, steps, lag)
    np.testing.assert_allclose(ramp[-1], 100 * (TIME[-1] - 0.05), rtol=1e-6)


def test_the_play_reverses_only_after_its_whole_width() -> None:
    triangle = np.interp(TIME, [0, 0.25, 0.5, 1.0], [0, 100, 0, 100])
    effective = effective_voltage(triangle, np.array([1e-3]), drive_row({"piezo_hysteresis": {"r": 10.0}}))
    assert effective.max() == pytest.approx(90.0)
    assert effective[400] == pytest.approx(min(90.0, triangle[400] + 10.0))
    assert np.max(np.abs(effective - triangle)) == pytest.approx(10.0)


GRID = Damper(
    base=tuple(
        BaseRow(
            voltage_V=u, temperature_degC=t, T0_N=100 + u - t, C_Ns_per_m=2000 + u + 10 * t, k_N_per_m=1e5 + 1e3 * u
        )
        for u in (0.0, 50.0, 150.0)
        for t in (22.0, 43.0)
    )
)


def test_parameters_are_bilinear_in_voltage_and_temperature_and_constant_beyond(rng: np.random.Generator) -> None:
    u, t = rng.uniform(0, 150, 50), rng.uniform(22, 43, 50)
    expected = np.stack([100 + u - t, 2000 + u + 10 * t, 1e5 + 1e3 * u], axis=-1)
    np.testing.assert_allclose(bingham_parameters(GRID, u, t), expected, rtol=1e-12)
    np.testing.assert_allclose(bingham_parameters(GRID, 400.0, 90.0), bingham_parameters(GRID, 150.0, 43.0))


def test_drift_is_exponential_in_the_distance_from_the_reference_temperature() -> None:
    warm = Damper(
        base=(BaseRow(T0_N=100.0, C_Ns_per_m=1000.0, k_N_per_m=1e5),),
        effects={"temperature_drift": {"beta_T0": 0.04, "beta_C": 0.01}},
        reference_temperature_degC=22.0,
    )
    np.testing.assert_allclose(bingham_parameters(warm, None, 42.0), [[100 * np.exp(-0.8), 1000 * np.exp(-0.2), 1e5]])


def test_a_drift_per_voltage_needs_a_voltage() -> None:
    drifting = Damper(
        base=(BaseRow(T0_N=100.0, C_Ns_per_m=1000.0, k_N_per_m=1e5),),
        effects={"temperature_drift": {"beta_T0": (0.04, 0.02), "beta_C": 0.01, "at_voltage_V": (0.0, 100.0)}},
        reference_temperature_degC=22.0,
    )
    voltage, temperature = np.array([0.0, 50.0, 100.0]), np.array([42.0, 42.0, 32.0])
    expected = 100 * np.exp([-0.8, -0.6, -0.2])
    np.testing.assert_allclose(bingham_parameters(drifting, voltage, temperature)[:, 0], expected)
    np.testing.assert_allclose(bingham_parameters(drifting, voltage, 42.0)[:, 0], 100 * np.exp([-0.8, -0.6, -0.4]))
    np.testing.assert_allclose(
        bingham_parameters(drifting, voltage, temperature)[:, 1], 1000 * np.exp([-0.2, -0.2, -0.1])
    )
    with pytest.raises(ValueError, match="beta_T0 depends on the voltage, and none is given"):
        bingham_parameters(drifting, None, 42.0)


def test_the_nodes_for_compiled_loops_give_the_same_rows() -> None:
    damper = GRID.with_effect("orifice_quadratic", {"q": (10.0, 30.0), "at_voltage_V": (20.0, 100.0)})
    nodes = nodes_of(damper, 30.0)
    for voltage in (-5.0, 10.0, 60.0, 149.0, 200.0):
        row = row_at(nodes.voltages, nodes.rows, voltage)
        np.testing.assert_allclose(row[:3], bingham_parameters(damper, voltage, 30.0)[0])
        q = row[3 + STROKE_AND_FLOW.index(("orifice_quadratic", "q"))]
        assert q == pytest.approx(np.interp(voltage, [20.0, 100.0], [10.0, 30.0]))


def test_a_gas_spring_of_one_value_at_every_node_counts_from_another_place_too() -> None:
    rows = tuple(BaseRow(voltage_V=u, T0_N=1.0, C_Ns_per_m=1.0, k_N_per_m=1e6) for u in (0.0, 1.0))
    damper = Damper(base=rows, effects={"gas_spring": {"k_g": 1000.0, "at_voltage_V": (0.0, 1.0)}})
    moved = damper.about(0.01)
    assert moved.effects["preload_offset"] == {"F_0": (10.0, 10.0), "at_voltage_V": (0.0, 1.0)}


def test_a_lag_for_each_voltage_is_refused_by_name() -> None:
    rows = tuple(BaseRow(voltage_V=u, T0_N=1.0, C_Ns_per_m=1.0, k_N_per_m=1e6) for u in (0.0, 1.0))
    damper = Damper(base=rows, effects={"valve_lag": {"tau": (0.01, 0.02), "at_voltage_V": (0.0, 1.0)}})
    with pytest.raises(ValueError, match=r"valve_lag\.tau must be one number, not a list by voltage"):
        nodes_of(damper, None)


def test_an_uneven_time_gives_the_same_force(rng: np.random.Generator) -> None:
    uneven = np.sort(rng.uniform(0, 1, 3000))
    omega = 2 * np.pi * 2
    single = Damper(base=(BaseRow(T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),))

    def force(time: np.ndarray) -> np.ndarray:
        x = 0.02 * np.sin(omega * time)
        return respond(single, Motion(time, x, 0.02 * omega * np.cos(omega * time), -(omega**2) * x))

    even = np.arange(uneven[0], 1, 1e-4)
    late = uneven > 0.5
    np.testing.assert_allclose(force(uneven)[late], np.interp(uneven[late], even, force(even)), atol=0.5)
