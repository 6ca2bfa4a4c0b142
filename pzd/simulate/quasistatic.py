"""Damper forces without dynamics of their own: the demand at once (`ideal`), or the table (`table`)."""

from __future__ import annotations

from pzd.damper.compiled import compiled, laid_in
from pzd.record import Array
from pzd.simulate.demand import bounds_of, demand, feedback_force, one_sided, spring_acceleration
from pzd.simulate.scene import (
    DEFLECTION,
    FORCE,
    HIGH,
    LIFT,
    LOW,
    MINIMISE,
    NEAR,
    RATE,
    SET,
    SIDE,
    SPRINGS,
    TABLE,
    TIE_END,
    Grid,
    Scene,
    Vehicle,
)
from pzd.simulate.sticking import holding_force, holding_share
from pzd.table.kernel import table_force


@compiled
def tabled(car: Vehicle, grid: Grid, axle: int, voltage: float, velocity: float) -> float:
    """Force of an axle [N] whose dampers stand at a voltage [V], at a suspension speed [m/s].

    Equation: T = n r F(U, r V)      Source: virtual work, r the motion ratio and n the number of dampers
    """
    ratio = car.ratio[axle]
    force = table_force(grid.voltages, grid.speeds, grid.rebound, grid.compression, voltage, ratio * velocity)
    return car.dampers[axle] * ratio * force


@compiled
def quasistatic_forces(y: Array, scene: Scene, control: Array, desk: Array) -> None:
    """Fill the desk's forces for axles that slip; one that sticks is left to what holds it."""
    law = scene.law
    for i in range(2):
        velocity = desk[RATE, i]
        if law.jumps and control[SIDE, i] != 0.0:
            velocity = one_sided(velocity, control[SIDE, i])
        desk[NEAR, i] = velocity
        if law.fidelity == TABLE:
            desk[FORCE, i] = tabled(scene.car, scene.grid, i, control[SET, i], velocity)
        else:
            desk[LOW, i], desk[HIGH, i] = bounds_of(law, scene.car, scene.grid, i, velocity)
    if law.fidelity == TABLE:
        return
    if law.jumps and control[SIDE, 0] * control[SIDE, 1] == 0.0:
        if control[SIDE, 0] != control[SIDE, 1]:
            _force_beside_sticking(y, scene, control, desk)
        return
    demand(law, scene.car, y, desk, int(control[TIE_END, 1]))


@laid_in
def _force_beside_sticking(y: Array, scene: Scene, control: Array, desk: Array) -> None:
    """Fill the force of the free axle where the other sticks: the policy knows that the stuck one answers."""
    law, car = scene.law, scene.car
    stuck = 0 if control[SIDE, 0] == 0.0 else 1
    free = 1 - stuck
    if law.aim == MINIMISE:
        alone = holding_force(car, stuck, desk[SPRINGS, stuck], desk[LIFT, stuck], desk[SPRINGS, free])
        a0 = spring_acceleration(car, desk[DEFLECTION]) + car.comfort[stuck] * alone
        slope = car.comfort[free] + car.comfort[stuck] * holding_share(car, stuck)
        wanted = -a0 / slope if slope != 0.0 else 0.0
    else:
        wanted = feedback_force(law.gains[free], y, desk)
    desk[FORCE, free] = min(max(wanted, desk[LOW, free]), desk[HIGH, free])
