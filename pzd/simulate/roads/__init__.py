"""The roads: what a block of the config must give to be one, and the profile that the car meets.

Every module here is found by itself; it declares a family of roads, `ROADS = (...)`, each with a `kind` of its own.
"""

from __future__ import annotations

import importlib
import pkgutil
from abc import abstractmethod
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from pzd.record import Array
from pzd.schema.model import OneOfAKind

# --- Profile: a harmonic and a spline of degree five through evenly spaced knots, by its coefficients ---
#
# Such a spline is four times continuously differentiable: an integrator of order five keeps its order across the knots;
# a cubic one would force it to shorter steps.

DEGREE = 5
_AT_KNOTS = np.array([1.0, 26.0, 66.0, 26.0, 1.0]) / 120.0
_SLOPE = np.array([-1.0, -10.0, 0.0, 10.0, 1.0]) / 24.0
_CURVATURE = np.array([1.0, 2.0, -6.0, 2.0, 1.0]) / 6.0
"""Of the basis spline of degree five: its value at the knots, and its derivatives there by the place in knots."""
_BAND = 4
_BLOCK = 200_000
"""Knots whose coefficients are solved for at a time, so that the memory for it does not grow with the road."""
END_REACH = 100
"""Knots over which the end of a spline acts: each coefficient is 0.43 of the one before, and 0.43^100 is 1e-36."""


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
    """(n + 4,) of the spline over n knots [m]; the first acts two knots before the first one."""

    @property
    def smooth(self) -> bool:
        """Whether the harmonic is the whole road."""
        return self.coefficients.size == 0

    def height(self, distance: Array) -> Array:
        """Return the height of the road.

        Equation: xi = A sin(kappa d) + sum c_j B(d / h - j), B the basis spline of degree 5 over whole numbers
        Source: de Boor 2001, A Practical Guide to Splines, ch. IX and X; a ride evaluates it by `road_at` of
        `pzd.simulate.vehicle.suspension`

        Parameters
        ----------
        distance : (n,) along the road [m]

        Returns
        -------
        (n,) height xi [m]

        >>> road = through(np.array([0.0, 0.0, 0.02, 0.0, 0.0]), spacing=0.5)
        >>> road.height(np.array([-1.0, 1.0, 9.0])).round(6).tolist()
        [0.0, 0.02, 0.0]
        """
        from scipy.interpolate import BSpline

        harmonic: Array = self.amplitude * np.sin(self.wavenumber * distance)
        if self.smooth:
            return harmonic
        count = self.coefficients.size
        knots = np.arange(count + DEGREE + 1, dtype=np.float64) - DEGREE
        place = np.clip(np.asarray(distance, dtype=np.float64) / self.spacing, 0.0, count - DEGREE)
        return harmonic + np.asarray(BSpline(knots, self.coefficients, DEGREE)(place))


def through(heights: Array, spacing: float) -> Profile:
    """Return the four times continuously differentiable road through given heights, level at both ends.

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
        start, stop = max(first - END_REACH, 0), min(first + _BLOCK + END_REACH, len(heights))
        last = min(first + _BLOCK, len(heights)) if stop < len(heights) else len(heights) + 4
        coefficients[first:last] = _coefficients_through(heights[start:stop] - heights[0])[first - start : last - start]
        if last > len(heights):
            break
    return Profile(spacing=spacing, coefficients=coefficients)


def _coefficients_through(heights: Array) -> Array:
    """Solve for the (n + 4,) coefficients through (n,) heights, slope and curvature 0 at both ends."""
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


# --- What a block of the config must give to be a road ---


@dataclass(frozen=True)
class Way:
    """What a road may ask of the ride."""

    vehicle_speed: float
    """[m/s]."""
    distance: float
    """Length of the ride [m]."""
    seed: int
    """Of the run, for roads that are drawn."""
    folder: Path
    """Of the config, for roads that are read."""
    key: str = "simulate.roads"
    """Of the road in the config, for errors."""


class Road(OneOfAKind):
    """A road under the wheels, of a `kind` of its own."""

    @property
    def event(self) -> tuple[float, float] | None:
        """Where a single event begins and ends on a level road [m]; None on a road that goes on and on."""
        return None

    @abstractmethod
    def profile(self, way: Way) -> Profile:
        """Return the road as the car meets it: height over distance."""


@cache
def roads() -> dict[str, type[Road]]:
    """Find the block of every kind of road, by its `kind` in alphabetical order."""
    modules = (importlib.import_module(f"{__name__}.{info.name}") for info in pkgutil.iter_modules(__path__))
    found = {road.model_fields["kind"].default: road for module in modules for road in module.ROADS}
    return {kind: found[kind] for kind in sorted(found)}
