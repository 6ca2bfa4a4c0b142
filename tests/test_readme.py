"""The README does as it says: its commands are run as they stand, its configs are read, its listings are printed.

The quick commands run in the order of the page on a small damper under the name of the quickstart; `make ci` runs all
of them as they stand, in a copy of the repository.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from listings import missing
from scipy.special import ndtri

import pzd
from pzd.cli.app import status
from pzd.config import load
from pzd.damper.effects import library
from pzd.damper.element import element_force

ROOT = Path(__file__).resolve().parent.parent
BLIND = "pzd blind configs/blind.yaml --set blind.cases=6 --set blind.seed=1 --set blind.tuning=true"
LONG = ("make demo", ". .venv/bin/activate", BLIND)
"""Commands of the README that install or take minutes: `make ci` alone runs them."""
SMALL: dict[str, Any] = {
    "rig": {
        "virtual": [
            {
                "damper": {
                    "base": [
                        {"voltage_V": 0, "T0_N": 301, "C_Ns_per_m": 2720, "k_N_per_m": 199000},
                        {"voltage_V": 150, "T0_N": 1325, "C_Ns_per_m": 2560, "k_N_per_m": 423000},
                    ]
                },
                "voltages_V": [0, 150],
                "rate_Hz": 250,
                "tests": [
                    {"waveform": {"kind": "sine", "frequency_Hz": 1, "amplitude_m": 0.03}, "cycles": 6},
                    {"waveform": {"kind": "sine", "frequency_Hz": 2, "amplitude_m": 0.02}, "cycles": 6},
                ],
                "noise": {"force": {"share_of_peak": 0.005}, "displacement": {"sd_m": 5e-6}},
            }
        ]
    },
    "diagnose": {"forbid": sorted(set(library()) - {"gas_spring", "orifice_quadratic"})},
    "table": {"speed_points": 8, "tolerance": 0.01},
    "simulate": {
        "roads": [{"kind": "sine", "frequency_Hz": 2.25, "amplitude_m": 0.02}],
        "policies": ["passive", "comfort"],
        "fidelities": ["table"],
        "duration_s": 4,
        "settle_s": 2,
    },
}
"""A virtual rig of four records, two candidates and two short rides: what the commands do, in seconds."""

MISTAKES = {
    "sign: {force: -1} ": "sign: {force: 1} ",
    "displacement: mm": "displacement: m",
    "force: load": "force: Load",
    ", force: kN": "",
    "<voltage>": "<voltag>",
    "temperature: 22 degC": "temperature: 22 degC, voltage: 100 V",
    "columns:": "colums:",
    "22 degC": "22",
}
"""Mistakes in the config of own files, in the order of their messages in the page of the configs."""


def page(name: str) -> str:
    """The text of a page."""
    return (ROOT / name).read_text(encoding="utf-8")


def typed(name: str) -> list[str]:
    """The commands that a page tells its reader to type, in order."""
    blocks = re.findall(r"^( *)```sh\n(.*?)^ *```", page(name), re.MULTILINE | re.DOTALL)
    return [line.strip() for _, block in blocks for line in block.splitlines() if line.strip()]


def marked(name: str, mark: str) -> str:
    """The fenced block of a page behind a comment."""
    found = re.search(rf"^<!-- {re.escape(mark)} -->\n```\w+\n(.*?)^```", page(name), re.MULTILINE | re.DOTALL)
    assert found, f"{name}: no block behind <!-- {mark} -->"
    return found[1]


def shell(command: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """A command typed in a folder."""
    return subprocess.run(
        ["bash", "-euc", command],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def clone(
    tmp_path: Path, pzd_here: Callable[..., subprocess.CompletedProcess[str]]
) -> Callable[[str], subprocess.CompletedProcess[str]]:
    """Type a command where `make demo` was run; a small damper takes the place of the quickstart."""
    (tmp_path / "configs").mkdir()
    (tmp_path / "configs" / "quickstart.yaml").write_text(yaml.safe_dump(SMALL, sort_keys=False), encoding="utf-8")
    shutil.copy(ROOT / "configs" / "aged.yaml", tmp_path / "configs")

    def run(command: str) -> subprocess.CompletedProcess[str]:
        """Do what a shell would, which expands patterns and writes to a file."""
        typed, _, written = command.partition(" > ")
        program, *words = shlex.split(typed)
        assert program == "pzd"
        expanded = [sorted(map(str, tmp_path.glob(word))) or [word] for word in words]
        done = pzd_here(*(name for names in expanded for name in names), cwd=tmp_path)
        if written:
            (tmp_path / written).write_text(done.stdout, encoding="utf-8")
        return done

    demo = re.search(r"^demo:.*\n((?:\t.*\n)+)", page("Makefile"), re.MULTILINE)
    assert demo
    assert "$(BIN)/pzd run configs/quickstart.yaml" in demo[1]
    done = run("pzd run configs/quickstart.yaml")
    assert done.returncode == 0, done.stdout + done.stderr
    return run


def test_the_readme_tells_its_reader_what_to_type() -> None:
    assert "pzd diagnose configs/quickstart.yaml" in typed("README.md")
    assert set(LONG) - set(typed("README.md")) == set()


def test_the_quick_commands_of_the_readme_run_one_after_the_other(
    clone: Callable[[str], subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    """A config that `pzd init` wrote gets the few candidates and short rides too: its defaults take half a minute."""
    short = yaml.safe_dump({key: SMALL[key] for key in ("diagnose", "table", "simulate")})
    for command in typed("README.md"):
        if command not in LONG:
            done = clone(command)
            assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
            if command.endswith("> my.yaml"):
                with (tmp_path / "my.yaml").open("a", encoding="utf-8") as file:
                    file.write(short)


def test_the_damper_of_a_run_predicts_a_motion_as_the_readme_says(
    clone: Callable[[str], subprocess.CompletedProcess[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    time = np.arange(1000) / 500.0
    names: dict[str, Any] = {"pzd": pzd, "t": time, "x": 0.02 * np.sin(3.0 * np.pi * time)}
    exec(marked("README.md", "own motion"), names)
    assert names["force"].shape == time.shape
    assert 800.0 < np.max(names["force"]) < 2000.0


@pytest.fixture
def own_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the rig files that the pages speak of: one hides a pause of the logger, one a spike.

    The damper is the plain element, with T0 of 300 N at 0 V and 1300 N at 150 V.
    """
    (tmp_path / "data").mkdir()
    spread = np.arange(1, 6001) ** 2 * (np.sqrt(5.0) - 1.0) / 2.0 % 1.0  # evenly spread: pages show the same numbers
    for frequency, amplitude in ((1, 30.0), (2, 15.0)):
        for voltage, friction in ((0, 300.0), (150, 1300.0)):
            time = np.arange(6000) / 1000
            position = amplitude * np.sin(2 * np.pi * frequency * time)
            force = element_force(position / 1000, 0.001, friction, 3000.0, 4e5)
            load = -np.round(force + 5.0 * ndtri(spread)) / 1000
            keep = np.ones(time.size, dtype=bool)
            if (frequency, voltage) == (1, 0):
                keep[2001:2020] = False
            if (frequency, voltage) == (2, 150):
                load[3210] += 2.5
            rows = [f"{t:.3f},{x:.3f},{f:.3f}" for t, x, f in zip(time[keep], position[keep], load[keep], strict=True)]
            text = "\n".join(["t,pos,load", *rows]) + "\n"
            (tmp_path / "data" / f"sine_{frequency}Hz_{voltage}V.csv").write_text(text, encoding="utf-8")
    (tmp_path / "my.yaml").write_text(marked("README.md", "config of own files"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_init_prints_what_the_page_of_the_configs_shows(own_files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = sorted(str(path.relative_to(own_files)) for path in own_files.glob("data/*.csv"))
    assert status(["init", *files]) == 0
    printed = capsys.readouterr().out.replace(ROOT.as_uri(), "file:///...")  # the folder in which pzd is installed
    assert printed == marked("configs/README.md", "printed by: pzd init data/*.csv")


def test_the_config_of_own_files_reads_them_and_check_prints_what_the_page_of_the_configs_shows(
    own_files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert status(["check", "my.yaml"]) == 0
    assert capsys.readouterr().out == marked("configs/README.md", "printed by: pzd check my.yaml")


def test_each_mistake_in_the_config_is_answered_as_the_page_of_the_configs_shows(
    own_files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    right = (own_files / "my.yaml").read_text(encoding="utf-8")
    answers = []
    for said, mistaken in MISTAKES.items():
        assert said in right
        (own_files / "wrong.yaml").write_text(right.replace(said, mistaken), encoding="utf-8")
        assert status(["check", "wrong.yaml"]) in {2, 3}
        answers.append(capsys.readouterr().err.splitlines()[0])
    assert answers == marked("configs/README.md", "printed by: pzd check wrong.yaml").splitlines()


def test_the_smallest_config_is_one(tmp_path: Path) -> None:
    (tmp_path / "smallest.yaml").write_text(marked("configs/README.md", "smallest config"), encoding="utf-8")
    (entry,) = load(tmp_path / "smallest.yaml").rig.files or ()
    assert entry.path == "data/*.csv"


@pytest.mark.ci
def test_every_command_of_the_readme_runs_in_a_fresh_copy_and_prints_what_it_shows(tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    kept = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    for name in kept:
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, copy / name)
    quiet = {"PYTHONPATH": "", "MAKEFLAGS": "", "MAKELEVEL": ""}
    for command in typed("README.md"):
        activated = command if command.startswith("make") else f". .venv/bin/activate; {command}"
        done = shell(activated, copy, **quiet)
        assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
        if f"<!-- printed by: {command} -->" in page("README.md"):
            assert missing(marked("README.md", f"printed by: {command}"), done.stdout) == []
