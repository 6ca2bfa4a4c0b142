"""Universal files, dataset 58: every function of time is a column; units and quantities by their labels.

Channels that share abscissa and length are a table; those of other clocks are a table each, on the clock that the file
shares. Where a channel stands in the file again, the next recording begins. Spectra and other functions are left out.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pzd.rig.files.sheet import Cells, FileTable, tables_by_length
from pzd.schema.errors import DataError, at

if TYPE_CHECKING:
    from pzd.rig.config import FilesEntry

KIND = "a universal file"
SUFFIXES = (".uff", ".unv", ".uf", ".bunv")
NEEDS = "pyuff"
OPTIONS = ("table",)
APART = True
CLOCK = "time"
"""Header of the abscissa."""
_FUNCTION = 58
_GENERAL, _TIME_RESPONSE = 0, 1
"""Types of function, record 6 field 1."""
_OF_TIME = 17
"""Specific data type of an abscissa of time, record 8 field 1."""
_QUANTITIES = {
    5: "temperature",
    8: "displacement",
    9: "force",
    11: "velocity",
    12: "acceleration",
    13: "force",
    15: "pressure",
}
"""Specific data types of an ordinate, record 9 field 1."""

_LABELS = ("ordinate_axis_lab", "id1", "rsp_ent_name")
"""Labels that may name a channel."""
_NOTHING = ("", "NONE", "NONAME")
"""What stands where a label has nothing to say."""


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes: a line of -1, and one with the number of a dataset."""
    lines = [line.strip() for line in start.splitlines()[:2]]
    return len(lines) == 2 and lines[0] == b"-1" and lines[1][:6].rstrip(b"b ").isdigit()


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read the functions of time.

    Raises
    ------
    DataError : when there is none
    """
    import pyuff

    read = pyuff.UFF(str(path)).read_sets()
    functions = [one for one in (read if isinstance(read, list) else [read]) if one.get("type") == _FUNCTION]
    found = [one for one in functions if _of_time(one)]
    if not found:
        what = f"{len(functions)} functions of frequency or others" if functions else "no dataset 58"
        raise DataError(f"{at(path)}: {KIND} without a function of time, {what}: a test needs records over time")
    recordings: list[dict[str, Any]] = [{}]
    for one in found:
        if any(_channel(one) == _channel(other) for other in recordings[-1].values()):
            recordings.append({})
        recordings[-1][_name(one, found, recordings[-1])] = one
    several = len(recordings) > 1
    return [
        table
        for number, channels in enumerate(recordings, 1)
        for table in _recording(f"recording {number}" if several else "", channels)
    ]


def _of_time(one: dict[str, Any]) -> bool:
    kind = one.get("func_type")
    return kind == _TIME_RESPONSE or (kind == _GENERAL and one.get("abscissa_spec_data_type") == _OF_TIME)


def _channel(one: dict[str, Any]) -> tuple[Any, ...]:
    """Return what tells a channel from others: node, direction, labels and type."""
    keys = ("rsp_node", "rsp_dir", "ordinate_spec_data_type", *_LABELS)
    return tuple(one.get(key) for key in keys)


def _name(one: dict[str, Any], every: Sequence[dict[str, Any]], taken: Collection[str]) -> str:
    """Return the header of a channel: a label that no other bears, else what its type says; where taken with its node.

    The first line of identification names the channel in some loggers, and the whole test in others.
    """
    told = ""
    for key in _LABELS:
        label = str(one.get(key, "")).strip()
        bearers = {_channel(other) for other in every if str(other.get(key, "")).strip() == label}
        if label.upper() not in _NOTHING and len(bearers) == 1:
            told = label
            break
    name = told or _QUANTITIES.get(int(one.get("ordinate_spec_data_type", 0)), "channel")
    if name not in taken:
        return name
    return f"{name} {one.get('rsp_node', len(taken))}:{one.get('rsp_dir', 0)}"


def _recording(name: str, channels: dict[str, Any]) -> list[FileTable]:
    """Make the tables of one recording, one for each clock."""
    clocks: dict[tuple[float, ...], dict[str, tuple[Cells, str]]] = {}
    for head, one in channels.items():
        time = np.asarray(one["x"], dtype=np.float64)
        key = (float(time[0]), float(time[-1]), float(time.size)) if time.size else (0.0, 0.0, 0.0)
        columns = clocks.setdefault(key, {CLOCK: (time, _unit(one, "abscissa") or "s")})
        columns[head] = (np.real(np.asarray(one["data"])).astype(np.float64), _unit(one, "ordinate"))
    if len(clocks) == 1:
        return tables_by_length(name, next(iter(clocks.values())))
    made = []
    for number, columns in enumerate(clocks.values(), 1):
        (table, *_) = tables_by_length(f"{name} clock {number}".strip(), columns)
        made.append(replace(table, clock=CLOCK, begins=0.0, group=name or "recording"))
    return made


def _unit(one: dict[str, Any], axis: str) -> str:
    label = str(one.get(f"{axis}_axis_units_lab", "")).strip()
    return "" if label.upper() in _NOTHING else label
