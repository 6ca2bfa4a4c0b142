"""From scored cases to rates: what counts as right, ambiguous, wrong, and how sure a rate is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from pzd.blind.case import Scored
from pzd.blind.outside import FORMS
from pzd.diagnosis.config import DiagnoseConfig
from pzd.schema.model import Frozen

Z95 = 1.959963984540054
"""Two-sided 95 % point of the normal distribution."""
GAPS = (0.0, 0.0025, 0.005, 0.01, 0.02, math.inf)
"""Edges of the bins of the visible gap, as shares of the peak force."""
VISIBLE = 0.005
"""A truth is visible from this gap on."""
COUNTS = DiagnoseConfig().visible
"""A smaller gap counts as nothing missing."""
LOW_NOISE = 0.01
"""Noise up to this share of the peak is low."""

Predicate = Callable[[Scored], bool]


@dataclass(frozen=True)
class Rate:
    """So many of so many, with the Wilson 95 % interval."""

    hits: int
    count: int

    @classmethod
    def of(cls, cases: Iterable[Scored], hit: Predicate) -> Rate:
        """How many of the cases pass a test."""
        hits = [hit(case) for case in cases]
        return cls(sum(hits), len(hits))

    @property
    def share(self) -> float | None:
        """Hits over count; None of nothing."""
        return self.hits / self.count if self.count else None

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the share.

        Equation: (p + z^2/2n +- z sqrt(p (1-p)/n + z^2/4n^2)) / (1 + z^2/n)      Source: Wilson 1927
        """
        if not self.count:
            return 0.0, 1.0
        n, p = self.count, self.hits / self.count
        middle = p + Z95**2 / (2 * n)
        half = Z95 * math.sqrt(p * (1.0 - p) / n + Z95**2 / (4 * n * n))
        whole = 1.0 + Z95**2 / n
        return max((middle - half) / whole, 0.0), min((middle + half) / whole, 1.0)


# ---------------------------------------------------------------- what is said of one case


def right(case: Scored) -> bool:
    """Named, and exactly what was there."""
    return case.verdict == "named" and set(case.effects) == set(case.truth)


def ambiguous_with_truth(case: Scored) -> bool:
    """Called ambiguous, everything that was there being among the effects and rivals."""
    return case.verdict == "ambiguous" and among(case)


def wrong_name(case: Scored) -> bool:
    """Named, and something else than what was there; a failed diagnosis is wrong as well."""
    return case.failure is not None or (case.verdict == "named" and not right(case))


def truth_and_more(case: Scored) -> bool:
    """Named what was there, and something beside it."""
    return case.verdict == "named" and bool(case.truth) and set(case.truth) < set(case.effects)


def among(case: Scored) -> bool:
    """What was there is among what was adopted and what would do as well."""
    return bool(case.truth) and set(case.truth) <= {*case.effects, *case.rivals}


def wrong_single(case: Scored) -> bool:
    """Named one effect, though what was there is not in the library; a failed diagnosis is wrong as well."""
    return case.failure is not None or (case.verdict == "named" and len(case.effects) == 1)


def shape_told(case: Scored) -> bool:
    """The shape of a force outside the library is among the first two that are told of what is left."""
    return case.hidden in FORMS and bool({*case.shapes[:2]} & {*FORMS[case.hidden].named_shapes})


def rightly_outside(case: Scored) -> bool:
    """Left unexplained, or named by what describes it rightly."""
    described = bool(case.described_by) and bool(case.effects) and set(case.effects) <= set(case.described_by)
    return case.verdict == "unexplained" or (case.verdict in ("named", "ambiguous") and described)


def false_name(case: Scored) -> bool:
    """Something named or adopted where nothing was there; a failed diagnosis is wrong as well."""
    return case.failure is not None or case.verdict in ("named", "ambiguous")


def visible(case: Scored) -> bool:
    """Whether what was hidden can be seen: of a pair, each one given the other."""
    return case.visible_gap >= VISIBLE and all(gap >= VISIBLE for gap in case.gap_given_other.values())


