"""Small files as loggers of all kinds write them: init proposes what reads them, asks for the rest, and check reads it.

Every file is one test, a sine of 20 mm at 1.5 Hz on a damper of 1000 N s/m and 100 N of friction; what is read is
compared sample by sample.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pzd.quantities import Control
from pzd.record import Array
from pzd.rig.config import RigConfig
from pzd.rig.files.guess import guessed
from pzd.rig.stage import ingest
from pzd.schema.errors import DataError

SAMPLES, RATE, OMEGA = 1200, 500.0, 2.0 * np.pi * 1.5
TIME = np.arange(SAMPLES) / RATE
X = 0.02 * np.sin(OMEGA * TIME)
V = 0.02 * OMEGA * np.cos(OMEGA * TIME)
FORCE = 1000.0 * V + 100.0 * np.tanh(V / 1e-3)
GRAM, POUND, INCH = 9.80665e-3, 4.4482216152605, 0.0254
SPARSE = [f"{20.0 + n / 600.0:.1f}" if n % 400 == 0 else "" for n in range(SAMPLES)]
"""A temperature every 400th row."""


def rows(*columns: Sequence[str] | Array, separator: str = ",", decimal: str = ".", end: str = "") -> str:
    def cell(value: object) -> str:
        return value if isinstance(value, str) else f"{value:.9g}".replace(".", decimal)

    return "".join(separator.join(map(cell, row)) + end + "\n" for row in zip(*columns, strict=True))


def quoted(text: str) -> str:
    return "".join(",".join(f'"{cell}"' for cell in line.split(",")) + "\n" for line in text.splitlines())


TABLE = rows(TIME, 1e3 * X, FORCE)
GERMAN = rows(TIME, 1e3 * X, FORCE, separator=";", decimal=",")
HEAD = "Time (s),Position (mm),Force (N)\n"


@dataclass(frozen=True)
class FieldFile:
    """A file, what a person fills in, and how fine its channels are."""

    text: str
    encoding: str = "utf-8"
    filled: dict[str, dict[str, str]] = field(default_factory=dict)
    """Empty places of the proposal, by key and quantity."""
    fineness: tuple[float, float] = (1e-8, 1e-3)
    """Largest difference of displacement [m] and force [N]."""


COUNTS = np.round(X / 1e-5)
ROUNDED = (0.51e-5, 1e-3)
FILES = {
    "two rows of head, units below": FieldFile("Time,Disp,Load\ns,mm,N\n" + TABLE),
    "numbers of the channels above the names": FieldFile("CH0,CH1,CH2\n" + HEAD + TABLE),
    "units in brackets below": FieldFile("Time,Position,Force\n[s],[mm],[N]\n" + TABLE),
    "pairs of keys and values above": FieldFile(f"Operator,NN\nRate,500 Hz\nGain,12.5\n\n{HEAD}{TABLE}"),
    "a separator behind each row": FieldFile(HEAD + rows(TIME, 1e3 * X, FORCE, end=",")),
    "a separator behind some rows": FieldFile(
        HEAD + "".join(line + "," * (n % 7 == 0) + "\n" for n, line in enumerate(TABLE.splitlines()))
    ),
    "a temperature now and then": FieldFile(f"{HEAD[:-1]},Temp (degC)\n" + rows(TIME, 1e3 * X, FORCE, SPARSE)),
    "a temperature now and then, NaN between": FieldFile(
        f"{HEAD[:-1]},Temp (degC)\n" + rows(TIME, 1e3 * X, FORCE, [cell or "NaN" for cell in SPARSE])
    ),
    "quoted numbers": FieldFile(quoted(HEAD + TABLE)),
    "quoted decimal commas": FieldFile(quoted(HEAD) + quoted(TABLE).replace(".", ",")),
    "Chinese in GBK": FieldFile("\u65f6\u95f4(s),\u4f4d\u79fb(mm),\u529b(N)\n" + TABLE, "gbk"),
    "Japanese in Shift-JIS": FieldFile("\u6642\u9593(s),\u5909\u4f4d(mm),\u8377\u91cd(N)\n" + TABLE, "shift_jis"),
    "French in UTF-16": FieldFile("Temps [s];D\u00e9placement [mm];Effort [N]\n" + GERMAN, "utf-16"),
    "Spanish in a Windows code page": FieldFile("Tiempo (s);Desplazamiento (mm);Fuerza (N)\n" + GERMAN, "cp1252"),
    "Italian with tabs": FieldFile("Tempo [s]\tSpostamento [mm]\tForza [N]\n" + GERMAN.replace(";", "\t")),
    "German with strokes": FieldFile("Zeit/s;Weg/mm;Kraft/N\n" + GERMAN),
    "whole numbers in the first row of decimal commas": FieldFile(
        "Zeit [s];Weg [mm];Kraft [N]\n" + rows(TIME, 1e3 * X, np.round(FORCE), separator=";", decimal=","),
        fineness=(1e-8, 0.51),
    ),
    "Polish in its code page": FieldFile("Czas [s];Przemieszczenie [mm];Si\u0142a [N]\n" + GERMAN, "cp1250"),
    "grams-force": FieldFile("Time (s),Position (mm),Force (gf)\n" + rows(TIME, 1e3 * X, FORCE / GRAM)),
    "grams, which are none of a force": FieldFile(
        "Time (s),Position (mm),Load (g)\n" + rows(TIME, 1e3 * X, FORCE / GRAM), filled={"units": {"force": "gf"}}
    ),
    "kgf": FieldFile("Time (s),Position (mm),Force (kgf)\n" + rows(TIME, 1e3 * X, 1e-3 * FORCE / GRAM)),
    "inches, in/s and pounds": FieldFile(
        "Time (s),Position (in),Velocity (in/s),Force (lbf)\n" + rows(TIME, X / INCH, V / INCH, FORCE / POUND)
    ),
    "counts of 0.01 mm": FieldFile(
        "Time (s),Encoder (counts),Force (N)\n" + rows(TIME, COUNTS, FORCE),
        filled={"columns": {"displacement": "Encoder (counts)"}, "units": {"displacement": "0.01 mm"}},
        fineness=ROUNDED,
    ),
    "a unit of 0.01 mm": FieldFile("Time (s),Pos [0.01mm],Force (N)\n" + rows(TIME, COUNTS, FORCE), fineness=ROUNDED),
    "volts of a load cell with their zero": FieldFile(
        "Time (s),Position (mm),Load cell (V)\n" + rows(TIME, 1e3 * X, 2.5 - FORCE / 200.0),
        filled={"units": {"force": "-200 N/V about 2.5 V"}},
    ),
    "no header at all": FieldFile(
        TABLE,
        filled={
            "columns": {"displacement": "column2", "force": "column3"},
            "units": {"time": "s", "displacement": "mm", "force": "N"},
        },
    ),
    "lines of notes above": FieldFile("# logger v2\n# a note\nTime (s),x_mm,F_N\n" + TABLE),
    "a line that names the separator": FieldFile("sep=;\nTime (s);Position (mm);Force (N)\n" + TABLE.replace(",", ";")),
    "exponents of Fortran": FieldFile(
        HEAD + rows(*([f"{v:.12E}".replace("E", "D") for v in one] for one in (TIME, 1e3 * X, FORCE)))
    ),
    "words below the table": FieldFile(f"{HEAD}{TABLE}\nEnd of test\n"),
    "strokes between the fields": FieldFile((HEAD + TABLE).replace(",", "|")),
    "UTF-16 without its mark": FieldFile(HEAD + TABLE, "utf-16-le"),
    "Chinese units below": FieldFile(
        "\u65f6\u95f4,\u4f4d\u79fb,\u529b\u503c\n\u79d2,\u6beb\u7c73,\u725b\n" + TABLE, "gbk"
    ),
    "kiloponds": FieldFile(
        "Zeit [s];Weg [cm];Kraft [kp]\n"
        + rows(TIME, 1e2 * X, 1e-3 * FORCE / GRAM, separator=";", decimal=",")
    ),
    "blanks between the fields and in the headers": FieldFile(
        "   Running Time   Axial Position      Axial Force\n            sec               mm                N\n"
        + "".join("".join(f"{v:17.9f}" for v in row) + "\n" for row in zip(TIME, 1e3 * X, FORCE, strict=True))
    ),
    "blanks before the units too": FieldFile("Time [s] Pos [mm] Force [N]\n" + TABLE.replace(",", " ")),
    "dates with the time of day": FieldFile(
        "Timestamp,Position (mm),Force (N)\n"
        + rows([f"2024-03-02 10:15:{t:09.6f}" for t in TIME], 1e3 * X, FORCE)
    ),
}  # fmt: skip


def proposed(path: Path) -> dict[str, Any]:
    """The entry of `rig.files` that init prints."""
    entry: dict[str, Any] = yaml.safe_load("\n".join(guessed([path])))["rig"]["files"][0]
    return {**entry, "path": path.name}


def empty(entry: dict[str, Any]) -> dict[str, set[str]]:
    """The places that init leaves empty, by key."""
    found = {
        key: {name for name, value in (entry.get(key) or {}).items() if value is None} for key in ("columns", "units")
    }
    return {key: names for key, names in found.items() if names}


@pytest.mark.parametrize("name", FILES)
def test_what_init_prints_reads_the_file_once_its_empty_places_are_filled(name: str, tmp_path: Path) -> None:
    file = FILES[name]
    path = tmp_path / "a.csv"
    path.write_bytes(file.text.encode(file.encoding))
    entry = proposed(path)
    assert empty(entry) == {key: set(values) for key, values in file.filled.items()}
    for key, values in file.filled.items():
        entry[key].update(values)
    config = RigConfig.model_validate_json(json.dumps({"files": [entry]}))
    (record,) = ingest(config, Control(), tmp_path).records
    np.testing.assert_allclose(record.time - record.time[0], TIME, atol=2e-6)
    np.testing.assert_allclose(record.displacement, X, atol=file.fineness[0])
    np.testing.assert_allclose(record.force, FORCE, atol=file.fineness[1])


def test_a_temperature_now_and_then_is_held(tmp_path: Path) -> None:
    for name in ("a temperature now and then", "a temperature now and then, NaN between"):
        path = tmp_path / "a.csv"
        path.write_text(FILES[name].text, encoding="utf-8")
        config = RigConfig.model_validate_json(json.dumps({"files": [proposed(path)]}))
        (record,) = ingest(config, Control(), tmp_path).records
        assert record.temperature is not None
        expected = np.repeat([float(cell) for cell in SPARSE if cell], 400)
        np.testing.assert_allclose(record.temperature, expected, atol=1e-9)


V_OF_CURVE = np.linspace(-1.0, 1.0, 21)
TRIANGLE = np.minimum(TIME, TIME[-1] - TIME)
NO_TESTS: dict[str, tuple[str, Callable[[Path], object], str]] = {
    "accelerations of a ride": (
        "Time (s),ax (g),ay (g),az (g)\n" + rows(TIME, X, X, V),
        proposed,
        "pzd rate rates them",
    ),
    "a curve": (
        "Velocity (mm/s),Force (N)\n" + rows(1e3 * V_OF_CURVE, 900.0 * V_OF_CURVE),
        proposed,
        r"take it by damper: \{curve: ",
    ),
    "third octaves": ("f (Hz),a (m/s2)\n1,0.1\n1.25,0.2\n1.6,0.3\n2,0.2\n", proposed, "levels over frequency"),
    "telemetry": (
        "Time (s),Speed (km/h),Damper FL (mm),Damper FR (mm)\n" + rows(TIME, 50.0 + X, 1e3 * X, 1e3 * X),
        proposed,
        "as telemetry of a car has",
    ),
    "a pull": (
        HEAD + rows(TIME, 20.0 * TIME, 100.0 + 50.0 * TIME),
        lambda path: ingest(RigConfig.model_validate({"files": (proposed(path),)}), Control(), path.parent),
        "one way alone",
    ),
    "one load and unload": (
        HEAD + rows(TIME, 20.0 * TRIANGLE, 100.0 * np.sign(TIME[-1] / 2 - TIME) + 50.0 * TRIANGLE),
        lambda path: ingest(RigConfig.model_validate({"files": (proposed(path),)}), Control(), path.parent),
        "one load and unload",
    ),
}


@pytest.mark.parametrize("name", NO_TESTS)
def test_a_file_that_is_no_test_is_told_what_it_is(name: str, tmp_path: Path) -> None:
    text, looked_at, words = NO_TESTS[name]
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DataError, match=words):
        looked_at(path)
