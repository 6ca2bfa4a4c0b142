"""JSON: arrays by name, `{"time [s]": [...], "force [kN]": [...]}`, at the top or in objects below, or a list of rows.

`{"unit": "mm", "values": [...]}` is a column too, and a single number beside arrays a column of one value.
A list of channels, each with its name, unit and samples, is a table of these.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pzd.rig.config import FilesEntry
from pzd.rig.files.sheet import FileTable, named_channels, table_of_rows, tables_of_tree
from pzd.schema.errors import DataError, at

KIND = "a JSON file"
SUFFIXES = (".json",)
NEEDS = None
OPTIONS = ("table",)


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes and as all of it is JSON."""
    if not start.removeprefix(b"\xef\xbb\xbf").lstrip().startswith((b"{", b"[")):
        return False
    try:
        json.loads(path.read_bytes())
    except ValueError:
        return False
    except RecursionError:
        return True  # `tables` refuses it
    return True


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read the tables of the objects."""
    try:
        read = json.loads(path.read_bytes(), parse_constant=_no_number, object_pairs_hook=_object)
    except json.JSONDecodeError as error:
        raise DataError(f"{at(path, error.lineno, error.colno)}: no JSON ({error.msg})") from None
    except RecursionError:
        raise DataError(f"{at(path, 1)}: lists and objects nested too deep for a table of a rig's channels") from None
    except _TwiceError as error:
        raise DataError(f"{at(path)}: the key {error.args[0]!r} stands twice in one object") from None
    if isinstance(read, list) and read and all(isinstance(row, dict) for row in read):
        if not any(isinstance(cell, list | dict) for row in read for cell in row.values()):
            return [table_of_rows("", read)]
        read = named_channels(read) or {str(number + 1): below for number, below in enumerate(read)}
    return tables_of_tree(read) if isinstance(read, dict) else []


class _TwiceError(Exception):
    """A key that stands twice in one object; a parser would keep the last."""


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key.strip() in found:
            raise _TwiceError(key)
        found[key.strip()] = value
    return found


def _no_number(word: str) -> Any:
    """Read NaN as an empty cell, and an infinity as it is, to be refused with its place."""
    return None if word == "NaN" else float(word.replace("Infinity", "inf"))
