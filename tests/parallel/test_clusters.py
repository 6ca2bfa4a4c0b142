"""A sweep on real schedulers gives the bytes of one on this machine, though a job is lost in the middle."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from one_node import NoSlurmError, one_node

from pzd.parallel import engines
from pzd.parallel.config import EngineConfig
from pzd.parallel.engines import Where
from pzd.parallel.processes import Progress
from pzd.schema.errors import ConfigError
from pzd.sweep.campaign import SweepRuns
from pzd.sweep.task import BaseRun

pytestmark = pytest.mark.ci

SMALL = """
rig:
  virtual:
    - damper: {base: [{voltage_V: 0, T0_N: 300, C_Ns_per_m: 2700, k_N_per_m: 200000}]}
      voltages_V: [0]
      rate_Hz: 200
      tests: [{waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.02}, cycles: 4}]
      noise: {force: {share_of_peak: 0.01}}
sweep:
  until: identify
  chunk: 1
  over: {seed: [2, 3, 4, 5, 6, 7, 8, 9]}
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(SMALL, encoding="utf-8")
    return path


@pytest.fixture
def slurm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A SLURM of one node; skips where the machine allows none, as in a container without root."""
    pytest.importorskip("dask_jobqueue", reason="pip install pzd[cluster]")
    try:
        with one_node(tmp_path / "slurm") as written:
            monkeypatch.setenv("SLURM_CONF", str(written))
            yield written
    except NoSlurmError as why:
        pytest.skip(f"no SLURM on this machine: {why}")


@pytest.fixture
def certificates(tmp_path: Path) -> Path:
    """A folder with an authority, and a certificate that it signed for 127.0.0.1."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed; apt-get install openssl")
    folder = tmp_path / "tls"
    folder.mkdir()

    def openssl(*arguments: str) -> None:
        subprocess.run(["openssl", *arguments], cwd=folder, check=True, capture_output=True)

    new = ("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2")
    openssl(*new, "-subj", "/CN=authority", "-keyout", "ca.key", "-out", "ca.pem")
    openssl("req", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=pzd", "-keyout", "key.pem", "-out", "request.pem")
    signed = ("-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-days", "2")
    openssl("x509", "-req", "-in", "request.pem", *signed, "-out", "cert.pem")
    openssl(*new, "-subj", "/CN=stranger", "-keyout", "strange.key", "-out", "strange.pem")
    return folder


def swept(path: Path, runs: Path, *overrides: str, at: Callable[[Progress], None] | None = None) -> Path:
    """The folder of the results of a sweep."""
    base = BaseRun(path, runs, overrides)
    campaign = SweepRuns.of(base, at) if at else SweepRuns.of(base)
    campaign.gather(campaign.run(2), path.stem)
    return campaign.folder


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def test_jobs_of_slurm_give_the_same_bytes_though_one_is_cancelled(small: Path, tmp_path: Path, slurm: Path) -> None:
    cancelled: list[str] = []

    def cancel_one(done: Progress) -> None:
        if not cancelled:
            listed = subprocess.run(["squeue", "--noheader", "--format=%A"], capture_output=True, text=True, check=True)
            cancelled.append(listed.stdout.split()[0])
            subprocess.run(["scancel", "--signal=KILL", "--full", cancelled[0]], check=True)

    asked = ("sweep.engine=slurm", "sweep.slurm.memory=2GB", "sweep.slurm.jobs=2", "sweep.slurm.partition=all")
    found = swept(small, tmp_path / "b", *asked, at=cancel_one)
    assert cancelled
    assert files(found) == files(swept(small, tmp_path / "a"))
    left = subprocess.run(["squeue", "--noheader", "--states=RUNNING"], capture_output=True, text=True, check=True)
    assert left.stdout == ""


@pytest.mark.usefixtures("slurm")
def test_a_partition_that_is_not_there_is_refused(small: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"sweep\.slurm: SLURM takes no such job: .*partition"):
        swept(small, tmp_path / "b", "sweep.engine=slurm", "sweep.slurm.memory=2GB", "sweep.slurm.partition=none")


def test_a_cluster_under_tls_gives_the_same_bytes_and_takes_no_stranger(
    small: Path, tmp_path: Path, certificates: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed", reason="pip install pzd[cluster]")
    secured = EngineConfig.model_validate(
        {"engine": "dask", "security": {"ca": "ca.pem", "cert": "cert.pem", "key": "key.pem"}}
    )
    security = engines.security(Where(secured, "sweep", certificates, tmp_path))
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0", security=security
    ) as cluster:
        assert cluster.scheduler_address.startswith("tls://")
        given = [f"sweep.address={cluster.scheduler_address}", "sweep.engine=dask"]
        given += [f"sweep.security.{key}={certificates / f'{key}.pem'}" for key in ("ca", "cert", "key")]
        assert files(swept(small, tmp_path / "b", *given)) == files(swept(small, tmp_path / "a"))
        monkeypatch.setattr(engines, "WAIT_S", 2.0)
        stranger = [
            f"sweep.security.{key}={certificates}/strange.{end}" for key, end in (("cert", "pem"), ("key", "key"))
        ]
        with pytest.raises(ConfigError, match="no scheduler answers there"):
            swept(small, tmp_path / "c", *given, *stranger)
        with pytest.raises(ConfigError, match=r"sweep\.security\.ca: the file is missing"):
            swept(small, tmp_path / "d", *given, "sweep.security.ca=absent.pem")
