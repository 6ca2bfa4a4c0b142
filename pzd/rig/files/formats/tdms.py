"""TDMS of LabVIEW: every group is a table; units from `unit_string`, the clock of a waveform from its increment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pzd.rig.config import FilesEntry
from pzd.rig.files.tables import Cells, Table, cells_of, equal_lengths

KIND = "a TDMS file"
SUFFIXES = (".tdms",)
NEEDS = "nptdms"
CLOCK = "time"
"""Header of the clock of a group of waveforms, which has no channel of its own."""


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format by how it begins."""
    return start.startswith(b"TDSm")


def tables(path: Path, entry: FilesEntry) -> list[Table]:
    """The tables of the groups."""
    from nptdms import TdmsFile

    found = []
    for group in TdmsFile.read(path).groups():
        columns: dict[str, tuple[Cells, str]] = {}
        for channel in group.channels():
            if len(channel) and "wf_increment" in channel.properties and CLOCK not in columns:
                start = float(channel.properties.get("wf_start_offset", 0.0))
                step = float(channel.properties["wf_increment"])
                columns[CLOCK] = (np.asarray(start + step * np.arange(len(channel)), dtype=np.float64), "s")
            if len(channel):
                unit = channel.properties.get("unit_string", channel.properties.get("NI_UnitDescription", ""))
                columns[channel.name.strip()] = (_cells(channel[:]), str(unit).strip())
        found += equal_lengths(group.name, columns)
    return found


def _cells(samples: Any) -> Cells:
    return samples.astype(np.float64) if samples.dtype.kind in "biuf" else cells_of(samples.tolist())
