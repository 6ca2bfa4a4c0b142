"""Chunks of tasks are done on processes that may be killed: each result comes once, whatever happened on the way."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

from pzd.parallel.chunks import ChunkedWork
from pzd.parallel.config import EngineConfig
from pzd.parallel.engines import ENGINES, Pools, Where
from pzd.schema.errors import DataError

CHUNKS = tuple((first, first + 1) for first in range(0, 12, 2))


def doubled(chunk: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(2 * task for task in chunk)


def killed_by_five(chunk: tuple[int, ...]) -> tuple[int, ...]:
    if 5 in chunk:
        os.kill(os.getpid(), signal.SIGKILL)
    return doubled(chunk)


def refused(chunk: tuple[int, ...]) -> tuple[int, ...]:
    raise DataError(f"cannot do {chunk[0]}")


class KilledOnce:
    """Kills its process where no file stands that says it did so before."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __call__(self, chunk: tuple[int, ...]) -> tuple[int, ...]:
        if 5 in chunk and not self.mark.exists():
            self.mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return doubled(chunk)


def worked(tmp_path: Path, *steps: object, jobs: int = 2) -> tuple[dict[int, int | None], list[tuple[int, str]]]:
    """What came of every task, and which were lost in which step."""
    found: dict[int, int | None] = {}
    lost: list[tuple[int, str]] = []

    def keep(chunk: Sequence[int], results: Sequence[int | None]) -> None:
        assert not found.keys() & set(chunk)
        found.update(zip(chunk, results, strict=True))

    def set_aside(task: int, step: int, reason: str) -> None:
        lost.append((step, f"{task}: {reason}"))

    ChunkedWork(steps, keep, set_aside, Where(EngineConfig(), "sweep", tmp_path, tmp_path), 2).do(CHUNKS, jobs)  # type: ignore[arg-type]  # steps of any kind
    return found, lost


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.ci)])
def test_a_task_whose_process_is_killed_every_time_is_set_aside_and_all_others_are_done(
    jobs: int, tmp_path: Path
) -> None:
    found, lost = worked(tmp_path, killed_by_five, jobs=jobs)
    assert found == {task: None if task == 5 else 2 * task for task in range(12)}
    assert lost == [(0, "5: the process that did it was lost 3 times: it was killed")]


@pytest.mark.ci
def test_a_task_whose_process_is_killed_once_has_its_result(tmp_path: Path) -> None:
    found, lost = worked(tmp_path, KilledOnce(tmp_path / "mark"))
    assert (tmp_path / "mark").exists()
    assert found == {task: 2 * task for task in range(12)}
    assert lost == []


@pytest.mark.ci
def test_a_loss_in_the_second_of_two_steps_is_reported_as_such(tmp_path: Path) -> None:
    found, lost = worked(tmp_path, doubled, killed_by_five, jobs=1)
    assert found == {task: None if task == 5 else 2 * task for task in range(12)}
    assert [step for step, _ in lost] == [1]


def test_what_the_user_can_mend_ends_the_work_at_once(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="cannot do 0"):
        worked(tmp_path, refused, jobs=1)


class AtOnce(Executor):
    """Has done a chunk as soon as it is given one."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except DataError as error:
            future.set_exception(error)
        return future


def test_of_several_mistakes_found_at_the_same_time_the_first_chunk_s_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(ENGINES, "local", lambda where, jobs, steps: nullcontext(Pools([AtOnce()], jobs)))
    with pytest.raises(DataError, match="cannot do 0"):
        worked(tmp_path, refused, jobs=len(CHUNKS))
