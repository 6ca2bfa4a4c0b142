"""How fast pzd is: each figure beside what is wanted, and beside a peer that does the same work.

    python tests/studies/bench.py                       all; into runs/bench/bench.json
    python tests/studies/bench.py kernels stages        the force of a damper; fit, ride and comfort
    python tests/studies/bench.py waits files diagnose road engines campaign profile

Ratios are of processor time, taken in pairs in turn in one process, the median over the pairs. Waits are by the clock,
so that they hold on an idle machine alone. No figure decides anything but what is printed beside it.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from importlib.metadata import version
from pathlib import Path

import bench_commands
import bench_engines
import bench_kernels
import bench_stages
from bench_table import PAIRS, Row

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "runs" / "bench" / "bench.json"


def parts(folder: Path) -> dict[str, Callable[[], Iterator[Row]]]:
    """What can be asked for."""
    return {
        "kernels": bench_kernels.rows,
        "stages": bench_stages.rows,
        "waits": partial(bench_commands.waits, folder / "waits"),
        "files": partial(bench_commands.files, folder),
        "diagnose": partial(bench_commands.diagnoses, folder / "diagnose"),
        "road": partial(bench_commands.road_hour, folder / "road"),
        "engines": bench_engines.rows,
        "campaign": partial(bench_commands.campaign, folder / "campaign"),
        "profile": partial(bench_commands.profiles, folder / "profiles"),
    }


def main() -> None:
    """Measure, print a table, write it as JSON."""
    found: list[Row] = []
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        known = parts(Path(name))
        parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
        parser.add_argument("part", nargs="*", help=f"{', '.join(known)}; none for all")
        asked = parser.parse_args().part
        if unknown := set(asked) - set(known):
            parser.error(f"there is {', '.join(known)} (got {', '.join(sorted(unknown))})")
        for part in asked or known:
            begun = time.perf_counter()
            for row in known[part]():
                row.say()
                found.append(row)
            sys.stdout.write(f"-- {part}: {time.perf_counter() - begun:.0f} s\n")
    met, wanted = sum(row.met is True for row in found), sum(row.target is not None for row in found)
    sys.stdout.write(f"{met} of {wanted} targets met, in {(time.perf_counter() - start) / 60.0:.1f} minutes\n")
    busy = os.getloadavg()[0]
    machine = {"processor": platform.processor() or platform.machine(), "cores": os.cpu_count(), "load": busy}
    versions = {"python": platform.python_version()} | {name: version(name) for name in ("numpy", "scipy", "numba")}
    told = {
        "machine": machine,
        "versions": versions,
        "pairs": PAIRS,
        "rows": [{**asdict(row), "met": row.met} for row in found],
    }
    OUT.parent.mkdir(parents=True, exist_ok=True)
    OUT.write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")
    sys.stdout.write(f"written to {OUT}; load of the machine at the end {busy:.1f}\n")


if __name__ == "__main__":
    main()
