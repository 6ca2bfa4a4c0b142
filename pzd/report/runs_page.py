"""The page of `pzd compare`: the curves of several runs over one another, and what differs beyond the intervals."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pzd.artefacts import ComfortRow, Diagnosis, ForceRow, ParameterRow
from pzd.artefacts.csv_rows import Estimate
from pzd.artefacts.identified import PeakVelocityRow
from pzd.damper.compose import static_force
from pzd.damper.model import BaseRow, Damper
from pzd.quantities import BINGHAM, Control
from pzd.record import CONSTANT_SHARE, SAME_TEMPERATURE, Array
from pzd.report.blocks import (
    Card,
    Gallery,
    Notes,
    Paragraph,
    Section,
    amount,
    listed,
    number,
    percent,
    shortened,
    spelled,
)
from pzd.report.columns import Cell, Column, Table
from pzd.report.drawing import AXIS, Panel, axes, axes_with_difference, encoded, legend, styled
from pzd.report.page import render
from pzd.simulate.study.plan import PLAIN_SUFFIX

_FOOTER = "Written by pzd compare. Every number of this page stands in the files of the runs, or follows from them."
_COLOURS = ("#4d4d4d", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Of Okabe and Ito (2008), in the order of the runs."""
_MOST_CURVES = 8
"""Control values that are drawn: those that most runs share."""
_MOST_RIDES = 20
"""Rides beyond which their table is folded."""


@dataclass(frozen=True, eq=False)
class ComparedRun:
    """One run as the page shows it, in the setting in use; empty or None where a stage has not run."""

    name: str
    control: Control
    parameters: tuple[ParameterRow | BaseRow, ...]
    """T0, C and k of the adopted damper, or as identify found them."""
    diagnosis: Diagnosis | None
    damper: Damper | None
    """The adopted one."""
    force: tuple[ForceRow, ...]
    """Of the table."""
    peak_velocity: tuple[PeakVelocityRow, ...]
    comfort: tuple[ComfortRow, ...]
    identified: tuple[ParameterRow, ...] = ()
    """As identify found them, for how far the simple model is off."""


def beyond(one: Estimate, other: Estimate) -> bool | None:
    """Tell whether two values differ by more than their 95 % intervals allow; None where one has no interval.

    The interval of a difference of two independent values is the root of the sum of squares of theirs, each taken
    towards the other value. Intervals that just touch, as is often looked at, would be those of 99.4 %.

    Examples
    --------
    >>> beyond(Estimate(100.0, 95.0, 105.0), Estimate(108.0, 103.0, 113.0))
    True
    >>> beyond(Estimate(100.0, 95.0, 105.0), Estimate(107.0, 102.0, 112.0))
    False
    """
    low, high = sorted((one, other), key=lambda each: each.value or 0.0)
    if low.value is None or high.value is None or low.high95 is None or high.low95 is None:
        return None
    return bool(high.value - low.value > np.hypot(low.high95 - low.value, high.value - high.low95))


def runs_page(runs: Sequence[ComparedRun], warnings: Sequence[str] = ()) -> str:
    """Write the page as HTML.

    Parameters
    ----------
    runs : two or more; the others are compared with the first
    warnings : why numbers of a run are not those of its config as it is today, or not to be trusted
    """
    tables = (*_parameter_tables(runs), *_effect_tables(runs))
    with styled():
        curves = tuple(encoded(_curves(runs, at)) for at in _levels(runs)[:_MOST_CURVES])
    sections = [
        Section("curves", "Force over velocity", (Paragraph(_CURVES), Gallery(curves)))
        if curves
        else Section("curves", "Force over velocity", (Paragraph("No run has a table of force."),)),
        Section("parameters", "Parameters", (Paragraph(_INTERVALS), *(table.block() for table in tables))),
    ]
    rides = _ride_table(runs)
    if rides.rows:
        sections.append(Section("rides", "Comfort of the rides", (Paragraph(_RIDES), rides.block())))
    if warnings:
        sections.append(Section("trust", "How far to trust it", (Notes(tuple(warnings), "care"),)))
    title = f"{listed([run.name for run in runs])} compared"
    return render(title, tuple(_cards(runs, tables)), (), tuple(sections), _FOOTER)


