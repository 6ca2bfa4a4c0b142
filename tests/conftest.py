"""What the tests of every package share: random draws, the measured data, and the command itself.

Every random number of a test comes from here. The draws of a test hang on its name alone, so that `make test` says
the same at every run; PZD_SEED draws others, and `make fresh` tries many of those.
"""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import zlib
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings
from installed import Installed

from pzd.parallel import chunks
from pzd.parallel.engines import Pools, Where

ROOT = Path(__file__).resolve().parent.parent

gc.disable()  # until all tests are collected: what is imported stays

# Tests run in several processes; a pool of threads in each would only get in the way.
for pool in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(pool, "1")
os.environ.setdefault("MPLBACKEND", "Agg")

FRESH = os.environ.get("PZD_SEED", "")
"""Set by `make fresh`, or to draw again what failed there; empty: the fixed draws."""

settings.register_profile("fixed", deadline=None, max_examples=50, derandomize=True)
settings.register_profile("fresh", deadline=None, max_examples=50, database=None, print_blob=True)
settings.load_profile("fresh" if FRESH else "fixed")


def pytest_report_header() -> str:
    """Say which data and which draws this session uses."""
    drawn = f"drawn by PZD_SEED={FRESH}" if FRESH else "fixed draws"
    return f"measured data: {_shared() or 'absent'}; {drawn}"


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what draws, so that `make fresh` finds it."""
    for item in items:
        if generator_for.__name__ in getattr(item, "fixturenames", ()) or item.get_closest_marker("hypothesis"):
            item.add_marker("draws")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Fail instead of skipping for want of a Debian package where PZD_REQUIRE_PACKAGES says that all are installed."""
    report = yield
    if report.skipped and "apt-get install" in str(report.longrepr) and os.environ.get("PZD_REQUIRE_PACKAGES"):
        report.outcome, report.longrepr = "failed", f"skipped although PZD_REQUIRE_PACKAGES is set: {report.longrepr}"
    return report


def pytest_collection_finish() -> None:
    """Spare the garbage collector what lives to the end: looking through modules and tests took a tenth of the time."""
    gc.enable()
    gc.freeze()


def name_of(item: pytest.Item) -> str:
    """File and test, without the folder: a file that moves keeps its draws."""
    return f"{item.path.name}::{item.nodeid.partition('::')[2]}"


@pytest.fixture(scope="session")
def generator_for() -> Callable[[str], np.random.Generator]:
    """The one source of generators, one a name: for what several tests share; a test itself asks for `rng`."""
    return lambda name: np.random.default_rng(zlib.crc32(f"{FRESH} {name}".encode()))


@pytest.fixture
def rng(request: pytest.FixtureRequest, generator_for) -> np.random.Generator:
    """The generator of this test; `rng.spawn(n)` gives n that do not hang on each other."""
    return generator_for(name_of(request.node))


@pytest.fixture
def seeds(rng: np.random.Generator) -> Callable[[int], list[int]]:
    """So many whole numbers from the generator of this test, for what asks for a seed."""
    return lambda count: rng.integers(2**32, size=count).tolist()


def _shared() -> Path | None:
    folder = Path(os.environ.get("PZD_SHARED") or ROOT.parent / "shared")
    return folder if (folder / "data").is_dir() else None


@pytest.fixture(scope="session", autouse=True)
def kernels_compiled_once(request: pytest.FixtureRequest) -> Generator[None, None, None]:
    """Where tests run in several processes, what most begin with is compiled first, by one of them for all.

    The ride's kernels, which take most of it, are compiled beside the tests before: a ride waits for them.
    """
    if not hasattr(request.config, "workerinput"):
        yield
        return
    from pzd.compiled import cache_folder
    from pzd.simulate.compiled_ahead import mark

    respond_once()
    ahead = None
    if not mark(cache_folder()).exists():
        ahead = subprocess.Popen([sys.executable, "-m", "pzd.simulate.precompile"], cwd=ROOT)
    yield
    if ahead:
        ahead.wait()


def respond_once() -> None:
    """Compile what most tests begin with: a damper's force in closed form, and piece by piece."""
    from pzd.damper.compose import respond
    from pzd.damper.model import BaseRow, Damper
    from pzd.damper.motion import Motion

    time, still = np.arange(3) / 1000.0, np.zeros(3)
    plain = Damper(base=(BaseRow(voltage_V=0.0, T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),))
    for damper in (plain, plain.with_effect("lash", {"delta": 1e-4})):
        respond(damper, Motion(time, still, still, still, still))


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


@pytest.fixture
def pzd_here(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., subprocess.CompletedProcess[str]]:
    """The same in this process, which has everything imported: a new one takes seconds to be where this one is."""
    from pzd.cli.app import status

    def run(*arguments: object, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
        given = [str(argument) for argument in arguments]
        capsys.readouterr()
        with monkeypatch.context() as patch:
            patch.chdir(cwd)
            code = status(given)
        return subprocess.CompletedProcess(given, code, *capsys.readouterr())

    return run


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built wheel."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="session")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """The wheel, installed with the hashed lock in an environment of its own."""
    folder = tmp_path_factory.mktemp("installed")
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    pip = [str(folder / "bin" / "python"), "-m", "pip", "--disable-pip-version-check", "install", "-qq"]
    subprocess.run([*pip, "--require-hashes", "-r", str(ROOT / "requirements.lock")], check=True)
    subprocess.run([*pip, "--no-deps", str(wheel)], check=True)
    return Installed(folder)


@contextmanager
def in_threads(where: Where, jobs: int, steps: int) -> Iterator[Pools]:
    """An engine of threads of this process, which start at once."""
    with ThreadPoolExecutor(jobs) as pool:
        yield Pools([pool] * steps, jobs)


@pytest.fixture
def threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Threads in place of the processes of every engine, which take long to start."""
    monkeypatch.setattr(chunks, "ENGINES", dict.fromkeys(chunks.ENGINES, in_threads))
