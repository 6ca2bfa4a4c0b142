"""A road as the car meets it: height over distance, with slope and curvature where the step needs them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pzd.compiled import compiled, inlined
from pzd.record import Array

# ----------------------------------------------------------------------------------------------------
# A spline of degree five over evenly spaced knots, by its coefficients: four times continuously differentiable.
#
# An integrator of order five keeps its order across knots of such a road; a cubic one would force it to shorter steps.


NEEDED = 6
"""Coefficients that act in one cell."""


@inlined
def spline_at(coefficients: Array, place: float) -> tuple[float, float, float]:
    """Value of a spline, its derivative and its second derivative; held before the first and behind the last knot.

    Equation: s = sum c_j B(p - j), B the basis spline of degree 5 over whole numbers, as a polynomial in the cell
    Source: de Boor 2001, A Practical Guide to Splines, ch. IX and X

    Parameters
    ----------
    coefficients : (n + 4,) of a spline over n knots, or more than `NEEDED`; the first acts two knots before the first
    place : counted from the first knot, in knots

    Returns
    -------
    value, and its derivatives by the place
    """
    last = coefficients.size - NEEDED
    held = place <= 0.0 or place >= last + 1.0
    place = min(max(place, 0.0), last + 1.0)
    cell = min(int(place), last)
    t = place - cell
    c0, c1, c2 = coefficients[cell], coefficients[cell + 1], coefficients[cell + 2]
    c3, c4, c5 = coefficients[cell + 3], coefficients[cell + 4], coefficients[cell + 5]
    a0 = (c0 + c4 + 26.0 * (c1 + c3) + 66.0 * c2) / 120.0
    a1 = (c4 - c0 + 10.0 * (c3 - c1)) / 24.0
    a2 = (c0 + c4 + 2.0 * (c1 + c3) - 6.0 * c2) / 12.0
    a3 = (c4 - c0 - 2.0 * (c3 - c1)) / 12.0
    a4 = (c0 + c4 - 4.0 * (c1 + c3) + 6.0 * c2) / 24.0
    a5 = (c5 - c0 + 5.0 * (c1 - c4) + 10.0 * (c3 - c2)) / 120.0
    value = a0 + t * (a1 + t * (a2 + t * (a3 + t * (a4 + t * a5))))
    if held:
        return value, 0.0, 0.0
    slope = a1 + t * (2.0 * a2 + t * (3.0 * a3 + t * (4.0 * a4 + t * 5.0 * a5)))
    return value, slope, 2.0 * a2 + t * (6.0 * a3 + t * (12.0 * a4 + t * 20.0 * a5))


@compiled
def fill_values(coefficients: Array, places: Array, values: Array) -> None:
    """Fill the values of a spline at (m,) places."""
    for n in range(places.size):
        values[n], _, _ = spline_at(coefficients, places[n])


# ----------------------------------------------------------------------------------------------------


_AT_KNOTS = np.array([1.0, 26.0, 66.0, 26.0, 1.0]) / 120.0
_SLOPE = np.array([-1.0, -10.0, 0.0, 10.0, 1.0]) / 24.0
_CURVATURE = np.array([1.0, 2.0, -6.0, 2.0, 1.0]) / 6.0
"""Of the basis spline of degree five: its value at the knots, and its derivatives there by the place in knots."""
_BAND = 4
_BLOCK = 200_000
"""Knots whose coefficients are solved for at a time, so that the room for it does not grow with the road."""
_OVERLAP = 100
"""Knots over which an end is felt: each coefficient is 0.43 of the one before, and 0.43^100 is 1e-36."""


@dataclass(frozen=True, eq=False)
class Profile:
    """One harmonic plus a spline of degree five over distance; either may be absent.

    The spline is flat before its first and behind its last knot.
    """

    amplitude: float = 0.0
    """Amplitude of the harmonic [m]."""
    wavenumber: float = 0.0
    """Of the harmonic [rad/m]."""
    spacing: float = 1.0
    """Distance between two knots of the spline [m]."""
    coefficients: Array = field(default_factory=lambda: np.zeros(0))
    """(n + 4,) of the spline over n knots [m], see `pzd.simulate.road.profile`."""

    @property
    def smooth(self) -> bool:
        """Whether the harmonic is the whole road."""
        return self.coefficients.size == 0

    def height(self, distance: Array) -> Array:
        """Height of the road.

        Parameters
        ----------
        distance : (n,) along the road [m]

        Returns
        -------
        (n,) height xi [m]
        """
        harmonic: Array = self.amplitude * np.sin(self.wavenumber * distance)
        if self.smooth:
            return harmonic

        splined = np.empty(len(distance))
        fill_values(self.coefficients, np.asarray(distance, dtype=np.float64) / self.spacing, splined)
        return harmonic + splined


def through(heights: Array, spacing: float) -> Profile:
    """The four times continuously differentiable road through given heights, level at both ends.

    Parameters
    ----------
    heights : (n,) at equal distances [m], two or more
    spacing : distance between them [m]

    Returns
    -------
    the profile above its first height; before the first and behind the last knot the height is held
    """
    coefficients = np.empty(len(heights) + 4)
    for first in range(0, len(heights), _BLOCK):
        start, stop = max(first - _OVERLAP, 0), min(first + _BLOCK + _OVERLAP, len(heights))
        last = min(first + _BLOCK, len(heights)) if stop < len(heights) else len(heights) + 4
        coefficients[first:last] = _solved(heights[start:stop] - heights[0])[first - start : last - start]
        if last > len(heights):
            break
    return Profile(spacing=spacing, coefficients=coefficients)


def _solved(heights: Array) -> Array:
    """(n + 4,) coefficients through (n,) heights, slope and curvature 0 at both ends."""
    from scipy.linalg import solve_banded

    count = len(heights) + 4
    band, right = np.zeros((2 * _BAND + 1, count)), np.zeros(count)
    right[2:-2] = heights
    for n in range(5):
        band[_BAND + 2 - n, n : count - 4 + n] = _AT_KNOTS[n]
    for n in range(5):
        for row, weights in ((0, _SLOPE), (1, _CURVATURE)):
            band[_BAND + row - n, n] = weights[n]
            band[_BAND + 4 - row - n, count - 5 + n] = weights[n]
    return np.asarray(solve_banded((_BAND, _BAND), band, right))
