"""The damper with its own dynamics in the car: valve, oil spring, flow, and the forces beside the element."""

from __future__ import annotations

import math
from typing import NamedTuple

from pzd.compiled import compiled, inlined
from pzd.damper.flow import flow_speed
from pzd.damper.kernels import (
    Row,
    branch_force,
    branch_stored,
    branches_follow,
    effective_voltage_after,
    parallel_force,
)
from pzd.damper.regimes import spring_force
from pzd.record import Array
from pzd.table.kernel import bracket

_TINY = 1e-300  # m/s: a speed that only carries its sign


class DynamicDamper(NamedTuple):
    """One damper: parameter rows over the effective voltage, linear between; see `pzd.damper.compose.Nodes`."""

    voltages: Array
    rows: Array
    parallel: Array
    drive: Array
    alone: bool
    """Whether nothing stands beside the element."""
    scratch: Array
    """A row of parallel effects to work in."""
    slips: bool
    """Whether a branch beside the element remembers which way the rod went."""
    memory: Array
    """(2, 1 + b) of one damper at each axle: the extension at the last step of integration, and what each of the b
    branches was deflected by there [m]."""


@inlined
def place(nodes: Array, value: float) -> tuple[int, float]:
    """Interval of rising nodes that holds a value, and the share of it that lies below; held beyond the ends."""
    if nodes.size == 1 or value <= nodes[0]:
        return 0, 0.0
    if value >= nodes[-1]:
        return nodes.size - 1, 0.0
    i = bracket(nodes, value)
    return i, (value - nodes[i]) / (nodes[i + 1] - nodes[i])


@inlined
def parallel_at(damper: DynamicDamper, voltage: float, row: Array) -> None:
    """Fill `row` with the parameters of the parallel effects at an effective voltage: linear between, held beyond."""
    i, share = place(damper.voltages, voltage)
    for j in range(row.size):
        row[j] = damper.parallel[i, j] + share * (
            damper.parallel[min(i + 1, damper.voltages.size - 1), j] - damper.parallel[i, j]
        )


@compiled
def effective_voltage(damper: DynamicDamper, voltage: float, kept: Array, elapsed: float) -> float:
    """Voltage as the valve feels it [V], a time after the voltage was set.

    Parameters
    ----------
    damper : the damper
    voltage : set by the controller, and held since [V]
    kept : (d,) voltage behind each drive effect when it was set [V]
    elapsed : time since [s]
    """
    effective, _ = effective_voltage_after(voltage, elapsed, kept, damper.drive)
    return effective


@inlined
def flowing(e: float, row: Row, guess: float) -> tuple[float, float]:
    """Force of the oil spring [N] at its elastic deflection [m], and the speed at which the oil flows [m/s].

    Equation: F = k e, |F| = flow curve (|dy/dt|)      Source: Makowski and Knap 2021, eq. (1) to (3)
    """
    force = spring_force(e, row)
    side = 1.0 if force >= 0.0 else -1.0
    return force, side * flow_speed(abs(force), row, side, guess)


@inlined
def rubbing_force(v: float, row: Array) -> float:
    """Friction beside the element [N] at a speed [m/s]; the sign bit of 0 picks the side."""
    moving = math.copysign(_TINY, v) if v == 0.0 else v
    return float(parallel_force(0.0, moving, 0.0, row) - parallel_force(0.0, 0.0, 0.0, row))


@inlined
def elastic_force(x: float, row: Array) -> float:
    """Force beside the element [N] at an extension [m] from where the car stands: it gives its work back.

    A force that is there at rest is carried by the static balance and left out.
    """
    return float(parallel_force(x, 0.0, 0.0, row) - parallel_force(0.0, 0.0, 0.0, row))


@inlined
def inertance(row: Array) -> float:
    """Force beside the element for each acceleration [kg]."""
    return float(parallel_force(0.0, 0.0, 1.0, row) - parallel_force(0.0, 0.0, 0.0, row))


@inlined
def slipping_forces(damper: DynamicDamper, axle: int, x: float, v: float, row: Array) -> tuple[float, float]:
    """Force [N] of the branches beside the element: the part whose work is stored, and the part that slips.

    Parameters
    ----------
    damper : the damper, its memory of the last step
    axle : 0 or 1
    x : extension [m], reached from there without turning round
    v : its speed [m/s]; the sign bit of 0 picks the side
    row : of the parallel effects
    """
    memory, side = damper.memory[axle], math.copysign(1.0, v)
    travel = side * max(side * (x - memory[0]), 0.0)  # a rounding the other way would count as turning round
    stored = branch_stored(travel, side, memory[1:], row)
    return stored, branch_force(travel, memory[1:], row) - stored


@inlined
def remember(damper: DynamicDamper, axle: int, x: float, row: Array) -> None:
    """Bring the branches of an axle to an extension [m], reached without turning round; by one row."""
    memory = damper.memory[axle]
    branches_follow(x - memory[0], memory[1:], row)
    memory[0] = x
