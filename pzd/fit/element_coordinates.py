"""Coordinates in which T0, C and k are searched, in identify and in diagnose alike.

Equation: T0 = min(F, 0.45 k X) x_1, C = c sinh x_2, 1/k = s sinh x_3

T0 goes up to the peak force F, or to what lets the element slip within every full stroke X.
Beyond c and s, which no test shows, they are logarithms; below they are linear, so that the limits of the law,
friction alone (C = 0), viscous force alone (T0 = 0) and the rigid damper (1/k = 0), lie at zero, within reach, each
with a finite derivative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.damper.element import STIFFEST
from pzd.record import Array

HARDLY_DAMPING = 1e-4
"""C at which the coordinate turns from linear to logarithmic [peak force over peak speed]: its viscous force is a
ten-thousandth of the peak, less than any load cell shows."""
HARDLY_ELASTIC = 1e-5
"""1/k at which it does [range of displacement over peak force]: the oil spring gives by a hundred-thousandth of the
range at peak force, less than any displacement sensor shows."""
LARGEST_PRE_SLIP = 0.45
"""Largest pre-slip deflection T0/k, as a share of the range of displacement: the element still slips."""
LARGEST = (1.0, 1e2, 10.0)
"""T0, C and 1/k up to which is searched, in the same units."""


@dataclass(frozen=True)
class ElementCoordinates:
    """Search coordinates of an element under tests of a size."""

    force: float
    """Peak force [N]."""
    speed: float
    """Peak speed [m/s]."""
    stroke: float
    """Range of displacement [m]."""

    @property
    def _damping(self) -> float:
        return HARDLY_DAMPING * self.force / self.speed

    @property
    def _compliance(self) -> float:
        return HARDLY_ELASTIC * self.stroke / self.force

    @property
    def high(self) -> Array:
        """Largest coordinates (3,); the least are zero."""
        friction, damping, compliance = LARGEST
        return np.array([friction, np.arcsinh(damping / HARDLY_DAMPING), np.arcsinh(compliance / HARDLY_ELASTIC)])

    def to_search(self, friction: float, damping: float, stiffness: float) -> Array:
        """Return the coordinates (3,) of T0 [N], C [N s/m] and k [N/m], infinite or no less than is searched."""
        compliance = 1.0 / max(stiffness, self.force / (LARGEST[2] * self.stroke))
        return np.array(
            [
                friction / self._largest_friction(compliance),
                np.arcsinh(damping / self._damping),
                np.arcsinh(compliance / self._compliance),
            ]
        )

    def from_search(self, x: Array) -> tuple[float, float, float]:
        """Return T0 [N], C [N s/m] and k [N/m] at coordinates (3,); k infinite where nothing tells it from rigid."""
        compliance = self._compliance * float(np.sinh(x[2]))
        stiffness = 1.0 / compliance if compliance > 1.0 / STIFFEST else np.inf
        return self._largest_friction(compliance) * float(x[0]), self._damping * float(np.sinh(x[1])), stiffness

    def _largest_friction(self, compliance: float) -> float:
        """Return the friction [N] at x_1 = 1."""
        return self.force / max(1.0, compliance * self.force / (LARGEST_PRE_SLIP * self.stroke))

    def slopes(self, x: Array) -> Array:
        """Return the derivatives (3, 3) of T0, C and 1/k (rows) by the coordinates (columns)."""
        compliance = self._compliance * float(np.sinh(x[2]))
        by_x = self._compliance * np.cosh(x[2])
        largest = self._largest_friction(compliance)
        falls = -largest / compliance * by_x if largest < self.force else 0.0
        return np.array([[largest, 0.0, falls * x[0]], [0.0, self._damping * np.cosh(x[1]), 0.0], [0.0, 0.0, by_x]])
