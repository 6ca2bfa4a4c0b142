"""Channels of several clocks brought to one: recorders sample each channel at its own rate, and begin it late.

What moves (displacement, velocity, acceleration, force) is interpolated at the instants of one clock by a spline of
degree five, which up to some 0.7 of the band of its samples is the band-limited interpolation. What labels a test
(control signal, temperature, pressure) is held from sample to sample: a command in steps has no value between two of
them. Nothing is left where a channel has not begun, has ended, or was paused.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pzd.record import Array, Mask, clock_fault
from pzd.rig.files.sheet import FileTable, ReadingStep, Wanted, table_place
from pzd.rig.preflight.clock import GAP
from pzd.schema.errors import DataError, counted

DEGREE = 5
"""Of the spline: its frequency response is within 3 % of 1 up to 0.7 of the Nyquist frequency (Unser 1999, IEEE
Signal Processing Magazine 16), that of a straight line falls by 3 % at 0.2."""
TOP = 0.75
"""Share of the band of a channel's samples above which lies what an interpolation cannot restore;"""
FOLLOWS = 5e-5
"""the share of its variance there up to which it follows a quicker clock: what noise of 1 % of the amplitude has.

A force with dry friction has more, up to 1/n at n samples a cycle where that is all: its flanks would be guessed, and
smeared over two samples they pass for a soft oil spring. So a quick displacement is read at the instants of the force.
"""
SAME = 1e-9
"""Instants that differ by less [s] are one: recorders count in steps of 1e-7 s and more."""


@dataclass(frozen=True, eq=False)
class _Channel:
    """One wanted column, on the clock that its file shares."""

    head: str
    table: FileTable
    time: Array
    """(n,) on the shared clock [s]"""
    values: Array
    """(n,)"""
    unit: str
    held: bool
    """Whether it is held from sample to sample."""

    @property
    def step(self) -> float:
        """Median step of its clock [s]."""
        return float(np.median(np.diff(self.time))) if self.time.size > 1 else 0.0

    @property
    def end(self) -> float:
        """Instant up to which its value is known [s]; of one sample, for ever."""
        if not self.held:
            return float(self.time[-1])
        return float(self.time[-1]) + self.step if self.time.size > 1 else np.inf

    def same_clock(self, time: Array) -> bool:
        """Whether it was sampled at these instants."""
        return self.time.size == time.size and bool(np.all(np.abs(self.time - time) <= SAME))


# --- Which tables belong together ---


def on_one_clock(path: Path, tables: Sequence[FileTable], wanted: Wanted) -> list[FileTable]:
    """Join the tables of one recording whose channels were sampled by clocks of their own.

    Tables of one group belong together; then tables of several groups, as far as each wanted channel stands in one of
    them alone. A table that holds a recording by itself is completed by what stands once elsewhere.

    Parameters
    ----------
    path : the file, for its refusals
    tables : of the file
    wanted : the columns to read

    Returns
    -------
    tables, those that were joined as one in the place of the first

    Raises
    ------
    DataError : when a clock does not run forwards, a cell is empty, or channels have no time in common
    """
    groups: dict[str, list[FileTable]] = {}
    for number, table in enumerate(tables):
        shared = table.begins is not None
        groups.setdefault(f"{table.group if shared else ''}\n{'' if shared and table.group else number}", []).append(
            table
        )
    parts = [_joined(path, members, wanted) if _several(members, wanted) else members[0] for members in groups.values()]
    parts += [table for members in groups.values() if not _several(members, wanted) for table in members[1:]]
    shared_parts = [part for part in parts if part.begins is not None]
    whole = [part for part in shared_parts if _complete([part], wanted)]
    if not whole:
        once = [part for part in shared_parts if _heads(part, wanted) and _stands_alone(part, shared_parts, wanted)]
        if len(once) < 2 or not _complete(once, wanted):
            return parts
        return [_joined(path, once, wanted), *(part for part in parts if part not in once)]
    found = []
    for part in parts:
        more = [
            other
            for other in shared_parts
            if other not in whole
            and _heads(other, wanted) - _heads(part, wanted)
            and _stands_alone(other, shared_parts, wanted)
        ]
        found.append(_joined(path, [part, *more], wanted) if part in whole and more else part)
    return found


def headers_together(tables: Sequence[FileTable]) -> FileTable | None:
    """Return the first row of all tables that share a clock, as if they were one; None where there are not two."""
    shared = [table for table in tables if table.begins is not None and table.rows]
    if len(shared) < 2:
        return None
    first: dict[str, tuple[Array | list[str], str]] = {}
    for table in shared:
        for index, head in enumerate(table.header):
            if head != table.clock or not first:
                first.setdefault(head, (table.cells[index][:1], table.units[index] if table.units else ""))
    cells, units = zip(*first.values(), strict=True)
    return FileTable("", tuple(first), tuple(cells), tuple(units))


