"""Work on several cores gives what one core gives, and fails as it would there."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import pzd.record
from pzd.parallel.processes import own_python, parallel_map
from pzd.schema.errors import DataError

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("jobs", [1, 2, 3, 50])
@pytest.mark.parametrize("count", [0, 1, 2, 7])
def test_results_stand_in_order_for_any_number_of_processes(jobs: int, count: int) -> None:
    assert parallel_map(lambda number: number**2, range(count), jobs) == [number**2 for number in range(count)]


@pytest.mark.parametrize("jobs", [1, 2, 3])
@pytest.mark.parametrize("count", [0, 1, 2, 7])
def test_what_the_first_item_loads_all_others_have_where_it_is_done_here(jobs: int, count: int) -> None:
    loaded: list[int] = []

    def load(number: int) -> tuple[int, int]:
        if not loaded:
            loaded.append(os.getpid())
        return number, loaded[0]

    found = parallel_map(load, range(count), jobs, first_here=True)
    assert found == [(number, os.getpid()) for number in range(count)]


@pytest.mark.parametrize("jobs", [1, 3])
def test_each_that_is_made_is_reported_in_order_where_it_was_asked_for(jobs: int) -> None:
    told: list[tuple[int, int]] = []
    parallel_map(lambda number: number**2, range(5), jobs, lambda square: told.append((square, os.getpid())))
    assert told == [(number**2, os.getpid()) for number in range(5)]


def test_two_processes_work_at_the_same_time() -> None:
    both = multiprocessing.get_context("fork").Barrier(2, timeout=60.0)  # opens when two have come

    def meet(_: int) -> int:
        both.wait()
        return os.getpid()

    assert len(set(parallel_map(meet, range(2), 2)) - {os.getpid()}) == 2


def test_workers_end_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    text = (
        "import os, time\nfrom pathlib import Path\nfrom pzd.parallel.processes import parallel_map\n"
        "def work(n):\n    Path(f'{n}').write_text(str(os.getpid()))\n    time.sleep(60)\n"
        "parallel_map(work, range(2), 2)"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen([sys.executable, "-c", text], cwd=tmp_path, env=environment) as parent:
        until(lambda: all((tmp_path / name).is_file() and (tmp_path / name).read_text() for name in "01"))
        workers = [int((tmp_path / name).read_text()) for name in "01"]
        parent.kill()
    until(lambda: not any(runs(worker) for worker in workers))


def until(true: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30.0  # a busy machine starts Python slowly
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def runs(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"  # one that has ended and whom nobody waits for


@pytest.mark.parametrize("failing", [0, 1])
def test_what_fails_in_another_process_is_reported_as_if_it_failed_here(failing: int) -> None:
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


def test_a_process_of_our_own_takes_no_module_from_the_folder_where_somebody_stands(tmp_path: Path) -> None:
    for name in ("pzd", "numpy", "json"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('planted')\n", encoding="utf-8")
    command = own_python("import json, numpy, pzd.record; print(pzd.record.__file__)")
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.strip() == pzd.record.__file__
