"""The first hour of a damper laboratory: from the files of its dyno to report and FMU, with what the wheel holds."""

from __future__ import annotations

import csv
import re
from datetime import datetime, timedelta
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from installed import Installed
from test_without_control import CONTROL

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion

CLICKERS = {"C02_R06": (110.0, 1500.0), "C08_R12": (120.0, 2600.0)}
"""Dry friction [N] and damping [N s/m] at two positions of the clickers."""
GAS, STIFFNESS = 90.0, 8e5
"""Force of the gas at mid-stroke [N], stiffness of the oil [N/m]."""
AMPLITUDE, SPEEDS, RATE = 0.025, (0.052, 0.131, 0.262, 0.393), 500.0
"""Of the crank [m], peak speeds of its tests [m/s], sampling rate [Hz]."""


def damper(clicker: str) -> Damper:
    friction, damping = CLICKERS[clicker]
    base = BaseRow(T0_N=friction, C_Ns_per_m=damping, k_N_per_m=STIFFNESS)
    return Damper(base=(base,), effects={"preload_offset": {"F_0": GAS}})


def driven(speed: float, cycles: float, rate: float) -> Motion:
    """A sine of the crank with this peak speed."""
    omega = speed / AMPLITUDE
    time = np.arange(round(cycles * 2.0 * np.pi / omega * rate) + 1) / rate
    x = AMPLITUDE * np.sin(omega * time)
    return Motion(time, x, speed * np.cos(omega * time), -(omega**2) * x)


def write_raw(folder: Path, rng: np.random.Generator) -> None:
    """One file a speed and clicker position, as a crank dyno writes them (layout `dyno_volts_units`)."""
    folder.mkdir()
    for clicker in CLICKERS:
        for speed in SPEEDS:
            motion = driven(speed, 7.0, RATE)
            running = motion.time >= 2.0 * np.pi * AMPLITUDE / speed  # the crank turns before it is recorded
            channels = (motion.time, motion.displacement, respond(damper(clicker), motion))
            time, x, force = (values[running] for values in channels)
            force = force + 0.004 * np.abs(force).max() * rng.standard_normal(force.size)
            begin = datetime(2024, 3, 25, 10, 59, 59)  # noqa: DTZ001  # a logger knows no zone
            rows = ["Timestamp,Load (V),Stroke (V),Load (N),Stroke (mm),Temp (C)"]
            for t, s, f in zip(time.tolist(), x, force, strict=True):
                when = (begin + timedelta(seconds=t)).isoformat(timespec="microseconds")
                rows.append(f"{when},{f / 500.0:.6f},{s * 100.0:.6f},{f:.2f},{s * 1e3:.4f},22.4")
            path = folder / f"{clicker}_150psi_{speed:.3f}mps.csv"
            path.write_text("\n".join(rows) + "\n", encoding="utf-8")


@pytest.mark.ci
def test_from_the_files_of_a_dyno_to_report_and_fmu(
    installed: Installed, tmp_path: Path, rng: np.random.Generator
) -> None:
    def pzd(*arguments: object) -> str:
        return installed.output("pzd", *arguments, cwd=tmp_path)

    write_raw(tmp_path / "raw", rng)
    files = sorted(path.relative_to(tmp_path) for path in (tmp_path / "raw").iterdir())
    (tmp_path / "my.yaml").write_text(pzd("init", *files), encoding="utf-8")
    assert pzd("check", "my.yaml").endswith("; the config is in order, nothing was written\n")
    assert "report: runs/my/6-report/report.html" in pzd("run", "my.yaml")

    run = tmp_path / "runs" / "my"
    text = (run / "6-report" / "report.html").read_text(encoding="utf-8")
    page = unescape(re.sub(r"<style>.*?</style>|<script.*?</script>|src=\"[^\"]*\"", "", text, flags=re.DOTALL))
    assert CONTROL.findall(page.replace("relief_valve", "").replace("relief valve", "")) == []
    for said in ("Peak-velocity plot (PVP)", "Continuous-velocity plot (CVP)", *CLICKERS):
        assert said in page
    check_plots(run / "2-identify")

    assert "export: runs/my/export/my-fmi2.fmu" in pzd("export", "my.yaml", "--to", "fmu")
    for version in (2, 3):
        check_fmu(run / "export" / f"my-fmi{version}.fmu", "C02_R06")


def check_plots(folder: Path) -> None:
    """PVP and CVP of each clicker position lie on its law: C v behind a first-order lag of C / k, friction, gas."""
    with (folder / "pvp.csv").open(encoding="utf-8", newline="") as file:
        peaks = list(csv.DictReader(file))
    with (folder / "cvp.csv").open(encoding="utf-8", newline="") as file:
        cycles = list(csv.DictReader(file))
    for clicker, (friction, damping) in CLICKERS.items():
        mine = [row for row in peaks if row["setting"] == clicker]
        assert [float(row["rebound_velocity_m_per_s"]) for row in mine] == pytest.approx(SPEEDS, rel=2e-3)
        for row, speed in zip(mine, SPEEDS, strict=True):
            law = friction + damping * speed
            assert float(row["rebound_force_N"]) == pytest.approx(GAS + law, rel=0.01)
            assert float(row["compression_force_N"]) == pytest.approx(GAS - law, rel=0.01)
        points = [row for row in cycles if row["setting"] == clicker]
        names = ("frequency_Hz", "displacement_m", "velocity_m_per_s", "force_N")
        f, x, v, force = (np.array([float(row[name]) for row in points]) for name in names)
        omega, lag = 2.0 * np.pi * f, damping / STIFFNESS
        law = GAS + friction * np.sign(v) + damping * (v + omega**2 * lag * x) / (1.0 + (omega * lag) ** 2)
        flowing = np.abs(v) > 0.5 * omega * AMPLITUDE
        assert np.count_nonzero(flowing) > 200
        np.testing.assert_allclose(force[flowing], law[flowing], atol=0.015 * np.abs(law).max())


def check_fmu(path: Path, clicker: str) -> None:
    """Driven by FMPy, the FMU gives the force of the damper that the files were written from."""
    fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed: pip install fmpy")
    motion = driven(0.3, 2.0, 1000.0)
    columns = {"time": motion.time, "displacement": motion.displacement, "velocity": motion.velocity}
    given = np.array(list(zip(*columns.values(), strict=True)), dtype=[(name, np.double) for name in columns])
    end = float(motion.time[-1])
    found = fmpy.simulate_fmu(path, stop_time=end, output_interval=1e-3, input=given, output=["force"])
    truth = np.interp(found["time"], motion.time, respond(damper(clicker), motion))
    settled = found["time"] > 0.5 * end
    np.testing.assert_allclose(found["force"][settled], truth[settled], atol=0.03 * np.abs(truth).max())
