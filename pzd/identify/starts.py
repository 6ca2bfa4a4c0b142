"""Starting values read off the dissipative characteristic, as the paper's first stage does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pzd.identify.objective import Bingham
from pzd.identify.trial import Trial
from pzd.record import Array

FLANK = 0.3
"""The slip flank is read where the speed falls and still exceeds this share of its peak: there it surely slips."""
PRE_SLIP = 0.5
"""The pre-slip branch is read where abs(F) stays below this share of the force at the foot of the flank."""


def graphical_start(trials: Sequence[Trial]) -> Bingham:
    """Starting values of T0, C and k from the characteristic of force over speed.

    Equation: abs(F) = T0 + C (abs(v) - tau d abs(v)/dt) on the slip flank; k = dF/dx before slip
              Source: eq. (1)-(3), to first order in tau = C/k

    T0 is where the slip flank, extended, meets zero piston speed (the force measured there is
    larger, the oil spring being still loaded, which the term in tau takes off); C is the flank's
    slope; k the slope of force over displacement where the force passes through zero.

    Parameters
    ----------
    trials : the records of one condition

    Returns
    -------
    T0 [N], C [N s/m], k [N/m], all positive
    """
    speed, slowing, force = _flank(trials)
    peak = max(float(np.max(force, initial=0.0)), np.finfo(float).tiny)
    fastest = max(float(np.max(speed, initial=0.0)), np.finfo(float).tiny)
    terms = np.column_stack([np.ones(speed.size), speed / fastest, slowing / max(np.max(slowing, initial=0.0), 1e-12)])
    intercept, slope, _ = np.linalg.lstsq(terms, force / peak, rcond=1e-3)[0] * peak
    damping = max(slope, 0.05 * peak) / fastest
    friction = float(np.clip(intercept, 0.01 * peak, peak))
    return Bingham(friction, float(damping), _pre_slip_slope(trials, friction))


def _flank(trials: Sequence[Trial]) -> tuple[Array, Array, Array]:
    """Speed, its rate of fall, and force along the direction of motion, on the slip flank."""
    parts = []
    for t in trials:
        velocity = t.at_samples(np.gradient(t.displacement, t.step))
        step = t.step * (t.displacement.size - 1) / (t.force.size - 1)
        speed = np.abs(velocity)
        slowing = -np.gradient(speed, step)
        along = t.force * np.sign(velocity)
        flank = t.counted & (speed > FLANK * np.max(speed)) & (slowing >= 0.0) & (along > 0.0)
        parts.append(np.stack([speed[flank], slowing[flank], along[flank]]))
    speed, slowing, along = np.concatenate(parts, axis=1)
    return speed, slowing, along


def _pre_slip_slope(trials: Sequence[Trial], friction: float) -> float:
    """Slope of force over displacement where the force passes through zero, pooled over all passages."""
    covariance = variance = 0.0
    for t in trials:
        displacement = t.at_samples(t.displacement)[t.counted]
        force = t.force[t.counted]
        for part in _runs(np.abs(force) < PRE_SLIP * friction):
            dx = displacement[part] - displacement[part].mean()
            covariance += float(dx @ (force[part] - force[part].mean()))
            variance += float(dx @ dx)
    if covariance > 0.0:
        return covariance / variance
    stroke = max(float(np.ptp(t.displacement)) for t in trials)
    return 20.0 * friction / stroke


def _runs(inside: NDArray[np.bool_]) -> list[slice]:
    """Stretches of at least three samples inside."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], inside.astype(int), [0]))))
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 3]
