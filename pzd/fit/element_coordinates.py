"""Coordinates in which T0, C and k are searched, in identify and in diagnose alike.

Equation: T0 = F x_1, C = c sinh x_2, 1/k = s sinh x_3

Beyond c and s, which no test shows, they are logarithms; below they are linear, so that the limits of the law, friction
alone (C = 0), viscous force alone (T0 = 0) and the rigid damper (1/k = 0), lie at zero, within reach, each with a finite
derivative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.record import Array

HARDLY_DAMPING = 1e-4
"""C at which the coordinate turns from linear to logarithmic [peak force over peak speed]: its viscous force is a
ten-thousandth of the peak, less than any load cell shows."""
HARDLY_ELASTIC = 1e-5
"""1/k at which it does [range of displacement over peak force]: the oil spring gives by a hundred-thousandth of the
range at peak force, less than any displacement sensor shows."""
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
        """Return the coordinates (3,) of T0 [N], C [N s/m] and k [N/m], which may be infinite."""
        compliance = 1.0 / stiffness
        return np.array(
            [friction / self.force, np.arcsinh(damping / self._damping), np.arcsinh(compliance / self._compliance)]
        )

    def from_search(self, x: Array) -> tuple[float, float, float]:
        """Return T0 [N], C [N s/m] and k [N/m] at coordinates (3,)."""
        compliance = self._compliance * float(np.sinh(x[2]))
        stiffness = 1.0 / compliance if compliance > 0.0 else np.inf
        return self.force * float(x[0]), self._damping * float(np.sinh(x[1])), stiffness

    def slopes(self, x: Array) -> Array:
        """Return the derivatives (3,) of T0, C and 1/k by their coordinates (3,)."""
        return np.array([self.force, self._damping * np.cosh(x[1]), self._compliance * np.cosh(x[2])])
