"""Runs the cases: one pool of processes draws them, another diagnoses them, and the truth is opened last.

At most `jobs` processes work at a time, so that the seconds of a diagnosis are its own.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pzd.blind.case import Places, Scored
from pzd.blind.config import BlindConfig
from pzd.blind.diagnosis import Methods, diagnose_case
from pzd.blind.hide import BenchmarkSetup, hide
from pzd.blind.hide_independent import hide_independent, plan_independent
from pzd.blind.plan import PlannedCase, plan
from pzd.blind.scoring import score_case
from pzd.schema.errors import DataError
from pzd.schema.jsonfile import read_json
from pzd.schema.processes import spawned_pool
from pzd.schema.progress import Listener, Progress, no_listener


@dataclass(frozen=True)
class Benchmark:
    """What is hidden, how it is sought, and where the files go."""

    setup: BenchmarkSetup
    methods: Methods
    places: Places
    made_from: str
    """Hash of everything that a case depends on but its number: cases with another one are done again."""
    pool: Callable[[int], Executor] = spawned_pool
    """Makes a pool of so many workers."""
    progress: Listener = no_listener
    """Hears of every case that is done."""

    def run(self, jobs: int, *, afresh: bool = False) -> tuple[Scored, ...]:
        """Every case's score; those that stand there finished are not done again.

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
        return tuple(done[case.id] for case in cases)

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

        def kept(case: PlannedCase) -> None:
            found[case.id] = score_case(
                self.places, case.id, self.made_from, self.setup.control, keep_files=self.setup.blind.keep_files
            )
            left = (time.monotonic() - begun) / len(found) * (len(waiting) - len(found))
            done = whole - len(waiting) + len(found)
            self.progress(Progress(done, whole, f"cases, {_duration(left)} left"))

        draws = hide_independent if self.setup.blind.generator == "independent" else hide
        drawing, seeking = (self.pool(min(jobs, len(waiting))) for _ in range(2))
        try:
            _in_turn(
                waiting,
                lambda case: drawing.submit(draws, self.setup, case, self.places),
                lambda case: seeking.submit(diagnose_case, self.methods, self.places.case(case.id)),
                kept,
                jobs,
            )
        finally:
            drawing.shutdown(cancel_futures=True)
            seeking.shutdown(cancel_futures=True)
        return found


def _in_turn(
    cases: list[PlannedCase],
    draw: Callable[[PlannedCase], Future[None]],
    diagnose: Callable[[PlannedCase], Future[None]],
    kept: Callable[[PlannedCase], None],
    jobs: int,
) -> None:
    """Draw and diagnose every case, at most `jobs` at work; what is drawn is diagnosed first."""
    waiting, drawn = list(reversed(cases)), list[PlannedCase]()
    drawing: dict[Future[None], PlannedCase] = {}
    seeking: dict[Future[None], PlannedCase] = {}
    while waiting or drawn or drawing or seeking:
        while len(drawing) + len(seeking) < jobs and (drawn or waiting):
            if drawn:
                case = drawn.pop()
                seeking[diagnose(case)] = case
            else:
                case = waiting.pop()
                drawing[draw(case)] = case
        finished, _ = wait([*drawing, *seeking], return_when=FIRST_COMPLETED)
        for future in finished:
            future.result()
            if future in drawing:
                drawn.append(drawing.pop(future))
            else:
                kept(seeking.pop(future))


def _duration(seconds: float) -> str:
    return f"{seconds / 60.0:.0f} min" if seconds > 90.0 else f"{seconds:.0f} s"


def folder_of(root: Path, blind: BlindConfig) -> Places:
    """Where a benchmark lies below the benchmarks' folder, by its seed and its generator."""
    kind = "" if blind.generator == "own" else f"{blind.generator}-"
    return Places(root / f"{kind}seed-{blind.seed}")
