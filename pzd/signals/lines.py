"""A control signal between its steps: where noise is all that it differs from a line by, it is that line.

Noise of the recorded signal is none of the valve's, and a law that follows it steps in the force wherever the noise
turns. A level that is held and a ramp are lines; what is bent stays as it was recorded.
"""

from __future__ import annotations

import numpy as np

from pzd.record import Array
from pzd.signals.jumps import USUAL

SUDDEN = 6.0
"""A change from one sample to the next of so many times its usual scatter is a step, or part of one."""
FEWEST = 10
"""Samples from which a stretch is held against a line."""
BY_NOISE = 1.5
"""A stretch whose r.m.s. about its line is at most so many times the noise of a sample is that line."""


def without_noise(values: Array) -> Array:
    """A signal whose levels and ramps are free of noise.

    Parameters
    ----------
    values : (n,) of a signal that steps, is held, rises and falls

    Returns
    -------
    (n,) by least squares on each stretch between two steps that is a line but for noise; the rest as it is
    """
    changes = np.diff(values)
    usual = np.median(changes) if changes.size else 0.0
    scatter = USUAL * float(np.median(np.abs(changes - usual))) if changes.size else 0.0
    if scatter == 0.0:
        return values
    ends = np.flatnonzero(np.abs(changes - usual) > SUDDEN * scatter) + 1
    found = values.copy()
    for part in np.split(np.arange(values.size), ends):
        if part.size >= FEWEST:
            line = np.polyval(np.polyfit(part - part.mean(), values[part], 1), part - part.mean())
            if np.sqrt(np.mean((values[part] - line) ** 2)) <= BY_NOISE * scatter / np.sqrt(2.0):
                found[part] = line
    return found
