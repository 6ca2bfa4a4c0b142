"""MATLAB files up to version 7: arrays of one length are the columns of one table; a structure is a table below.

A matrix `x_F` of three columns gives `x_F.1`, `x_F.2`, `x_F.3`; a single number is a column of one value. Objects of
MATLAB's own classes (table, timeseries) are not stored openly: save their columns as arrays.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pzd.rig.files.sheet import FileTable, tables_of_tree
from pzd.schema.errors import DataError, at

if TYPE_CHECKING:
    from pzd.rig.config import FilesEntry

KIND = "a MATLAB file"
SUFFIXES = (".mat",)
NEEDS = None
OPTIONS = ("table",)
APART = True


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes."""
    return start.startswith(b"MATLAB 5.0")


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read the tables of the variables and structures.

    Raises
    ------
    DataError : when there are only objects of MATLAB's own classes
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatlabOpaque

    read = loadmat(path, simplify_cells=True)
    found = tables_of_tree({name: value for name, value in read.items() if not name.startswith("__")})
    if not found and any(isinstance(value, MatlabOpaque) for value in read.values()):
        raise DataError(f"{at(path)}: objects of MATLAB's own classes (table, timeseries); save the columns as arrays")
    return found
