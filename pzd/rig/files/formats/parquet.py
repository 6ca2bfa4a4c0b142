"""Parquet: one table of typed columns; the unit of a column is its metadata `unit` or `units`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pzd.rig.files.sheet import FileTable, cells_of

if TYPE_CHECKING:
    from pzd.rig.config import FilesEntry

KIND = "a Parquet file"
SUFFIXES = (".parquet", ".pq")
NEEDS = "pyarrow"
OPTIONS = ()
APART = True


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes."""
    return start.startswith(b"PAR1")


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read the one table of the file."""
    from pyarrow import parquet, types

    table = parquet.read_table(path)
    units = tuple(_unit(dict(field.metadata or {})) for field in table.schema)
    names = [name.strip() for name in table.column_names]
    cells = [
        cells_of(column.to_pylist())
        if column.null_count or not _plain(column.type)
        else column.to_numpy().astype(float)
        for column in table.columns
    ]
    # pandas writes an index without a name so; one of instants is the clock of the recording.
    if _INDEX in names and types.is_timestamp(table.schema.types[place := names.index(_INDEX)]):
        stamps = table.columns[place].to_numpy().astype("datetime64[ns]")
        names[place], cells[place] = _CLOCK, (stamps - stamps[0]) / np.timedelta64(1, "s")
        units = tuple("s" if i == place else unit for i, unit in enumerate(units))
    return [FileTable("", tuple(names), tuple(cells), units if any(units) else None)]


_INDEX, _CLOCK = "__index_level_0__", "time"


def _plain(kind: object) -> bool:
    """Whether a column holds numbers only."""
    from pyarrow import types

    return bool(types.is_floating(kind) or types.is_integer(kind) or types.is_boolean(kind))


def _unit(metadata: dict[bytes, bytes]) -> str:
    return metadata.get(b"unit", metadata.get(b"units", b"")).decode("utf-8", "replace").strip()
