"""A cluster that others can reach is refused without TLS; what belongs to another engine is refused too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pzd.cli.app import status
from pzd.parallel.config import EngineConfig, is_loopback
from pzd.schema.errors import ConfigError

FILES = {"ca": "ca.pem", "cert": "cert.pem", "key": "key.pem"}


@pytest.mark.parametrize(
    ("block", "says"),
    [
        ({"address": "tcp://127.0.0.1:1"}, "address belongs to engine: dask"),
        ({"engine": "dask", "slurm": {}}, "belongs to engine: slurm"),
        ({"security": FILES}, "security belongs to engine: dask or slurm"),
        ({"engine": "dask", "address": "tcp://10.0.0.1:8786"}, "say security"),
        ({"engine": "dask", "address": "head.lab:8786"}, r"say security.*got head\.lab"),
        ({"engine": "dask", "address": "tcp://0.0.0.0:8786"}, "say security"),
        ({"engine": "dask", "address": "tcp://10.0.0.1:8786", "security": FILES}, "begins with tls://"),
        ({"engine": "slurm", "slurm": {"host": "10.0.0.1"}}, r"slurm\.host is not of this machine"),
        ({"engine": "slurm", "slurm": {"walltime": "an hour"}}, "walltime"),
    ],
)
def test_an_engine_that_makes_no_sense_or_is_open_to_others_is_refused(block: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        EngineConfig(**block)


@pytest.mark.parametrize(
    "block",
    [
        {"engine": "dask", "address": "tcp://localhost:8786"},
        {"engine": "dask", "address": "tcp://[::1]:8786"},
        {"engine": "dask", "address": "tls://10.0.0.1:8786", "security": FILES},
        {"engine": "slurm", "slurm": {"host": "10.0.0.1"}, "security": FILES},
        {"engine": "slurm"},
    ],
)
def test_a_loopback_or_tls_is_taken(block: dict[str, Any]) -> None:
    assert EngineConfig(**block).engine == block["engine"]


def test_the_whole_loopback_net_is_this_machine() -> None:
    assert [is_loopback(host) for host in ("127.8.0.1", "::1", "192.168.0.1", "elsewhere")] == [
        True,
        True,
        False,
        False,
    ]


def test_an_open_cluster_ends_with_exit_code_2_before_anything_runs(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    there = ("--set", "sweep.engine=dask", "--set", "sweep.address=tcp://10.0.0.1:8786")
    given = ["sweep", str(root / "configs" / "sweep.yaml"), "--runs", str(tmp_path / "runs"), *there]
    assert status(given) == ConfigError.exit_code
    assert "whoever reaches it may run anything" in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()
