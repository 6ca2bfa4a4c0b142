"""MDF 3 and 4 of vehicle and rig loggers: every channel group is a table, its master channel the clock."""

from __future__ import annotations

from pathlib import Path
from traceback import walk_tb
from typing import Any, BinaryIO

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
    found = []
    with path.open("rb") as opened, _opened(opened) as file:
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


def _opened(file: BinaryIO) -> Any:
    """The file as the library sees it; one that it could not open is closed, as its destructor would fail aloud."""
    from asammdf import MDF

    try:
        return MDF(file)
    except Exception as error:
        for frame, _ in walk_tb(error.__traceback__):
            half_open = frame.f_locals.get("self")
            if half_open is not None and hasattr(half_open, "_tempfile") and hasattr(half_open, "_closed"):
                half_open._tempfile.close()  # noqa: SLF001  # the library has no other way to it
                half_open._closed = True  # noqa: SLF001  # as above
        raise
