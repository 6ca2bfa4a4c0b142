"""Rig files of every format, written by the format's own library and read back value by value."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_uff import written as functions_written
from written_files import FORCE, TIME, X, lines, refused, run, write, wrong

from pzd.cli.app import status
from pzd.config import load
from pzd.quantities import Control
from pzd.rig.files.formats import formats
from pzd.rig.files.guess import guessed
from pzd.rig.stage import ingest
from pzd.schema.errors import DataError

MM, KN, VOLTS = X * 1e3, FORCE / 1e3, np.full(TIME.size, 100.0)
UNITS = {"time": "s", "pos": "mm", "load": "kN", "valve voltage": "V"}
COLUMNS = dict(zip(UNITS, (TIME, MM, KN, VOLTS), strict=True))
NAMED = {"columns": {"time": "time", "displacement": "pos", "force": "load", "voltage": "valve voltage"}}
SAID = NAMED | {"units": {"time": "s", "displacement": "mm", "force": "kN", "voltage": "V"}}

Columns = dict[str, Any]


def excel(
    path: Path, columns: Columns = COLUMNS, units: dict[str, str] = UNITS, sheets: tuple[str, ...] = ("Run",)
) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    assert book.active is not None
    book.active.append(["A damper, tested by nobody"])
    for name in sheets:
        sheet = book.create_sheet(name)
        sheet.append(list(columns))
        sheet.append([units[head] for head in columns])
        for row in zip(*columns.values(), strict=True):
            sheet.append([cell.item() if isinstance(cell, np.generic) else cell for cell in row])
    book.save(path)


def parquet(path: Path, columns: Columns = COLUMNS, units: dict[str, str] = UNITS) -> None:
    import pyarrow as pa
    from pyarrow import parquet as written

    fields = [pa.field(head, pa.float64(), metadata={"unit": units[head]}) for head in columns]
    written.write_table(pa.table(list(map(pa.array, columns.values())), pa.schema(fields)), path)


def matlab(path: Path, columns: Columns = COLUMNS) -> None:
    from scipy.io import savemat

    run_1 = {head.replace(" ", "_"): values[:, None] for head, values in columns.items() if head != "valve voltage"}
    savemat(path, {"run": run_1 | {"valve_voltage": 100.0}, "operator": "nobody", "f": 5.0})


def hdf5(path: Path, columns: Columns = COLUMNS, units: dict[str, str] = UNITS) -> None:
    """As MATLAB writes version 7.3: a head of 512 bytes, columns as rows, texts as numbers."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for head, values in columns.items():
            stored = file.create_dataset(f"run/{head}", data=values[None, :])
            stored.attrs["MATLAB_class"] = np.bytes_("double")
            stored.attrs["unit"] = units[head]
        title = file.create_dataset("run/title", data=np.array([[ord(c)] for c in "nobody's"], dtype=np.uint16))
        title.attrs["MATLAB_class"] = np.bytes_("char")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512))


def json_arrays(path: Path, columns: Columns = COLUMNS, units: dict[str, str] = UNITS) -> None:
    arrays = {f"{head} [{units[head]}]": values.tolist() for head, values in columns.items() if head != "valve voltage"}
    path.write_text(json.dumps({"operator": "nobody", "valve voltage [V]": 100, "data": arrays}), encoding="utf-8")


def tdms(
    path: Path, columns: Columns = COLUMNS, units: dict[str, str] = UNITS, groups: tuple[str, ...] = ("Run",)
) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        for group in groups:
            writer.write_segment(
                [
                    ChannelObject(
                        group,
                        head,
                        values,
                        {"unit_string": units[head], "wf_increment": 2e-3, "wf_samples": values.size},
                    )
                    for head, values in columns.items()
                    if head != "time"
                ]
            )


def mdf(path: Path, columns: Columns = COLUMNS, units: dict[str, str] = UNITS) -> None:
    from asammdf import MDF, Signal

    signals = [
        Signal(values, columns["time"], unit=units[head], name=head)
        for head, values in columns.items()
        if head != "time"
    ]
    with MDF(version="4.10") as file:
        file.append(signals, comment="Run")
        file.append([Signal(np.arange(5.0), np.arange(5.0), unit="degC", name="cabinet")])
        file.save(path)


