"""TDMS of LabVIEW: every group is a table; units from `unit_string`, the clock of a waveform from its increment."""

from __future__ import annotations

from collections.abc import Sequence
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
    return [table for group in file.groups() for table in _group(group.name, group.channels())]


def _group(name: str, channels: Sequence[Any]) -> list[FileTable]:
    """Make the tables of one group: one for the waveforms of each clock, with what has no clock of its own."""
    filled = [channel for channel in channels if len(channel)]
    clocks = list(dict.fromkeys(filter(None, map(_clock, filled))))
    if any(channel.name.strip() == CLOCK for channel in filled):
        clocks = []
    found = []
    for number, clock in enumerate(clocks or [None]):
        mine = [channel for channel in filled if clock is None or _clock(channel) in (clock, None)]
        columns = {channel.name.strip(): (_cells(channel[:]), _unit(channel)) for channel in mine}
        if clock is not None:
            _, start, step, length = clock
            columns[CLOCK] = (np.asarray(start + step * np.arange(length), dtype=np.float64), "s")
        found += tables_by_length(f"{name} clock {number + 1}" if len(clocks) > 1 else name, columns)
    return found


def _clock(channel: Any) -> tuple[str, float, float, int] | None:
    """Return the start of a waveform, the offset of its first sample and the step of its clock [s], and its length."""
    properties = channel.properties
    if "wf_increment" not in properties:
        return None
    begun = str(properties.get("wf_start_time", ""))
    return begun, float(properties.get("wf_start_offset", 0.0)), float(properties["wf_increment"]), len(channel)


def _unit(channel: Any) -> str:
    return str(channel.properties.get("unit_string", channel.properties.get("NI_UnitDescription", ""))).strip()


def _cells(samples: Any) -> Cells:
    return samples.astype(np.float64) if samples.dtype.kind in "biuf" else cells_of(samples.tolist())