_CURVES = (
    "Steady force of the adopted dampers, a rebound positive, with the force at rest. Dots are the forces at the peak "
    "velocity of each test. Below: what a run differs by from the first."
)
_INTERVALS = (
    "T0, C and k are those of the adopted dampers, each with its 95 % interval. A difference is beyond the intervals "
    "where it is larger than the root of the sum of their squares: two measurements of one damper come to that once in "
    "twenty."
)
_RIDES = "A ride has no interval: it follows from its damper, so that a difference is as certain as the damper is."


# --- What is compared with what


@dataclass(frozen=True)
class Matched:
    """One condition of several runs."""

    setting: str | None
    """None where no run has several."""
    voltage: float | None
    temperature: float | None
    unit: str
    rows: dict[str, Any]
    """What each run has there, by its name."""

    @property
    def words(self) -> str:
        """The condition as the page names it."""
        parts = [self.setting] if self.setting is not None else []
        parts += [amount(self.voltage, self.unit)] if self.voltage is not None else []
        parts += [amount(self.temperature, "degC")] if self.temperature is not None else []
        return ", ".join(parts) or "one condition"


def matched(runs: Sequence[ComparedRun], rows_of: Callable[[ComparedRun], Sequence[Any]]) -> list[Matched]:
    """Match the conditions of runs, as `identify.group` matches records by default; sorted by the control signal.

    What a run calls its setting says nothing of another run, and counts only where one has several.
    """
    every = [row.voltage_V for run in runs for row in rows_of(run) if row.voltage_V is not None]
    within = CONSTANT_SHARE * max(max(every) - min(every), *map(abs, every)) if every else 0.0
    several = any(len({_setting(row) for row in rows_of(run)}) > 1 for run in runs)
    found: list[Matched] = []
    for run in runs:
        unit = run.control.unit
        for row in rows_of(run):
            setting = _setting(row) if several else None
            for place in found:
                same = (unit, setting) == (place.unit, place.setting) and _near(row.voltage_V, place.voltage, within)
                if same and _near(row.temperature_degC, place.temperature, SAME_TEMPERATURE):
                    place.rows.setdefault(run.name, row)
                    break
            else:
                found.append(Matched(setting, row.voltage_V, row.temperature_degC, unit, {run.name: row}))
    return sorted(
        found,
        key=lambda place: (place.unit, place.setting or "", place.voltage or 0.0, place.temperature or 0.0),
    )


def _setting(row: Any) -> str | None:
    return getattr(row, "setting", None)


def _near(one: float | None, other: float | None, within: float) -> bool:
    return one == other if one is None or other is None else abs(one - other) <= within


# --- Tables


@dataclass(frozen=True)
class _Row:
    """One quantity of all runs."""

    name: str
    values: dict[str, Estimate]

    def value(self, run: str) -> Estimate:
        return self.values.get(run, Estimate(None))

    def share(self, run: str, first: str) -> float | None:
        """Return by what share of the first run's value another differs."""
        start, end = self.value(first).value, self.value(run).value
        return None if start is None or end is None or start == 0.0 else (end - start) / abs(start)


def _table(title: str, head: str, unit: str, rows: list[_Row], runs: Sequence[ComparedRun]) -> Table:
    """Return the values of all runs, and of each but the first its difference, with a word on the intervals."""
    first, *others = (run.name for run in runs)
    columns = [Column("name", head), *(_value_column(run.name, unit) for run in runs)]
    return Table(title, (*columns, *(_difference_column(name, first) for name in others)), rows)


def _value_column(run: str, unit: str) -> Column:
    def value(row: _Row) -> Cell:
        found = row.value(run)
        return found if found.interval else found.value

    return Column(run, run, unit, value)


def _difference_column(run: str, first: str) -> Column:
    """Return the column of a run's differences in %, and whether each is beyond the intervals, where there are any."""

    def told(row: _Row) -> Cell:
        share, found = row.share(run, first), beyond(row.value(first), row.value(run))
        text = "" if share is None else number(100.0 * share, 2)
        return ", ".join(filter(None, (text, {True: "beyond", False: "within", None: ""}[found]))) or None

    return Column(f"{run} difference", f"{run}: difference", "%", told)


