"""The five changes that the page of the code shows: each is made in a copy of the package, and is there."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import pzd

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "pzd" / "README.md").read_text(encoding="utf-8")
SHOWN = re.findall(r"^<!-- (new file|change of): (\S+) -->\n```\w+\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
"""What each change does, the file that it touches, and the text of the page."""

Python = Callable[[str], str]


def changed(text: str, difference: str) -> str:
    """A text after a difference as the page shows it."""
    lines = difference.splitlines(keepends=True)
    before = "".join(line[1:] for line in lines if line[0] in " -")
    after = "".join(line[1:] for line in lines if line[0] in " +")
    assert text.count(before) == 1, f"the page shows lines that do not stand there once:\n{before}"
    return text.replace(before, after)


def made(folder: Path, *files: str) -> None:
    """Make the changes that touch these files in a copy of the package."""
    for kind, name, text in SHOWN:
        if name in files:
            path = folder / name
            old = path.read_text(encoding="utf-8") if path.exists() else ""
            assert path.exists() == (kind == "change of")
            path.write_text(changed(old, text) if old else text, encoding="utf-8")


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A folder with a copy of the package."""
    shutil.copytree(Path(pzd.__file__).parent, tmp_path / "pzd")  # with its bytecode, which takes long to make
    return tmp_path


@pytest.fixture
def python(copy: Path) -> Python:
    """Run code on the copy, and return what it prints."""

    def run(code: str) -> str:
        environment = {**os.environ, "PYTHONPATH": str(copy)}
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=copy, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_the_page_shows_five_changes_of_one_file_each() -> None:
    assert len({name for _, name, _ in SHOWN}) == len(SHOWN) == 5


def test_a_column_a_format_and_a_threshold_are_there(copy: Path, python: Python) -> None:
    made(copy, "pzd/report/tables.py", "pzd/rig/files/formats/dyn.py", "pzd/rig/preflight/motion.py")
    shown = python(
        "from pzd.damper.model import BaseRow\n"
        "from pzd.quantities import Control\n"
        "from pzd.report.tables import parameters\n"
        "row = BaseRow(voltage_V=0.0, T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=9e5)\n"
        "print(*parameters([row], Control()).lines(), sep='\\n')"
    )
    assert "C/k [ms]" in shown.splitlines()[0]
    assert " 3 " in shown.splitlines()[1]

    samples = (f"{i / 200} {20 * triangle(i / 200)} {500 * square(i / 200)}" for i in range(1600))
    (copy / "test.dyn").write_text("\n".join(["DYN1", *samples]) + "\n", encoding="utf-8")
    (copy / "lab.yaml").write_text(
        "rig: {files: [{path: test.dyn, columns: {time: time, displacement: displacement, "
        "force: force}}]}\ncar: false\n",
        encoding="utf-8",
    )
    found = python("from pzd.cli.app import status\nassert status(['check', 'lab.yaml', '-v']) == 0")
    assert "fewer than 12" in found


def triangle(t: float) -> float:
    """A triangle of 1 Hz between -1 and 1."""
    return 4.0 * abs((t + 0.25) % 1.0 - 0.5) - 1.0


def square(t: float) -> float:
    """The sign of its speed."""
    return -1.0 if (t + 0.25) % 1.0 < 0.5 else 1.0


@pytest.mark.ci
def test_an_effect_and_a_policy_are_there(copy: Path, python: Python) -> None:
    made(copy, "pzd/damper/effects/cubic_damping.py", "pzd/simulate/policies/suspension_damping.py")
    assert "cubic_damping" in python("from pzd.cli.app import status\nstatus(['effects'])")
    force = python(
        "import numpy as np\n"
        "from pzd.damper.compose import steady_force\n"
        "from pzd.damper.model import BaseRow, Damper\n"
        "base = (BaseRow(T0_N=300.0, C_Ns_per_m=1000.0, k_N_per_m=1e6),)\n"
        "damper = Damper(base=base, effects={'cubic_damping': {'c_3': 800.0}})\n"
        "print(steady_force(damper, None, None, np.array([0.5]))[0])"
    )
    assert float(force) == pytest.approx(300.0 + 1000.0 * 0.5 + 800.0 * 0.5**3)
    shutil.copy(ROOT / "configs" / "quickstart.yaml", copy / "quickstart.yaml")
    ride = "{fidelities: [ideal], policies: [passive, constant, suspension_damping], duration_s: 8, settle_s: 4}"
    (copy / "lab.yaml").write_text(f"extends: quickstart.yaml\nsimulate: {ride}\n", encoding="utf-8")
    python("from pzd.cli.app import status\nassert status(['simulate', 'lab.yaml']) == 0")
    summary = (copy / "runs" / "lab" / "5-simulate" / "summary.csv").read_text(encoding="utf-8")
    assert "suspension_damping" in summary
