"""The whole damper: drive, material, stroke, flow, parallel forces and sensor in their order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pzd.damper.competing_forms import known
from pzd.damper.drive import effective_voltage
from pzd.damper.effects import library
from pzd.damper.effects.sensor_delay import law as moment
from pzd.damper.flow import ROW, flow_force
from pzd.damper.material import base_voltages, material
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.damper.parallel import COLUMNS, parallel_forces
from pzd.damper.path import march
from pzd.damper.rows import row_of

Array = NDArray[np.float64]

TOLERANCE = 1e-9
"""Admissible error of one piece of the path, as a share of the force."""

_FLOW_COLUMNS = tuple(
    (effect.name, parameter.name)
    for column in ROW[3:]
    for effect in library().values()
    for parameter in effect.parameters
    if parameter.name == column and effect.place in ("stroke", "flow")
)
_NEUTRAL = {(e.name, p.name): p.neutral for e in known().values() for p in e.parameters}
_EVEN = 1e-6  # of the median sampling interval


def respond(damper: Damper, motion: Motion, initial_force: float = 0.0, tolerance: float = TOLERANCE) -> Array:
    """Force that the force channel records while the damper goes through a motion.

    Parameters
    ----------
    damper : the damper with its effects
    motion : (n,) sampled motion, its displacement as recorded; the extension is a parabola inside each step,
        voltage and temperature go linearly
    initial_force : force of the oil spring at the first sample [N]
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
    effective = voltage_at_valve(damper, standing(motion.voltage), steps)
    rows = element_rows(damper, effective, standing(motion.temperature))
    parallel = parallel_rows(damper, effective)
    force = with_parallel(element_force(rows, motion, steps, initial_force, tolerance), parallel, motion)
    return recorded(value_of(damper, "sensor_delay", "tau"), motion.time, force)


def element_force(rows: Array, motion: Motion, steps: Array, initial_force: float, tolerance: float) -> Array:
    """(n,) force [N] of the element with its stroke and flow effects.

    Parameters
    ----------
    rows : (n, 10) or (1, 10) parameter rows
    motion : (n,) sampled motion
    steps : (n - 1,) or (1,) sampling intervals [s]
    initial_force : force of the oil spring at the first sample [N]
    tolerance : admissible error of a piece, as a share of the force
    """
    return march(motion.displacement, motion.velocity, steps, rows, initial_force, tolerance)


def with_parallel(force: Array, parallel: Array | None, motion: Motion) -> Array:
    """(n,) force [N] of the element together with what stands beside it.

    Parameters
    ----------
    force : (n,) of the element [N]
    parallel : (n, m) or (1, m) rows of the parallel effects; None without any
    motion : (n,) sampled motion
    """
    if parallel is None:
        return force
    return force + parallel_forces(motion.displacement, motion.velocity, motion.acceleration, parallel)


def constant_rows(
    friction: float, damping: float, stiffness: float, effects: Mapping[str, Mapping[str, float]]
) -> tuple[Array, Array | None]:
    """The (1, 10) and (1, m) rows for `element_force` and `with_beside` where voltage and temperature stand still."""
    flow = [effects.get(name, {}).get(parameter, _NEUTRAL[name, parameter]) for name, parameter in _FLOW_COLUMNS]
    row = np.array([[friction, damping, stiffness, *flow]])
    if not any(name in effects for name, _ in COLUMNS):
        return row, None
    return row, np.array([[effects.get(n, {}).get(parameter, _NEUTRAL[n, parameter]) for n, parameter in COLUMNS]])


def standing(channel: Array | None) -> Array | None:
    """(1,) value of a channel that stands still; the channel itself (n,) where it moves, None where it is absent."""
    return channel if channel is None or np.any(channel != channel[0]) else channel[:1]


def sampling_steps(time: Array) -> Array:
    """(1,) sampling interval [s] where it is even, else (n - 1,)."""
    steps = np.diff(time)
    usual = (time[-1] - time[0]) / steps.size
    return np.array([usual]) if np.max(np.abs(steps - usual)) <= _EVEN * usual else steps


def voltage_at_valve(damper: Damper, voltage: Array | None, steps: Array) -> Array | None:
    """(n,) voltage as the valve feels it [V]; None where none is given."""
    tau, r = value_of(damper, "valve_lag", "tau"), value_of(damper, "piezo_hysteresis", "r")
    if voltage is None or (tau == 0.0 and r == 0.0):
        return voltage
    return effective_voltage(voltage, steps, tau, r)


