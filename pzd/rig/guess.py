"""Guesses, from the headers of rig files, the entry of a config that reads them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from pzd.quantities import (
    ACCELERATION,
    CHANNELS,
    DISPLACEMENT,
    FORCE,
    PRESSURE,
    TEMPERATURE,
    TIME,
    VELOCITY,
    VOLTAGE,
    Quantity,
)
from pzd.rig.channels import ALSO_READ, NEEDED
from pzd.rig.config import FilesEntry
from pzd.rig.formats import reader
from pzd.rig.units import in_header
from pzd.schema.scalars import written

_LOOKS_LIKE = {
    TIME: r"^t$|\btime",
    DISPLACEMENT: r"^[xs]$|disp|pos|stroke|travel|weg",
    VELOCITY: r"^v$|vel|speed",
    ACCELERATION: r"^a$|acc",
    FORCE: r"^f$|force|load|kraft",
    VOLTAGE: r"^u$|volt|spannung",
    TEMPERATURE: r"temp",
    PRESSURE: r"^p$|press",
}
"""What headers of each quantity look like, its own unit in brackets taken off."""

Header = tuple[str, ...]


def guessed(files: Sequence[Path]) -> list[str]:
    """A config for rig files, as lines of YAML, with empty places where only a person knows the answer.

    Parameters
    ----------
    files : the rig files

    Returns
    -------
    the lines; each empty place says in a comment what to fill in

    Raises
    ------
    UserError : when a file cannot be read
    """
    by_header: dict[Header, list[Path]] = {}
    for path in files:
        sheet = reader(path, None, "rig.files")(path, FilesEntry(path=str(path)), [q.column for q in CHANNELS])
        by_header.setdefault(sheet.header, []).append(path)
    lines = ["# Guessed from the headers: check every line. Paths are relative to this file.", "rig:", "  files:"]
    for header, paths in by_header.items():
        for pattern in _patterns(paths):
            lines += [f"    - path: {written(pattern)}", *(f"      {line}" for line in _entry(header))]
    return lines


def _patterns(paths: Sequence[Path]) -> list[str]:
    """One pattern for all the files where one matches exactly these, else every file by itself."""
    folders, endings = {path.parent for path in paths}, {path.suffix for path in paths}
    if len(paths) > 1 and len(folders) == len(endings) == 1:
        folder, pattern = paths[0].parent, f"*{paths[0].suffix}"
        if set(folder.glob(pattern)) == set(paths):
            return [(folder / pattern).as_posix()]
    return [path.as_posix() for path in paths]


def _entry(header: Header) -> Iterator[str]:
    found = {quantity: _column(header, quantity) for quantity in CHANNELS}
    named = {q: column for q, column in found.items() if column is not None and not _canonical(column, q)}
    lost = [q for q in NEEDED if found[q] is None]
    if named or lost:
        yield "columns:"
        yield from (f"  {q.name}: {written(column)}" for q, column in named.items())
        yield from (f"  {q.name}:   # fill in: one of {', '.join(header)}" for q in lost)
    unitless = [(q, column) for q, column in named.items() if in_header(column, q) is None]
    if unitless:
        yield "units:"
        yield from (f"  {q.name}:   # fill in: {column} names no unit, e.g. {q.unit}" for q, column in unitless)


def _column(header: Header, quantity: Quantity) -> str | None:
    canonical = [column for column in header if _canonical(column, quantity)]
    alike = [column for column in header if re.search(_LOOKS_LIKE[quantity], _bare(column))]
    taken = [column for column in alike if not any(_canonical(column, other) for other in CHANNELS)]
    return next(iter(canonical or taken), None)


def _canonical(column: str, quantity: Quantity) -> bool:
    return column in (quantity.column, ALSO_READ.get(quantity))


def _bare(column: str) -> str:
    return re.sub(r"[\[(].*", "", column).strip().lower()