def _parameter_tables(runs: Sequence[ComparedRun]) -> Iterator[Table]:
    """Yield T0, C and k by condition."""
    places = matched(runs, lambda run: run.parameters)
    for parameter in BINGHAM:
        rows = [
            _Row(place.words, {run: Estimate.of(row, parameter.column) for run, row in place.rows.items()})
            for place in places
        ]
        if any(value.value is not None for row in rows for value in row.values.values()):
            yield _table(parameter.symbol, "condition", parameter.unit, rows, runs)


def _effect_tables(runs: Sequence[ComparedRun]) -> Iterator[Table]:
    """Yield the parameters of every effect that a run adopted."""
    found: dict[tuple[str, str, str], dict[str, dict[str, Estimate]]] = {}
    for run in runs:
        for effect, parameters in (run.diagnosis.parameters if run.diagnosis else {}).items():
            for name, value in parameters.items():
                levels = [amount(level, run.control.unit) for level in value.at_voltage_V or ()] or ["everywhere"]
                for level, estimate in zip(levels, value.estimates, strict=True):
                    found.setdefault((effect, name, value.unit), {}).setdefault(level, {})[run.name] = estimate
    for (effect, name, unit), by_level in found.items():
        rows = [_Row(level, values) for level, values in by_level.items()]
        yield _table(f"{spelled(effect)}: {name}", "condition", unit, rows, runs)


def _ride_table(runs: Sequence[ComparedRun]) -> Table:
    """Return a_w of every ride on the adopted damper that two runs or more have."""
    found: dict[str, dict[str, Estimate]] = {}
    for run in runs:
        for row in run.comfort:
            if row.measure == "a_w" and not row.case.endswith(PLAIN_SUFFIX):
                found.setdefault(row.case, {})[run.name] = Estimate(row.value)
    rows = [_Row(case, values) for case, values in found.items() if len(values) > 1]
    return replace(_table("a_w of each ride", "ride", "m/s2", rows, runs), fold=_MOST_RIDES)


# --- Headline


def _cards(runs: Sequence[ComparedRun], tables: Sequence[Table]) -> Iterator[Card]:
    first = runs[0].name
    for run in runs[1:]:
        differing: list[str] = []
        for table in tables:
            shares = [row.share(run.name, first) for row in table.rows if beyond(row.value(first), row.value(run.name))]
            known = [share for share in shares if share is not None]
            if shares:
                largest = max(known, key=abs, default=None)
                by = "" if largest is None else f" (up to {'+' * (largest > 0.0)}{percent(largest)})"
                differing.append(f"{table.title}{by}")
        known_in_both = any(beyond(row.value(first), row.value(run.name)) is not None for t in tables for row in t.rows)
        nothing = "Nothing beyond the intervals" if known_in_both else "No parameter is known of both"
        answer = listed(differing) if differing else nothing
        yield Card(f"Where does {run.name} differ from {first}?", answer, _largest(runs[0], run))
    for run in runs:
        if run.diagnosis is not None:
            effects = listed([spelled(effect) for effect in run.diagnosis.effects]) or "nothing was added"
            yield Card(f"What was found in {run.name}?", run.diagnosis.verdict.capitalize(), f"{effects}.")


def _largest(first: ComparedRun, other: ComparedRun) -> str:
    """Return where the curves of two runs are farthest apart."""
    best: tuple[float, str] | None = None
    for place in _levels((first, other)):
        if len(place.rows) > 1:
            velocity, force = place.rows[first.name].curve
            apart = _difference(place, first.name, other.name)
            at = int(np.nanargmax(np.abs(apart)))
            share = float(abs(apart[at]) / np.nanmax(np.abs(force)))
            where = f"at {amount(float(velocity[at]), 'm/s')}, {place.words}"
            text = (
                f"The curves differ by up to {amount(float(abs(apart[at])), 'N')}, {percent(share)} of peak, {where}."
            )
            best = max(best, (share, text)) if best else (share, text)
    return best[1] if best else ""


# --- Curves


@dataclass(frozen=True, eq=False)
class _Curve:
    """Force over velocity of one run at one control value, with the points at the peak velocity of its tests."""

    voltage_V: float | None
    temperature_degC: float | None
    curve: tuple[Array, Array]
    """(n,) velocity [m/s] and (n,) force [N], within what the rig reached."""
    points: tuple[Array, Array]
    """(m,) velocity [m/s] and (m,) force [N]."""


