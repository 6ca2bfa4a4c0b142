"""How long a user waits, and how fast the kernels are.

    python tests/studies/bench.py               both
    python tests/studies/bench.py kernels       the kernels alone, beside other solvers; into runs/bench/bench.json

Prints each wait beside its limit, and exits 1 where one is above. No ratio of a kernel decides anything.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from bench_kernels import measure

ROOT = Path(__file__).resolve().parents[2]
CONFIG = ROOT / "configs" / "quickstart.yaml"
PAPER = ROOT / "configs" / "paper.yaml"


def seconds(*arguments: object, folder: Path) -> float:
    """How long a command takes; it must exit 0."""
    command = [sys.executable, "-m", "pzd", *map(str, arguments)]
    folder.mkdir(exist_ok=True)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(folder / "cache")}
    start = time.perf_counter()
    subprocess.run(command, env=environment, cwd=folder, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - start


def waits(folder: Path) -> Iterator[tuple[str, float, float]]:
    """What is waited for, how long it takes and how long it may take [s]."""
    yield "pzd --help, best of 5", min(seconds("--help", folder=folder) for _ in range(5)), 0.2
    yield "pzd run, nothing compiled yet", seconds("run", CONFIG, folder=folder), 30.0
    yield "pzd run again, all fresh", seconds("run", CONFIG, folder=folder), 2.0
    yield "pzd run, all anew, kernels compiled", seconds("run", CONFIG, "--runs", "anew", folder=folder), 10.0
    yield "make figures, from nothing", seconds("figures", PAPER, folder=folder / "elsewhere"), 120.0


def main() -> int:
    """Measure and print."""
    late = 0 if sys.argv[1:] == ["kernels"] else too_long()
    measure(ROOT / "runs" / "bench" / "bench.json")
    return 1 if late else 0


def too_long() -> int:
    """How many waits are above their limits; prints all of them."""
    with tempfile.TemporaryDirectory() as name:
        late = 0
        for what, took, limit in waits(Path(name)):
            late += took > limit
            sys.stdout.write(f"{what:<40}{took:8.2f} s   at most {limit:g} s{'   TOO LONG' if took > limit else ''}\n")
            sys.stdout.flush()
    return late


if __name__ == "__main__":
    sys.exit(main())
