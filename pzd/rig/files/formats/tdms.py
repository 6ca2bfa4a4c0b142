"""TDMS of LabVIEW: every group is a table; units from `unit_string`, the clock of a waveform from its increment.

Waveforms of several clocks, told by `wf_increment`, `wf_start_time` and `wf_start_offset`, are a table each, on the
clock that the file shares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pzd.rig.files.sheet import Cells, FileTable, cells_of, tables_by_length
from pzd.schema.errors import DataError, at

if TYPE_CHECKING:
    from pzd.rig.config import FilesEntry

KIND = "a TDMS file"
SUFFIXES = (".tdms",)
NEEDS = "nptdms"
OPTIONS = ("table",)
APART = True
CLOCK = "time"
"""Header of the clock of a group of waveforms, which has no channel of its own."""


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes."""
    return start.startswith(b"TDSm")


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read the tables of the groups.

    Raises
    ------
    DataError : when the file ends in the middle of its data, as it does where the logger was cut off
    """
    from nptdms import TdmsFile

    file = TdmsFile.read(path)
    if file.file_status.incomplete_final_segment:
        raise DataError(f"{at(path)}: ends in the middle of its data; export it again, or what is left of it")
    groups = {group.name: [channel for channel in group.channels() if len(channel)] for group in file.groups()}
    begun = [start for channels in groups.values() for start in map(_start, channels) if start is not None]
    return [table for name, channels in groups.items() for table in _group(name, channels, min(begun, default=None))]


def _group(name: str, filled: Sequence[Any], earliest: np.datetime64 | None) -> list[FileTable]:
    """Make the tables of one group: one for the waveforms of each clock, with what has no clock of its own."""
    clocks = list(dict.fromkeys(filter(None, map(_clock, filled))))
    if any(channel.name.strip() == CLOCK for channel in filled):
        clocks = []
    if len(clocks) < 2:
        columns = {channel.name.strip(): (_cells(channel[:]), _unit(channel)) for channel in filled}
        found = tables_by_length(name, columns | (_time(clocks[0]) if clocks else {}))
        return [_on_clock(table, clocks[0], earliest, "") for table in found] if clocks else found
    tables = []
    for number, clock in enumerate(clocks):
        mine = {
            channel.name.strip(): (_cells(channel[:]), _unit(channel))
            for channel in filled
            if _clock(channel) in (clock, None)
        }
        (table, *_) = tables_by_length(f"{name} clock {number + 1}", _time(clock) | mine)
        tables.append(_on_clock(table, clock, earliest, name))
    return tables


_Clock = tuple[np.datetime64 | None, float, float, int]
"""Instant at which a waveform begins, offset of its first sample from it [s], step of its clock [s], its length."""


def _clock(channel: Any) -> _Clock | None:
    """Return the clock of a waveform, None for a channel without one."""
    properties = channel.properties
    if "wf_increment" not in properties:
        return None
    offset, step = float(properties.get("wf_start_offset", 0.0)), float(properties["wf_increment"])
    return _start(channel), offset, step, len(channel)


def _start(channel: Any) -> np.datetime64 | None:
    begun = channel.properties.get("wf_start_time")
    return begun.astype("datetime64[us]") if isinstance(begun, np.datetime64) else None


def _time(clock: _Clock) -> dict[str, tuple[Cells, str]]:
    _, offset, step, length = clock
    return {CLOCK: (np.asarray(offset + step * np.arange(length), dtype=np.float64), "s")}


def _on_clock(table: FileTable, clock: _Clock, earliest: np.datetime64 | None, group: str) -> FileTable:
    """Place a table of waveforms on the clock of the file, which begins with its earliest waveform."""
    if CLOCK not in table.header:
        return table
    start = clock[0]
    if earliest is None:
        begins: float | None = 0.0
    else:
        begins = None if start is None else float((start - earliest) / np.timedelta64(1, "us")) * 1e-6
    return replace(table, clock=CLOCK, begins=begins, group=group)


def _unit(channel: Any) -> str:
    return str(channel.properties.get("unit_string", channel.properties.get("NI_UnitDescription", ""))).strip()


def _cells(samples: Any) -> Cells:
    return samples.astype(np.float64) if samples.dtype.kind in "biuf" else cells_of(samples.tolist())
