"""The keys of a block that say where its work is done."""

from __future__ import annotations

from ipaddress import ip_address
from typing import Literal
from urllib.parse import urlsplit

from pydantic import Field, model_validator

from pzd.schema.model import Frozen

LOOPBACK = "127.0.0.1"
"""Address of a scheduler that only this machine can reach."""


class SecurityConfig(Frozen):
    """Files for TLS, which every process of a cluster shows and checks; relative to the config."""

    ca: str = Field(min_length=1)
    """Certificate of the authority that signed the others (PEM)."""
    cert: str = Field(min_length=1)
    """Certificate of the processes (PEM)."""
    key: str = Field(min_length=1)
    """Its private key (PEM)."""


class SlurmConfig(Frozen):
    """What SLURM is asked for."""

    partition: str | None = None
    """Where the jobs wait; by default that of the cluster."""
    walltime: str = Field(default="01:00:00", pattern=r"^(\d+-)?\d+(:\d\d){0,2}$")
    """How long a job may last, as `sbatch --time` takes it: HH:MM:SS."""
    memory: str = Field(default="4GB", pattern=r"^\d+(\.\d+)? ?[kMGT]i?B$")
    """Of a job."""
    cores: int = Field(default=1, ge=1)
    """Of a job: so many processes, each doing a chunk at a time."""
    jobs: int = Field(default=1, ge=1)
    """How many are submitted."""
    host: str = LOOPBACK
    """Address of this machine at which the jobs reach the scheduler; any but the loopback needs `security`."""


class EngineConfig(Frozen):
    """Where work is done that is made of many tasks."""

    engine: Literal["local", "dask", "slurm"] = "local"
    """Where it runs: in processes of this machine, on a Dask cluster, or in jobs of SLURM that form one (the latter two
    with `pip install pzd[cluster]`)."""
    address: str | None = None
    """Of the Dask scheduler; by default a cluster of `--jobs` processes on this machine. All workers must see the
    folder of the results."""
    slurm: SlurmConfig | None = None
    """What `engine: slurm` asks for."""
    security: SecurityConfig | None = None
    """TLS of the cluster, needed wherever its scheduler is reached from beyond this machine."""

    @model_validator(mode="after")
    def _reachable_safely(self) -> EngineConfig:
        if self.address is not None and self.engine != "dask":
            raise ValueError("address belongs to engine: dask")
        if self.slurm is not None and self.engine != "slurm":
            raise ValueError("the block slurm belongs to engine: slurm")
        if self.security is not None and self.engine == "local":
            raise ValueError("security belongs to engine: dask or slurm; processes of this machine need none")
        if self.security is None:
            hosts = {"address": host_of(self.address), "slurm.host": self.slurm.host if self.slurm else LOOPBACK}
            for key, host in hosts.items():
                if not is_loopback(host):
                    raise ValueError(
                        f"{key} is not of this machine, and whoever reaches it may run anything; "
                        f"say security: {{ca: ..., cert: ..., key: ...}} (got {host})"
                    )
        elif self.address is not None and not self.address.startswith("tls://"):
            raise ValueError(f"address: with security it begins with tls:// (got {self.address})")
        return self


HOW = frozenset(EngineConfig.model_fields)
"""Keys that do not change the results."""


def host_of(address: str | None) -> str:
    """Return the host of `tcp://HOST:PORT`; the loopback where there is no address."""
    if address is None:
        return LOOPBACK
    return urlsplit(address if "//" in address else f"//{address}").hostname or address


def is_loopback(host: str) -> bool:
    """Whether an address or name is this machine's alone."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
