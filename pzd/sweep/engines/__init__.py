"""Where the runs of a sweep are done; an engine is an executor of `concurrent.futures`, one file each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from contextlib import AbstractContextManager

from pzd.sweep.engines import dask, local

Engine = Callable[[int, str | None], AbstractContextManager[Executor]]
"""Takes the number of processes and an address, and lends an executor."""

ENGINES: Mapping[str, Engine] = {"local": local.executor, "dask": dask.executor}
"""By the name that a config gives."""
