"""What the data say of T0, C and k at an optimum: bounds, convergence, misfit, noise of the displacement."""

from __future__ import annotations

import numpy as np

from pzd.identify.misfit import Misfit
from pzd.identify.objective import Bingham, Objective
from pzd.identify.trust import (
    MISFIT,
    SPRING_TO_NOISE,
    STATIONARY,
    ParameterEvidence,
    displacement_noise,
    friction_scale,
)
from pzd.record import Array

NAMES = ("T0", "C", "k")
TARE = 0.3
"""A mean force above this share of the r.m.s. is worth a hint."""
NO_FRICTION = 1e-6
"""A friction below this share of the peak force is none."""


def scales_of(parameters: Bingham, measured: Array) -> Array:
    """(3,) what the uncertainty of T0, C and k is measured against."""
    return np.array([friction_scale(parameters.friction, measured), parameters.damping, parameters.stiffness])


def evidence_of(
    objective: Objective, parameters: Bingham, criterion: float, facts: Array, misfit: Misfit
) -> list[ParameterEvidence]:
    """What the data say of T0, C and k.

    Parameters
    ----------
    objective : the data
    parameters : the optimum
    criterion : W_s there
    facts : (5, 3) scale, half widths of the 95 % interval by noise alone and altogether, visible share, and cosine
        of stationarity of each
    misfit : what the model misses
    """
    scales, noise, widths, visible, cosines = facts.tolist()
    unsettled = _unsettled(objective, parameters, cosines)
    vetoes = [
        f"at a bound of the search{_tare(objective)}" if bounded else "the search did not converge" if moving else None
        for bounded, moving in zip(objective.at_bounds(parameters), unsettled, strict=True)
    ]
    vetoes[2] = vetoes[2] or _blurred(objective, parameters)
    doubt = _doubt(float(np.sqrt(criterion)), misfit)
    return [
        ParameterEvidence(name, scale, by_noise, width, share, veto, doubt)
        for name, scale, by_noise, width, share, veto in zip(NAMES, scales, noise, widths, visible, vetoes, strict=True)
    ]


def _doubt(left: float, misfit: Misfit) -> str | None:
    """Why the parameters are weak however narrow their intervals: the model lacks something."""
    missed = f"the model misses {misfit.share:.1%} of peak: the parameters are the model's, not the damper's"
    much = f"the model leaves {left:.0%} of the force's r.m.s."
    return "; ".join(words for words, true in ((missed, misfit.is_large), (much, left > MISFIT)) if true) or None


def _unsettled(objective: Objective, parameters: Bingham, cosines: list[float]) -> list[bool]:
    """Whether the criterion still falls along each parameter; at a friction of zero it may."""
    unsettled = [c > STATIONARY for c in cosines]
    if parameters.friction <= NO_FRICTION * objective.scales[0]:
        unsettled[0] = False
    return unsettled


def _tare(objective: Objective) -> str:
    """A hint where the force has a mean that the element cannot have."""
    mean = float(np.mean(objective.measured))
    if mean**2 <= TARE**2 * objective.energy / objective.measured.size:
        return ""
    return f"; the force has a mean of {mean:.0f} N, a tare of the load cell?"


def _blurred(objective: Objective, parameters: Bingham) -> str | None:
    """Why the displacement's noise hides the oil spring, None where it does not."""
    noise = max(displacement_noise(t.at_samples(t.displacement)) for t in objective.trials)
    spring = objective.scales[0] / parameters.stiffness
    if spring >= SPRING_TO_NOISE * noise:
        return None
    return f"the spring gives by {1e6 * spring:.1f} um at peak force, the displacement's noise is {1e6 * noise:.1f} um"
