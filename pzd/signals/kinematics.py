"""Velocity and acceleration from the displacement, without differencing samples.

Where cycles repeat, the average cycle is differentiated with the harmonics that exceed their own scatter; elsewhere
the displacement is smoothed by cross-validation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pzd.record import Array
from pzd.signals.cycles import Cycles
from pzd.signals.measures import usual_step
from pzd.signals.smoothing import HIGHEST, low_pass
from pzd.signals.splines import even_cubic, even_derivatives, is_even

STANDARD_ERRORS = 4.0
"""A harmonic is kept where its mean exceeds this many standard errors: noise does so once in 10^7."""
DRIFT_CORNER = 3.0
"""Corner of the drift about the average cycle, in cycles: quicker departures are noise."""


class Kinematics(NamedTuple):
    """Motion without its noise, in the unit of the displacement and s; every array is (n,)."""

    displacement: Array
    velocity: Array
    acceleration: Array


def kinematics(time: Array, displacement: Array, run: Cycles | None) -> Kinematics:
    """Compute displacement, velocity and acceleration without the noise of the displacement sensor.

    Parameters
    ----------
    time : (n,) strictly increasing [s]
    displacement : (n,) [m]
    run : the cycles that repeat, None where none do

    Returns
    -------
    inside the run from the average cycle plus a slow drift, outside from the smoothed displacement
    """
    if run is None:
        return _smoothed_motion(time, displacement, np.inf)
    inside = run.inside(time)
    cyclic = _average_cycle(time, displacement - mean_over_period(time, displacement, run), run)
    drift = _smoothed_motion(time[inside], displacement[inside] - cyclic.displacement, DRIFT_CORNER * run.frequency)
    repeating = Kinematics(*(one + other for one, other in zip(cyclic, drift, strict=True)))
    if inside.all():
        return repeating
    motion = _smoothed_motion(time, displacement, np.inf)
    for whole, part in zip(motion, repeating, strict=True):
        whole[inside] = part
    return motion


def significant_harmonics(folded: Array) -> Array:
    """Find the harmonics whose mean exceeds its scatter over the cycles, as a mask (points // 2 + 1,).

    Equation: abs(mean c_h) > 4 sqrt(sum abs(c_h - mean)^2 / (n (n - 1)))     Source: standard error of a complex mean

    Parameters
    ----------
    folded : (cycles, points) one row a cycle, at least two
    """
    spectrum = np.fft.rfft(folded, axis=1)
    mean = spectrum.mean(axis=0)
    count = folded.shape[0]
    error = np.sqrt(np.sum(np.abs(spectrum - mean) ** 2, axis=0) / (count * (count - 1)))
    kept = np.abs(mean) > STANDARD_ERRORS * error + 1e-12 * np.abs(mean).max()
    kept[0] = True
    if folded.shape[1] % 2 == 0:
        kept[-1] = False
    return np.asarray(kept)


def mean_over_period(time: Array, displacement: Array, run: Cycles) -> Array:
    """Compute the mean over one period around every sample (n,), to which no harmonic of the cycle contributes.

    Half a cycle at either end of the run is extrapolated linearly; outside the run the mean is constant.
    """
    from scipy.integrate import cumulative_trapezoid

    whole = cumulative_trapezoid(displacement, time, initial=0)
    half = 0.5 * run.period
    middle = np.linspace(run.start + half, min(run.end, float(time[-1])) - half, 4 * run.count)
    mean = (np.interp(middle + half, time, whole) - np.interp(middle - half, time, whole)) / run.period
    edge = min(4, mean.size) - 1
    first = mean[0] - half * (mean[edge] - mean[0]) / (middle[edge] - middle[0])
    last = mean[-1] + half * (mean[-1] - mean[-1 - edge]) / (middle[-1] - middle[-1 - edge])
    knots = np.concatenate(([middle[0] - half], middle, [middle[-1] + half]))
    return np.asarray(np.interp(time, knots, np.concatenate(([first], mean, [last]))))


def _average_cycle(time: Array, displacement: Array, run: Cycles) -> Kinematics:
    """Return the average cycle and its derivatives at the samples inside the run."""
    folded = run.fold(time, displacement)
    points = folded.shape[1]
    spectrum = np.where(significant_harmonics(folded), np.fft.rfft(folded.mean(axis=0)), 0.0)
    rate = 2j * np.pi * np.arange(spectrum.size) * run.frequency
    fine = 8 * points
    cycle = np.stack([np.fft.irfft(spectrum * rate**order, fine) * (fine / points) for order in range(3)], axis=1)
    phase = run.phase(time[run.inside(time)])
    wrapped = even_cubic(cycle, periodic=True)(fine * phase)
    return Kinematics(*np.ascontiguousarray(wrapped.T))


def _smoothed_motion(time: Array, displacement: Array, highest: float) -> Kinematics:
    """Smooth the displacement by cross-validation, with a corner of at most `highest` [Hz]."""
    steps = np.diff(time)
    step = max(usual_step(time), float(time[-1] - time[0]) / (4.0 * time.size))
    regular = bool(np.all(np.abs(steps - step) < 1e-3 * step))
    grid = time if regular else np.arange(time[0], time[-1] + 0.5 * step, step)
    values = displacement if regular else np.interp(grid, time, displacement)
    smooth = low_pass(values, min(2.0 * np.pi * highest * step, HIGHEST))
    if regular and is_even(time):
        speed, acceleration = even_derivatives(smooth)
        return Kinematics(smooth, speed / step, acceleration / step**2)
    from scipy.interpolate import CubicSpline

    course = CubicSpline(grid, smooth)
    return Kinematics(course(time), course(time, 1), course(time, 2))
