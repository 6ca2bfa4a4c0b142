"""The simulate stage: the half-car rides every road with every policy at every fidelity."""

from __future__ import annotations

import logging
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

from pzd.artefacts import AXLE_COLUMNS, Diagnosed, Rides, Table
from pzd.simulate.config import SimulateConfig

if TYPE_CHECKING:
    from pzd.simulate.outcome import Outcome
    from pzd.simulate.plan import Case

log = logging.getLogger(__name__)

_DEMANDED, _VOLTAGE = AXLE_COLUMNS[-2:]


def simulate(
    simulate: SimulateConfig, diagnosed: Diagnosed, table: Table, seed: int, folder: Path, jobs: int = 1
) -> Rides:
    """Every ride that the config asks for, its summary, and the response of the damper to a step of voltage.

    Parameters
    ----------
    simulate : the config's block
    diagnosed : the damper, and the plain one before diagnose
    table : force over voltage and velocity, by which the controller finds its voltage
    seed : of the run, for roads that are drawn
    folder : of the config, for roads that are read
    jobs : rides at the same time

    Raises
    ------
    ConfigError : when a policy needs the voltage of a rig without one
    DataError : when a ride needs the table where it ends
    """
    from pzd.simulate.dampers import check_inertance, dynamic_damper_of, grid_of, lowest_temperature, table_of
    from pzd.simulate.outcome import ride_of, summary_row
    from pzd.simulate.plan import cases
    from pzd.simulate.response import responses
    from pzd.simulate.riding import KM_PER_H, ride_case
    from pzd.simulate.road import Way

    with_voltage = all(row.voltage_V is not None for row in diagnosed.damper.base)
    planned = cases(simulate, with_voltage, diagnosed.damper != diagnosed.plain)
    temperature = simulate.temperature_degC
    if temperature is None:
        temperature = lowest_temperature(table)
    speed = simulate.vehicle_speed_km_per_h * KM_PER_H
    profiles = {
        road.name: road.profile(Way(speed, speed * simulate.duration_s, seed, folder, f"simulate.roads.{n}"))
        for n, road in enumerate(simulate.roads)
    }
    grids, oils = {}, {}
    for plain in {case.plain for case in planned} | {False}:
        damper = diagnosed.plain if plain else diagnosed.damper
        grids[plain] = grid_of(table_of(damper, table) if plain else table, temperature)
        oils[plain] = dynamic_damper_of(damper, temperature, simulate.valve_response_s)
        check_inertance(oils[plain], simulate.car.car())

    def ridden(case: Case) -> Outcome:
        log.info("simulate: %s", case.name)
        ends = table.notes.outside == "error"
        return ride_case(simulate, case, profiles[case.road.name], grids[case.plain], oils[case.plain], ends)

    rides, summary = [], []
    with ThreadPoolExecutor(max(jobs, 1)) as pool:
        outcomes = list(pool.map(ridden, planned))
    for case, outcome in zip(planned, outcomes, strict=True):
        without: tuple[str, ...] = (_VOLTAGE,) if case.fidelity == "ideal" or not with_voltage else ()
        without += (_DEMANDED,) if case.policy.aim == "voltage" else ()
        rides.append(ride_of(case.name, outcome, without))
        summary.append(
            summary_row(case.name, case.road.name, case.policy.name, case.fidelity, outcome, simulate.settle_s)
        )
    answered = responses(simulate, diagnosed.damper, temperature) if with_voltage else ()
    return Rides(tuple(rides), tuple(summary), answered)
