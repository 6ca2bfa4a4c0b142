"""Strokes of the rod, and what they are: one of constant speed, half a cycle of a sine, or another smooth one.

A stroke is looked at by itself, so that it does not matter what the waveform was called, how often it
was repeated, or whether rests lie between the strokes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from pzd.artefacts.characteristics import Kind
from pzd.record import Array

STRAIGHT = (0.2, 0.8)
"""Shares of the stroke between which a test of constant speed holds it: an actuator needs the rest to turn round."""
MIDDLE = (0.4, 0.6)
"""Shares of the stroke between which its force is read: far from the reversal, after which the oil spring winds up."""
PARTS = 4
"""The straight part is cut into so many parts of equal way, whose speeds are compared."""
CONSTANT = 0.03
"""A speed stays constant within this share of its mean; that of a sine moves by 5 % over these parts."""
SINUSOIDAL = 0.03
"""R.m.s. deviation from half a cosine, as a share of the stroke: a slider-crank leaves 0.02, a triangle 0.07."""
AROUND_PEAK = 0.7
"""The peak speed of a sine is looked for within this share of the half stroke to either side of its middle."""
BESIDE_PEAK = 0.4
"""The force is read from a parabola over this share of that time to either side of the peak, 18 degrees of a sine."""
SMOOTH = 0.005
"""R.m.s. deviation from the polynomial around the middle, as a share of the stroke, up to which there is one peak."""
LEAST_POINTS = 6
"""Samples that a fit over a part of a stroke needs, at least."""


@dataclass(frozen=True, eq=False)
class Stroke:
    """The rod from one reversal to the next; every array is (n,)."""

    time: Array
    displacement: Array
    force: Array

    @property
    def rebound(self) -> bool:
        """Whether the damper extends."""
        return bool(self.displacement[-1] > self.displacement[0])

    @property
    def length(self) -> float:
        """Way from end to end [m]."""
        return float(np.ptp(self.displacement))

    @property
    def middle(self) -> float:
        """Displacement half way [m]."""
        return 0.5 * float(self.displacement.min() + self.displacement.max())

    @cached_property
    def kind(self) -> Kind | None:
        """What the motion is; None where its speed has no clear peak, or there are too few samples to say."""
        if self._constant():
            return "constant velocity"
        if self.time[self._around_middle].size < LEAST_POINTS or not self._has_one_peak():
            return None
        return "sine" if self._sinusoidal() else "other swing"

    def at_peak(self) -> tuple[float, float]:
        """Speed [m/s] and force [N] where the stroke is fastest.

        At constant speed that is the middle of the stroke, as anywhere in its straight part.

        Equation: v from a straight line, or a polynomial of degree five, through x; F from one through F
                                                                    Source: least squares, so that noise averages out
        """
        if self.kind == "constant velocity":
            part = self.between(*STRAIGHT)
            x, t = self.displacement[part], self.time[part]
            inner = self.between(*MIDDLE)
            force = _at(self.displacement[inner] - self.middle, self.force[inner], 1, 0.0)
            return float(np.polyfit(t - t[0], x, 1)[0]), force
        course, half = self._course()
        fastest = _fastest(course)
        near = self._around_middle
        s = (self.time[near] - self.time[near][0]) / half - 1.0 - fastest
        nearest = np.argsort(np.abs(s), kind="stable")
        nearest = nearest[: max(int(np.sum(np.abs(s) <= BESIDE_PEAK)), LEAST_POINTS)]
        return float(course.deriv()(fastest)) / half, _at(s[nearest], self.force[near][nearest], 2, 0.0)

    @cached_property
    def _around_middle(self) -> slice:
        return self.between(0.5 - 0.5 * AROUND_PEAK, 0.5 + 0.5 * AROUND_PEAK)

    def _course(self) -> tuple[np.polynomial.Polynomial, float]:
        """Displacement around the middle [m] over time from -1 to 1, and half of that time [s]."""
        t, x = self.time[self._around_middle], self.displacement[self._around_middle]
        half = 0.5 * float(t[-1] - t[0])
        return np.polynomial.Polynomial.fit((t - t[0]) / half - 1.0, x, 5, domain=(-1.0, 1.0)), half

    def _has_one_peak(self) -> bool:
        """Whether the motion around the middle is smooth, and fastest inside of it and not at its end."""
        course, half = self._course()
        t, x = self.time[self._around_middle], self.displacement[self._around_middle]
        left = x - course((t - t[0]) / half - 1.0)
        return bool(np.sqrt(np.mean(left**2)) <= SMOOTH * self.length) and abs(_fastest(course)) < 1.0

    def between(self, low: float, high: float) -> slice:
        """The samples between two shares of the way, counted from where the stroke begins."""
        way = np.abs(self.displacement - self.displacement[0]) / abs(self.displacement[-1] - self.displacement[0])
        first = int(np.argmax(way >= low))
        return slice(first, first + int(np.argmax(np.append(way[first:], 2.0) > high)))

    def _constant(self) -> bool:
        shares = np.linspace(*STRAIGHT, PARTS + 1)
        parts = [self.between(low, high) for low, high in pairwise(shares)]
        if any(part.stop - part.start < LEAST_POINTS // 2 for part in parts):
            return False
        speeds = np.array([np.polyfit(self.time[p] - self.time[p][0], self.displacement[p], 1)[0] for p in parts])
        return bool(np.all(np.abs(speeds / speeds.mean() - 1.0) <= CONSTANT))

    def _sinusoidal(self) -> bool:
        share = (self.time - self.time[0]) / (self.time[-1] - self.time[0])
        ideal = self.displacement[0] + (self.displacement[-1] - self.displacement[0]) * 0.5 * (
            1.0 - np.cos(np.pi * share)
        )
        return bool(np.sqrt(np.mean((self.displacement - ideal) ** 2)) <= SINUSOIDAL * self.length)


def _at(x: Array, values: Array, degree: int, place: float) -> float:
    """Value of the polynomial of a degree through (n,) values over (n,) x at a place."""
    return float(np.polynomial.Polynomial.fit(x, values, degree)(place))


def _fastest(course: np.polynomial.Polynomial) -> float:
    """Where from -1 to 1 a course has its steepest slope."""
    fine = np.linspace(-1.0, 1.0, 2001)
    return float(fine[np.argmax(np.abs(course.deriv()(fine)))])
