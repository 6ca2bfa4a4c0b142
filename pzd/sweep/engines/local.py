"""Processes of this machine."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

from pzd.schema.processes import spawned_pool


@contextmanager
def executor(jobs: int, address: str | None) -> Iterator[Executor]:
    """A pool of processes.

    Parameters
    ----------
    jobs : how many
    address : of no meaning here
    """
    pool = spawned_pool(jobs)
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
