"""Work on several cores gives what one core gives, and fails as it would there."""

from __future__ import annotations

import os
import signal

import pytest

from pzd.schema.errors import DataError
from pzd.schema.processes import parallel_map


@pytest.mark.parametrize("jobs", [1, 2, 3, 50])
@pytest.mark.parametrize("count", [0, 1, 2, 7])
def test_results_stand_in_order_for_any_number_of_processes(jobs: int, count: int) -> None:
    assert parallel_map(lambda number: number**2, range(count), jobs) == [number**2 for number in range(count)]


def test_two_processes_work_at_the_same_time() -> None:
    assert len(set(parallel_map(lambda _: os.getpid(), range(4), 2))) == 2


@pytest.mark.parametrize("failing", [0, 1])
def test_what_fails_in_another_process_is_told_as_if_it_failed_here(failing: int) -> None:
    def refuse(number: int) -> int:
        if number == failing:
            raise DataError([f"data/{number}.csv:3: wrong", "and more"])
        return number

    with pytest.raises(DataError) as caught:
        parallel_map(refuse, range(4), 2)
    assert caught.value.messages == (f"data/{failing}.csv:3: wrong", "and more")


def test_what_was_killed_there_is_made_here() -> None:
    here = os.getpid()

    def killed_elsewhere(number: int) -> int:
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return number

    assert parallel_map(killed_elsewhere, range(5), 3) == list(range(5))
