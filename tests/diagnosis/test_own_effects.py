"""Effect files of one's own: proposed from what a diagnosis left, loaded from the folder of PZD_EFFECTS, and forced."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic import TWO, damper_of, sines

from pzd.compiled import sources
from pzd.damper.confounders import known
from pzd.own_effects import own_files, own_folder
from pzd.pipeline.dependencies import code_hash
from pzd.quantities import DISPLACEMENT, FORCE, TIME, VOLTAGE, Control
from pzd.schema.csvfile import write_columns

ROOT = Path(__file__).resolve().parents[2]
TESTS = ((0.5, 0.03), (1.0, 0.02), (1.0, 0.03), (2.0, 0.02))
BYPASS = 30000.0
"""Coefficient of |x| v [N s/m2]."""
Pzd = Callable[..., "subprocess.CompletedProcess[str]"]

DETENT = """
from pzd.damper.effect import Effect, Parameter, Search

EFFECT = Effect(
    name="{name}",
    place="parallel",
    law="F_d",
    parameters=(Parameter("F_d", "N", 0.0, -1.0e6, 1.0e6, "force", Search(lambda s: s.force, (0.05,))),),
    source="made up for a test",
    tests=(({{"F_d": 100.0}}, 100.0),),
    {ending}
)


def law(F_d: float) -> float:
    return F_d
"""
NEVER_NAMED = 'never_named="made up",'


@pytest.fixture
def own(tmp_path: Path) -> Pzd:
    """pzd in a folder, with PZD_EFFECTS naming `mine` in it."""

    def run(*arguments: object, effects: str = "mine") -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PZD_EFFECTS": effects}
        command = [sys.executable, "-m", "pzd", *map(str, arguments)]
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)

    return run


def write(folder: Path, file: str, name: str, ending: str = NEVER_NAMED) -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / f"{file}.py"
    path.write_text(DETENT.format(name=name, ending=ending), encoding="utf-8")
    return path


def test_an_effect_file_of_ones_own_is_in_the_library(own: Pzd, tmp_path: Path) -> None:
    write(tmp_path / "mine", "detent", "detent")
    listed = own("effects")
    assert listed.returncode == 0, listed.stderr
    assert "detent" in {line.split()[0] for line in listed.stdout.splitlines()}
    assert "detent" not in own("effects", effects="").stdout


IN_EACH = """
import os, sys
import numpy, pydantic, yaml  # what `pzd effects` loads whatever the folder, once for all
from pzd.cli.app import status
assert "pzd.damper.effects" not in sys.modules
for folder in sys.argv[1:]:
    print(f"in {folder}", file=sys.stderr, flush=True)
    if not (child := os.fork()):
        os.environ["PZD_EFFECTS"] = folder
        code = status(["effects"])
        sys.stderr.flush()
        os._exit(code)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""
"""`pzd effects` in each of some folders, forked from one process: a new one takes long to start."""
REFUSED = [
    ("gas_spring", "gas_spring", NEVER_NAMED, "the library has an effect of that name"),
    ("detent", "other", NEVER_NAMED, "must be called other.py"),
    ("detent", "detent", "", "nor why no verdict names it"),
    ("detent", "detent", "broken=1,", "is no effect file: TypeError"),
]


def test_a_folder_or_a_file_that_cannot_be_taken_is_one_clear_error(tmp_path: Path) -> None:
    paths = [write(tmp_path / f"{i}", file, name, ending) for i, (file, name, ending, _) in enumerate(REFUSED)]
    expected = [(str(path), said) for path, (*_, said) in zip(paths, REFUSED, strict=True)]
    nowhere = tmp_path / "nowhere"
    expected.append((str(nowhere), "PZD_EFFECTS: there is no folder of that name"))
    folders = [*(str(path.parent) for path in paths), str(nowhere)]
    command = [sys.executable, "-c", IN_EACH, *folders]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["2"] * len(folders)
    lines = done.stderr.splitlines()
    assert lines[::2] == [f"in {folder}" for folder in folders]
    assert len(lines) == 2 * len(folders)
    for line, (place, said) in zip(lines[1::2], expected, strict=True):
        assert place in line
        assert said in line


def test_kernels_and_stages_depend_on_the_files_of_ones_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert known()  # imported without them
    monkeypatch.setenv("PZD_EFFECTS", str(tmp_path))
    hashes = set[str]()
    for ending in (NEVER_NAMED, 'never_named="otherwise",'):
        path = write(tmp_path, "detent", "detent", ending)
        code_hash.cache_clear()
        hashes.add(code_hash("pzd.diagnosis.stage"))
        assert (own_folder(), own_files()) == (tmp_path, [path])
        assert path in sources()
    monkeypatch.delenv("PZD_EFFECTS")
    code_hash.cache_clear()
    hashes.add(code_hash("pzd.diagnosis.stage"))
    assert len(hashes) == 3


CONFIG = """
rig: {files: [{path: data/*.csv}]}
diagnose: {most_added: 0, forbid: [asymmetry, end_stop, lash, relief_valve, rounded_yield, shear_thinning]}
"""


@pytest.mark.ci
def test_the_hypothesis_is_written_as_an_effect_file_and_closes_the_gap_when_forced(
    own: Pzd, tmp_path: Path, rng: np.random.Generator
) -> None:
    (tmp_path / "data").mkdir()
    for record in sines(damper_of(TWO), rng, TWO, tests=TESTS, cycles=6, noise=3e-3, colour=0.5):
        force = record.force + BYPASS * np.abs(record.displacement) * record.velocity
        channels = {TIME: record.time, DISPLACEMENT: record.displacement, FORCE: force, VOLTAGE: record.voltage}
        columns = {quantity.column: channel for quantity, channel in channels.items()}
        write_columns(tmp_path / "data" / f"{record.name}.csv", columns, Control())
    (tmp_path / "bypass.yaml").write_text(CONFIG, encoding="utf-8")

    def diagnosed(config: str) -> Any:
        done = own("diagnose", f"{config}.yaml", "-q")
        assert done.returncode in (0, 4), done.stderr
        return json.loads((tmp_path / "runs" / config / "3-diagnose" / "diagnosis.json").read_text("utf-8"))

    (tmp_path / "mine").mkdir()
    assert diagnosed("bypass")["verdict"] == "unexplained"
    shown = own("show", "bypass.yaml").stdout
    assert "hypothesis: c |x| v, c = " in shown
    written = own("effects", "--propose", "runs/bypass")
    assert written.returncode == 0, written.stderr
    assert "mine/abs_x_v.py" in written.stdout
    assert own("effects", "--propose", "runs/bypass").returncode == 2  # nothing is written over

    forced = CONFIG.replace("diagnose: {", "diagnose: {force: [abs_x_v], ")
    (tmp_path / "forced.yaml").write_text(forced, encoding="utf-8")
    after = diagnosed("forced")
    assert after["effects"] == ["abs_x_v"]
    assert after["parameters"]["abs_x_v"]["c"]["value"] == pytest.approx(BYPASS, rel=0.05)
    assert after["prediction"]["W_s"] < 0.2 * after["prediction"]["W_s_plain"]
