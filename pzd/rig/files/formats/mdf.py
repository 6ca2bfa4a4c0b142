"""MDF 3 and 4 of vehicle and rig loggers: every channel group is a table, its master channel the clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pzd.rig.config import FilesEntry
from pzd.rig.files.tables import Cells, Table, equal_lengths

KIND = "an MDF file"
SUFFIXES = (".mf4", ".mdf")
NEEDS = "asammdf"
CLOCK = "time"
"""Header of the clock where the master channel has no name."""


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format by how it begins."""
    return start.startswith((b"MDF     ", b"UnFinMF "))


def tables(path: Path, entry: FilesEntry) -> list[Table]:
    """The tables of the channel groups, in physical values."""
    from asammdf import MDF

    found = []
    with MDF(path) as file:
        for number, group in enumerate(file.groups):
            columns: dict[str, tuple[Cells, str]] = {}
            master = file.masters_db.get(number)
            for index, channel in enumerate(group.channels):
                if index == master:
                    continue
                signal = file.get(group=number, index=index)
                if signal.samples.ndim != 1 or signal.samples.dtype.kind not in "biuf":
                    continue
                if not columns:
                    clock = group.channels[master].name if master is not None else CLOCK
                    columns[clock or CLOCK] = (np.asarray(signal.timestamps, dtype=np.float64), "s")
                columns[channel.name.strip()] = (signal.samples.astype(np.float64), (signal.unit or "").strip())
            name = getattr(group.channel_group, "acq_name", "") or f"group {number + 1}"
            found += equal_lengths(name, columns)
    return found
