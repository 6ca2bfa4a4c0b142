"""MDF 3 and 4 of vehicle and rig loggers: every channel group is a table, its master channel the clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from traceback import walk_tb
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from pzd.rig.files.sheet import Cells, FileTable, tables_by_length

if TYPE_CHECKING:
    from pzd.rig.config import FilesEntry

KIND = "an MDF file"
SUFFIXES = (".mf4", ".mdf")
NEEDS = "asammdf"
OPTIONS = ("table",)
APART = True
CLOCK = "time"
"""Header of the clock where the master channel has no name."""
TIME_MASTER = 1
"""Kind of a master channel that is a time, and no angle, distance or count."""


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes."""
    return start.startswith((b"MDF     ", b"UnFinMF "))


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read the tables of the channel groups, in physical values."""
    found = []
    with path.open("rb") as opened, _opened(opened) as file:
        for number, group in enumerate(file.groups):
            master = file.masters_db.get(number)
            signals = [
                file.get(group=number, index=index, ignore_invalidation_bits=True)
                for index in range(len(group.channels))
                if index != master
            ]
            plain = [signal for signal in signals if signal.samples.ndim == 1 and signal.samples.dtype.kind in "biuf"]
            if plain:
                clock = None if master is None else group.channels[master]
                name = getattr(group.channel_group, "acq_name", "") or f"group {number + 1}"
                columns = _columns(clock, plain)
                read = tables_by_length(name, columns)
                # Every master of time counts from the start of the file.
                shared = next(iter(columns.values()))[1] == "s"
                found += [replace(t, clock=next(iter(columns)), begins=0.0) for t in read] if shared else read
    return found


def _columns(master: Any, signals: Sequence[Any]) -> dict[str, tuple[Cells, str]]:
    """Make columns of the signals of one group and their clock, invalid samples empty; equal names are numbered."""
    clock = CLOCK if master is None else master.name.strip() or CLOCK
    unit = "s" if getattr(master, "sync_type", TIME_MASTER) == TIME_MASTER else str(master.unit or "-")
    columns: dict[str, tuple[Cells, str]] = {clock: (np.asarray(signals[0].timestamps, dtype=np.float64), unit)}
    names = [signal.name.strip() for signal in signals]
    for number, signal in enumerate(signals):
        name = names[number]
        twice = names.count(name) > 1 or name == clock
        samples = signal.samples.astype(np.float64)
        if signal.invalidation_bits is not None:
            samples[np.asarray(signal.invalidation_bits, dtype=np.bool_)] = np.nan
        columns[f"{name}.{names[: number + 1].count(name)}" if twice else name] = (samples, (signal.unit or "").strip())
    return columns


def _opened(file: BinaryIO) -> Any:
    """Open a file by the library; close it where that fails, as the destructor would print an error."""
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
