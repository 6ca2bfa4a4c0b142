"""How runs/ is laid out and written: one folder a config, one folder a stage, whole or not at all.

A stage is written into a hidden folder beside its own, synced to disk and renamed, so that a
killed run leaves the old result or the new one. What a rename was interrupted in is settled
the next time the run is opened.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from pzd.artefacts import Artefact, Diagnosed, Identified, Manifest, MountedDampers, Report, Rides, Rig, Table
from pzd.quantities import Control
from pzd.runs.disk import (
    as_files_error,
    file_hash,
    locked,
    refuse_links,
    sync,
    sync_folder,
    versions,
    write_afresh,
)
from pzd.schema.errors import ConfigError, DataError, FilesError
from pzd.schema.validate import read_json, write_json

log = logging.getLogger(__name__)

Made = TypeVar("Made", Rig, Identified, Diagnosed, Table, MountedDampers, Rides, Report, Artefact)

MANIFEST = "manifest.json"
CONFIG = "config.yaml"
_CONFIG_HEAD = "# Written by pzd with every default. An output: edit the config itself. sha256 {digest}\n"
"""First line of the written config, with the hash of the rest: where it does not fit, somebody edited the file."""
_WRITTEN = ".written.json"
"""Hashes of what was written into a folder that is no stage and has no manifest."""
_FOLDERS = (
    *(kind.folder for kind in (Rig, Identified, Diagnosed, Table, Rides, Report)),
    "figures",
    "peers",
    "changes",
)
"""What a run's folder may hold."""
_WRITTEN_IN_PLACE = ("export", "sweep", "blind")
"""What it may hold beside them, where files are replaced one by one."""
_NAMES = Control()
"""Manifests name files and keys as they are, whatever the control is called."""
NEW = ".new"
"""Ending of what is being written; it is renamed once it is whole."""
OLD = ".old"
"""Ending of the old folder until the new one is in its place."""


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
        """Return the run of a config below a folder of runs.

        Raises
        ------
        ConfigError : when the folder holds the results of another config of the same stem, or the stem names none
        """
        if not config.stem.strip("."):
            raise ConfigError(f"{config}: the results would lie outside of a folder of their own; rename the config")
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
        """Return the config that the results are of, by the manifests; None where there are none."""
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
        """Return what stands in a stage's folder."""
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
        FilesError : when another command holds it, or the folder cannot be written, or a link stands in it
        """
        with locked(self.folder, command):
            refuse_links(self.folder / name for name in (*_FOLDERS, *_WRITTEN_IN_PLACE))
            with as_files_error(self.folder):
                clean_up(self.folder)
            yield

    def write_config(self, text: str) -> None:
        """Write the config with every default; one that somebody edited is kept under another name."""
        path, fresh = self.folder / CONFIG, hidden(self.folder, CONFIG, NEW)
        with as_files_error(path):
            whole = _CONFIG_HEAD.format(digest=_digest(text)) + text
            if path.exists() and path.read_bytes() == whole.encode():
                return
            write_afresh(fresh, whole.encode())
            sync(fresh)
            before = (
                "" if path.is_symlink() or not path.exists() else path.read_text(encoding="utf-8", errors="replace")
            )
            if before and not _as_written(before):
                _keep_edited(path, self.folder)
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
                self._keep_edits(name, fresh)
                sync_folder(fresh)
                old = hidden(self.folder, name, OLD)
                if target.exists():
                    target.rename(old)
                fresh.rename(target)
                sync(self.folder)
                shutil.rmtree(old, ignore_errors=True)
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

    def _keep_edits(self, name: str, fresh: Path) -> None:
        """Copy what a person left in a folder into the one that takes its place, edited results as NAME.edited-HASH."""
        target, written = self.folder / name, self._written(name)
        now = self.hashes(fresh.name) | {MANIFEST: "", _WRITTEN: ""}
        by_hand = self.hashes(name)
        if (target / MANIFEST).is_file() and self._manifest(name) is None:
            by_hand[MANIFEST] = file_hash(target / MANIFEST)  # one that cannot be read was edited
        by_hand = {file: digest for file, digest in by_hand.items() if digest not in (written.get(file), now.get(file))}
        edited = [file for file in by_hand if file in written or file in now]
        for file in by_hand.keys() - set(edited):
            (fresh / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(target / file, fresh / file)
        for file in edited:
            _keep_edited(target / file, fresh / Path(file).parent)


# --- Hand edits


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _as_written(text: str) -> bool:
    """Check a written config against the hash in its first line."""
    head, _, rest = text.partition("\n")
    return head.endswith(f"sha256 {_digest(rest)}")


def _keep_edited(path: Path, folder: Path) -> None:
    """Copy an edited result into a folder, under a name that its content gives: another edit never takes its place."""
    digest = file_hash(path)
    names = (f"{path.name}.edited-{digest[:length]}" for length in range(8, len(digest) + 1))
    free = next(folder / name for name in names if _is_free(folder / name, digest))
    free.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy2(path, free)


def _is_free(copy: Path, digest: str) -> bool:
    """Whether a copy can be written: nothing stands there, not even a link to nowhere, or the same content."""
    return not os.path.lexists(copy) or (not copy.is_symlink() and file_hash(copy) == digest)


# --- What a killed command left half done: finished, undone, or removed


def hidden(folder: Path, name: str, ending: str) -> Path:
    """Return where something is written, or waits, until it has its name."""
    return folder / f".{name}{ending}"


def clean_up(folder: Path) -> None:
    """Settle what a killed command left in the folder of a run; what only looks like it is reported and left."""
    config = hidden(folder, CONFIG, NEW)
    if config.is_file() and not config.is_symlink():
        config.unlink()
    for name in _FOLDERS:
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
    """Remove a half-written folder, and put the old one back where a command was killed between the two renames."""
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
