"""Chunks of tasks done side by side; a task whose process is killed is repeated, and given up after some tries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from pzd.parallel.engines import ENGINES, Pools, Where
from pzd.schema.errors import UserError

TRIES = 3
"""Tries of a task whose process is killed: once may be chance (memory, a node), thrice is the task."""

T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True)
class ChunkedWork(Generic[T, R]):
    """Steps that are done with every chunk of tasks."""

    steps: tuple[Callable[[tuple[T, ...]], Any], ...]
    """Done one after the other with a chunk, by processes of their own where the engine has such; the last one returns
    a result for each task. Each can be repeated after it was cut short."""
    keep: Callable[[tuple[T, ...], Sequence[R]], None]
    """Takes the results of a chunk, in this process."""
    lost: Callable[[T, int, str], R]
    """The result of a task whose process was lost every time, in a step of this number, and why."""
    where: Where
    ahead: int = 1
    """Chunks given to each worker: one, or more where it must not wait for the next one to come."""

    def do(self, chunks: Sequence[tuple[T, ...]], jobs: int) -> None:
        """Do all chunks, and keep their results.

        Parameters
        ----------
        chunks : in the order in which they are begun
        jobs : processes at the same time, where the engine starts them on this machine

        Raises
        ------
        UserError : of a step, at once
        """
        waiting = list(chunks)
        while waiting:
            waiting, lost = self._side_by_side(waiting, min(jobs, len(waiting)))
            for chunk in lost:
                self._alone(chunk)

    def _side_by_side(
        self, chunks: Sequence[tuple[T, ...]], jobs: int
    ) -> tuple[list[tuple[T, ...]], list[tuple[T, ...]]]:
        """Do chunks until a process is lost; return those that are left, and those that were in work."""
        ready: list[list[tuple[T, ...]]] = [list(reversed(chunks)), *([] for _ in self.steps[1:])]
        flying: dict[Future[Any], tuple[int, tuple[T, ...]]] = {}
        lost: list[tuple[T, ...]] = []
        with self._pools(jobs) as pools:
            while True:
                while not lost and len(flying) < self.ahead * pools.workers and any(ready):
                    step = max(i for i, some in enumerate(ready) if some)  # what has come furthest goes first
                    chunk = ready[step].pop()
                    try:
                        flying[pools.executors[step].submit(self.steps[step], chunk)] = step, chunk
                    except BrokenExecutor:
                        lost.append(chunk)
                if not flying:
                    return [chunk for some in ready for chunk in reversed(some)], lost
                done = wait(flying, return_when=FIRST_COMPLETED).done
                for future in [given for given in flying if given in done]:  # a set has no order: errors would change
                    step, chunk = flying.pop(future)
                    try:
                        found = future.result()
                    except UserError:
                        raise
                    except Exception:  # noqa: BLE001  # an error that does not reach us unharmed is the end of a process
                        lost.append(chunk)
                        continue
                    if step + 1 < len(self.steps):
                        ready[step + 1].append(chunk)
                    else:
                        self.keep(chunk, found)

    def _alone(self, chunk: tuple[T, ...]) -> None:
        """Do a chunk task by task, with nothing beside it, to find the task that kills its process."""
        found: list[R] = []
        tries = 0
        while len(found) < len(chunk):
            with self._pools(1) as pools:
                while len(found) < len(chunk):
                    task = chunk[len(found)]
                    try:
                        found.append(self._one(pools, task))
                    except _LostError as error:
                        tries += 1
                        if tries == TRIES:
                            reason = f"the process that did it was lost {tries} times: {error}"
                            found.append(self.lost(task, error.step, reason))
                            tries = 0
                        break  # out of processes that may be gone, into new ones
                    tries = 0
        self.keep(chunk, found)

    def _one(self, pools: Pools, task: T) -> R:
        made: Any = None
        for step, do in enumerate(self.steps):
            try:
                made = pools.executors[step].submit(do, (task,)).result()
            except UserError:
                raise
            except Exception as error:
                raise _LostError(step, error) from error
        result: R = made[0]
        return result

    def _pools(self, jobs: int) -> AbstractContextManager[Pools]:
        return ENGINES[self.where.how.engine](self.where, jobs, len(self.steps))


class _LostError(Exception):
    """A process was lost in a step, with the reason in the same words whatever the engine."""

    def __init__(self, step: int, error: Exception) -> None:
        killed = isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"
        super().__init__("it was killed" if killed else f"{type(error).__name__}: {error}")
        self.step = step
