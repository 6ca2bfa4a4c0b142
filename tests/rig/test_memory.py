"""A long text file is read and checked in a small multiple of its size, whatever its dialect and its faults."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pzd.rig.preflight.sense import rows_of_cycles
from pzd.signals.cycles import Cycles

ROWS, MANY_ROWS = 300_000, 1_450_000
RATE_HZ, FREQUENCY_HZ = 1000.0, 5.0
MOST = 10.0
"""Memory beyond the imports, as a multiple of the file."""

CHECK = """
import resource, sys
from pzd.cli.app import status
assert status(["check", "small.yaml", "-q"]) == 0  # the imports, and buffers of fixed size
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
code = status(["check", "large.yaml", "-q"])
print(code, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


def plain(line: str) -> str:
    return line


def quoted(line: str) -> str:
    return ",".join(f'"{cell}"' for cell in line.split(","))


def with_semicolons(line: str) -> str:
    return line.replace(",", ";").replace(".", ",")


def write(folder: Path, name: str, rows: int, written: Callable[[str], str], options: str) -> int:
    """Write a config and a record of so many samples; return the size of the record."""
    time = np.arange(rows) / RATE_HZ
    angle = 2.0 * np.pi * FREQUENCY_HZ * time
    displacement, force = 0.02 * np.sin(angle), 300.0 * np.sign(np.cos(angle)) + 600.0 * np.cos(angle)
    path = folder / f"{name}.csv"
    with path.open("w", encoding="utf-8") as file:
        file.write(written("time_s,displacement_m,force_N") + "\n")
        for cells in zip(time.tolist(), displacement.tolist(), force.tolist(), strict=True):
            file.write(written("{:.3f},{:.9f},{:.6f}".format(*cells)) + "\n")
    (folder / f"{name}.yaml").write_text(f"rig:\n  files:\n    - path: {name}.csv\n{options}", encoding="utf-8")
    return path.stat().st_size


@pytest.mark.ci
@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss has another unit, or there is none")
@pytest.mark.parametrize(
    ("rows", "written", "options", "code"),
    [
        pytest.param(MANY_ROWS, plain, "", 0, id="plain, 47 MB"),
        pytest.param(ROWS, quoted, "", 0, id="quoted"),
        pytest.param(ROWS, plain, "      comment: '#'\n", 0, id="comments"),
        pytest.param(
            ROWS, with_semicolons, "      separator: ;\n", 3, id="decimal commas that the config does not say"
        ),
    ],
)
def test_checking_a_long_file_takes_at_most_ten_times_its_size(
    tmp_path: Path, rows: int, written: Callable[[str], str], options: str, code: int
) -> None:
    write(tmp_path, "small", 3000, plain, "")
    size = write(tmp_path, "large", rows, written, options)
    assert 8e6 < size * ROWS / rows < 12e6
    done = subprocess.run([sys.executable, "-c", CHECK], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    ended, kilobytes = map(int, done.stdout.split())
    assert ended == code, done.stderr
    assert 1024.0 * kilobytes < MOST * size


def test_the_rows_of_each_cycle_are_those_of_its_number() -> None:
    time = np.arange(-50, 1000) / 100.0
    run = Cycles(start=0.105, period=0.333, count=17)
    number = run.number(time)
    for k, rows in enumerate(rows_of_cycles(number, run.count)):
        assert np.arange(time.size)[rows].tolist() == np.flatnonzero(number == k).tolist()
