"""`pzd init`: what it writes is read back as it was meant; what is no rig file is refused in one line."""

from __future__ import annotations

import re
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from written_files import FORCE, TIME, X, lines, write, wrong

from pzd.artefacts import Rig
from pzd.config import load
from pzd.quantities import Control
from pzd.rig.files.guess import guessed
from pzd.rig.stage import ingest
from pzd.schema.errors import ConfigError, DataError

NO_RIG_FILES = {
    "a letter": ("Dear Sir,\n\nthe damper, as agreed, works.\nYours\n", "letter.csv:"),
    "columns of people": ("name,age,town\na,1,x\n", "people.csv:1: no header names time, displacement or force"),
    "nothing": ("\n", "no header line"),
}


@pytest.mark.parametrize("kind", NO_RIG_FILES)
def test_what_is_no_rig_file_is_refused_in_one_line(tmp_path: Path, kind: str) -> None:
    text, said = NO_RIG_FILES[kind]
    path = tmp_path / f"{kind.rsplit(maxsplit=1)[-1]}.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DataError) as caught:
        guessed([path])
    (line,) = caught.value.messages
    assert said in line


def test_every_file_that_is_no_rig_file_is_named(tmp_path: Path) -> None:
    for name in ("one.csv", "two.csv"):
        (tmp_path / name).write_text("name,age\na,1\n", encoding="utf-8")
    with pytest.raises(DataError) as caught:
        guessed([tmp_path / "one.csv", tmp_path / "two.csv"])
    assert len(caught.value.messages) == 2


# ---------------------------------------------------------------- what init writes, check reads


