"""How runs/ is laid out and written: one folder a config, one folder a stage, whole or not at all.

A stage is written into a hidden folder beside its own, synced to disk and renamed, so that a
killed run leaves the old result or the new one. What a rename was interrupted in is settled
the next time the run is opened.
"""

from __future__ import annotations

import json
import logging
import os
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from pzd.artefacts import Artefact, Diagnosed, Identified, Manifest, Report, Rides, Rig, Table
from pzd.quantities import Control
from pzd.runs.disk import as_files_error, file_hash, locked, sync, sync_folder, versions
from pzd.schema.errors import ConfigError, DataError, FilesError
from pzd.schema.validate import read_json, write_json

# ----------------------------------------------------------------------------------------------------
# What a person wrote into a folder of results is kept when the results are written anew.


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


# ----------------------------------------------------------------------------------------------------
# What a command that was killed left half done in a run's folder: finished, undone, or removed.


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


# ----------------------------------------------------------------------------------------------------


Made = TypeVar("Made", Rig, Identified, Diagnosed, Table, Rides, Report, Artefact)

MANIFEST = "manifest.json"
CONFIG = "config.yaml"
_CONFIG_HASHES = ".config.sha256"
"""Hashes of the config as it was written, the last two times: a config with another one was edited by hand."""
_WRITTEN = ".written.json"
"""Hashes of what was written into a folder that is no stage and has no manifest."""
_FOLDERS = (*(kind.folder for kind in (Rig, Identified, Diagnosed, Table, Rides, Report)), "figures", "peers")
"""What a run's folder may hold."""
_NAMES = Control()
"""Manifests name files and keys as they are, whatever the control is called."""


@dataclass(frozen=True)
class StageFolder:
    """What stands in a stage's folder, against what its manifest says was written."""

    manifest: Manifest | None
    """None where the stage has not run, or its manifest cannot be read."""
    missing: tuple[str, ...] = ()
    """Files that were written and are gone."""
    edited: tuple[str, ...] = ()
    """Files that somebody changed since."""


