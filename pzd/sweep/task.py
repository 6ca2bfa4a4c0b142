"""One run of a sweep: what it differs in is set, what that changes is made anew in memory, its results are rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from pzd.artefacts import Artefact, Diagnosed, Identified, Rides
from pzd.config import RunConfig, validated
from pzd.parallel.chunks import TRIES
from pzd.pipeline.command import Opened, opened
from pzd.pipeline.in_memory import InMemory, unaffected
from pzd.pipeline.stages import Stage, stages
from pzd.schema.errors import UserError
from pzd.schema.model import Frozen
from pzd.schema.scalars import Scalar
from pzd.sweep.plan import Task
from pzd.sweep.scatter import scattered

PLAIN = "-plain"
"""Ends the name of a ride on the damper before diagnose."""


class RunResult(Frozen):
    """What came of one run."""

    task: int
    rows: tuple[dict[str, Scalar], ...] = ()
    """Of the table of results."""
    failure: str | None = None
    """Why there are none."""


@dataclass(frozen=True)
class BaseRun:
    """The config that all runs of a sweep begin with, and where its results stand."""

    config: Path
    runs: Path
    overrides: tuple[str, ...]

    @property
    def absolute(self) -> BaseRun:
        """The same for a process that works in another folder."""
        return replace(self, config=self.config.absolute(), runs=self.runs.absolute())

    @property
    def opened(self) -> Opened:
        """The config, read once in each process."""
        return _opened(self)


@cache
def _opened(base: BaseRun) -> Opened:
    return opened(base.config, base.runs, base.overrides)


@cache
def _read(base: BaseRun, folder: str) -> Artefact:
    """What stands in a stage's folder of the base run, read once in each process."""
    (kind,) = (stage.makes for stage in stages(base.opened.config) if stage.folder == folder)
    return base.opened.run.read(kind)


def config_of(given: Opened, task: Task) -> RunConfig:
    """The config of one run.

    Raises
    ------
    ConfigError : when a value is wrong
    """
    return validated(given.document.overridden(task.overrides))


def shared_stages(given: Opened, some: Sequence[Task]) -> tuple[Stage, ...]:
    """The stages that make the same in all of some runs as in the base run."""
    kept = stages(given.config)
    for task in some:
        kept = kept[: len(unaffected(given.config, config_of(given, task)))]
    return kept


def outcomes(base: BaseRun, chunk: Sequence[Task]) -> tuple[RunResult, ...]:
    """What comes of some runs, one after another; one that fails is told, and the others go on."""
    return tuple(_outcome(base, task) for task in chunk)


def _outcome(base: BaseRun, task: Task) -> RunResult:
    failure = ""
    for _ in range(TRIES):
        try:
            return RunResult(task=task.number, rows=tuple(_rows(base, task)))
        except UserError as error:
            return RunResult(task=task.number, failure="; ".join(error.messages))
        except Exception as error:  # noqa: BLE001  # whatever it is, it is told, and the other runs go on
            failure = f"{type(error).__name__}: {error}"
    return RunResult(task=task.number, failure=failure)


def _rows(base: BaseRun, task: Task) -> Iterator[dict[str, Scalar]]:
    given = base.opened
    config = config_of(given, task)
    sweep = config.sweep
    if sweep is None:
        raise ValueError("a task of a config without a sweep")
    kept = {stage.name: stage for stage in unaffected(given.config, config)}
    if task.damper:
        kept.pop("table", None)
        kept.pop("simulate", None)
        kept.pop("report", None)
    known = {stage.folder: _read(base, stage.folder) for stage in kept.values()}
    chain = InMemory(config, given.run, stages(config), _silent, artefacts=known)
    if sweep.until == "simulate":
        chain.through("diagnose")
        chain.artefacts[Diagnosed.folder] = scattered(chain.of(Diagnosed), sweep.damper, dict(task.damper))
    chain.through(sweep.until)
    yield from ROWS[sweep.until](chain)


def _silent(_: str) -> None:
    """Nobody follows the stages of one run of many."""


def _of_identify(chain: InMemory) -> Iterator[dict[str, Scalar]]:
    yield from (row.model_dump() for row in chain.of(Identified).rows)


def _of_diagnose(chain: InMemory) -> Iterator[dict[str, Scalar]]:
    found = chain.of(Diagnosed).diagnosis
    gap, prediction = found.gap, found.prediction
    yield {
        "verdict": found.verdict,
        "effects": " ".join(found.effects),
        "confidence": found.confidence,
        "gap_before": gap.before if gap else None,
        "gap_after": gap.after if gap else None,
        "W_s_plain": prediction.W_s_plain if prediction else None,
        "W_s": prediction.W_s if prediction else None,
    }


def _of_simulate(chain: InMemory) -> Iterator[dict[str, Scalar]]:
    rides = chain.of(Rides)
    weighted = {(row.case, row.point): row.a_w_m_per_s2 for row in rides.weighted}
    for row in rides.summary:
        if not row.case.endswith(PLAIN):
            yield {**row.model_dump(), "a_w_m_per_s2": weighted.get((row.case, row.point))}


ROWS: Mapping[str, Callable[[InMemory], Iterator[dict[str, Scalar]]]] = {
    "identify": _of_identify,
    "diagnose": _of_diagnose,
    "simulate": _of_simulate,
}
"""The rows of a run for the table of results, labels before measures, by the stage whose results are gathered."""