def mts(
    path: Path, columns: Columns = COLUMNS, units: dict[str, str] = UNITS, blocks: int = 1, decimal: str = "."
) -> None:
    rows = lines(columns, "\t", decimal)[1:]
    text = [f"MTS793|MPT|ENU|1|2|{decimal}|/|:|1|0|0|A", ""]
    for number in range(blocks):
        text += [f"Data Acquisition\t\tTime:\t{number + 1}\tSec\t3/29/2016 1:54:32 PM"]
        text += ["\t".join(columns), "\t".join(units[head] for head in columns), *rows, ""]
    write(path, text)


def lvm(path: Path, columns: Columns = COLUMNS, units: dict[str, str] = UNITS) -> None:
    above = ["LabVIEW Measurement\t", "Separator\tTab", "Decimal_Separator\t.", "X_Columns\tOne"]
    said = "\t".join(["Y_Unit_Label", *(units[head] for head in columns if head != "time")])
    heads = "\t".join(["X_Value", *(head for head in columns if head != "time"), "Comment"])
    end = "***End_of_Header***"
    samples = "\t".join(["Samples", *[str(TIME.size)] * 3])
    write(path, [*above, end, "", "Channels\t3", samples, said, end, heads, *lines(columns, "\t")[1:]])


def rpc3(path: Path, columns: Columns = COLUMNS, units: dict[str, str] = UNITS) -> None:
    """Of 32 bits, all in one group."""
    channels = {head: values for head, values in columns.items() if head != "time"}
    said: dict[str, Any] = {"FORMAT": "BINARY_IEEE_LITTLE_END", "NUM_HEADER_BLOCKS": 5, "FILE_TYPE": "TIME_HISTORY"}
    said |= {"DELTA_T": 2e-3, "CHANNELS": len(channels), "PTS_PER_FRAME": TIME.size, "PTS_PER_GROUP": TIME.size}
    said |= {"FRAMES": 1, "DATA_TYPE": "FLOATING_POINT"}
    for n, head in enumerate(channels, start=1):
        said |= {f"DESC.CHAN_{n}": head, f"UNITS.CHAN_{n}": units[head]}
    head = b"".join(key.encode().ljust(32, b"\0") + str(value).encode().ljust(96, b"\0") for key, value in said.items())
    data = b"".join(np.asarray(values, dtype="<f4").tobytes() for values in channels.values())
    path.write_bytes(head.ljust(5 * 512, b"\0") + data)


def uff(path: Path, columns: Columns = COLUMNS, units: dict[str, str] = UNITS) -> None:
    """Of dataset 58, in text; a function of its own for each channel."""
    channels = [head for head in columns if head != "time"]
    functions_written(path, *((head, 0, units[head], columns["time"], columns[head]) for head in channels))


WRITERS: dict[str, tuple[str, Callable[..., None], dict[str, Any]]] = {
    "excel": ("a.xlsx", excel, NAMED | {"units_row": True}),
    "parquet": ("a.parquet", parquet, NAMED),
    "matlab": ("a.mat", matlab, {**SAID, "columns": SAID["columns"] | {"voltage": "valve_voltage"}}),
    "hdf5": ("a73.mat", hdf5, NAMED),
    "json_arrays": (
        "a.json",
        json_arrays,
        {"columns": {q: f"{h} [{UNITS[h]}]" for q, h in NAMED["columns"].items()}},
    ),
    "tdms": ("a.tdms", tdms, NAMED),
    "mdf": ("a.mf4", mdf, NAMED),
    "mts": ("a.dat", mts, NAMED),
    "rpc3": ("a.rsp", rpc3, NAMED),
    "uff": ("a.uff", uff, NAMED),
    "lvm": ("a.lvm", lvm, {"columns": NAMED["columns"] | {"time": "X_Value"}}),
}
every_format = pytest.mark.parametrize("name", WRITERS)