@dataclass(frozen=True)
class Run:
    """The folder of one config's results."""

    folder: Path
    config: Path
    control: Control

    @classmethod
    def of(cls, config: Path, runs: Path, control: Control) -> Run:
        """The run of a config below a folder of runs.

        Raises
        ------
        ConfigError : when the folder holds the results of another config of the same stem
        """
        run = cls(runs / config.stem, config, control)
        for manifest in sorted(run.folder.glob(f"*/{MANIFEST}")):
            owner = run._owner(manifest.parent.name)
            if owner is not None and owner.exists() and owner != config.resolve():
                raise ConfigError(
                    f"{run.folder}: this folder holds the results of {owner}, and {config.resolve()} has the same "
                    "stem; rename one of them or give --runs another folder"
                )
        return run

    def config_of_results(self) -> Path | None:
        """The config that the results are of, by the manifests; None where there are none."""
        owners = (self._owner(manifest.parent.name) for manifest in sorted(self.folder.glob(f"*/{MANIFEST}")))
        owner = next((owner for owner in owners if owner is not None), None)
        return Path(os.path.relpath(owner)) if owner else None

    def _owner(self, stage: str) -> Path | None:
        manifest = self._manifest(stage)
        return (self.folder / manifest.config).resolve() if manifest else None

    def _manifest(self, stage: str) -> Manifest | None:
        try:
            return read_json(self.folder / stage / MANIFEST, Manifest, _NAMES)
        except DataError:
            return None

    # ------------------------------------------------------------ reading

    def hashes(self, stage: str) -> dict[str, str]:
        """Hash of every file of a stage, by its path in the stage's folder."""
        folder = self.folder / stage
        ours = (folder / MANIFEST, folder / _WRITTEN)
        files = (path for path in sorted(folder.rglob("*")) if path.is_file() and path not in ours)
        with as_files_error(folder):
            return {path.relative_to(folder).as_posix(): file_hash(path) for path in files}

    def outputs(self, stage: str) -> dict[str, str]:
        """Hash of every file that a stage wrote, as it is now; what somebody laid beside is left out."""
        manifest = self._manifest(stage)
        written = manifest.outputs if manifest else {}
        return {name: digest for name, digest in self.hashes(stage).items() if name in written}

    def stage_folder(self, stage: str) -> StageFolder:
        """What stands in a stage's folder."""
        manifest = self._manifest(stage)
        if manifest is None:
            return StageFolder(None)
        now = self.hashes(stage)
        return StageFolder(
            manifest,
            tuple(name for name in manifest.outputs if name not in now),
            tuple(name for name, digest in manifest.outputs.items() if now.get(name, digest) != digest),
        )

    def read(self, kind: type[Made], jobs: int = 1) -> Made:
        """Read an artefact of the run, checked; with so many files at the same time, where there are many.

        Raises
        ------
        DataError : when a file of it is missing or at fault, with every place
        """
        with as_files_error(self.folder / kind.folder):
            if issubclass(kind, Rig | Rides):
                return kind.read(self.folder / kind.folder, self.control, jobs)
            return kind.read(self.folder / kind.folder, self.control)

    # ------------------------------------------------------------ writing

    @contextmanager
    def locked(self, command: str) -> Iterator[None]:
        """Hold the run for one command, and settle what an earlier one was killed in.

        Raises
        ------
        FilesError : when another command holds it, or the folder cannot be written
        """
        with locked(self.folder, command):
            with as_files_error(self.folder):
                clean_up(self.folder, _FOLDERS, (CONFIG,))
            yield

    def write_config(self, text: str) -> None:
        """Write the config with every default, unless it is there; one edited by hand is kept under another name."""
        path, hashes = self.folder / CONFIG, self.folder / _CONFIG_HASHES
        with as_files_error(path):
            if path.exists() and path.read_bytes() == text.encode():
                return
            fresh = hidden(self.folder, CONFIG, NEW)
            fresh.write_text(text, encoding="utf-8", newline="\n")
            sync(fresh)
            written = hashes.read_text(encoding="utf-8").split() if hashes.exists() else []
            if path.exists() and (digest := file_hash(path)) not in written:
                free = free_name(self.folder, CONFIG, digest, {other.name for other in self.folder.iterdir()})
                if free is not None:
                    shutil.copy2(path, self.folder / free)
            # Killed before the rename, the old config still counts as ours; killed behind it, the new one does.
            hashes.write_text("\n".join([*written[-1:], file_hash(fresh)]) + "\n", encoding="utf-8")
            fresh.replace(path)

    def write(
        self,
        stage: str,
        artefact: Artefact,
        inputs: dict[str, str],
        key: str,
        marks: tuple[str, ...],
        seconds: float,
        jobs: int = 1,
    ) -> None:
        """Write a stage's artefact and manifest in place of what was there before.

        Parameters
        ----------
        stage : name of the stage
        artefact : what it made
        inputs : hash of everything that it depends on
        key : hash of them all
        marks : why the result is not to be trusted
        seconds : how long it took
        jobs : files written at the same time, where there are many

        Raises
        ------
        FilesError : when the disk does not take it; what was there before still is
        """

        def fill(fresh: Path) -> None:
            if isinstance(artefact, Rig | Rides):
                artefact.write(fresh, self.control, jobs)
            else:
                artefact.write(fresh, self.control)
            manifest = Manifest(
                stage=stage,
                key=key,
                config=Path(os.path.relpath(self.config.resolve(), self.folder.resolve())).as_posix(),
                inputs=inputs,
                outputs=self.hashes(fresh.name),
                versions=versions(),
                finished=datetime.now(UTC).isoformat(timespec="seconds"),
                seconds=round(seconds, 3),
                marks=marks,
            )
            write_json(fresh / MANIFEST, manifest, _NAMES)

        self._replace(artefact.folder, fill)

    def write_extra(self, folder: str, write: Callable[[Path], None]) -> None:
        """Write a folder that is no stage in place of what was there before, whole or not at all.

        Parameters
        ----------
        folder : its name beside the stages
        write : fills the empty folder that it is given

        Raises
        ------
        FilesError : when the disk does not take it; what was there before still is
        """

        def fill(fresh: Path) -> None:
            write(fresh)
            write_json(fresh / _WRITTEN, self.hashes(fresh.name), _NAMES)

        self._replace(folder, fill)

    def _replace(self, name: str, fill: Callable[[Path], None]) -> None:
        """Fill a folder and put it in place of the one of that name, with what a person left there."""
        target, fresh = self.folder / name, hidden(self.folder, name, NEW)
        made = False
        try:
            with as_files_error(target):
                in_the_way(self.folder, name)
                fresh.mkdir()
                made = True
                fill(fresh)
                now = self.hashes(fresh.name) | {MANIFEST: "", _WRITTEN: ""}
                carry_over(target, fresh, self._by_hand(name), self._written(name), now)
                sync_folder(fresh)
                self._swap(target, fresh)
        finally:
            if made:
                shutil.rmtree(fresh, ignore_errors=True)

    def _written(self, name: str) -> dict[str, str]:
        """Hash of every file that was written into a folder, as it was then; none where nobody can say."""
        if manifest := self._manifest(name):
            return manifest.outputs
        try:
            written = json.loads((self.folder / name / _WRITTEN).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return written if isinstance(written, dict) else {}

    def _by_hand(self, name: str) -> dict[str, str]:
        """Hash of every file that a person may have written; a manifest that cannot be read is one."""
        manifest = self.folder / name / MANIFEST
        broken = manifest.is_file() and self._manifest(name) is None
        return self.hashes(name) | ({MANIFEST: file_hash(manifest)} if broken else {})

    def _swap(self, target: Path, fresh: Path) -> None:
        old = hidden(self.folder, target.name, OLD)
        if target.exists():
            target.rename(old)
        fresh.rename(target)
        sync(self.folder)
        shutil.rmtree(old, ignore_errors=True)
