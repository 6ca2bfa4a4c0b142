"""A SLURM of one node that is this machine, from Debian's packages, for as long as a test takes."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "sinfo")
_READY_S = 30.0


class NoSlurmError(Exception):
    """This machine allows no SLURM, and why."""


@contextmanager
def one_node(folder: Path) -> Iterator[Path]:
    """The daemons in a folder of their own, on the loopback alone; gives the path of slurm.conf.

    Raises
    ------
    NoSlurmError : where a program is missing, the user is not root, or a daemon does not come up
    """
    missing = [name for name in PROGRAMS if shutil.which(name) is None]
    if missing:
        raise NoSlurmError(f"{', '.join(missing)} not installed; apt-get install slurmctld slurmd slurm-client munge")
    if os.geteuid() != 0:
        raise NoSlurmError("slurmd starts jobs as root alone")
    written = _configured(folder)
    with ExitStack() as stack:
        places = {"key-file": "key", "socket": "socket", "pid-file": "pid", "log-file": "log", "seed-file": "seed"}
        munge = [f"--{option}={folder}/munge.{end}" for option, end in places.items()]
        _daemon(stack, folder, "munged", "--foreground", "--force", *munge)
        _wait_for("munge", (folder / "munge.socket").exists, folder)
        _daemon(stack, folder, "slurmctld", "-D", "-c", "-f", str(written))
        _daemon(stack, folder, "slurmd", "-D", "-c", "-f", str(written))
        _wait_for("slurmd", lambda: _idle(written), folder)
        yield written


def _configured(folder: Path) -> Path:
    """Write key and config; folders are readable for their owner alone, as munge asks for."""
    folder.mkdir(parents=True, mode=0o755, exist_ok=True)
    for name in ("state", "spool"):
        (folder / name).mkdir()
    key = folder / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o600)
    node = socket.gethostname().partition(".")[0]
    lines = {
        "ClusterName": "one",
        "SlurmctldHost": f"{node}(127.0.0.1)",
        "SlurmUser": "root",
        "SlurmdUser": "root",
        "AuthInfo": f"socket={folder / 'munge.socket'}",
        "SlurmctldPort": _free_port(),
        "SlurmdPort": _free_port(),
        "StateSaveLocation": folder / "state",
        "SlurmdSpoolDir": folder / "spool",
        "SlurmctldPidFile": folder / "slurmctld.pid",
        "SlurmdPidFile": folder / "slurmd.pid",
        "SlurmdParameters": "config_overrides",
        "ProctrackType": "proctrack/linuxproc",
        "TaskPlugin": "task/none",
        "SelectType": "select/cons_tres",
        "SelectTypeParameters": "CR_Core",
        "MpiDefault": "none",
        "NodeName": f"{node} NodeAddr=127.0.0.1 CPUs=2 RealMemory=8000",
        "PartitionName": "all Nodes=ALL Default=YES State=UP",
    }
    written = folder / "slurm.conf"
    written.write_text("".join(f"{key}={value}\n" for key, value in lines.items()), encoding="utf-8")
    return written


def _daemon(stack: ExitStack, folder: Path, *command: str) -> None:
    """Start a daemon that stays a child of this process, and stop it at the end."""
    log = stack.enter_context((folder / f"{command[0]}.log").open("w"))
    process = subprocess.Popen(command, stdout=log, stderr=log, stdin=subprocess.DEVNULL)
    stack.callback(process.wait)
    stack.callback(process.terminate)


def _wait_for(name: str, ready: Callable[[], bool], folder: Path) -> None:
    deadline = time.monotonic() + _READY_S
    while not ready():
        if time.monotonic() > deadline:
            logs = "; ".join(f"{path.name}: {path.read_text()[-300:]}" for path in sorted(folder.glob("*.log")))
            raise NoSlurmError(f"{name} does not come up within {_READY_S:g} s: {logs}")
        time.sleep(0.1)


def _idle(written: Path) -> bool:
    command = ["sinfo", "--noheader", "--format=%T"]
    done = subprocess.run(
        command, env={**os.environ, "SLURM_CONF": str(written)}, capture_output=True, text=True, check=False
    )
    return done.stdout.strip() == "idle"


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])
