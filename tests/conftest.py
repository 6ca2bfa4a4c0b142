"""What the tests of every package share: the measured data, fresh seeds, and the command itself."""

from __future__ import annotations

import os
import random
import secrets
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parent.parent

# Tests run in several processes; a pool of threads in each would only get in the way.
for pool in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(pool, "1")
os.environ.setdefault("MPLBACKEND", "Agg")

settings.register_profile("pzd", deadline=None, max_examples=50, print_blob=True)
settings.load_profile("pzd")

SEED = int(os.environ.get("PZD_SEED") or secrets.randbits(32))


def pytest_report_header() -> str:
    """Say which data and which seed this session uses."""
    return f"shared data: {_shared() or 'absent'}; fresh seeds are drawn from OS entropy or PZD_SEED"


def _shared() -> Path | None:
    folder = Path(os.environ.get("PZD_SHARED") or ROOT.parent / "shared")
    return folder if (folder / "data").is_dir() else None


@pytest.fixture(scope="session")
def root() -> Path:
    """The root of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of the measured data: PZD_SHARED, else ../shared beside the repository."""
    folder = _shared()
    if folder is None:
        pytest.skip("measured data absent: neither PZD_SHARED nor ../shared holds a folder data/")
    return folder


@pytest.fixture
def fresh_seeds(request: pytest.FixtureRequest) -> Callable[[int], list[int]]:
    """Seeds nobody has chosen; a failure prints the PZD_SEED that draws the same ones again."""
    print(f"fresh seeds: PZD_SEED={SEED}")  # noqa: T201  # pytest shows it where the test fails
    source = random.Random(f"{SEED} {request.node.nodeid}")

    def draw(count: int) -> list[int]:
        return [source.getrandbits(32) for _ in range(count)]

    return draw


@pytest.fixture(scope="session")
def pzd() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run the command as a user would: pzd("run", config, cwd=folder) gives code, stdout and stderr."""

    def run(*arguments: object, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
        paths = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
        return subprocess.run(
            [sys.executable, "-m", "pzd", *map(str, arguments)],
            cwd=cwd,
            env={**os.environ, "PYTHONPATH": paths},
            capture_output=True,
            text=True,
            check=False,
        )

    return run
