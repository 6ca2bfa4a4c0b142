"""Elementary measures of a recorded signal: time step, r.m.s., criterion (4), reversals of the motion, work."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from typing import Any, ParamSpec, TypeVar
from weakref import ref

import numpy as np

from pzd.record import MAD_TO_SIGMA, Array, running_median

SIGNIFICANCE = 1e-3
"""Probability by noise alone below which a misfit is believed: of a thousand plain dampers one looks so."""
VISIBLE = 0.0025
"""Least misfit that matters, r.m.s. as a share of peak force: half of the error of a load cell of class 0.5, whose own
nonlinearity may be as large."""

_last_clock: list[tuple[ref[Array], float]] = []
"""The last clock and its step: records are worked on one at a time, and a median is dear. Clocks are never modified."""


def usual_step(time: Array) -> float:
    """Return the median step of a clock (n,) [s]."""
    for known, step in _last_clock:
        if known() is time:
            return step
    step = float(np.median(np.diff(time)))
    _last_clock[:] = [(ref(time), step)]
    return step


# --- What is found of a record once, and asked for by many ---

P = ParamSpec("P")
T = TypeVar("T")

_KEPT = 6
"""Results of each function that are kept: those of the channels of one record."""
_in_hand: ContextVar[dict[Any, Any] | None] = ContextVar("_in_hand", default=None)
"""What was found so far, by function; None outside of `one_record`."""


@contextmanager
def one_record() -> Iterator[None]:
    """Work on one record, none of whose arrays changes: what `found_once` finds of it is kept until this ends."""
    if _in_hand.get() is not None:
        yield
        return
    token = _in_hand.set({})
    try:
        yield
    finally:
        _in_hand.reset(token)


def found_once(function: Callable[P, T]) -> Callable[P, T]:
    """Ask a function only once what it makes of the same arrays, within `one_record`; nobody changes what it returns.

    Outside it is asked each time: an array may hold other values by then.
    """

    @wraps(function)
    def found(*given: P.args, **named: P.kwargs) -> T:
        in_hand = _in_hand.get()
        if in_hand is None:
            return function(*given, **named)
        known = in_hand.setdefault(function, {})
        arguments = (*given, *named.items())
        # The arrays are kept with what was made of them, so that no other takes the place of one.
        key = tuple(id(one) if isinstance(one, np.ndarray) else one for one in arguments)
        if key not in known:
            made = function(*given, **named)
            if len(known) == _KEPT:
                known.pop(next(iter(known)))
            known[key] = arguments, made
        found_so: T = known[key][1]
        return found_so

    return found


def rms(values: Array) -> float:
    """Root mean square about zero, in the unit of the values.

    Equation: a = sqrt(1/T int a(t)^2 dt)      Source: ISO 2631-1:1997, eq. (1), for an acceleration

    Parameters
    ----------
    values : (n,) at even steps

    Examples
    --------
    >>> rms(np.array([3.0, -3.0, 3.0]))
    3.0
    """
    return float(np.sqrt(np.mean(values**2)))


def criterion(residual: Array, measured: Array) -> float:
    """Criterion W_s: sum of squares of the residual over that of the measured force; a pure number.

    Equation: W_s = sum (F - F_sim)^2 / sum F^2      Source: Makowski and Knap 2021, eq. (4)

    Parameters
    ----------
    residual : (n,) measured less simulated force, of one record or of several in a row [N]
    measured : (n,) the measured force of the same samples [N]

    Examples
    --------
    >>> criterion(np.array([1.0, -1.0]), np.array([10.0, 10.0]))
    0.01
    """
    return float(residual @ residual / (measured @ measured))


def criterion_error(squares: Array, energies: Array) -> float:
    """Compute the standard error of W_s from its scatter between tests, cycles or other parts.

    Equation: s^2 = n / (n - 1) sum (e_i - W_s f_i)^2 / (sum f)^2, of n parts       Source: Cochran 1977, eq. (6.9)

    Parameters
    ----------
    squares : (n,) sum of squares of the residual of each part, e [N^2]
    energies : (n,) likewise of the measured force, f [N^2]

    Examples
    --------
    >>> round(criterion_error(np.array([1.0, 3.0]), np.array([100.0, 100.0])), 4)
    0.01
    """
    total, count = float(energies.sum()), squares.size
    deviation = squares - float(squares.sum()) / total * energies
    return float(np.sqrt(deviation @ deviation * count / max(count - 1, 1))) / total


WHOLE_STEPS = 0.05
"""Largest median distance of the steps of a quantised channel from a whole number of the least one."""


def noise_beside_motion(values: Array) -> float:
    """Estimate the standard deviation of white noise in a channel (n,), in its unit; 0 of fewer than three samples.

    Equation: 1.4826 median |second difference| / sqrt(6), which a smooth motion hardly has, and a step seldom
    """
    return MAD_TO_SIGMA * float(np.median(np.abs(np.diff(values, 2)))) / np.sqrt(6.0) if values.size > 2 else 0.0


@found_once
def resolution(values: Array) -> float:
    """Return the step in whole numbers of which a channel (n,) is recorded, in its unit; 0 where it has none."""
    steps = np.diff(np.unique(values))
    steps = steps[steps > 1e-9 * np.ptp(values)]  # less is rounding
    whole = steps / np.min(steps, initial=np.inf)
    return float(np.min(steps)) if steps.size and np.median(np.abs(whole - np.round(whole))) < WHOLE_STEPS else 0.0


REVERSAL_SHARE = 0.1
"""Least stroke between two reversals, as a share of the range: noise and the creep of a servo stay below it."""


@found_once
def reversals(displacement: Array, share: float = REVERSAL_SHARE) -> list[int]:
    """Find the samples at which a motion reverses, each between strokes larger than a share of the range.

    Parameters
    ----------
    displacement : (n,) motion, in any unit
    share : least stroke, as a share of the range

    Returns
    -------
    indices of the samples, rising

    Examples
    --------
    >>> reversals(np.array([0.0, 1.0, 2.0, 1.0, 0.0, 1.0]))
    [2, 4]
    """
    enough = share * float(np.ptp(displacement))
    steps = np.sign(np.diff(displacement))
    candidates = [0, *(np.flatnonzero(steps[1:] != steps[:-1]) + 1).tolist(), displacement.size - 1]
    turns: list[int] = []
    low = high = 0
    direction = 0
    for i in candidates:
        low = i if displacement[i] < displacement[low] else low
        high = i if displacement[i] > displacement[high] else high
        if direction >= 0 and displacement[high] - displacement[i] > enough:
            if direction or displacement[high] - displacement[0] > enough:
                turns.append(high)
            direction, low = -1, i
        elif direction <= 0 and displacement[i] - displacement[low] > enough:
            if direction or displacement[0] - displacement[low] > enough:
                turns.append(low)
            direction, high = 1, i
    return turns


CHANCE_WORK = 0.05
"""Work of one cycle that may be chance, as a share of stroke times range of the force.