def element_rows(damper: Damper, effective: Array | None, temperature: Array | float | None) -> Array:
    """(n, 10) parameter rows of the element with its stroke and flow effects, (1, 10) where nothing moves."""
    base = material(damper, effective, temperature)
    extra = _effect_columns(damper, _FLOW_COLUMNS, effective)
    rows = np.hstack([np.broadcast_to(part, (max(len(base), len(extra)), part.shape[1])) for part in (base, extra)])
    return rows[:1] if np.all(rows == rows[0]) else rows


def parallel_rows(damper: Damper, effective: Array | None) -> Array | None:
    """(n, m) or (1, m) rows of the parallel effects; None without any."""
    return (
        _effect_columns(damper, COLUMNS, effective) if any(effect in damper.effects for effect, _ in COLUMNS) else None
    )


def recorded(tau: float, time: Array, force: Array) -> Array:
    """(n,) force as a channel delayed by tau [s] shows it [N], linear between samples, held before the first."""
    return force if tau == 0.0 else np.asarray(np.interp(moment(time, tau), time, force))


def steady_force(
    damper: Damper, voltage: Array | float | None, temperature: float | None, velocity: Array | float
) -> Array:
    """Force at steady slip: what a table of force over voltage and velocity can carry.

    The oil spring has settled, so w = |v|. A force that is there at rest (a preload) is carried by
    the static balance and left out, as are forces by displacement and acceleration.

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
    rows = np.broadcast_to(element_rows(damper, effective, temperature), (v.size, len(ROW)))
    side = np.copysign(1.0, v)
    force = np.array([s * flow_force(abs(w), row_of(row), s) for w, s, row in zip(v, side, rows, strict=True)])
    parallel = _effect_columns(damper, COLUMNS, effective)
    rest = np.zeros(v.size)
    moving = np.where(v == 0.0, side * np.finfo(np.float64).tiny, v)
    force += parallel_forces(rest, moving, rest, parallel) - parallel_forces(rest, rest, rest, parallel)
    return force.reshape(speeds.shape)


@dataclass(frozen=True, eq=False)
class Nodes:
    """A damper at one temperature, laid out for compiled loops: all of it piecewise linear in the effective voltage."""

    voltages: Array
    """(m,) rising nodes [V]; held beyond."""
    rows: Array
    """(m, 10) parameter rows of the element."""
    parallel: Array
    """(m, b) rows of the parallel effects, columns as `beside.COLUMNS`."""
    tau: float
    """Time constant of the valve lag [s]."""
    r: float
    """Half-width of the play [V]."""


def nodes_of(damper: Damper, temperature: float | None) -> Nodes:
    """The damper at one temperature [degC], laid out for compiled loops."""
    listed = [values["at_voltage_V"] for values in damper.effects.values() if "at_voltage_V" in values]
    voltages = np.unique(np.concatenate([base_voltages(damper), *(np.atleast_1d(v) for v in listed)]))
    shape = (voltages.size, -1)
    rows = element_rows(damper, voltages, temperature)
    parallel = _effect_columns(damper, COLUMNS, voltages)
    return Nodes(
        voltages,
        np.broadcast_to(rows, (voltages.size, rows.shape[1])).reshape(shape).copy(),
        np.broadcast_to(parallel, (voltages.size, parallel.shape[1])).reshape(shape).copy(),
        value_of(damper, "valve_lag", "tau"),
        value_of(damper, "piezo_hysteresis", "r"),
    )


def value_of(damper: Damper, effect: str, parameter: str) -> float:
    """A parameter that is one number: the damper's, or the neutral one where it lacks the effect.

    Raises
    ------
    ValueError : when the damper gives it by voltage
    """
    value = damper.effects.get(effect, {}).get(parameter, _NEUTRAL[effect, parameter])
    if isinstance(value, tuple):
        raise ValueError(f"{effect}.{parameter} must be one number, not a list by voltage")  # noqa: TRY004  # a wrong value of a config
    return value


def _effect_columns(damper: Damper, columns: tuple[tuple[str, str], ...], effective: Array | None) -> Array:
    """(n, m) or (1, m) values of effect parameters, by the effective voltage where they are lists."""
    values = [_column(damper, effect, parameter, effective) for effect, parameter in columns]
    return np.stack(np.broadcast_arrays(*values), axis=-1)


def _column(damper: Damper, effect: str, parameter: str, effective: Array | None) -> Array:
    given = damper.effects.get(effect, {})
    value = given.get(parameter, _NEUTRAL[effect, parameter])
    if not isinstance(value, tuple):
        return np.array([value])
    if effective is None:
        raise ValueError(f"{effect}.{parameter} depends on the voltage, and none is given")
    return np.asarray(np.interp(effective, np.atleast_1d(given["at_voltage_V"]), np.array(value)))
