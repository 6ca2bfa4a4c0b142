"""What an engineer's file or config could be read wrongly without a word: read right, refused, or a finding."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from written_files import CANONICAL, FORCE, TIME, V, X, lines, refused, run, write, wrong

from pzd.quantities import Control
from pzd.record import conditions
from pzd.rig.files.guess import guessed
from pzd.schema.errors import DataError
from tests.studies.misread_files import WAYS, Way, tried

LONG = np.arange(8000) * 1e-3
LONG_X = 0.01 * np.sin(2.0 * np.pi * 2.0 * LONG)
LONG_V = np.gradient(LONG_X, LONG)
LONG_FORCE = 900.0 * LONG_V + 200.0 * np.tanh(LONG_V / 0.01)
LONGER = {"time_s": LONG, "displacement_m": LONG_X, "force_N": LONG_FORCE}


def checks(folder: Path, *entries: dict[str, object]) -> list[str]:
    """The findings of the first record, each as check and place."""
    return [f"{finding.check}: {finding.where}" for finding in run(folder, *entries).entries[0].findings]


# ---------------------------------------------------------------- said twice


def test_a_quantity_from_a_column_and_from_the_config_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "a_50V.csv", lines(CANONICAL))
    (said,) = wrong(tmp_path, {"path": "*.csv", "constants": {"voltage": "50 V"}})
    assert "rig.files.0: voltage: stands in column 'voltage_V'" in said
    assert "under constants as well" in said
    pattern = {"path": "*.csv", "pattern": r"_(?P<voltage>\d+)V", "units": {"voltage": "V"}}
    assert "under pattern as well" in wrong(tmp_path, pattern)[0]
    a_test = {"path": "*.csv", "split": {"gap_s": 9.0, "constants": {"voltage": ["50 V"]}}}
    assert "under split.constants as well" in wrong(tmp_path, a_test)[0]
    for entry in (pattern, {"path": "*.csv", "constants": {"voltage": "50 V"}}):
        assert run(tmp_path, entry | {"columns": {"voltage": ""}}).entries[0].voltage_V == 50.0
    empty = {name: values for name, values in CANONICAL.items() if name != "voltage_V"} | {"voltage_V": [""] * 500}
    write(tmp_path / "a_50V.csv", lines(empty))
    assert run(tmp_path, pattern).entries[0].voltage_V == 50.0


# ---------------------------------------------------------------- tare and sign


def test_the_tare_is_what_the_cell_shows_whatever_the_sign(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines(CANONICAL | {"force_N": -FORCE + 50.0}))
    (record,) = run(tmp_path, {"path": "a.csv", "sign": {"force": -1}, "fixture": {"tare_N": 50}}).records
    assert np.abs(record.force - FORCE).max() < 1e-4


# ---------------------------------------------------------------- glitches


def test_one_sample_of_ten_kilovolts_merges_no_conditions(tmp_path: Path) -> None:
    for volts in (0.0, 50.0, 150.0):
        voltage = np.full(LONG.size, volts)
        if volts == 50.0:
            voltage[[10, 4000, LONG.size - 1]] = 1e4
        write(tmp_path / f"{volts:.0f}.csv", lines(LONGER | {"voltage_V": voltage}))
    rig = run(tmp_path)
    found, moving = conditions(rig.records)
    assert [condition.voltage for condition in found] == [0.0, 50.0, 150.0]
    assert moving == ()
    (finding,) = [f for entry in rig.entries for f in entry.findings]
    assert (finding.check, finding.unit) == ("spikes", "V")
    assert finding.where.startswith("voltage, 3 samples")
    assert finding.size == pytest.approx(1e4 - 50.0)


def test_glitches_of_temperature_and_pressure_are_findings_under_their_own_names(tmp_path: Path) -> None:
    temperature, pressure, current = np.full(8000, 22.0), np.full(8000, 2e6), np.full(8000, 0.5)
    temperature[3000], pressure[2000], current[1000] = 999.0, 0.0, 9.0
    labels = {"temperature_degC": temperature, "pressure_Pa": pressure, "current_A": current}
    write(tmp_path / "a.csv", lines(LONGER | labels))
    (entry,) = run(tmp_path, control=Control("current", "A")).entries
    assert [(f.check, f.where.split(",")[0], f.unit) for f in entry.findings] == [
        ("spikes", "current", "A"),
        ("spikes", "temperature", "degC"),
        ("spikes", "pressure", "Pa"),
    ]
    assert (entry.temperature_degC, entry.voltage_V) == (22.0, 0.5)


def test_hum_of_a_constant_control_and_of_a_thermocouple_is_reported(tmp_path: Path) -> None:
    hum = np.sin(2.0 * np.pi * 50.0 * LONG)
    quiet = 0.01 * np.sin(2.0 * np.pi * 3.7 * LONG)
    channels = {"voltage_V": 100.0 + 1.0 * hum + quiet, "temperature_degC": 22.0 + 0.5 * hum + quiet}
    write(tmp_path / "a.csv", lines(LONGER | channels))
    found = checks(tmp_path)
    assert "hum: voltage, the whole record, at 50 Hz" in found
    assert "hum: temperature, the whole record, at 50 Hz" in found


def test_a_control_cut_off_at_its_range_is_reported_and_a_programme_is_not(tmp_path: Path) -> None:
    sine = 80.0 * np.sin(2.0 * np.pi * 1.3 * LONG)
    programmes = {
        "steps": 100.0 * (np.sin(2.0 * np.pi * 1.3 * LONG + 1.0) > 0.0),
        "ramps": np.clip(200.0 * np.abs((LONG * 0.7) % 1.0 - 0.5), 20.0, 80.0),
        "cut": np.minimum(sine, 50.0),
    }
    for name, voltage in programmes.items():
        write(tmp_path / f"{name}.csv", lines(LONGER | {"voltage_V": voltage}))
    said = {entry.name: [f.check for f in entry.findings if "voltage" in f.where] for entry in run(tmp_path).entries}
    assert said == {"cut": ["saturation"], "ramps": [], "steps": []}


def test_labels_that_are_constant_but_for_rounding_are_constants(tmp_path: Path, rng: np.random.Generator) -> None:
    rounding = 1e-13 * rng.standard_normal(8000)
    text = [
        f"{t!r},{x!r},{f!r},{u!r},{d!r}"
        for t, x, f, u, d in zip(
            LONG.tolist(),
            LONG_X.tolist(),
            LONG_FORCE.tolist(),
            rounding.tolist(),
            (71.6 + rounding).tolist(),
            strict=True,
        )
    ]
    write(tmp_path / "a.csv", ["time_s,displacement_m,force_N,voltage_V,T [degF]", *text])
    rig = run(tmp_path, {"path": "a.csv", "columns": {"temperature": "T [degF]"}})
    (record,) = rig.records
    assert record.voltage is not None
    assert record.temperature is not None
    assert np.ptp(record.voltage) == 0.0
    assert np.ptp(record.temperature) == 0.0
    assert rig.entries[0].findings == ()
    assert conditions(rig.records)[1] == ()


# ---------------------------------------------------------------- the clock


def test_a_second_sampling_rate_after_a_pause_is_refused_with_its_line_and_read_where_it_is_cut(tmp_path: Path) -> None:
    slow = 60.0 + np.arange(500) * 1e-2
    time = np.concatenate((TIME, slow))
    x = np.concatenate((X, 0.01 * np.sin(2.0 * np.pi * slow)))
    v = np.gradient(x, time)
    write(tmp_path / "a.csv", lines({"time_s": time, "displacement_m": x, "force_N": 900.0 * v}))
    (said,) = refused(tmp_path)
    assert "a.csv:502: the clock goes on at 100 Hz here, at 500 Hz before" in said
    assert "split: {gap_s" in said
    rates = [record.rate for record in run(tmp_path, {"path": "a.csv", "split": {"gap_s": 10}}).records]
    assert rates == pytest.approx([500.0, 100.0])


def test_lost_samples_and_jitter_are_no_second_rate(tmp_path: Path, rng: np.random.Generator) -> None:
    time = LONG + 2e-4 * rng.uniform(-1.0, 1.0, LONG.size)
    kept = np.delete(np.arange(LONG.size), [*range(3000, 3400), *rng.choice(LONG.size, 300, replace=False)])
    write(tmp_path / "a.csv", lines({"time_s": time[kept], **{k: v[kept] for k, v in list(LONGER.items())[1:]}}))
    assert len(run(tmp_path).records) == 1


def test_a_header_among_the_data_is_named_as_such(tmp_path: Path) -> None:
    text = lines(CANONICAL)
    write(tmp_path / "a.csv", [*text, *text])
    (said,) = refused(tmp_path)
    assert "a.csv:502: the header stands here again" in said
    assert "a file of its own" in said


def test_a_header_below_a_blank_line_and_a_title_among_the_data_is_named_as_such(tmp_path: Path) -> None:
    text = lines(CANONICAL)
    write(tmp_path / "a.csv", [*text, "", "Test 2", *text, "", "Test 3", *text])
    (said,) = refused(tmp_path)
    assert "a.csv:504: the header stands here again and once more below" in said


@pytest.mark.parametrize("again", ["Time [s],Pos [in],Force [N]", "Time [s],Force [N],Pos [mm]", "Time,Pos,Force,Temp"])
def test_a_header_in_another_unit_or_order_among_the_data_is_named_as_such(tmp_path: Path, again: str) -> None:
    """With the line taken out inches would be read as millimetres, and a force as a displacement."""
    rows = lines(CANONICAL)[1:]
    path = write(tmp_path / "a.csv", ["Time [s],Pos [mm],Force [N]", *rows, again, *rows])
    columns = {"time": "Time [s]", "displacement": "Pos [mm]", "force": "Force [N]"}
    (said,) = refused(tmp_path, {"path": path.name, "columns": columns})
    assert f"a.csv:502: the header stands here again, as {again.replace(',', ', ')}: another recording" in said
    assert "a file of its own, cut above this line" in said


@pytest.mark.parametrize(("cell", "decimal"), [("1.129,", ","), ("1,129.9", "."), ("-12 129,9", ",")])
def test_grouped_thousands_are_reported_as_such(tmp_path: Path, cell: str, decimal: str) -> None:
    text = [line.replace(".", decimal) for line in lines(CANONICAL, separator=";")]
    text[7] = ";".join([*text[7].split(";")[:2], cell, *text[7].split(";")[3:]])
    write(tmp_path / "a.csv", text)
    said = refused(tmp_path, {"path": "*.csv", "separator": ";", "decimal": decimal})
    assert f"force_N: a number is needed (got {cell!r}); write the file without grouping thousands" in said[0]


def test_a_point_before_three_digits_and_a_decimal_comma_parts_thousands(tmp_path: Path) -> None:
    text = [line.replace(".", ",") for line in lines(CANONICAL, separator=";")]
    text[7] = ";".join([*text[7].split(";")[:2], "-1.129,9", *text[7].split(";")[3:]])
    write(tmp_path / "a.csv", text)
    (record,) = run(tmp_path, {"path": "*.csv", "separator": ";", "decimal": ","}).records
    assert record.force[6] == -1129.9


def test_a_clock_is_a_column_or_counted_and_not_both(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines({name: values for name, values in CANONICAL.items() if name != "time_s"}))
    assert "missing column time_s" in refused(tmp_path)[0]
    (record,) = run(tmp_path, {"path": "*.csv", "rate_Hz": 200.0}).records
    assert record.time == pytest.approx(np.arange(TIME.size) / 200.0)
    (said,) = wrong(tmp_path, {"path": "*.csv", "rate_Hz": 200.0, "columns": {"time": "t"}})
    assert "time: said twice, under rate_Hz and columns" in said


def test_milliseconds_called_seconds_are_asked_about_unless_the_config_says_them(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines(CANONICAL | {"time_s": TIME * 1e3}))
    (said,) = refused(tmp_path)
    assert "the clock goes in steps of 2 s while the motion reaches 0.31" in said
    assert "units: {time: ms}" in said
    (record,) = run(tmp_path, {"path": "a.csv", "units": {"time": "ms"}}).records
    assert np.abs(record.velocity).max() == pytest.approx(np.abs(V).max(), rel=1e-3)
    (entry,) = run(tmp_path, {"path": "a.csv", "units": {"time": "s"}}).entries
    assert "scale" in [finding.check for finding in entry.findings]


@pytest.mark.parametrize(
    ("unit", "first"), [("%H:%M:%S.%f", "23:59:59"), ("%I:%M:%S.%f", "11:59:59"), ("%I:%M:%S.%f %p", "11:59:59")]
)
def test_a_clock_without_a_date_goes_on_past_midnight_and_noon(tmp_path: Path, unit: str, first: str) -> None:
    start = float(np.dot([int(part) for part in first.split(":")], [3600, 60, 1]))
    half = ["PM", "AM"]
    stamps = []
    for t in TIME + start + 0.5:
        hour = int(t // 3600) % 24
        shown = hour if "%H" in unit else (hour % 12 or 12)
        rest = f"{shown:02d}:{int(t // 60) % 60:02d}:{t % 60:09.6f}"
        stamps.append(f"{rest} {half[int(t // 43200) % 2]}" if "%p" in unit else rest)
    columns = {"when": stamps, "displacement_m": X, "force_N": FORCE}
    write(tmp_path / "a.csv", lines(columns))
    (record,) = run(tmp_path, {"path": "a.csv", "columns": {"time": "when"}, "units": {"time": unit}}).records
    assert np.abs(record.time - TIME).max() < 1e-5


# ---------------------------------------------------------------- other kinds of files


def test_a_file_that_no_format_reads_is_called_what_it_is_whatever_its_name(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("run.csv", "time_s,displacement_m,force_N")
    kinds = {
        "a zip archive": path.read_bytes(),
        "an Excel file of before 2007": b"\xd0\xcf\x11\xe0" + bytes(64),
        "a PDF file": b"%PDF-1.7" + bytes(64),
    }
    for kind, content in kinds.items():
        path.write_bytes(content)
        (said,) = refused(tmp_path)
        assert f"a.csv: this is {kind}; export the table as" in said
        assert "encoding" not in said
        with pytest.raises(DataError, match=f"this is {kind}"):
            guessed([path])


# ---------------------------------------------------------------- what the file says otherwise than the config


def test_a_header_with_another_unit_than_the_config_is_a_finding(tmp_path: Path) -> None:
    heads = {"time_s": TIME, "displacement_m": X, "Load [kN]": FORCE}
    write(tmp_path / "a.csv", lines(heads))
    entry = {"path": "a.csv", "columns": {"force": "Load [kN]"}, "units": {"force": "N"}}
    assert checks(tmp_path, entry) == ["units: force, whose header is 'Load [kN]'; the config says N"]
    assert checks(tmp_path, entry | {"units": {"force": "0.001 kN"}}) == [
        "units: force, whose header is 'Load [kN]'; the config says 0.001 kN"
    ]
    write(tmp_path / "a.csv", lines({"time_s": TIME, "displacement_m": X, "Load [N]": FORCE}))
    assert checks(tmp_path, {"path": "a.csv", "columns": {"force": "Load [N]"}, "units": {"force": "newton"}}) == []


def test_headers_that_count_compression_ask_for_a_sign(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines({"time_s": TIME, "Compression [m]": -X, "Druckkraft [N]": -FORCE}))
    entry = {"path": "a.csv", "columns": {"displacement": "Compression [m]", "force": "Druckkraft [N]"}}
    assert [said.split(",")[0] for said in checks(tmp_path, entry)] == ["sign: displacement", "sign: force"]
    turned = run(tmp_path, entry | {"sign": {"displacement": -1, "force": -1}})
    assert turned.entries[0].findings == ()
    assert np.abs(turned.records[0].force - FORCE).max() < 1e-5
    assert checks(tmp_path, entry | {"sign": {"displacement": 1, "force": 1}}) == []


def test_a_pattern_that_fits_twice_or_leaves_out_a_minus_is_refused(tmp_path: Path) -> None:
    plain = {name: values for name, values in CANONICAL.items() if name != "voltage_V"}
    write(tmp_path / "25mm_100V_-10C.csv", lines(plain))
    loose = {"path": "*.csv", "pattern": "(?P<voltage>[0-9.]+)", "units": {"voltage": "V"}}
    assert "fits in 3 places (25 and 100 and 10)" in wrong(tmp_path, loose)[0]
    cold = {"path": "*.csv", "pattern": "(?P<temperature>[0-9]+)C", "units": {"temperature": "degC"}}
    assert "the minus in front of a number is left out" in wrong(tmp_path, cold)[0]
    right = {"path": "*.csv", "pattern": "(?P<temperature>-?[0-9]+)C", "units": {"temperature": "degC"}}
    assert run(tmp_path, right).entries[0].temperature_degC == -10.0


# ---------------------------------------------------------------- held channels, missing samples, odd sizes


def held(values: np.ndarray) -> np.ndarray:
    result = values.copy()
    result[2010:2050] = result[2009]
    return result


def test_channels_that_are_held_and_samples_that_are_missing_are_reported(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    noisy = LONG_FORCE + rng.standard_normal(8000)
    gone = {name: np.delete(values, np.s_[3000:3100]) for name, values in LONGER.items()} | {"time_s": LONG[:-100]}
    missing = noisy.copy()
    missing[3000:3060] = -9999.0
    ways = {
        "force": LONGER | {"force_N": held(noisy)},
        "displacement": LONGER | {"displacement_m": held(LONG_X), "force_N": noisy},
        "gone": gone,
        "missing": LONGER | {"force_N": missing},
        "sound": LONGER | {"force_N": noisy},
        "digitised": LONGER | {"force_N": np.round(LONG_FORCE), "displacement_m": np.round(LONG_X, 5)},
    }
    for name, columns in ways.items():
        write(tmp_path / f"{name}.csv", lines(columns))
    found = {e.name: [f.where.split(",")[0] for f in e.findings if f.check == "jumps"] for e in run(tmp_path).entries}
    assert found == {
        "force": ["force"],
        "displacement": ["displacement"],
        "gone": ["displacement"],
        "missing": ["force"],
        "sound": [],
        "digitised": [],
    }


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"temperature_degC": np.full(500, 295.0)}, "temperature of the whole record"),
        ({"temperature_degC": np.full(500, 180.0)}, "temperature of the whole record"),
        ({"voltage_V": np.full(500, 1e5)}, "voltage of the whole record"),
        ({"force_N": 1e3 * FORCE}, "peak force of the whole record"),
    ],
)
def test_kelvin_millivolts_and_newtons_called_kilonewtons_are_suspected(
    tmp_path: Path, changed: dict[str, object], said: str
) -> None:
    write(tmp_path / "a.csv", lines(CANONICAL | changed))
    assert f"scale: {said}" in checks(tmp_path)
    write(tmp_path / "a.csv", lines(CANONICAL | {"temperature_degC": np.full(500, 80.0)}))
    assert checks(tmp_path) == []


# ---------------------------------------------------------------- all ways of the study


@pytest.mark.ci
@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.told)
def test_no_way_to_misread_a_file_is_silent(way: Way) -> None:
    happened, _ = tried(way)
    assert happened in ("right", "refused", "finding")


def test_a_hundred_ways_are_tried() -> None:
    assert len({way.told for way in WAYS}) >= 100