Reason: a damper that sticks draws a line without area, and the small area of its noise is as often negative as
positive; a loop of dry friction alone has ten times this and more."""


def work(displacement: Array, force: Array, closed: bool = False) -> float:
    """Compute the work done on the damper along a path of force over displacement.

    Equation: W = integral of F dx, the area of the loop of force over displacement      Source: definition

    Parameters
    ----------
    displacement : (n,) extension [m]
    force : (n,) force [N]
    closed : whether the last sample is followed by the first, as in an average cycle

    Returns
    -------
    work [J]

    Examples
    --------
    >>> work(np.array([0.0, 1.0, 1.0, 0.0]), np.array([2.0, 2.0, -2.0, -2.0]), closed=True)
    4.0
    """
    if closed:
        displacement, force = np.append(displacement, displacement[0]), np.append(force, force[0])
    return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(displacement)))


def chance_work(displacement: Array, force: Array, cycles: float | None = None) -> float:
    """Compute the work [J] that noise may do along a path; it grows with the root of the number of cycles.

    Parameters
    ----------
    displacement : (n,) extension [m]
    force : (n,) force [N]
    cycles : number of cycles; None to count the reversals of the motion
    """
    of_cycle = CHANCE_WORK * float(np.ptp(displacement) * np.subtract(*np.percentile(force, (99, 1))))
    return of_cycle * float(np.sqrt(1.0 + 0.5 * len(reversals(displacement)) if cycles is None else cycles))


@found_once
def slope(time: Array, x: Array) -> Array:
    """Compute the slope (n,) of a motion over four samples, insensitive to spikes of one or two."""
    if time.size < 6:
        return np.gradient(x, time)
    clean = despiked(x)
    step = usual_step(time)
    span = np.maximum(time[4:] - time[:-4], 4.0 * step)
    return np.pad((clean[4:] - clean[:-4]) / span, 2, mode="edge")


@found_once
def despiked(x: Array) -> Array:
    """Return the running median (n,) of five samples."""
    if x.size < 5:
        return x
    middle = running_median(x, 5)
    return np.concatenate((middle[:1], middle[:1], middle, middle[-1:], middle[-1:]))
