"""HDF5, among it MATLAB files of version 7.3: data sets of one length in one group are the columns of one table.

The unit of a column is the attribute `unit` or `units` of its data set; a number among the attributes of a group is
that of all its rows. MATLAB stores texts as the numbers of their characters, and a matrix turned over, which does not
matter: the longer side is time.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from pzd.rig.files.formats.matlab import OWN_CLASSES, tables_of_variables
from pzd.rig.files.sheet import FileTable
from pzd.schema.errors import DataError, at

if TYPE_CHECKING:
    from pzd.rig.config import FilesEntry

KIND = "an HDF5 file"
SUFFIXES = (".h5", ".hdf5", ".hdf")
NEEDS = "h5py"
OPTIONS = ("table",)
APART = True
MOST_REFERENCES = 1000
"""Values of an array of structures that are followed: channels of a recorder are fewer."""
MAGIC = b"\x89HDF\r\n\x1a\n"


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes; MATLAB puts 512 bytes of its own in front."""
    return MAGIC in (start[:8], start[512:520], start[1024:1032], start[2048:2056])


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read the tables of the groups."""
    import h5py

    with h5py.File(path, "r") as file:
        found = tables_of_variables(_tree(file, file))
        if not found and any("MATLAB_object_decode" in item.attrs for item in file.values()):
            raise DataError(f"{at(path)}: {OWN_CLASSES}")
        return found


def _tree(group: Any, file: Any) -> dict[str, Any]:
    """Read a group as a structure, without what MATLAB keeps for itself, which begins with a sharp."""
    found: dict[str, Any] = {}
    for name, item in group.items():
        if name.startswith("#"):
            continue
        if hasattr(item, "items"):
            found[name] = _structures(_tree(item, file))
        elif "MATLAB_object_decode" in item.attrs:
            continue  # an object of MATLAB's own classes is numbers that mean nothing here
        elif (value := _followed(item, file)) is not None:
            unit = next((_text(item.attrs[key]) for key in ("unit", "units") if key in item.attrs), None)
            found[name] = {"values": value, "unit": unit} if unit is not None else value
    return _numbers_of(group) | found


def _numbers_of(group: Any) -> dict[str, float]:
    """Return the attributes of a group that are one number each, as the level of a test is written down."""
    return {
        name: float(value)
        for name, value in group.attrs.items()
        if not name.startswith("MATLAB_") and getattr(value, "size", 0) == 1 and value.dtype.kind in "iuf"
    }


def _structures(fields: dict[str, Any]) -> Any:
    """Return an array of structures as a list of them: MATLAB stores, for each field, a list of its values."""
    lists = [value for value in fields.values() if isinstance(value, _Referred)]
    if not lists or len(lists) < len(fields) or len({len(one) for one in lists}) != 1:
        return fields
    return [dict(zip(fields, values, strict=True)) for values in zip(*lists, strict=True)]


class _Referred(list[Any]):
    """Values of one field of an array of structures, or of a cell array."""


def _followed(item: Any, file: Any) -> Any:
    """Read a data set, and where it holds references what they refer to."""
    if item.dtype.kind != "O" or item.dtype.metadata is None or "ref" not in item.dtype.metadata:
        return _value(item)
    if item.shape is None or item.size > MOST_REFERENCES:
        return None
    referred = [file[one] for one in item[()].ravel() if one]
    return _Referred(
        _structures(_tree(one, file)) if hasattr(one, "items") else _followed(one, file) for one in referred
    )


def _value(item: Any) -> Any:
    """Read the samples, number or text of one data set; None for anything else."""
    kind = _text(item.attrs.get("MATLAB_class", ""))
    if item.dtype.names:
        return {name: item[name] for name in item.dtype.names} if item.ndim == 1 else None
    if item.shape is None or item.dtype.kind not in "biufSUO" or "MATLAB_empty" in item.attrs:
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
