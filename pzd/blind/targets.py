"""Targets of the diagnosis, each with the figure that was reached: pure functions of the scored cases."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Literal

import numpy as np

from pzd.blind import rates
from pzd.blind.case import Scored
from pzd.blind.rates import CalibrationRow, Predicate, Rate
from pzd.schema.model import Frozen

FULL_BIN = 50
"""A bin of the calibration is held to its target from so many cases on: its 95 % interval is then about 8 % wide."""
ENOUGH_PARAMETERS = 400
"""Intervals are held to their target from so many parameters on: the rate is then known to some 2 %."""
FIFTHS = (0.2, 0.4, 0.6, 0.8, 1.0)
"""Bins of as many cases, where there are `FULL_FIFTH` to each."""
FULL_FIFTH = 200
LARGEST_LOSS = 0.05
"""Share of the plain damper's gap by which one with effects may at most be farther from the noise-free force."""
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


# --- The pages ---


def lines(cases: Sequence[Scored]) -> list[Line]:
    """Return every target of cases of the virtual rig, in the order of the printed page."""
    return [
        *_asked(cases),
        *_selection(cases),
        *_nothing_to_name(cases),
        *_gap_cuts(cases),
        *_calibration(cases),
        *_counts(cases),
    ]


def campaign_lines(cases: Sequence[Scored]) -> list[Line]:
    """Return how far the verdicts hold on each campaign alone, the campaigns in the order of their first case."""
    found = []
    for name in dict.fromkeys(case.campaign for case in cases):
        seen, nothing, outside = _by_truth([c for c in cases if c.campaign == name])
        found += [
            rate_line(f"{name}, visible", "right, or ambiguous with the truth", seen, _right_or_ambiguous, ">= 95 %"),
            rate_line(f"{name}, visible", "wrong name", seen, rates.wrong_name, "<= 0.5 %"),
            rate_line(f"{name}, no effect", "false names", nothing, rates.false_name, "<= 1 %"),
            rate_line(f"{name}, outside the library, visible", "unexplained", outside, rates.unexplained, ">= 95 %"),
        ]
    return found


def independent_lines(cases: Sequence[Scored]) -> list[Line]:
    """Return the targets of cases of the second generator, whose forms outside say what describes them rightly."""
    _, _, outside = _by_truth(cases)
    strict = [c for c in outside if not c.described_by]
    return [
        *_asked(cases),
        rate_line(
            "outside the library, visible", "flagged, or rightly described", outside, rates.rightly_outside, ">= 95 %"
        ),
        rate_line("outside, described by nothing", "a wrong single name", strict, rates.wrong_single),
        *_gap_cuts(cases),
        *_calibration(cases),
        rate_line("all", "failed", cases, rates.failed),
    ]


def _by_truth(cases: Sequence[Scored]) -> tuple[list[Scored], list[Scored], list[Scored]]:
    """Return the cases with visible effects, those without an effect, and those with a visible form outside."""
    return (
        [c for c in cases if c.truth and rates.visible(c)],
        [c for c in cases if not c.truth and c.kind != "outside"],
        [c for c in cases if c.kind == "outside" and rates.visible(c)],
    )


def _right_or_ambiguous(case: Scored) -> bool:
    return rates.right(case) or rates.ambiguous_with_truth(case)


def _asked(cases: Sequence[Scored]) -> Iterator[Line]:
    """Yield what is asked of the verdicts on either generator: the head of both pages."""
    seen, nothing, outside = _by_truth(cases)
    low = [c for c in seen if rates.low_noise(c)]
    yield rate_line("something of the library hidden", "visible", [c for c in cases if c.truth], rates.visible)
    yield rate_line("visible", "right, or ambiguous with the truth", seen, _right_or_ambiguous, ">= 95 %")
    yield rate_line("visible", "right name", seen, rates.right)
    yield rate_line("visible, noise to 1 %, all", "right name", low, rates.right, ">= 98 %")
    yield rate_line("visible", "wrong name", seen, rates.wrong_name, "<= 0.5 %")
    yield rate_line("no effect", "false names", nothing, rates.false_name, "<= 1 %")
    yield rate_line("no effect", "left open, nothing adopted", nothing, rates.left_open)
    strict = [c for c in outside if not c.described_by]
    yield rate_line("outside, described by nothing, visible", "unexplained", strict, rates.unexplained, ">= 95 %")


