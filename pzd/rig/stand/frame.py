"""Force of a damper in a compliant frame: the damper is extended less than the actuator moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pzd.damper.compiled.kernels import K, row_of, stroke_straight
from pzd.damper.compose import (
    integrated_force,
    parallel_force_along,
    recorded,
    respond,
    sampling_steps,
    sensors_of,
    voltage_at_valve,
)
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import element_rows, parallel_rows
from pzd.damper.path import deflections
from pzd.record import Array

TOLERANCE = 1e-7
"""Admissible error of one piece of the path, as a share of the force; steps are so short that few pieces reach it."""
_MOST_ITERATIONS = 12
"""Each takes the error of the last times the ratio of the parallel stiffness to that of the frame, which is small."""
_CONVERGED = 1e-10
"""Change of a force in an iteration that ends it, as a share of the largest force: far below `TOLERANCE`."""


def force_in_frame(damper: Damper, motion: Motion, frame_stiffness: float | None) -> Array:
    """Compute the force that the channel records, the motion being that of the actuator.

    The frame and the oil spring are springs in series, so the element is solved exactly with
    1 / k' = 1 / k + 1 / k_frame. Parallel forces are found by iteration, since they act at the damper's
    own extension, and so is the rest of a nonlinear stroke law. The frame has no mass: its resonance
    is left out, so a fluid_inertia takes the acceleration of the actuator, and a friction the speed
    behind the element's force alone.

    Equation: F = k' (x - F_beside / k_frame - y)           Source: springs in series

    Parameters
    ----------
    damper : the damper
    motion : (n,) of the actuator, with voltage and temperature
    frame_stiffness : k_frame [N/m]; None for a rigid frame

    Returns
    -------
    (n,) force [N]

    Raises
    ------
    ValueError : when the damper needs a voltage or temperature that the motion does not have
    """
    if frame_stiffness is None:
        return respond(damper, motion, tolerance=TOLERANCE)
    motion = motion.centred_on(damper.zero_m)
    steps = sampling_steps(motion.time)
    effective = voltage_at_valve(damper, motion.voltage, steps)
    own = np.array(element_rows(damper, effective, motion.temperature))
    rows = own.copy()
    rows[:, K] /= 1.0 + own[:, K] / frame_stiffness
    force = integrated_force(rows, motion, steps, 0.0, TOLERANCE)
    parallel = parallel_rows(damper, effective)
    if parallel is not None or not all(stroke_straight(row_of(row)) for row in own):
        force = _iterated(motion, steps, own, rows, parallel, force, frame_stiffness)
    return recorded(sensors_of(damper), motion.time, force)


def _iterated(
    motion: Motion,
    steps: Array,
    own: Array,
    rows: Array,
    parallel: Array | None,
    element: Array,
    frame_stiffness: float,
) -> Array:
    """Force (n,) of the element and the parallel effects, iterated from that of the element alone.

    Parameters
    ----------
    motion : (n,) of the actuator
    steps : sampling intervals [s]
    own, rows : (n, r) or (1, r) rows of the element, and the same with the spring k' in place of k
    parallel : rows of the parallel effects; None without any
    element : (n,) force of the element alone [N]
    frame_stiffness : k_frame [N/m]
    """
    velocity = motion.velocity - np.gradient(element, motion.time) / frame_stiffness
    bent = not all(stroke_straight(row_of(row)) for row in own)
    more, bend = np.zeros(element.size), np.zeros(element.size)
    for _ in range(_MOST_ITERATIONS):
        total, last = element + more, (more, bend)
        if parallel is not None:
            at = motion.displacement - total / frame_stiffness
            more = parallel_force_along(replace(motion, displacement=at, velocity=velocity), parallel)
        if bent:
            bend = deflections(element, rows) - deflections(element, own) - element / frame_stiffness
        change = max(np.max(np.abs(more - last[0])), frame_stiffness * np.max(np.abs(bend - last[1])))
        if change <= _CONVERGED * np.max(np.abs(total)):
            break
        behind = replace(motion, displacement=motion.displacement - more / frame_stiffness + bend)
        element = integrated_force(rows, behind, steps, 0.0, TOLERANCE)
    return np.asarray(element + more)
