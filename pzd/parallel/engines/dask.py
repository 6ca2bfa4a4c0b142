"""Workers of a Dask cluster: of one that stands at an address, or of processes started on this machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, cast

from pzd.parallel.config import LOOPBACK, Pools, Where
from pzd.schema.errors import ConfigError

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from distributed import Client
    from distributed.security import Security

NO_DASHBOARD = f"{LOOPBACK}:0"
"""A scheduler answers questions by HTTP without TLS, whatever it is told: on the loopback alone, then."""
_WAIT_S = 10.0
"""How long a scheduler at an address may take to answer."""


@contextmanager
def pools(where: Where, jobs: int, steps: int) -> Iterator[Pools]:
    """An executor on a cluster, the same for every step; what a lost worker was doing is done again by another one.

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
            cluster = stack.enter_context(
                LocalCluster(  # type: ignore[no-untyped-call]  # Dask declares no types
                    n_workers=jobs,
                    threads_per_worker=1,
                    host=LOOPBACK,
                    dashboard_address=NO_DASHBOARD,
                    security=secured,
                )
            )
            client = Client(cluster)  # type: ignore[no-untyped-call]  # Dask declares no types
        else:
            try:
                client = Client(  # type: ignore[no-untyped-call]  # Dask declares no types
                    address, timeout=_WAIT_S, security=secured
                )
            except (OSError, ValueError) as error:
                raise ConfigError(
                    f"{where.block}.address: no scheduler answers there: {error} (got {address})"
                ) from error
        stack.enter_context(client)
        yield lent(client, steps, jobs)


def lent(client: Client, steps: int, jobs: int) -> Pools:
    """An executor of a client for every step; at least `jobs` workers are expected."""
    executor = cast(
        "Executor",
        client.get_executor(pure=False),  # type: ignore[no-untyped-call]  # Dask declares no types
    )
    there = len(client.nthreads())  # type: ignore[no-untyped-call]  # Dask declares no types
    return Pools([executor] * steps, max(there, jobs))


def security(where: Where) -> Security | None:
    """TLS as the config says, None without.

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
    return Security(  # type: ignore[no-untyped-call]  # Dask declares no types
        require_encryption=True, tls_ca_file=str(files["ca"]), **roles
    )
