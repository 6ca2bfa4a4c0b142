"""The page of `pzd changes`: both loops, the difference before and after naming, a bar per change, and the tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pzd.artefacts.changes import (
    Change,
    Changes,
    Course,
    CourseRow,
    Unchanged,
    growth,
    had_no_value,
    holds_what_was,
    value_at,
    values_at,
)
from pzd.diagnosis.changes.comparison import Compared, ComparedCycle
from pzd.diagnosis.changes.over import Followed
from pzd.quantities import Control
from pzd.report import tables
from pzd.report.blocks import (
    DASH,
    Block,
    Card,
    Gallery,
    Notes,
    Paragraph,
    Section,
    TextTable,
    amount,
    listed,
    number,
    percent,
    sentence,
    spelled,
)
from pzd.report.changes_text import SHARES, TOO_SMALL
from pzd.report.diagnosis_text import next_test_line
from pzd.report.drawing import BASELINE, FINAL, MEASURED, MUTED, Panel, axes, encoded, legend, styled, ticks_named
from pzd.report.page import render

_COMPARED = {
    "cycles": "Averaged cycles of the motions that were run in both states were compared.",
    "model": "No motion was run in both states: the damper of the first stands for its tests.",
    "both": "Averaged cycles were compared where a motion was run in both states, the damper of the first elsewhere.",
}
"""How the states were compared."""

SHOWN = 3
"""Motions that are drawn, those with the largest difference: a row of loops, and below each what changes in it."""
_FOOTER = "Written by pzd changes. Every number of this page stands in the JSON beside it, or in the records."
_HEADLINES = {
    "changed": "Something changed",
    "unchanged": "Nothing of the damper changed visibly",
    "ambiguous": "Something changed, and these tests leave open what",
    "unexplained": "Something changed that has no name",
}


def changes_page(found: Compared, control: Control) -> str:
    """Write the page as HTML.

    Parameters
    ----------
    found : what changed, and the compared cycles
    control : the control signal, for its unit
    """
    changes = found.changes
    most = sorted(found.cycles, key=lambda cycle: -_rms(cycle.force_after - cycle.force_before))[:SHOWN]
    shown = sorted(most, key=_by_control_and_speed)
    with styled():
        loops = tuple(encoded(_loop(cycle, control)) for cycle in shown)
        differences = tuple(encoded(_difference(cycle, control)) for cycle in shown)
        bars = tuple(encoded(panel) for panel in _bars(changes))
    table: list[Block] = [_quantities(changes, control)] if changes.changes or changes.unchanged else []
    sections = [
        Section("what", "What changed", (Paragraph(sentence(changes.reason)), *table, Gallery(bars))),
        Section("cycles", "Cycle by cycle", (*_left_out(found), Gallery(loops), Gallery(differences))),
        Section("trade", "Force at peak velocity", (_trade(found.cycles, control),)),
    ]
    if found.undetermined:
        sections.append(Section("trust", "Not to be trusted", (Notes(found.undetermined, "care"),)))
    title = f"What changed from {changes.from_} to {changes.to}"
    return render(title, _cards(changes, control), (), tuple(sections), _FOOTER)


def course_page(found: Followed, control: Control) -> str:
    """Write the page of several states as HTML: each quantity over the states, with its limits.

    Parameters
    ----------
    found : the courses
    control : the control signal, for its unit
    """
    course = found.course
    with styled():
        drawn = tuple(encoded(_course_panel(course, row, control)) for row in course.over)
    within = {True: "Yes", False: "No", None: "Not settled, or no limits are given"}[course.pass_]
    cards = (
        Card("What changed?", _HEADLINES[course.verdict], sentence(course.reason)),
        Card("Is all within the tolerance?", within, ""),
    )
    sections = [Section("over", "Over the states", (Gallery(drawn), tables.course(course, control).block()))]
    if found.undetermined:
        sections.append(Section("trust", "Not to be trusted", (Notes(found.undetermined, "care"),)))
    return render(f"From {course.from_} to {course.to}", cards, (), tuple(sections), _FOOTER)


def _course_panel(course: Course, row: CourseRow, control: Control) -> Panel:
    name = spelled(row.name) if row.name == row.parameter else f"{spelled(row.name)} {row.parameter}"
    figure, ax = axes("state", f"{name} [{row.unit}]", labels=("-000000",), slanted=course.states)
    places = np.arange(len(course.states))
    for i in range(len(row.at_voltage_V or (None,))):
        middle, low, high = (
            np.array([np.nan if (v := value_at(each, i)) is None else v for each in column])
            for column in (row.values, row.low95, row.high95)
        )
        label = amount(row.at_voltage_V[i], control.unit) if row.at_voltage_V is not None else ""
        spread = np.maximum(np.array([middle - low, high - middle]), 0.0)
        ax.errorbar(places, middle, spread, fmt="o-", markersize=4.0, capsize=2.0, label=label)
    for limit in row.limits or ():
        ax.axhline(limit, color=BASELINE, linestyle="--", linewidth=1.0)
    if row.at_voltage_V is not None:
        legend(figure)
    return Panel(figure, name, f"{name} over the states {', '.join(course.states)}, with 95 % intervals.", "")


def _cards(changes: Changes, control: Control) -> tuple[Card, ...]:
    names = listed(list(dict.fromkeys(spelled(c.name) for c in changes.changes if c.of == "damper")))
    stand = listed(list(dict.fromkeys(spelled(c.name) for c in changes.changes if c.of == "stand")))
    d = changes.difference
    size = f"{amount(d.rms_N, 'N')} r.m.s., {percent(d.share_of_peak)} of peak"
    beside = "And something that has no name" if names and changes.verdict == "unexplained" else ""
    left = f"{amount(d.left_N, 'N')} of it are left, {amount(d.noise_N, 'N')} of them noise."
    found = [
        Card(
            "What changed?",
            names or _HEADLINES[changes.verdict],
            f"{beside or _HEADLINES[changes.verdict]}." if names else _COMPARED[changes.compared],
        ),
        Card("How much?", size, left),
    ]
    if stand:
        found.append(Card("What did the stand do?", stand, "This is not the damper's."))
    if changes.rivals:
        rivals = listed([spelled(name) for name in changes.rivals], "or")
        test = changes.next_test
        tell = "" if test is None else f" {sentence(next_test_line(test, control.unit))}"
        found.append(Card("What else may it have been?", rivals, f"These tests cannot tell them apart.{tell}"))
    same = listed(list(dict.fromkeys(_quantity(u) for u in changes.unchanged)))
    if same:
        found.append(Card("What stayed as it was?", same, "A visible change of these would have shown."))
    return tuple(found)


# --- Tables


def _quantities(changes: Changes, control: Control) -> TextTable:
    header = ("quantity", control.name, "before", "after", "95 % interval", "change", "of its size", "share")
    listed_rows: list[Change | Unchanged] = [*changes.changes, *changes.unchanged]
    rows = [row for each in listed_rows for row in _rows(each, control, newly=had_no_value(each, listed_rows))]
    title = (
        "Each quantity before and after, with 95 % intervals; in % of its size; a share is that of all its values, and "
        "those without one did not change"
    )
    return TextTable(title, *_without_control_where_none(header, rows))


def _without_control_where_none(
    header: tuple[str, ...], rows: Sequence[tuple[str, ...]]
) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """Leave out the second column, the control signal, where no row has one."""
    if any(row[1] != DASH for row in rows):
        return header, tuple(rows)
    return (header[0], *header[2:]), tuple((row[0], *row[2:]) for row in rows)


def _quantity(each: Change | Unchanged) -> str:
    return spelled(each.name) if each.name == each.parameter else f"{spelled(each.name)} {each.parameter}"


def _rows(each: Change | Unchanged, control: Control, *, newly: bool) -> Iterator[tuple[str, ...]]:
    count = len(each.at_voltage_V) if each.at_voltage_V is not None else 1
    name = _quantity(each)
    for i in range(count):
        start, to, low, high = values_at(each, i)
        start = None if newly else start
        same = TOO_SMALL if holds_what_was(each, i) is False else DASH
        share = percent(each.share) if isinstance(each, Change) else same
        change = None if start is None or to is None else to - start
        at = amount(each.at_voltage_V[i], control.unit) if each.at_voltage_V is not None else DASH
        interval = DASH if low is None or high is None else f"{number(low, 4)} to {number(high, 4)}"
        yield (
            name, at, amount(start, each.unit, 4), amount(to, each.unit, 4), interval, amount(change, each.unit),
            _growth_between(start, to, low, high), share,
        )  # fmt: skip


def _growth_between(start: float | None, to: float | None, low: float | None, high: float | None) -> str:
    """Return by how many % the size of a quantity grew, with the interval; a dash where it was 0 or its sign turned."""
    grown = None if start is None or to is None else growth(start, to)
    ends = [None if start is None or end is None else growth(start, end) for end in (low, high)]
    if grown is None or None in ends:
        return percent(grown)
    least, most = sorted(end for end in ends if end is not None)
    return f"{percent(grown)} ({percent(least)} to {percent(most)})"


def _left_out(found: Compared) -> Iterator[Block]:
    """Say how many of the compared tests are drawn, where not all are."""
    if len(found.cycles) > SHOWN:
        yield Paragraph(f"Drawn are the {SHOWN} of {len(found.cycles)} compared tests that differ most.")


def _trade(cycles: Sequence[ComparedCycle], control: Control) -> TextTable:
    """Return force at peak velocity, as the trade reads it: in rebound and compression, and by how many % it grew."""
    sides = ("after", "grew by", "%")
    header = ("test", control.name, "velocity", "rebound before", *sides, "compression before", *sides)
    rows = []
    for cycle in sorted(cycles, key=_by_control_and_speed):
        cells = []
        for at, way in ((int(np.argmax(cycle.velocity)), 1.0), (int(np.argmin(cycle.velocity)), -1.0)):
            before, after = float(cycle.force_before[at]), float(cycle.force_after[at])
            grown = amount(way * (after - before), "N")
            cells += [amount(before, "N"), amount(after, "N"), grown, percent(growth(before, after))]
        at_control = DASH if cycle.voltage is None else amount(cycle.voltage, control.unit)
        test = cycle.after if cycle.before is not None else f"{cycle.after} (before: the model)"
        rows.append((test, at_control, amount(float(np.max(cycle.velocity)), "m/s"), *cells))
    title = (
        "Force at the peak velocity of each test, with the gas, and by how much it grew; a dash where the sign turned"
    )
    return TextTable(title, *_without_control_where_none(header, rows))


# --- Pictures


def _loop(cycle: ComparedCycle, control: Control) -> Panel:
    figure, ax = axes("displacement [mm]", "force [kN]")
    x = 1000.0 * cycle.displacement
    ax.plot(x, cycle.force_before / 1000.0, color=MEASURED, label="before")
    ax.plot(x, cycle.force_after / 1000.0, color=BASELINE, linestyle="--", label="after")
    legend(figure)
    name = _name(cycle, control)
    alt = f"Force over displacement of {name}, before and after."
    return Panel(figure, f"Both states, {name}", alt, f"{cycle.before or 'The model'} beside {cycle.after}.")


def _difference(cycle: ComparedCycle, control: Control) -> Panel:
    figure, ax = axes("phase of the cycle", "difference [N]")
    phase = np.arange(cycle.displacement.size) / cycle.displacement.size
    whole = cycle.force_after - cycle.force_before
    ax.plot(phase, whole - cycle.explained, color=MUTED, linewidth=2.5, label="left")  # below: it may be all of it
    ax.plot(phase, whole, color=BASELINE, label="difference")
    ax.plot(phase, cycle.explained, color=FINAL, linestyle="--", label="what the changes make")
    legend(figure)
    name = _name(cycle, control)
    alt = f"Difference of the forces of {name} over the cycle, what the changes make of it, and what is left."
    return Panel(figure, f"Difference, {name}", alt, f"R.m.s. {amount(_rms(whole), 'N')} before naming.")


def _bars(changes: Changes) -> Iterator[Panel]:
    shares = {f"{spelled(c.name)} ({c.of})": c.share for c in reversed(changes.changes)}
    if not shares:
        return
    figure, ax = axes("share of the difference [%]", height=0.9 + 0.3 * len(shares), labels=tuple(shares), key=0)
    ax.barh(np.arange(len(shares)), [100.0 * share for share in shares.values()], color=FINAL)
    ticks_named(ax, tuple(shares))
    yield Panel(
        figure,
        "Share of each change",
        "Share of the mean square of the difference that is left without each change.",
        sentence(SHARES),
    )


def _by_control_and_speed(cycle: ComparedCycle) -> tuple[float, float]:
    return cycle.voltage or 0.0, float(np.max(cycle.velocity))


def _name(cycle: ComparedCycle, control: Control) -> str:
    speed = amount(float(np.max(cycle.velocity)), "m/s")
    return speed if cycle.voltage is None else f"{speed}, {amount(cycle.voltage, control.unit)}"


def _rms(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(values**2)))
