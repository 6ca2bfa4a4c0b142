"""From scored cases to rates: what counts as right, ambiguous or wrong, and how sure a rate is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from pzd.blind.case import Scored
from pzd.blind.outside import FORMS
from pzd.fit.intervals import CONFIDENCE
from pzd.schema.model import Frozen
from pzd.signals.measures import VISIBLE

NEGLIGIBLE_GAP = VISIBLE
"""A smaller gap counts as nothing missing."""
VISIBLE_TRUTH_GAP = 2.0 * VISIBLE
"""A hidden effect that leaves this visible gap must be found: twice the gap from which on an effect is adopted."""
GAP_EDGES = (0.0, NEGLIGIBLE_GAP, VISIBLE_TRUTH_GAP, 2.0 * VISIBLE_TRUTH_GAP, 4.0 * VISIBLE_TRUTH_GAP, math.inf)
"""Edges of the bins of the visible gap, as shares of the peak force."""
LOW_NOISE = 0.01
"""Noise up to this share of the peak is low."""

Predicate = Callable[[Scored], bool]


@dataclass(frozen=True)
class Rate:
    """Hits among cases, with the Wilson 95 % interval.

    >>> rate = Rate(8, 10)
    >>> rate.share, [round(end, 3) for end in rate.interval]
    (0.8, [0.49, 0.943])
    """

    hits: int
    count: int

    @classmethod
    def of(cls, cases: Iterable[Scored], hit: Predicate) -> Rate:
        """Count how many of the cases pass a test."""
        hits = [hit(case) for case in cases]
        return cls(sum(hits), len(hits))

    @property
    def share(self) -> float | None:
        """Hits over count; None without a case."""
        return self.hits / self.count if self.count else None

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the share.

        Equation: (p + z^2/2n +- z sqrt(p (1-p)/n + z^2/4n^2)) / (1 + z^2/n)      Source: Wilson 1927
        """
        from scipy.stats import binomtest

        if not self.count:
            return 0.0, 1.0
        found = binomtest(self.hits, self.count).proportion_ci(CONFIDENCE, method="wilson")
        return float(found.low), float(found.high)


# --- The answer to one case; a failed diagnosis is always wrong ---


def right(case: Scored) -> bool:
    """Return whether exactly the hidden effects are named."""
    return case.verdict == "named" and set(case.effects) == set(case.truth)


def ambiguous_with_truth(case: Scored) -> bool:
    """Return whether the verdict is ambiguous, and every hidden effect is among its effects and rivals."""
    return case.verdict == "ambiguous" and truth_among(case)


def wrong_name(case: Scored) -> bool:
    """Return whether something else than the hidden effects is named."""
    return case.failure is not None or (case.verdict == "named" and not right(case))


def truth_and_more(case: Scored) -> bool:
    """Return whether the hidden effects are named, and others with them."""
    return case.verdict == "named" and bool(case.truth) and set(case.truth) < set(case.effects)


def truth_among(case: Scored) -> bool:
    """Return whether every hidden effect is among the adopted ones and their rivals."""
    return bool(case.truth) and set(case.truth) <= {*case.effects, *case.rivals}


def wrong_single(case: Scored) -> bool:
    """Return whether one effect is named, of a case that hides something outside the library."""
    return case.failure is not None or (case.verdict == "named" and len(case.effects) == 1)


def shape_found(case: Scored) -> bool:
    """Return whether the shape of a form outside the library is among the first two hypotheses of the residual."""
    return case.hidden in FORMS and bool({*case.shapes[:2]} & {*FORMS[case.hidden].named_shapes})


def unexplained(case: Scored) -> bool:
    """Return whether the verdict is `unexplained`."""
    return case.verdict == "unexplained"


def rightly_outside(case: Scored) -> bool:
    """Return whether a form outside the library is left unexplained, or named by effects that describe it rightly."""
    described = bool(case.described_by) and bool(case.effects) and set(case.effects) <= set(case.described_by)
    return unexplained(case) or (case.verdict in ("named", "ambiguous") and described)


def false_name(case: Scored) -> bool:
    """Return whether an effect is named or adopted, of a case that hides none."""
    return case.failure is not None or case.verdict == "named" or (case.verdict == "ambiguous" and bool(case.effects))


def says_none(case: Scored) -> bool:
    """Return whether nothing is said to be missing, or an answer is left open that the true likelihood cannot give."""
    return case.verdict == "none" or (_nothing_adopted(case) and not case.told_apart)


def left_open(case: Scored) -> bool:
    """Return whether it is left open if something is missing, though the true likelihood can tell."""
    return _nothing_adopted(case) and case.told_apart


def _nothing_adopted(case: Scored) -> bool:
    return case.verdict == "ambiguous" and not case.effects


def failed(case: Scored) -> bool:
    """Return whether no diagnosis came."""
    return case.failure is not None


def visible(case: Scored) -> bool:
    """Return whether the hidden effects can be seen: of a pair, each one given the other."""
    return min([case.visible_gap, *case.gap_given_other.values()]) >= VISIBLE_TRUTH_GAP


def low_noise(case: Scored) -> bool:
    """Return whether the noise is at most 1 % of the peak."""
    return case.force_noise <= LOW_NOISE + 1e-12


def right_answer(case: Scored) -> bool:
    """Return whether the verdict is right: the names, `none` for nothing, `unexplained` for a form outside."""
    if case.kind == "outside":
        return unexplained(case)
    return right(case) if case.truth else says_none(case)


