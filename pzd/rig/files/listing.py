"""Which files the config names, and what their records are called."""

from __future__ import annotations

import glob
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pzd.rig.config import FilesEntry
from pzd.schema.errors import ConfigError


@dataclass(frozen=True)
class Listed:
    """One file, and the entry of the config that names it."""

    path: Path
    entry: FilesEntry
    place: str
    """Where the entry stands in the config."""


def listed(entries: Sequence[FilesEntry], folder: Path) -> tuple[Listed, ...]:
    """Every file of every entry, sorted by path.

    Parameters
    ----------
    entries : `rig.files` of the config
    folder : the config's folder, which relative paths start from

    Raises
    ------
    ConfigError : when a path matches no file
    """
    found: list[Listed] = []
    faults: list[str] = []
    for number, entry in enumerate(entries):
        place = f"rig.files.{number}"
        paths = matching(folder, entry.path)
        found += [Listed(path, entry, place) for path in paths]
        if not paths:
            hint = f"; {entry.source}" if entry.source else "; the path is relative to the config's folder"
            faults.append(f"{place}.path: no such file under {folder}{hint} (got {entry.path!r})")
    if faults:
        raise ConfigError(faults)
    return tuple(sorted(found, key=lambda one: (one.path.as_posix(), one.place)))


def matching(folder: Path, pattern: str) -> list[Path]:
    """Files that a path or glob pattern of the config names, seen from the config's folder."""
    literal = folder / pattern
    if literal.is_file():
        return [literal]
    whole = str(Path(glob.escape(str(folder))) / pattern)
    found = [Path(path) for path in glob.glob(whole, recursive=True)]  # noqa: PTH207  # Path.glob takes no absolute patterns
    return [path for path in found if path.is_file()]


def names(tests: Sequence[tuple[Path, int | None]]) -> tuple[str, ...]:
    """The name of every record, by the file and the number of the test in it.

    Parameters
    ----------
    tests : file, and number of the test in it (None where the file holds one)

    Returns
    -------
    the file's stem; with the parent folder in front where stems are equal; then -1, -2

    Raises
    ------
    ConfigError : when two records would have one name
    """
    files = list(dict.fromkeys(path for path, _ in tests))
    stems = Counter(_safe(path.stem) for path in files)
    called = [_called(path, number, stems) for path, number in tests]
    first: dict[str, Path] = {}
    faults: list[str] = []
    for name, (path, _) in zip(called, tests, strict=True):
        if name in first:
            faults.append(f"rig.files: two records would be called {name}: {first[name]} and {path}; rename one")
        first.setdefault(name, path)
    if faults:
        raise ConfigError(faults)
    return tuple(called)


def _called(path: Path, number: int | None, stems: Counter[str]) -> str:
    stem = _safe(path.stem)
    whole = stem if stems[stem] == 1 else _safe(f"{path.resolve().parent.name}-{path.stem}")
    return whole if number is None else f"{whole}-{number}"


def _safe(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9._-]", "_", name)
