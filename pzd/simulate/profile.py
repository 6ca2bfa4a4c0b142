"""A road as the car meets it: height over distance, with slope and curvature where the step needs them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pzd.record import Array


@dataclass(frozen=True, eq=False)
class Profile:
    """One harmonic plus a cubic spline over distance; either may be absent.

    The spline is flat before its first and behind its last knot.
    """

    amplitude: float = 0.0
    """Amplitude of the harmonic [m]."""
    wavenumber: float = 0.0
    """Of the harmonic [rad/m]."""
    spacing: float = 1.0
    """Distance between two knots of the spline [m]."""
    coefficients: Array = field(default_factory=lambda: np.zeros((0, 4)))
    """(n, 4) height = c0 + c1 d + c2 d^2 + c3 d^3 with d the distance behind knot i."""

    @property
    def smooth(self) -> bool:
        """Whether the harmonic is the whole road."""
        return len(self.coefficients) == 0

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
        count = len(self.coefficients)
        place = np.clip(distance / self.spacing, 0.0, count)
        knot = np.minimum(place.astype(int), count - 1)
        d = (place - knot) * self.spacing
        c = self.coefficients[knot]
        total: Array = harmonic + c[:, 0] + d * (c[:, 1] + d * (c[:, 2] + d * c[:, 3]))
        return total


def through(heights: Array, spacing: float) -> Profile:
    """The twice continuously differentiable road through given heights, level at both ends.

    Parameters
    ----------
    heights : (n,) at equal distances [m]
    spacing : distance between them [m]

    Returns
    -------
    the profile above its first height; before the first and behind the last knot the height is held
    """
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(spacing * np.arange(len(heights)), heights - heights[0], bc_type="clamped")
    return Profile(spacing=spacing, coefficients=np.ascontiguousarray(spline.c[::-1].T))
