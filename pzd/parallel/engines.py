"""Engines that do tasks: processes of this machine, a Dask cluster, or jobs of SLURM that form one.

An engine is a context manager that lends one executor of `concurrent.futures` for each step of the work.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, cast

from pzd.parallel.config import LOOPBACK, EngineConfig, SlurmConfig, is_loopback
from pzd.parallel.processes import spawned_pool
from pzd.schema.errors import ConfigError

if TYPE_CHECKING:
    from distributed import Client
    from distributed.security import Security

NO_DASHBOARD = f"{LOOPBACK}:0"
"""A scheduler serves HTTP without TLS, whatever its settings: on the loopback alone, then."""
WAIT_S = 10.0
"""How long a scheduler at an address may take to answer."""


@dataclass(frozen=True)
class Where:
    """Engine that does the work, with its block of the config and its folders."""

    how: EngineConfig
    block: str
    """Block of the config, for messages."""
    folder: Path
    """Folder of the config, to which its paths are relative."""
    logs: Path
    """Folder for what jobs of SLURM print."""


@dataclass(frozen=True)
class Pools:
    """Executors that an engine lends."""

    executors: Sequence[Executor]
    """One for each step."""
    workers: int
    """How many chunks are worked on at a time."""


@contextmanager
def local_pools(where: Where, jobs: int, steps: int) -> Iterator[Pools]:
    """Lend pools of processes, one for each step, so that no process does two different steps.

    Parameters
    ----------
    where : without meaning here
    jobs : processes in each pool
    steps : how many pools
    """
    pools = [spawned_pool(jobs) for _ in range(steps)]
    try:
        yield Pools(pools, jobs)
    finally:
        for pool in pools:
            pool.shutdown(wait=False, cancel_futures=True)


@contextmanager
def dask_pools(where: Where, jobs: int, steps: int) -> Iterator[Pools]:
    """Lend the executor of a Dask cluster, the same for every step; the task of a lost worker is done again.

    Parameters
    ----------
    where : may hold the address of a scheduler, `tcp://127.0.0.1:8786`, or `tls://` with `security`
    jobs : processes to start where it holds none, on the loopback interface alone
    steps : how many executors

    Raises
    ------
    ConfigError : when Dask is not installed, no scheduler answers, or a file of `security` is missing
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise ConfigError(
            f"{where.block}.engine: dask is not installed; pip install pzd[cluster], or say local"
        ) from None
    secured, address = security(where), where.how.address
    with ExitStack() as stack:
        if address is None:
            cluster = LocalCluster(  # type: ignore[no-untyped-call]  # Dask declares no types
                n_workers=jobs, threads_per_worker=1, host=LOOPBACK, dashboard_address=NO_DASHBOARD, security=secured
            )
            client = Client(stack.enter_context(cluster))  # type: ignore[no-untyped-call]  # Dask declares no types
        else:
            try:
                client = Client(address, timeout=WAIT_S, security=secured)  # type: ignore[no-untyped-call]  # as above
            except (OSError, ValueError) as error:
                raise ConfigError(
                    f"{where.block}.address: no scheduler answers there: {error} (got {address})"
                ) from error
        yield _executors(stack.enter_context(client), steps, jobs)


@contextmanager
def slurm_pools(where: Where, jobs: int, steps: int) -> Iterator[Pools]:
    """Lend the executor of a Dask cluster whose workers are jobs of SLURM and whose scheduler is in this process.

    The block `slurm` says how many jobs there are, so that `jobs` is without meaning here.

    Raises
    ------
    ConfigError : when dask-jobqueue or SLURM is not installed, or SLURM refuses a job
    """
    try:
        from dask_jobqueue import SLURMCluster
        from distributed import Client
    except ImportError:
        raise ConfigError(
            f"{where.block}.engine: dask-jobqueue is not installed; pip install pzd[cluster], or say local"
        ) from None
    asked, secured = where.how.slurm or SlurmConfig(), security(where)
    own = ["--host", LOOPBACK] if is_loopback(asked.host) else []
    scheduler = {"host": asked.host, "port": 0, "dashboard_address": NO_DASHBOARD, "dashboard": False}
    with ExitStack() as stack:
        cluster = SLURMCluster(
            queue=asked.partition,
            walltime=asked.walltime,
            memory=asked.memory,
            cores=asked.cores,
            processes=asked.cores,
            protocol="tcp://" if secured is None else "tls://",
            security=secured,
            scheduler_options=scheduler,
            log_directory=str(where.logs),
            worker_extra_args=["--no-dashboard", *own],
        )
        stack.enter_context(cluster)
        _check_accepted(where, cluster.job_script())
        # Adaptive, so that a job that ends before the work is replaced.
        cluster.adapt(minimum_jobs=asked.jobs, maximum_jobs=asked.jobs)
        client = stack.enter_context(Client(cluster))  # type: ignore[no-untyped-call]  # Dask declares no types
        yield _executors(client, steps, asked.jobs * asked.cores)


def _executors(client: Client, steps: int, jobs: int) -> Pools:
    """Lend an executor of a client for every step; at least `jobs` workers are expected."""
    executor = cast("Executor", client.get_executor(pure=False))  # type: ignore[no-untyped-call]  # Dask declares no types
    workers = len(client.nthreads())  # type: ignore[no-untyped-call]  # as above
    return Pools([executor] * steps, max(workers, jobs))


def security(where: Where) -> Security | None:
    """Return the TLS settings that the config asks for, None without.

    Raises
    ------
    ConfigError : when a file is missing
    """
    given = where.how.security
    if given is None:
        return None
    from distributed.security import Security

    files = {key: where.folder / path for key, path in given.model_dump().items()}
    for key, path in files.items():
        if not path.is_file():
            raise ConfigError(f"{where.block}.security.{key}: the file is missing; check the path (got {path})")
    roles = {
        f"tls_{role}_{end}": str(files[end]) for role in ("client", "worker", "scheduler") for end in ("cert", "key")
    }
    return Security(require_encryption=True, tls_ca_file=str(files["ca"]), **roles)  # type: ignore[no-untyped-call]  # as above


def _check_accepted(where: Where, script: str) -> None:
    """Ask SLURM whether it accepts a job, before anything waits for it.

    Raises
    ------
    ConfigError : when it does not, or is not there
    """
    sbatch = shutil.which("sbatch")
    if sbatch is None:
        raise ConfigError(f"{where.block}.engine: sbatch is not on this machine; start where SLURM is (got slurm)")
    command = [sbatch, "--test-only"]
    asked = subprocess.run(command, input=script, capture_output=True, text=True, check=False)  # noqa: S603  # of SLURM
    if asked.returncode != 0:
        reason = " ".join(asked.stderr.split())
        raise ConfigError(f"{where.block}.slurm: SLURM takes no such job: {reason}")


Engine = Callable[[Where, int, int], AbstractContextManager[Pools]]
"""Takes where to run, the number of processes and the number of steps."""

ENGINES: Mapping[str, Engine] = {"local": local_pools, "dask": dask_pools, "slurm": slurm_pools}
"""By the name that a config gives."""