def _several(tables: Sequence[FileTable], wanted: Wanted) -> bool:
    """Whether more than one table of a group holds what is wanted, each something else."""
    heads = [_heads(table, wanted) for table in tables if _heads(table, wanted)]
    return len(heads) > 1 and sum(map(len, heads)) == len(frozenset().union(*heads))


def _heads(table: FileTable, wanted: Wanted) -> frozenset[str]:
    """Return the wanted columns of numbers of a table beside its clock."""
    return frozenset(table.header) & wanted.numbers - {table.clock}


def _complete(tables: Sequence[FileTable], wanted: Wanted) -> bool:
    heads = {head for table in tables for head in table.header}
    return all(heads & of_quantity for of_quantity in wanted.needed)


def _stands_alone(table: FileTable, tables: Sequence[FileTable], wanted: Wanted) -> bool:
    others = [_heads(other, wanted) for other in tables if other is not table and not _complete([other], wanted)]
    return not _heads(table, wanted) & frozenset().union(*others)


# --- One table of them ---


def _joined(path: Path, tables: Sequence[FileTable], wanted: Wanted) -> FileTable:
    """Bring the wanted channels of tables to one clock: the fastest of displacement and force that both follow."""
    channels = [channel for table in tables for channel in _channels(path, table, wanted)]
    moving = [channel for channel in channels if not channel.held]
    needed = [c for c in moving if any(c.head in of_quantity for of_quantity in wanted.needed)] or moving or channels
    quick = min(needed, key=lambda channel: channel.step)
    slow = max(needed, key=lambda channel: channel.step)
    lead = quick if slow.step <= quick.step * (1.0 + SAME) or _follows(slow.values) else slow
    rows, cuts = _common_rows(path, lead, channels)
    time = lead.time[rows]
    base = lead.table
    cells: dict[str, tuple[Array, str]] = {base.clock: (time, _unit(base, base.clock))}
    steps = list(_left_out(tables, wanted))
    steps += [step for table in tables for step in table.steps]
    for channel in channels:
        same = channel.same_clock(lead.time)
        values = channel.values[rows] if same else resampled(channel.time, channel.values, time, held=channel.held)
        cells[channel.head] = (values, channel.unit)
        if not same:
            steps.append(_step(channel, lead, wanted))
    group = base.group or base.name
    units = tuple(unit for _, unit in cells.values())
    return FileTable(
        group,
        tuple(cells),
        tuple(values for values, _ in cells.values()),
        units if any(units) else None,
        clock=base.clock,
        begins=0.0,
        group=base.group,
        steps=(*steps, *cuts),
    )


def _channels(path: Path, table: FileTable, wanted: Wanted) -> Iterator[_Channel]:
    """Yield the wanted channels of a table.

    Raises
    ------
    DataError : when its clock does not run forwards, or a cell is no number
    """
    heads = _heads(table, wanted)
    clock = table.cells[table.header.index(table.clock)]
    place = table_place(path, table.name)
    if isinstance(clock, list):
        raise DataError(f"{place}: row 1: {table.clock}: a clock in seconds is needed (got {clock[0]!r})")
    if heads and (fault := clock_fault(clock)):
        raise DataError(f"{place}: row {fault[0] + 1}: {table.clock}: {fault[1]}")
    for index, head in enumerate(table.header):
        if head not in heads:
            continue
        values = table.cells[index]
        if isinstance(values, list):
            raise DataError(f"{place}: row 1: {head}: a number is needed (got {values[0]!r})")
        empty = np.flatnonzero(~np.isfinite(values))
        if empty.size:
            more = f" ({empty.size} such cells)" if empty.size > 1 else ""
            raise DataError(f"{place}: row {empty[0] + 1}: {head}: empty cell{more}")
        yield _Channel(head, table, clock + (table.begins or 0.0), values, _unit(table, head), head in wanted.held)


