"""The rig files that the paths and patterns of a config name."""

from __future__ import annotations

import glob
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
    number: int
    """Which entry of the config it is, from 0."""


def listed(entries: Sequence[FilesEntry], folder: Path) -> tuple[Listed, ...]:
    """Every file of every entry, sorted by path.

    Parameters
    ----------
    entries : `rig.files` of the config
    folder : the config's folder, which relative paths start from

    Raises
    ------
    ConfigError : when a path matches no file, or two entries read the same of a file
    """
    found: list[Listed] = []
    faults: list[str] = []
    for number, entry in enumerate(entries):
        place = f"rig.files.{number}"
        paths = matching(folder, entry.path)
        found += [Listed(path, entry, number) for path in paths]
        if not paths:
            hint = f"; {entry.source}" if entry.source else "; the path is relative to the config's folder"
            faults.append(f"{place}.path: no such file under {folder}{hint} (got {entry.path!r})")
    faults += _read_twice(found)
    if faults:
        raise ConfigError(faults)
    return tuple(sorted(found, key=lambda one: (one.path.as_posix(), one.number)))


def _read_twice(found: Sequence[Listed]) -> list[str]:
    """Pairs of entries that read the same of a file; each may take other tables, columns or tests."""
    first: dict[tuple[Path, str], Listed] = {}
    pairs: dict[tuple[int, int], list[Path]] = {}
    for one in found:
        way = one.entry.model_dump_json(include={"layout", "columns", "table", "split"})
        before = first.setdefault((one.path.resolve(), way), one)
        if before is not one:
            pairs.setdefault((before.number, one.number), []).append(one.path)
    faults: list[str] = []
    for (first_number, number), paths in pairs.items():
        earlier, later = _entry(found, first_number), _entry(found, number)
        more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
        faults.append(
            f"rig.files.{number}.path: reads {paths[0].name}{more}, which rig.files.{first_number} reads too"
            f"{_settings(earlier, later)}; each test belongs to one entry: narrow one of the paths "
            f"(got {earlier.path!r} and {later.path!r})"
        )
    return faults


def _entry(found: Sequence[Listed], number: int) -> FilesEntry:
    return next(one.entry for one in found if one.number == number)


def _settings(one: FilesEntry, other: FilesEntry) -> str:
    """Under which settings, where two entries name different ones."""
    if one.setting == other.setting:
        return ""
    return f", as setting {one.setting or 'without a name'} and {other.setting or 'without a name'}"


def matching(folder: Path, pattern: str) -> list[Path]:
    """Files that a path or glob pattern of the config names, seen from the config's folder."""
    literal = folder / pattern
    if literal.is_file():
        return [literal]
    whole = str(Path(glob.escape(str(folder))) / pattern)
    found = [Path(path) for path in glob.glob(whole, recursive=True)]  # noqa: PTH207  # Path.glob takes no absolute patterns
    return [path for path in found if path.is_file()]
