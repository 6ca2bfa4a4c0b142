"""What a command that was killed left half done in a run's folder: finished, undone, or removed."""

from __future__ import annotations

import logging
import os
import shutil
from collections.abc import Collection
from pathlib import Path

from pzd.schema.errors import FilesError

NEW = ".new"
"""Ending of what is being written; it is renamed once it is whole."""
OLD = ".old"
"""Ending of the old folder until the new one is in its place."""

log = logging.getLogger(__name__)


def hidden(folder: Path, name: str, ending: str) -> Path:
    """Where something is written, or waits, until it has its name."""
    return folder / f".{name}{ending}"


def clean_up(folder: Path, folders: Collection[str], files: Collection[str]) -> None:
    """Settle what a killed command left; what only looks like it is named and left.

    Parameters
    ----------
    folder : the folder of the run
    folders : names of the folders that are written there
    files : names of the files that are written there
    """
    for name in files:
        path = hidden(folder, name, NEW)
        if path.is_file() and not path.is_symlink():
            path.unlink()
    for name in folders:
        _settle(folder, name)
    for path in sorted(folder.glob(".*")):
        if path.suffix in (NEW, OLD):
            log.warning("%s: pzd did not write this, so it is left as it is; move it away if you do not need it", path)


def in_the_way(folder: Path, name: str) -> None:
    """Refuse to write a folder where something stands that is not ours.

    Raises
    ------
    FilesError : naming it
    """
    for path in (hidden(folder, name, NEW), hidden(folder, name, OLD)):
        if os.path.lexists(path):
            raise FilesError(f"{path}: this stands where {folder / name} is written, and is not of pzd; move it away")


def _settle(folder: Path, name: str) -> None:
    new, old, target = hidden(folder, name, NEW), hidden(folder, name, OLD), folder / name
    if _is_folder(new):
        shutil.rmtree(new)
    if _is_folder(old):
        if target.exists():
            shutil.rmtree(old)
        else:
            old.rename(target)


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()
