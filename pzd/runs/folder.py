"""How runs/ is laid out and written: one folder a config, one folder a stage, whole or not at all.

A stage is written into a hidden folder beside its own, synced to disk and renamed, so that a
killed run leaves the old result or the new one. What a rename was interrupted in is settled
the next time the run is opened.
"""

from __future__ import annotations

import os
import platform
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from pzd.artefacts import Artefact, Diagnosed, Identified, Manifest, Report, Rides, Rig, Table
from pzd.quantities import Control
from pzd.runs.disk import as_files_error, file_hash, sync, sync_folder, versions
from pzd.schema.errors import ConfigError, DataError, FilesError
from pzd.schema.jsonfile import read_json, write_json

Made = TypeVar("Made", Rig, Identified, Diagnosed, Table, Rides, Report, Artefact)

MANIFEST = "manifest.json"
CONFIG = "config.yaml"
_LOCK = ".lock"
PATIENCE = 2.0
"""How long to wait for another command on the same run [s]."""
_NAMES = Control()
"""Manifests name files and keys as they are, whatever the control is called."""


@dataclass(frozen=True)
class Kept:
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
                    f"{run.folder}: the results of {owner} stand here, and {config.resolve()} has the same stem; "
                    "rename one of them or give --runs another folder"
                )
        return run

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
        files = (path for path in sorted(folder.rglob("*")) if path.is_file() and path.name != MANIFEST)
        with as_files_error(folder):
            return {path.relative_to(folder).as_posix(): file_hash(path) for path in files}

    def outputs(self, stage: str) -> dict[str, str]:
        """Hash of every file that a stage wrote, as it is now; what somebody laid beside is left out."""
        manifest = self._manifest(stage)
        written = manifest.outputs if manifest else {}
        return {name: digest for name, digest in self.hashes(stage).items() if name in written}

    def kept(self, stage: str) -> Kept:
        """What stands in a stage's folder."""
        manifest = self._manifest(stage)
        if manifest is None:
            return Kept(None)
        now = self.hashes(stage)
        return Kept(
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
        from filelock import FileLock, Timeout

        holder = self.folder / ".holder"
        with as_files_error(self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
            lock = FileLock(self.folder / _LOCK)
            try:
                lock.acquire(timeout=PATIENCE)
            except Timeout:
                who = holder.read_text(encoding="utf-8") if holder.exists() else "another command"
                raise FilesError(
                    f"{self.folder}: {who} is writing here; wait for it, or give --runs another folder"
                ) from None
        try:
            with as_files_error(self.folder):
                started = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
                holder.write_text(
                    f"{command} (process {os.getpid()} on {platform.node()}, since {started})", encoding="utf-8"
                )
                self._settle()
            yield
        finally:
            holder.unlink(missing_ok=True)
            self._leave_nothing_for_nothing()
            lock.release()

    def _leave_nothing_for_nothing(self) -> None:
        """Take the folder away again where a first run came to no result."""
        if [path.name for path in self.folder.iterdir()] == [_LOCK]:
            (self.folder / _LOCK).unlink()
            self.folder.rmdir()
            with suppress(OSError):
                self.folder.parent.rmdir()

    def _settle(self) -> None:
        for leftover in self.folder.glob(".*.new"):
            shutil.rmtree(leftover)
        for old in self.folder.glob(".*.old"):
            stage = self.folder / old.name[1 : -len(".old")]
            if stage.exists():
                shutil.rmtree(old)
            else:
                old.rename(stage)

    def write_config(self, text: str) -> None:
        """Write the config with every default, unless it stands there already."""
        path = self.folder / CONFIG
        with as_files_error(path):
            if path.exists() and path.read_bytes() == text.encode():
                return
            fresh = self.folder / f".{CONFIG}.new"
            fresh.write_text(text, encoding="utf-8", newline="\n")
            sync(fresh)
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
        target = self.folder / artefact.folder
        fresh = self.folder / f".{artefact.folder}.new"
        try:
            with as_files_error(target):
                fresh.mkdir()
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
                self._carry_over(target, fresh, manifest)
                sync_folder(fresh)
                self._swap(target, fresh)
        finally:
            shutil.rmtree(fresh, ignore_errors=True)

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
        target, fresh = self.folder / folder, self.folder / f".{folder}.new"
        try:
            with as_files_error(target):
                fresh.mkdir()
                write(fresh)
                sync_folder(fresh)
                self._swap(target, fresh)
        finally:
            shutil.rmtree(fresh, ignore_errors=True)

    def _carry_over(self, target: Path, fresh: Path, manifest: Manifest) -> None:
        """Keep what a person left in the folder: files of their own, and edited ones beside the new."""
        before = self._manifest(target.name)
        for name, digest in self.hashes(target.name).items() if before else ():
            if before is not None and name in before.outputs:
                by_hand = digest not in (before.outputs[name], manifest.outputs.get(name))
                goal = fresh / f"{name}.edited"
            else:
                by_hand, goal = name not in manifest.outputs, fresh / name
            if by_hand:
                goal.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(target / name, goal)

    def _swap(self, target: Path, fresh: Path) -> None:
        old = self.folder / f".{target.name}.old"
        if target.exists():
            target.rename(old)
        fresh.rename(target)
        sync(self.folder)
        shutil.rmtree(old, ignore_errors=True)
