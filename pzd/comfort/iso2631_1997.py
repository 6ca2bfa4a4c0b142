"""ISO 2631-1:1997: the weighted measures of a ride, when the r.m.s. does not suffice, and the likely reactions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.record import Array
from pzd.signals.measures import rms

EDITION = "ISO 2631-1:1997"

INTEGRATION_TIME_S = 1.0
"""tau of the running r.m.s. behind MTVV, ISO 2631-1:1997, 6.3.1."""


def vibration_dose(acceleration: Array, rate: float) -> float:
    """Compute the fourth power vibration dose value, which grows with the length of the ride.

    Equation: VDV = (int a(t)^4 dt)^(1/4)                Source: ISO 2631-1:1997, eq. (5)

    Parameters
    ----------
    acceleration : (n,) weighted acceleration [m/s2]
    rate : sampling rate [Hz]

    Returns
    -------
    [m/s^1.75]

    Examples
    --------
    >>> vibration_dose(np.ones(1600), 100.0)
    2.0
    """
    return float((np.sum(acceleration**4) / rate) ** 0.25)


def maximum_transient(acceleration: Array, rate: float) -> float:
    """Compute the maximum transient vibration value: the largest running r.m.s. over 1 s.

    Equation: MTVV = max sqrt(1/tau int_(t0-tau)^t0 a(t)^2 dt), tau = 1 s
                                                         Source: ISO 2631-1:1997, eq. (2), (4)

    Parameters
    ----------
    acceleration : (n,) weighted acceleration; shorter than 1 s, its r.m.s. is taken [m/s2]
    rate : sampling rate [Hz]

    Returns
    -------
    [m/s2]
    """
    window = min(max(round(INTEGRATION_TIME_S * rate), 1), acceleration.size)
    total = np.concatenate([[0.0], np.cumsum(acceleration**2)])
    return float(np.sqrt(np.max(total[window:] - total[:-window]) / window))


# --- All measures of a ride, and the limits of the r.m.s. ---

CREST_LIMIT = 9.0
MTVV_LIMIT = 1.5
VDV_LIMIT = 1.75
"""Above any of these the r.m.s. alone understates the vibration (6.2.1 and 6.3.3)."""


@dataclass(frozen=True)
class Reaction:
    """One of the likely reactions in public transport (Annex C); neighbouring ranges overlap in the standard."""

    text: str
    low: float
    """[m/s2]"""
    high: float
    """[m/s2]"""
    trust: str


REACTIONS = (
    Reaction("not uncomfortable", 0.0, 0.315, "verified"),
    Reaction("a little uncomfortable", 0.315, 0.63, "verified"),
    Reaction("fairly uncomfortable", 0.5, 1.0, "verified"),
    Reaction("uncomfortable", 0.8, 1.6, "verified"),
    Reaction("very uncomfortable", 1.25, 2.5, "recalled, not verified"),
    Reaction("extremely uncomfortable", 2.0, float("inf"), "recalled, not verified"),
)

HEALTH_ZONES = {"0.45-0.90": (0.45, 0.90), "0.47-0.93": (0.47, 0.93)}
"""Readings of the health guidance caution zone at 8 h [m/s2]: secondary sources disagree."""


@dataclass(frozen=True)
class Evaluation:
    """The weighted measures of one ride."""

    a_w: float
    """Weighted r.m.s. [m/s2]."""
    peak: float
    """Weighted peak [m/s2]."""
    vdv: float
    """[m/s^1.75]"""
    mtvv: float
    """[m/s2]"""
    duration: float
    """T, over which these were taken [s]."""

    @property
    def crest(self) -> float:
        """Peak over r.m.s.; 0 for a vehicle at rest, as the ratios below."""
        return self.peak / self.a_w if self.a_w > 0.0 else 0.0

    @property
    def mtvv_ratio(self) -> float:
        """MTVV / a_w."""
        return self.mtvv / self.a_w if self.a_w > 0.0 else 0.0

    @property
    def vdv_ratio(self) -> float:
        """VDV / (a_w T^(1/4))."""
        return self.vdv / (self.a_w * self.duration**0.25) if self.a_w > 0.0 else 0.0

    @property
    def beyond(self) -> tuple[str, ...]:
        """Conditions that hold under which MTVV and VDV are to be reported besides a_w."""
        found = (
            (self.crest > CREST_LIMIT, f"crest factor above {CREST_LIMIT:g}"),
            (self.mtvv_ratio > MTVV_LIMIT, f"MTVV/a_w above {MTVV_LIMIT:g}"),
            (self.vdv_ratio > VDV_LIMIT, f"VDV/(a_w T^(1/4)) above {VDV_LIMIT:g}"),
        )
        return tuple(text for met, text in found if met)


def evaluate(weighted: Array, rate: float) -> Evaluation:
    """Compute all measures of a weighted history.

    Source: ISO 2631-1:1997, eq. (1), (2), (4), (5) and 6.3.3

    Parameters
    ----------
    weighted : (n,) weighted acceleration of the settled ride [m/s2]
    rate : sampling rate [Hz]

    Returns
    -------
    the measures
    """
    return Evaluation(
        a_w=rms(weighted),
        peak=float(np.max(np.abs(weighted))),
        vdv=vibration_dose(weighted, rate),
        mtvv=maximum_transient(weighted, rate),
        duration=weighted.size / rate,
    )


def reactions(a_w: float) -> tuple[Reaction, ...]:
    """Return the likely reactions to a weighted r.m.s. [m/s2]; the ranges overlap, so there may be two."""
    return tuple(reaction for reaction in REACTIONS if reaction.low <= a_w < reaction.high)
