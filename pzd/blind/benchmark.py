"""Runs the cases: each is drawn, then diagnosed, on any engine; on this machine by processes that do one of the two.

The truth is opened last, when the score is taken. Each worker has one case at a time, so that the seconds of a
diagnosis are its own. A ledger says which seeds were scored with which code: a seed is fresh once, so that no rule is
chosen on what it is scored on.
"""

from __future__ import annotations

import shutil
import time
import traceback
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from pzd.blind.case import COST, CaseFiles, Cost, Scored
from pzd.blind.config import BlindConfig
from pzd.blind.hide import BenchmarkSetup, hide
from pzd.blind.plan import PlannedCase, plan
from pzd.blind.score import score_case
from pzd.diagnosis.config import DiagnoseConfig
from pzd.identification.config import IdentifyConfig
from pzd.parallel.chunks import ChunkedWork
from pzd.parallel.engines import Where
from pzd.parallel.processes import Listener, Progress, no_listener
from pzd.quantities import Control
from pzd.rig.config import FilesEntry, Limits, RigConfig
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.errors import ConfigError, DataError
from pzd.schema.model import Frozen
from pzd.schema.validate import read_json, write_json

# --- The diagnosis of a case, from its rig files alone ---


@dataclass(frozen=True)
class Methods:
    """How a case is diagnosed: the config's ordinary blocks."""

    identify: IdentifyConfig
    diagnose: DiagnoseConfig
    limits: Limits
    """Of the stand."""
    control: Control
    seed: int
    """Of the evolutionary search, where identify uses it."""


def diagnose_case(methods: Methods, folder: Path) -> None:
    """Run ingest, identify and diagnose on the files of `folder`/rig, and write the diagnosis into `folder`.

    An error is written down as the failure of the case.

    Parameters
    ----------
    methods : how
    folder : holds the rig files and nothing else
    """
    begun = time.perf_counter()
    diagnose_seconds, failure = 0.0, None
    try:
        diagnose_seconds = _diagnose(methods, folder)
    except Exception as error:  # noqa: BLE001  # whatever fails counts against the diagnosis
        last = traceback.extract_tb(error.__traceback__)[-1]
        message = "".join(traceback.format_exception_only(error)).strip()
        failure = f"{message} ({Path(last.filename).name}:{last.lineno})"
    cost = Cost(
        seconds=round(time.perf_counter() - begun, 3),
        diagnose_seconds=round(diagnose_seconds, 3),
        peak_memory_MB=round(_peak_memory(), 1),
        failure=failure,
    )
    write_json(folder / COST, cost, methods.control)


def _diagnose(methods: Methods, folder: Path) -> float:
    """Write the diagnosis, and return the seconds that diagnose took."""
    from pzd.diagnosis.stage import diagnose
    from pzd.identification.stage import identify
    from pzd.rig.stage import ingest

    config = RigConfig(files=(FilesEntry(path="rig/*.csv"),), limits=methods.limits)
    rig = ingest(config, methods.control, folder)
    identified = identify(methods.identify, rig, methods.seed)
    begun = time.perf_counter()
    diagnosed = diagnose(methods.diagnose, methods.identify, config, rig, identified, methods.control, None, jobs=1)
    seconds = time.perf_counter() - begun
    diagnosed.write(folder, methods.control)
    return seconds


