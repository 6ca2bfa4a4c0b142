"""Damper forces without dynamics of their own: the demand at once (`ideal`), or the table (`table`)."""

from __future__ import annotations

from pzd.compiled import compiled, inlined
from pzd.record import Array
from pzd.simulate.demand import bounds_of, demand, one_sided, spring_acceleration, wanted_force
from pzd.simulate.ride_model import (
    DEFLECTION,
    FORCE,
    HIGH,
    LIFT,
    LOW,
    MINIMISE,
    RATE,
    SET,
    SIDE,
    SIDED_RATE,
    SPRINGS,
    TABLE,
    RideModel,
    TableArrays,
    Vehicle,
)
from pzd.simulate.sticking import holding_force, holding_share
from pzd.table.kernel import table_force


@compiled
def tabled(car: Vehicle, grid: TableArrays, axle: int, voltage: float, velocity: float) -> float:
    """Force of an axle [N] whose dampers stand at a voltage [V], at a suspension speed [m/s].

    Equation: T = n r F(U, r V)      Source: virtual work, r the motion ratio and n the number of dampers
    """
    ratio = car.ratio[axle]
    force = table_force(grid.voltages, grid.speeds, grid.rebound, grid.compression, voltage, ratio * velocity)
    return car.dampers[axle] * ratio * force


@inlined
def quasistatic_forces(y: Array, model: RideModel, control: Array, workspace: Array) -> None:
    """Fill the workspace's forces for axles that slip; one that sticks is left to what holds it."""
    control_spec = model.control_spec
    for i in range(2):
        velocity = workspace[RATE, i]
        if control_spec.jumps and control[SIDE, i] != 0.0:
            velocity = one_sided(velocity, control[SIDE, i])
        workspace[SIDED_RATE, i] = velocity
        if control_spec.fidelity == TABLE:
            workspace[FORCE, i] = tabled(model.car, model.grid, i, control[SET, i], velocity)
        else:
            workspace[LOW, i], workspace[HIGH, i] = bounds_of(control_spec, model.car, model.grid, i, velocity)
    if control_spec.fidelity == TABLE:
        return
    if control_spec.jumps and control[SIDE, 0] * control[SIDE, 1] == 0.0:
        if control[SIDE, 0] != control[SIDE, 1]:
            _force_outside_sticking(y, model, control, workspace)
        return
    demand(control_spec, model.car, y, control, workspace)


@inlined
def _force_outside_sticking(y: Array, model: RideModel, control: Array, workspace: Array) -> None:
    """Fill the force of the free axle where the other sticks: the policy knows that the stuck one answers."""
    control_spec, car = model.control_spec, model.car
    stuck = 0 if control[SIDE, 0] == 0.0 else 1
    free = 1 - stuck
    if control_spec.aim == MINIMISE:
        alone = holding_force(car, stuck, workspace[SPRINGS, stuck], workspace[LIFT, stuck], workspace[SPRINGS, free])
        a0 = spring_acceleration(car, workspace[DEFLECTION]) + car.comfort[stuck] * alone
        slope = car.comfort[free] + car.comfort[stuck] * holding_share(car, stuck)
        wanted = -a0 / slope if slope != 0.0 else 0.0
        workspace[FORCE, free] = min(max(wanted, workspace[LOW, free]), workspace[HIGH, free])
    else:
        workspace[FORCE, free] = wanted_force(control_spec, free, y, control, workspace)
