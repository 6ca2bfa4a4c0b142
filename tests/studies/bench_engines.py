"""What a chunk costs beside its runs: on processes of this machine, and through a Dask scheduler."""

from __future__ import annotations

import pickle
import resource
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from bench_table import Row

from pzd.parallel.chunks import ChunkedWork
from pzd.parallel.config import EngineConfig
from pzd.parallel.engines import Where
from pzd.sweep.campaign import SweepRuns
from pzd.sweep.task import BaseRun, outcomes

COUNTS = (500, 3000)
"""Chunks; the difference leaves out what it takes to start."""
CAMPAIGN = Path(__file__).parent / "campaign" / "rides.yaml"


def nothing(chunk: tuple[int, ...]) -> tuple[int, ...]:
    """The tasks themselves."""
    return chunk


def seconds(engine: str, count: int) -> tuple[float, float]:
    """By the clock, and of this process, which holds the scheduler too, for so many chunks without work."""

    def keep(chunk: tuple[int, ...], results: Sequence[int]) -> None:
        assert tuple(results) == chunk

    def lost(task: int, step: int, reason: str) -> int:
        raise RuntimeError(reason)

    how = EngineConfig.model_validate({"engine": engine})
    work = ChunkedWork((nothing,), keep, lost, Where(how, "sweep", Path(), Path()), 4)
    spent, start = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter()
    work.do([(number,) for number in range(count)], 2)
    wall, now = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_SELF)
    return wall, now.ru_utime + now.ru_stime - spent.ru_utime - spent.ru_stime


def rows() -> Iterator[Row]:
    """All."""
    for engine in ("local", "dask"):
        (few_wall, few_cpu), (wall, cpu) = (seconds(engine, count) for count in COUNTS)
        each, each_cpu = (1e3 * (a - b) / (COUNTS[1] - COUNTS[0]) for a, b in ((wall, few_wall), (cpu, few_cpu)))
        yield Row(f"a chunk without work, engine {engine}", each, "ms", about=f"{each_cpu:.2g} CPU-ms of the scheduler")
    campaign = SweepRuns.of(BaseRun(CAMPAIGN, Path("runs"), ()))
    sent = len(pickle.dumps((partial(outcomes, campaign.base.absolute), campaign.chunks[-1])))
    yield Row("a chunk of 8 rides, bytes sent", sent, "B")
