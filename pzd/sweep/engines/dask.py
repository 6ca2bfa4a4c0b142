"""Workers of a Dask cluster: of one that stands at an address, or of processes started on this machine."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import TYPE_CHECKING, cast

from pzd.schema.errors import ConfigError

if TYPE_CHECKING:
    from distributed import Client

_WAIT_S = 10.0
"""How long a scheduler at an address may take to answer."""


@contextmanager
def executor(jobs: int, address: str | None) -> Iterator[Executor]:
    """An executor on a cluster; what a lost worker was doing is done again by another one.

    Parameters
    ----------
    jobs : processes to start where no address is given, on the loopback interface alone
    address : of a scheduler, e.g. `tcp://127.0.0.1:8786`; across hosts `tls://`, as Dask's own configuration sets it up

    Raises
    ------
    ConfigError : when Dask is not installed, or no scheduler answers
    """
    with _client(jobs, address) as client:
        yield cast("Executor", client.get_executor(pure=False))


def _client(jobs: int, address: str | None) -> Client:
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise ConfigError("sweep.engine: dask is not installed; pip install pzd[cluster], or say local") from None
    if address is None:
        cluster = LocalCluster(  # type: ignore[no-untyped-call]  # Dask declares no types
            n_workers=jobs, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
        )
        return Client(cluster)  # type: ignore[no-untyped-call]  # Dask declares no types
    try:
        return Client(address, timeout=_WAIT_S)  # type: ignore[no-untyped-call]  # Dask declares no types
    except (OSError, ValueError) as error:
        raise ConfigError(f"sweep.address: no scheduler answers there: {error} (got {address})") from error
