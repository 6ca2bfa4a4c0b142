"""Runs the cases: each is drawn, then diagnosed, on any engine; on this machine by processes that do one of the two.

The truth is opened last, here. Each worker has one case at a time, so that the seconds of a diagnosis are its own.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from pzd.blind.case import Cost, Places, Scored
from pzd.blind.config import BlindConfig
from pzd.blind.diagnosis import COST, Methods, diagnose_case
from pzd.blind.hide import BenchmarkSetup, hide
from pzd.blind.hide_independent import hide_independent, plan_independent
from pzd.blind.plan import PlannedCase, plan
from pzd.blind.scoring import score_case
from pzd.parallel.chunks import ChunkedWork
from pzd.parallel.pools import Where
from pzd.schema.errors import DataError
from pzd.schema.jsonfile import read_json, write_json
from pzd.schema.progress import Listener, Progress, no_listener


@dataclass(frozen=True)
class Benchmark:
    """What is hidden, how it is sought, and where the files go."""

    setup: BenchmarkSetup
    methods: Methods
    places: Places
    made_from: str
    """Hash of everything that a case depends on but its number: cases with another one are done again."""
    where: Where
    """Where the cases are drawn and diagnosed."""
    progress: Listener = no_listener
    """Hears of every case that is done."""
    undrawn: dict[str, str] = field(default_factory=dict)
    """Why a case could not be drawn, by its id; filled by `run`."""

    def run(self, jobs: int, *, afresh: bool = False) -> tuple[Scored, ...]:
        """Every case's score but of those that could not be drawn; those that stand there finished are not done again.

        Parameters
        ----------
        jobs : processes that work at a time
        afresh : do the finished ones again as well
        """
        cases = self.plan()
        done = {} if afresh else self.finished(cases)
        waiting = [case for case in cases if case.id not in done]
        if waiting:
            self._prepare(waiting)
            done |= self._worked(waiting, len(cases), jobs)
        return tuple(done[case.id] for case in cases if case.id in done)

    def plan(self) -> tuple[PlannedCase, ...]:
        """Every case, in the order in which they are done."""
        independent = self.setup.blind.generator == "independent"
        return plan_independent(self.setup.blind) if independent else plan(self.setup.blind)

    def finished(self, cases: Iterable[PlannedCase]) -> dict[str, Scored]:
        """The scores that stand there and were made from the same config and code."""
        found = {}
        for case in cases:
            with suppress(DataError):
                score = read_json(self.places.scored(case.id), Scored, self.setup.control)
                if score.made_from == self.made_from:
                    found[case.id] = score
        return found

    def _prepare(self, waiting: Iterable[PlannedCase]) -> None:
        """Take away what an earlier run left of the cases."""
        for case in waiting:
            shutil.rmtree(self.places.case(case.id), ignore_errors=True)
            for path in (self.places.truth(case.id), self.places.clean(case.id), self.places.scored(case.id)):
                path.unlink(missing_ok=True)

    def _worked(self, waiting: list[PlannedCase], whole: int, jobs: int) -> dict[str, Scored]:
        begun = time.monotonic()
        found: dict[str, Scored] = {}

        def keep(chunk: tuple[PlannedCase, ...], failures: Sequence[str | None]) -> None:
            for case, failure in zip(chunk, failures, strict=True):
                if failure is not None:
                    self.undrawn[case.id] = failure
                else:
                    found[case.id] = score_case(
                        self.places, case.id, self.made_from, self.setup.control, keep_files=self.setup.blind.keep_files
                    )
                    left = (time.monotonic() - begun) / len(found) * (len(waiting) - len(found))
                    done = whole - len(waiting) + len(found)
                    self.progress(Progress(done, whole, f"cases, {_duration(left)} left"))

        places = self.places.absolute
        steps = (partial(_draw, self.setup, places), partial(_diagnose, self.methods, places))
        ChunkedWork(steps, keep, self._lost, self.where).do([(case,) for case in waiting], jobs)
        return found

    def _lost(self, case: PlannedCase, step: int, reason: str) -> str | None:
        """Set a case aside: without a truth it has no score, without a diagnosis it is one that failed."""
        if step == 0:
            return reason
        cost = Cost(seconds=0.0, diagnose_seconds=0.0, peak_memory_MB=0.0, failure=reason)
        write_json(self.places.case(case.id) / COST, cost, self.setup.control)
        return None


def _draw(setup: BenchmarkSetup, places: Places, chunk: tuple[PlannedCase, ...]) -> None:
    """Draw some cases."""
    draws = hide_independent if setup.blind.generator == "independent" else hide
    for case in chunk:
        draws(setup, case, places)


def _diagnose(methods: Methods, places: Places, chunk: tuple[PlannedCase, ...]) -> tuple[None, ...]:
    """Diagnose some cases; nothing that a score would need is handed back."""
    for case in chunk:
        diagnose_case(methods, places.case(case.id))
    return (None,) * len(chunk)


def _duration(seconds: float) -> str:
    return f"{seconds / 60.0:.0f} min" if seconds > 90.0 else f"{seconds:.0f} s"


def folder_of(root: Path, blind: BlindConfig) -> Places:
    """Where a benchmark lies below the benchmarks' folder, by its seed and its generator."""
    kind = "" if blind.generator == "own" else f"{blind.generator}-"
    return Places(root / f"{kind}seed-{blind.seed}")
