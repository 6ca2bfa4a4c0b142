"""Force of a damper behind a frame that gives: the damper is extended less than the actuator moves."""

from __future__ import annotations

import numpy as np

from pzd.damper.compose import (
    element_rows,
    parallel_rows,
    recorded,
    respond,
    sampling_steps,
    value_of,
    voltage_at_valve,
)
from pzd.damper.flow import ROW
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.damper.parallel import parallel_forces
from pzd.damper.path import march
from pzd.record import Array

TOLERANCE = 1e-7
"""Admissible error of one piece of the path, as a share of the force; steps are so short that few pieces reach it."""
_ROUNDS = 12
_SETTLED = 1e-10  # change of the parallel force in a round, as a share of the largest force
_STIFFNESS = ROW.index("k")


def force_in_frame(damper: Damper, motion: Motion, frame_stiffness: float | None) -> Array:
    """Force that the channel records, the motion being that of the actuator.

    The frame and the oil spring are springs in series, so the element is solved exactly with
    1 / k' = 1 / k + 1 / k_frame; forces beside it are found by rounds, since they act at the
    damper's own extension. The frame has no mass: its resonance is left out, so a fluid_inertia
    takes the acceleration of the actuator, and a friction the speed behind the element's force alone.

    Equation: F = k' (x - F_beside / k_frame - y)           Source: springs in series

    Parameters
    ----------
    damper : the damper
    motion : (n,) of the actuator, with voltage and temperature
    frame_stiffness : k_frame [N/m]; None where the frame does not give

    Returns
    -------
    (n,) force [N]

    Raises
    ------
    ValueError : when the damper needs a voltage or temperature that the motion does not have
    """
    if frame_stiffness is None:
        return respond(damper, motion, tolerance=TOLERANCE)
    motion = motion.about(damper.zero_m)
    steps = sampling_steps(motion.time)
    effective = voltage_at_valve(damper, motion.voltage, steps)
    rows = np.array(element_rows(damper, effective, motion.temperature))
    rows[:, _STIFFNESS] /= 1.0 + rows[:, _STIFFNESS] / frame_stiffness
    element = march(motion.displacement, motion.velocity, steps, rows, 0.0, TOLERANCE)
    parallel = parallel_rows(damper, effective)
    force = element if parallel is None else _with_parallel(motion, steps, rows, parallel, element, frame_stiffness)
    return recorded(value_of(damper, "sensor_delay", "tau"), motion.time, force)


def _with_parallel(
    motion: Motion, steps: Array, rows: Array, parallel: Array, element: Array, frame_stiffness: float
) -> Array:
    """(n,) force of the element and of what stands beside it, in rounds from that of the element alone."""
    velocity = motion.velocity - np.gradient(element, motion.time) / frame_stiffness
    more = np.zeros(element.size)
    for _ in range(_ROUNDS):
        total = element + more
        own = motion.displacement - total / frame_stiffness
        last, more = more, parallel_forces(own, velocity, motion.acceleration, parallel)
        if np.max(np.abs(more - last)) <= _SETTLED * np.max(np.abs(total)):
            break
        shifted = motion.displacement - more / frame_stiffness
        element = march(shifted, motion.velocity, steps, rows, 0.0, TOLERANCE)
    return np.asarray(element + more)
