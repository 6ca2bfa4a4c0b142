"""A displacement smoothed as far as its own noise asks for."""

from __future__ import annotations

from weakref import ref

import numpy as np

from pzd.record import Array, Complex

# ----------------------------------------------------------------------------------------------------
# The usual step of a clock, which everything that reads a record over time asks for.


_last: list[tuple[ref[Array], float]] = []
"""The clock asked for last, which nobody changes, and its step: one record is worked on at a time."""


def usual_step(time: Array) -> float:
    """The median step of a clock (n,) [s]."""
    if _last and _last[0][0]() is time:
        return _last[0][1]
    step = float(np.median(np.diff(time)))
    _last[:] = [(ref(time), step)]
    return step


# ----------------------------------------------------------------------------------------------------
# The samples at which a motion reverses.


REVERSAL_SHARE = 0.1
"""Share of the range by which a motion must go back: noise and the creep of a servo stay below it."""


def reversals(displacement: Array, share: float = REVERSAL_SHARE) -> list[int]:
    """Samples at which the motion turns, each between strokes larger than a share of the range.

    Parameters
    ----------
    displacement : (n,) motion, in any unit
    share : of its range
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


# ----------------------------------------------------------------------------------------------------


HIGHEST = 20.0
"""Corner of the smoothing [rad/sample] that leaves a record without noise as it is."""
_CORNERS = 60
_BINS = 2000
_HALVINGS = 6
"""Bands that are asked, the narrowest a sixty-fourth of half the sampling rate: no sensor is recorded faster."""
CLEAR = 2.0
"""Corners above which the filter has taken all but a hundredth: what is left there is noise."""
_FEWEST = 50
"""Frequencies that show the level of the noise within 15 %."""
_FAINT = 1e-6
"""Share of the power of a motion up to which what looks like noise is noise: a thousandth of its r.m.s.

Reason: a displacement sensor is better than that, and a sweep fills its band as evenly as noise."""
_STANDS_OUT = 3.0
"""Of white noise the largest of n powers is about ln n times their mean, and beyond three times that once in n^2."""


def low_pass(values: Array, highest: float) -> Array:
    """Smoothing spline of the sixth order on a regular grid, its corner chosen by its own cross-validation.

    Equation: gain = 1 / (1 + (2 sin(w/2) / w_c)^6), w_c minimising sum((1 - g)^2 P) / sum(1 - g)^2
              Source: Craven and Wahba 1979, in the frequency domain

    Parameters
    ----------
    values : (n,) at a regular step
    highest : largest corner [rad/sample]

    Returns
    -------
    (n,) smoothed; the ends are continued by point reflection
    """
    line, spectrum, s = _reflected(values)
    smooth: Array = np.fft.irfft(
        spectrum / (1.0 + (s / _corner(s, np.abs(spectrum) ** 2, highest)) ** 6), 2 * (values.size - 1)
    )[: values.size]
    return smooth + line


def motion_below(values: Array) -> float:
    """Frequency [rad/sample] at which a motion (n,) at a regular step sinks into its noise; pi where it never does."""
    _, spectrum, s = _reflected(values)
    return min(_corner(s, np.abs(spectrum) ** 2, HIGHEST), float(np.pi))


def _reflected(values: Array) -> tuple[Array, Complex, Array]:
    """The line (n,) through both ends, the spectrum (n,) of the rest continued by point reflection, 2 sin(w/2) (n,)."""
    line = np.linspace(values[0], values[-1], values.size)
    flat = values - line
    spectrum = np.fft.rfft(np.concatenate((flat, -flat[-2:0:-1])))
    return line, spectrum, 2.0 * np.sin(np.pi * np.arange(spectrum.size) / (2 * (values.size - 1)))


def _corner(s: Array, power: Array, highest: float) -> float:
    """The corner [rad/sample] with the least generalised cross-validation, in the widest band of even noise.

    Cross-validation takes noise for white. Where a filter has left none at high frequencies, it takes what lies below
    for motion. So bands from 0 to a half, a quarter, an eighth ... of the range are asked too: the least corner counts
    above which nothing stands out of the noise of its band, up to the end of the range, and little is left.
    """
    edges = np.unique(np.geomspace(1, s.size, _BINS).astype(np.int64))
    edges = edges[edges < s.size]
    binned, counts = np.add.reduceat(power, edges), np.diff(np.append(edges, s.size))
    middle = np.add.reduceat(s, edges) / counts
    corners = np.geomspace(min(np.pi / s.size, highest), highest, _CORNERS)
    taken = 1.0 / (1.0 + (corners[:, None] / middle[None, :]) ** 6)
    found = float(corners[_least(taken, binned, counts)])
    for halvings in range(1, _HALVINGS + 1):
        limit = s[-1] / 2.0**halvings
        inside = middle <= limit
        if np.count_nonzero(s <= limit) < _FEWEST:
            break
        corner = float(corners[_least(taken[:, inside], binned[inside], counts[inside])])
        noise = (s > CLEAR * corner) & (s <= limit)
        if np.count_nonzero(noise) < _FEWEST:
            continue
        level = float(np.mean(power[noise]))
        above = power[s > CLEAR * corner]
        even = float(np.max(above)) <= _STANDS_OUT * np.log(above.size) * level
        if even and float(np.sum(above)) <= _FAINT * float(np.sum(power)):
            found = min(found, corner)
    return found


def _least(taken: Array, binned: Array, counts: Array) -> int:
    """Which corner has the least score; `taken` (corners, bins) is what each takes away."""
    return int(np.argmin((taken**2 @ binned) / (taken @ counts) ** 2))


# ----------------------------------------------------------------------------------------------------
# Work along a path of force over displacement.


CHANCE = 0.05
"""Work of one cycle that may be chance, as a share of stroke times range of the force.

Reason: a damper that sticks draws a line without area, and what little its noise encloses is fed in as often as taken
out; a loop of dry friction alone has ten times this and more."""


def work(displacement: Array, force: Array, closed: bool = False) -> float:
    """Work done on the damper along the path.

    Equation: W = integral of F dx, the area of the loop of force over displacement      Source: definition

    Parameters
    ----------
    displacement : (n,) extension [m]
    force : (n,) force [N]
    closed : whether the last sample is followed by the first, as in an average cycle

    Returns
    -------
    work [J]
    """
    if closed:
        displacement, force = np.append(displacement, displacement[0]), np.append(force, force[0])
    return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(displacement)))


def work_of_chance(displacement: Array, force: Array, cycles: float | None = None) -> float:
    """Work [J] that chance may do over a path; over many cycles it adds up with the root of their number.

    Parameters
    ----------
    displacement : (n,) extension [m]
    force : (n,) force [N]
    cycles : how many there are; by the turns of the motion where it is not said
    """
    of_cycle = CHANCE * float(np.ptp(displacement) * np.subtract(*np.percentile(force, (99, 1))))
    return of_cycle * float(np.sqrt(1.0 + 0.5 * len(reversals(displacement)) if cycles is None else cycles))