def _levels(runs: Sequence[ComparedRun]) -> list[Matched]:
    """Return the curves of the runs by control value: those that most runs share first, then by control value."""
    curves = {run.name: tuple(_curves_of(run)) for run in runs}
    return sorted(matched(runs, lambda run: curves[run.name]), key=lambda place: -len(place.rows))


def _curves_of(run: ComparedRun) -> Iterator[_Curve]:
    """Yield a curve for each control value, at the lowest temperature of the table."""
    rows = [row for row in run.force if row.force_N is not None and row.inside]
    first = min((row.temperature_degC for row in rows), key=lambda t: -np.inf if t is None else t, default=None)
    here = [row for row in rows if row.temperature_degC == first]
    tests = [(row.voltage_V, velocity, force) for row in run.peak_velocity for velocity, force in _peaks(row)]
    levels = sorted({row.voltage_V for row in here}, key=lambda level: level or 0.0)
    for level in levels:
        nearest = [(v, f) for u, v, f in tests if _nearest(levels, u) == level]
        pairs = [(row.velocity_m_per_s, row.force_N or 0.0) for row in here if row.voltage_V == level]
        velocity, force = np.array(pairs).T
        rest = float(static_force(run.damper, level)) if run.damper else 0.0
        points = np.array(nearest).reshape(-1, 2).T
        yield _Curve(level, first, (velocity, force + rest), (points[0], points[1]))


def _peaks(row: PeakVelocityRow) -> Iterator[tuple[float, float]]:
    for velocity, force in (
        (row.rebound_velocity_m_per_s, row.rebound_force_N),
        (row.compression_velocity_m_per_s, row.compression_force_N),
    ):
        if velocity is not None and force is not None:
            yield velocity, force


def _nearest(levels: Sequence[float | None], voltage: float | None) -> float | None:
    known = [level for level in levels if level is not None]
    return min(known, key=lambda level: abs(level - voltage)) if known and voltage is not None else None


def _difference(place: Matched, first: str, other: str) -> Array:
    """Return the force of another run less that of the first, at the velocities of the first [N]; NaN beyond.

    Force jumps at v = 0, where both one-sided rows stand, so that each side is interpolated by itself.
    """
    (velocity, force), (others, forces) = place.rows[first].curve, place.rows[other].curve
    apart = np.full(velocity.size, np.nan)
    for side in (False, True):
        mine, theirs = np.signbit(velocity) == side, np.signbit(others) == side
        if theirs.any():
            at = np.interp(velocity[mine], others[theirs], forces[theirs], left=np.nan, right=np.nan)
            apart[mine] = at - force[mine]
    return apart


def _curves(runs: Sequence[ComparedRun], place: Matched) -> Panel:
    present = [(run, colour) for run, colour in zip(runs, _colours(len(runs)), strict=True) if run.name in place.rows]
    if len(present) == 1:
        figure, upper = axes("velocity [m/s]", "force [kN]", height=3.9)
        lower = upper
    else:
        figure, upper, lower = axes_with_difference("velocity [m/s]", "force [kN]", "difference [N]", key=len(present))
        lower.axhline(0.0, color=AXIS, linewidth=0.8)
    first = present[0][0].name
    told = []
    for number_, (run, colour) in enumerate(present):
        found = place.rows[run.name]
        velocity, force = found.curve
        style = "-" if number_ == 0 else ("--", "-.", ":")[(number_ - 1) % 3]
        upper.plot(velocity, force / 1000.0, style, color=colour, linewidth=1.3, label=shortened(run.name))
        upper.plot(found.points[0], found.points[1] / 1000.0, "o", color=colour, markersize=3.0, alpha=0.6)
        if run.name != first:
            apart = _difference(place, first, run.name)
            lower.plot(place.rows[first].curve[0], apart, style, color=colour, linewidth=1.2)
            if np.isfinite(apart).any():
                told.append(f"{run.name} by up to {amount(float(np.nanmax(np.abs(apart))), 'N')}")
    legend(figure, 1)
    differs = f"; {listed(told)} from {first}" if told else ""
    some = "No other run has it." if len(present) == 1 else f"{len(present)} of {len(runs)} runs have it."
    caption = some if len(present) < len(runs) else ""
    return Panel(figure, place.words, f"Force over velocity at {place.words}{differs}.", caption)


def _colours(count: int) -> list[str]:
    return [_COLOURS[place % len(_COLOURS)] for place in range(count)]
