"""The simulate stage: the half-car rides every road with every policy at every fidelity."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

from pzd.artefacts import Diagnosed, MountedDampers, Rides, Table, damper_without_force
from pzd.schema.csvfile import check_installed
from pzd.schema.errors import ConfigError
from pzd.simulate.config import SimulateConfig

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pzd.artefacts import Response
    from pzd.damper.model import Damper
    from pzd.simulate.roads import Profile
    from pzd.simulate.study.plan import Case
    from pzd.simulate.study.tuning import Setup


def simulate(
    simulate: SimulateConfig, diagnosed: Diagnosed, table: Table, seed: int, folder: Path, jobs: int = 1
) -> Rides:
    """Ride every case of the config, take its numbers, and compute the response of the damper to a step of voltage.

    Parameters
    ----------
    simulate : the config's block
    diagnosed : the damper, and that before diagnose
    table : force over voltage and velocity, by which the controller finds its voltage
    seed : of the run, for roads that are drawn
    folder : of the config, for roads that are read
    jobs : rides at the same time

    Raises
    ------
    ConfigError : when histories cannot be written as asked, a policy needs the voltage of a rig without one, a road is
        too short for the ride, or a temperature or a voltage lies outside of the table
    DataError : when a ride needs the table where it ends
    """
    from pzd.simulate.ride.model import check_inertance, dynamic_damper_of, grid_of, table_of
    from pzd.simulate.study.plan import cases, checked_temperature, checked_voltage
    from pzd.simulate.study.response import responses
    from pzd.simulate.study.tuning import Setup

    if simulate.histories == "parquet":
        check_installed("simulate.histories")
    with_voltage = all(row.voltage_V is not None for row in diagnosed.damper.base)
    planned = cases(simulate, with_voltage, diagnosed.damper != diagnosed.baseline)
    temperature = checked_temperature(simulate, table)
    checked_voltage(simulate, table)
    profiles = profiles_of(simulate, seed, folder)
    setups = {}
    for plain in {case.plain for case in planned} | {False}:
        damper = diagnosed.baseline if plain else diagnosed.damper
        grid = grid_of(table_of(damper, table) if plain else table, temperature)
        dynamic = dynamic_damper_of(damper, temperature, simulate.valve_response_s)
        check_inertance(dynamic, simulate.car.car())
        setups[plain] = Setup(simulate, profiles, grid, dynamic, table.notes.outside == "error")

    answered = responses(simulate, diagnosed.damper, temperature) if with_voltage else ()
    return _ridden(simulate, planned, setups, answered, with_voltage=with_voltage, jobs=jobs)


def simulate_mounted(
    simulate: SimulateConfig, mounted: MountedDampers, seed: int, folder: Path, jobs: int = 1
) -> Rides:
    """Ride every case of the config on dampers that are known without a rig.

    Parameters
    ----------
    simulate : the config's block
    mounted : the dampers, of one or of each axle
    seed, folder, jobs : as `simulate`

    Raises
    ------
    ConfigError, DataError : as `simulate_on_axles` does
    """
    axles = [(axle.damper, axle.table) for axle in mounted.axles]
    return simulate_on_axles(simulate, axles, seed, folder, jobs)


def simulate_on_axles(
    simulate: SimulateConfig, axles: Sequence[tuple[Damper | None, Table]], seed: int, folder: Path, jobs: int = 1
) -> Rides:
    """Ride every case of the config with a damper of its own at each axle.

    A damper that is known by its table alone, as a measured curve is, has no oil spring and no valve: where one is
    among them, what would be ridden `dynamic` is ridden by the tables.

    Parameters
    ----------
    simulate : the config's block
    axles : damper and table of axle 1, and of axle 2 where it is another one; None for a damper known by its table
    seed, folder, jobs : as `simulate`

    Raises
    ------
    ConfigError : as `simulate` does; and when one of two dampers has a control signal and the other has none, or a
        policy predicts one damper at both axles
    DataError : as `simulate` does
    """
    from pzd.simulate.ride.model import check_inertance, dynamic_damper_of, grid_of
    from pzd.simulate.study.plan import cases, checked_temperature, checked_voltage
    from pzd.simulate.study.tuning import Setup

    config, controlled, mounted = simulate, [], []
    if config.histories == "parquet":
        check_installed("simulate.histories")
    if any(damper is None for damper, _ in axles):
        config = simulate.by_tables()
    for damper, table in axles:
        controlled.append(all(row.voltage_V is not None for row in table.force))
        checked_voltage(config, table)
        temperature = checked_temperature(config, table)
        dynamic = dynamic_damper_of(damper or damper_without_force(table), temperature, config.valve_response_s)
        check_inertance(dynamic, config.car.car())
        mounted.append((grid_of(table, temperature), dynamic))
    if len(set(controlled)) > 1:
        raise ConfigError("damper: that of one axle has a control signal, and that of the other has none")
    planned = cases(config, controlled[0], changed=False)
    foreseeing = [case.policy.name for case in planned if case.policy.aim in ("predict", "schedule")]
    if foreseeing and len(axles) > 1:
        raise ConfigError(f"simulate.policies: {foreseeing[0]} knows one damper at both axles, and there are two")
    ends = any(table.notes.outside == "error" for _, table in axles)
    rear = mounted[1] if len(mounted) > 1 else None
    setup = Setup(config, profiles_of(config, seed, folder), *mounted[0], ends, rear)
    return _ridden(config, planned, {False: setup}, (), with_voltage=controlled[0], jobs=jobs)


def _ridden(
    simulate: SimulateConfig,
    planned: tuple[Case, ...],
    setups: Mapping[bool, Setup],
    answered: tuple[Response, ...],
    *,
    with_voltage: bool,
    jobs: int,
) -> Rides:
    """Ride the cases, on the damper before diagnose and on that after."""
    from pzd.simulate.study.gathering import Gathering

    gathering = Gathering(simulate, with_voltage)
    with ThreadPoolExecutor(max(jobs, 1)) as pool:
        rides = list(pool.map(lambda case: gathering.of_ride(case, setups[case.plain].ridden), planned))
    return gathering.all(planned, rides, answered)


def profiles_of(simulate: SimulateConfig, seed: int, folder: Path) -> dict[str, Profile]:
    """Return every road that the config asks for, by its name.

    Parameters
    ----------
    simulate : the config's block
    seed : of the run, for roads that are drawn
    folder : of the config, for roads that are read

    Raises
    ------
    ConfigError : when a file cannot be used, is missing, or is too short for the ride, or the ride ends before an event
    """
    from pzd.simulate.roads import Way

    speed = simulate.vehicle_speed
    wrong: list[str] = []
    profiles: dict[str, Profile] = {}
    for n, road in enumerate(simulate.roads):
        try:
            way = Way(speed, speed * simulate.duration_s, seed, folder, f"simulate.roads.{n}")
            profiles[road.name] = road.profile(way)
        except ConfigError as error:
            wrong += error.messages
    if wrong:
        raise ConfigError(wrong)
    return profiles