# --- Lines of rates ---


def rate_line(about: str, figure: str, cases: Sequence[Scored], hit: Predicate, target: str = "") -> Line:
    """Return a share of cases beside its target.

    Parameters
    ----------
    about : which cases, in words
    figure : what is counted, in words
    cases : of which
    hit : what is counted
    target : like ``>= 95 %``; nothing where the share is shown alone
    """
    rate = Rate.of(cases, hit)
    return _line(about, figure, rate.share, rate.count, target, _verdict(rate.share, target), rate.interval)


def _line(
    about: str,
    figure: str,
    value: float | None,
    count: int,
    target: str,
    met: Met,
    interval: tuple[float, float] | tuple[None, None] = (None, None),
) -> Line:
    low, high = interval
    return Line(about=about, figure=figure, value=value, low95=low, high95=high, count=count, target=target, met=met)


def _verdict(share: float | None, target: str) -> Met:
    if share is None:
        return "no cases"
    if not target:
        return "shown"
    sign, number = target.removesuffix(" %").split(" ")
    limit = float(number) / 100.0 + (1e-12 if sign == "<=" else -1e-12)  # a share at its limit meets it
    return "met" if (share <= limit if sign == "<=" else share >= limit) else "missed"


def _selection(cases: Sequence[Scored]) -> Iterator[Line]:
    single = [c for c in cases if c.kind == "single" and c.truth]
    several = [c for c in single if not c.one_frequency]
    seen = [c for c in several if rates.visible(c)]
    for about, mine, targets in (
        ("visible, noise to 1 %", [c for c in seen if rates.low_noise(c)], ("", "", ">= 98 %")),
        ("visible, noise above 1 %", [c for c in seen if not rates.low_noise(c)], ("", "", "")),
    ):
        yield rate_line(about, "right name", mine, rates.right, targets[0])
        yield rate_line(about, "wrong name", mine, rates.wrong_name, targets[1])
        yield rate_line(about, "truth among effects and rivals", mine, rates.truth_among, targets[2])
    faint = [c for c in several if rates.NEGLIGIBLE_GAP <= c.visible_gap < rates.VISIBLE_TRUTH_GAP]
    between = f"gap {100.0 * rates.NEGLIGIBLE_GAP:g}-{100.0 * rates.VISIBLE_TRUTH_GAP:g} %"
    with_truth = "right, or ambiguous with the truth"
    yield rate_line(between, with_truth, faint, _right_or_ambiguous, ">= 60 %")
    yield rate_line(between, "wrong name", faint, rates.wrong_name, "<= 3 %")
    alone = [c for c in single if c.one_frequency and rates.visible(c)]
    yield rate_line("one frequency, visible", "wrong name", alone, rates.wrong_name, "<= 2 %")
    twins = [c for c in alone if set(c.truth) <= TWINS]
    yield rate_line(
        "one frequency, spring or mass", "ambiguous with the truth", twins, rates.ambiguous_with_truth, ">= 100 %"
    )
    pairs = [c for c in cases if c.kind == "pair" and len(c.truth) == 2 and rates.visible(c)]
    yield rate_line("pairs, each visible given the other", "both found", pairs, _both_found, ">= 85 %")


def _both_found(case: Scored) -> bool:
    return set(case.truth) <= set(case.effects)


def _nothing_to_name(cases: Sequence[Scored]) -> Iterator[Line]:
    _, _, outside = _by_truth(cases)
    yield rate_line("outside the library, visible", "a wrong single name", outside, rates.wrong_single, "<= 3 %")
    yield rate_line("outside the library, visible", "shape among the first two", outside, rates.shape_found, ">= 60 %")