def test_every_format_but_text_has_its_writer_here() -> None:
    assert set(WRITERS) == set(formats()) - {"text"}


@every_format
def test_every_value_of_a_format_is_read(tmp_path: Path, name: str) -> None:
    file, written, entry = WRITERS[name]
    written(tmp_path / file)
    rig = run(tmp_path, {"path": file} | entry)
    (record,) = rig.records
    assert record.voltage is not None
    exact = {"mts": 1e-8, "lvm": 1e-8, "uff": 1e-11, "rpc3": 1e-6}.get(
        name, 1e-15
    )  # text of nine digits, numbers of 32 bits
    assert record.time == pytest.approx(TIME, abs=exact)
    assert record.displacement == pytest.approx(X, abs=exact)
    assert record.force == pytest.approx(FORCE, abs=max(exact, 1e-12) * 1e2)
    assert record.voltage == pytest.approx(VOLTS, abs=0.0)
    assert "rename" in {row.step for row in rig.ingested}


@every_format
def test_the_format_is_recognised_by_content_whatever_the_name(tmp_path: Path, name: str) -> None:
    file, written, entry = WRITERS[name]
    written(tmp_path / file)
    (tmp_path / file).rename(tmp_path / "b.csv")
    assert run(tmp_path, {"path": "b.csv"} | entry).records[0].time.size == TIME.size