def low_noise(case: Scored) -> bool:
    """Whether the noise is at most 1 % of the peak."""
    return case.force_noise <= LOW_NOISE + 1e-12


# ---------------------------------------------------------------- tables


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
    """A row for each campaign, kind, noise and bin of the visible gap that holds a case."""
    every = list(cases)
    campaigns = sorted({case.campaign for case in every})
    rows = []
    for campaign, kind, low, (start, end) in product(
        campaigns, ("single", "pair", "none", "outside"), (True, False), pairwise(GAPS)
    ):
        found = [
            c
            for c in every
            if (c.campaign, c.kind, low_noise(c)) == (campaign, kind, low) and start <= c.visible_gap < end
        ]
        if found:
            rows.append(_row((campaign, kind, "to 1 %" if low else "above 1 %", _bin(start, end)), found))
    return rows


def _bin(start: float, end: float) -> str:
    return f"{100 * start:g}-{100 * end:g}" if math.isfinite(end) else f"over {100 * start:g}"


def _row(labels: tuple[str, str, str, str], cases: list[Scored]) -> RateRow:
    def share(hit: Predicate) -> float:
        return round(Rate.of(cases, hit).share or 0.0, 4)

    exact, wrong = Rate.of(cases, rightly), Rate.of(cases, wrongly)
    return RateRow(
        campaign=labels[0],
        kind=labels[1],
        force_noise=labels[2],
        visible_gap_percent=labels[3],
        cases=len(cases),
        right=share(rightly),
        right_low95=round(exact.interval[0], 4),
        right_high95=round(exact.interval[1], 4),
        ambiguous_with_truth=share(ambiguous_with_truth),
        wrong_name=share(wrongly),
        wrong_name_low95=round(wrong.interval[0], 4),
        wrong_name_high95=round(wrong.interval[1], 4),
        truth_and_more=share(truth_and_more),
        truth_among=share(among),
        none=share(lambda c: c.verdict == "none"),
        unexplained=share(lambda c: c.verdict == "unexplained"),
        failed=share(lambda c: c.failure is not None),
    )


def rightly(case: Scored) -> bool:
    """The right word for what was there: its name, `none` for nothing, `unexplained` for what is not in the library."""
    if case.kind == "outside":
        return case.verdict == "unexplained"
    return right(case) if case.truth else case.verdict == "none"


def wrongly(case: Scored) -> bool:
    """A wrong name for what was there, or for nothing."""
    if case.kind == "outside":
        return wrong_single(case)
    return wrong_name(case) if case.truth else false_name(case)


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


def held(case: Scored) -> bool:
    """Whether what a confidence is stated for holds: that what is named is there, or a rival, and nothing else counts.

    Where nothing counts, an effect that was hidden is rightly named and rightly not.
    """
    if case.kind == "outside":
        return rightly_outside(case) or (case.visible_gap < COUNTS and not case.effects)
    said = {*case.effects, *(case.rivals if case.verdict == "ambiguous" else ())}
    there = {name for name in case.truth if case.gap_given_other.get(name, case.visible_gap) >= COUNTS}
    if not there <= said:
        return False
    return {*case.effects} <= {*case.truth} or (case.verdict == "ambiguous" and bool(there))


def brier_gain(cases: Iterable[Scored]) -> float | None:
    """By which share the mean square error of stated confidences is below that of the best constant.

    Equation: 1 - sum (c - h)^2 / sum (h - mean h)^2                Source: Brier 1950, Mon. Weather Rev. 78, eq. (2)

    None where nothing, or always the same, came of them.
    """
    stated = [(case.confidence, held(case)) for case in cases if case.confidence is not None]
    if not stated:
        return None
    said, came = np.array(stated, dtype=np.float64).T
    spread = float(np.sum((came - came.mean()) ** 2))
    return 1.0 - float(np.sum((said - came) ** 2)) / spread if spread > 0.0 else None


CONFIDENCES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)


def calibration_rows(cases: Iterable[Scored], limits: Sequence[float] = CONFIDENCES) -> list[CalibrationRow]:
    """Bins of the confidence, and how often what it was stated for held.

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
            rate = Rate.of((case for _, case in inside), held)
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
