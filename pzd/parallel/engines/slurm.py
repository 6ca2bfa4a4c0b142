"""Jobs of SLURM: each starts workers of a Dask cluster whose scheduler is in this process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from pzd.parallel.config import LOOPBACK, SlurmConfig, is_loopback
from pzd.parallel.engines.dask import lent, security
from pzd.parallel.pools import Pools, Where
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
                scheduler_options={"host": asked.host, "port": 0, "dashboard_address": None, "dashboard": False},
                worker_extra_args=["--no-dashboard", *own],
            )
        )
        try:
            cluster.scale(jobs=asked.jobs)
            cluster.sync(cluster._correct_state)  # noqa: SLF001  # submits now, so that a refusal is heard here
        except (OSError, RuntimeError) as error:
            said = " ".join(str(error).split())
            raise ConfigError(f"{where.block}.slurm: SLURM takes no jobs of this kind: {said}") from error
        client = stack.enter_context(Client(cluster))  # type: ignore[no-untyped-call]  # Dask declares no types
        yield lent(client, steps, asked.jobs * asked.cores)
