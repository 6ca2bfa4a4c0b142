"""What the diagnosis has to reach, each target beside the figure: pure functions of the scored cases."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Literal

import numpy as np

from pzd.blind.case import Scored
from pzd.blind.rates import (
    CalibrationRow,
    Predicate,
    Rate,
    ambiguous_with_truth,
    among,
    brier_gain,
    calibration_rows,
    false_name,
    low_noise,
    right,
    rightly_outside,
    shape_told,
    visible,
    wrong_name,
    wrong_single,
)
from pzd.schema.model import Frozen

FULL_BIN = 50
"""A bin of the calibration counts from so many cases on."""
ENOUGH_PARAMETERS = 400
"""So do intervals from so many parameters on."""
FIFTHS = (0.2, 0.4, 0.6, 0.8, 1.0)
"""Bins of as many cases, where there are `FULL_FIFTH` to each."""
FULL_FIFTH = 200
CALIBRATED = 0.05
"""Largest distance of stated confidence and hit rate."""
TWINS = {"gas_spring", "fluid_inertia"}
"""The same thing while all tests share one frequency."""


Met = Literal["met", "missed", "no cases", "too few", "shown"]


class Line(Frozen):
    """One target and its figure."""

    about: str
    """Which cases."""
    figure: str
    """What is counted."""
    value: float | None
    low95: float | None
    high95: float | None
    count: int
    target: str
    """What it has to be; empty where the figure is shown alone."""
    met: Met


def lines(cases: Sequence[Scored]) -> list[Line]:
    """Every line of what the benchmark says, in the order of the printed page."""
    return [*_selection(cases), *_nothing_to_name(cases), *_gap_cuts(cases), *_calibration(cases), *_counts(cases)]


def campaign_lines(cases: Sequence[Scored]) -> list[Line]:
    """How far the verdicts hold on each campaign alone, the campaigns in the order of their first case."""
    found = []
    for name in dict.fromkeys(case.campaign for case in cases):
        mine = [c for c in cases if c.campaign == name]
        seen = [c for c in mine if c.truth and visible(c)]
        nothing = [c for c in mine if not c.truth and c.kind != "outside"]
        outside = [c for c in mine if c.kind == "outside" and visible(c)]
        found += [
            rate_line(f"{name}, visible", "right, or ambiguous with the truth", seen, _right_or_ambiguous, ">= 95 %"),
            rate_line(f"{name}, visible", "wrong name", seen, wrong_name, "<= 1 %"),
            rate_line(f"{name}, no effect", "false names", nothing, false_name, "<= 1 %"),
            rate_line(f"{name}, outside the library, visible", "unexplained", outside, _unexplained, ">= 92 %"),
        ]
    return found


def independent_lines(cases: Sequence[Scored]) -> list[Line]:
    """The same of cases of the second generator, whose forms outside the library say what describes them rightly."""
    seen = [c for c in cases if c.truth and visible(c)]
    nothing = [c for c in cases if not c.truth and c.kind != "outside"]
    outside = [c for c in cases if c.kind == "outside" and visible(c)]
    strict = [c for c in outside if not c.described_by]
    return [
        rate_line("visible", "right, or ambiguous with the truth", seen, _right_or_ambiguous, ">= 95 %"),
        rate_line("visible", "right name", seen, right),
        rate_line("visible", "wrong name", seen, wrong_name, "<= 1 %"),
        rate_line("no effect", "false names", nothing, false_name, "<= 1 %"),
        rate_line("outside the library, visible", "flagged, or rightly described", outside, rightly_outside, ">= 92 %"),
        rate_line("outside, described by nothing", "unexplained", strict, _unexplained),
        rate_line("outside, described by nothing", "a wrong single name", strict, wrong_single),
        *_gap_cuts(cases),
        *_calibration(cases),
        rate_line("all", "failed", cases, lambda c: c.failure is not None),
    ]


def _right_or_ambiguous(case: Scored) -> bool:
    return right(case) or ambiguous_with_truth(case)


# ---------------------------------------------------------------- lines of rates


def rate_line(about: str, figure: str, cases: Sequence[Scored], hit: Predicate, target: str = "") -> Line:
    """A share of cases beside its target.

    Parameters
    ----------
    about : which cases, in words
    figure : what is counted, in words
    cases : of which
    hit : what is counted
    target : like ``>= 95 %``; nothing where the share is shown alone
    """
    rate = Rate.of(cases, hit)
    low, high = rate.interval
    return Line(
        about=about,
        figure=figure,
        value=rate.share,
        low95=low,
        high95=high,
        count=rate.count,
        target=target,
        met=_verdict(rate.share, target),
    )


def _verdict(share: float | None, target: str) -> Met:
    if share is None:
        return "no cases"
    if not target:
        return "shown"
    sign, number = target.removesuffix(" %").split(" ")
    limit = float(number) / 100.0 + (1e-12 if sign == "<=" else -1e-12)
    return "met" if (share <= limit if sign == "<=" else share >= limit) else "missed"


def _selection(cases: Sequence[Scored]) -> Iterator[Line]:
    single = [c for c in cases if c.kind == "single" and c.truth]
    several = [c for c in single if not c.one_frequency]
    seen = [c for c in several if visible(c)]
    for about, mine, targets in (
        ("visible, noise to 1 %", [c for c in seen if low_noise(c)], (">= 95 %", "<= 1 %", ">= 98 %")),
        ("visible, noise above 1 %", [c for c in seen if not low_noise(c)], ("", "", "")),
    ):
        yield rate_line(about, "right name", mine, right, targets[0])
        yield rate_line(about, "wrong name", mine, wrong_name, targets[1])
        yield rate_line(about, "truth among effects and rivals", mine, among, targets[2])
    faint = [c for c in several if 0.0025 <= c.visible_gap < 0.005]
    with_truth = "right, or ambiguous with the truth"
    yield rate_line("gap 0.25-0.5 %", with_truth, faint, _right_or_ambiguous, ">= 60 %")
    yield rate_line("gap 0.25-0.5 %", "wrong name", faint, wrong_name, "<= 3 %")
    alone = [c for c in single if c.one_frequency]
    yield rate_line("one frequency, visible", "wrong name", [c for c in alone if visible(c)], wrong_name, "<= 2 %")
    twins = [c for c in alone if visible(c) and set(c.truth) <= TWINS]
    yield rate_line(
        "one frequency, spring or mass", "ambiguous with the truth", twins, ambiguous_with_truth, ">= 100 %"
    )
    pairs = [c for c in cases if c.kind == "pair" and len(c.truth) == 2 and visible(c)]
    yield rate_line("pairs, each visible given the other", "both found", pairs, _both, ">= 85 %")


def _both(case: Scored) -> bool:
    return set(case.truth) <= set(case.effects)


def _nothing_to_name(cases: Sequence[Scored]) -> Iterator[Line]:
    nothing = [c for c in cases if not c.truth and c.kind != "outside"]
    yield rate_line("no effect", "false names", nothing, false_name, "<= 1 %")
    outside = [c for c in cases if c.kind == "outside" and visible(c)]
    yield rate_line("outside the library, visible", "a wrong single name", outside, wrong_single, "<= 3 %")
    yield rate_line("outside the library, visible", "unexplained", outside, _unexplained, ">= 92 %")
    yield rate_line("outside the library, visible", "shape among the first two", outside, shape_told, ">= 60 %")


def _unexplained(case: Scored) -> bool:
    return case.verdict == "unexplained"


# ---------------------------------------------------------------- lines of numbers


def _gap_cuts(cases: Sequence[Scored]) -> Iterator[Line]:
    named = [c for c in cases if c.truth and right(c) and visible(c)]
    cuts = [c.gap_cut for c in named if c.gap_cut is not None]
    shapes = [c.gap_cut_gains_out for c in named if c.gap_cut_gains_out is not None]
    best = [c.gap_cut_of_truth for c in named if c.gap_cut_of_truth is not None]
    for about, values, targets in (
        ("", cuts, (">= 90 %", ">= 75 %")),
        (" of the truth, gains as fitted", best, ("", "")),
        (", gains left out", shapes, ("", "")),
    ):
        yield _percentile(f"gap cut{about}, median", values, 50, targets[0])
        yield _percentile(f"gap cut{about}, tenth percentile", values, 10, targets[1])
    inside = [hit for c in cases if c.truth and visible(c) for hit in c.inside.values()]
    rate = Rate(sum(inside), len(inside))
    met: Met = "too few"
    if rate.share is not None and rate.count >= ENOUGH_PARAMETERS:
        met = "met" if 0.92 <= rate.share <= 0.98 else "missed"
    yield Line(
        about="rightly found, visible",
        figure="parameters inside their 95 % interval",
        value=rate.share,
        low95=rate.interval[0],
        high95=rate.interval[1],
        count=rate.count,
        target="92 to 98 %",
        met=met,
    )


def _percentile(figure: str, values: Sequence[float], share: float, target: str) -> Line:
    value = float(np.percentile(values, share)) if values else None
    return Line(
        about="rightly named, visible",
        figure=figure,
        value=value,
        low95=None,
        high95=None,
        count=len(values),
        target=target,
        met=_verdict(value, target),
    )


def _calibration(cases: Sequence[Scored]) -> Iterator[Line]:
    for row in calibration_rows(cases):
        far = abs(row.stated - row.hit_rate)
        full = row.cases >= FULL_BIN
        yield _bin_line(
            row, "within 5 %" if full else "", "shown" if not full else "met" if far <= CALIBRATED else "missed"
        )
    stated = sorted(c.confidence for c in cases if c.confidence is not None)
    if len(stated) >= len(FIFTHS) * FULL_FIFTH:
        limits = np.unique(np.quantile(stated, [0.0, *FIFTHS]))
        for row in calibration_rows(cases, [float(limit) for limit in limits]):
            yield _bin_line(
                row, "in its interval", "met" if row.hit_low95 <= row.stated <= row.hit_high95 else "missed"
            )
        gain = brier_gain(cases)
        yield Line(
            about="confidence",
            figure="mean square error below that of the best constant",
            value=gain,
            low95=None,
            high95=None,
            count=len(stated),
            target=">= 20 %",
            met=_verdict(gain, ">= 20 %"),
        )


def _bin_line(row: CalibrationRow, target: str, met: Met) -> Line:
    return Line(
        about=f"confidence {row.confidence_low:.3g}-{row.confidence_high:.3g}, mean {100 * row.stated:.1f} %",
        figure="hit rate",
        value=row.hit_rate,
        low95=row.hit_low95,
        high95=row.hit_high95,
        count=row.cases,
        target=target,
        met=met,
    )


def _counts(cases: Sequence[Scored]) -> Iterator[Line]:
    of: dict[str, tuple[Callable[[Scored], bool], int]] = {
        "with visible effects": (lambda c: c.kind in ("single", "pair") and visible(c), 600),
        "with nothing": (lambda c: c.kind == "none", 400),
        "with something visible outside the library": (lambda c: c.kind == "outside" and visible(c), 300),
    }
    for about, (hit, wanted) in of.items():
        count = sum(hit(case) for case in cases)
        yield Line(
            about=about,
            figure="cases",
            value=None,
            low95=None,
            high95=None,
            count=count,
            target=f">= {wanted}",
            met="met" if count >= wanted else "missed",
        )
    yield rate_line("all", "failed", cases, lambda c: c.failure is not None)
