"""The knee law as numbers: bleed, knee and blow-off of each direction, and the coordinates in which they are searched.

Equation: |F| = T0 + C w up to the speed w_k of the knee, then T0 + C w_k + B (w - w_k); C, w_k and B of each direction
                                        Source: bleed and blow-off, Dixon 2007; element of eq. (1)-(3) with k
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pzd.damper.fitted_laws.knee import NO_KNEE
from pzd.record import Array

REBOUND, COMPRESSION = 0, 1
"""The directions, in this order wherever there are two of something."""


class KneeCurve(NamedTuple):
    """The parameters of the element; pairs are of rebound and compression."""

    friction: float
    """T0 [N]."""
    bleed: tuple[float, float]
    """C [N s/m]."""
    stiffness: float
    """k [N/m]."""
    knee_speed: tuple[float, float]
    """w_k [m/s]; infinite without a knee."""
    blow_off: tuple[float, float]
    """B [N s/m]; without a knee the bleed."""

    def knee_force(self, way: int) -> float:
        """Force at the knee of one direction [N]."""
        return self.friction + self.bleed[way] * self.knee_speed[way]

    @property
    def damping(self) -> float:
        """Mean of both bleeds [N s/m], the C of the damper's base row."""
        return 0.5 * (self.bleed[REBOUND] + self.bleed[COMPRESSION])

    def effect(self) -> dict[str, float]:
        """Parameters of the law `knee` beside T0, `damping` and k."""
        forces = [min(self.knee_force(way), NO_KNEE) for way in (REBOUND, COMPRESSION)]
        return {
            "beta": (self.bleed[REBOUND] - self.bleed[COMPRESSION]) / (2.0 * self.damping),
            "F_reb": forces[REBOUND],
            "C_reb": self.blow_off[REBOUND],
            "F_comp": forces[COMPRESSION],
            "C_comp": self.blow_off[COMPRESSION],
        }


@dataclass(frozen=True)
class KneeForm:
    """Which of the parameters are free."""

    alike: bool = False
    """Whether both directions have one bleed and no knee: the Bingham element."""
    bent: tuple[bool, bool] = (True, True)
    """Whether rebound and compression have a knee."""

    @property
    def ways(self) -> tuple[int, ...]:
        """The directions with a knee."""
        return tuple(way for way in (REBOUND, COMPRESSION) if self.bent[way])

    def natural(self, curve: KneeCurve) -> Array:
        """(p,) the free parameters in their own units: T0, the bleeds, k, then w_k and B of each knee."""
        bleeds = curve.bleed[:1] if self.alike else curve.bleed
        knees = [value for way in self.ways for value in (curve.knee_speed[way], curve.blow_off[way])]
        return np.array([curve.friction, *bleeds, curve.stiffness, *knees])

    def curve(self, natural: Array) -> KneeCurve:
        """The curve that they stand for."""
        friction, *rest = natural.tolist()
        bleed = (rest[0], rest[0]) if self.alike else (rest[0], rest[1])
        stiffness, *knees = rest[1:] if self.alike else rest[2:]
        speed, slope = [np.inf, np.inf], [*bleed]
        for place, way in enumerate(self.ways):
            speed[way], slope[way] = knees[2 * place : 2 * place + 2]
        return KneeCurve(friction, bleed, stiffness, (speed[0], speed[1]), (slope[0], slope[1]))

    def searched(self, curve: KneeCurve, force: float) -> Array:
        """(p,) what least squares searches: T0 as a share of a force [N], the logarithms of all others."""
        natural = self.natural(curve)
        return np.concatenate([natural[:1] / force, np.log(natural[1:])])

    def found(self, searched: Array, force: float) -> KneeCurve:
        """The curve at a point of the search."""
        return self.curve(np.concatenate([searched[:1] * force, np.exp(searched[1:])]))


BINGHAM = KneeForm(alike=True, bent=(False, False))
"""One T0 and C."""
