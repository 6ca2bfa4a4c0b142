"""The plain damper: Bingham parameters over the control signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from pzd.record import Array

# ----------------------------------------------------------------------------------------------------
# How hard a case drives its damper: what the parameters of the laws are drawn in proportion to.


@dataclass(frozen=True)
class Scale:
    """Largest values over the tests of a case."""

    force: float
    """Of the plain damper [N]."""
    speed: float
    """Of the piston [m/s]."""
    stroke: float
    """From the middle of the stroke [m]."""
    acceleration: float
    """Of the piston [m/s2]; a high percentile, as corners of a triangle have no acceleration of their own."""
    damping: float
    """C in the middle of the range of the control signal [N s/m]."""
    voltage: float
    """Range of the control signal [V]."""


# ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Base:
    """Bingham parameters at every value of the control signal, linear between."""

    values: tuple[float, ...]
    T0: tuple[float, ...]
    C: tuple[float, ...]
    k: tuple[float, ...]

    @classmethod
    def drawn(cls, values: tuple[float, ...], draw: Generator) -> Base:
        """Those of a damper for anything between a seat and a lorry."""
        T0, C, k = (float(np.exp(draw.uniform(*np.log(span)))) for span in ((40, 400), (800, 6000), (1.5e5, 2e6)))
        share = np.linspace(0.0, 1.0, len(values)) ** float(draw.uniform(0.7, 1.3))
        gain = float(draw.uniform(1.5, 5.0))
        friction = T0 * (1.0 + (gain - 1.0) * share)
        damping = C * (1.0 + float(draw.uniform(-0.3, 0.6)) * share)
        stiffness = k * (1.0 + float(draw.uniform(-0.2, 0.5)) * share)
        return cls(values, *(tuple(float(v) for v in row) for row in (friction, damping, stiffness)))

    def at(self, signal: Array) -> tuple[Array, Array, Array]:
        """(n,) T0, C and k at values of the control signal."""
        T0, C, k = (np.asarray(np.interp(signal, self.values, row)) for row in (self.T0, self.C, self.k))
        return T0, C, k
