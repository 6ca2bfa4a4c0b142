"""Tests as the fit of the knee law sees them: motion, force to be met, and the force that a curve gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pzd.damper.compose import constant_rows, integrated_force, sampling_steps
from pzd.damper.motion import Motion
from pzd.identify.knee.curve import KneeCurve
from pzd.identify.trial import in_motion
from pzd.record import Array, Mask, Record, mid_stroke

TOLERANCE = 1e-6
"""Admissible error of a piece of the path, as a share of the force; between its corners the law is in closed form."""


@dataclass(frozen=True, eq=False)
class Test:
    """One test, the displacement counted from the middle of all tests concerned."""

    __test__ = False

    record: Record
    motion: Motion
    steps: Array
    counted: Mask
    """(n,) which samples enter the criterion."""

    @property
    def measured(self) -> Array:
        """(m,) force at the counted samples [N]."""
        return self.record.force[self.counted]

    @property
    def of_gas(self) -> Array:
        """(m, 2) force of F_0 = 1 N and k_g = 1 N/m at the counted samples."""
        x = self.motion.displacement[self.counted]
        return np.column_stack([np.ones(x.size), x])

    def simulated(self, curve: KneeCurve, gas: Array) -> Array:
        """(m,) force of the element [N], begun at the measured force less that of the gas, (2,) F_0 and k_g."""
        rows, _ = constant_rows(curve.friction, curve.damping, curve.stiffness, {"knee": curve.effect()})
        first = float(self.record.force[0] - gas[0] - gas[1] * self.motion.displacement[0])
        return integrated_force(rows, self.motion, self.steps, first, TOLERANCE)[self.counted]


@dataclass(frozen=True, eq=False)
class Tests:
    """The tests of one condition, or some of them."""

    __test__ = False

    tests: tuple[Test, ...]
    middle: float
    """Displacement, as recorded, from which x is counted [m]."""

    @classmethod
    def of(cls, records: Sequence[Record]) -> Tests:
        """The tests, the displacement counted from the middle of their motion."""
        middle = mid_stroke(r.displacement for r in records)
        found = (Test(r, Motion.of(r).about(middle), sampling_steps(r.time), in_motion(r)) for r in records)
        return cls(tuple(found), middle)

    def some(self, kept: Sequence[int]) -> Tests:
        """Some of the tests, about the same zero."""
        return Tests(tuple(self.tests[i] for i in kept), self.middle)

    @cached_property
    def measured(self) -> Array:
        """(N,) force at the counted samples, test by test [N]."""
        return np.concatenate([t.measured for t in self.tests])

    @cached_property
    def of_gas(self) -> Array:
        """(N, 2) force of F_0 = 1 N and k_g = 1 N/m."""
        return np.vstack([t.of_gas for t in self.tests])

    @cached_property
    def speed(self) -> Array:
        """(N,) extension speed [m/s]."""
        return np.concatenate([t.record.velocity[t.counted] for t in self.tests])

    @property
    def fastest(self) -> float:
        """Largest speed [m/s]."""
        return float(np.max(np.abs(self.speed)))

    @property
    def peak(self) -> float:
        """Largest force [N]."""
        return float(np.max(np.abs(self.measured)))

    def simulated(self, curve: KneeCurve, gas: Array) -> Array:
        """(N,) force of the element [N]."""
        return np.concatenate([t.simulated(curve, gas) for t in self.tests])
