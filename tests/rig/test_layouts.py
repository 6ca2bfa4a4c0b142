"""Layouts: each that comes with pzd is found for its file and reads every value; what an entry says goes first."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_formats import mdf, mts, tdms
from written_files import FORCE, TIME, X, lines, run, write, wrong

from pzd.artefacts import Rig
from pzd.cli.app import status
from pzd.config import load
from pzd.export.formats import formats as exports
from pzd.quantities import Control
from pzd.rig.files.formats import formats
from pzd.rig.files.guess import guessed
from pzd.rig.files.layout import all_layouts
from pzd.rig.stage import ingest

INCH, KIP, POUND = 0.0254, 4448.2216152605, 4.4482216152605
"""Inch [m], kip and pound-force [N], by definition."""
STAMPS = [(datetime(2024, 3, 25, 10, 59, 59) + timedelta(seconds=t)).isoformat(timespec="microseconds") for t in TIME]  # noqa: DTZ001  # a logger knows no zone
WARM = 22.0 + 0.0 * TIME


def stamped(at: float) -> list[str]:
    begin = datetime(2022, 4, 29, 12, 11, 14) + timedelta(seconds=at)  # noqa: DTZ001  # a logger knows no zone
    return [(begin + timedelta(seconds=t)).strftime("%m/%d/%Y %I:%M:%S.%f %p") for t in TIME.tolist()]


def logger(path: Path, first: np.ndarray, second: np.ndarray) -> None:
    """A preamble, volts, five tests with pauses between them, an event only where there is one."""
    text = ["Header Size:  7", "Version:  2", "Sampling Interval:  0.002", "Sampling Rate:  500", "Sample Count:  2500"]
    text += ["Device Serial Number:  0", "Sample Number, Date/Time, CHANNEL0, CHANNEL1, Events"]
    for test in range(5):
        rows = zip(stamped(30.0 * test), first, second, strict=True)
        body = [f"{500 * test + n + 1:10d},   {when}, {a:.9g}, {b:.9g}" for n, (when, a, b) in enumerate(rows)]
        body[0] += ", DAQ Resume" if test else ", DAQ Start"
        body[-1] += ", DAQ Pause" if test < 4 else ", DAQ Pause, DAQ Stop"
        text += body
    write(path, text)


def text(path: Path, columns: dict[str, Any], **how: Any) -> None:
    encoding = how.pop("encoding", "utf-8")
    below = [how.pop("units")] if "units" in how else []
    head, *rows = lines(columns, **how)
    write(path, [head, *below, *rows], encoding)


def servo(path: Path) -> None:
    columns = {"Axial Force": FORCE / KIP, "Axial Displacement": X / INCH, "Running Time": TIME}
    mts(path, columns, {"Axial Force": "kip", "Axial Displacement": "in", "Running Time": "Sec"}, blocks=2)


def valve(path: Path) -> None:
    columns = {
        "Running Time": TIME,
        "Axial Displacement": X * 1e3,
        "Axial Load": FORCE,
        "CDC 1 Current FB_1": WARM / 22,
    }
    mts(path, columns, dict(zip(columns, ("s", "mm", "N", "A"), strict=True)))


def labview(path: Path) -> None:
    columns = {"time": TIME, "Position": X * 1e3, "Load": FORCE / 1e3, "Coil Current": WARM / 22}
    tdms(path, columns, dict(zip(columns, ("s", "mm", "kN", "A"), strict=True)))


def vehicle(path: Path) -> None:
    columns = {"time": TIME, "RigStroke": X * 1e3, "RigForce": FORCE, "ValveVoltage": WARM / 22}
    mdf(path, columns, dict(zip(columns, ("s", "mm", "N", "V"), strict=True)))


def matlab(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"Tout": TIME[:, None], "dist": X[:, None] * 1e3, "forc": FORCE[:, None], "Ts": 0.002})


def arrays(path: Path) -> None:
    keys = {"time [s]": TIME, "displacement [mm]": X * 1e3, "force [kN]": FORCE / 1e3}
    path.write_text(json.dumps({key: values.tolist() for key, values in keys.items()}), encoding="utf-8")


def dyno(path: Path) -> None:
    volts = {"Load (V)": FORCE / 500.0, "Stroke (V)": X * 100.0}
    text(path, {"Timestamp": STAMPS, **volts, "Load (N)": FORCE, "Stroke (mm)": X * 1e3, "Temp (C)": WARM})


def us(path: Path) -> None:
    columns = {"Time (sec)": TIME, "Displacement (in)": X / INCH, "Velocity (in/sec)": np.gradient(X, TIME) / INCH}
    text(path, columns | {"Force (lbs)": FORCE / POUND, "Temp (F)": WARM * 1.8 + 32.0})


GERMAN = {"separator": ";", "decimal": ",", "encoding": "latin-1"}
VOLTS = (FORCE / 980.665, X * 100.0)
FILES: dict[str, tuple[str, Callable[[Path], None], int]] = {
    "dyno_volts_units": ("C08_R12_150psi_0.131mps.csv", dyno, 1),
    "german_dyno": (
        "a.txt",
        lambda p: text(
            p, {"Zeit [s]": TIME, "Weg [mm]": X * 1e3, "Kraft [N]": FORCE, "Temperatur [°C]": WARM}, **GERMAN
        ),
        1,
    ),
    "german_units_row": (
        "a.csv",
        lambda p: text(p, {"Prüfzeit": TIME, "Standardweg": X * 1e3, "Standardkraft": FORCE}, units="s;mm;N", **GERMAN),
        1,
    ),
    "json_units_in_keys": ("a.json", arrays, 1),
    "labview_valve_current": ("a.tdms", labview, 1),
    "mdf_valve_voltage": ("a.mf4", vehicle, 1),
    "press_logger_force_first": ("ME10mm5Hz.txt", lambda p: logger(p, *VOLTS), 5),
    "press_logger_force_second": ("ME10mm5Hz.txt", lambda p: logger(p, *reversed(VOLTS)), 5),
    "servo_kip_inch": ("specimen.dat", servo, 2),
    "servo_valve_current": ("specimen.dat", valve, 1),
    "shaking_table_mat": ("ensaio.A.1.mat", matlab, 1),
    "testing_machine_kn": (
        "a.csv",
        lambda p: text(
            p,
            {
                "Total Time (s)": TIME,
                "Position(Linear:Digital Position) (mm)": X * 1e3,
                "Load(Linear:Load) (kN)": FORCE / 1e3,
            },
        ),
        1,
    ),
    "us_dyno": ("a.csv", us, 1),
}
every_layout = pytest.mark.parametrize("name", FILES)


def read_back(folder: Path, said: list[str]) -> Rig:
    (folder / "own").mkdir()
    (folder / "own" / "guess.yaml").write_text("\n".join(said), encoding="utf-8")
    config = load(folder / "own" / "guess.yaml")
    return ingest(config.rig, config.control.signal(), folder)


def test_every_layout_that_comes_with_pzd_has_its_file_here(tmp_path: Path) -> None:
    assert set(all_layouts(tmp_path)) == set(FILES)
    assert len(FILES) >= 12


@every_layout
def test_init_finds_the_layout_of_a_file_and_it_reads_every_value(tmp_path: Path, name: str) -> None:
    file, written, tests = FILES[name]
    written(tmp_path / file)
    said = guessed([tmp_path / file])
    assert [line.split()[1] for line in said if "layout:" in line] == [name]
    assert said == guessed([tmp_path / file], layout=name)
    rig = read_back(tmp_path, said)
    assert len(rig.records) == tests
    for record in rig.records:
        assert record.time - record.time[0] == pytest.approx(TIME, abs=1e-6)
        assert record.displacement == pytest.approx(X, abs=1e-9)
        assert record.force == pytest.approx(FORCE, abs=1e-4)


def test_a_layout_of_another_control_signal_says_how_the_config_declares_it(tmp_path: Path) -> None:
    name, (file, written, _) = next((name, each) for name, each in FILES.items() if each[1] is valve)
    written(tmp_path / file)
    (said,) = wrong(tmp_path, {"path": file, "layout": name})
    ((control, unit),) = re.findall(r"say at the top of the config control: \{name: (\w+), unit: (\w+)\}", said)
    assert len(run(tmp_path, {"path": file, "layout": name}, control=Control(control, unit)).records) == 1


def test_clickers_pressure_temperature_and_currents_come_with_their_layouts(tmp_path: Path) -> None:
    dyno(tmp_path / "C08_R12_150psi_0.131mps.csv")
    (record,) = run(tmp_path, {"path": "*.csv", "layout": "dyno_volts_units"}).records
    assert record.setting == "C08_R12"
    assert record.pressure == pytest.approx(150.0 * 6894.757293168, rel=1e-9)
    assert record.median_temperature() == 22.0
    logger(tmp_path / "ME10mm5Hz.txt", *VOLTS)
    rig = read_back(tmp_path, guessed([tmp_path / "ME10mm5Hz.txt"]))
    assert [entry.voltage_V for entry in rig.entries] == [0.0, 0.25, 0.5, 0.75, 1.0]


def test_files_whose_channels_stand_in_another_order_are_told_apart(tmp_path: Path) -> None:
    logger(tmp_path / "ME10mm5Hz.txt", *VOLTS)
    logger(tmp_path / "ME10mm3Hz.txt", *reversed(VOLTS))
    said = guessed(sorted(tmp_path.glob("ME*.txt")))
    assert sum(line.startswith("control:") for line in said) == 1
    rig = read_back(tmp_path, said)
    assert len(rig.records) == 10
    for record in rig.records:
        assert record.force == pytest.approx(FORCE, abs=1e-4)


def test_the_real_exports_of_the_press_are_found_and_read(shared: Path, tmp_path: Path) -> None:
    files = sorted((shared / "data" / "utfsm-mr" / "raw").glob("*.txt"))
    said = guessed(files)
    assert [line.split()[1] for line in said if "layout:" in line] == ["press_logger_force_first"]
    assert len(read_back(tmp_path, said).records) == 5 * len(files)


def test_the_scale_of_one_press_is_not_proposed_for_the_logger_of_another(tmp_path: Path) -> None:
    logger(tmp_path / "ours.txt", *VOLTS)
    said = "\n".join(guessed([tmp_path / "ours.txt"]))
    assert "layout:" not in said
    assert "skip: 6" in said
    assert "split: {event: Events, begins: DAQ Resume}" in said
    assert said.count("fill in: one of") == 2


def test_what_an_entry_says_goes_before_its_layout_key_by_key(tmp_path: Path) -> None:
    us(tmp_path / "a.csv")
    units = {"force": "kN", "temperature": "degC"}
    rig = run(tmp_path, {"path": "a.csv", "layout": "us_dyno", "units": units, "columns": {"velocity": ""}})
    (record,) = rig.records
    assert record.force == pytest.approx(FORCE / POUND * 1e3, abs=1e-2)
    assert record.median_temperature() == pytest.approx(1.8 * 22.0 + 32.0)
    assert "velocity" not in {row.quantity for row in rig.ingested}


OWN = """about: our own
columns: {time: t, displacement: x, force: f}
units: {time: ms, displacement: mm, force: N}
"""


def test_a_layout_beside_the_config_is_found_and_a_change_of_it_makes_the_run_stale(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text(tmp_path / "a.csv", {"t": TIME * 1e3, "x": X * 1e3, "f": FORCE})
    (tmp_path / "ours.yaml").write_text(OWN, encoding="utf-8")
    (tmp_path / "my.yaml").write_text("", encoding="utf-8")  # as the shell makes it for `pzd init a.csv > my.yaml`
    assert status(["init", "a.csv"]) == 0
    printed = capsys.readouterr().out
    assert "layout: ours" in printed
    (tmp_path / "my.yaml").write_text(printed, encoding="utf-8")
    assert status(["ingest", "my.yaml"]) == 0
    assert status(["ingest", "my.yaml"]) == 0
    assert "fresh" in capsys.readouterr().out
    (tmp_path / "ours.yaml").write_text(OWN.replace("mm,", "cm,"), encoding="utf-8")
    assert status(["ingest", "my.yaml"]) == 0
    assert "ours.yaml has changed" in capsys.readouterr().out


def test_a_layout_that_was_asked_for_and_does_not_fit_names_the_file_as_it_was_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    dyno(tmp_path / "C08_R12_150psi_0.131mps.csv")
    monkeypatch.chdir(tmp_path)
    assert status(["init", "C08_R12_150psi_0.131mps.csv", "--layout", "us_dyno"]) == 3
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 5
    assert all(line.startswith("C08_R12_150psi_0.131mps.csv:1: missing column") for line in said)


def test_wrong_layouts_are_refused_with_file_and_line(tmp_path: Path) -> None:
    us(tmp_path / "a.csv")
    (said,) = wrong(tmp_path, {"path": "a.csv", "layout": "us_dino"})
    assert "rig.files.0.layout: no such layout" in said
    assert "did you mean us_dyno? (got 'us_dino')" in said
    (tmp_path / "ours.yaml").write_text(OWN + "unit: {}\nlayout: us_dyno\n", encoding="utf-8")
    said = "\n".join(wrong(tmp_path, {"path": "a.csv", "layout": "ours"}))
    assert "ours.yaml:4:1: unit: no such key; did you mean units?" in said
    tdms(tmp_path / "b.tdms")
    (said,) = wrong(tmp_path, {"path": "b.tdms", "layout": "labview_valve_current"})
    assert "say at the top of the config control: {name: current, unit: A}" in said


# ---------------------------------------------------------------- the ingest report


def test_the_ingest_report_lists_everything_that_was_done(tmp_path: Path) -> None:
    head, *rows = lines({"t": TIME, "pos [mm]": X * 1e3, "load": -FORCE, "spare": FORCE})
    write(tmp_path / "100V.csv", ["Bench 3", head, *rows[:99], "# a remark", *rows[99:]])
    entry = {
        "path": "100V.csv",
        "skip": 1,
        "comment": "#",
        "columns": {"time": "t", "displacement": "pos [mm]", "force": "load"},
        "units": {"time": "s", "force": "N", "voltage": "V"},
        "sign": {"force": -1},
        "pattern": "(?P<voltage>[0-9]+)V",
        "fixture": {"mass_kg": 0.1},
        "split": {"gap_s": 1},
    }
    rig = run(tmp_path, entry)
    assert [(row.step, row.quantity, row.was, row.became) for row in rig.ingested] == [
        ("left out", None, "1 line above the header", ""),
        ("left out", None, "1 line that begin with '#'", ""),
        ("read", None, "lines 3 to 503", "500 rows"),
        ("left out", None, "columns spare", ""),
        ("rename", "time", "column 't'", "time_s"),
        ("rename", "displacement", "column 'pos [mm]'", "displacement_m"),
        ("unit", "displacement", "mm", "m: times 0.001"),
        ("rename", "force", "column 'load'", "force_N"),
        ("sign", "force", "as recorded", "times -1"),
        ("value", "voltage", "no column; pattern", "100 V"),
        ("fixture", None, "inertia of 0.1 kg", "taken out"),
    ]
    assert {(row.record, row.file) for row in rig.ingested} == {("100V", "100V.csv")}
    (tmp_path / "1-rig").mkdir()
    rig.write(tmp_path / "1-rig", Control())
    assert Rig.read(tmp_path / "1-rig", Control()).ingested == rig.ingested


def test_degrees_fahrenheit_are_reported_with_their_zero(tmp_path: Path) -> None:
    us(tmp_path / "a.csv")
    rig = run(tmp_path, {"path": "a.csv", "layout": "us_dyno"})
    (said,) = [row.became for row in rig.ingested if row.step == "unit" and row.quantity == "temperature"]
    assert said == "degC: times 0.5555555556 -17.77777778"


# ---------------------------------------------------------------- the page


def test_every_format_read_or_written_and_every_layout_is_in_the_page_of_the_configs(
    root: Path, tmp_path: Path
) -> None:
    page = (root / "configs" / "README.md").read_text(encoding="utf-8")
    assert [name for name in formats() if f"| `{name}` |" not in page] == []
    assert [name for name, one in exports().items() if f"| `{name}` | {one.meaning}" not in page] == []
    shown = {name: layout.about for name, layout in all_layouts(tmp_path).items()}
    assert [name for name, about in shown.items() if f"| `{name}` | {about} |" not in page] == []


def test_a_config_by_a_layout_is_as_short_as_the_page_shows(root: Path, tmp_path: Path) -> None:
    page = (root / "configs" / "README.md").read_text(encoding="utf-8")
    shown = re.search(r"<!-- config by a layout -->\n```yaml\n(.*?)```", page, re.DOTALL)
    assert shown is not None
    (tmp_path / "my.yaml").write_text(shown[1], encoding="utf-8")
    (tmp_path / "data").mkdir()
    dyno(tmp_path / "data" / "C08_R12_150psi_0.131mps.csv")
    assert len(ingest(load(tmp_path / "my.yaml").rig, Control(), tmp_path).records) == 1
