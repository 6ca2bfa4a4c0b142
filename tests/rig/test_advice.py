"""What a refusal advises is accepted, and files that no damper can be made of say so at once."""

from __future__ import annotations

import re
import warnings
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from written_files import CANONICAL, FORCE, TIME, X, lines, refused, run, write, wrong

from pzd.config import load
from pzd.quantities import Control
from pzd.rig.files.guess import guessed
from pzd.rig.stage import ingest
from pzd.schema.errors import DataError, UserError

# ---------------------------------------------------------------- paths, and faults of several files


def test_a_folder_in_the_place_of_its_files_is_told_with_a_pattern_that_reads_them(tmp_path: Path) -> None:
    (tmp_path / "bench").mkdir()
    write(tmp_path / "bench" / "a.txt", lines(CANONICAL))
    (said,) = wrong(tmp_path, {"path": "bench"})
    (pattern,) = re.findall(r"this is a folder; name the files in it, e\.g\. (\S+)", said)
    assert len(run(tmp_path, {"path": pattern}).records) == 1


def test_a_wrong_unit_of_many_files_is_told_once_and_corrected_once(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        write(tmp_path / f"{name}.csv", lines({"time_s": TIME, "pos": X, "force_N": FORCE}))
    entry = {"path": "*.csv", "columns": {"displacement": "pos"}}
    (said,) = wrong(tmp_path, entry | {"units": {"displacement": "mmm"}})
    assert said.endswith("a.csv) (and so in 2 more files)")
    (unit,) = re.findall(r"write one like '(\w+)'", said)
    assert len(run(tmp_path, entry | {"units": {"displacement": unit}}).records) == 3


@pytest.mark.parametrize(
    ("columns", "entry"),
    [
        ({"time_s": TIME, "position_m": X, "load": FORCE}, {}),
        ({"time_s": np.arange(TIME.size, dtype=float), "displacement_m": X, "force_N": FORCE}, {}),
    ],
    ids=["a header that is nothing's", "a clock that counts samples"],
)
def test_what_is_wrong_alike_in_many_files_is_told_once(
    columns: dict[str, Any], entry: dict[str, Any], tmp_path: Path
) -> None:
    for name in ("a", "b", "c"):
        write(tmp_path / f"{name}.csv", lines(columns))
    alone = refused(tmp_path, entry | {"path": "a.csv"})
    together = refused(tmp_path, entry | {"path": "*.csv"})
    assert len(together) == len(alone)
    assert all("a.csv" in said and "(and so in 2 more files)" in said for said in together)


# ---------------------------------------------------------------- columns and headers


def test_a_column_asked_for_by_its_number_is_named_by_its_header(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines({"t": TIME, "x": X, "F total": FORCE}))
    units = {"units": {"time": "s", "displacement": "m", "force": "N"}}
    said = refused(tmp_path, {"path": "a.csv", "columns": {"time": "1", "displacement": "2", "force": "3"}, **units})
    named = dict(re.findall(r"rig\.files\.0\.columns: \{(\w+): (.*?)\}", "\n".join(said)))
    assert named == {"time": "t", "displacement": "x", "force": "F total"}
    assert np.abs(run(tmp_path, {"path": "a.csv", "columns": named, **units}).records[0].force - FORCE).max() < 1e-5


def test_a_file_without_headers_is_told_how_to_name_its_columns(tmp_path: Path) -> None:
    rows = lines({"a": TIME, "b": X, "c": FORCE, "d": TIME})[1:]
    write(tmp_path / "a.csv", rows)
    (said,) = refused(tmp_path)
    assert "a.csv:1: numbers stand where the headers should" in said
    header = re.findall(r"header: \[(.*?)\]", said)[0].split(", ")
    assert np.abs(run(tmp_path, {"path": "a.csv", "header": header}).records[0].force - FORCE).max() < 1e-5
    # `pzd init` shows the range of each, so that one sees which is which.
    proposed = guessed([tmp_path / "a.csv"])
    assert (
        "      header: [column1, column2, column3, column4]    # the file has none: these names are made up" in proposed
    )
    assert any(re.fullmatch(r" *# column2: -0.01 to 0.01, turns \d+ times", one) for one in proposed)
    assert "        time: column1" in proposed
    filled = "\n".join(proposed)
    for empty, answer in (
        ("displacement:   # fill in: one of", "displacement: column2 #"),
        ("force:   # fill in: one of the others", "force: column3 #"),
        ("time:   # fill in: column1", "time: s #"),
        ("displacement:   # fill in: the unit", "displacement: m #"),
        ("force:   # fill in: the unit", "force: N #"),
    ):
        assert empty in filled
        filled = filled.replace(empty, answer)
    (tmp_path / "own.yaml").write_text(filled.replace("# car", "car"), encoding="utf-8")
    assert np.abs(ingest(load(tmp_path / "own.yaml").rig, Control(), tmp_path).records[0].force - FORCE).max() < 1e-5


@pytest.mark.parametrize("heads", [("Time [s]", "Pos [mm]"), ("Time [s]", "Pos [mm]", "")])
def test_without_force_no_damper(tmp_path: Path, heads: tuple[str, ...]) -> None:
    write(tmp_path / "a.csv", lines(dict(zip(heads, (TIME, X * 1e3, [""] * TIME.size), strict=False))))
    with pytest.raises(DataError) as caught:
        guessed([tmp_path / "a.csv"])
    assert "a.csv:1: without force no damper: this file has Time [s], Pos [mm]" in caught.value.messages[0]
    entry = {"path": "a.csv", "columns": {"time": heads[0], "displacement": heads[1]}}
    assert "missing column force_N; without force no damper" in refused(tmp_path, entry)[0]


def test_what_is_asked_to_be_filled_in_has_candidates(tmp_path: Path) -> None:
    """A load cell recorded in volts was taken for the control, and nothing was left to choose the force from."""
    write(tmp_path / "a.csv", lines({"Time [s]": TIME, "Pos [mm]": X * 1e3, "Voltage [V]": FORCE}))
    column, unit = [line for line in guessed([tmp_path / "a.csv"]) if line.startswith("        force:")]
    assert column == "        force:   # fill in: one of Voltage [V]"
    assert unit == "        force:   # fill in: the unit of that column, e.g. N"
    entry = {
        "path": "a.csv",
        "columns": {"time": "Time [s]", "displacement": "Pos [mm]", "force": "Voltage [V]"},
        "units": {"force": "1 N"},
    }
    assert np.abs(run(tmp_path, entry).records[0].force - FORCE).max() < 1e-5


# ---------------------------------------------------------------- motions that show little


@pytest.mark.parametrize(("turns", "says"), [(0, "one way alone shows"), (1, "one load and unload shows")])
def test_a_motion_of_too_few_reversals_says_what_it_shows_and_what_not(tmp_path: Path, turns: int, says: str) -> None:
    time = np.arange(1500) * 1e-3
    x = 0.02 * np.sin(np.pi * (turns + 1) * time / time[-1] - 0.5 * np.pi)
    v = np.gradient(x, time)
    write(tmp_path / "a.csv", lines({"time_s": time, "displacement_m": x, "force_N": 900.0 * v + 200.0 * np.sign(v)}))
    (said,) = refused(tmp_path)
    assert "a.csv:2: the displacement needs 2 reversals larger than 10% of its range" in said
    assert says in said
    assert said.endswith(f"drive a cycle and a half at least (got {turns})")


def test_a_cycle_and_a_half_is_enough(tmp_path: Path) -> None:
    time = np.arange(1500) * 1e-3
    x = 0.02 * np.sin(3.0 * np.pi * time / time[-1] - 0.5 * np.pi)
    v = np.gradient(x, time)
    write(tmp_path / "a.csv", lines({"time_s": time, "displacement_m": x, "force_N": 900.0 * v + 200.0 * np.sign(v)}))
    assert len(run(tmp_path).records) == 1


def slow(speed: float) -> dict[str, Any]:
    """Three triangles of 10 mm at a speed [m/s], on friction, damping and a spring."""
    period = 0.04 / speed
    time = np.linspace(0.0, 3.0 * period, 6000)
    x = 0.02 / np.pi * np.arcsin(np.sin(2.0 * np.pi * time / period))
    v = np.gradient(x, time)
    return {"time_s": time, "displacement_m": x, "force_N": 2000.0 * v + 200.0 * np.tanh(20.0 * v / speed) + 1e3 * x}


def test_tests_that_are_all_quasi_static_show_no_damping_and_this_is_told(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines(slow(8e-4)))
    (entry,) = run(tmp_path).entries
    (told,) = [finding for finding in entry.findings if finding.check == "speed"]
    assert told.size == pytest.approx(8e-4, rel=0.05)
    assert "the damping coefficient does not" in told.follows
    write(tmp_path / "b.csv", lines(CANONICAL))
    assert not [f for entry in run(tmp_path).entries for f in entry.findings if f.check == "speed"]


def test_a_held_channel_is_advised_what_a_file_allows(tmp_path: Path) -> None:
    held = FORCE.copy()
    held[203:230] = held[202]
    columns = CANONICAL | {"force_N": held}
    write(tmp_path / "a.csv", lines(columns))
    (told,) = [finding for finding in run(tmp_path).entries[0].findings if finding.check == "jumps"]
    assert "take these rows out of the file" in told.follows
    write(tmp_path / "a.csv", [row for n, row in enumerate(lines(columns)) if not 204 <= n <= 230])
    assert "jumps" not in [finding.check for finding in run(tmp_path).entries[0].findings]


# ---------------------------------------------------------------- hostile cells and files


@pytest.mark.parametrize("column", ["time_s", "displacement_m", "force_N", "voltage_V"])
def test_a_cell_that_is_no_measurement_is_refused_with_its_place(tmp_path: Path, column: str) -> None:
    row = TIME.size - 1 if column == "time_s" else 123
    write(
        tmp_path / "a.csv", lines(CANONICAL | {column: np.where(np.arange(TIME.size) == row, 6e198, CANONICAL[column])})
    )
    (said,) = refused(tmp_path)
    assert f"a.csv:{row + 2}: {column}: no {column.rpartition('_')[0]} is so large (got 6e+198)" in said


@pytest.mark.parametrize("bracket", ["[", '{"a":'])
@pytest.mark.parametrize("name", ["a.json", "a.csv"])
def test_a_hundred_thousand_brackets_are_refused(tmp_path: Path, bracket: str, name: str) -> None:
    (tmp_path / name).write_text(bracket * 100_000, encoding="utf-8")
    (said,) = refused(tmp_path, {"path": name})
    assert f"{name}:1: lists and objects nested too deep" in said
    with pytest.raises(DataError):
        guessed([tmp_path / name])


# ---------------------------------------------------------------- every other refusal: what it says to do is done

Remedy = dict[str, Any]
NAMED = {"t": TIME, "pos": X, "load": FORCE}
READ = {"columns": {"time": "t", "displacement": "pos", "force": "load"}}
SI = {"units": {"time": "s", "displacement": "m", "force": "N"}}
WITHOUT = {name: values for name, values in CANONICAL.items() if name != "voltage_V"}
START = datetime(2024, 2, 12, 23, 59, 59, 500000)  # noqa: DTZ001  # a logger knows no zone
DAYS = [(START + timedelta(seconds=t)).strftime("%d/%m/%Y %H:%M:%S.%f") for t in TIME.tolist()]

REFUSED: dict[str, tuple[list[str], Remedy, str, Remedy]] = {
    "the unit of a header is missing": (lines(NAMED), READ, r"units: \{displacement: m\}", READ | SI),
    "a misspelt header": (
        lines(NAMED),
        READ | SI | {"columns": READ["columns"] | {"force": "Load"}},
        r"columns: \{force: load\}",
        READ | SI,
    ),
    "millimetres": (
        lines(WITHOUT | {"displacement_m": X * 1e3}),
        {},
        r"say units: \{displacement: mm\}",
        {"units": {"displacement": "mm"}},
    ),
    "the sign": (lines(WITHOUT | {"force_N": -FORCE}), {}, r"say sign: \{force: -1\}", {"sign": {"force": -1}}),
    "the sign, turned in vain": (
        lines(WITHOUT),
        {"sign": {"force": -1}},
        r"say sign: \{force: 1\}",
        {"sign": {"force": 1}},
    ),
    "decimal commas": (lines(WITHOUT, ";", ","), {}, "decimal: ','", {"decimal": ","}),
    "blanks": (lines(WITHOUT, " "), {}, "say separator: ' '", {"separator": " "}),
    "a row of units": (
        [lines(NAMED)[0], "s,m,N", *lines(NAMED)[1:]],
        READ | SI,
        "say units_row: true",
        READ | {"units_row": True},
    ),
    "a preamble": (["Stand 7", *["of the lab"] * 6, *lines(WITHOUT)], {}, "say skip: ", {"skip": 7}),
    "an empty line above": (["", *lines(WITHOUT)], {}, "say skip: N where N lines", {"skip": 1}),
    "given twice": (
        lines(CANONICAL),
        {"constants": {"voltage": "50 V"}},
        r"columns: \{voltage: ''\}",
        {"constants": {"voltage": "50 V"}, "columns": {"voltage": ""}},
    ),
    "no unit of the name": (
        lines(WITHOUT),
        {"pattern": "^(?P<voltage>a|5)"},
        "say voltage: V",
        {"pattern": "(?P<voltage>5)", "units": {"voltage": "V"}},
    ),
    "a constant without its unit": (
        lines(WITHOUT),
        {"constants": {"voltage": "5"}},
        "like '1.5 V'",
        {"constants": {"voltage": "1.5 V"}},
    ),
    "days and months": (
        lines({"when": DAYS, "displacement_m": X, "force_N": FORCE}),
        {"columns": {"time": "when"}, "units": {"time": "%m/%d/%Y %H:%M:%S.%f"}},
        r'say units: \{time: "%d/%m/%Y %H:%M:%S.%f"\}',
        {"columns": {"time": "when"}, "units": {"time": "%d/%m/%Y %H:%M:%S.%f"}},
    ),
    "no time": (lines({"displacement_m": X, "force_N": FORCE}), {}, "say rate_Hz: N for N samples", {"rate_Hz": 500.0}),
    "creeping seconds": (
        lines(WITHOUT | {"time_s": TIME * 1e3}),
        {},
        r"say units: \{time: ms\}",
        {"units": {"time": "ms"}},
    ),
    "creeping seconds that are some": (
        lines(WITHOUT | {"time_s": TIME * 1e3}),
        {},
        r"units: \{time: s\}",
        {"units": {"time": "s"}},
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_refusal_says_to_do_is_accepted(tmp_path: Path, case: str) -> None:
    rows, entry, advice, remedy = REFUSED[case]
    write(tmp_path / "5.csv", rows)
    with pytest.raises(UserError) as caught:
        run(tmp_path, {"path": "5.csv", **entry})
    said = "\n".join(caught.value.messages)
    assert re.search(advice, said), said
    assert len(run(tmp_path, {"path": "5.csv", **remedy}).records) == 1


def test_an_encoding_that_is_advised_reads_the_file(tmp_path: Path) -> None:
    for encoding in ("utf-16", "latin-1"):
        write(tmp_path / "a.csv", lines(WITHOUT | {"Temp \u00b0": TIME}), encoding)
        (said,) = refused(tmp_path)
        (advised,) = re.findall("encoding: (.*)$", said)
        assert len(run(tmp_path, {"path": "a.csv", "encoding": advised}).records) == 1


def test_the_advice_of_a_finding_is_accepted(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines(CANONICAL | {"velocity_m_per_s": 2.0 * np.gradient(X, TIME)}))
    (told,) = run(tmp_path).entries[0].findings
    assert told.follows.endswith("left out: the speed is derived from the displacement")
    assert run(tmp_path, {"path": "a.csv", "columns": {"velocity": ""}}).entries[0].findings == ()


def test_a_tare_that_changed_is_taken_out_as_advised(tmp_path: Path) -> None:
    """Four tests of one speed, the load cell loaded in one of them: an entry of its own takes the tare out."""
    for name in ("a", "b", "c", "d"):
        write(tmp_path / f"{name}.csv", lines(WITHOUT | {"force_N": FORCE + 150.0 * (name == "d")}))
    offsets = [f for entry in run(tmp_path).entries for f in entry.findings if f.check == "offset"]
    (told,) = offsets
    assert told.size == pytest.approx(150.0, rel=0.1)
    assert "tare" in told.follows
    assert "fixture" in told.follows
    apart = {"path": "d.csv", "fixture": {"tare_N": 150.0}}
    mended = run(tmp_path, {"path": "[abc].csv"}, apart)
    assert not [f for entry in mended.entries for f in entry.findings if f.check == "offset"]
    assert np.allclose(mended.records[3].force, mended.records[0].force)


def test_numbers_beyond_all_measure_are_refused_without_a_warning(tmp_path: Path) -> None:
    """Their products overflow, and what numpy says of that would stand on the screen."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for force, unit in ((1e300 * FORCE, "N"), (1e306 * np.sign(FORCE), "GN")):
            write(tmp_path / "a.csv", lines({"time_s": TIME, "displacement_m": 1e10 * X, "F": force}))
            guessed([tmp_path / "a.csv"])
            said = refused(tmp_path, {"path": "a.csv", "columns": {"force": "F"}, "units": {"force": unit}})
            assert any("no force is so large" in one for one in said)


def test_files_recorded_the_other_way_beside_others_are_told_to_need_an_entry_of_their_own(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines(CANONICAL))
    write(tmp_path / "b.csv", lines(CANONICAL | {"force_N": -FORCE}))
    (said,) = refused(tmp_path)
    assert "and in 1 other test of this entry it does none: it needs an entry of its own" in said
    (sign,) = re.findall(r"say sign: \{force: (-?1)\}", said)
    rig = run(tmp_path, {"path": "a.csv"}, {"path": "b.csv", "sign": {"force": int(sign)}})
    assert np.allclose(rig.records[0].force, rig.records[1].force)
