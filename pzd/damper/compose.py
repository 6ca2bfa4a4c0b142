"""The whole damper: drive, material, stroke, flow, parallel forces and sensor in their order."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pzd.compiled import compiled
from pzd.damper.compiled.columns import DRIVE, NEUTRAL, PARALLEL, STROKE_AND_FLOW, acting, columns_of, value_of
from pzd.damper.compiled.kernels import (
    T0,
    C,
    K,
    branch_force,
    branch_steady,
    branches_follow,
    parallel_forces,
    plain,
    row_of,
)
from pzd.damper.compiled.laws import arguments, functions
from pzd.damper.confounders import module_of
from pzd.damper.element import element_force, element_force_sensitivities
from pzd.damper.flow import flow_force
from pzd.damper.march import march, march_sensitivities
from pzd.damper.material import effective_voltage, material
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.record import Array

# ----------------------------------------------------------------------------------------------------
# The forces beside the element that remember: their deflections along a sampled motion.


BRANCHES = len(acting("branch"))
"""How many deflections are remembered."""


def branch_forces(motion: Motion, rows: Array) -> Array:
    """Force of the branches along a motion, from rest at its first sample.

    The extension is a parabola inside each step, cut where the rod turns round: from there to there the laws are exact
    where the parameters stand still. Where they move they are taken as at the end of each step, of order two.

    Parameters
    ----------
    motion : (n,) sampled motion
    rows : (n, m) or (1, m) parameters of the forces beside the element, linear between samples

    Returns
    -------
    (n,) force [N]
    """
    force = np.zeros(motion.time.size)
    _fill(motion.displacement, motion.velocity, motion.time, rows, np.zeros(BRANCHES), force)
    return force


@compiled
def any_slips(rows: Array) -> bool:
    """Whether a branch acts in one of the (n, m) rows of the forces beside the element."""
    found = False
    for i in range(rows.shape[0]):
        found = found or branch_steady(1.0, rows[i]) != 0.0
    return found


@compiled
def _fill(x: Array, v: Array, time: Array, rows: Array, state: Array, force: Array) -> None:
    """Fill `force`, and change the deflections in place."""
    last = rows.shape[0] - 1
    for i in range(1, x.size):
        now = rows[min(i, last)]
        travel, h = x[i] - x[i - 1], time[i] - time[i - 1]
        half = 0.5 * (v[i] - v[i - 1])
        u0, u1 = travel / h - half, travel / h + half
        if u0 * u1 < 0.0:
            way = 0.5 * u0 * u0 / (u0 - u1) * h
            branches_follow(way, state, now)
            travel -= way
        branches_follow(travel, state, now)
        force[i] = branch_force(0.0, state, now)


# ----------------------------------------------------------------------------------------------------


TOLERANCE = 1e-9
"""Admissible error of one piece of the path, as a share of the force."""

_NEUTRAL_ROW = np.array([[0.0, 0.0, 0.0, *(NEUTRAL[column] for column in STROKE_AND_FLOW)]])
_NEUTRAL_PARALLEL = np.array([[NEUTRAL[column] for column in PARALLEL]])
_IN_ROW = {column: K + 1 + i for i, column in enumerate(STROKE_AND_FLOW)}
_IN_PARALLEL = {column: i for i, column in enumerate(PARALLEL)}

_EVEN = 1e-6  # of the median sampling interval
_NUDGE = 1e-6  # of the largest force, for the derivative by the initial one


def respond(damper: Damper, motion: Motion, first_force: float | None = None, tolerance: float = TOLERANCE) -> Array:
    """Force that the force channel records while the damper goes through a motion.

    Parameters
    ----------
    damper : the damper with its effects
    motion : (n,) sampled motion, its displacement as recorded; the extension is a parabola inside each step,
        voltage and temperature go linearly
    first_force : force of the whole damper at the first sample [N], of which the oil spring carries what the forces
        beside it do not; None for an oil spring that is relaxed there
    tolerance : admissible error of a piece, as a share of the force

    Returns
    -------
    (n,) force [N]

    Raises
    ------
    ValueError : when the damper needs a voltage or temperature that the motion does not have
    """
    motion = motion.about(damper.zero_m)
    steps = sampling_steps(motion.time)
    effective = voltage_at_valve(damper, constant_value(motion.voltage), steps)
    rows = element_rows(damper, effective, constant_value(motion.temperature))
    parallel = parallel_rows(damper, effective)
    beside = np.zeros(1) if parallel is None else forces_beside(motion, parallel)
    initial = 0.0 if first_force is None else first_force - float(beside[0])
    return recorded(sensors_of(damper), motion.time, integrated_force(rows, motion, steps, initial, tolerance) + beside)


def integrated_force(rows: Array, motion: Motion, steps: Array, initial_force: float, tolerance: float) -> Array:
    """(n,) force [N] of the element with its stroke and flow effects.

    An element alone whose parameters stand still is solved in closed form, everything else piece by piece.

    Parameters
    ----------
    rows : (n, r) or (1, r) parameter rows, see `kernels.Row`
    motion : (n,) sampled motion
    steps : (n - 1,) or (1,) sampling intervals [s]
    initial_force : force of the oil spring at the first sample [N]
    tolerance : admissible error of a piece, as a share of the force
    """
    x, v = motion.displacement, motion.velocity
    if len(rows) == 1 and plain(row_of(rows[0])):
        friction, damping, stiffness = rows[0, [T0, C, K]]
        return element_force(x, steps, friction, damping, stiffness, initial_force, v)
    return march(x, v, steps, rows, initial_force, tolerance)


def integrated_sensitivities(
    rows: Array,
    columns: NDArray[np.int64],
    along: Array,
    motion: Motion,
    steps: Array,
    initial_force: float,
    initial_slopes: Array,
    tolerance: float,
) -> tuple[Array, Array]:
    """The same force, and its derivatives by v variables that move c columns of the rows and the initial force.

    Parameters
    ----------
    rows : as `integrated_force`
    columns : (c,) places in the row
    along : (n, v, c) or (1, v, c) derivatives of these columns by each variable
    motion, steps, initial_force : as `integrated_force`
    initial_slopes : (v,) derivatives of the initial force by each variable [N]
    tolerance : as `integrated_force`

    Returns
    -------
    (n,) force [N] and (n, v) its derivatives [N]
    """
    x, v = motion.displacement, motion.velocity
    if len(rows) == len(along) == 1 and plain(row_of(rows[0])) and np.all(columns <= K):
        friction, damping, stiffness = rows[0, [T0, C, K]]
        force, slopes = element_force_sensitivities(x, steps, friction, damping, stiffness, initial_force, v)
        found = slopes[:, columns] @ along[0].T
        if np.any(initial_slopes != 0.0):
            nudge = _NUDGE * max(float(np.max(np.abs(force))), np.finfo(float).tiny)
            begun = element_force(x, steps, friction, damping, stiffness, initial_force + nudge, v)
            found += np.outer((begun - force) / nudge, initial_slopes)
        return force, found
    return march_sensitivities(x, v, steps, rows, initial_force, initial_slopes, tolerance, columns, along)


def forces_beside(motion: Motion, parallel: Array) -> Array:
    """(n,) force [N] of what stands beside the element, with memory and without.

    Parameters
    ----------
    motion : (n,) sampled motion
    parallel : (n, m) or (1, m) rows of these forces
    """
    force = parallel_forces(motion.displacement, motion.velocity, motion.acceleration, parallel)
    return force + branch_forces(motion, parallel) if any_slips(parallel) else force


def constant_rows(
    friction: float, damping: float, stiffness: float, effects: Mapping[str, Mapping[str, float]]
) -> tuple[Array, Array | None]:
    """The (1, r) and (1, m) rows for `integrated_force` and `forces_beside` at constant voltage and temperature."""
    row, parallel = _NEUTRAL_ROW.copy(), _NEUTRAL_PARALLEL.copy()
    row[0, [T0, C, K]] = friction, damping, stiffness
    beside = False
    for name, values in effects.items():
        for parameter, value in values.items():
            if (place := _IN_ROW.get((name, parameter))) is not None:
                row[0, place] = value
            elif (place := _IN_PARALLEL.get((name, parameter))) is not None:
                parallel[0, place] = value
                beside = True
    return row, parallel if beside else None


def constant_value(channel: Array | None) -> Array | None:
    """(1,) value of a channel that stands still; the channel itself (n,) where it moves, None where it is absent."""
    return channel if channel is None or np.any(channel != channel[0]) else channel[:1]


def sampling_steps(time: Array) -> Array:
    """(1,) sampling interval [s] where it is even, else (n - 1,)."""
    steps = np.diff(time)
    usual = (time[-1] - time[0]) / steps.size
    return np.array([usual]) if np.max(np.abs(steps - usual)) <= _EVEN * usual else steps


def voltage_at_valve(damper: Damper, voltage: Array | None, steps: Array) -> Array | None:
    """(n,) voltage as the valve feels it [V]; None where none is given.

    Raises
    ------
    ValueError : when a parameter of the drive is given by voltage
    """
    row = drive_row_of(damper)
    if voltage is None or all(value == NEUTRAL[column] for value, column in zip(row, DRIVE, strict=True)):
        return voltage
    return effective_voltage(voltage, steps, row)


def drive_row_of(damper: Damper) -> Array:
    """(d,) the row of a damper's drive.

    Raises
    ------
    ValueError : when a parameter of the drive is given by voltage
    """
    return np.array([value_of(damper, *column) for column in DRIVE])


def element_rows(damper: Damper, effective: Array | None, temperature: Array | float | None) -> Array:
    """(n, r) parameter rows of the element with its stroke and flow effects, (1, r) where nothing moves."""
    base = material(damper, effective, temperature)
    extra = columns_of(damper, STROKE_AND_FLOW, effective)
    rows = np.hstack([np.broadcast_to(part, (max(len(base), len(extra)), part.shape[1])) for part in (base, extra)])
    return rows[:1] if np.all(rows == rows[0]) else rows


def parallel_rows(damper: Damper, effective: Array | None) -> Array | None:
    """(n, m) or (1, m) rows of the parallel effects; None without any."""
    return columns_of(damper, PARALLEL, effective) if any(name in damper.effects for name, _ in PARALLEL) else None


def sensors_of(damper: Damper) -> dict[str, dict[str, float]]:
    """Parameters of the effects of the sensor that a damper has, by effect and name.

    Raises
    ------
    ValueError : when one is given by voltage
    """
    return {
        effect.name: {p.name: value_of(damper, effect.name, p.name) for p in effect.parameters}
        for effect in acting("sensor")
        if effect.name in damper.effects
    }


def shown_moments(sensors: Mapping[str, Mapping[str, float]], time: Array) -> Array:
    """(n,) moments [s] whose force the channel shows at (n,) times [s], behind effects of the sensor."""
    for effect in acting("sensor"):
        if effect.name in sensors:
            law = functions(effect, module_of(effect))["law"]
            given = {**sensors[effect.name], "time": time}
            time = np.asarray(law(**{argument: given[argument] for argument in arguments(law)}))
    return time


def recorded(sensors: Mapping[str, Mapping[str, float]], time: Array, force: Array) -> Array:
    """(n,) force as the channel shows it behind effects of the sensor [N], linear between samples, held at the ends."""
    if all(value == NEUTRAL[name, key] for name, values in sensors.items() for key, value in values.items()):
        return force
    return np.asarray(np.interp(shown_moments(sensors, time), time, force))


def steady_force(
    damper: Damper, voltage: Array | float | None, temperature: float | None, velocity: Array | float
) -> Array:
    """Force at steady slip: what a table of force over voltage and velocity can carry.

    The oil spring has settled, so w = |v|. A force that is there at rest (a preload, `static_force`) is
    carried by the static balance and left out, as are forces by displacement and acceleration.

    Parameters
    ----------
    damper : the damper
    voltage : voltage [V], broadcast against velocity; None where the damper has a single one
    temperature : [degC]; None where the damper has a single one
    velocity : extension speed [m/s]; -0.0 and +0.0 give the two one-sided limits

    Returns
    -------
    force [N] in the broadcast shape
    """
    speeds, voltages = np.broadcast_arrays(
        np.asarray(velocity, dtype=np.float64), np.asarray(0.0 if voltage is None else voltage, dtype=np.float64)
    )
    v, u = speeds.ravel(), voltages.ravel()
    effective = None if voltage is None else u
    rows = element_rows(damper, effective, temperature)
    rows = np.array(np.broadcast_to(rows, (v.size, rows.shape[1])))
    side = np.copysign(1.0, v)
    force = np.array([s * flow_force(abs(w), row_of(row), s) for w, s, row in zip(v, side, rows, strict=True)])
    parallel = columns_of(damper, PARALLEL, effective)
    rest = np.zeros(v.size)
    moving = np.where(v == 0.0, side * np.finfo(np.float64).tiny, v)
    force += parallel_forces(rest, moving, rest, parallel) - static_force(damper, effective)
    rows_beside = np.broadcast_to(parallel, (v.size, parallel.shape[1]))
    force += [branch_steady(s, row) for s, row in zip(side, rows_beside, strict=True)]
    return force.reshape(speeds.shape)


def static_force(damper: Damper, voltage: Array | float | None) -> Array:
    """Force at rest in the middle of the stroke, such as a preload: what `steady_force` leaves out.

    Parameters
    ----------
    damper : the damper
    voltage : voltage [V]; None where the damper has a single one

    Returns
    -------
    force [N] in the shape of the voltage
    """
    u = np.asarray(0.0 if voltage is None else voltage, dtype=np.float64)
    rest = np.zeros(u.size)
    rows = columns_of(damper, PARALLEL, None if voltage is None else u.ravel())
    return parallel_forces(rest, rest, rest, rows).reshape(u.shape)
