"""Formats of rig files, one file each: `KIND`, `SUFFIXES`, `NEEDS`, `OPTIONS`, `holds(path, start)` and `tables`.

`NEEDS` is the library that reads the format, None where pzd itself needs it anyway; it is imported inside `tables`.
`OPTIONS` are the keys of `ALL_OPTIONS` that apply to the format; others are refused. A format of loose cells (a
workbook) has `rows(path)` too, from which `pzd init` guesses the layout. Delimited text alone has `read` instead of
`tables`: it parses only the columns that are asked for. A format with `APART = True` is read in a child process, with
limits: its library is at the mercy of the file.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable
from contextlib import redirect_stdout
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from pzd.rig.files.child import as_plain, read_in_child
from pzd.rig.files.dialect import after_lines, text_of
from pzd.rig.files.one_clock import on_one_clock
from pzd.rig.files.sheet import FileTable, Sheet, Wanted, named_tables, sheet_of
from pzd.schema.errors import ConfigError, DataError, FilesError, UserError, at

if TYPE_CHECKING:  # the child has no use for it, and its import takes long
    from pzd.rig.config import FilesEntry

TEXT = "text"
"""Format of files that no other format recognises by their content or their ending."""
ALL_OPTIONS = ("separator", "decimal", "skip", "header", "units_row", "comment", "leave_out", "encoding", "table")
"""Keys of an entry about the dialect of a file."""
START = 4096
"""Bytes from the start of a file by which its format is known."""


@lru_cache(maxsize=1)
def formats() -> dict[str, ModuleType]:
    """Return every format of this folder by its name."""
    return {found.name: import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__)}


def format_of(path: Path, name: str | None, place: str) -> str:
    """Return the name of a file's format: by the config, else by content, else by its ending, else text.

    Parameters
    ----------
    path : the file
    name : `format` of the config
    place : where the entry stands in the config

    Raises
    ------
    ConfigError : when no format has the name, or its library is not installed
    FilesError : when the file cannot be read
    """
    if name is not None and name not in formats():
        raise ConfigError(f"{place}.format: no such format; there are {', '.join(formats())} (got {name!r})")
    found = name or _recognised(path)
    library = formats()[found].NEEDS
    if library is not None and find_spec(library) is None:
        raise ConfigError(
            f"{at(path)}: {formats()[found].KIND} is read with {library}, which is not installed; "
            "pip install 'pzd[formats]'"
        )
    return found


def read_sheet(path: Path, entry: FilesEntry, wanted: Wanted, place: str) -> Sheet:
    """Read the wanted columns of a file of any format.

    Parameters
    ----------
    path : the file
    entry : how it is to be read
    wanted : the columns to read
    place : where the entry stands in the config

    Raises
    ------
    ConfigError : when no format has the name in the config, its library is not installed, or an option does not apply
    DataError : when the file is damaged or holds no such table
    FilesError : when the file cannot be read
    """
    module = formats()[format_of(path, entry.format, place)]
    idle = [
        k for k in ALL_OPTIONS if k not in module.OPTIONS and getattr(entry, k) != type(entry).model_fields[k].default
    ]
    if idle:
        raise ConfigError(f"{place}.{key}: {module.KIND} has nothing of the kind ({at(path)})" for key in idle)
    if hasattr(module, "read"):
        sheet: Sheet = module.read(path, entry, wanted)
        return sheet
    tables = tables_in(path, entry, module)
    named = named_tables(path, tables, entry.table)
    others = [table for table in tables if table.rows and table not in named]
    return sheet_of(path, on_one_clock(path, named, wanted), others, wanted)


def tables_in(path: Path, entry: FilesEntry, module: ModuleType) -> list[FileTable]:
    """Read the tables of a file of one format.

    Raises
    ------
    DataError : when the library of the format cannot read it
    """
    found: list[FileTable]
    if getattr(module, "APART", False):
        found = read_in_child(path, module, "tables", as_plain(ALL_OPTIONS, entry))
    else:
        found = by_library(path, module, lambda: module.tables(path, entry))
    return found


def rows_in(path: Path, module: ModuleType) -> dict[str, list[list[str]]] | None:
    """Read the cells of every sheet of a file of loose cells, row by row; None for a format of named columns.

    Raises
    ------
    DataError : when the library of the format cannot read it
    """
    if not hasattr(module, "rows"):
        return None
    found: dict[str, list[list[str]]] = read_in_child(path, module, "rows")
    return found


def lines_above(path: Path, entry: FilesEntry, sheet: Sheet, place: str) -> tuple[str, ...]:
    """Return the lines above the header of every table of a file that was read, one text each.

    Parameters
    ----------
    path : the file
    entry : how it was read
    sheet : what was read of it
    place : where the entry stands in the config

    Raises
    ------
    ConfigError : when nothing stands above the headers in files of this format
    """
    module = formats()[form := format_of(path, entry.format, place)]
    if form == TEXT:
        text = text_of(path, entry.encoding)
        return (text[: after_lines(text, entry.skip if sheet.header_line is None else sheet.header_line - 1)],)
    rows = rows_in(path, module)
    if rows is None:
        raise ConfigError(f"{place}.preamble: {module.KIND} has nothing of the kind ({at(path)})")
    above = (rows.get(table, [])[: entry.skip] for table in sheet.tables)
    return tuple("\n".join("\t".join(filter(None, cells)) for cells in table) for table in above)


def by_library(path: Path, module: ModuleType, read: Callable[[], Any]) -> Any:
    """Read a file by a format's library; a damaged file makes these libraries raise anything."""
    try:
        with redirect_stdout(StringIO()):  # some libraries print what they stumble over
            return read()
    except UserError:
        raise
    except Exception as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise DataError(f"{at(path)}: {module.KIND} that cannot be read ({why})") from error


def _recognised(path: Path) -> str:
    """Return the format of a file by its content, else by its ending, else text."""
    try:
        with path.open("rb") as file:
            start = file.read(START)
    except OSError as error:
        raise FilesError(f"{at(path)}: cannot be read ({error.strerror})") from None
    others = {name: module for name, module in formats().items() if name != TEXT}
    by_content = next((name for name, module in others.items() if module.holds(path, start)), None)
    ending = path.suffix.lower()
    return by_content or next((name for name, module in others.items() if ending in module.SUFFIXES), TEXT)
