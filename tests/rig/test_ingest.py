"""Rig files of any dialect become the same record; what cannot be believed is refused with its line."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from written_files import CANONICAL, FORCE, TIME, V, X, lines, refused, run, write, wrong

from pzd.artefacts import Rig
from pzd.damper.element import element_force
from pzd.quantities import Control
from pzd.rig.config import RigConfig
from pzd.rig.stage import ingest
from pzd.rig.stand.config import VirtualEntry
from pzd.rig.stand.recording import run_campaign
from pzd.schema.errors import Advised, DataError


def test_canonical_columns_need_nothing_but_the_path(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines(CANONICAL))
    (record,) = run(tmp_path).records
    assert record.name == "a"
    assert np.array_equal(record.force, [float(f"{f:.9g}") for f in FORCE])
    assert np.abs(record.velocity - V).max() < 1e-5 * np.abs(V).max()
    assert record.temperature is None
    assert record.median_voltage() == 100.0


def test_two_processes_read_what_one_reads_and_refuse_it_in_the_same_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pzd.rig.files.reading.BYTES_WORTH_A_PROCESS", 0)
    for name in "abc":
        write(tmp_path / f"{name}.csv", lines(CANONICAL | {"force_N": FORCE * (1.0 + ord(name))}))
    config = RigConfig.model_validate_json(json.dumps({"files": [{"path": "*.csv"}]}))
    one, two = (ingest(config, Control(), tmp_path, jobs) for jobs in (1, 2))
    assert one.entries == two.entries
    for alone, beside in zip(one.records, two.records, strict=True):
        assert all(np.array_equal(getattr(alone, f.name), getattr(beside, f.name)) for f in fields(alone)[2:8])
    write(tmp_path / "b.csv", lines(CANONICAL | {"time_s": np.arange(TIME.size)}))  # told with advice
    write(tmp_path / "c.csv", ["time_s,displacement_m,force_N", "0,1", "1,2,x"])
    told = []
    for jobs in (1, 2):
        with pytest.raises(DataError) as caught:
            ingest(config, Control(), tmp_path, jobs)
        told.append(caught.value.messages)
    assert told[0] == told[1]
    assert len(told[0]) == 2
    advised = [next(m for m in messages if isinstance(m, Advised)) for messages in told]
    assert advised[0].advice == advised[1].advice


@pytest.mark.parametrize(("separator", "decimal"), [(";", "."), ("\t", "."), (";", ","), ("\t", ","), (" ", ".")])
def test_every_dialect_gives_the_same_record(tmp_path: Path, separator: str, decimal: str) -> None:
    write(tmp_path / "plain.csv", lines(CANONICAL))
    write(tmp_path / "other.txt", lines(CANONICAL, separator, decimal))
    entry = {"path": "other.txt", "decimal": decimal} | ({"separator": " "} if separator == " " else {})
    rig = run(tmp_path, entry, {"path": "plain.csv"})
    other, plain = rig.records
    assert np.array_equal(other.displacement, plain.displacement)
    assert np.array_equal(other.force, plain.force)


def test_mapped_columns_units_signs_and_constants_come_out_in_si(tmp_path: Path) -> None:
    text = lines({"t [ms]": TIME * 1e3, "pos": X * 1e3, "Load (kN)": -FORCE / 1e3, "remark": ["ok"] * TIME.size})
    write(tmp_path / "exports" / "a.dat", ["made by a logger", "", *text], encoding="latin-1")
    entry = {
        "path": "exports/*.dat",
        "skip": 2,
        "columns": {"time": "t [ms]", "displacement": "pos", "force": "Load (kN)"},
        "units": {"displacement": "mm"},
        "constants": {"voltage": "0.1 kV", "temperature": "295.15 K"},
        "sign": {"force": -1},
        "setting": "gap 0.25 mm",
    }
    (record,) = run(tmp_path, entry).records
    assert np.abs(record.displacement - X).max() < 1e-11
    assert np.abs(record.force - FORCE).max() < 1e-5
    assert np.abs(record.time - TIME).max() < 1e-11
    assert record.median_voltage() == pytest.approx(100.0)
    assert record.median_temperature() == pytest.approx(22.0)
    assert record.setting == "gap 0.25 mm"


def test_a_row_of_units_and_a_file_without_headers_are_read(tmp_path: Path) -> None:
    text = lines({"t": TIME, "x": X * 1e3, "F": FORCE / 1e3})
    write(tmp_path / "units.csv", [text[0], "s,[mm],kN", *text[1:]])
    write(tmp_path / "bare.csv", text[1:])
    columns = {"time": "t", "displacement": "x", "force": "F"}
    bare = {"path": "bare.csv", "header": ["t", "x", "F"], "columns": columns}
    bare |= {"units": {"time": "s", "displacement": "mm", "force": "kN"}}
    rig = run(tmp_path, {"path": "units.csv", "units_row": True, "columns": columns}, bare)
    assert [record.name for record in rig.records] == ["bare", "units"]
    for record in rig.records:
        assert np.ptp(record.displacement) == pytest.approx(0.02, rel=1e-3)
        assert record.force.max() == pytest.approx(FORCE.max())


def test_quotes_comments_and_a_byte_order_mark_do_no_harm(tmp_path: Path) -> None:
    text = lines(CANONICAL)
    quoted = [",".join(f'"{cell}"' for cell in line.split(",")) for line in text]
    write(tmp_path / "a.csv", ["# exported", quoted[0], "# a remark", *quoted[1:]], encoding="utf-8-sig")
    (record,) = run(tmp_path, {"path": "a.csv", "comment": "#"}).records
    assert record.time.size == TIME.size


def test_the_control_may_be_a_current_from_the_name_of_the_file(tmp_path: Path) -> None:
    columns = {name: values for name, values in CANONICAL.items() if name != "voltage_V"}
    write(tmp_path / "2mm5Hz_0x25A.csv", lines(columns))
    entry = {"path": "*.csv", "pattern": r"_(?P<current>[0-9.x]+)A$", "units": {"current": "A"}}
    for key in ("current", "voltage"):
        pattern = entry["pattern"].replace("current", key)  # type: ignore[union-attr] # a string
        given = entry | {"pattern": pattern, "units": {key: "mA"}}
        (record,) = run(tmp_path, given, control=Control("current", "A")).records
        assert record.median_voltage() == pytest.approx(0.25e-3)
    assert "the file's name has no unit" in wrong(tmp_path, entry | {"units": {}}, control=Control("current", "A"))[0]
    assert (
        "does not match"
        in wrong(tmp_path, {"path": "*.csv", "pattern": r"(?P<voltage>\d+)V", "units": {"voltage": "V"}})[0]
    )


def test_a_preamble_that_was_not_skipped_is_hinted_at(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", ["made by a logger", *lines(CANONICAL)])
    assert "say skip" in refused(tmp_path)[-1]
    text = lines(CANONICAL)
    write(tmp_path / "a.csv", [*text[:9], *[f"{line},1" for line in text[9:20]], *text[20:]])
    assert "say skip" not in refused(tmp_path)[-1]


def test_several_tests_in_one_file_are_numbered(tmp_path: Path) -> None:
    pause = np.concatenate((TIME, TIME + 60.0))
    event = [""] * pause.size
    event[500] = "DAQ Resume"
    columns = {"time_s": pause, "displacement_m": np.tile(X, 2), "force_N": np.tile(FORCE, 2)}
    text = lines(columns | {"label": ["first"] * 500 + ["second"] * 500, "event": event})
    ends_early = [text[0], *(line.removesuffix(",") for line in text[1:])]
    write(tmp_path / "a.csv", ends_early)
    constants = {"voltage": ["0 V", "100 V"]}
    # the column of events may be left out of a row, and only where the config names it
    assert "4 fields where the header has 5" in refused(tmp_path)[0]
    event_split = {"event": "event", "begins": "Resume", "constants": constants}
    write(tmp_path / "b.csv", text)
    for file, split in (("a", event_split), ("b", {"column": "label"}), ("b", {"gap_s": 10.0}), ("b", event_split)):
        rig = run(tmp_path, {"path": f"{file}.csv", "split": split})
        assert [record.name for record in rig.records] == [f"{file}-1", f"{file}-2"]
        assert rig.records[1].time[0] == 60.0
    assert [entry.voltage_V for entry in rig.entries] == [0.0, 100.0]
    three = {"path": "b.csv", "split": event_split | {"constants": {"voltage": ["1 V"] * 3}}}
    assert "3 values for 2 tests" in wrong(tmp_path, three)[0]


def test_clock_times_are_read_by_their_format(tmp_path: Path) -> None:
    stamps = [f"04/29/2022 11:59:{59 + int(t):02d}.{round(t % 1 * 1000):03d} AM" for t in TIME]
    columns = {"when": stamps, "displacement_m": X, "force_N": FORCE}
    write(tmp_path / "a.csv", lines(columns))
    entry = {"path": "a.csv", "columns": {"time": "when"}, "units": {"time": "%m/%d/%Y %I:%M:%S.%f %p"}}
    (record,) = run(tmp_path, entry).records
    assert np.abs(record.time - TIME).max() < 1e-9
    assert "no date and time like" in refused(tmp_path, entry | {"units": {"time": "%d.%m.%Y"}})[0]


def test_names_take_as_many_folders_as_tell_equal_stems_apart(tmp_path: Path) -> None:
    for name in ("one/run.csv", "two/run.csv", "two/other run.csv"):
        write(tmp_path / name, lines(CANONICAL))
    rig = run(tmp_path, {"path": "**/*.csv"})
    assert [record.name for record in rig.records] == ["one-run", "other_run", "two-run"]
    write(tmp_path / "deep" / "one" / "run.csv", lines(CANONICAL))
    names = {record.name for record in run(tmp_path, {"path": "**/*.csv"}).records}
    assert names == {"deep-one-run", f"{tmp_path.name}-one-run", f"{tmp_path.name}-two-run", "other_run"}
    write(tmp_path / "deep-one-run.csv", lines(CANONICAL))
    assert "two records would be called deep-one-run" in wrong(tmp_path, {"path": "**/*.csv"})[0]


def test_a_known_fixture_is_taken_out_and_reported(tmp_path: Path) -> None:
    acceleration = -((2 * np.pi * 5.0) ** 2) * X
    write(tmp_path / "mass.csv", lines(CANONICAL | {"force_N": FORCE + 40.0 + 3.0 * acceleration}))
    write(tmp_path / "frame.csv", lines(CANONICAL | {"displacement_m": X + FORCE / 2e6, "velocity_m_per_s": 9.0 * V}))
    massive = {"path": "mass.csv", "fixture": {"mass_kg": 3.0, "tare_N": 40.0}}
    rig = run(tmp_path, {"path": "frame.csv", "fixture": {"stiffness_N_per_m": 2e6}}, massive)
    frame, mass = rig.records
    assert np.abs(mass.force - FORCE).max() < 1e-3 * np.abs(FORCE).max()
    assert np.abs(frame.displacement - X).max() < 1e-9
    assert np.abs(frame.velocity - V).max() < 1e-4 * V.max()
    assert [entry.removed for entry in rig.entries] == [
        "give of the frame at 2e+06 N/m",
        "tare of 40 N, inertia of 3 kg",
    ]


def test_the_virtual_fixture_and_its_removal_are_one_law(tmp_path: Path) -> None:
    fixture = {"mass_kg": 2.0, "tare_N": -25.0, "stiffness_N_per_m": 5e6}
    stand = {
        "damper": {
            "base": [{"voltage_V": None, "temperature_degC": None, "T0_N": 300, "C_Ns_per_m": 2500, "k_N_per_m": 3e5}]
        },
        "tests": [{"waveform": {"kind": "sine", "frequency_Hz": 2.0, "amplitude_m": 0.01}, "cycles": 4}],
    }
    with_fixture = VirtualEntry.model_validate_json(json.dumps(stand | {"fixture": fixture}))
    (shown,) = run_campaign(with_fixture, 1)
    columns = {"time_s": shown.time, "displacement_m": shown.displacement, "force_N": shown.force}
    write(tmp_path / "a.csv", lines(columns))
    (record,) = run(tmp_path, {"path": "a.csv", "fixture": fixture}).records
    # What is left is the damper's own force at the damper's own extension: the element on x gives F.
    x = record.displacement
    again = element_force(np.concatenate((x[:-1], x)), 1e-3, 300.0, 2500.0, 3e5)[x.size - 1 :]
    assert np.sqrt(np.mean((again - record.force) ** 2)) < 2e-3 * np.abs(record.force).max()


def test_missing_units_are_an_error_never_a_guess(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines({"time_s": TIME, "pos": X, "force_N": FORCE}))
    entry = {"path": "a.csv", "columns": {"displacement": "pos"}}
    assert "names no unit" in wrong(tmp_path, entry)[0]
    assert "is no unit of it" in wrong(tmp_path, entry | {"units": {"displacement": "kN"}})[0]
    assert "needs" in wrong(tmp_path, {"path": "a.csv", "constants": {"temperature": "22"}})[0].replace(
        "needed", "needs"
    )
    with pytest.raises(ValueError, match="needs its unit"):
        RigConfig.model_validate_json(json.dumps({"files": [{"path": "a.csv", "constants": {"voltage": 100}}]}))


def test_a_wrong_config_is_refused_with_all_its_faults(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines(CANONICAL))
    found = wrong(tmp_path, {"path": "no/*.csv", "source": "ask the lab"}, {"path": "none.csv"})
    assert len(found) == 2
    assert "rig.files.0.path" in found[0]
    assert "ask the lab" in found[0]
    entry = {"path": "a.csv", "columns": {"displacment": "x"}, "units": {"current": "A"}}
    found = wrong(tmp_path, entry)
    assert "did you mean displacement?" in found[0]
    assert "current" in found[1]
    twice = {"path": "a.csv", "columns": {"voltage": "voltage_V"}, "constants": {"voltage": "1 V"}}
    assert "said twice" in wrong(tmp_path, twice)[0]
    assert "no such format" in wrong(tmp_path, {"path": "a.csv", "format": "xlsx"})[0]


def test_an_empty_column_of_an_optional_quantity_counts_as_absent(tmp_path: Path) -> None:
    columns = CANONICAL | {"temperature_C": [""] * TIME.size, "velocity_m_per_s": V}
    write(tmp_path / "a.csv", lines(columns))
    (record,) = run(tmp_path).records
    assert record.temperature is None
    assert record.velocity[0] == pytest.approx(V[0])


BREAKS: dict[str, tuple[Any, str]] = {
    "missing column": (
        lambda t: [line.rpartition(",")[0].rpartition(",")[0] for line in t],
        ":1: missing column force_N",
    ),
    "duplicate column": (lambda t: [t[0].replace("voltage_V", "force_N"), *t[1:]], ":1: force: duplicate column"),
    "bad cell": (lambda t: [*t[:7], t[7].replace(",100", ",abc"), *t[8:]], ":8: voltage_V: a number is needed"),
    "empty cell": (lambda t: [*t[:7], t[7].replace(",100", ","), *t[8:]], ":8: voltage_V: empty cell"),
    "infinite cell": (lambda t: [*t[:7], t[7].replace(",100", ",inf"), *t[8:]], ":8: voltage_V: a"),
    "not a number": (lambda t: [*t[:7], t[7].replace(",100", ",nan"), *t[8:]], ":8: voltage_V: a number is needed"),
    "trailing comma": (lambda t: [t[0], t[1] + ",", *t[2:]], ":2: 5 fields where the header has 4"),
    "short row": (lambda t: [*t[:9], "0.1,0.2", *t[10:]], ":10: 2 fields where the header has 4"),
    "repeated time beside a bad cell": (
        lambda t: [*t[:7], t[7].replace(",100", ",nan"), t[8], t[8], *t[9:]],
        ":10: time does not increase",
    ),
    "repeated time beside an empty cell": (
        lambda t: [*t[:7], t[7].replace(",100", ","), t[8], t[8], *t[9:]],
        ":10: time does not increase",
    ),
    "repeated time": (lambda t: [*t[:9], t[8], *t[9:]], ":10: time does not increase"),
    "time going back": (lambda t: [*t[:9], t[5], *t[9:]], ":10: time does not increase"),
    "no rows": (lambda t: t[:1], ":1: no data rows"),
    "decimal comma": (lambda t: [line.replace(",", ";").replace(".", ",") for line in t], "decimal: ','"),
    "zero byte": (lambda t: [*t[:4], t[4] + "\0", *t[5:]], ":5: not a text file"),
    "empty file": (lambda t: [""], "no header line; say skip: N where N lines stand above it"),
}


@pytest.mark.parametrize("fault", BREAKS)
def test_a_broken_file_is_refused_with_its_line(tmp_path: Path, fault: str) -> None:
    broken, message = BREAKS[fault]
    write(tmp_path / "good.csv", lines(CANONICAL))
    write(tmp_path / "bad.csv", broken(lines(CANONICAL)))
    found = refused(tmp_path)
    assert all("bad.csv" in line for line in found)
    assert any(message in line for line in found), found


SIZES: dict[str, tuple[dict[str, Any], str]] = {
    "millimetres as metres": ({"displacement_m": X * 1e3}, "a stroke of 20 m, above 1 m"),
    "too fast": ({"time_s": TIME / 50.0}, "above 10 m/s"),
    "recorded speed": ({"velocity_m_per_s": V * 1e3}, "velocity reads 313.5 m/s"),
    "wrong sign": ({"force_N": -FORCE}, "wrong sign"),
    "constant force": ({"force_N": np.full(500, 20.0)}, "force is constant"),
    "constant displacement": ({"displacement_m": np.full(500, 0.01)}, "displacement is constant"),
    "one stroke": ({"displacement_m": 0.01 * TIME, "force_N": 5.0 + TIME}, "2 reversals larger than 10%"),
}


@pytest.mark.parametrize("fault", SIZES)
def test_what_cannot_be_a_damper_is_refused(tmp_path: Path, fault: str) -> None:
    changed, message = SIZES[fault]
    write(tmp_path / "a.csv", lines(CANONICAL | changed))
    assert any(message in line for line in refused(tmp_path)), refused(tmp_path)


def test_a_clock_of_too_few_digits_is_reported_with_what_to_do_about_it(tmp_path: Path) -> None:
    """Five digits of a second, as a table is exported: from 10 s on three samples have one time."""
    later = 10.0 + np.arange(TIME.size) / 3000.0
    write(tmp_path / "a.csv", lines(CANONICAL | {"time_s": np.array([float(f"{t:.5g}") for t in later])}))
    (said,) = refused(tmp_path)
    assert "a.csv:3: time does not increase: 10 s after 10 s, and " in said
    assert "; it has too few digits; say rate_Hz: 3000 or what is known of it, and leave out the column" in said


def test_a_clock_of_too_few_ticks_tells_no_rate(tmp_path: Path) -> None:
    """Two seconds at 500 Hz, whose clock goes on once, are no 999 Hz."""
    clock = 10.0 + np.floor(np.arange(TIME.size) * 1.5 / TIME.size)
    write(tmp_path / "a.csv", lines(CANONICAL | {"time_s": clock}))
    (said,) = refused(tmp_path)
    assert "; it has too few digits; say rate_Hz: N for N samples a second, which this clock does not tell" in said


def test_a_clock_that_never_goes_on_is_reported_no_rate(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines(CANONICAL | {"time_s": np.zeros(TIME.size)}))
    assert any("time does not increase" in line for line in refused(tmp_path))
    assert not any("rate_Hz" in line for line in refused(tmp_path))


def test_every_offending_file_is_listed_at_once(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines(CANONICAL | {"force_N": -FORCE}))
    write(tmp_path / "b.csv", lines(CANONICAL)[:1])
    write(tmp_path / "c.csv", lines(CANONICAL | {"displacement_m": X * 1e3}))
    found = "\n".join(refused(tmp_path))
    assert all(f"{name}.csv" in found for name in "abc")


def test_a_spike_and_a_tare_are_findings_and_no_refusal(tmp_path: Path) -> None:
    spiked = X.copy()
    spiked[123] += 0.1
    write(tmp_path / "a.csv", lines(CANONICAL | {"displacement_m": spiked}))
    # Half a cycle more out than back: the tare does negative work over the whole record, the damper does not.
    half = {name: values[:475] for name, values in (CANONICAL | {"force_N": FORCE - 5000.0}).items()}
    half["displacement_m"] = half["displacement_m"] + 0.05 * half["time_s"]
    assert np.trapezoid(half["force_N"], half["displacement_m"]) < 0.0
    write(tmp_path / "b.csv", lines(half))
    rig = run(tmp_path)
    assert "spikes" in {finding.check for finding in rig.entries[0].findings}
    assert "offset" in {finding.check for finding in rig.entries[1].findings}


def test_the_records_of_the_stage_are_those_in_the_files(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", lines(CANONICAL))
    made = run(tmp_path)
    (record,) = made.records
    made = replace(made, records=(replace(record, force=np.repeat(record.force, 2)[::2]),))
    folder = tmp_path / Rig.folder
    folder.mkdir()
    made.write(folder, Control())
    handed, read = made.as_read(), Rig.read(folder, Control())
    assert handed.entries == read.entries
    assert handed.ingested == read.ingested
    for field in fields(record):
        one, other = (getattr(rig.records[0], field.name) for rig in (handed, read))
        assert np.array_equal(one, other)
        assert not isinstance(one, np.ndarray) or (one.dtype == other.dtype and one.flags.c_contiguous)
    assert made.as_read().records[0] is not made.records[0]
    assert handed.as_read().records[0] is handed.records[0]
