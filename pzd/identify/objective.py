"""Criterion (4) over the records of one condition, and the bounds of the search.

Equation: W_s = sum (F - F_sim)^2 / sum F^2      Source: Makowski and Knap 2021, eq. (4)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pzd.damper.element import element_force, element_force_sensitivities
from pzd.identify.trial import Trial
from pzd.record import Array

LARGEST_PRE_SLIP = 0.45
"""Largest pre-slip deflection T0/k of the search, as a share of the range of displacement."""
AT_BOUND = 1e-3
"""A parameter within this share of a bound, in search coordinates, lies at it."""


class Bingham(NamedTuple):
    """The three parameters of the element, or one number for each of them."""

    friction: float
    damping: float
    stiffness: float


@dataclass(frozen=True, eq=False)
class Objective:
    """What both methods minimise: criterion (4) pooled over the counted samples of the trials."""

    trials: tuple[Trial, ...]
    basis: Array | None = None
    """(N, q) orthonormal forces beside the element whose best multiples are solved inside, by variable projection."""

    @cached_property
    def measured(self) -> Array:
        """(N,) measured force at the counted samples, trial by trial [N]."""
        return np.concatenate([t.force[t.counted] for t in self.trials])

    @cached_property
    def energy(self) -> float:
        """Denominator of the criterion [N2]."""
        return float(self.measured @ self.measured)

    @property
    def lengths(self) -> tuple[int, ...]:
        """Counted samples of each trial."""
        return tuple(int(np.count_nonzero(t.counted)) for t in self.trials)

    def simulated(self, parameters: Bingham) -> Array:
        """(N,) force of the element [N]."""
        return np.concatenate(
            [
                t.met(element_force(t.displacement, t.step, *parameters, float(t.force[0]), every=t.every))
                for t in self.trials
            ]
        )

    def residuals(self, parameters: Bingham) -> Array:
        """(N,) measured less simulated force, the forces beside the element at their best [N]."""
        return self._projected(self.measured - self.simulated(parameters))

    def residuals_and_slopes(self, parameters: Bingham) -> tuple[Array, Array]:
        """(N,) residuals and (N, 3) what T0, C and k do to the force that nothing beside the element makes up."""
        simulated, slopes = self.simulated_and_slopes(parameters)
        return self._projected(self.measured - simulated), self._projected(slopes)

    def simulated_and_slopes(self, parameters: Bingham) -> tuple[Array, Array]:
        """(N,) force of the element and (N, 3) its derivatives by T0, C and k."""
        forces, slopes = [], []
        for t in self.trials:
            force, slope = element_force_sensitivities(
                t.displacement, t.step, *parameters, float(t.force[0]), every=t.every
            )
            forces.append(t.met(force))
            slopes.append(t.met(slope))
        return np.concatenate(forces), np.concatenate(slopes)

    def _projected(self, values: Array) -> Array:
        """What of (N,) or (N, p) forces the basis cannot make up.

        Equation: (I - Q Q') r                      Source: Golub and Pereyra 1973, variable projection
        """
        return values if self.basis is None else values - self.basis @ (self.basis.T @ values)

    def criterion(self, parameters: Bingham) -> float:
        """W_s at the parameters."""
        residuals = self.residuals(parameters)
        return float(residuals @ residuals) / self.energy

    @cached_property
    def scales(self) -> tuple[float, float, float]:
        """Peak force [N], peak speed [m/s] and range of displacement [m] over the trials."""
        speed = max(float(np.max(np.abs(np.diff(t.displacement)))) / t.step for t in self.trials)
        stroke = max(float(np.ptp(t.displacement)) for t in self.trials)
        return float(np.max(np.abs(self.measured))), speed, stroke

    @cached_property
    def bounds(self) -> tuple[Bingham, Bingham]:
        """Smallest and largest parameters worth a look, from the data's own scales.

        T0 up to the peak force; C from 1e-4 to 1e2 of peak force over peak speed; k from 0.1 to
        1e4 of peak force over the range of displacement.
        """
        force, speed, stroke = self.scales
        return (
            Bingham(0.0, 1e-4 * force / speed, 0.1 * force / stroke),
            Bingham(force, 1e2 * force / speed, 1e4 * force / stroke),
        )

    @cached_property
    def search_bounds(self) -> tuple[Array, Array]:
        """(3,) bounds of what least squares searches."""
        low, high = self.bounds
        return (
            np.array([0.0, np.log(low.damping), np.log(low.stiffness)]),
            np.array([LARGEST_PRE_SLIP, np.log(high.damping), np.log(high.stiffness)]),
        )

    def slips(self, parameters: Bingham) -> bool:
        """Whether the element slips within every full stroke: else F(0) would act as a free offset for ever."""
        return parameters.friction <= LARGEST_PRE_SLIP * parameters.stiffness * self.scales[2]

    def at_bounds(self, parameters: Bingham) -> tuple[bool, ...]:
        """Whether each parameter lies at a bound of the search; a friction of zero does not."""
        low, high = self.search_bounds
        x = to_search(parameters, self.scales[2])
        beyond = x >= high - AT_BOUND * np.abs(high)
        below = x <= low + AT_BOUND * np.abs(low)
        return bool(beyond[0]), bool(beyond[1] or below[1]), bool(beyond[2] or below[2])

    def clipped(self, parameters: Bingham) -> Bingham:
        """The parameters, brought inside the bounds."""
        stroke = self.scales[2]
        return from_search(np.clip(to_search(parameters, stroke), *self.search_bounds), stroke)


@dataclass(frozen=True, eq=False)
class Fit:
    """An optimum of the criterion."""

    parameters: Bingham
    criterion: float
    residuals: Array
    """(N,) measured less simulated force at the counted samples [N]."""
    slopes: Array
    """(N, 3) derivatives of the simulated force by T0, C and k."""


def to_search(parameters: Bingham, stroke: float) -> Array:
    """(3,) what least squares searches: pre-slip T0/k as a share of the stroke, the logarithms of C and k."""
    friction, damping, stiffness = parameters
    return np.array([friction / (stiffness * stroke), np.log(damping), np.log(stiffness)])


def from_search(x: Array, stroke: float) -> Bingham:
    """The parameters from what least squares searches."""
    stiffness = float(np.exp(x[2]))
    return Bingham(float(x[0]) * stiffness * stroke, float(np.exp(x[1])), stiffness)


def search_slopes(parameters: Bingham, stroke: float) -> Array:
    """(3, 3) derivatives of T0, C, k (rows) by what least squares searches (columns)."""
    friction, damping, stiffness = parameters
    return np.array([[stiffness * stroke, 0.0, friction], [0.0, damping, 0.0], [0.0, 0.0, stiffness]])
