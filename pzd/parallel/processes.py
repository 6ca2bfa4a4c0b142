"""Processes of this machine: a map over forked ones that share memory, pools of spawned ones; events of progress."""

from __future__ import annotations

import logging
import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pzd.parallel.on_disk import let_go

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future

Item = TypeVar("Item")
Made = TypeVar("Made")

_FORKS = sys.platform == "linux"
"""Elsewhere a process would have to import everything anew, which takes longer than it saves."""


def parallel_map(
    function: Callable[[Item], Made],
    items: Sequence[Item],
    jobs: int,
    made_one: Callable[[Made], None] | None = None,
    *,
    first_here: bool = False,
) -> list[Made]:
    """Call a function with each item, in forked processes.

    Parameters
    ----------
    function : is called once for each item; what it changes in memory may be lost
    items : its arguments
    jobs : processes at the same time; the results do not depend on it
    made_one : is called in this process with each result, in order
    first_here : whether the first item is done in this process before the others part from it, so that they have what
        it loads: for items that take less time than that

    Returns
    -------
    the results, in the order of the items

    Raises
    ------
    whatever the function does

    Examples
    --------
    >>> parallel_map(lambda number: number**2, [1, 2, 3], jobs=1)
    [1, 4, 9]
    """
    made: list[Made] = []
    for one in parallel_each(function, items, jobs, first_here=first_here):
        made.append(one)
        if made_one is not None:
            made_one(one)
    return made


def parallel_each(
    function: Callable[[Item], Made], items: Sequence[Item], jobs: int, *, first_here: bool = False
) -> Iterator[Made]:
    """Yield what a function makes of each item, as `parallel_map` does, and keep none of it."""
    jobs = min(jobs, len(items)) if _FORKS else 1
    here = len(items) if jobs < 2 else int(first_here)
    for place in range(here):
        yield function(items[place])
        let_go()
    if here == len(items):
        return
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    # The arguments of a forked process are not pickled: the function may be any, and the items are not copied.
    context = multiprocessing.get_context("fork")
    pool = ProcessPoolExecutor(jobs, context, _start_worker, (function, items))
    finished = False
    try:
        futures = deque(pool.submit(_one, place) for place in range(here, len(items)))
        for place in range(here, len(items)):
            yield _result(futures.popleft(), function, items[place])
            let_go()
        finished = True
    finally:
        pool.shutdown(wait=finished, cancel_futures=True)


def own_python(code: str) -> list[str]:
    """Return the command of a process that runs code with this copy of pzd, wherever somebody stands.

    A module of the current folder is never taken for a library: that folder holds what others sent.
    """
    root = str(Path(__file__).resolve().parents[2])
    found = f"import sys; {root!r} in sys.path or sys.path.insert(0, {root!r})"
    return [sys.executable, "-P", "-c", f"{found}; {code}"]


def spawned_pool(jobs: int) -> Executor:
    """Return a pool of processes that share nothing with this one, log nothing, and end with it however it ends."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    return ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), _work_quietly)


def _work_quietly() -> None:
    logging.getLogger("pzd").addHandler(logging.NullHandler())
    end_with_parent()


def end_with_parent() -> None:
    """Let this process, a worker of a pool, end silently when it is interrupted or its parent has ended.

    A parent that is killed cannot end its workers: they would wait for work for ever.
    """
    import multiprocessing
    from threading import Thread

    signal.signal(signal.SIGINT, signal.SIG_DFL)
    parent = multiprocessing.parent_process()

    def wait_for_its_end() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    Thread(target=wait_for_its_end, daemon=True).start()


def _result(future: Future[Made], function: Callable[[Item], Made], item: Item) -> Made:
    """Return what a worker made; where it failed or was killed, call the function here, so that the error is whole."""
    try:
        return future.result()
    except Exception:  # noqa: BLE001  # whatever it is, the same call here raises it, with all that belongs to it
        return function(item)


_work: list[Any] = []
"""In a worker: the function, and the items."""


def _start_worker(function: Callable[[Any], Any], items: Sequence[Any]) -> None:
    end_with_parent()
    _work[:] = function, items


def _one(place: int) -> Any:
    function, items = _work
    try:
        return function(items[place])
    finally:
        let_go()


# --- Progress of a stage that takes long ---


@dataclass(frozen=True)
class Progress:
    """Event of progress: so many parts of the work are done."""

    done: int
    whole: int
    what: str
    """What is counted, in the plural, and a remark on the part that was done last."""

    def __str__(self) -> str:
        """Return the progress in words."""
        return f"{self.done} of {self.whole} {self.what}"


Listener = Callable[[Progress], None]
"""Is called with every event, in the thread that does the work."""


def no_listener(_: Progress) -> None:
    """Ignore an event, where nobody follows the progress of a stage."""
