"""Jobs of SLURM: each starts workers of a Dask cluster whose scheduler is in this process."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from pzd.parallel.config import LOOPBACK, Pools, SlurmConfig, Where, is_loopback
from pzd.parallel.engines.dask import NO_DASHBOARD, lent, security
from pzd.schema.errors import ConfigError


@contextmanager
def pools(where: Where, jobs: int, steps: int) -> Iterator[Pools]:
    """An executor on the workers of the jobs, the same for every step.

    The block `slurm` says how many jobs there are, so that `jobs` says nothing here.

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
    protocol = "tcp://" if secured is None else "tls://"
    own = ["--host", LOOPBACK] if is_loopback(asked.host) else []
    with ExitStack() as stack:
        cluster = stack.enter_context(
            SLURMCluster(
                queue=asked.partition,
                walltime=asked.walltime,
                memory=asked.memory,
                cores=asked.cores,
                processes=asked.cores,
                protocol=protocol,
                security=secured,
                scheduler_options={
                    "host": asked.host,
                    "port": 0,
                    "dashboard_address": NO_DASHBOARD,
                    "dashboard": False,
                },
                log_directory=str(where.logs),
                worker_extra_args=["--no-dashboard", *own],
            )
        )
        _check_taken(where, cluster.job_script())
        cluster.adapt(
            minimum_jobs=asked.jobs, maximum_jobs=asked.jobs
        )  # a job that ends before the work has a successor
        client = stack.enter_context(Client(cluster))  # type: ignore[no-untyped-call]  # Dask declares no types
        yield lent(client, steps, asked.jobs * asked.cores)


def _check_taken(where: Where, script: str) -> None:
    """Ask SLURM whether it takes a job, before anything waits for it.

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
        said = " ".join(asked.stderr.split())
        raise ConfigError(f"{where.block}.slurm: SLURM takes no such job: {said}")
