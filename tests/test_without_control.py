"""A passive damper with a clicker and no control signal, from raw files to its report, without a car."""

from __future__ import annotations

import re
from collections.abc import Callable
from html import unescape
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest

from pzd.config import load
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.schema.errors import ConfigError

CONTROL = re.compile(r"(?i)volt|\bcontrol|\bvalve\b|\d[\s\u00a0]V\b")
"""Words about a control signal; `relief_valve` is an effect."""
CONFIG = """\
car: false
setting: click1
rig:
  files:
    - path: raw/*.csv
      columns: {time: t, displacement: pos, force: load}
      units: {time: s, displacement: mm, force: kN}
      pattern: '^(?P<setting>click[0-9]+)-'
diagnose: {most_effects: 1}
"""
SPEEDS = (0.131, 0.262, 0.524)


def write_raw(folder: Path, rng: np.random.Generator) -> None:
    """Sines of equal amplitude and rising speed on two settings, in mm and kN, with noise."""
    folder.mkdir()
    for click, damping in ((1, 1800.0), (5, 3000.0)):
        base = BaseRow(T0_N=120.0, C_Ns_per_m=damping, k_N_per_m=4e5)
        damper = Damper(base=(base,), effects={"preload_offset": {"F_0": 90.0}})
        for speed in SPEEDS:
            omega = speed / 0.025
            time = np.arange(round(6 * 2.0 * np.pi / omega * 500.0)) / 500.0
            x, v = 0.025 * np.sin(omega * time), speed * np.cos(omega * time)
            force = respond(damper, Motion(time, x, v, -(omega**2) * x))
            force += 0.003 * np.abs(force).max() * rng.standard_normal(time.size)
            lines = [f"{t:.4f},{1e3 * a:.5f},{1e-3 * f:.6f}" for t, a, f in zip(time, x, force, strict=True)]
            text = "\n".join(["t,pos,load", *lines]) + "\n"
            (folder / f"click{click}-{speed:g}.csv").write_text(text, encoding="utf-8")


@pytest.mark.ci
def test_from_raw_files_to_the_report_nothing_speaks_of_a_control(
    tmp_path: Path, rng: np.random.Generator, pzd: Callable[..., CompletedProcess[str]]
) -> None:
    write_raw(tmp_path / "raw", rng)
    config = tmp_path / "passive.yaml"
    config.write_text(CONFIG, encoding="utf-8")
    said = []
    for command in ("check", "run", "show", "diagnose"):
        done = pzd(command, config, "--runs", tmp_path / "runs", "-v")
        assert done.returncode == 0, done.stderr
        said.append(done.stdout + done.stderr)
    run = tmp_path / "runs" / "passive"
    assert not (run / "5-simulate").exists()
    page = (run / "6-report" / "report.html").read_text(encoding="utf-8")
    page = re.sub(r"<style>.*?</style>|<script.*?</script>|src=\"[^\"]*\"", "", page, flags=re.DOTALL)
    for text in (*said, unescape(page)):
        assert CONTROL.findall(text.replace("relief_valve", "").replace("relief valve", "")) == []
    assert "Peak-velocity plot (PVP)" in page
    shown = re.findall(r"click1 +([\d.]+) +([\d.]+) +(-[\d.]+)", said[2])
    assert [float(speed) for speed, _, _ in shown] == pytest.approx(SPEEDS, rel=2e-3)
    for speed, rebound, compression in shown:
        viscous = 120.0 + 1800.0 * float(speed)
        assert float(rebound) == pytest.approx(viscous + 90.0, rel=0.02)
        assert float(compression) == pytest.approx(-viscous + 90.0, rel=0.02)
    # at 0.131 m/s and more the 90 N may as well be an asymmetry of the damping
    assert re.search(r"click1 +cannot be told from asymmetry +1[12]\d", said[2])


@pytest.mark.parametrize(
    ("stages", "fault"),
    [
        ("[rig, identify]", "1:9: stages: .* must be rig, identify, diagnose, table, simulate, report in this order"),
        ("[rig, diagnose, identify, table, report]", "1:9: stages: is the former spelling of car, and must be rig"),
        ("[rig, identify, diagnose, table, rides, report]", "say car: true, or car: false"),
        ("[rig, identify, diagnose, table, report]\ncar: false", "1:1: stages: .* take this key away"),
        (
            "[rig, identify, diagnose, table, report]\nsimulate: {duration_s: 9}",
            "simulate: car: false leaves the rides",
        ),
    ],
)
def test_the_former_spelling_of_car_is_refused_where_it_leaves_out_another_stage(
    tmp_path: Path, stages: str, fault: str
) -> None:
    config = tmp_path / "c.yaml"
    config.write_text(f"stages: {stages}\nrig: {{files: [{{path: a.csv}}]}}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=fault):
        load(config)


def test_the_ride_that_is_left_out_is_no_command(
    tmp_path: Path, pzd_here: Callable[..., CompletedProcess[str]]
) -> None:
    config = tmp_path / "c.yaml"
    config.write_text(CONFIG, encoding="utf-8")
    done = pzd_here("simulate", config)
    assert done.returncode == 2
    assert done.stderr == "pzd simulate: car: false leaves the rides out; take this key out of the config\n"
