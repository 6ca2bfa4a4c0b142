"""What a damper predicts for a record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion, parts_of_steps, steps_of_voltage
from pzd.diagnose.data.cleaning import Prepared
from pzd.identify.trial import in_motion
from pzd.record import Array, Record, Rows
from pzd.signals.reversals import reversals

FEWEST_IN_HALF_CYCLE = 25
"""Samples of the fastest half cycle from which a parabola between them is exact enough: 1e-4 of the force."""
PREDICTION_TOLERANCE = 1e-7
"""Of the damper's path, as a share of the force.

Reason: far below `weights.RESOLUTION`; see `likelihood.SIMULATION_TOLERANCE`."""

WARMS = 0.5
"""A test over which the temperature moves by less [K] counts as its average cycle, at one temperature.

Reason: about the resolution of a thermocouple; not tuned."""
HELD = 0.05
"""A temperature that moves by less [K] over a test stands still there.

Reason: of 5 % a kelvin, which is much for an oil, the force changes by 0.25 % of itself, which counts as nothing."""
BESIDE_STEP = 0.001
"""Nothing is judged so shortly before and after a step of the voltage [s].

Reason: two standard deviations of a test's own delay (`NuisanceConfig.delay_s`); a sample at least, over which a filter
against aliasing spreads the step of the force."""
ENDS = 0.02
"""Share of a record at either end where its smoothed displacement rests on one side alone: not judged."""


def predicted_force(damper: Damper, prepared: Prepared) -> Array:
    """(n,) force that the damper gives under the record's cleaned motion [N]."""
    record = prepared.lead or prepared.record
    return force_in(damper, record)[prepared.lead_samples :]


def force_in(damper: Damper, record: Record) -> Array:
    """(n,) force that the damper gives in the motion of a record, from the recorded force on [N]."""
    motion, places = motion_of(record)
    return respond(damper, motion, float(record.force[0]), PREDICTION_TOLERANCE)[places]


def motion_of(record: Record) -> tuple[Motion, Rows]:
    """The record's motion, on a finer grid where its samples are too far apart.

    That is where no parabola goes from one to the next, and where the voltage steps between two.

    Parameters
    ----------
    record : cleaned; a temperature that hardly moves counts as standing still, at its median

    Returns
    -------
    the motion, and (n,) which of its samples are those of the record
    """
    size = record.time.size
    half_cycle = min(np.diff(reversals(record.displacement)), default=size)
    fewest = int(np.ceil(FEWEST_IN_HALF_CYCLE / max(half_cycle, 1)))
    motion, places = Motion.of(record).finer(np.maximum(parts_of_steps(record.voltage, size), fewest))
    if motion.temperature is not None and not warms(motion.temperature, HELD):
        held = np.full(motion.temperature.size, np.median(motion.temperature))
        motion = replace(motion, temperature=held)
    return motion, places


def warms(temperature: Array | None, by: float = WARMS) -> bool:
    """Whether a temperature (n,) moves by so much [K] from beginning to end; False where none was recorded."""
    return temperature is not None and float(np.ptp(ends(temperature))) > by


def ends(temperature: Array) -> tuple[float, float]:
    """Temperature [degC] at the beginning and at the end of a test, the noise of (n,) samples averaged out."""
    tenth = max(temperature.size // 10, 1)
    return float(np.median(temperature[:tenth])), float(np.median(temperature[-tenth:]))


def counted(prepared: Prepared) -> NDArray[np.bool_]:
    """(n,) whether the prediction depends neither on how the record began nor on when exactly a voltage stepped.

    And whether something moves, or has just come to rest.
    """
    size = prepared.record.time.size
    if prepared.lead is not None:
        return np.ones(size, dtype=np.bool_)
    ends = int(ENDS * size)
    order = np.arange(size)
    inside = (order >= ends) & (order < size - ends)
    return inside & in_motion(prepared.record) & ~_stepping(prepared.record)


def _stepping(record: Record) -> NDArray[np.bool_]:
    """(n,) whether the voltage steps shortly before or after a sample."""
    size = record.time.size
    steps = np.append(steps_of_voltage(record.voltage, size), False)
    if not steps.any():
        return steps
    reach = int(np.ceil(BESIDE_STEP * record.rate))
    near = np.convolve(steps, np.ones(2 * reach + 2))[reach : reach + size]
    beside: NDArray[np.bool_] = near > 0.5
    return beside
