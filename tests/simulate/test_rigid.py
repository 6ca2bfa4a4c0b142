"""Rides on dampers whose oil is rigid or all but plastic: F = T0 sign(v) + C v, any force up to T0 at rest."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from simulate_dampers import table_of

from pzd.damper.model import BaseRow, Damper
from pzd.simulate.config import SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.ride.model import dynamic_damper_of, grid_of
from pzd.simulate.ride.outcome import Outcome
from pzd.simulate.ride.riding import ride_case
from pzd.simulate.roads import Way
from pzd.simulate.study.plan import Case

SINE = {"kind": "sine", "frequency_Hz": 1.8, "amplitude_m": 0.01}
BUMP = {"kind": "bump", "height_m": 0.05, "length_m": 2.0}


def of(friction: float, damping: float, stiffness: float) -> Damper:
    """A damper at one voltage."""
    row = BaseRow(voltage_V=0.0, T0_N=friction, C_Ns_per_m=damping, k_N_per_m=stiffness)
    return Damper(base=(row.model_copy(update={"temperature_degC": 22.0}),))


def ridden(damper: Damper, fidelity: str = "dynamic", road: dict[str, object] = SINE, **given: object) -> Outcome:
    """A passive ride of a few seconds."""
    block = {"roads": (road,), "duration_s": 6.0, "settle_s": 1.0, **given}
    config = SimulateConfig.model_validate(block)
    case = Case(config.roads[0], policies()["passive"], fidelity, plain=False)
    profile = case.road.profile(Way(config.vehicle_speed, config.vehicle_speed * config.duration_s, 1, Path()))
    dynamic = dynamic_damper_of(damper, 22.0, config.valve_response_s)
    return ride_case(config, case, profile, grid_of(table_of(damper), None), dynamic, ends=False)


@pytest.mark.parametrize("road", [SINE, BUMP])
@pytest.mark.parametrize(("friction", "damping"), [(300.0, 1100.0), (300.0, 1.0), (0.0, 1100.0)])
def test_a_rigid_damper_is_its_curve_with_sticking(friction: float, damping: float, road: dict[str, object]) -> None:
    # The table of a Bingham damper is its curve; both rides stick where |demand| <= T0.
    damper = of(friction, damping, 1e10)
    assert dynamic_damper_of(damper, 22.0, 0.001).rigid
    found, expected = ridden(damper, road=road), ridden(damper, "table", road)
    peak = float(np.max(np.abs(expected.comfort)))
    assert np.max(np.abs(found.comfort - expected.comfort)) < 1e-3 * peak
    assert abs(found.energy_error) < 1e-6


def test_towards_rigid_a_ride_converges_in_proportion_to_the_compliance() -> None:
    # Without friction: with it the body swings on the spring wherever the damper sticks, the faster the stiffer. And
    # past the start, where the road sets off at once and the force of a rigid damper jumps.
    rigid, *softer = (ridden(of(0.0, 1100.0, k), duration_s=3.0).comfort for k in (1e10, 4e6, 8e6))
    settled = slice(rigid.size // 3, None)
    off = [float(np.sqrt(np.mean((each - rigid)[settled] ** 2))) for each in softer]
    assert off[0] / off[1] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("damping", [0.0, 1100.0])
def test_a_stiffness_that_is_infinite_is_rigid(damping: float) -> None:
    infinite, stiff = (ridden(of(300.0, damping, k), duration_s=3.0).comfort for k in (np.inf, 1e12))
    assert np.max(np.abs(infinite - stiff)) < 1e-9


def test_a_stiff_spring_that_hardly_damps_brings_the_car_to_rest() -> None:
    # k = 2e7 N/m with C = 1 N s/m, once taken as 1e5 N/m, below whose friction the car swung for ever.
    history = ridden(of(400.0, 1.0, 2e7), road=BUMP, duration_s=12.0).history
    last = history[history[:, 0] > 11.0]
    assert np.max(np.abs(last[:, 3])) == pytest.approx(0.0, abs=1e-6)
    assert np.max(np.abs(last[:, [5, 11]])) < 1e-8


def test_a_soft_spring_that_hardly_damps_keeps_its_stiffness() -> None:
    # Elasto-plastic: k = 1.19e5 N/m and T0 = 322 N let the oil give by 2.7 mm; it is no rigid damper.
    damper = of(322.0, 0.55, 1.19e5)
    dynamic = dynamic_damper_of(damper, 22.0, 0.001)
    assert not dynamic.rigid
    soft, stiffer = ridden(damper, duration_s=3.0), ridden(of(322.0, 1.2, 1.19e5), duration_s=3.0)
    assert np.max(np.abs(soft.comfort - stiffer.comfort)) < 0.02 * np.max(np.abs(soft.comfort))


def test_where_nothing_is_dissipated_the_energy_error_is_a_share_of_what_flows() -> None:
    # Friction of 1e5 N never slips: body and oil spring swing, and the road takes back what it gives.
    found = ridden(of(1e5, 1000.0, 2e5))
    assert found.course[-1, 4] == pytest.approx(0.0, abs=1e-9)
    assert abs(found.energy_error) < 1e-6


def test_a_ride_beyond_the_tested_stroke_is_told() -> None:
    damper = of(300.0, 1100.0, 4e5)
    table = table_of(damper)
    config = SimulateConfig.model_validate({"roads": (SINE,), "duration_s": 4.0, "settle_s": 1.0})
    case = Case(config.roads[0], policies()["passive"], "table", plain=False)
    profile = case.road.profile(Way(config.vehicle_speed, config.vehicle_speed * config.duration_s, 1, Path()))
    dynamic, outside = dynamic_damper_of(damper, 22.0, config.valve_response_s), []
    travel = float(np.max(ride_case(config, case, profile, grid_of(table, None), dynamic, ends=False).course[:, 3]))
    for stroke in (None, 2.0 * travel, 0.5 * travel):
        notes = table.notes.model_copy(update={"reached_stroke_m": stroke})
        grid = grid_of(replace(table, notes=notes), None)
        outside.append(ride_case(config, case, profile, grid, dynamic, ends=False).outside)
    assert outside[0] == outside[1] == 0.0
    assert 0.3 < outside[2] < 1.0