def _common_rows(path: Path, lead: _Channel, channels: Sequence[_Channel]) -> tuple[Mask, list[ReadingStep]]:
    """Mark the rows of the leading clock at which every channel is known, and report those that are left out.

    Raises
    ------
    DataError : when there are not two
    """
    late = max((c for c in channels if c.time.size > 1), key=lambda channel: float(channel.time[0]))
    short = min(channels, key=lambda channel: channel.end)
    before, after = lead.time < late.time[0] - SAME, lead.time > short.end + SAME
    known = ~before & ~after
    paused: Mask = np.zeros(lead.time.size, dtype=np.bool_)
    for channel in channels:
        if not channel.held and channel is not lead:
            paused |= known & _in_gap(channel.time, lead.time)
    known &= ~paused
    if np.count_nonzero(known) < 2:
        heads = {channel.head for channel in channels}
        whole = any(heads <= set(channel.table.header) for channel in (late, short))
        advice = (
            "are these tests of their own? say table: NAME" if whole else "export both as recorded at the same time"
        )
        raise DataError(
            f"{table_place(path, late.table.name)}: {late.head!r} begins at {late.time[0]:.6g} s, when {short.head!r} "
            f"has ended ({short.end:.6g} s): they have no time in common; {advice}"
        )
    cuts = [
        ReadingStep("left out", None, f"{counted(int(np.count_nonzero(rows)), 'row')} of {channel.head!r} {where}", "")
        for channel in channels
        if not channel.held
        for rows, where in (
            (channel.time < late.time[0] - SAME, f"before {late.time[0]:.6g} s, where {late.head!r} begins"),
            (channel.time > short.end + SAME, f"after {short.end:.6g} s, where {short.head!r} ends"),
            (paused if channel is lead else paused[:0], "in which another channel was paused"),
        )
        if rows.any()
    ]
    return known, cuts


def _in_gap(clock: Array, time: Array) -> Mask:
    """Whether instants lie inside a gap of a clock."""
    after = np.clip(np.searchsorted(clock, time - SAME), 1, clock.size - 1)
    wide = clock[after] - clock[after - 1] > GAP * float(np.median(np.diff(clock)))
    inside: Mask = wide & (time > clock[after - 1] + SAME) & (time < clock[after] - SAME)
    return inside


def _follows(values: Array) -> bool:
    """Whether samples (n,) have next to nothing in the uppermost part of their band."""
    if values.size < 8:
        return False
    scaled = values / max(float(np.max(np.abs(values))), np.finfo(np.float64).tiny)
    power = np.abs(np.fft.rfft((scaled - scaled.mean()) * np.hanning(values.size))) ** 2
    top = power[int(TOP * power.size) :]
    return bool(top.sum() <= FOLLOWS * power.sum())


def resampled(clock: Array, values: Array, time: Array, *, held: bool) -> Array:
    """Return a channel at other instants: held from sample to sample, or by a spline of degree five through them.

    Parameters
    ----------
    clock : (n,) instants of its samples, rising [s]
    values : (n,)
    time : (m,) from its first sample on [s]
    held : whether it is held

    Returns
    -------
    (m,)

    Examples
    --------
    >>> import numpy as np
    >>> resampled(np.array([0.0, 1.0]), np.array([5.0, 7.0]), np.array([0.0, 0.9, 1.0, 1.2]), held=True).tolist()
    [5.0, 5.0, 7.0, 7.0]
    """
    from scipy.interpolate import make_interp_spline

    if held:
        return np.asarray(values[np.maximum(np.searchsorted(clock, time + SAME, side="right") - 1, 0)])
    # About their own middle the instants keep their digits, however late the clock began.
    middle = 0.5 * float(clock[0] + clock[-1])
    degree = min(DEGREE, (clock.size - 1) // 2 * 2 - 1) if clock.size > 2 else 1
    return np.asarray(make_interp_spline(clock - middle, values, k=degree)(time - middle))


def _step(channel: _Channel, lead: _Channel, wanted: Wanted) -> ReadingStep:
    """Report a channel that was brought to the leading clock, with the delay of its first sample."""
    rate = f"{1.0 / channel.step:.6g} Hz" if channel.step else "one sample"
    delay = float(channel.time[0] - lead.time[0])
    begins = f", {abs(delay):.6g} s {'later' if delay > 0.0 else 'earlier'} than {lead.head!r}" if delay else ""
    how = "held from sample to sample" if channel.held else f"by a spline of degree {DEGREE}"
    return ReadingStep(
        "clock",
        wanted.quantities.get(channel.head),
        f"column {channel.head!r} of {channel.table.name!r} at {rate}{begins}",
        f"the clock of {lead.head!r}, {1.0 / lead.step:.6g} Hz, {how}",
    )


def _left_out(tables: Iterable[FileTable], wanted: Wanted) -> Iterator[ReadingStep]:
    unread = dict.fromkeys(h for t in tables for h in t.header if h not in wanted.numbers | wanted.texts)
    unread = {head: None for head in unread if not any(head == table.clock for table in tables)}
    if unread:
        yield ReadingStep("left out", None, f"columns {', '.join(unread)}", "")


def _unit(table: FileTable, head: str) -> str:
    return "" if table.units is None else table.units[table.header.index(head)]