def _counts(cases: Sequence[Scored]) -> Iterator[Line]:
    wanted: dict[str, tuple[Callable[[Scored], bool], int]] = {
        "with visible effects": (lambda c: c.kind in ("single", "pair") and rates.visible(c), 600),
        "with nothing": (lambda c: c.kind == "none", 400),
        "with something visible outside the library": (lambda c: c.kind == "outside" and rates.visible(c), 300),
    }
    for about, (hit, least) in wanted.items():
        count = sum(hit(case) for case in cases)
        yield _line(about, "cases", None, count, f">= {least}", "met" if count >= least else "missed")
    yield rate_line("all", "failed", cases, rates.failed)


# --- Lines of numbers ---


def _gap_cuts(cases: Sequence[Scored]) -> Iterator[Line]:
    named = [c for c in cases if c.truth and rates.right(c) and rates.visible(c)]
    for suffix, cuts, targets in (
        ("", [c.gap_cut for c in named], (">= 90 %", ">= 75 %")),
        (" of the truth, gains as fitted", [c.gap_cut_of_truth for c in named], ("", "")),
        (", gains left out", [c.gap_cut_gains_out for c in named], ("", "")),
    ):
        values = [cut for cut in cuts if cut is not None]
        for percentile, words, target in ((50, "median", targets[0]), (10, "tenth percentile", targets[1])):
            value = float(np.percentile(values, percentile)) if values else None
            figure = f"gap cut{suffix}, {words}"
            yield _line("rightly named, visible", figure, value, len(values), target, _verdict(value, target))
    # The gain of a test that no fit has seen is nobody's to know: shapes are compared.
    handed_on = [c for c in cases if c.gap_cut_gains_out is not None]
    about, farther = "effects handed on, gains left out", "farther from the truth than plain"
    much = f"so by more than {100.0 * LARGEST_LOSS:g} % of its gap"
    yield rate_line(about, farther, handed_on, partial(_is_farther, by=0.0), "<= 0.5 %")
    yield rate_line(about, much, handed_on, partial(_is_farther, by=LARGEST_LOSS), "<= 0 %")
    inside = [hit for c in cases if c.truth and rates.visible(c) for hit in c.inside.values()]
    rate = Rate(sum(inside), len(inside))
    met: Met = "too few"
    if rate.share is not None and rate.count >= ENOUGH_PARAMETERS:
        met = "met" if 0.92 <= rate.share <= 0.98 else "missed"
    figure = "parameters inside their 95 % interval"
    yield _line("rightly found, visible", figure, rate.share, rate.count, "92 to 98 %", met, rate.interval)


def _is_farther(case: Scored, by: float) -> bool:
    """Whether what is handed on is farther from the noise-free force than plain, by more than a share of its gap."""
    return case.gap_cut_gains_out is not None and case.gap_cut_gains_out < -by


def _calibration(cases: Sequence[Scored]) -> Iterator[Line]:
    for row in rates.calibration_rows(cases):
        if row.cases < FULL_BIN:
            yield _bin_line(row, "", "shown")
        else:
            far = abs(row.stated - row.hit_rate)
            yield _bin_line(row, "within 5 %", "met" if far <= CALIBRATED else "missed")
    stated = sorted(c.confidence for c in cases if c.confidence is not None)
    if len(stated) >= len(FIFTHS) * FULL_FIFTH:
        limits = np.unique(np.quantile(stated, [0.0, *FIFTHS]))
        for row in rates.calibration_rows(cases, [float(limit) for limit in limits]):
            inside = row.hit_low95 <= row.stated <= row.hit_high95
            yield _bin_line(row, "in its interval", "met" if inside else "missed")
        gain, target = rates.brier_gain(cases), ">= 20 %"
        figure = "mean square error below that of the best constant"
        yield _line("confidence", figure, gain, len(stated), target, _verdict(gain, target))


def _bin_line(row: CalibrationRow, target: str, met: Met) -> Line:
    about = f"confidence {row.confidence_low:.3g}-{row.confidence_high:.3g}, mean {100 * row.stated:.1f} %"
    return _line(about, "hit rate", row.hit_rate, row.cases, target, met, (row.hit_low95, row.hit_high95))
