"""A road as the car meets it: height over distance, with slope and curvature where the step needs them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pzd.record import Array

_AT_KNOTS = np.array([1.0, 26.0, 66.0, 26.0, 1.0]) / 120.0
_SLOPE = np.array([-1.0, -10.0, 0.0, 10.0, 1.0]) / 24.0
_CURVATURE = np.array([1.0, 2.0, -6.0, 2.0, 1.0]) / 6.0
"""Of the basis spline of degree five: its value at the knots, and its derivatives there by the place in knots."""
_BAND = 4


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
    """(n + 4,) of the spline over n knots [m], see `pzd.simulate.spline`."""

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
        from pzd.simulate.spline import fill_values

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
    from scipy.linalg import solve_banded

    count = len(heights) + 4
    band, right = np.zeros((2 * _BAND + 1, count)), np.zeros(count)
    right[2:-2] = heights - heights[0]
    for n in range(5):
        band[_BAND + 2 - n, n : count - 4 + n] = _AT_KNOTS[n]
    for n in range(5):
        for row, weights in ((0, _SLOPE), (1, _CURVATURE)):
            band[_BAND + row - n, n] = weights[n]
            band[_BAND + 4 - row - n, count - 5 + n] = weights[n]
    return Profile(spacing=spacing, coefficients=solve_banded((_BAND, _BAND), band, right))
