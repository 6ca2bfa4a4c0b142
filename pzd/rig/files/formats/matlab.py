"""MATLAB files up to version 7: arrays of one length are the columns of one table; a structure is a table below.

A matrix `x_F` of three columns gives `x_F.1`, `x_F.2`, `x_F.3`; a single number is a column of one value. A structure
with time of Simulink and a capture of dSPACE are tables with their labels as headers. Objects of MATLAB's own classes
(table, timeseries) are not stored openly: save their columns as arrays.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pzd.record import Array
from pzd.rig.files.sheet import Cells, FileTable, tables_by_length, tables_of_tree
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
    found = tables_of_variables({name: value for name, value in read.items() if not name.startswith("__")})
    if not found and any(isinstance(value, MatlabOpaque) for value in read.values()):
        raise DataError(f"{at(path)}: {OWN_CLASSES}")
    return found


# --- What Simulink and dSPACE make of it ---

OWN_CLASSES = (
    "objects of MATLAB's own classes (table, timetable, timeseries), which MATLAB alone can read; there, say "
    "writetable(T, 'test.csv') for a table T, or save arrays, as t = ts.Time; x = ts.Data of a timeseries ts"
)
"""What to do about classes that are not stored openly."""
CLOCK = "time"
"""Header of the clock of a structure with time."""


def tables_of_variables(variables: Mapping[str, Any]) -> list[FileTable]:
    """Make the tables of variables: those of Simulink and dSPACE by their own clocks, the others as they stand."""
    found: list[FileTable] = []
    plain: dict[str, Any] = {}
    for name, value in variables.items():
        tables = _of_simulink(name, value) or _of_dspace(name, value)
        found += tables
        if not tables:
            plain[name] = value
    return found + tables_of_tree(plain)


def _of_simulink(name: str, value: Any) -> list[FileTable]:
    """Make the table of a structure with time: `time`, and `signals` with `values` and `label` each."""
    if not isinstance(value, Mapping) or not {"time", "signals"} <= set(value):
        return []
    columns: dict[str, tuple[Cells, str]] = {}
    for number, signal in enumerate(_list_of(value["signals"])):
        if not isinstance(signal, Mapping) or "values" not in signal:
            return []
        head = _text(signal, "label") or _text(signal, "blockName") or f"signal {number + 1}"
        columns |= _columns(_free(head, columns), signal["values"], "")
    return _on_their_clock(name, {"": (np.atleast_1d(value["time"]), columns)})


def _of_dspace(name: str, value: Any) -> list[FileTable]:
    """Make the tables of a capture of dSPACE: `X` with the times, `Y` with `Name`, `Data` and the number of its `X`."""
    if not isinstance(value, Mapping) or not {"X", "Y"} <= set(value):
        return []
    clocks, signals = _list_of(value["X"]), _list_of(value["Y"])
    if not all(isinstance(one, Mapping) and "Data" in one for one in (*clocks, *signals)):
        return []
    rasters: dict[str, tuple[Array, dict[str, tuple[Cells, str]]]] = {
        str(n): (np.atleast_1d(clock["Data"]), {}) for n, clock in enumerate(clocks)
    }
    for number, signal in enumerate(signals):
        index = signal.get("XIndex")
        at_clock = int(index) - 1 if isinstance(index, int | float) and 1 <= index <= len(clocks) else 0
        columns = rasters[str(at_clock)][1]
        head = _text(signal, "Name").strip('"') or f"signal {number + 1}"
        columns |= _columns(_free(head, columns), signal["Data"], _text(signal, "Unit"))
    return _on_their_clock(name, rasters)


def _text(fields: Mapping[str, Any], key: str) -> str:
    """Return the text of a field; empty where it is an array, as an empty text is."""
    value = fields.get(key)
    return value.strip() if isinstance(value, str) else ""


def _list_of(value: Any) -> list[Any]:
    many = isinstance(value, list | tuple) or (isinstance(value, np.ndarray) and value.dtype.kind == "O")
    return list(np.ravel(value)) if many else [value]


def _free(head: str, taken: Mapping[str, Any]) -> str:
    """Return a label, numbered where it stands there already."""
    return head if head not in taken and head != CLOCK else f"{head}.{len(taken) + 1}"


def _columns(head: str, values: Any, unit: str) -> dict[str, tuple[Cells, str]]:
    """Make one column of samples, or one for each channel of a matrix, its longer side the time."""
    samples = np.squeeze(np.asarray(values))
    if samples.dtype.kind not in "biuf" or samples.ndim > 2:
        return {}
    samples = np.atleast_1d(samples).astype(np.float64)
    if samples.ndim == 1:
        return {head: (samples, unit)}
    upright = samples if samples.shape[0] >= samples.shape[1] else samples.T
    return {f"{head}.{n + 1}": (np.ascontiguousarray(column), unit) for n, column in enumerate(upright.T)}


def _on_their_clock(name: str, rasters: Mapping[str, tuple[Array, dict[str, tuple[Cells, str]]]]) -> list[FileTable]:
    """Make a table of each clock; columns of another length than the clock's have none."""
    found = []
    for number, (time, columns) in rasters.items():
        called = f"{name} clock {int(number) + 1}" if len(rasters) > 1 else name
        fitting = {head: both for head, both in columns.items() if len(both[0]) == time.size}
        clock: dict[str, tuple[Cells, str]] = {CLOCK: (np.asarray(time, dtype=np.float64).ravel(), "s")}
        if fitting:
            (table,) = tables_by_length(called, clock | fitting)
            found.append(replace(table, clock=CLOCK, begins=0.0, group=name if len(rasters) > 1 else ""))
        found += tables_by_length(called, {head: both for head, both in columns.items() if head not in fitting})
    return found
