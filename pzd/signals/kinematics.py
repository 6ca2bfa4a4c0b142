"""Velocity and acceleration from the displacement, without differencing samples.

Where cycles repeat, the average cycle is differentiated, without its noise and its steps
(`pzd.signals.average_cycle`); elsewhere the displacement is smoothed by cross-validation.
"""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.random import default_rng

from pzd.parallel.on_disk import beside
from pzd.record import Array, Record
from pzd.signals.average_cycle import AverageCycle
from pzd.signals.cycles import Cycles, cycles_of
from pzd.signals.measures import resolution, usual_step
from pzd.signals.smoothing import HIGHEST, low_pass, without_steps
from pzd.signals.splines import even_derivatives, is_even

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
        return _smoothed_motion(time, displacement, resolution(displacement))
    inside = run.inside(time)
    average = AverageCycle.of(time, displacement, run)
    cyclic = Kinematics(*average.motion(average.clear_harmonics)(time[inside]))
    departure, corner = displacement[inside] - cyclic.displacement, DRIFT_CORNER * run.frequency
    drift = _smoothed_motion(time[inside], departure, 0.0, corner)
    repeating = Kinematics(*(one + other for one, other in zip(cyclic, drift, strict=True)))
    if inside.all():
        return repeating
    motion = Kinematics(*(np.array(each) for each in _smoothed_motion(time, displacement, resolution(displacement))))
    for whole, part in zip(motion, repeating, strict=True):
        whole[inside] = part
    return motion


_clean_by_record: WeakKeyDictionary[Record, Array] = WeakKeyDictionary()
"""Displacements without noise found so far; an entry goes with its record."""


def clean_displacement_of(record: Record) -> Array:
    """Return the displacement (n,) of a record without its noise [m], found once; see `kinematics`."""
    if record not in _clean_by_record:
        found = kinematics(record.time, record.displacement, cycles_of(record)).displacement
        remember_clean_displacement(record, found)
    return _clean_by_record[record]


def displacement_error_of(record: Record) -> float:
    """Estimate the r.m.s. noise that is left in the clean displacement of a record [m].

    Equation: s = |S e| / sqrt(n), S the cleaning, e what it took away in random order
                                                    Source: Girard 1989, Numer. Math. 56, 1 (trace of S S' by a draw)

    What the cleaning takes from the motion itself is not in it: with that the error is 0.9 to 2 times as much, in the
    mean 1.2 times (110 tests of `tests/studies/plain_study.py`).
    """
    clean = clean_displacement_of(record)
    taken = default_rng(0).permutation(record.displacement - clean)
    changed = kinematics(record.time, clean + taken, cycles_of(record)).displacement
    return float(np.std(changed - clean))


def remember_clean_displacement(record: Record, clean: Array) -> None:
    """Store the displacement (n,) without noise that was found elsewhere, perhaps in another process [m]."""
    _clean_by_record[record] = beside(clean, record.displacement)


def mean_over_period(time: Array, displacement: Array, run: Cycles) -> Array:
    """Compute the mean over one period around every sample (n,), to which no harmonic of the cycle contributes.

    Half a cycle at either end of the run is extrapolated linearly; outside the run the mean is constant.
    """
    # The rule of the trapezium; scipy's takes a quarter of a second to load.
    whole = np.concatenate([[0.0], np.cumsum(np.diff(time) * (displacement[1:] + displacement[:-1]) / 2.0)])
    half = 0.5 * run.period
    middle = np.linspace(run.start + half, min(run.end, float(time[-1])) - half, 4 * run.count)
    mean = (np.interp(middle + half, time, whole) - np.interp(middle - half, time, whole)) / run.period
    edge = min(4, mean.size) - 1
    first = mean[0] - half * (mean[edge] - mean[0]) / (middle[edge] - middle[0])
    last = mean[-1] + half * (mean[-1] - mean[-1 - edge]) / (middle[-1] - middle[-1 - edge])
    knots = np.concatenate(([middle[0] - half], middle, [middle[-1] + half]))
    return np.asarray(np.interp(time, knots, np.concatenate(([first], mean, [last]))))


def _smoothed_motion(time: Array, displacement: Array, finest: float, highest: float = np.inf) -> Kinematics:
    """Smooth a displacement of steps `finest` [m] by cross-validation, with a corner of at most `highest` [Hz]."""
    steps = np.diff(time)
    step = max(usual_step(time), float(time[-1] - time[0]) / (4.0 * time.size))
    regular = bool(np.all(np.abs(steps - step) < 1e-3 * step))
    grid = time if regular else np.arange(time[0], time[-1] + 0.5 * step, step)
    values = displacement if regular else np.interp(grid, time, displacement)
    smooth = low_pass(without_steps(values, finest), min(2.0 * np.pi * highest * step, HIGHEST))
    if regular and is_even(time):
        speed, acceleration = even_derivatives(smooth)
        return Kinematics(smooth, speed / step, acceleration / step**2)
    from scipy.interpolate import CubicSpline

    course = CubicSpline(grid, smooth)
    return Kinematics(course(time), course(time, 1), course(time, 2))
