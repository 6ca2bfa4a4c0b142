"""What a command does with a config: run its stages as far as asked, or check it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pzd.artefacts import MountedDampers, RecordEntry, Rig
from pzd.config import RunConfig, check_settings, read_config, validated
from pzd.identification.stage import refuse_one_condition, refuse_partly_recorded
from pzd.parallel.processes import Listener, no_listener
from pzd.pipeline.dependencies import leaves
from pzd.pipeline.execution import Pipeline, Say
from pzd.pipeline.stages import LAST, Stage, stages
from pzd.quantities import Control
from pzd.runs import Run
from pzd.schema.errors import ConfigError
from pzd.schema.model import nearest
from pzd.schema.validate import canonical_nodes
from pzd.schema.yamlfile import Document
from pzd.schema.yamltree import Node

_SUFFIXES = (".yaml", ".yml", ".json")
"""Of a config; JSON is YAML too."""


@dataclass(frozen=True)
class Opened:
    """A config as a command was given it, and where its results stand."""

    document: Document
    config: RunConfig
    run: Run

    @contextmanager
    def placed(self) -> Iterator[None]:
        """Put file, line and column in front of a stage's complaint about the config."""
        try:
            yield
        except ConfigError as error:
            raise ConfigError(self._placed(message) for message in error.messages) from error

    def _placed(self, message: str) -> str:
        path, _, rest = message.partition(": ")
        if not re.fullmatch(r"\w+(\.\w+)*", path) or path.split(".")[0] not in RunConfig.model_fields:
            return message
        place = self.document.place(path.split("."), rest)
        return f"{place}: {rest}" if place == f"--set {path}" else f"{place}: {message}"


def opened(path: Path, runs: Path, overrides: Sequence[str] = ()) -> Opened:
    """Read a config and find its run.

    Parameters
    ----------
    path : the config
    runs : the folder of all runs
    overrides : any number of ``a.b=VALUE``

    Raises
    ------
    ConfigError : when the config is wrong, or its run belongs to another config
    """
    check_given(path)
    try:
        document = read_config(path, overrides)
        config = validated(document)
    except ConfigError as error:
        if path.suffix.lower() in _SUFFIXES:
            raise
        hint = f"{path}: is this a config? it would be a YAML file; pzd init prints one for files of a rig"
        raise ConfigError([*error.messages, hint]) from error
    return Opened(document, config, Run.of(path, runs, config.control.signal()))


def check_given(path: Path) -> None:
    """Check that a path given as a config is a file.

    Raises
    ------
    ConfigError : when it is a folder, or nothing is there, with the config that was most likely meant
    """
    if path.is_dir():
        owner = Run(path, path, Control()).config_of_results()
        hint = f"these are the results of {owner}; give {owner}" if owner else "this is a folder, a file is needed"
        raise ConfigError(f"{path}: {hint}")
    if not path.exists():
        beside = {one.stem: one for one in sorted(path.parent.glob("*")) if one.suffix.lower() in _SUFFIXES}
        near = nearest(path.stem, beside)
        hint = f"did you mean {beside[near]}?" if near else "check the path"
        raise ConfigError(f"{path}: the file is missing; {hint}")


def execute(
    given: Opened, target: str, *, force: bool, jobs: int, say: Say, progress: Listener = no_listener
) -> tuple[str, ...]:
    """Run every stage that is out of date, as far as a target.

    Parameters
    ----------
    given : config and run
    target : name of the last stage, or ``run`` for all
    force : run the target again although it is fresh; with ``run`` every stage
    jobs : processes that a stage may use
    say : takes a line about each stage
    progress : hears how far a stage has come

    Returns
    -------
    why the results are not to be trusted, a line a reason

    Raises
    ------
    UserError : what the user can mend
    """
    line = stages(given.config)
    last = LAST if target == "run" else target
    _right_source(line, last)
    forced = [stage.name for stage in line if target in ("run", stage.name)] if force else []
    if last == LAST:
        _check_reference(given)
    with given.placed(), given.run.locked(f"pzd {target}"):
        return Pipeline(given.config, given.run, line, say, progress, jobs).execute(last, forced)


