"""`pzd changes`: two states from their configs, compared, and the files that tell of it."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pzd.artefacts import Diagnosed, Identified, Rig
from pzd.config import setting_in_use
from pzd.diagnosis.changes.comparison import Compared, changes_between
from pzd.diagnosis.changes.over import Followed, blocks_of_cycles, followed_over
from pzd.diagnosis.changes.state import State, diagnosed_state, with_adopted
from pzd.identification.stage import identify
from pzd.pipeline.command import Opened, execute
from pzd.pipeline.dependencies import setting_of as setting_of_run
from pzd.pipeline.execution import Say
from pzd.rig.files.reading import listed
from pzd.rig.files.sniffing import setting_of
from pzd.runs import Run
from pzd.schema.errors import ConfigError

FOLDER = "changes"
"""Of a run, with a JSON and a page for each pair of states."""
CYCLES = "cycles"
"""In the place of settings: the cycles of the tests are the states."""


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
                return setting_of_run(self.given.config, self.given.run)
        return self._among([entry.setting for entry in self.given.run.read(Rig).entries], option)

    def check(self, option: str) -> None:
        """Refuse a setting that the config and the names of its files have not, before anything runs.

        Raises
        ------
        ConfigError : when there is none of that name
        """
        told = _settings_told(self.given)
        if self.setting is not None and told is not None:
            self._among(told, option)

    def _among(self, settings: Sequence[str | None], option: str) -> str | None:
        try:
            return setting_in_use(self.setting, settings)
        except ConfigError as error:
            raise ConfigError(f"{option}: {message.partition(': ')[2]}" for message in error.messages) from error


def _settings_told(given: Opened) -> list[str | None] | None:
    """Return the settings that the config and the names of its files tell; None where only reading them does."""
    rig = given.config.rig
    if rig is None:
        return None
    if rig.virtual is not None:
        return [entry.setting for entry in rig.virtual]
    files = rig.files or ()
    if any(entry.layout is not None or entry.preamble is not None for entry in files):
        return None
    with given.placed():
        found = listed(files, given.run.config.parent)
    return [setting_of(one.entry.pattern, one.path) or one.entry.setting for one in found]


def compare_states(before: Named, after: Named, jobs: int, say: Say) -> Compared:
    """Bring rig and identify of both states up to date, and diagnose of the first, and compare them.

    Of a setting that is not the one in use the diagnosis is made in memory.

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
    before.check("--from")
    after.check("--to")
    for given in {id(each): each for each in (one, other)}.values():
        execute(given, "identify", force=False, jobs=jobs, say=say)
    settings = before.chosen("--from"), after.chosen("--to")
    if one.run.config == other.run.config and settings[0] == settings[1]:
        raise ConfigError("--from and --to name the same records; name two settings, or two configs")
    names = [
        setting if one.run.config == other.run.config and setting is not None else given.run.config.stem
        for given, setting in zip((one, other), settings, strict=True)
    ]
    with one.placed():
        first = _first_state(one, names[0], settings[0], jobs, say)
    with other.placed():
        second = _state(other, names[1], settings[1], jobs)
        say(f"changes    runs: {names[0]} and {names[1]} are compared")
        config = other.config
        return changes_between(first, second, config.diagnose, config.identify, other.run.control)


def follow_states(given: Opened, over: str, jobs: int, say: Say) -> Followed:
    """Follow each quantity over several settings of a config, or over the cycles of its tests.

    Parameters
    ----------
    given : the config
    over : settings with commas between, or `cycles`
    jobs : processes that a stage may use
    say : takes a line about each stage

    Raises
    ------
    ConfigError : when fewer than two settings are named, or one is not among those of the rig
    """
    names = [name.strip() for name in over.split(",") if name.strip()]
    cut = names == [CYCLES]
    if len(set(names)) < max(len(names), 2) and not cut:
        raise ConfigError(f"--over: needs two settings or more, each once, or `{CYCLES}` (got {over})")
    for name in () if cut else names:
        Named(given, name).check("--over")
    execute(given, "identify", force=False, jobs=jobs, say=say)
    config, control = given.config, given.run.control
    with given.placed():
        if cut:
            states = _blocks(given, jobs)
        else:
            settings = [Named(given, name).chosen("--over") for name in names]
            first = _first_state(given, names[0], settings[0], jobs, say)
            pairs = zip(names[1:], settings[1:], strict=True)
            states = [first, *(_state(given, name, setting, jobs) for name, setting in pairs)]
        say(f"changes    runs: {len(states) - 1} states are compared with {states[0].name}")
        return followed_over(states, config.diagnose, config.identify, config.changes, control)


def _blocks(given: Opened, jobs: int) -> list[State]:
    """Return the states that blocks of cycles are, the first identified and diagnosed by itself."""
    config, control = given.config, given.run.control
    setting = Named(given, None).chosen("--over")
    blocks = blocks_of_cycles(given.run.read(Rig, jobs), setting)
    (name, rig), *_ = blocks
    identified = identify(config.identify, rig, jobs)
    first = diagnosed_state(
        State.of(name, rig, identified, setting, control),
        rig, identified, setting, config.diagnose, config.identify, config.measured_rig, control, jobs,
    )  # fmt: skip
    return [first, *(State.of(name, rig, identified, setting, control) for name, rig in blocks[1:])]


def _state(given: Opened, name: str, setting: str | None, jobs: int) -> State:
    """Return a state with the damper that identify found."""
    rig, identified = given.run.read(Rig, jobs), given.run.read(Identified)
    return State.of(name, rig, identified, setting, given.run.control)


def _is_in_use(given: Opened, setting: str | None) -> bool:
    """Whether a setting is the one that diagnose is about; of several none is, where the config names none."""
    try:
        return setting_of_run(given.config, given.run) == setting
    except ConfigError:
        return False


def _first_state(given: Opened, name: str, setting: str | None, jobs: int, say: Say) -> State:
    """Return a state with the damper that diagnose adopts, by its stage where that is about this setting."""
    state, config, control = _state(given, name, setting, jobs), given.config, given.run.control
    if _is_in_use(given, setting):
        execute(given, "diagnose", force=False, jobs=jobs, say=say)
        return with_adopted(state, given.run.read(Diagnosed))
    say(f"diagnose   runs in memory: {setting} is not the setting in use")
    rig, identified = given.run.read(Rig, jobs), given.run.read(Identified)
    return diagnosed_state(
        state, rig, identified, setting, config.diagnose, config.identify, config.measured_rig, control, jobs
    )


def write_comparison(run: Run, folder: str, name: str, files: dict[str, Callable[[Path], None]]) -> Path:
    """Write the files of one comparison beside those of others.

    Parameters
    ----------
    run : in whose folder they shall stand
    folder : for comparisons of their kind
    name : of the comparison
    files : by their ending, what writes each

    Returns
    -------
    the folder
    """

    def fill(fresh: Path) -> None:
        for there in sorted((run.folder / folder).glob("*")):
            if there.is_file() and not there.name.startswith("."):
                shutil.copy2(there, fresh / there.name)
        for ending, write in files.items():
            write(fresh / f"{name}.{ending}")

    run.write_extra(folder, fill)
    return run.folder / folder


def comparison_name(*names: str, between: str = "--to--") -> str:
    """Return the name of the files of a comparison.

    >>> comparison_name("gap 0.15 mm", "aged")
    'gap_0.15_mm--to--aged'
    """
    return between.join(re.sub(r"[^A-Za-z0-9._-]", "_", each) for each in names)
