"""The damper of a ride as arrays: its table, and its nodes with the lag of the valve."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Table
from pzd.damper.branch import BRANCHES, any_slips
from pzd.damper.columns import DRIVE
from pzd.damper.compose import steady_force
from pzd.damper.kernels import C, K, parallel_force
from pzd.damper.model import Damper
from pzd.damper.nodes import nodes_of
from pzd.record import Array
from pzd.schema.errors import DataError
from pzd.simulate.car import HalfCar
from pzd.simulate.dynamic_damper import DynamicDamper
from pzd.simulate.ride_model import TableArrays
from pzd.table.lookup import Lookup

LEAST_RELAXATION = 1e-5
"""An oil spring that relaxes faster than this [s] is rigid for a car, and is taken as this fast."""


def grid_of(table: Table, temperature: float | None) -> TableArrays:
    """The table at one temperature [degC], as the compiled loop reads it."""
    lookup = Lookup.of(table, temperature)
    return TableArrays(lookup.voltages, lookup.speeds, lookup.rebound, lookup.compression, lookup.reach)


def table_of(damper: Damper, table: Table) -> Table:
    """The table that another damper would have at the same nodes: what the plain one promises.

    Parameters
    ----------
    damper : the other damper
    table : whose nodes, reach and rule for what lies outside are kept

    Returns
    -------
    the table without its inverse
    """
    held = {(row.temperature_degC, row.voltage_V): 0.0 for row in table.force}
    for row in table.force:
        key = (row.temperature_degC, row.voltage_V)
        if row.inside == 1 or table.notes.outside != "clamp":
            held[key] = max(held[key], abs(row.velocity_m_per_s))
    forces = np.zeros(len(table.force))
    for conditions, fastest in held.items():
        places = [i for i, row in enumerate(table.force) if (row.temperature_degC, row.voltage_V) == conditions]
        asked = [table.force[i].velocity_m_per_s for i in places]
        velocity = np.copysign(np.minimum(np.abs(asked), fastest), asked)
        forces[places] = steady_force(damper, conditions[1], conditions[0], velocity)
    rows = (
        row if row.force_N is None else row.model_copy(update={"force_N": float(force)})
        for row, force in zip(table.force, forces, strict=True)
    )
    return Table(tuple(rows), (), table.notes)


def dynamic_damper_of(damper: Damper, temperature: float | None, valve: float) -> DynamicDamper:
    """The damper at one temperature, as the compiled loop reads it.

    Parameters
    ----------
    damper : with its effects
    temperature : [degC]
    valve : time constant of the valve where the damper has no `valve_lag` of its own [s]
    """
    nodes = nodes_of(damper, temperature)
    rows = np.array(nodes.rows)
    rows[:, K] = np.minimum(rows[:, K], rows[:, C] / LEAST_RELAXATION)
    drive = np.array(nodes.drive)
    if "valve_lag" not in damper.effects:
        drive[DRIVE.index(("valve_lag", "tau"))] = valve
    parallel = np.ascontiguousarray(nodes.parallel)
    remembers = any_slips(parallel)
    alone = not (remembers or any(_is_parallel(row) for row in parallel))
    room, memory = np.zeros(parallel.shape[1]), np.zeros((2, 1 + BRANCHES))
    return DynamicDamper(nodes.voltages, rows, parallel, drive, alone, room, remembers, memory)


def rubs(dynamic: DynamicDamper) -> bool:
    """Whether friction beside the element jumps where the speed crosses zero."""
    tiny = np.finfo(np.float64).tiny
    return any(parallel_force(0.0, tiny, 0.0, row) != parallel_force(0.0, 0.0, 0.0, row) for row in dynamic.parallel)


def _is_parallel(row: Array) -> bool:
    rest = parallel_force(0.0, 0.0, 0.0, row)
    tries = [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, -1e-6, 0.0), (0.0, 0.0, 1.0)]
    return any(parallel_force(x, v, a, row) != rest for x, v, a in tries)


def check_inertance(dynamic: DynamicDamper, car: HalfCar) -> None:
    """Refuse a damper whose apparent mass would outweigh the car's.

    Raises
    ------
    DataError : when it would
    """
    apart = min(
        float(parallel_force(0.0, 0.0, 1.0, row) - parallel_force(0.0, 0.0, 0.0, row)) for row in dynamic.parallel
    )
    per_axle = apart * max(n * r * r for n, r in zip(car.dampers, car.motion_ratios, strict=True))
    mobility = np.max(np.linalg.eigvalsh(car.mobility()))
    if 1.0 + per_axle * mobility <= 0.0:
        raise DataError(f"3-diagnose/damper.yaml: effects.fluid_inertia: {apart:g} kg outweighs what the axles carry")
