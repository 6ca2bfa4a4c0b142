"""Work of Python itself on several cores at once: in processes that are forked and share what stands in memory."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

Item = TypeVar("Item")
Made = TypeVar("Made")

_FORKS = sys.platform == "linux"
"""Elsewhere a process would have to import everything anew, which takes longer than what is saved."""


def parallel_map(function: Callable[[Item], Made], items: Sequence[Item], jobs: int) -> list[Made]:
    """What a function makes of each item, in order, however many processes there are.

    Parameters
    ----------
    function : is called once an item; what it changes in memory may be lost
    items : what to call it with
    jobs : processes at the same time

    Raises
    ------
    whatever the function does
    """
    jobs = min(jobs, len(items)) if _FORKS else 1
    if jobs < 2:
        return [function(item) for item in items]
    import multiprocessing

    context = multiprocessing.get_context("fork")
    others = []
    for share in range(1, jobs):
        ours, theirs = context.Pipe(duplex=False)
        process = context.Process(target=_work, args=(function, items[share::jobs], theirs), daemon=True)
        process.start()
        theirs.close()
        others.append((share, process, ours))
    made: dict[int, list[Made]] = {}
    try:
        made[0] = [function(item) for item in items[::jobs]]
        for share, _, ours in others:
            made[share] = _received(ours)
    finally:
        for _, process, ours in others:
            process.kill()
            process.join()
            ours.close()
    for share, results in made.items():
        # What failed there fails here again, where its reason can be told; what was killed there is made here.
        made[share] = results or [function(item) for item in items[share::jobs]]
    return [made[place % jobs][place // jobs] for place in range(len(items))]


def _work(function: Callable[[Item], Made], items: Sequence[Item], pipe: Connection) -> None:
    try:
        pipe.send([function(item) for item in items])
    except BaseException:  # noqa: BLE001  # whatever it is, the process that asked does the work itself
        pipe.send([])


def _received(pipe: Connection) -> list[Made]:
    try:
        results: list[Made] = pipe.recv()
    except EOFError:
        return []
    return results