@every_format
def test_init_check_and_identify_take_a_file_of_each_format(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    file, written, _ = WRITERS[name]
    written(tmp_path / file)
    assert status(["init", file]) == 0
    text = capsys.readouterr().out
    if name == "matlab":
        units = {"time": "s", "displacement": "mm", "force": "kN", "voltage": "V"}
        text = "\n".join(
            f"{line.partition('#')[0]}{units[line.split(':')[0].strip()]}" if "# fill in" in line else line
            for line in text.splitlines()
        )
    assert "fill in" not in text
    Path("own.yaml").write_text(text, encoding="utf-8")
    assert status(["check", "own.yaml", "-v"]) == 0
    said = capsys.readouterr().out
    assert "rename force: column 'load" in said
    assert "unit displacement: mm -> m: times 0.001" in said
    assert status(["identify", "own.yaml", "-q"]) in (0, 4)
    assert Path("runs/own/2-identify/parameters.csv").is_file()


# ---------------------------------------------------------------- several tables in one file


def test_every_sheet_group_or_block_with_a_recording_is_a_test(tmp_path: Path) -> None:
    excel(tmp_path / "a.xlsx", sheets=("slow", "quick"))
    tdms(tmp_path / "b.tdms", groups=("slow", "quick"))
    mts(tmp_path / "c.dat", blocks=2)
    for file, entry, second in (
        ("a.xlsx", {"units_row": True}, "quick"),
        ("b.tdms", {}, "quick"),
        ("c.dat", {}, "block 2"),
    ):
        rig = run(tmp_path, {"path": file} | NAMED | entry)
        assert [record.name[1:] for record in rig.records] == ["-1", "-2"]
        assert rig.records[1].time == pytest.approx(TIME, abs=1e-9)
        (one,) = run(tmp_path, {"path": file, "table": second} | NAMED | entry).records
        assert one.time.size == TIME.size
    (said,) = refused(tmp_path, {"path": "b.tdms", "table": "fast"} | NAMED)
    assert said.endswith("b.tdms: no table 'fast' (got slow, quick)")


def test_each_table_may_have_its_own_constant(tmp_path: Path) -> None:
    columns = {head: values for head, values in COLUMNS.items() if head != "valve voltage"}
    excel(tmp_path / "a.xlsx", columns, sheets=("slow", "quick"))
    entry = {
        "path": "a.xlsx",
        "units_row": True,
        "columns": {"time": "time", "displacement": "pos", "force": "load"},
        "split": {"tables": True, "constants": {"voltage": ["0 V", "150 V"]}},
    }
    assert [one.voltage_V for one in run(tmp_path, entry).entries] == [0.0, 150.0]


def test_tables_that_differ_in_a_unit_are_not_read_as_one(tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    tdms(tmp_path / "a.tdms")
    with TdmsWriter(tmp_path / "a.tdms", mode="a") as writer:
        for head, unit in (("pos", "mm"), ("load", "N"), ("valve voltage", "V")):
            more = {"unit_string": unit, "wf_increment": 2e-3}
            writer.write_segment([ChannelObject("Again", head, COLUMNS[head], more)])
    (said,) = refused(tmp_path, {"path": "a.tdms"} | NAMED)
    assert "a.tdms:Again: 'load' is in 'N' here and in 'kN' in 'Run'" in said


# ---------------------------------------------------------------- what cannot be read


@every_format
def test_a_damaged_file_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    file, written, entry = WRITERS[name]
    written(tmp_path / file)
    content = (tmp_path / file).read_bytes()
    (tmp_path / file).write_bytes(content[: len(content) // 3])
    with pytest.raises(DataError) as caught:
        guessed([tmp_path / file])
    for said in (*refused(tmp_path, {"path": file} | entry), *caught.value.messages):
        assert said.startswith(str(tmp_path / file))
        assert "\n" not in said


def test_a_file_that_ends_in_the_middle_of_its_samples_is_not_read_as_a_shorter_test(tmp_path: Path) -> None:
    for file, written, entry in (WRITERS["tdms"], WRITERS["mdf"], WRITERS["json_arrays"], WRITERS["matlab"]):
        written(tmp_path / file)
        content = (tmp_path / file).read_bytes()
        (tmp_path / file).write_bytes(content[: int(0.97 * len(content))])
        (said,) = refused(tmp_path, {"path": file} | entry)
        assert said.startswith(str(tmp_path / file))


@pytest.mark.parametrize("name", [name for name, module in formats().items() if module.NEEDS])
def test_without_its_library_a_message_names_the_extra(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, written, entry = WRITERS[name]
    written(tmp_path / file)
    monkeypatch.setitem(sys.modules, formats()[name].NEEDS, None)
    (said,) = wrong(tmp_path, {"path": file} | entry)
    assert said.endswith("which is not installed; pip install 'pzd[formats]'")


def test_a_bad_cell_is_named_by_sheet_and_row(tmp_path: Path) -> None:
    columns = COLUMNS | {"load": [*KN[:10].tolist(), "broken", None, *KN[12:].tolist()]}
    excel(tmp_path / "a.xlsx", columns)
    (said,) = refused(tmp_path, {"path": "a.xlsx", "units_row": True} | NAMED)
    assert said.endswith("a.xlsx:Run:13: load: a number is needed (got 'broken')")
    holes = KN.copy()
    holes[7] = np.nan
    parquet(tmp_path / "b.parquet", COLUMNS | {"load": holes})
    (said,) = refused(tmp_path, {"path": "b.parquet"} | NAMED)
    assert said.endswith(
        "b.parquet: row 8: load: empty cell; take a row without a value out: it is told as a lost sample"
    )


def test_a_row_of_a_block_that_is_cut_short_is_named_by_its_line(tmp_path: Path) -> None:
    mts(tmp_path / "a.dat")
    text = (tmp_path / "a.dat").read_text(encoding="utf-8").splitlines()
    write(tmp_path / "a.dat", [*text[:20], text[20].rpartition("\t")[0], *text[21:]])
    (said,) = refused(tmp_path, {"path": "a.dat"} | NAMED)
    assert "a.dat:21: 4 numbers are needed here (got 3 fields" in said


def test_keys_that_mean_nothing_for_a_format_are_refused(tmp_path: Path) -> None:
    parquet(tmp_path / "a.parquet")
    said = wrong(tmp_path, {"path": "a.parquet", "skip": 3, "table": "x"} | NAMED)
    assert [line.split(" (")[0] for line in said] == [
        "rig.files.0.skip: a Parquet file has nothing of the kind",
        "rig.files.0.table: a Parquet file has nothing of the kind",
    ]


# ---------------------------------------------------------------- what would be silently wrong


def test_a_key_that_stands_twice_in_an_object_is_refused(tmp_path: Path) -> None:
    json_arrays(tmp_path / "a.json")
    text = (tmp_path / "a.json").read_text(encoding="utf-8")
    (tmp_path / "a.json").write_text(text.replace('"load [kN]"', '"load [kN]": [1], "load [kN]"'), encoding="utf-8")
    (said,) = refused(tmp_path, {"path": "a.json"} | WRITERS["json_arrays"][2])
    assert said.endswith("a.json: the key 'load [kN]' stands twice in one object")


def test_invalid_samples_of_a_channel_are_empty_cells_and_channels_of_one_name_are_numbered(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    flawed = np.zeros(TIME.size, dtype=bool)
    flawed[[4, 7]] = True
    signals = [
        Signal(MM, TIME, unit="mm", name="pos"),
        Signal(KN, TIME, unit="kN", name="load", invalidation_bits=flawed),
    ]
    entry = {"path": "a.mf4", "columns": {"time": "time", "displacement": "pos", "force": "load"}}
    with MDF(version="4.10") as file:
        file.append(signals)
        file.save(tmp_path / "a.mf4")
    (said,) = refused(tmp_path, entry)
    assert said.endswith(
        "row 5: load: empty cell (2 such cells); take a row without a value out: it is told as a lost sample"
    )
    with MDF(version="4.10") as file:
        file.append([*signals[:1], Signal(KN, TIME, unit="kN", name="load"), Signal(MM, TIME, unit="kN", name="load")])
        file.save(tmp_path / "a.mf4", overwrite=True)
    assert "missing column load" in refused(tmp_path, entry)[0]
    assert "load.1, load.2" in refused(tmp_path, entry)[0]


def test_a_master_channel_that_is_an_angle_is_no_clock(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append(
            [
                Signal(values, TIME, name=head, unit=UNITS[head], master_metadata=("time", 2))
                for head, values in (("pos", MM), ("load", KN))
            ]
        )
        file.save(tmp_path / "a.mf4")
    entry = {"path": "a.mf4", "columns": {"time": "time", "displacement": "pos", "force": "load"}}
    (said,) = wrong(tmp_path, entry)
    assert "rig.files.0.units: time:" in said
    assert "is no unit of it" in said


def test_a_unit_of_the_file_that_the_config_or_the_header_contradicts_is_a_finding(tmp_path: Path) -> None:
    parquet(tmp_path / "a.parquet")
    rig = run(tmp_path, {"path": "a.parquet"} | NAMED | {"units": {"force": "N"}})
    (found,) = [one for one in rig.entries[0].findings if one.check == "units"]
    assert found.where == "force, whose header is 'load' and its unit 'kN'; the config says N"
    assert found.size == pytest.approx(1e3)
    columns = {"time_s": TIME, "displacement_m": X, "force_N": FORCE}
    parquet(tmp_path / "b.parquet", columns, dict(zip(columns, ("s", "m", "lbf"), strict=True)))
    (found,) = [one for one in run(tmp_path, {"path": "b.parquet"}).entries[0].findings if one.check == "units"]
    assert found.where == "force, whose header is 'force_N'; the file says beside it lbf"


def test_instants_in_cells_of_a_workbook_are_a_clock(tmp_path: Path) -> None:
    begin = datetime(2024, 3, 25, 23, 59, 59)  # noqa: DTZ001  # Excel knows no zone
    stamps = [begin + timedelta(milliseconds=2 * n) for n in range(TIME.size)]
    excel(tmp_path / "a.xlsx", {"time": stamps, "pos": MM, "load": KN}, UNITS | {"time": ""})
    text = "\n".join(guessed([tmp_path / "a.xlsx"]))
    assert "time: '%Y-%m-%dT%H:%M:%S.%f'" in text
    (tmp_path / "own.yaml").write_text(text, encoding="utf-8")
    (record,) = ingest(load(tmp_path / "own.yaml").rig, Control(), tmp_path).records
    assert record.time == pytest.approx(TIME, abs=1e-6)


def test_a_list_of_rows_and_values_with_their_unit_are_json_too(tmp_path: Path) -> None:
    heads = {"time_s": TIME, "displacement_m": X, "force_N": FORCE}
    rows = [
        dict(zip(heads, row, strict=True)) for row in zip(*(values.tolist() for values in heads.values()), strict=True)
    ]
    (tmp_path / "a.json").write_text(json.dumps(rows), encoding="utf-8")
    said = {head: {"unit": UNITS[head], "values": COLUMNS[head].tolist()} for head in ("time", "pos", "load")}
    (tmp_path / "b.json").write_text(json.dumps({"runs": [said, said]}), encoding="utf-8")
    assert run(tmp_path, {"path": "a.json"}).records[0].force == pytest.approx(FORCE, abs=0.0)
    entry = {"path": "b.json", "columns": {"time": "time", "displacement": "pos", "force": "load"}}
    for record in run(tmp_path, entry).records:
        assert record.force == pytest.approx(FORCE, abs=1e-10)


# ---------------------------------------------------------------- real files, and text of loggers


def test_the_file_of_the_shaking_table_is_its_converted_one(tmp_path: Path, shared: Path) -> None:
    rig = run(shared / "data", {"path": "utfpr-mr/mat/*.mat", "layout": "shaking_table_mat"})
    converted = {"path": "utfpr-mr/converted/ensaio.A.1_*.csv", "columns": {"displacement": "displacement_mm"}}
    (theirs,) = run(shared / "data", converted | {"units": {"displacement": "mm"}}).records
    (ours,) = rig.records
    assert ours.time == pytest.approx(theirs.time, abs=1e-9)
    assert ours.displacement == pytest.approx(theirs.displacement, abs=1e-7)
    assert ours.force == pytest.approx(theirs.force, abs=1e-4)


def test_a_decimal_comma_is_reported_by_the_first_line_of_a_block_file(tmp_path: Path) -> None:
    mts(tmp_path / "a.dat", decimal=",")
    (record,) = run(tmp_path, {"path": "a.dat"} | NAMED).records
    assert record.force == pytest.approx(FORCE, abs=1e-5)


def test_events_with_a_separator_of_their_own_are_read_and_numbers_are_not_taken_for_them(tmp_path: Path) -> None:
    text = lines({"time_s": TIME, "displacement_m": X, "force_N": FORCE})
    text[0] += ",Events"
    text[250] += ",DAQ Pause, DAQ Stop"
    text[251] += ",DAQ Resume"
    split = {"split": {"event": "Events", "begins": "DAQ Resume"}}
    write(tmp_path / "a.csv", text)
    first, second = run(tmp_path, {"path": "a.csv"} | split).records
    assert (first.time.size, second.time.size) == (250, 250)
    assert np.concatenate((first.force, second.force)) == pytest.approx(FORCE, abs=1e-5)
    stops = {"split": {"event": "Events", "begins": "DAQ Pause, DAQ Stop"}}
    assert [record.time.size for record in run(tmp_path, {"path": "a.csv"} | stops).records] == [249, 251]
    text[100] += ",1,5"
    write(tmp_path / "a.csv", text)
    assert "a.csv:101: 5 fields where the header has 4" in refused(tmp_path, {"path": "a.csv"} | split)[0]


def test_a_current_may_be_the_control_of_any_format(tmp_path: Path) -> None:
    columns = COLUMNS | {"valve voltage": VOLTS / 200.0}
    parquet(tmp_path / "a.parquet", columns, UNITS | {"valve voltage": "A"})
    entry = {"path": "a.parquet", "columns": NAMED["columns"] | {"current": "valve voltage"}}
    del entry["columns"]["voltage"]
    (one,) = run(tmp_path, entry, control=Control("current", "A")).entries
    assert one.voltage_V == 0.5
