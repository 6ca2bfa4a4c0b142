"""Whether a claim holds by more than luck: the tests that draw, on seeds that nobody has chosen.

Runs every test that draws on so many new seeds. What failed is run again on the seed that it failed on, which tells
whether the seed decides, and on as many new ones, which tells how often. A test that fails more often than the
comment beside its bound says is wrong, or the code is; the command that is printed shows it again.

    python tests/studies/fresh.py [--seeds 20] [--jobs 2] [--not-ci] [tests/diagnosis ...]
"""

from __future__ import annotations

import argparse
import os
import secrets
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

NOTHING_TO_RUN = 5
"""What pytest returns where no test is chosen."""


def say(line: str) -> None:
    """Print at once: a run takes long."""
    print(line, flush=True)  # noqa: T201  # this is what the study is for


def options(seed: int, which: str = "draws") -> list[str]:
    """What pytest is told so that everything is drawn from one seed: hypothesis takes its own."""
    return ["-m", which, f"--hypothesis-seed={seed}"]


def run(seed: int, tests: Sequence[str], jobs: int, which: str) -> dict[str, bool]:
    """Whether each of the tests that a marker expression picks passed on a seed."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "results.xml"
        done = subprocess.run(
            [sys.executable, "-m", "pytest", *options(seed, which), "-q", "-n", str(jobs), "--tb=no",
             "-p", "no:cacheprovider", "-o", "junit_family=xunit1", f"--junitxml={path}", *tests],
            cwd=ROOT, env={**os.environ, "PZD_SEED": str(seed)}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode not in (0, 1):
            sys.exit(done.stdout + done.stderr if done.returncode != NOTHING_TO_RUN else "no such test draws")
        cases = ET.parse(path).getroot().iter("testcase")
        return {
            f"{case.get('file')}::{case.get('name')}": case.find("failure") is None and case.find("error") is None
            for case in cases
            if case.find("skipped") is None
        }


def main() -> int:
    """Print seed and rate of every test that failed; 1 if any did."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--not-ci", action="store_true", help="leave out what takes long")
    parser.add_argument("tests", nargs="*", default=[])
    asked = parser.parse_args()
    which = "draws and not ci" if asked.not_ci else "draws"

    tried: dict[str, int] = defaultdict(int)
    failed: dict[str, list[int]] = defaultdict(list)

    def on_new_seeds(tests: Sequence[str]) -> None:
        for _ in range(asked.seeds):
            seed, begun = secrets.randbits(32), time.monotonic()
            passed = run(seed, tests, asked.jobs, which)
            for test, well in passed.items():
                tried[test] += 1
                if not well:
                    failed[test].append(seed)
            wrong = [test for test, well in passed.items() if not well]
            say(f"seed {seed:10d}: {len(wrong)} of {len(passed)} failed, {time.monotonic() - begun:.0f} s")
            for test in wrong:
                say(f"    {test}")

    on_new_seeds(asked.tests)
    held = len(tried) - len(failed)
    again = {test: run(seeds[0], [test], 1, which) for test, seeds in failed.items()}
    if failed:
        say(f"{len(failed)} failed; these on as many seeds more:")
        on_new_seeds(sorted(failed))
    for test, seeds in sorted(failed.items()):
        decides = "fails again on the same seed" if not all(again[test].values()) else "NOT THE SEED: passes when alone"
        say(f"\n{test}\n  failed {len(seeds)} of {tried[test]} ({len(seeds) / tried[test]:.1%}); {decides}")
        say(f"  seeds {', '.join(map(str, seeds))}")
        say(f"  PZD_SEED={seeds[0]} python -m pytest {' '.join(options(seeds[0])[2:])} '{test}'")
    say(f"\n{held} of {len(tried)} tests that draw passed on all of {asked.seeds} seeds")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
