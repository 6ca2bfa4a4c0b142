"""Which parameters the data determine, judged by what they do to the force and by their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pzd.record import Array
from pzd.signals.root_mean_square import rms

SENSOR_ERROR = 0.005
"""A systematic force error of this share of r.m.s. is always possible: load cells are of class 0.5 at best."""
UNDETERMINED_SHARE = 0.5
"""A parameter is undetermined when its 95 % half width by noise alone, or the shift that the sensor error may cause,
exceeds this share of it. What the sensors or a misfit add makes it weak: the data still have a value for it."""
WEAK_WIDTH = 0.1
"""A parameter is weak when its 95 % half width exceeds this share of it."""
WEAK_SHIFT = 0.2
"""A parameter is weak when the sensor error may shift it by this share."""
FRICTION_FLOOR = 0.05
"""T0 is judged against itself or this share of the force's r.m.s., the larger: a friction of zero is a finding."""
SPRING_TO_NOISE = 10.0
"""k is undetermined when the spring gives by less than this many times the displacement's noise at peak force:
what the noise does to the force then decides on k."""
MISFIT = 0.2
"""All parameters are weak where the model leaves more than this share of the force's r.m.s."""
STATIONARY = 1e-3
"""Largest cosine between the residuals and a parameter's slope at an optimum."""
EXACT = 1e-14
"""A criterion below this is rounding: the fit is exact."""


@dataclass(frozen=True)
class Trust:
    """What to say of the parameters of one row."""

    status: str
    """`ok`, or `weak: ...`, `undetermined: ...` with the reason."""
    determined: tuple[bool, ...]
    """Whether each parameter's value may be shown."""


@dataclass(frozen=True)
class ParameterEvidence:
    """What the data say of one parameter."""

    name: str
    scale: float
    """What its uncertainty is measured against [its unit]."""
    noise: float
    """Half width of the 95 % interval that noise of the residuals' colour alone gives it [its unit]."""
    half_width: float
    """Half width of its 95 % interval, sensors and misfit allowed for [its unit]."""
    visible: float
    """R.m.s. of the force that changes with it by one scale and that no other parameter makes up, over the r.m.s."""
    veto: str | None = None
    """Why it is undetermined whatever the numbers say."""
    doubt: str | None = None
    """Why it is weak whatever the numbers say."""

    def undetermined(self) -> str | None:
        """Why the data do not determine it, None where they do."""
        if self.veto:
            return self.veto
        if self.visible <= 0.0:
            return "the force does not depend on it, or another parameter makes it up"
        if self.shift > UNDETERMINED_SHARE:
            return f"a force error of {SENSOR_ERROR:.1%} may shift it by {_percent(self.shift)}"
        if not self.noise <= UNDETERMINED_SHARE * self.scale:
            return f"95 % interval of +-{_percent(self.noise / self.scale)} by noise alone"
        return None

    def weak(self) -> str | None:
        """Why it is weak, None where it is not."""
        if self.doubt:
            return self.doubt
        if self.half_width > WEAK_WIDTH * self.scale:
            return f"95 % interval of +-{_percent(self.half_width / self.scale)}"
        if self.shift > WEAK_SHIFT:
            return f"a force error of {SENSOR_ERROR:.1%} may shift it by {_percent(self.shift)}"
        return None

    @property
    def shift(self) -> float:
        """Largest relative shift that a force error of `SENSOR_ERROR` can cause."""
        return SENSOR_ERROR / self.visible if self.visible > 0.0 else np.inf


def friction_scale(friction: float, force: Array) -> float:
    """What the uncertainty of T0 is measured against [N]."""
    return max(friction, FRICTION_FLOOR * rms(force))


def visible_shares(slopes: Array, scales: Array, energy: float) -> Array:
    """What each parameter does to the force that no other parameter makes up, as a share of r.m.s.

    Equation: s_j = scale_j / sqrt([(J'J)^-1]_jj sum F^2)      Source: partial regression

    Parameters
    ----------
    slopes : (N, p) J, derivatives of the force by the parameters
    scales : (p,) change of each parameter
    energy : sum of F^2 over the samples concerned [N2]

    Returns
    -------
    (p,) shares, 0 where the slopes are linearly dependent
    """
    scaled = slopes * scales
    size = np.linalg.norm(scaled, axis=0)
    unit = scaled / np.where(size > 0.0, size, 1.0)
    gram = unit.T @ unit
    shares = np.zeros(size.size)
    for j in range(size.size):
        others = np.delete(np.arange(size.size), j)
        solved = np.linalg.lstsq(gram[np.ix_(others, others)], gram[others, j], rcond=1e-12)[0]
        shares[j] = np.sqrt(max(float(gram[j, j] - gram[others, j] @ solved), 0.0)) * size[j]
    result: Array = shares / np.sqrt(energy)
    return result


def stationarity(slopes: Array, residuals: Array, energy: float) -> Array:
    """(p,) cosine between the residuals and each slope, 0 at an optimum, whatever the solver says."""
    size = np.linalg.norm(slopes, axis=0) * np.sqrt(residuals @ residuals)
    if float(residuals @ residuals) <= EXACT * energy:
        return np.zeros(size.size)
    cosines: Array = np.abs(slopes.T @ residuals) / np.where(size > 0.0, size, 1.0)
    return cosines


def displacement_noise(displacement: Array) -> float:
    """White noise of a sampled displacement, from its third differences [m].

    Equation: sigma = q90(|third difference|) / (1.645 sqrt(20))      Source: variance of 1, -3, 3, -1 is 20
    """
    if displacement.size < 8:
        return 0.0
    return float(np.quantile(np.abs(np.diff(displacement, 3)), 0.9) / (1.645 * np.sqrt(20.0)))


def trust_of(evidence: Sequence[ParameterEvidence]) -> Trust:
    """The status of a row from the evidence on its parameters."""
    reasons = [e.undetermined() for e in evidence]
    weak = [None if reason else e.weak() for e, reason in zip(evidence, reasons, strict=True)]
    names = [e.name for e in evidence]
    parts = [_clause("undetermined", names, reasons), _clause("weak", names, weak)]
    return Trust("; ".join(p for p in parts if p) or "ok", tuple(reason is None for reason in reasons))


def _clause(word: str, names: Sequence[str], reasons: Sequence[str | None]) -> str:
    named = [(n, r) for n, r in zip(names, reasons, strict=True) if r]
    if not named:
        return ""
    alike = len({reason for _, reason in named}) == 1
    detail = named[0][1] if alike else "; ".join(f"{n}: {r}" for n, r in named)
    return f"{word}: {', '.join(n for n, _ in named)} ({detail})"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share < 10.0 else "more than 1000 %"
