"""Small files as the recorders and machines that are sold write them: init proposes, a person fills in, check reads.

Each is written here after the layout that its maker publishes or that its users show, by code that shares nothing with
the reader; every one is the same test, 15 mm at 2 Hz on a damper of 1200 N s/m and 150 N of friction.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pzd.config import load
from pzd.quantities import DISPLACEMENT, VELOCITY, Control
from pzd.record import Array
from pzd.rig.config import FilesEntry, RigConfig
from pzd.rig.files.guess import guessed
from pzd.rig.files.sniffing import quantity_of
from pzd.rig.stage import ingest
from pzd.schema.errors import ConfigError, DataError

RATE, SAMPLES = 500.0, 1000
TIME = np.arange(SAMPLES) / RATE
OMEGA = 4.0 * np.pi
X, V = 0.015 * np.sin(OMEGA * TIME), 0.015 * OMEGA * np.cos(OMEGA * TIME)
FORCE = 1200.0 * V + 150.0 * np.tanh(V / 2e-3)
MM, INCH, POUND = 1e3 * X, X / 0.0254, FORCE / 4.4482216152605


def table(*columns: Sequence[str] | Array, by: str = ",", decimal: str = ".", end: str = "") -> Iterator[str]:
    """Rows of cells, numbers to nine digits."""
    for row in zip(*columns, strict=True):
        yield by.join(c if isinstance(c, str) else f"{c:.9g}".replace(".", decimal) for c in row) + end


@dataclass(frozen=True)
class Recorded:
    """A file, and what a person fills in or changes of what init proposes."""

    lines: tuple[str, ...]
    suffix: str = "csv"
    encoding: str = "utf-8"
    columns: dict[str, str] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    rate_Hz: float | None = None
    fineness: tuple[float, float, float] = (1e-6, 1e-8, 1e-3)
    """Largest difference of time [s], displacement [m] and force [N]."""


CLOCK = [f"{int(t)}.{round(1e3 * (t - int(t))):03d}" for t in TIME]
SCOPE = {"displacement": "10 mm", "force": "100 N"}
"""What a volt stands for."""
SETTINGS = [("Record Length", "1000"), ("Sample Interval", "0.002"), ("Trigger Point", "0"), ("Source", "CH1")]
"""Of a scope, beside the first rows."""
FILES = {
    "Hioki, settings of each channel above": Recorded(
        (
            '"File name","WAVE0001.CSV","V1.00"',
            '"Title comment",""',
            "\"Start trigger time\",\"'24-06-30 15:53:03\"",
            '"CH","CH1","CH2","CH3","CH4",',
            '"Mode","DC","DC","DC","DC",',
            '"Range","500mV","2V","5V","50V",',
            '"Comment","Stroke","Load","","",',
            '"Scaling","On","On","Off","Off",',
            '"Ratio"," 1.00000E+01"," 5.00000E+02"," 1.00000E+00"," 1.00000E+00",',
            '"Offset"," 0.00000E+00"," 0.00000E+00"," 0.00000E+00"," 0.00000E+00",',
            '"Time","CH1[mm]","CH2[N]","CH3[V]","CH4[V]",',
            *(f"{t:.9E},{x: .7E},{f: .7E}, 1.00000E-03,-2.57813E+00," for t, x, f in zip(TIME, MM, FORCE, strict=True)),
        ),
        columns={"displacement": "CH1[mm]", "force": "CH2[N]"},
        units={"time": "s", "displacement": "mm", "force": "N"},
    ),
    "Graphtec, numbers, dates and milliseconds": Recorded(
        (
            "Vendor,GRAPHTEC Corporation",
            "Model,GL980, Ver1.05",
            "Sampling interval,2ms",
            "Total data points,1000",
            "Start time,2024-06-03,14:22:10",
            "AMP settings,",
            "CH,Signal name,Input,Range,Filter,Span",
            "CH1,STROKE,DC,10V,Off,   50.0,  -50.0,mm",
            "CH2,LOAD,DC,5V,Off,   2000,  -2000,N",
            "Logic/Pulse,Off",
            "Data",
            "Number,Date&Time,ms,CH1,CH2,Alarm1-10,AlarmOut",
            "NO.,Time,ms,mm,N,A12345678910,A1234",
            *(
                f"{n + 1},2024/06/03 14:22:{10 + int(t):02d},"
                f"{round(1e3 * (t - int(t)))},{x:+.6f},{f:+.4f},LLLLLLLLLL,LLLL"
                for n, (t, x, f) in enumerate(zip(TIME, MM, FORCE, strict=True))
            ),
        ),
        columns={"time": "", "displacement": "CH1", "force": "CH2"},
        rate_Hz=500.0,
    ),
    "Instron, a table of results above the raw data": Recorded(
        (
            "Specimen label,damper 3",
            "Rate 1,10.0,mm/min",
            "",
            "Results Table 1",
            ",Maximum Load (N),Extension at Maximum (mm)",
            "1,376.2,0.01",
            "",
            "Raw Data",
            '"Time","Extension","Load"',
            '"(sec)","(mm)","(N)"',
            *(f'"{t:.4f}","{x:.6f}","{f:.5f}"' for t, x, f in zip(TIME, MM, FORCE, strict=True)),
        )
    ),
    "Zwick, a report above, German": Recorded(
        (
            '"Pr\u00fcfprotokoll";"D\u00e4mpfer 12"',
            '"Kunde";"intern"',
            '"Pr\u00fcfzeit";"Standardweg";"Standardkraft"',
            '"s";"mm";"N"',
            *table(TIME, MM, FORCE, by=";", decimal=","),
        ),
        encoding="cp1252",
    ),
    "Dewesoft, channels with their input": Recorded(
        (
            "Dewesoft X data export",
            "Start time: 2024-02-03 10:11:12.345",
            "Sample rate: 500 Hz",
            "",
            "Time (s)\tDisp/AI 1 (mm)\tForce/AI 2 (N)",
            *table(TIME, MM, FORCE, by="\t"),
        ),
        "txt",
    ),
    "catman, starts and steps of each channel below the units": Recorded(
        (
            "HBM_CATMAN_DATAFILE_40",
            "KOMMENTAR",
            "",
            "ANZAHL KANAELE: 3",
            "",
            "Zeit  1 - Standardmessrate\tWeg_WA50\tKraft_U9C",
            "s\tmm\tN",
            "T0=0\tT0=0\tT0=0",
            "dt=0,002\tdt=0,002\tdt=0,002",
            *table(TIME, MM, FORCE, by="\t", decimal=","),
        ),
        "asc",
        "cp1252",
    ),
    "Tektronix, names above": Recorded(
        (
            "Model,MSO44",
            "Waveform Type,ANALOG",
            "Sample Interval,0.002",
            "Record Length,1000",
            "",
            "TIME,CH1,CH2",
            *table(TIME, 100.0 * X, FORCE / 100.0),
        ),
        columns={"displacement": "CH1", "force": "CH2"},
        units={"time": "s", **SCOPE},
    ),
    "Tektronix, settings beside the first rows, no header": Recorded(
        tuple(
            f"{','.join(SETTINGS[n] if n < len(SETTINGS) else ('', ''))},,{t:.6f},{x:.8f},{f:.8f},"
            for n, (t, x, f) in enumerate(zip(TIME, 100.0 * X, FORCE / 100.0, strict=True))
        ),
        columns={"displacement": "column5", "force": "column6"},
        units={"time": "s", **SCOPE},
    ),
    "Keysight, channels by number": Recorded(
        ("x-axis,1,2", "second,Volt,Volt", *table(TIME, 100.0 * X, FORCE / 100.0)),
        columns={"displacement": "1", "force": "2"},
        units=SCOPE,
    ),
    "PicoScope, milliseconds and an empty line": Recorded(
        ("Time,Channel A,Channel B", "(ms),(V),(V)", "", *table(1e3 * TIME, 100.0 * X, FORCE / 100.0)),
        columns={"displacement": "Channel A", "force": "Channel B"},
        units=SCOPE,
    ),
    "Saleae, volts about the middle of their range": Recorded(
        ("Time [s],Channel 0,Channel 1", *table(TIME, 2.5 + 100.0 * X, 2.5 + FORCE / 1000.0)),
        columns={"displacement": "Channel 0", "force": "Channel 1"},
        units={"displacement": "10 mm/V about 2.5 V", "force": "1000 N/V about 2.5 V"},
        fineness=(1e-6, 1e-7, 1e-2),
    ),
    "Arduino, messages above": Recorded(
        (
            "Booting...",
            "HX711 ready, tare done",
            "millis,pos_mm,load_N",
            *table([f"{1e3 * t:.0f}" for t in TIME], MM, FORCE),
        ),
        "log",
        units={"time": "ms"},
    ),
    "a Chinese machine, in GBK": Recorded(
        (
            "\u8bd5\u9a8c\u7f16\u53f7:\t2024-001",
            "\u91c7\u6837\u9891\u7387:\t500Hz",
            "\u5e8f\u53f7\t\u65f6\u95f4(s)\t\u4f4d\u79fb(mm)\t\u8d1f\u8377(N)",
            *table([str(n + 1) for n in range(SAMPLES)], TIME, MM, FORCE, by="\t"),
        ),
        "txt",
        "gbk",
    ),
    "a Chinese machine, deformation beside the displacement, kN": Recorded(
        (
            "\u65f6\u95f4,\u529b(kN),\u53d8\u5f62(mm),\u4f4d\u79fb(mm)",
            "\u79d2,kN,mm,mm",
            *table(TIME, 1e-3 * FORCE, np.full(SAMPLES, 0.1), MM),
        ),
        encoding="gb18030",
    ),
    "Roehrig, inches and pounds": Recorded(
        (
            "ROEHRIG ENGINEERING - SHOCK 6.3",
            "File: front_left_01.rdt",
            "Stroke (in): 1.18",
            "",
            "Time\tPosition\tVelocity\tForce\tTemp",
            "sec\tin\tin/sec\tlbf\tdegF",
            *table(TIME, INCH, V / 0.0254, POUND, np.full(SAMPLES, 77.0), by="\t"),
        ),
        "txt",
    ),
    "MTS, a block of a station": Recorded(
        (
            "MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A",
            "Data Header:\t\tTime:\t2.0000\tSec\t3/2/2024 10:11:12 AM",
            "Data Acquisition:\t\tTimed",
            "Station Name:\tdamper rig",
            "Time\tAxial Displacement\tAxial Force",
            "Sec\tmm\tN",
            *table(TIME, MM, FORCE, by="\t"),
        ),
        "dat",
    ),
    "French, centimetres and decanewtons": Recorded(
        ("temps (s);course (cm);effort (daN)", *table(TIME, 0.1 * MM, 0.1 * FORCE, by=";", decimal=",")),
        encoding="latin-1",
    ),
    "instants with a zone": Recorded(
        (
            "timestamp,stroke_mm,force_kN",
            *table([f"2024-03-02T10:15:{t:09.6f}+01:00" for t in TIME], MM, 1e-3 * FORCE),
        )
    ),
    "American, a clock of twelve hours beside the date": Recorded(
        (
            "Date,Time,Position (in),Load (lbs)",
            *table(["3/2/2024"] * SAMPLES, [f"2:05:{7.0 + t:06.3f} PM" for t in TIME], INCH, POUND),
        )
    ),
    "milliseconds since 1970": Recorded(
        ("epoch_ms,x_mm,F_N", *table([f"{1717400000000 + round(1e3 * t)}" for t in TIME], MM, FORCE))
    ),
    "days of Excel": Recorded(
        ("Date/Time,Weg (mm),Kraft (N)", *table([f"{45353.5 + t / 86400.0:.12f}" for t in TIME], MM, FORCE)),
        units={"time": "d"},
    ),
}  # fmt: skip


def written(name: str, folder: Path) -> Path:
    """The file, with line ends of Windows."""
    one = FILES[name]
    path = folder / f"a.{one.suffix}"
    lines = one.lines
    if "settings beside" in name:  # each channel of this scope has a file of its own; here both stand in one
        lines = tuple(line.rstrip(",") for line in lines)
    path.write_bytes(("\r\n".join(lines) + "\r\n").encode(one.encoding))
    return path


def filled(name: str, path: Path) -> dict[str, Any]:
    """The entry that init proposes, with what a person says; nothing else is left empty."""
    one = FILES[name]
    entry: dict[str, Any] = yaml.safe_load("\n".join(guessed([path])))["rig"]["files"][0]
    entry |= {"path": path.name} | ({"rate_Hz": one.rate_Hz} if one.rate_Hz else {})
    for key, values in (("columns", one.columns), ("units", one.units)):
        entry[key] = {**(entry.get(key) or {}), **values}
    left_out = [quantity for quantity, header in entry["columns"].items() if header == ""]
    entry["units"] = {quantity: unit for quantity, unit in entry["units"].items() if quantity not in left_out}
    assert not [key for key in ("columns", "units") for value in entry[key].values() if value is None]
    return entry


@pytest.mark.parametrize("name", FILES)
def test_what_a_recorder_writes_is_read_once_the_empty_places_are_filled(name: str, tmp_path: Path) -> None:
    path = written(name, tmp_path)
    config = RigConfig.model_validate_json(json.dumps({"files": [filled(name, path)]}))
    (record,) = ingest(config, Control(), tmp_path).records
    within = FILES[name].fineness
    np.testing.assert_allclose(record.time - record.time[0], TIME, atol=within[0])
    np.testing.assert_allclose(record.displacement, X, atol=within[1])
    np.testing.assert_allclose(record.force, FORCE, atol=within[2])


def proposed(path: Path) -> dict[str, Any]:
    """The entry that init proposes."""
    entry: dict[str, Any] = yaml.safe_load("\n".join(guessed([path])))["rig"]["files"][0]
    return {**entry, "path": path.name}


ARDUINO = FILES["Arduino, messages above"].lines


def test_a_message_within_the_rows_is_told_and_the_advice_reads_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_text("\n".join([*ARDUINO[:400], "WARN: sensor timeout", *ARDUINO[400:]]) + "\n", encoding="utf-8")
    entry = proposed(path)
    entry["units"]["time"] = "ms"
    with pytest.raises(DataError, match=r"a\.log:401: 1 fields .*if this is a message of the logger, say comment: W$"):
        ingest(RigConfig.model_validate_json(json.dumps({"files": [entry]})), Control(), tmp_path)
    said = RigConfig.model_validate_json(json.dumps({"files": [{**entry, "comment": "W"}]}))
    (record,) = ingest(said, Control(), tmp_path).records
    np.testing.assert_allclose(record.force, FORCE, atol=1e-3)


TOLD = {
    "names beside each number": (
        tuple(f"t:{1e3 * t:.0f} pos:{x:.3f} load:{f:.2f}" for t, x, f in zip(TIME, MM, FORCE, strict=True)),
        r"a name stands beside each number \(got t:0\); write the names once, in a line above the rows",
    ),
    "points between thousands": (
        (
            "Zeit [ms];Weg [mm];Kraft [N]",
            *(
                ";".join(f"{c:,.{d}f}".translate(str.maketrans(",.", ".,")) for c, d in ((t, 0), (x, 4), (f, 2)))
                for t, x, f in zip(1e3 * TIME, MM, 10.0 * FORCE, strict=True)
            ),
        ),
        r"a number is needed \(got '1\.000'\)",
    ),
    "units in the cells": (
        ("Time,Position,Force", *(f"{t:.3f} s,{x:.5f} mm,{f:.4f} N" for t, x, f in zip(TIME, MM, FORCE, strict=True))),
        r"a number is needed \(got '0\.000 s'\)",
    ),
    "a clock and an arrow": (
        tuple(f"14:05:{7.0 + t:06.3f} -> {x:.3f},{f:.2f}" for t, x, f in zip(TIME, MM, FORCE, strict=True)),
        r"a number is needed \(got '14:05:07\.000 -> 0\.000'\)",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", TOLD)
def test_what_cannot_be_read_is_told_with_its_place(name: str, tmp_path: Path) -> None:
    lines, words = TOLD[name]
    path = tmp_path / "a.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(DataError, match=words):  # noqa: PT012  # init refuses some, reading the others
        entry = proposed(path)
        if "column1" in entry.get("header", ()):
            entry |= {"rate_Hz": 500.0, "columns": {"displacement": "column1", "force": "column2"}}
            entry["units"] = {"displacement": "mm", "force": "N"}
        asked = {"time": "s", "displacement": "mm", "force": "N"}
        units = entry.get("units") or {}
        entry["units"] = {quantity: unit or asked[quantity] for quantity, unit in units.items()}
        ingest(RigConfig.model_validate_json(json.dumps({"files": [entry]})), Control(), tmp_path)


@pytest.mark.parametrize(
    ("start", "kind"),
    [
        (b"|CF,2,1,1;|CK,1,3,1,1;\r\n|NO,1,11,0,0,imc STUDIO;\x00\x01", "a file of imc FAMOS"),
        (b'<?xml version="1.0"?>\n<usi:tdm xmlns:usi="http://www.ni.com/Schemas/USI/1_0">', "an XML file"),
    ],
)
def test_a_file_that_no_format_reads_is_told_by_its_kind(start: bytes, kind: str, tmp_path: Path) -> None:
    path = tmp_path / "a.dat"
    path.write_bytes(start)
    with pytest.raises(DataError, match=f"this is {kind}; export the table as xlsx, CSV or other delimited text"):
        guessed([path])


@pytest.mark.parametrize(
    ("minus", "mark", "decimal"),
    [("\u2212", "", "."), ("-", "'", ","), ("-", "\u2019", "."), ("\u2212", "\u202f", ","), ("-", ".", ",")],
)
def test_a_typographic_minus_and_marks_between_thousands_are_no_part_of_a_number(
    tmp_path: Path, minus: str, mark: str, decimal: str
) -> None:
    def cell(value: float) -> str:
        return f"{value:,.6f}".replace(",", "~").replace(".", decimal).replace("~", mark).replace("-", minus)

    rows = [";".join(map(cell, row)) for row in zip(TIME, 1e6 * X, FORCE, strict=True)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["Time [s];Stroke [µm];Force [N]", *rows]) + "\n", encoding="utf-8")
    (tmp_path / "guess.yaml").write_text("\n".join(guessed([path])), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    (record,) = ingest(config.rig, config.control.signal(), tmp_path).records
    assert record.displacement == pytest.approx(X, abs=1e-11)
    assert record.force == pytest.approx(FORCE, abs=1e-5)


@pytest.mark.parametrize("ending", ["csv", "xlsx"])
def test_extremes_and_a_remark_below_the_table_are_left_out_and_told(tmp_path: Path, ending: str) -> None:
    head, below = (
        ("Time [s]", "Stroke [mm]", "Force [N]"),
        (("Max", 15, 300.5), ("Min", -15, -300.5), ("-- Warm oil --",)),
    )
    path, told = tmp_path / f"a.{ending}", 3 if ending == "csv" else 4  # a sheet counts the empty row above them
    if ending == "csv":
        text = [",".join(head), *table(TIME, MM, FORCE), "", *(",".join(map(str, row)) for row in below)]
        path.write_text("\n".join(text) + ",,\n", encoding="utf-8")
    else:
        openpyxl = pytest.importorskip("openpyxl")
        book = openpyxl.Workbook()
        for row in (head, *zip(TIME.tolist(), MM.tolist(), FORCE.tolist(), strict=True), (None,), *below):
            book.active.append(row)
        book.save(path)
    (tmp_path / "guess.yaml").write_text("\n".join(guessed([path])), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    rig = ingest(config.rig, config.control.signal(), tmp_path)
    assert rig.records[0].time.size == SAMPLES
    assert any(f"{told} lines of words below the table" in row.was for row in rig.ingested), rig.ingested


def test_units_in_capitals_are_read_as_they_are_meant(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(
        "\n".join(["TIME (S),DISP (MM),FORCE (KN)", *table(TIME, MM, FORCE / 1e3)]) + "\n", encoding="utf-8"
    )
    (tmp_path / "guess.yaml").write_text("\n".join(guessed([path])), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    (record,) = ingest(config.rig, config.control.signal(), tmp_path).records
    assert record.displacement == pytest.approx(X, abs=1e-9)
    assert record.force == pytest.approx(FORCE, abs=1e-3)


def test_zeros_that_fill_the_block_of_a_card_are_no_part_of_a_text(tmp_path: Path) -> None:
    text = "\n".join(["time_s,displacement_m,force_N", *table(TIME, X, FORCE)]) + "\n"
    (tmp_path / "a.csv").write_bytes(text.encode() + bytes(300))
    config = RigConfig.model_validate_json('{"files": [{"path": "*.csv"}]}')
    assert ingest(config, Control(), tmp_path).records[0].time.size == SAMPLES


def test_whole_seconds_as_stamps_tell_the_rate_of_the_samples_between_them(tmp_path: Path) -> None:
    """The first second may have begun before the recording, and the last ended behind it."""
    stamps = [f"2026-11-27 09:30:{int(0.37 + t):02d}" for t in TIME]
    (tmp_path / "a.csv").write_text("\n".join(["t,x,F", *table(stamps, MM, FORCE)]) + "\n", encoding="utf-8")
    entry = {"path": "*.csv", "columns": {"time": "t", "displacement": "x", "force": "F"},
             "units": {"time": "%Y-%m-%d %H:%M:%S", "displacement": "mm", "force": "N"}}  # fmt: skip
    config = RigConfig.model_validate_json(json.dumps({"files": [entry]}))
    with pytest.raises(DataError, match="say rate_Hz: 500 or what is known of it"):
        ingest(config, Control(), tmp_path)


def test_a_level_among_the_attributes_of_an_hdf5_group_is_that_of_its_test(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for level in (0.0, 0.5):
            group = file.create_group(f"run{level}")
            group.attrs["current_A"], group.attrs["operator"], group.attrs["cycles"] = level, "N. N.", 4
            for name, values in (("time_s", TIME), ("position_mm", MM), ("load_N", FORCE)):
                group[name] = values
    (tmp_path / "guess.yaml").write_text("\n".join(guessed([tmp_path / "a.h5"])), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    entries = ingest(config.rig, config.control.signal(), tmp_path).entries
    assert [entry.voltage_V for entry in entries] == [0.0, 0.5]


def test_an_index_of_instants_without_a_name_is_the_clock_of_a_parquet(tmp_path: Path) -> None:
    pd = pytest.importorskip("pandas")
    index = pd.Timestamp("2026-11-27T09:30:00.1+01:00") + pd.to_timedelta(TIME, unit="s")
    pd.DataFrame({"disp_mm": MM, "force [N]": FORCE}, index=index).to_parquet(tmp_path / "a.parquet")
    (tmp_path / "guess.yaml").write_text("\n".join(guessed([tmp_path / "a.parquet"])), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    (record,) = ingest(config.rig, config.control.signal(), tmp_path).records
    assert record.time == pytest.approx(TIME, abs=1e-9)


def read_as_guessed(path: Path) -> Sequence[Any]:
    """Return the records of a file, read as init proposes."""
    (path.parent / "guess.yaml").write_text("\n".join(guessed([path])), encoding="utf-8")
    config = load(path.parent / "guess.yaml")
    return ingest(config.rig, config.control.signal(), path.parent).records


@pytest.mark.parametrize("decimal", ".,")
def test_numbers_that_a_workbook_holds_as_text_are_read_with_its_decimal_mark(tmp_path: Path, decimal: str) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Time [s]", "Stroke [mm]", "Force [N]"])
    for row in zip(TIME, MM, FORCE, strict=True):
        book.active.append([f"{value:.6f}".replace(".", decimal) for value in row])
    book.save(tmp_path / "a.xlsx")
    (record,) = read_as_guessed(tmp_path / "a.xlsx")
    assert record.displacement == pytest.approx(X, abs=1e-9)
    assert record.force == pytest.approx(FORCE, abs=1e-5)


@pytest.mark.parametrize("below", ["", "channels"])
@pytest.mark.parametrize("samples", ["data", "values", "samples"])
def test_a_list_of_channels_with_their_names_and_units_is_one_table(tmp_path: Path, below: str, samples: str) -> None:
    channels = [
        {"name": name, "unit": unit, samples: values.tolist()}
        for name, unit, values in (("Time", "s", TIME), ("Stroke", "mm", MM), ("Load", "N", FORCE))
    ]
    (tmp_path / "a.json").write_text(json.dumps({below: channels} if below else channels), encoding="utf-8")
    (record,) = read_as_guessed(tmp_path / "a.json")
    assert record.displacement == pytest.approx(X)
    assert record.force == pytest.approx(FORCE)


@pytest.mark.parametrize("quote", ["", '"'])
def test_empty_lines_between_rows_are_left_out_where_a_clock_goes_on(tmp_path: Path, quote: str) -> None:
    rows = [*table(TIME, MM, FORCE)]
    head = f"Time [s],Stroke [mm],{quote}Force [N]{quote}"
    (tmp_path / "a.csv").write_text("\n".join([head, *rows[:400], "", " ", *rows[400:]]) + "\n", encoding="utf-8")
    (record,) = read_as_guessed(tmp_path / "a.csv")
    assert record.force == pytest.approx(FORCE)


def test_an_empty_line_between_rows_without_a_clock_is_refused(tmp_path: Path) -> None:
    """Another recording may begin behind it, and nothing would tell."""
    rows = [*table(MM, FORCE)]
    text = ["Rate: 500 Hz", "Stroke [mm],Force [N]", *rows[:400], "", *rows[400:]]
    (tmp_path / "a.csv").write_text("\n".join(text) + "\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"a\.csv:403: 1 fields where the header has 2"):
        read_as_guessed(tmp_path / "a.csv")


@pytest.mark.parametrize("between", [" ", "\t", ","])
def test_the_rows_that_write_table_of_r_numbers_have_a_column_that_its_header_leaves_out(
    tmp_path: Path, between: str
) -> None:
    rows = [f'"{n}"{between}{row}' for n, row in enumerate(table(TIME, MM, FORCE, by=between), start=1)]
    head = between.join(f'"{name}"' for name in ("Time_s", "Stroke_mm", "Force_N"))
    (tmp_path / "a.txt").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    (record,) = read_as_guessed(tmp_path / "a.txt")
    assert record.time == pytest.approx(TIME, abs=1e-9)
    assert record.displacement == pytest.approx(X, abs=1e-9)
    assert record.force == pytest.approx(FORCE, abs=1e-5)


@pytest.mark.parametrize("header", ["n,time_s,displacement_mm", "time_s,displacement_mm,force_N"])
def test_a_row_with_a_field_too_many_is_no_numbered_row(tmp_path: Path, header: str) -> None:
    """Without quotes the first of its fields may be the one that the header names first, and the last have no name."""
    rows = [f"{n},{row}" for n, row in enumerate(table(TIME, MM, FORCE), start=1)]
    (tmp_path / "a.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"a\.csv:2: 4 fields where the header has 3"):
        ingest(RigConfig(files=(FilesEntry(path="a.csv"),)), Control(), tmp_path)


# --- A board of students: a column without its sensor, and words among the rows

BOARD = ["Millis,Load_Cell,Linear_Pot (scaled),Thermocouple", *(
    f"{1000.0 * t:.0f},{f:.4f},{x:.5f}" for t, x, f in zip(TIME, MM, FORCE, strict=True)
)]  # fmt: skip


def board(folder: Path, rows: Sequence[str], **more: object) -> Any:
    (folder / "b.csv").write_text("\n".join([*BOARD[:1], *rows]) + "\n", encoding="utf-8")
    entry = proposed(folder / "b.csv")
    units = {**entry["units"], "displacement": "mm", "force": "N"}
    said = RigConfig.model_validate_json(json.dumps({"files": [{**entry, "units": units, **more}]}))
    return ingest(said, Control(), folder)


def test_the_last_column_of_a_header_may_have_no_field_in_any_row(tmp_path: Path) -> None:
    """A logger without a thermocouple: `4 fields where the header has 5` in every line, and no key that helped."""
    (record,) = board(tmp_path, BOARD[1:]).records
    np.testing.assert_allclose(record.force, FORCE, atol=1e-3)
    np.testing.assert_allclose(record.displacement, X, atol=1e-6)


def test_which_names_have_no_field_is_for_a_person_to_say_and_the_advice_reads_the_file(tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_text("\n".join(BOARD) + "\n", encoding="utf-8")
    columns = {"time": "Millis", "displacement": "Linear_Pot (scaled)", "force": "Load_Cell"}
    entry = {"path": "b.csv", "columns": columns, "units": {"time": "ms", "displacement": "mm", "force": "N"}}

    def read_by(**more: object) -> Any:
        return ingest(RigConfig.model_validate_json(json.dumps({"files": [{**entry, **more}]})), Control(), tmp_path)

    with pytest.raises(DataError) as refused:
        read_by()
    told = (
        r"b\.csv:1: the header has 4 names, and the rows have 3 fields; where the last names have none \(Thermocouple\)"
    )
    advised = re.search(told + r", say skip: (\d+) and header: \[(.*)\]$", str(refused.value))
    assert advised is not None
    (record,) = read_by(skip=int(advised[1]), header=advised[2].split(", ")).records
    np.testing.assert_allclose(record.force, FORCE, atol=1e-3)


@pytest.mark.parametrize("head", ["t,Force, N,pos,temp", "t,Force,pos, filtered,temp"])
def test_a_name_with_the_separator_in_it_shifts_no_column(tmp_path: Path, head: str) -> None:
    """`Force, N` without quotes is two names: the displacement would be read under that of the next column."""
    rows = [head, *(f"{t:.3f},{f:.4f},{x:.5f},20" for t, x, f in zip(TIME, MM, FORCE, strict=True))]
    (tmp_path / "n.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    entry = {"path": "n.csv", "columns": {"time": "t", "displacement": "pos", "force": "Force"}}
    said = {"files": [{**entry, "units": {"time": "s", "displacement": "mm", "force": "N"}}]}
    with pytest.raises(DataError, match="the header has 5 names, and the rows have 4 fields"):
        ingest(RigConfig.model_validate_json(json.dumps(said)), Control(), tmp_path)


@pytest.mark.parametrize("row", ["801,Switched from 8 to 9,", "801,Switched from 8 to 9,,,"])
def test_the_key_that_is_advised_leaves_a_message_among_the_rows_out(tmp_path: Path, row: str) -> None:
    rows = [*BOARD[1:402], row, *BOARD[402:]]
    with pytest.raises(DataError) as refused:
        board(tmp_path, rows)
    advised = re.search(r"say leave_out: '([^']+)'", str(refused.value))
    assert advised is not None
    rig = board(tmp_path, rows, leave_out=advised[1])
    np.testing.assert_allclose(rig.records[0].force, FORCE, atol=1e-3)
    assert any("1 line in which 'Switched from 8 to 9' is found" in str(row) for row in rig.ingested)


def test_lines_that_are_left_out_are_counted_by_what_leaves_them_out(tmp_path: Path) -> None:
    rows = [*BOARD[1:200], "# a comment", *BOARD[200:], "9999,overload,"]
    rig = board(tmp_path, rows, leave_out="overload", comment="#")
    told = "".join(str(row) for row in rig.ingested)
    assert "1 line in which 'overload' is found" in told
    assert "1 line that begin with '#'" in told


def test_a_key_that_a_format_does_not_know_is_refused(tmp_path: Path) -> None:
    rows = [{"t": t, "x": x, "F": f} for t, x, f in zip(TIME, X, FORCE, strict=True)]
    (tmp_path / "b.json").write_text(json.dumps(rows), encoding="utf-8")
    entry = {"path": "b.json", "columns": {"time": "t", "displacement": "x", "force": "F"}, "leave_out": "x"}
    said = {"files": [{**entry, "units": {"time": "s", "displacement": "m", "force": "N"}}]}
    with pytest.raises(ConfigError, match="leave_out"):
        ingest(RigConfig.model_validate_json(json.dumps(said)), Control(), tmp_path)


@pytest.mark.parametrize("head", ["Motor speed (rpm)", "Velocidad_RPM", "rpm_velocity"])
def test_the_speed_of_a_motor_is_not_that_of_the_damper(head: str) -> None:
    assert quantity_of(head, None, Control()) is not VELOCITY


def test_a_pot_is_a_displacement_and_its_temperature_none() -> None:
    assert quantity_of("Linear_Pot (scaled)", None, Control()) is DISPLACEMENT
    assert quantity_of("LinPot", None, Control()) is DISPLACEMENT
    assert quantity_of("pot_temp", None, Control()) is not DISPLACEMENT
