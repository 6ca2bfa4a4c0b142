"""HDF5, among it MATLAB files of version 7.3: data sets of one length in one group are the columns of one table.

The unit of a column is the attribute `unit` or `units` of its data set. MATLAB stores texts as the numbers of their
characters, and a matrix turned over, which does not matter: the longer side is time.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from pzd.rig.files.sheet import FileTable, tables_of_tree

if TYPE_CHECKING:
    from pzd.rig.config import FilesEntry

KIND = "an HDF5 file"
SUFFIXES = (".h5", ".hdf5", ".hdf")
NEEDS = "h5py"
OPTIONS = ("table",)
APART = True
MAGIC = b"\x89HDF\r\n\x1a\n"


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes; MATLAB puts 512 bytes of its own in front."""
    return MAGIC in (start[:8], start[512:520], start[1024:1032], start[2048:2056])


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read the tables of the groups."""
    import h5py

    with h5py.File(path, "r") as file:
        return tables_of_tree(_tree(file))


def _tree(group: Any) -> dict[str, Any]:
    """Read a group as a structure, without what MATLAB keeps for itself, which begins with a sharp."""
    found: dict[str, Any] = {}
    for name, item in group.items():
        if name.startswith("#"):
            continue
        if hasattr(item, "items"):
            found[name] = _tree(item)
        elif (value := _value(item)) is not None:
            unit = next((_text(item.attrs[key]) for key in ("unit", "units") if key in item.attrs), None)
            found[name] = {"values": value, "unit": unit} if unit is not None else value
    return found


def _value(item: Any) -> Any:
    """Read the samples, number or text of one data set; None for anything else."""
    kind = _text(item.attrs.get("MATLAB_class", ""))
    if item.dtype.names:
        return {name: item[name] for name in item.dtype.names} if item.ndim == 1 else None
    references = item.dtype.kind == "O" and item.dtype.metadata is not None and "ref" in item.dtype.metadata
    if item.shape is None or references or item.dtype.kind not in "biufSUO" or "MATLAB_empty" in item.attrs:
        return None
    read = item[()]
    if kind == "char":
        return "".join(map(chr, read.ravel()))
    if item.dtype.kind in "SO":
        return _text(read) if item.ndim == 0 else [_text(cell) for cell in read.ravel()]
    if item.ndim == 0 or item.size == 1:
        return float(read.ravel()[0]) if item.ndim else float(read)
    return read


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