def _check_reference(given: Opened) -> None:
    """Refuse a file of expected numbers that is at fault before anything runs, though only the report reads it."""
    if given.config.report.reference is not None:
        from pzd.report.reference import file_of, read_reference

        with given.placed():
            path = file_of(given.config.report.reference, given.run.config.parent)
        read_reference(path, given.run.control)


def _right_source(line: Sequence[Stage], target: str) -> None:
    if target == "simulate" and target not in [stage.name for stage in line]:
        raise ConfigError("pzd simulate: car: false leaves the rides out; take this key out of the config")
    if line[0].name == "table" and target not in [stage.name for stage in line]:
        raise ConfigError(f"pzd {target}: the config has damper and no rig, so the first command is pzd table")
    if target not in [stage.name for stage in line]:
        held = "rig.virtual" if line[0].name == "synthesise" else "rig.files"
        raise ConfigError(f"pzd {target}: the config has {held}, so the command is pzd {line[0].name}")


def stale_stages(given: Opened) -> dict[str, str]:
    """Why the results in a run are not those of the config as it is today, by stage; empty where they are."""
    return Pipeline(given.config, given.run, stages(given.config), lambda _: None).stale_stages()


def preflight(given: Opened) -> Rig:
    """Return the rig's records, what the preflight finds in them, and what was done to their files; written nowhere.

    Raises
    ------
    UserError : what a run would be refused for
    """
    first = stages(given.config)[0]
    _check_reference(given)
    with given.placed():
        made = Pipeline(given.config, given.run, (first,), lambda _: None).made(first)
        if not isinstance(made, Rig):
            return Rig((), ())
        refuse_one_condition(given.config.identify, made, given.run.control)
        refuse_partly_recorded(made, given.run.control)
    return made


def mounted_dampers(given: Opened) -> MountedDampers:
    """Return the dampers of a config without a rig, read and tabulated; written nowhere.

    Raises
    ------
    UserError : what a run would be refused for
    """
    _check_reference(given)
    (first, *_) = stages(given.config)
    with given.placed():
        made = Pipeline(given.config, given.run, (first,), lambda _: None).made(first)
    if not isinstance(made, MountedDampers):
        raise ConfigError(f"{given.run.config}: the config has a rig")
    return made


def check_roads(given: Opened) -> None:
    """Check that the roads of the config are there, can be read and are as long as the ride.

    Raises
    ------
    ConfigError : when one is not
    """
    from pzd.simulate.stage import profiles_of

    with given.placed():
        profiles_of(given.config.simulate, given.config.seed, given.run.config.parent)


def check_setting(given: Opened, entries: Sequence[RecordEntry]) -> None:
    """Check that the config says which setting of the rig's records the stages from diagnose on are about.

    Raises
    ------
    ConfigError : when there are several and it does not, none is the one it says, or one of the table lies beyond them
    """
    with given.placed():
        check_settings(given.config, [entry.setting for entry in entries])


# --- Every value of a config, with its origin: a line of the file, `--set`, or the default

DEFAULT = "default"
"""The origin of what neither the config nor the command line says."""


@dataclass(frozen=True)
class Resolved:
    """One value of a config."""

    path: str
    """Keys and indices, as `--set` takes them."""
    value: Any
    """A scalar, or an empty list or mapping."""
    origin: str
    """``file:line:column``, ``--set a.b``, or `default`."""


def resolved(given: Opened) -> tuple[Resolved, ...]:
    """Return the values of a config in the order of the reference, the control under its own name.

    Parameters
    ----------
    given : the config as a command was given it
    """
    control = given.run.control
    root = canonical_nodes(given.document.root, control)
    return tuple(
        Resolved(".".join(control.renamed(part) for part in path), value, _origin(root, path))
        for path, value in leaves(given.config.model_dump(mode="json"))
    )


def _origin(root: Node, path: tuple[str, ...]) -> str:
    """Where a value stands in a tree with canonical keys."""
    node = root
    for part in path:
        if isinstance(node.value, Mapping) and part in node.value:
            node = node.value[part].node
        elif isinstance(node.value, tuple) and part.isdecimal() and int(part) < len(node.value):
            node = node.value[int(part)]
        else:
            return DEFAULT
    return node.place
