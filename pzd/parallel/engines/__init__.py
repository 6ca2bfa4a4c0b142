"""Where tasks are done; an engine lends executors of `concurrent.futures`, one file each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager

from pzd.parallel.config import Pools, Where
from pzd.parallel.engines import dask, local, slurm

Engine = Callable[[Where, int, int], AbstractContextManager[Pools]]
"""Takes where it is to run, the number of processes and that of steps, and lends an executor for each step."""

ENGINES: Mapping[str, Engine] = {"local": local.pools, "dask": dask.pools, "slurm": slurm.pools}
"""By the name that a config gives."""
