"""Processes of this machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from pzd.parallel.config import Pools, Where
from pzd.parallel.processes import spawned_pool


@contextmanager
def pools(where: Where, jobs: int, steps: int) -> Iterator[Pools]:
    """Pools of processes, so that no process does two different steps.

    Parameters
    ----------
    where : of no meaning here
    jobs : how many work at a time
    steps : how many pools
    """
    made = [spawned_pool(jobs) for _ in range(steps)]
    try:
        yield Pools(made, jobs)
    finally:
        for pool in made:
            pool.shutdown(wait=False, cancel_futures=True)
