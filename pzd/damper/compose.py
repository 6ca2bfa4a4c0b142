"""Force of the whole damper: drive, material, stroke, flow, parallel forces and sensor in their order."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pzd.compiled import compiled
from pzd.damper.compiled import kernels
from pzd.damper.compiled.columns import DRIVE, NEUTRAL, PARALLEL, acting, columns_of, value_of
from pzd.damper.compiled.kernels import T0, C, K
from pzd.damper.confounders import module_of
from pzd.damper.effect import arguments, functions
from pzd.damper.element import element_force, element_force_sensitivities
from pzd.damper.flow import flow_force
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import drive_row_of, effective_voltage, element_rows, parallel_rows
from pzd.damper.path import Variables, march, march_sensitivities
from pzd.record import Array

BRANCHES = len(acting("branch"))
"""Number of branches, each with a deflection of its own."""
MEMORYLESS = sum(len(effect.parameters) for effect in acting("parallel"))
"""Number of columns of a row of the parallel forces that belong to those without memory."""
TOLERANCE = 1e-9
"""Admissible error of one piece of the path, as a share of the force."""


_EVEN = 1e-6  # of the mean sampling interval: less is rounding of the recorded times
_NUDGE = 1e-6  # of the largest force, for the derivative by the initial one: about half the digits of a double


def respond(damper: Damper, motion: Motion, first_force: float | None = None, tolerance: float = TOLERANCE) -> Array:
    """Compute the force that the force channel records while the damper follows a motion.

    Parameters
    ----------
    damper : the damper with its effects
    motion : (n,) sampled motion, its displacement as recorded; the extension is a parabola inside each step,
        voltage and temperature go linearly
    first_force : force of the whole damper at the first sample [N], of which the element carries what the parallel
        forces do not; None for an element that is relaxed there
    tolerance : admissible error of a piece, as a share of the force

    Returns
    -------
    (n,) force [N]

    Raises
    ------
    ValueError : when the damper needs a voltage or temperature that the motion does not have

    Examples
    --------
    >>> from pzd.damper.model import BaseRow, Damper
    >>> from pzd.damper.motion import Motion
    >>> damper = Damper(base=(BaseRow(T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),))
    >>> time, none = np.arange(3.0), np.zeros(3)
    >>> respond(damper, Motion(time, 0.001 * time, none, none)).round(3).tolist()
    [0.0, 200.0, 302.7]
    """
    motion = motion.centred_on(damper.zero_m)
    steps = sampling_steps(motion.time)
    effective = voltage_at_valve(damper, constant_value(motion.voltage), steps)
    rows = element_rows(damper, effective, constant_value(motion.temperature))
    parallel = parallel_rows(damper, effective)
    parallel_force = np.zeros(1) if parallel is None else parallel_force_along(motion, parallel)
    initial = 0.0 if first_force is None else first_force - float(parallel_force[0])
    force = integrated_force(rows, motion, steps, initial, tolerance) + parallel_force
    return recorded(sensors_of(damper), motion.time, force)


def integrated_force(rows: Array, motion: Motion, steps: Array, initial_force: float, tolerance: float) -> Array:
    """Compute the (n,) force [N] of the element with its stroke and flow effects.

    An element without effects and with constant parameters is solved in closed form, all else piece by piece.

    Parameters
    ----------
    rows : (n, r) or (1, r) parameter rows, see `kernels.Row`
    motion : (n,) sampled motion
    steps : (n - 1,) or (1,) sampling intervals [s]
    initial_force : force of the element at the first sample [N]
    tolerance : admissible error of a piece, as a share of the force
    """
    x, v = motion.displacement, motion.velocity
    if len(rows) == 1 and kernels.no_effects(kernels.row_of(rows[0])):
        friction, damping, stiffness = rows[0, [T0, C, K]]
        return element_force(x, steps, friction, damping, stiffness, initial_force, v)
    return march(x, v, steps, rows, initial_force, tolerance)


def integrated_sensitivities(
    rows: Array, variables: Variables, motion: Motion, steps: Array, initial_force: float, tolerance: float
) -> tuple[Array, Array]:
    """Compute the same force, and its derivatives by v variables.

    Parameters
    ----------
    rows : as `integrated_force`
    variables : what they change of the rows and of the initial force
    motion, steps, initial_force, tolerance : as `integrated_force`

    Returns
    -------
    (n,) force [N] and (n, v) its derivatives [N]
    """
    columns, along, initial_slopes = variables
    x, v = motion.displacement, motion.velocity
    if len(rows) == len(along) == 1 and kernels.no_effects(kernels.row_of(rows[0])) and np.all(columns <= K):
        friction, damping, stiffness = rows[0, [T0, C, K]]
        force, slopes = element_force_sensitivities(x, steps, friction, damping, stiffness, initial_force, v)
        found = slopes[:, columns] @ along[0].T
        if np.any(initial_slopes != 0.0):
            nudge = _NUDGE * max(float(np.max(np.abs(force))), np.finfo(float).tiny)
            begun = element_force(x, steps, friction, damping, stiffness, initial_force + nudge, v)
            found += np.outer((begun - force) / nudge, initial_slopes)
        return force, found
    return march_sensitivities(x, v, steps, rows, initial_force, tolerance, variables)


def parallel_force_along(motion: Motion, parallel: Array) -> Array:
    """Compute the (n,) sum of the forces parallel to the element [N], with memory and without.

    Parameters
    ----------
    motion : (n,) sampled motion
    parallel : (n, m) or (1, m) rows of these forces
    """
    force = kernels.parallel_forces(motion.displacement, motion.velocity, motion.acceleration, parallel)
    return force + branch_forces(motion, parallel) if any_slips(parallel) else force


_STANDSTILL = 1e-9
"""Speed to either side of standstill at which forces beside the element are compared [m/s]: no friction is slower."""


def jump_at_reversal(damper: Damper) -> float:
    """Compute by how much the forces beside the element jump where the rod reverses [N]: twice a seal's friction.

    Parameters
    ----------
    damper : of which the voltage with the largest jump counts
    """
    either_way, still = np.array([-_STANDSTILL, _STANDSTILL]), np.zeros(2)
    voltages = [None if row.voltage_V is None else np.array([row.voltage_V]) for row in damper.base]
    rows = [parallel_rows(damper, voltage) for voltage in voltages]
    forces = [kernels.parallel_forces(still, either_way, still, each) for each in rows if each is not None]
    return max((abs(float(force[1] - force[0])) for force in forces), default=0.0)


def parallel_force_change(motions: tuple[Motion, Motion], rows: tuple[Array, Array]) -> Array:
    """Compute by how much the parallel forces differ (n,) between two sets of parameters [N].

    Branches follow the travel of the rod, whatever its zero: where their parameters are the same they are left out.

    Parameters
    ----------
    motions : (n,) sampled motion, counted from the zero of either set
    rows : (n, m) or (1, m) rows of these forces
    """
    one, other = (
        kernels.parallel_forces(motion.displacement, motion.velocity, motion.acceleration, each)
        for motion, each in zip(motions, rows, strict=True)
    )
    change = other - one
    if not np.array_equal(rows[0][:, MEMORYLESS:], rows[1][:, MEMORYLESS:]):
        change += branch_forces(motions[1], rows[1]) - branch_forces(motions[0], rows[0])
    return change


def branch_forces(motion: Motion, rows: Array) -> Array:
    """Compute the force of the branches along a motion, from rest at its first sample.

    The extension is a parabola inside each step, cut where the rod reverses. With constant parameters this is exact;
    where they vary, those at the end of each step are used, which is of order two.

    Parameters
    ----------
    motion : (n,) sampled motion
    rows : (n, m) or (1, m) rows of the parallel forces, linear between samples

    Returns
    -------
    (n,) force [N]
    """
    force = np.zeros(motion.time.size)
    _fill_branches(motion.displacement, motion.velocity, motion.time, rows, np.zeros(BRANCHES), force)
    return force


@compiled
def any_slips(rows: Array) -> bool:
    """Return whether a branch acts in one of the (n, m) rows of the parallel forces."""
    found = False
    for i in range(rows.shape[0]):
        found = found or kernels.branch_steady(1.0, rows[i]) != 0.0
    return found


@compiled
def _fill_branches(x: Array, v: Array, time: Array, rows: Array, state: Array, force: Array) -> None:
    """Fill the force, and advance the deflections in `state` in place."""
    last = rows.shape[0] - 1
    for i in range(1, x.size):
        now = rows[min(i, last)]
        travel, h = x[i] - x[i - 1], time[i] - time[i - 1]
        half = 0.5 * (v[i] - v[i - 1])
        advance_branches(travel, travel / h - half, travel / h + half, h, state, now)
        force[i] = kernels.branch_force(0.0, state, now)


@compiled
def advance_branches(travel: float, u0: float, u1: float, h: float, state: Array, row: Array) -> None:
    """Advance the deflections of the branches [m] over one step, cut where the rod reverses.

    Parameters
    ----------
    travel : of the rod [m]
    u0, u1 : extension speed at the start and at the end [m/s]
    h : length of the step [s]
    state : (b,) deflections [m], changed in place
    row : (m,) row of the parallel forces at the end of the step
    """
    if u0 * u1 < 0.0:
        way = 0.5 * u0 * u0 / (u0 - u1) * h
        kernels.branches_follow(way, state, row)
        travel -= way
    kernels.branches_follow(travel, state, row)


def constant_value(channel: Array | None) -> Array | None:
    """Return the (1,) value of a constant channel, the (n,) channel itself where it varies, None where it is absent."""
    return channel if channel is None or np.any(channel != channel[0]) else channel[:1]


def sampling_steps(time: Array) -> Array:
    """Return the (1,) sampling interval [s] where it is even, else (n - 1,)."""
    steps = np.diff(time)
    mean = (time[-1] - time[0]) / steps.size
    return np.array([mean]) if np.max(np.abs(steps - mean)) <= _EVEN * mean else steps


def voltage_at_valve(damper: Damper, voltage: Array | None, steps: Array) -> Array | None:
    """Compute the (n,) effective voltage [V]; None where none is given.

    Raises
    ------
    ValueError : when a parameter of the drive has one value per voltage
    """
    row = drive_row_of(damper)
    if voltage is None or all(value == NEUTRAL[column] for value, column in zip(row, DRIVE, strict=True)):
        return voltage
    return effective_voltage(voltage, steps, row)


def sensors_of(damper: Damper) -> dict[str, dict[str, float]]:
    """Return the parameters of the sensor effects of a damper, by effect and name.

    Raises
    ------
    ValueError : when one has one value per voltage
    """
    return {
        effect.name: {p.name: value_of(damper, effect.name, p.name) for p in effect.parameters}
        for effect in acting("sensor")
        if effect.name in damper.effects
    }


def shown_moments(sensors: Mapping[str, Mapping[str, float]], time: Array) -> Array:
    """Compute the (n,) moments [s] whose force the channel shows at (n,) times [s], behind effects of the sensor."""
    for effect in acting("sensor"):
        if effect.name in sensors:
            law = functions(effect, module_of(effect))["law"]
            given = {**sensors[effect.name], "time": time}
            time = np.asarray(law(**{argument: given[argument] for argument in arguments(law)}))
    return time


def recorded(sensors: Mapping[str, Mapping[str, float]], time: Array, force: Array) -> Array:
    """Compute the (n,) force behind effects of the sensor [N], linear between samples, constant beyond the ends."""
    if all(value == NEUTRAL[name, key] for name, values in sensors.items() for key, value in values.items()):
        return force
    return np.asarray(np.interp(shown_moments(sensors, time), time, force))


def steady_force(
    damper: Damper, voltage: Array | float | None, temperature: float | None, velocity: Array | float
) -> Array:
    """Compute the force at steady slip, which a table of force over voltage and velocity can hold.

    The elastic deflection is constant, so w = |v|. A force at rest (a preload, `static_force`) is left to the static
    balance, as are forces by displacement and acceleration.

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
    force = np.array([s * flow_force(abs(w), kernels.row_of(row), s) for w, s, row in zip(v, side, rows, strict=True)])
    parallel = columns_of(damper, PARALLEL, effective)
    rest = np.zeros(v.size)
    moving = np.where(v == 0.0, side * np.finfo(np.float64).tiny, v)
    force += kernels.parallel_forces(rest, moving, rest, parallel) - static_force(damper, effective)
    branch_rows = np.broadcast_to(parallel, (v.size, parallel.shape[1]))
    force += [kernels.branch_steady(s, row) for s, row in zip(side, branch_rows, strict=True)]
    return force.reshape(speeds.shape)


def static_force(damper: Damper, voltage: Array | float | None) -> Array:
    """Compute the force at rest in the middle of the stroke, such as a preload, which `steady_force` leaves out.

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
    return kernels.parallel_forces(rest, rest, rest, rows).reshape(u.shape)
