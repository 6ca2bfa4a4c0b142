"""`pzd changes`: two states from their configs, compared, and the files that tell of it."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pzd.artefacts import Identified, Rig
from pzd.config import setting_in_use
from pzd.diagnosis.changes.comparison import Compared, changes_between
from pzd.diagnosis.changes.state import State, diagnosed_state
from pzd.pipeline.command import Opened, execute
from pzd.pipeline.dependencies import setting_of
from pzd.pipeline.execution import Say
from pzd.runs import Run
from pzd.schema.errors import ConfigError

FOLDER = "changes"
"""Of a run, with a JSON and a page for each pair of states."""


@dataclass(frozen=True)
class Named:
    """One state as a command names it."""

    given: Opened
    setting: str | None
    """Of the config's rig; None for the one in use."""

    def chosen(self, option: str) -> str | None:
        """Return the setting whose records it is.

        Raises
        ------
        ConfigError : when there is none of that name
        """
        if self.setting is None:
            with self.given.placed():
                return setting_of(self.given.config, self.given.run)
        entries = self.given.run.read(Rig).entries
        try:
            return setting_in_use(self.setting, [entry.setting for entry in entries])
        except ConfigError as error:
            raise ConfigError(f"{option}: {message.partition(': ')[2]}" for message in error.messages) from error


def compare_states(before: Named, after: Named, jobs: int, say: Say) -> Compared:
    """Bring rig and identify of both states up to date, diagnose the first in memory, and compare them.

    Raises
    ------
    ConfigError : when both are the same records, or the control signals differ
    """
    one, other = before.given, after.given
    if one.run.control != other.run.control:
        raise ConfigError(
            f"{other.run.config}: control: must be that of {one.run.config}, {one.run.control.name} in "
            f"{one.run.control.unit} (got {other.run.control.name} in {other.run.control.unit})"
        )
    for given in {id(each): each for each in (one, other)}.values():
        execute(given, "identify", force=False, jobs=jobs, say=say)
    settings = before.chosen("--from"), after.chosen("--to")
    if one.run.config == other.run.config and settings[0] == settings[1]:
        raise ConfigError("--from and --to name the same records; name two settings, or two configs")
    names = [
        setting if one.run.config == other.run.config and setting is not None else given.run.config.stem
        for given, setting in zip((one, other), settings, strict=True)
    ]
    with other.placed():
        first = _state(one, names[0], settings[0], jobs, diagnosed=True)
        second = _state(other, names[1], settings[1], jobs, diagnosed=False)
        config = other.config
        return changes_between(first, second, config.diagnose, config.identify, other.run.control)


def _state(given: Opened, name: str, setting: str | None, jobs: int, *, diagnosed: bool) -> State:
    rig, identified, config = given.run.read(Rig, jobs), given.run.read(Identified), given.config
    state = State.of(name, rig, identified, setting, given.run.control)
    if not diagnosed:
        return state
    return diagnosed_state(
        state, rig, identified, setting, config.diagnose, config.identify, config.rig, given.run.control, jobs
    )


def write_changes(run: Run, name: str, files: dict[str, Callable[[Path], None]]) -> Path:
    """Write the files of one comparison beside those of others.

    Parameters
    ----------
    run : of the second state
    name : of the comparison
    files : by their ending, what writes each

    Returns
    -------
    the folder
    """

    def fill(fresh: Path) -> None:
        for there in sorted((run.folder / FOLDER).glob("*")):
            if there.is_file() and not there.name.startswith("."):
                shutil.copy2(there, fresh / there.name)
        for ending, write in files.items():
            write(fresh / f"{name}.{ending}")

    run.write_extra(FOLDER, fill)
    return run.folder / FOLDER


def comparison_name(before: str, after: str) -> str:
    """Return the name of the files of a comparison.

    >>> comparison_name("gap 0.15 mm", "aged")
    'gap_0.15_mm--aged'
    """
    return "--".join(re.sub(r"[^A-Za-z0-9._-]", "_", each) for each in (before, after))
