"""All runs of a sweep in chunks, each written when it is done, so that a sweep that was stopped goes on."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

from pzd.artefacts import Diagnosed
from pzd.config import SweepConfig
from pzd.parallel.chunks import ChunkedWork
from pzd.parallel.config import HOW
from pzd.parallel.engines import Where
from pzd.parallel.processes import Listener, Progress, no_listener
from pzd.pipeline.dependencies import code_hash
from pzd.quantities import Control
from pzd.runs import file_hash
from pzd.runs.disk import refuse_links_below
from pzd.schema.errors import ConfigError, DataError
from pzd.schema.validate import read_json_list, write_json
from pzd.sweep.gather import Results, decisive, page, write
from pzd.sweep.task import BaseRun, RunResult, Task, check_scatter, config_of, outcomes, shared_stages, tasks

FOLDER = "sweep"
"""Folder of a sweep, beside the stages of the run."""
_MADE_FROM = "made_from.sha256"
_MOST_PRINTED = 5
"""Failures that are printed; failed.csv holds all."""
_EXECUTION_KEYS = HOW | {"chunk"}
"""Keys of the block that change nothing of the results."""
_AHEAD = 4
"""Chunks that wait at each worker: enough that none is idle, few enough that little is lost when it is stopped."""


@dataclass(frozen=True)
class SweepRuns:
    """The runs of a sweep, and the folder of their results."""

    base: BaseRun
    sweep: SweepConfig
    tasks: tuple[Task, ...]
    progress: Listener = no_listener
    """Is called with every chunk that is done."""

    @classmethod
    def of(cls, base: BaseRun, progress: Listener = no_listener) -> SweepRuns:
        """Plan the sweep of a config.

        Raises
        ------
        ConfigError : when the config has no block `sweep`, or no car that could be ridden
        """
        config = base.opened.config
        if config.sweep is None:
            raise ConfigError("sweep: the config has no such block; configs/sweep.yaml is an example")
        if config.sweep.until == "simulate" and not config.car:
            raise ConfigError("sweep.until: car: false leaves the rides out; say until: diagnose, or car: true")
        return cls(base, config.sweep, tasks(config.sweep, config.seed), progress)

    @property
    def folder(self) -> Path:
        """Folder of the results."""
        return self.base.opened.run.folder / FOLDER

    @property
    def control(self) -> Control:
        """The control signal."""
        return self.base.opened.run.control

    @cached_property
    def chunks(self) -> tuple[tuple[Task, ...], ...]:
        """The runs, chunk by chunk."""
        size = self.sweep.chunk
        return tuple(self.tasks[first : first + size] for first in range(0, len(self.tasks), size))

    def last_shared_stage(self) -> str | None:
        """Return the last stage that is the same in all runs; None where already the records differ.

        Raises
        ------
        ConfigError : when a value is wrong, with every place
        """
        once: dict[tuple[str, object], Task] = {}
        for task in self.tasks:
            for key, value in task.over:
                once.setdefault((key, value), task)
        ends = [*self.tasks[:1], *once.values()]
        for key in self.sweep.drawn:
            drawn = sorted(self.tasks, key=lambda task: dict(task.drawn)[key])
            ends += [drawn[0], drawn[-1]]
        faults: list[str] = []
        for task in ends:
            try:
                config_of(self.base.opened, task)
            except ConfigError as error:
                faults += error.messages
        if faults:
            raise ConfigError(dict.fromkeys(faults))
        shared = [stage.name for stage in shared_stages(self.base.opened, ends)]
        wanted = {"identify": 2, "diagnose": 3, "simulate": 4}[self.sweep.until]
        return shared[min(len(shared), wanted) - 1] if shared else None

    def check(self) -> None:
        """Check that the adopted damper has what is to scatter: before any run, where all share its diagnosis.

        Raises
        ------
        ConfigError : when it has no such parameter
        DataError : when the tests leave no interval for one
        """
        if self.sweep.damper:
            check_scatter(self.sweep.damper, self.base.opened.run.read(Diagnosed))

    def gather(self, found: Sequence[RunResult], name: str) -> list[str]:
        """Write the tables and the page, and return the lines to print.

        Parameters
        ----------
        found : result of every run
        name : of the config
        """
        results = Results(self.sweep, self.tasks, tuple(found), self.base.opened.config.seed)
        write(results, self.folder, self.control)
        path = self.folder / "sweep.html"
        path.write_text(page(results, f"Sweep: {name}"), encoding="utf-8", newline="\n")
        lines = [f"{len(self.tasks)} runs, {len(results.failed)} without a result"]
        lines += [f"failed: {row.differs_in}: {row.failure}" for row in results.failed[:_MOST_PRINTED]]
        lines += decisive(results)
        return [*lines, f"tables and page: {self.folder}"]

    def run(self, jobs: int, *, afresh: bool = False) -> tuple[RunResult, ...]:
        """Do every run that is not done, and return the results of all in order.

        A chunk that stands there finished, made from the same config, records and code, is not done again.

        Parameters
        ----------
        jobs : processes of this machine
        afresh : whether everything is done again
        """
        self._prepare(afresh=afresh)
        waiting = [chunk for chunk in self.chunks if self._stored(chunk) is None]
        done = len(self.chunks) - len(waiting)

        def store(chunk: Sequence[Task], found: Sequence[RunResult]) -> None:
            nonlocal done
            self._store(chunk, found)
            done += 1
            self.progress(Progress(done, len(self.chunks), f"chunks of {self.sweep.chunk} runs"))

        where = Where(self.sweep, FOLDER, self.base.config.parent, self.folder / "slurm")
        ChunkedWork((partial(outcomes, self.base.absolute),), store, _lost, where, _AHEAD).do(waiting, jobs)
        return tuple(outcome for chunk in self.chunks for outcome in self._stored(chunk) or ())

    def finished(self) -> tuple[RunResult, ...]:
        """Return the results of the runs that are done."""
        if not self._is_of_this_config():
            return ()
        return tuple(outcome for chunk in self.chunks for outcome in self._stored(chunk) or ())

    def seconds_a_chunk(self) -> float | None:
        """Return how long a chunk took, by the times of its files [s]; None with fewer than two."""
        times = sorted(path.stat().st_mtime for path in self._chunks_folder.glob("*.json"))
        return (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else None

    @property
    def _chunks_folder(self) -> Path:
        return self.folder / "chunks"

    def _path(self, chunk: Sequence[Task]) -> Path:
        return self._chunks_folder / f"{chunk[0].number:06d}-{chunk[-1].number:06d}.json"

    def _stored(self, chunk: Sequence[Task]) -> tuple[RunResult, ...] | None:
        path = self._path(chunk)
        if not path.exists():
            return None
        with suppress(DataError):
            found = read_json_list(path, RunResult, self.control)
            if [outcome.task for outcome in found] == [task.number for task in chunk]:
                return found
        return None

    def _store(self, chunk: Sequence[Task], found: Sequence[RunResult]) -> None:
        path = self._path(chunk)
        fresh = path.with_suffix(".new")  # a chunk is there whole or not at all
        write_json(fresh, found, self.control)
        fresh.replace(path)

    def _prepare(self, *, afresh: bool) -> None:
        """Remove what was made from another config, from other records or by other code."""
        refuse_links_below(self.folder)
        if afresh or not self._is_of_this_config():
            shutil.rmtree(self._chunks_folder, ignore_errors=True)
        self._chunks_folder.mkdir(parents=True, exist_ok=True)
        (self.folder / _MADE_FROM).write_text(self._made_from() + "\n", encoding="utf-8")

    def _is_of_this_config(self) -> bool:
        path = self.folder / _MADE_FROM
        return path.exists() and path.read_text(encoding="utf-8").strip() == self._made_from()

    def _made_from(self) -> str:
        """Compute the hash of all that the results depend on."""
        given = self.base.opened
        blocks = given.config.model_dump(mode="json")
        blocks["sweep"] = {key: value for key, value in blocks["sweep"].items() if key not in _EXECUTION_KEYS}
        files = {
            f"{path.parent.name}/{path.name}": file_hash(path)
            for folder in ("1-rig", "2-identify", "3-diagnose", "4-table")
            for path in sorted((given.run.folder / folder).glob("*"))
            if path.is_file() and path.name != "manifest.json"
        }
        return hashlib.sha256(json.dumps([blocks, files, code_hash("pzd.sweep.task")]).encode()).hexdigest()


def _lost(task: Task, step: int, reason: str) -> RunResult:
    return RunResult(task=task.number, failure=reason)