def stored(path: Path, head: list[str], columns: list[list[str]], separator: str, encoding: str = "utf-8") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = [separator.join(row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([*head, *rows]) + "\n", encoding=encoding)
    return path


def numbers(values: object, decimal: str = ".") -> list[str]:
    return [f"{value:.9g}".replace(".", decimal) for value in values]  # type: ignore[attr-defined]  # an array


def read_back(folder: Path, files: list[Path], filled: dict[str, str] | None = None) -> Rig:
    """The rig as the guessed config reads it, its empty places filled in."""
    text = "\n".join(guessed(files))
    for name, value in (filled or {}).items():
        text = re.sub(rf"^( +{name}:)   # fill in.*$", rf"\1 {value}", text, flags=re.MULTILINE)
    assert "fill in" not in text, text
    (folder / "guess.yaml").write_text(text, encoding="utf-8")
    config = load(folder / "guess.yaml")
    return ingest(config.rig, config.control.signal(), folder)


MM, KN = X * 1e3, FORCE / 1e3
FILES: dict[str, tuple[list[str], str, str, str]] = {
    "blanks": (["Time[s] Disp[mm] Force[kN]"], " ", ".", "utf-8"),
    "german": (["Zeit [s];Weg [mm];Kraft [kN]"], ";", ",", "latin-1"),
    "german units row": (["Prüfling 7", "", "Zeit;Weg;Kraft", "s;mm;kN"], ";", ",", "latin-1"),
    "german logger": (
        ["Nr;12", "Datum;22.11.2026", "", "Zeit [s];Weg [mm];Kraft [kN]"],
        ";",
        ",",
        "latin-1",
    ),
    "french": (["temps (s)\tcourse (mm)\teffort (kN)"], "\t", ",", "utf-8"),
    "spanish": (["tiempo [s],carrera [mm],fuerza [kN]"], ",", ".", "utf-8"),
    "underscores": (["time_s,pos_mm,load_kN"], ",", ".", "utf-8"),
    "letters": (["t_s,x_mm,F_kN"], ",", ".", "utf-8"),
    "slashes": (["Zeit / s;Weg / mm;Kraft / kN"], ";", ".", "utf-8"),
    "utf-16": (["Time [s],Stroke [mm],Load [kN]"], ",", ".", "utf-16"),
}


@pytest.mark.parametrize("kind", FILES)
def test_a_guess_needs_nothing_filled_in_where_the_headers_say_all(tmp_path: Path, kind: str) -> None:
    head, separator, decimal, encoding = FILES[kind]
    columns = [numbers(values, decimal) for values in (TIME, MM, KN)]
    path = stored(tmp_path / "a.txt", head, columns, separator, encoding)
    (record,) = read_back(tmp_path, [path]).records
    assert np.abs(record.displacement - X).max() < 1e-9
    assert np.abs(record.force - FORCE).max() < 1e-5


@pytest.mark.parametrize("heads", ["time_s,displacement_m,force_N", "Time (s),Pos (m),Load (N)"])
def test_which_way_is_rebound_is_always_asked_and_the_answer_turns_both_channels(tmp_path: Path, heads: str) -> None:
    """No recording tells: a damper turned round gives the same loops, and asymmetry would pass for its mirror image."""
    path = stored(tmp_path / "a.csv", [heads], [numbers(values) for values in (TIME, X, FORCE)], ",")
    text = guessed([path])
    (asked,) = [line for line in text if line.startswith("# Is extension (rebound) positive")]
    (answer,) = re.findall(r"say (sign: \{.*\})\.$", asked)
    (record,) = read_back(tmp_path, [path]).records
    (tmp_path / "turned.yaml").write_text("\n".join([*text, f"      {answer}"]), encoding="utf-8")
    (turned,) = ingest(load(tmp_path / "turned.yaml").rig, Control(), tmp_path).records
    assert turned.displacement == pytest.approx(-record.displacement)
    assert turned.force == pytest.approx(-record.force)


def test_headers_that_name_compression_are_told_with_the_signs_that_turn_them(tmp_path: Path) -> None:
    columns = [numbers(values) for values in (TIME, MM, FORCE)]
    path = stored(tmp_path / "a.csv", ["Time [s],Comp Travel [mm],Comp Force [N]"], columns, ",")
    (told,) = [line for line in guessed([path]) if "compression, by" in line]
    assert told.startswith("      # compression, by Comp Travel [mm] and Comp Force [N]: where it is positive, say ")
    entry = read_back(tmp_path, [path]).entries[0]
    assert [finding.check for finding in entry.findings if "whose header is" in finding.where] == ["sign", "sign"]
    (answer,) = re.findall(r"say (sign: \{.*\})$", told)
    (tmp_path / "turned.yaml").write_text("\n".join([*guessed([path]), f"      {answer}"]), encoding="utf-8")
    (turned,) = ingest(load(tmp_path / "turned.yaml").rig, Control(), tmp_path).records
    assert np.abs(turned.force + FORCE).max() < 1e-5
    compensated = stored(tmp_path / "b.csv", ["Time [s],Travel [mm],Temp comp Force [N]"], columns, ",")
    assert not any("compression, by" in line for line in guessed([compensated]))


def test_a_curve_with_a_column_for_each_direction_is_no_test_and_taken_by_damper(tmp_path: Path) -> None:
    path = tmp_path / "pvp.csv"
    path.write_text("Velocity (in/s),Compression (lbf),Rebound (lbf)\n1,-35,60\n2,-50,90\n3,-62,118\n", "utf-8")
    with pytest.raises(DataError, match=r"in place of a rig take it by damper: \{curve: \S*pvp.csv\} \("):
        guessed([path])


def test_one_header_is_one_quantity_and_engineering_units_go_before_volts(tmp_path: Path) -> None:
    heads = "Time (s),Load (V),Stroke (V),Load (N),Stroke (mm),Temp (C),Coil current (A)"
    volts = [numbers(values) for values in (TIME, FORCE / 500.0, X * 100.0, FORCE, MM, 0 * X + 22.5, 0 * X + 0.5)]
    path = stored(tmp_path / "a.csv", [heads], volts, ",")
    text = "\n".join(guessed([path]))
    named = re.findall(r"^        (\w+): (.*)$", text.partition("columns:")[2].partition("units:")[0], re.MULTILINE)
    assert dict(named) == {
        "time": "Time (s)",
        "displacement": "Stroke (mm)",
        "force": "Load (N)",
        "temperature": "Temp (C)",
        "current": "Coil current (A)",
    }
    assert "temperature: degC" in text
    (entry,) = read_back(tmp_path, [path]).entries
    assert (entry.temperature_degC, entry.voltage_V) == (22.5, 0.5)


def test_a_column_in_degrees_is_the_temperature_by_its_unit_alone(tmp_path: Path) -> None:
    columns = [numbers(values) for values in (TIME, MM, FORCE, 0 * X + 31.5)]
    path = stored(tmp_path / "a.csv", ["time [s],stroke [mm],force [N],oil [degC]"], columns, ",")
    (entry,) = read_back(tmp_path, [path]).entries
    assert entry.temperature_degC == 31.5


UNREAD = {
    "oil [degC],housing [degC]": "oil [degC] (may be the temperature), housing [degC] (may be the temperature)",
    "Supply [V],Counter": "Supply [V] (may be a control signal), Counter",
    "Encoder [mm],Temp [degC]": "Encoder [mm] (another displacement)",
    "Channel A,Channel C": "Channel A, Channel C",
}


@pytest.mark.parametrize("heads", UNREAD)
def test_every_column_that_is_not_read_is_told_with_what_it_may_be(tmp_path: Path, heads: str) -> None:
    columns = [numbers(values) for values in (TIME, MM, FORCE, 0 * X + 5.0, 0 * X + 31.5)]
    path = stored(tmp_path / "a.csv", [f"time [s],LVDT [mm],force [N],{heads}"], columns, ",")
    assert f"      # not read: {UNREAD[heads]}" in guessed([path])
    assert read_back(tmp_path, [path]).records


@pytest.mark.parametrize(
    "control", [("U_V", "voltage"), ("ctrl (V)", "voltage"), ("I_A", "current"), ("Coil/A", "current")]
)
def test_a_letter_or_a_word_of_any_signal_is_what_its_unit_says(tmp_path: Path, control: tuple[str, str]) -> None:
    header, name = control
    rows = [numbers(values) for values in (TIME, MM, FORCE, 0 * X + 31.5, 0 * X + 0.5)]
    path = stored(tmp_path / "a.csv", [f"t [s],x [mm],F [N],T [°C],{header}"], rows, ",")
    assert f"        {name}: {header}" in guessed([path])
    (entry,) = read_back(tmp_path, [path]).entries
    assert (entry.temperature_degC, entry.voltage_V) == (31.5, 0.5)


@pytest.mark.parametrize(("header", "unit", "name"), [("Coil", "A", "current"), ("Valve", "V", "voltage")])
def test_a_row_of_units_tells_the_control_signal_as_brackets_do(
    tmp_path: Path, header: str, unit: str, name: str
) -> None:
    rows = [numbers(values) for values in (TIME, MM, FORCE, 0 * X + 0.5)]
    path = stored(tmp_path / "a.csv", [f"Time,Stroke,Load,{header}", f"s,mm,N,{unit}"], rows, ",")
    assert f"        {name}: {header}" in guessed([path])
    (entry,) = read_back(tmp_path, [path]).entries
    assert entry.voltage_V == 0.5


@pytest.mark.parametrize(("unit", "name"), [("A", "current"), ("V", "voltage")])
def test_a_column_in_the_unit_of_a_control_signal_is_asked_about(tmp_path: Path, unit: str, name: str) -> None:
    """A command may be that of the stand or of the damper; left out in silence, all its values pass for one."""
    rows = [numbers(values) for values in (TIME, MM, FORCE, 0 * X + 0.5)]
    path = stored(tmp_path / "a.csv", ["Time,Stroke,Load,Command", f"s,mm,N,{unit}"], rows, ",")
    (asked,) = [line for line in guessed([path]) if line.startswith("# Is 'Command' the control signal?")]
    assert f"columns: {{{name}: Command}}" in asked


def test_a_farad_of_a_temperature_is_a_degree_fahrenheit(tmp_path: Path) -> None:
    columns = [numbers(values) for values in (TIME, MM, FORCE, 0 * X + 77.0)]
    path = stored(tmp_path / "a.csv", ["t [s],x [mm],F [N],Temp (F)"], columns, ",")
    (entry,) = read_back(tmp_path, [path]).entries
    assert entry.temperature_degC == pytest.approx(25.0)


@pytest.mark.parametrize("said", ["# Sample rate: 500 Hz", "Abtastfrequenz 0,5 kHz", "SAMPLING 500.0 hz"])
def test_a_rate_above_the_header_stands_for_a_column_of_time(tmp_path: Path, said: str) -> None:
    path = stored(tmp_path / "a.csv", [said, "Stroke (mm);Load (N)"], [numbers(MM), numbers(FORCE)], ";")
    assert "      rate_Hz: 500    # from the lines above the header: no column holds the time" in guessed([path])
    (record,) = read_back(tmp_path, [path]).records
    assert record.time == pytest.approx(np.arange(TIME.size) / 500.0)


@pytest.mark.parametrize("above", [[], ["Test frequency: 5 Hz"], ["Generated at 5 Hz"]])
@pytest.mark.parametrize("numbered", [False, True])
def test_a_rate_that_no_line_gives_is_asked_for(tmp_path: Path, above: list[str], numbered: bool) -> None:
    """Numbers of the rows are no time."""
    head, columns = "Stroke (mm);Load (N)", [numbers(MM), numbers(FORCE)]
    if numbered:
        head, columns = f"Sample;{head}", [numbers(np.arange(TIME.size)), *columns]
    text = "\n".join(guessed([stored(tmp_path / "a.csv", [*above, head], columns, ";")]))
    asked = "rate_Hz:   # fill in: samples a second"
    assert asked in text
    assert "Sample" not in text.partition("# not read: ")[0]
    (tmp_path / "guess.yaml").write_text(text.replace(asked, "rate_Hz: 500  #"), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    (record,) = ingest(config.rig, config.control.signal(), tmp_path).records
    assert record.time == pytest.approx(np.arange(TIME.size) / 500.0)


def test_files_that_tell_several_rates_are_read_each_by_its_own(tmp_path: Path) -> None:
    columns = [numbers(MM), numbers(FORCE)]
    paths = [
        stored(tmp_path / f"{rate}.csv", [f"Sample rate: {rate} Hz", "Stroke (mm);Load (N)"], columns, ";")
        for rate in (500, 1000)
    ]
    assert {record.time[1] for record in read_back(tmp_path, paths).records} == {1.0 / 500, 1.0 / 1000}


def test_what_stays_open_is_an_empty_value_that_the_check_asks_for(tmp_path: Path) -> None:
    path = stored(tmp_path / "a.csv", ["t,pos,Channel 3"], [numbers(values) for values in (TIME, MM, FORCE)], ",")
    (tmp_path / "guess.yaml").write_text("\n".join(guessed([path])), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load(tmp_path / "guess.yaml")
    said = "\n".join(caught.value.messages)
    assert "rig.files.0.columns.force: is empty; fill in the header of its column" in said
    assert "rig.files.0.units.time: is empty; fill in its unit" in said
    assert "guess.yaml:" in said


def test_instants_are_read_by_the_format_of_the_first_row(tmp_path: Path) -> None:
    for number, form in enumerate(("%Y-%m-%dT%H:%M:%S.%f", "%d.%m.%Y %H:%M:%S.%f", "%H:%M:%S.%f")):
        stamps = [(datetime(2024, 3, 25, 10, 59, 59) + timedelta(seconds=t)).strftime(form) for t in TIME.tolist()]  # noqa: DTZ001  # a logger knows no zone
        path = stored(
            tmp_path / f"{number}.csv", ["Zeit,Weg [mm],Kraft [N]"], [stamps, numbers(MM), numbers(FORCE)], ","
        )
        assert np.abs(read_back(tmp_path, [path]).records[0].time - TIME).max() < 1e-6
        path = stored(
            tmp_path / f"when{number}.csv", ["Wann,Weg [mm],Kraft [N]"], [stamps, numbers(MM), numbers(FORCE)], ","
        )
        assert np.abs(read_back(tmp_path, [path], {"time": "Wann"}).records[0].time - TIME).max() < 1e-6


def test_names_of_files_tell_the_control_and_the_work_the_sign(tmp_path: Path) -> None:
    columns = [numbers(values) for values in (TIME, X, -FORCE)]
    for volts in (0, 75, 150):
        stored(tmp_path / "data" / f"sine_2Hz_{volts}V.csv", ["time_s,displacement_m,force_N"], columns, ",")
    files = sorted((tmp_path / "data").glob("*.csv"))
    text = guessed(files)
    assert sum("path:" in line for line in text) == 1
    rig = read_back(tmp_path, files)
    assert sorted(entry.voltage_V or 0.0 for entry in rig.entries) == [0.0, 75.0, 150.0]
    assert np.abs(rig.records[0].force - FORCE).max() < 1e-5


def recorded_below(folder: Path, above: dict[str, list[str]], marks: str = ";.") -> list[Path]:
    """Store a recording a name below lines of its own, by separator and decimal mark."""
    separator, decimal = marks
    columns = [numbers(values, decimal) for values in (TIME, MM, FORCE)]
    heads = separator.join(("t [s]", "x [mm]", "F [N]"))
    return [stored(folder / f"{name}.csv", [*said, heads], columns, separator) for name, said in above.items()]


SAID_ABOVE = {
    ("Current [A]: 0.5", "Current [A]: 1"): (";.", "current", (0.5, 1.0)),
    ("# Spulenstrom = 500 mA", "# Spulenstrom = 1250 mA"): (";.", "current", (0.5, 1.25)),
    ("Strom;0,5;A", "Strom;1,0;A"): (";,", "current", (0.5, 1.0)),
    ("Voltage,75,V", "Voltage,150,V"): (",.", "voltage", (75.0, 150.0)),
    ("\u7535\u6d41\uff1a0.5 A", "\u7535\u6d41\uff1a1.0 A"): (";.", "current", (0.5, 1.0)),
    ("Piezo voltage (V):\t0", "Piezo voltage (V):\t150"): (";.", "voltage", (0.0, 150.0)),
}


@pytest.mark.parametrize("said", SAID_ABOVE)
def test_a_level_above_the_header_is_read_where_it_differs_from_file_to_file(
    tmp_path: Path, said: tuple[str, str]
) -> None:
    """Without it, tests of several levels are fitted as of one. A supply that is the same in all is no level."""
    marks, name, levels = SAID_ABOVE[said]
    same = "Supply current [A]: 3" if name == "current" else "Supply voltage [V]: 24"
    above = {
        one: ["Bench 4", same, line, f"Oil temperature: {20 + n} degC", ""]
        for n, (one, line) in enumerate(zip("ab", said, strict=True))
    }
    rig = read_back(tmp_path, recorded_below(tmp_path, above, marks))
    assert [entry.voltage_V for entry in rig.entries] == pytest.approx(levels)
    assert [entry.temperature_degC for entry in rig.entries] == pytest.approx([20.0, 21.0])


def test_what_is_the_same_above_every_header_is_no_level(tmp_path: Path) -> None:
    above = {one: ["Excitation voltage: 10 V", "Range: 5 kN"] for one in "ab"}
    assert not any(
        "preamble" in line or line.startswith("control:") for line in guessed(recorded_below(tmp_path, above))
    )


@pytest.mark.parametrize(
    ("above", "fault"),
    [
        (
            ["Valve: 0.5 A", "Limit: 3 A"],
            "the lines above the header match it in 2 places (0.5 and 3); add what stands before the right one",
        ),
        (["Valve: off"], "no line above the header holds a number; where one does, say skip: N for so many lines"),
        (
            ["Valve: 12 V"],
            "none of the lines above the header matches it; write it after one of them, as 'Valve: 12 V'",
        ),
    ],
)
def test_lines_above_the_header_that_tell_two_levels_or_none_are_refused(
    tmp_path: Path, above: list[str], fault: str
) -> None:
    recorded_below(tmp_path, {"a": above})
    entry = {
        "path": "a.csv",
        "separator": ";",
        "skip": len(above),
        "preamble": "(?P<current>[0-9.]+) A",
        "units": {"current": "A"},
    }
    columns = {"columns": {"time": "t [s]", "displacement": "x [mm]", "force": "F [N]"}}
    (said,) = wrong(tmp_path, entry | columns, control=Control("current", "A"))
    assert said == f"rig.files.0.preamble: {fault} (got a.csv)"


def test_each_sheet_of_a_workbook_has_the_level_above_its_own_header(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for level in (0.5, 1.0):
        sheet = book.create_sheet(f"run {level}")
        sheet.append(["Current [A]:", level])
        sheet.append(["t [s]", "x [mm]", "F [N]"])
        for row in zip(TIME.tolist(), MM.tolist(), FORCE.tolist(), strict=True):
            sheet.append(row)
    book.save(tmp_path / "book.xlsx")
    assert [entry.voltage_V for entry in read_back(tmp_path, [tmp_path / "book.xlsx"]).entries] == [0.5, 1.0]


def test_the_share_of_time_of_a_valve_is_its_level_and_not_the_voltage_that_it_chops(tmp_path: Path) -> None:
    columns = [numbers(values) for values in (TIME, MM, FORCE, 0 * X + 12.0, 0 * X + 40.0)]
    path = stored(tmp_path / "a.csv", ["t [s],x [mm],F [N],Supply voltage [V],PWM [%]"], columns, ",")
    rig = read_back(tmp_path, [path])
    assert rig.entries[0].voltage_V == pytest.approx(40.0)


# ---------------------------------------------------------------- dampers with clickers

CLICKERS = {
    "C08_R12_22degC": ("C04_R12_22degC", "C08_R12"),
    "run7-click5-0.131": ("run7-click1-0.131", "click5"),
    "15 clicks fast": ("3 clicks fast", "15 clicks"),
    "front_Klick-9": ("front_Klick-10", "Klick-9"),
    "150V_C08R12_22C": ("100V_C04R12_22C", "C08R12"),
}


@pytest.mark.parametrize("name", CLICKERS)
def test_clickers_in_the_names_are_settings_and_one_of_them_is_chosen(tmp_path: Path, name: str) -> None:
    other, clicker = CLICKERS[name]
    columns = [numbers(values) for values in (TIME, X, FORCE)]
    head = ["time_s,displacement_m,force_N"]
    files = [stored(tmp_path / "data" / f"{stem}.csv", head, columns, ",") for stem in (name, other)]
    entries = {entry.name.replace("_", " "): entry for entry in read_back(tmp_path, files).entries}
    mine = entries[name.replace("_", " ")]
    assert mine.setting == clicker
    assert mine.temperature_degC == (22.0 if "22" in name else None)
    assert mine.voltage_V == (150.0 if "150V" in name else None)
    settings = sorted(entry.setting or "" for entry in entries.values())
    assert load(tmp_path / "guess.yaml").setting == settings[0]


def test_clickers_are_read_by_a_layout_that_does_not_tell_where_they_stand(tmp_path: Path) -> None:
    columns = [numbers(values, ",") for values in (TIME, MM, FORCE, 0.0 * TIME + 22.0)]
    head = ["Zeit [s];Weg [mm];Kraft [N];Temperatur [\xb0C]"]
    files = [stored(tmp_path / f"click{n}.csv", head, columns, ";", "latin-1") for n in (1, 5)]
    assert any("layout: german_dyno" in line for line in guessed(files))
    assert [entry.setting for entry in read_back(tmp_path, files).entries] == ["click1", "click5"]


DAMPERS = {
    "LF_0.5Hz RF_1.0Hz": "LF RF",
    "sine_2Hz_front_left sine_2Hz_rear_left": "front_left rear_left",
    "SN1041_sine SN1042_sine": "SN1041 SN1042",
    "run_damper-1_a run_damper-2_a": "damper-1 damper-2",
    "LF_C12_R8_15in_s RF_C12_R8_15in_s": "LF_C12_R8 RF_C12_R8",
    "C4_R8_LF_15in_s C12_R8_LR_15in_s": "C12_R8_LR C4_R8_LF",
    "LF_15in_s_click5 RF_15in_s_click1": "LF_click5 RF_click1",
    "FR_3Hz_150V FL_3Hz_150V": "FL FR",
    "R10C5_0.5Hz R2C5_0.5Hz": "R10C5 R2C5",
    "reb2_0.5Hz reb10_0.5Hz": "reb10 reb2",
    "t1_50psi t1_150psi": "150psi 50psi",
    "2.5bar_1Hz 5bar_1Hz": "2.5bar 5bar",
}


@pytest.mark.parametrize("among_others", [False, True])
@pytest.mark.parametrize("names", DAMPERS)
def test_dampers_of_several_corners_or_numbers_are_settings(tmp_path: Path, names: str, among_others: bool) -> None:
    """One fit to two dampers is neither."""
    columns = [numbers(values) for values in (TIME, X, FORCE)]
    head = ["time_s,displacement_m,force_N"]
    files = [stored(tmp_path / "data" / f"{stem}.csv", head, columns, ",") for stem in names.split()]
    if among_others:
        stored(tmp_path / "data" / "of_another_day.csv", head, columns, ",")
    entries = read_back(tmp_path, files).entries
    assert sorted(entry.setting or "" for entry in entries) == DAMPERS[names].split()
    assert load(tmp_path / "guess.yaml").setting == DAMPERS[names].split()[0]
    assert {entry.voltage_V for entry in entries} == ({150.0} if "V" in names else {None})


FOLDERS: dict[str, tuple[list[str | None], list[float | None], list[float | None]]] = {
    "before/1Hz after/1Hz": (["after", "before"], [None], [None]),
    "new/csv/1Hz new/csv/2Hz aged/csv/1Hz aged/csv/2Hz": (["aged", "aged", "new", "new"], [None], [None]),
    "LF/1Hz RF/2Hz": (["LF", "RF"], [None], [None]),
    "before/1Hz after/2Hz": (["after", "before"], [None], [None]),
    "before/click5 before/click1 after/click5": (["after click5", "before click1", "before click5"], [None], [None]),
    "0V/1Hz 5V/1Hz": ([None, None], [0.0, 5.0], [None]),
    "20degC/1Hz 40degC/1Hz": ([None, None], [None], [20.0, 40.0]),
    "new/0V/1Hz new/5V/1Hz old/0V/1Hz old/5V/1Hz": (["new", "new", "old", "old"], [0.0, 5.0], [None]),
    "0V/new/1Hz 0V/old/1Hz 5V/new/1Hz 5V/old/1Hz": (["new", "new", "old", "old"], [0.0, 5.0], [None]),
    "monday/1Hz tuesday/2Hz": ([None, None], [None], [None]),
}


@pytest.mark.parametrize("paths", FOLDERS)
def test_folders_with_the_same_tests_are_states_of_a_damper_unless_they_name_a_level(
    tmp_path: Path, paths: str
) -> None:
    """One fit to a damper before and after a rebuild is neither."""
    settings, voltages, temperatures = FOLDERS[paths]
    head, columns = ["time_s,displacement_m,force_N"], [numbers(values) for values in (TIME, X)]
    files = [
        stored(tmp_path / f"{path}.csv", head, [*columns, numbers((1.0 + 0.01 * i) * FORCE)], ",")
        for i, path in enumerate(paths.split())  # a copy of a test would be told as such
    ]
    entries = read_back(tmp_path, files).entries
    assert sorted((entry.setting for entry in entries), key=str) == settings
    assert sorted({entry.voltage_V for entry in entries}, key=str) == voltages
    assert sorted({entry.temperature_degC for entry in entries}, key=str) == temperatures


def test_a_frequency_behind_a_direction_is_no_position_of_a_clicker(tmp_path: Path) -> None:
    """Rebound and compression in files of their own: rebound0.5Hz is no click 0."""
    columns, head = [numbers(values) for values in (TIME, X, FORCE)], ["time_s,displacement_m,force_N"]
    files = [stored(tmp_path / f"{name}.csv", head, columns, ",") for name in ("rebound0.5Hz", "rebound_1.5Hz")]
    assert not any("setting" in line for line in guessed(files))


def test_one_setting_or_none_needs_no_choice(tmp_path: Path) -> None:
    columns = [numbers(values) for values in (TIME, X, FORCE)]
    for names in (("click5-a", "click5-b"), ("plain-a", "plain-b"), ("click5-a", "plain-a"), ("LF-a", "LF-b")):
        files = [
            stored(tmp_path / names[1] / f"{name}.csv", ["time_s,displacement_m,force_N"], columns, ",")
            for name in names
        ]
        assert not any(line.startswith("setting:") for line in guessed(files))


def test_without_a_control_signal_the_line_that_leaves_the_car_out_is_shown(tmp_path: Path) -> None:
    columns = [numbers(values) for values in (TIME, X, FORCE)]
    path = stored(tmp_path / "a.csv", ["time_s,displacement_m,force_N"], columns, ",")
    (line,) = [line for line in guessed([path]) if line == "# car: false"]
    (tmp_path / "guess.yaml").write_text("\n".join([line.removeprefix("# "), *guessed([path])]), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    assert not config.car
    assert config.identify.law == "auto"  # a passive damper is seldom one T0 and C
    driven = stored(tmp_path / "b_100V.csv", ["time_s,displacement_m,force_N"], columns, ",")
    assert "# car: false" not in guessed([driven])


def test_of_two_columns_of_one_name_that_in_newtons_is_the_force_beside_that_in_volts(tmp_path: Path) -> None:
    lines = ["Time,Force,Force,Position", "(s),(V),(N),(m)"]
    columns = [numbers(values) for values in (TIME, 0.01 * FORCE, FORCE, X)]
    path = stored(tmp_path / "a.csv", lines, columns, ",")
    (record,) = read_back(tmp_path, [path]).records
    np.testing.assert_allclose(record.force, FORCE, rtol=1e-3, atol=1e-3 * np.ptp(FORCE))


# ---------------------------------------------------------------- headers of the world, and what is no test


WORLD = {
    "gbk": ["时间(s)", "位移(mm)", "阻尼力(N)", "电压(V)"],
    "shift_jis": ["時間[s]", "変位[mm]", "荷重[N]", "電圧[V]"],
    "utf-16": ["时间\uff08s\uff09", "行程\uff08mm\uff09", "力\uff08N\uff09", "电压\uff08V\uff09"],
    "latin-1": ["Temps (s)", "Déplacement (mm)", "Effort amortisseur (N)", "Tension à la vanne (V)"],
    "cp1250": ["Czas [s]", "Przemieszczenie [mm]", "Siła [N]", "Napięcie [V]"],
    "utf-8": ["Tempo [s]", "Spostamento [mm]", "Forza [N]", "Tensione [V]"],
    "cp1252": ["Tiempo [s]", "Desplazamiento [mm]", "Fuerza máxima [N]", "Tensión [V]"],
    "cp1251": [
        "\u0412\u0440\u0435\u043c\u044f, \u0441",
        "\u041f\u0435\u0440\u0435\u043c\u0435\u0449\u0435\u043d\u0438\u0435, \u043c\u043c",
        "\u0423\u0441\u0438\u043b\u0438\u0435, \u041d",
        "\u041d\u0430\u043f\u0440\u044f\u0436\u0435\u043d\u0438\u0435, \u0412",
    ],
    "cp1254": ["Tempo [s]", "Deslocamento [mm]", "Força [N]", "Tensão [V]"],
    "iso8859-15": ["Zeit [s]", "Kolbenweg [mm]", "Dämpferkraft [N]", "Spannung [V]"],
}


@pytest.mark.parametrize("encoding", WORLD)
def test_headers_of_the_world_are_known_in_their_code_pages(
    tmp_path: Path, encoding: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    columns = dict(zip(WORLD[encoding], (TIME, 1e3 * X, FORCE, np.full(TIME.size, 2.0)), strict=True))
    write(tmp_path / "a.csv", lines(columns, ";", ","), encoding)
    text = "\n".join(guessed([Path("a.csv")]))
    assert "fill in" not in text
    Path("own.yaml").write_text(text, encoding="utf-8")
    (entry,) = ingest(load(Path("own.yaml")).rig, Control(), tmp_path).entries
    assert entry.voltage_V == 2.0
    assert entry.force_rms_N == pytest.approx(np.std(FORCE), rel=1e-6)


def world_of(tmp_path: Path, rows: list[str]) -> str:
    write(tmp_path / "a.csv", rows)
    with pytest.raises(DataError) as caught:
        guessed([tmp_path / "a.csv"])
    return caught.value.messages[0]


def test_a_file_that_is_no_test_of_a_damper_is_told_what_it_is(tmp_path: Path) -> None:
    ride = {"Time [s]": TIME, "ax [g]": X, "ay [g]": X, "az [g]": X}
    assert "accelerations of a ride, and no test of a damper: pzd rate rates them" in world_of(tmp_path, lines(ride))
    v = np.linspace(-1.0, 1.0, 21)
    curve = {"Velocity [m/s]": v, "Force [N]": 900.0 * v}
    told = world_of(tmp_path, lines(curve))
    assert "a curve of force over velocity, and no recording over time" in told
    assert "take it by damper: {curve: " in told
    bands = {"Frequency [Hz]": np.geomspace(1.0, 80.0, 20), "a [m/s2]": np.full(20, 0.2)}
    assert "levels over frequency, as of third octaves" in world_of(tmp_path, lines(bands))
    telemetry = {"Time [s]": TIME, "Damper Pos FL [mm]": X, "Damper Pos FR [mm]": X, "Speed [km/h]": X}
    assert "without force no damper: this file has Time [s], Damper Pos FL [mm]" in world_of(tmp_path, lines(telemetry))
    velocity = {"Time [s]": TIME, "Velocity [m/s]": X, "Force [N]": FORCE}
    told = world_of(tmp_path, lines(velocity))
    assert "without displacement no damper: this file has Time [s], Velocity [m/s], Force [N]" in told
    assert "write the integral of the velocity" in told


def test_no_column_is_offered_for_two_quantities_and_units_are_asked_in_the_same_round(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines({"Time [s]": TIME, "Kanal 1": X, "Kanal 2": FORCE}))
    said = guessed([tmp_path / "a.csv"])
    assert "        displacement:   # fill in: one of Kanal 1, Kanal 2" in said
    assert "        force:   # fill in: one of the others of these" in said
    assert "        displacement:   # fill in: the unit of that column, e.g. mm" in said
    assert "        force:   # fill in: the unit of that column, e.g. N" in said


def motec(rows: list[str]) -> list[str]:
    """As MoTeC i2 writes CSV: a preamble of quoted pairs, headers, units, an empty line, quoted numbers."""
    return [
        '"Format","MoTeC CSV File",,,"Workbook","Damper"',
        '"Vehicle","Rig 3",,,"Worksheet","Loops"',
        '"Sample Rate","500.000","Hz",,"End Time","1.0","s"',
        "",
        '"Time","Damper Pos","Damper Force"',
        '"s","mm","N"',
        "",
        *(",".join(f'"{cell}"' for cell in row.split(",")) for row in rows),
    ]


def test_csv_of_motec_i2_and_quoted_decimal_commas_are_read_as_they_are_guessed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    rows = lines({"t": TIME, "x": 1e3 * X, "F": FORCE})[1:]
    write(Path("motec.csv"), motec(rows))
    comma = [",".join(f'"{cell}"'.replace(".", ",") for cell in row.split(",")) for row in rows]
    write(Path("comma.csv"), ['"Zeit [s]","Weg [mm]","Kraft [N]"', *comma])
    write(Path("trail.csv"), ["Time [s],Pos [mm],Load [N]", *(r + "," * (n % 3 == 0) for n, r in enumerate(rows))])
    for name in ("motec", "comma", "trail"):
        text = "\n".join(guessed([Path(f"{name}.csv")]))
        assert "fill in" not in text
        Path("own.yaml").write_text(text.replace("# car", "car"), encoding="utf-8")
        (record,) = ingest(load(Path("own.yaml")).rig, Control(), tmp_path).records
        assert record.displacement == pytest.approx(X, abs=1e-9)
        assert record.force == pytest.approx(FORCE, abs=1e-5)


@pytest.mark.parametrize(
    ("heads", "taken"),
    [
        (("Weg soll [mm]", "Weg ist [mm]", "Kraft [N]"), ("Weg ist [mm]", "Kraft [N]")),
        (("Position [mm]", "Side Load [N]", "Axial Load [N]"), ("Position [mm]", "Axial Load [N]")),
        (("Axial Displacement Command [mm]", "Axial Displacement [mm]", "Force Ref [N]", "Axial Force [N]"),
         ("Axial Displacement [mm]", "Axial Force [N]")),
        (("Stroke [mm]", "Force [lbf]", "Force [N]"), ("Stroke [mm]", "Force [lbf]")),  # the same one twice
    ],
)  # fmt: skip
def test_what_was_demanded_or_acts_across_the_stroke_is_not_taken_for_what_was_measured(
    tmp_path: Path, heads: tuple[str, ...], taken: tuple[str, str]
) -> None:
    channels = {"[mm]": 1e3 * X, "[N]": FORCE, "[lbf]": FORCE / 4.448}
    columns = {head: channels[head[head.index("["):]] for head in heads}  # fmt: skip
    path = write(tmp_path / "a.csv", lines({"Time [s]": TIME} | columns))
    text = "\n".join(guessed([path]))
    assert f'displacement: "{taken[0]}"' in text
    assert f'force: "{taken[1]}"' in text


def test_of_several_columns_that_may_be_the_force_none_is_taken_unasked(tmp_path: Path) -> None:
    columns = {"Test No": np.ones(TIME.size), "Time [s]": TIME, "Stroke [mm]": 1e3 * X}
    path = write(tmp_path / "a.csv", lines(columns | {"Force A [N]": FORCE, "Force B [N]": 0.1 * FORCE}))
    text = guessed([path])
    assert "        force:   # fill in: one of Force A [N], Force B [N]" in text


def test_a_curve_whose_columns_tell_rebound_is_proposed_without_a_sign(tmp_path: Path) -> None:
    speed = np.linspace(0.05, 0.5, 10)
    path = write(tmp_path / "a.csv", lines({"Velocity [m/s]": speed, "Comp Force [N]": speed, "Reb Force [N]": speed}))
    with pytest.raises(DataError, match=r"by damper: \{curve: [^,]*a\.csv\} "):
        guessed([path])
