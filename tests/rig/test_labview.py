"""LabVIEW measurement files, written here after NI's specification: each of its ways to hold time and channels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from written_files import FORCE, TIME, X, refused, run

from pzd.cli.app import status
from pzd.rig.files.guess import guessed

NAMED = {"columns": {"time": "X_Value", "displacement": "Stroke", "force": "Load"}}


def head(x_columns: str, decimal: str = ".", headings: str = "Yes", separator: str = "Tab") -> list[list[str]]:
    return [
        ["LabVIEW Measurement"],
        ["Writer_Version", "2"],
        ["Separator", separator],
        ["Decimal_Separator", decimal],
        ["Multi_Headings", headings],
        ["X_Columns", x_columns],
        ["Time_Pref", "Relative"],
        ["Operator", "nobody, Prüfstand 3"],
        ["Date", "2024/03/05"],
        ["Time", f"10:11:12{decimal}5"],
        ["***End_of_Header***", ""],
        [""],
    ]


def segment(
    names: list[str], cells: list[list[str]], said: dict[str, list[str]], above: list[list[str]] | None = None
) -> list[list[str]]:
    channels = [name for name in names if name != "X_Value"]
    return [
        *(above or []),
        ["Channels", str(len(channels))],
        *([key, *values] for key, values in said.items()),
        ["***End_of_Header***", "", "", ""],
        [*names, "Comment"],
        *cells,
    ]


def written(path: Path, rows: list[list[str]], separator: str = "\t", encoding: str = "utf-8") -> None:
    path.write_bytes(("\r\n".join(separator.join(row) for row in rows) + "\r\n").encode(encoding))


def said(
    *units: str, step: float = 2e-3, x0: float = 0.0, clock: str = "10:11:12.5", decimal: str = "."
) -> dict[str, Any]:
    n = len(units)
    return {
        "Date": ["2024/03/05"] * n,
        "Time": [clock.replace(".", decimal)] * n,
        "Y_Unit_Label": list(units),
        "X_Dimension": ["Time"] * n,
        "X0": [f"{x0:.16E}".replace(".", decimal)] * n,
        "Delta_X": [f"{step:.6E}".replace(".", decimal)] * n,
    }


def cells(*columns: Any, decimal: str = ".") -> list[list[str]]:
    return [
        [c if isinstance(c, str) else f"{c:.9g}".replace(".", decimal) for c in row]
        for row in zip(*columns, strict=True)
    ]


def is_the_test(record: Any) -> None:
    assert np.diff(record.time) == pytest.approx(np.diff(TIME))
    assert record.displacement == pytest.approx(X, abs=1e-10)
    assert record.force == pytest.approx(FORCE, abs=1e-5)


BOTH = ["X_Value", "Stroke", "Load"]


def test_one_column_of_time_with_notes_comments_and_a_special_block(tmp_path: Path) -> None:
    body = cells(TIME, 1e3 * X, FORCE)
    body[0].append("OK")
    body[70] += ["valve\tclicked; 3,5 V"]
    special = [["***Start_Special***"], ["Binary", "0.1", "Stroke"], ["***End_Special***"], [""]]
    notes = [["Notes", "values hold for Stroke alone"], ["Test_Name", "a"]]
    rows = [*head("One"), *segment(BOTH, body[:300], said("mm", "N"), notes), [""], *special, *body[300:]]
    written(tmp_path / "a.lvm", rows)
    is_the_test(run(tmp_path, {"path": "a.lvm"} | NAMED).records[0])


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "cp1252"])
@pytest.mark.parametrize(("separator", "sign"), [("Tab", "\t"), ("Comma", ","), ("Semicolon", ";")])
def test_separator_decimal_sign_and_code_page_are_those_declared(
    tmp_path: Path, encoding: str, separator: str, sign: str
) -> None:
    decimal = "." if sign == "," else ","
    rows = [
        *head("No", decimal, separator=separator),
        *segment(
            ["X_Value", "Kolbenweg über alles", "Load"],
            cells([""] * TIME.size, 1e3 * X, FORCE, decimal=decimal),
            said("mm", "Newtons", decimal=decimal),
        ),
    ]
    if sign == ",":
        rows[7] = ["Operator", "Prüfer"]
    written(tmp_path / "a.lvm", rows, sign, encoding)
    named = {"columns": NAMED["columns"] | {"displacement": "Kolbenweg über alles"}}
    is_the_test(run(tmp_path, {"path": "a.lvm"} | named).records[0])


@pytest.mark.parametrize("spread", [False, True])
def test_a_column_of_time_for_each_channel(tmp_path: Path, spread: bool) -> None:
    """The force begins 40 ms later at twice the rate; what the head says stands in every or in every other cell."""
    own = np.arange(960) * 1e-3
    late = 0.04 + own
    v = 0.01 * 2 * np.pi * 5.0 * np.cos(2 * np.pi * 5.0 * late)
    force = 900.0 * v + 200.0 * np.tanh(v / 0.01)
    body = [["", "", "", ""] for _ in own]
    for row, (t, x) in enumerate(zip(TIME, 1e3 * X, strict=True)):
        body[row][:2] = [f"{t:.9g}", f"{x:.9g}"]
    for row, (t, f) in enumerate(zip(own, force, strict=True)):
        body[row][2:] = [f"{t:.9g}", f"{f:.9g}"]
    of = said("mm", "N")
    of["Time"][1] = "10:11:12.54"
    of["Delta_X"][1] = "1E-3"
    if spread:
        of = {key: [cell for value in values for cell in (value, "")] for key, values in of.items()}
    written(tmp_path / "a.lvm", [*head("Multi"), *segment(["X_Value", "Stroke", "X_Value", "Load"], body, of)])
    rig = run(tmp_path, {"path": "a.lvm"} | NAMED)
    (record,) = rig.records
    assert record.rate == pytest.approx(1000.0, rel=1e-6)
    assert record.time[0] == pytest.approx(0.04, abs=1e-6)
    assert record.displacement == pytest.approx(0.01 * np.sin(2 * np.pi * 5.0 * record.time), abs=1e-7)
    assert record.force == pytest.approx(force[: record.force.size], abs=1e-5)
    assert any(row.step == "clock" and "0.04 s earlier than 'Load'" in row.was for row in rig.ingested)


@pytest.mark.parametrize("every_row", [True, False])
def test_a_temperature_of_fewer_samples_is_held(tmp_path: Path, every_row: bool) -> None:
    """In the rows of its instants, or in the first rows by a step of its own."""
    oil = [20.0 + n for n in range(5)]
    column = [""] * TIME.size
    for n, value in enumerate(oil):
        column[100 * n if every_row else n] = f"{value:g}"
    of = said("mm", "N", "degC")
    of["Delta_X"][2] = "0.2"
    rows = segment([*BOTH, "Oil temp"], cells(TIME, 1e3 * X, FORCE, column), of)
    written(tmp_path / "a.lvm", [*head("One"), *rows])
    named = {"columns": NAMED["columns"] | {"temperature": "Oil temp"}}
    (record,) = run(tmp_path, {"path": "a.lvm"} | named).records
    is_the_test(record)
    assert record.temperature is not None
    assert record.temperature == pytest.approx(20.0 + np.floor(TIME / 0.2 + 1e-6))


def test_segments_that_begin_anew_are_tests_and_those_that_go_on_are_one(tmp_path: Path) -> None:
    body = cells(TIME, 1e3 * X, FORCE)
    anew = [*head("One"), *segment(BOTH, body, said("mm", "N")), [""]]
    written(tmp_path / "a.lvm", [*anew, *segment(BOTH, body, said("mm", "N", clock="10:13:00.0"))])
    for record in run(tmp_path, {"path": "a.lvm"} | NAMED).records:
        is_the_test(record)
    assert len(run(tmp_path, {"path": "a.lvm"} | NAMED).records) == 2
    # By the column of time, and by the time of day where the column begins anew.
    goes_on = [*head("One"), *segment(BOTH, body[:200], said("mm", "N")), [""]]
    written(tmp_path / "b.lvm", [*goes_on, *segment(BOTH, body[200:], said("mm", "N"))])
    second = cells(TIME[:300], 1e3 * X[200:], FORCE[200:])
    written(tmp_path / "c.lvm", [*goes_on, *segment(BOTH, second, said("mm", "N", clock="10:11:12.9"))])
    for name in ("b.lvm", "c.lvm"):
        (record,) = run(tmp_path, {"path": name} | NAMED).records
        is_the_test(record)


def test_without_headings_of_its_own_a_segment_begins_where_time_goes_back(tmp_path: Path) -> None:
    body = cells(TIME, 1e3 * X, FORCE)
    written(tmp_path / "a.lvm", [*head("One", headings="No"), *segment(BOTH, body, said("mm", "N")), [""], *body])
    records = run(tmp_path, {"path": "a.lvm"} | NAMED).records
    assert len(records) == 2
    for record in records:
        is_the_test(record)


def test_a_bad_cell_or_a_cut_off_head_is_named_by_its_line(tmp_path: Path) -> None:
    body = cells(TIME, 1e3 * X, FORCE)
    body[4][2] = "12,5"
    written(tmp_path / "a.lvm", [*head("One"), *segment(BOTH, body, said("mm", "N"))])
    (message,) = refused(tmp_path, {"path": "a.lvm"} | NAMED)
    assert "a.lvm:26: numbers are needed here, with '.' as the head says" in message
    written(tmp_path / "b.lvm", head("One")[:6])
    assert "b.lvm:1: a head without its end" in refused(tmp_path, {"path": "b.lvm"} | NAMED)[0]


def test_what_init_proposes_passes_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rows = segment(["X_Value", "Stroke", "Load cell"], cells([""] * TIME.size, 1e3 * X, FORCE), said("mm", "Newtons"))
    written(tmp_path / "a.lvm", [*head("No"), *rows])
    text = "\n".join(guessed([Path("a.lvm")]))
    assert "fill in" not in text
    Path("own.yaml").write_text(text.replace("# car", "car"), encoding="utf-8")
    assert status(["check", "own.yaml", "-q"]) == 0
