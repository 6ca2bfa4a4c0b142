"""What a person wrote into a folder of results is kept when the results are written anew."""

from __future__ import annotations

import shutil
from collections.abc import Collection, Mapping
from pathlib import Path

from pzd.runs.disk import file_hash


def carry_over(
    target: Path, fresh: Path, files: Mapping[str, str], before: Mapping[str, str], now: Mapping[str, str]
) -> None:
    """Copy what a person left in a folder into the one that takes its place.

    Files of their own keep their names. A file that they edited, or that stands where a result is
    written now, is laid beside the result as ``NAME.edited``, ``NAME.edited-2`` and so on.

    Parameters
    ----------
    target : the folder as it is
    fresh : the folder that takes its place
    files : hash of every file in `target`, by its path in the folder
    before : hash of every file that was written into `target`
    now : hash of every file that was written into `fresh`
    """
    for name, digest in files.items():
        if digest in (before.get(name), now.get(name)):
            continue
        if name not in before and name not in now:
            _copy(target / name, fresh / name)
        elif (free := free_name(target, name, digest, {*files, *now})) is not None:
            _copy(target / name, fresh / free)


def free_name(folder: Path, name: str, digest: str, taken: Collection[str]) -> str | None:
    """The name under which an edited file is kept; None where it is kept already.

    Parameters
    ----------
    folder : where the edited copies so far stand
    name : of the edited file
    digest : its hash
    taken : names that are in use
    """
    number = 1
    while True:
        free = f"{name}.edited" if number == 1 else f"{name}.edited-{number}"
        if free not in taken:
            return free
        if (folder / free).is_file() and file_hash(folder / free) == digest:
            return None
        number += 1


def _copy(source: Path, goal: Path) -> None:
    goal.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy2(source, goal)