def _peak_memory() -> float:
    """Return the largest memory of this process so far [MB]; 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0.0
    import sys

    unit = 1e-6 if sys.platform == "darwin" else 1024e-6  # bytes there, kilobytes elsewhere
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


# --- The ledger of scored seeds ---


class ScoredSeed(Frozen):
    """One scored run."""

    seed: int
    generator: str
    made_from: str
    """Hash of the config and the code; empty where it was not written down."""
    cases: int
    date: str
    """The day on which it began, in UTC (ISO 8601)."""


def read_ledger(path: Path) -> tuple[ScoredSeed, ...]:
    """Read every scored run of a ledger; none where there is no such file."""
    return read_rows(path, ScoredSeed, Control()) if path.is_file() else ()


def enter(path: Path, run: ScoredSeed) -> None:
    """Enter a scored run before its first case is drawn, so that one that is stopped uses its seed up as well.

    Parameters
    ----------
    path : the ledger
    run : the run that begins

    Raises
    ------
    ConfigError : when the ledger holds the seed for another config or other code
    """
    known = read_ledger(path)
    same = [one for one in known if (one.seed, one.generator) == (run.seed, run.generator)]
    if other := next((one for one in same if one.made_from != run.made_from), None):
        raise ConfigError(
            f"blind.seed: seed {run.seed} was scored with another config or other code on {other.date} ({path}); "
            "take one that is not in this ledger, or one of tuned_on with tuning: true"
        )
    if all(one.cases < run.cases for one in same):
        write_rows(path, ScoredSeed, [*known, run], Control())


# --- All cases ---


@dataclass(frozen=True)
class Benchmark:
    """The cases of a config, how they are diagnosed, and where their files go."""

    setup: BenchmarkSetup
    methods: Methods
    files: CaseFiles
    made_from: str
    """Hash of everything that a case depends on but its number: cases with another one are done again."""
    where: Where
    """Engine that draws and diagnoses the cases."""
    progress: Listener = no_listener
    """Is called after every finished case."""
    undrawn: dict[str, str] = field(default_factory=dict)
    """Why a case could not be drawn, by its id; filled by `run`."""

    def run(self, jobs: int, *, afresh: bool = False) -> tuple[Scored, ...]:
        """Score every case but those that could not be drawn; finished ones are not done again.

        Parameters
        ----------
        jobs : processes that work at a time
        afresh : do the finished ones again as well
        """
        cases = plan(self.setup.blind)
        done = {} if afresh else self.finished(cases)
        waiting = [case for case in cases if case.id not in done]
        if waiting:
            self._remove_files(waiting)
            done |= self._score(waiting, len(cases), jobs)
        return tuple(done[case.id] for case in cases if case.id in done)

    def finished(self, cases: Iterable[PlannedCase]) -> dict[str, Scored]:
        """Read the scores that were made from the same config and code."""
        found = {}
        for case in cases:
            with suppress(DataError):
                score = read_json(self.files.scored(case.id), Scored, self.setup.control)
                if score.made_from == self.made_from:
                    found[case.id] = score
        return found

    def _remove_files(self, waiting: Iterable[PlannedCase]) -> None:
        """Remove what an earlier run left of the cases."""
        for case in waiting:
            shutil.rmtree(self.files.case(case.id), ignore_errors=True)
            for path in (self.files.truth(case.id), self.files.noise_free(case.id), self.files.scored(case.id)):
                path.unlink(missing_ok=True)

    def _score(self, waiting: list[PlannedCase], whole: int, jobs: int) -> dict[str, Scored]:
        begun = time.monotonic()
        scores: dict[str, Scored] = {}
        keep_files = self.setup.blind.keep_files

        def keep(chunk: tuple[PlannedCase, ...], failures: Sequence[str | None]) -> None:
            for case, failure in zip(chunk, failures, strict=True):
                if failure is not None:
                    self.undrawn[case.id] = failure
                    continue
                scores[case.id] = score_case(
                    self.files, case.id, self.made_from, self.setup.control, keep_files=keep_files
                )
                left = (time.monotonic() - begun) / len(scores) * (len(waiting) - len(scores))
                done = whole - len(waiting) + len(scores)
                self.progress(Progress(done, whole, f"cases, {_duration(left)} left"))

        files = self.files.absolute
        steps = (partial(_draw_cases, self.setup, files), partial(_diagnose_cases, self.methods, files))
        ChunkedWork(steps, keep, self._lost, self.where).do([(case,) for case in waiting], jobs)
        return scores

    def _lost(self, case: PlannedCase, step: int, reason: str) -> str | None:
        """Set a case aside: without a truth it has no score, without a diagnosis it is one that failed."""
        if step == 0:
            return reason
        cost = Cost(seconds=0.0, diagnose_seconds=0.0, peak_memory_MB=0.0, failure=reason)
        write_json(self.files.case(case.id) / COST, cost, self.setup.control)
        return None


def _draw_cases(setup: BenchmarkSetup, files: CaseFiles, chunk: tuple[PlannedCase, ...]) -> None:
    for case in chunk:
        hide(setup, case, files)


def _diagnose_cases(methods: Methods, files: CaseFiles, chunk: tuple[PlannedCase, ...]) -> tuple[None, ...]:
    for case in chunk:
        diagnose_case(methods, files.case(case.id))
    return (None,) * len(chunk)


def _duration(seconds: float) -> str:
    return f"{seconds / 60.0:.0f} min" if seconds > 90.0 else f"{seconds:.0f} s"


def folder_of(root: Path, blind: BlindConfig) -> CaseFiles:
    """Return the files of a benchmark below the benchmarks' folder, by its seed and its generator."""
    kind = "" if blind.generator == "own" else f"{blind.generator}-"
    return CaseFiles(root / f"{kind}seed-{blind.seed}")