def wrong_answer(case: Scored) -> bool:
    """Return whether something wrong is named."""
    if case.kind == "outside":
        return wrong_single(case)
    return wrong_name(case) if case.truth else false_name(case)


def confidence_holds(case: Scored) -> bool:
    """Return whether what a confidence is stated for holds: every effect that counts is found, and no false one.

    A hidden effect below `NEGLIGIBLE_GAP` may be named or not. An ambiguous verdict holds if the truth is among its
    names.
    """
    if case.kind == "outside":
        return rightly_outside(case) or (case.visible_gap < NEGLIGIBLE_GAP and not case.effects)
    possible = {*case.effects, *(case.rivals if case.verdict == "ambiguous" else ())}
    counting = {name for name in case.truth if case.gap_given_other.get(name, case.visible_gap) >= NEGLIGIBLE_GAP}
    if not counting <= possible:
        return False
    return {*case.effects} <= {*case.truth} or (case.verdict == "ambiguous" and bool(counting))


# --- Rates by campaign, noise and visible gap ---


class RateRow(Frozen):
    """Rates of the cases of one campaign, noise and visible gap; intervals by Wilson."""

    campaign: str
    kind: str
    force_noise: str
    visible_gap_percent: str
    cases: int
    right: float
    right_low95: float
    right_high95: float
    ambiguous_with_truth: float
    wrong_name: float
    wrong_name_low95: float
    wrong_name_high95: float
    truth_and_more: float
    truth_among: float
    none: float
    unexplained: float
    failed: float


def rate_rows(cases: Iterable[Scored]) -> list[RateRow]:
    """Return a row for each campaign, kind, noise and bin of the visible gap that holds a case."""
    every = list(cases)
    campaigns = sorted({case.campaign for case in every})
    rows = []
    for campaign, kind, low, (start, end) in product(
        campaigns, ("single", "pair", "none", "outside"), (True, False), pairwise(GAP_EDGES)
    ):
        found = [
            c
            for c in every
            if (c.campaign, c.kind, low_noise(c)) == (campaign, kind, low) and start <= c.visible_gap < end
        ]
        if found:
            gap = f"{100 * start:g}-{100 * end:g}" if math.isfinite(end) else f"over {100 * start:g}"
            rows.append(_row(campaign, kind, "to 1 %" if low else "above 1 %", gap, found))
    return rows


_COUNTED: dict[str, Predicate] = {
    "right": right_answer,
    "ambiguous_with_truth": ambiguous_with_truth,
    "wrong_name": wrong_answer,
    "truth_and_more": truth_and_more,
    "truth_among": truth_among,
    "none": lambda case: case.verdict == "none",
    "unexplained": unexplained,
    "failed": failed,
}
"""Columns of `RateRow` that are rates."""


def _row(campaign: str, kind: str, force_noise: str, gap: str, cases: list[Scored]) -> RateRow:
    rates = {name: Rate.of(cases, hit) for name, hit in _COUNTED.items()}
    numbers = {name: rate.share or 0.0 for name, rate in rates.items()}
    for name in ("right", "wrong_name"):
        numbers[f"{name}_low95"], numbers[f"{name}_high95"] = rates[name].interval
    rounded = {name: round(number, 4) for name, number in numbers.items()}
    return RateRow(
        campaign=campaign, kind=kind, force_noise=force_noise, visible_gap_percent=gap, cases=len(cases), **rounded
    )


# --- Calibration of stated confidences ---


class CalibrationRow(Frozen):
    """Stated confidence against how often it was right, in one bin."""

    confidence_low: float
    confidence_high: float
    cases: int
    stated: float
    """Mean confidence."""
    hit_rate: float
    hit_low95: float
    hit_high95: float


def brier_gain(cases: Iterable[Scored]) -> float | None:
    """Compute by which share the mean square error of stated confidences is below that of the best constant.

    Equation: 1 - sum (c - h)^2 / sum (h - mean h)^2                Source: Brier 1950, Mon. Weather Rev. 78, eq. (2)

    None where every stated confidence held, or none did.
    """
    pairs = [(case.confidence, confidence_holds(case)) for case in cases if case.confidence is not None]
    if not pairs:
        return None
    stated, held = np.array(pairs, dtype=np.float64).T
    spread = float(np.sum((held - held.mean()) ** 2))
    return 1.0 - float(np.sum((stated - held) ** 2)) / spread if spread > 0.0 else None


CONFIDENCE_EDGES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)


def calibration_rows(cases: Iterable[Scored], limits: Sequence[float] = CONFIDENCE_EDGES) -> list[CalibrationRow]:
    """Return bins of the confidence, and how often what it was stated for holds.

    Parameters
    ----------
    cases : those that state none are left out
    limits : between the bins, rising
    """
    stated = [(case.confidence, case) for case in cases if case.confidence is not None]
    rows = []
    for low, high in pairwise(limits):
        inside = [(c, case) for c, case in stated if low < c <= high or low == c == limits[0]]
        if inside:
            rate = Rate.of((case for _, case in inside), confidence_holds)
            rows.append(
                CalibrationRow(
                    confidence_low=low,
                    confidence_high=high,
                    cases=len(inside),
                    stated=round(float(np.mean([c for c, _ in inside])), 4),
                    hit_rate=round(rate.hits / rate.count, 4),
                    hit_low95=round(rate.interval[0], 4),
                    hit_high95=round(rate.interval[1], 4),
                )
            )
    return rows
