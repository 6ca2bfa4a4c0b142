"""Parquet: one table of typed columns; the unit of a column is its metadata `unit` or `units`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

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
    from pyarrow import parquet

    table = parquet.read_table(path)
    units = tuple(_unit(dict(field.metadata or {})) for field in table.schema)
    cells = tuple(
        cells_of(column.to_pylist())
        if column.null_count or not _plain(column.type)
        else column.to_numpy().astype(float)
        for column in table.columns
    )
    return [FileTable("", tuple(name.strip() for name in table.column_names), cells, units if any(units) else None)]


def _plain(kind: object) -> bool:
    """Whether a column holds numbers only."""
    from pyarrow import types

    return bool(types.is_floating(kind) or types.is_integer(kind) or types.is_boolean(kind))


def _unit(metadata: dict[bytes, bytes]) -> str:
    return metadata.get(b"unit", metadata.get(b"units", b"")).decode("utf-8", "replace").strip()
