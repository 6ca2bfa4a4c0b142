"""CSV artefacts read back bit by bit, and what a person or a program got wrong is refused with file and line."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from pzd.quantities import Control
from pzd.schema import csvfile
from pzd.schema.csvfile import lines, numbers, read_columns, read_rows, write_columns, write_rows
from pzd.schema.errors import DataError
from pzd.schema.model import Frozen

VOLTAGE = Control()
CURRENT = Control("current", "A")
HEADER = ("time_s", "force_N", "voltage_V")
OPTIONAL = ("voltage_V",)


class Row(Frozen):
    name: str
    voltage_V: float | None
    force_N: float
    inside: Literal[0, 1] = 1
    published: float | str = ""


def of_rows(path: Path, text: str | bytes, control: Control = VOLTAGE) -> list[str]:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(DataError) as caught:
        read_rows(path, Row, control)
    return [message.replace(str(path), "a.csv") for message in caught.value.messages]


def of_columns(path: Path, text: str | bytes, control: Control = VOLTAGE) -> list[str]:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(DataError) as caught:
        read_columns(path, HEADER, control, OPTIONAL)
    return [message.replace(str(path), "a.csv") for message in caught.value.messages]


@pytest.mark.parametrize("control", [VOLTAGE, CURRENT])
def test_rows_read_back_with_every_bit(tmp_path: Path, control: Control) -> None:
    path = tmp_path / "a.csv"
    rows = (
        Row(name='a, "b"\nc', voltage_V=None, force_N=-0.0, inside=0),
        Row(name="ä", voltage_V=0.1 + 0.2, force_N=1e-300, published="9 h"),
        Row(name="", voltage_V=1.0, force_N=5.0, published=2.5),
    )
    write_rows(path, Row, rows, control)
    found = read_rows(path, Row, control)
    assert found == rows
    assert np.signbit(found[0].force_N)


@pytest.mark.parametrize(
    "text", ["=HYPERLINK(1)", "+A1", "-A1", "@SUM(A1)", "\t=1", "\r=1", "\n=1", "'=1", "''=1", "=1,2", "-1.5 mm"]
)
def test_text_that_a_spreadsheet_would_compute_is_disarmed_and_reads_back(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.csv"
    rows = (Row(name=text, voltage_V=-1.5, force_N=-2.0, published=text),)
    write_rows(path, Row, rows, VOLTAGE)
    with path.open(newline="", encoding="utf-8") as file:
        _, cells = csv.reader(file)
    assert cells == [f"'{text}", "-1.5", "-2.0", "1", f"'{text}"]
    assert read_rows(path, Row, VOLTAGE) == rows


@pytest.mark.parametrize("text", ["-", "-1.5", "+3e4", "a=b", "'tis", "'", "gap 0.25 mm", ""])
def test_numbers_and_other_text_stay_as_they_are(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.csv"
    rows = (Row(name=text, voltage_V=None, force_N=1.0),)
    write_rows(path, Row, rows, VOLTAGE)
    assert path.read_text(encoding="utf-8").splitlines()[1] == f"{text},,1.0,1,"
    assert read_rows(path, Row, VOLTAGE) == rows


def test_no_rows_are_a_header_alone(tmp_path: Path) -> None:
    write_rows(tmp_path / "a.csv", Row, (), VOLTAGE)
    assert read_rows(tmp_path / "a.csv", Row, VOLTAGE) == ()


def test_a_spreadsheet_may_save_rows_its_own_way(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(b'\xef\xbb\xbfname,voltage_V,force_N,inside,published\r\n"a","1",2.50,1,\r\n')
    assert read_rows(path, Row, VOLTAGE) == (Row(name="a", voltage_V=1.0, force_N=2.5),)


def test_a_file_of_a_version_with_fewer_columns_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("name,voltage_V,force_N,published\na,1,2.5,x\n", encoding="utf-8")
    assert read_rows(path, Row, VOLTAGE) == (Row(name="a", voltage_V=1.0, force_N=2.5, published="x"),)


TOP = "name,voltage_V,force_N,inside,published\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a.csv:1: the header must read name,voltage_V,force_N,inside,published; missing: name"),
        ("name,voltage_V,force_kN,inside,published\n", "; missing: force_N; unknown: force_kN (got"),
        ("name,name,voltage_V,force_N,inside,published\n", "; twice: name (got"),
        ("voltage_V,name,force_N,inside,published\n", "; another order (got"),
        (TOP + "a,1,2,1\n", "a.csv:2: 4 fields where the header has 5"),
        (TOP + "a,1,2,1,,\n", "a.csv:2: 6 fields where the header has 5"),
        (TOP + "a,1,2,1,\n\n", "a.csv:3: 0 fields where the header has 5"),
        (TOP + "a,1,x,1,\n", "a.csv:2: force_N: must be a number (got 'x')"),
        (TOP + "a,1,,1,\n", "a.csv:2: force_N: must be a number (got '')"),
        (TOP + "a,1,nan,1,\n", "a.csv:2: force_N: "),
        (TOP + "a,1,1_0,1,\n", "a.csv:2: force_N: "),
        (TOP + "a,inf,1,1,\n", "a.csv:2: voltage_V: "),
        (TOP + "a,1,2,3,\n", "a.csv:2: inside: must be 0 or 1 (got 3)"),
        (TOP + '"a\nb",1,2,1,\nc,1,x,1,\n', "a.csv:4: force_N: "),
        (TOP + '"a,1,2,1,\n', "a.csv:2: not CSV: "),
        (TOP + '"a"b,1,2,1,\n', "a.csv:2: not CSV: "),
        (TOP + "a,1,2,1,\0\n", "a.csv:2: a zero byte; this is no text"),
        (TOP.encode() + b"caf\xe9,1,2,1,\n", "a.csv:2: not UTF-8 text"),
    ],
)
def test_rows_at_fault_are_refused_in_one_line_with_their_place(
    tmp_path: Path, text: str | bytes, message: str
) -> None:
    (found,) = of_rows(tmp_path / "a.csv", text)
    assert message in found
    assert found.startswith("a.csv:")


def test_every_row_at_fault_is_listed_at_once(tmp_path: Path) -> None:
    found = of_rows(tmp_path / "a.csv", TOP + "a,x,y,1,\nb,1,2,1,\nc,1,z,1,\n")
    assert [message.split(": ")[0] for message in found] == ["a.csv:2", "a.csv:2", "a.csv:4"]


def test_a_file_of_faults_is_not_a_message_without_end(tmp_path: Path) -> None:
    found = of_rows(tmp_path / "a.csv", TOP + "a,x,1,1,\n" * 1000)
    assert len(found) == 21
    assert found[-1] == "a.csv: and 980 more such faults"


def test_keys_of_the_control_bear_its_own_name(tmp_path: Path) -> None:
    (found,) = of_rows(tmp_path / "a.csv", TOP, CURRENT)
    assert "missing: current_A; unknown: voltage_V" in found


def test_columns_read_back_with_every_bit(tmp_path: Path, rng: np.random.Generator) -> None:
    for draw in rng.spawn(3):
        columns = {name: draw.standard_normal(500) * 10.0 ** draw.integers(-300, 300, 500) for name in HEADER}
        write_columns(tmp_path / "a.csv", columns, CURRENT)
        found = read_columns(tmp_path / "a.csv", HEADER, CURRENT, OPTIONAL)
        assert all(np.array_equal(found[name], columns[name]) for name in HEADER)
        assert (tmp_path / "a.csv").read_text().startswith("time_s,force_N,current_A\n")


def test_a_long_file_is_written_block_by_block_with_the_same_bytes(tmp_path: Path, rng, monkeypatch) -> None:
    columns = {name: rng.standard_normal(50) for name in HEADER}
    written = []
    for rows in (1000, 7):
        monkeypatch.setattr(csvfile, "_WRITTEN", rows)
        write_columns(tmp_path / "a.csv", columns, VOLTAGE, [*HEADER[:2], "absent", *HEADER[2:]])
        written.append((tmp_path / "a.csv").read_bytes())
    assert written[1] == written[0]
    assert len(written[0].splitlines()) == 51


def test_columns_of_one_line_are_read(tmp_path: Path) -> None:
    write_columns(tmp_path / "a.csv", {name: np.array([1.0]) for name in HEADER}, VOLTAGE)
    assert read_columns(tmp_path / "a.csv", HEADER, VOLTAGE)["force_N"].shape == (1,)


def test_an_absent_channel_is_empty_cells_and_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_columns(path, {"time_s": np.arange(3.0), "force_N": np.ones(3), "voltage_V": None}, VOLTAGE)
    assert path.read_text().splitlines()[1] == "0.0,1.0,"
    assert set(read_columns(path, HEADER, VOLTAGE, OPTIONAL)) == {"time_s", "force_N"}
    path.write_text("time_s,force_N\n0,1\n")
    assert set(read_columns(path, HEADER, VOLTAGE, OPTIONAL)) == {"time_s", "force_N"}


def test_windows_line_ends_and_a_mark_of_byte_order_are_no_fault(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbftime_s,force_N,voltage_V\r\n0,1,2\r\n1,2,3\r\n")
    assert read_columns(path, HEADER, VOLTAGE)["voltage_V"].tolist() == [2.0, 3.0]


HEAD = ",".join(HEADER) + "\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a.csv:1: the header must read time_s,force_N"),
        (HEAD, "a.csv:1: no data rows stand below the header"),
        ("time_s,force_kN,voltage_V\n0,1,2\n", "missing: force_N; unknown: force_kN"),
        ("time_s,force_N,voltage_V,voltage_V\n0,1,2,3\n", "twice: voltage_V"),
        (HEAD + "0,1,2\n1,2\n", "a.csv:3: 2 fields where the header has 3"),
        (HEAD + "0,1,2\n\n1,2,3\n", "a.csv:3: 1 fields where the header has 3"),
        (HEAD + "0,1,2\n1,x,2\n", "a.csv:3: force_N: a finite number is needed (got 'x')"),
        (HEAD + "0,1,2\n1,,2\n", "a.csv:3: force_N: a finite number is needed (got '')"),
        (HEAD + "0,1,2\n1,nan,2\n", "a.csv:3: force_N: a finite number is needed (got 'nan')"),
        (HEAD + "0,1,2\n1,-inf,2\n", "a.csv:3: force_N: a finite number is needed (got '-inf')"),
        (HEAD + "0,1,2\n1,1_0,2\n", "a.csv:3: force_N: a finite number is needed (got '1_0')"),
        (HEAD + '0,1,2\n1,"1",2\n', "a.csv:3: force_N: a finite number is needed"),
        (HEAD + "0,1,2\n1,2,\n", "a.csv:3: voltage_V: a finite number is needed (got '')"),
        (HEAD + "0,1,\n1,2,3\n", "a.csv:3: voltage_V: the column is empty above"),
        (HEAD + "0,1,2\n#,1,2\n", "a.csv:3: time_s: a finite number is needed (got '#')"),
        (HEAD + "0,1,2\n1,\0,2\n", "a.csv:3: a zero byte; this is no text"),
    ],
)
def test_columns_at_fault_are_refused_in_one_line_with_their_place(tmp_path: Path, text: str, message: str) -> None:
    (found,) = of_columns(tmp_path / "a.csv", text)
    assert message in found
    assert found.startswith("a.csv:")


def test_columns_that_no_reader_would_take_are_not_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="force_N"):
        write_columns(tmp_path / "a.csv", {"time_s": np.zeros(2), "force_N": np.array([1.0, np.nan])}, VOLTAGE)
    with pytest.raises(ValueError):
        write_columns(tmp_path / "a.csv", {"time_s": np.zeros(2), "force_N": np.zeros(3)}, VOLTAGE)


def test_a_long_record_is_read_in_a_moment(tmp_path: Path) -> None:
    columns = {name: np.linspace(0.0, 1.0, 200_000) for name in HEADER}
    write_columns(tmp_path / "a.csv", columns, VOLTAGE)
    assert read_columns(tmp_path / "a.csv", HEADER, VOLTAGE)["time_s"].size == 200_000


# --- Numbers as text ---

EDGES = [0.0, -0.0, 1.0, 0.1, 0.3, 2.0 / 3.0, 5e-324, 2.2250738585072014e-308, 1.7976931348623157e308, 1e15, 1e16, 1e22]
EDGES += [1e23, 9999999999999998.0, 12345678901234567.0, 1e-4, 1e-5, 123456.0, -1e-7, 1e100, 9.5, 99999.0, 100000.0]


def digits(text: str) -> str:
    """The digits of a decimal that count."""
    return text.lower().partition("e")[0].lstrip("-").replace(".", "").strip("0")


def all_read_back(values: np.ndarray) -> None:
    """Bit for bit, and as short as `repr` has them."""
    cells = lines([values], values.size).decode().split("\n")[:-1]
    assert np.array([float(cell) for cell in cells]).tobytes() == values.tobytes()
    assert numbers("\n".join(cells), [0], 1).tobytes() == values.tobytes()
    assert [digits(cell) for cell in cells] == [digits(repr(value)) for value in values.tolist()]


@pytest.mark.parametrize("figures", [None, 3, 7])
def test_measured_numbers_read_back_in_the_fewest_digits(rng: np.random.Generator, figures: int | None) -> None:
    values = rng.standard_normal(5000) * 10.0 ** rng.uniform(-8.0, 8.0, 5000)
    if figures is not None:
        values = np.array([float(f"{value:.{figures}g}") for value in values])
    all_read_back(values)


def test_any_float_reads_back_in_the_fewest_digits(rng: np.random.Generator) -> None:
    values = rng.integers(0, 2**64, 20_000, dtype=np.uint64).view(np.float64)
    all_read_back(values[np.isfinite(values)])


def test_floats_beside_powers_of_two_read_back_in_the_fewest_digits() -> None:
    powers = np.ldexp(1.0, np.arange(-1074, 1024))
    all_read_back(np.concatenate([EDGES, powers, np.nextafter(powers, 0.0), np.nextafter(powers, np.inf), -powers]))


def test_a_block_of_rows_is_written_as_the_rows_alone_are(rng: np.random.Generator) -> None:
    columns = [rng.standard_normal(600), None, rng.standard_normal(600), None]
    pieces = [lines([None if c is None else c[first : first + 10] for c in columns], 10) for first in range(0, 600, 10)]
    assert lines(columns, 600) == b"".join(pieces)


def test_columns_without_values_are_empty_cells() -> None:
    assert lines([None, None], 2) == b",\n,\n"
    assert lines([np.empty(0)], 0) == b""


def test_numbers_that_json_does_not_know_are_read() -> None:
    assert numbers("+1.,.5\n 2.0 ,-3E1\n", [0, 1], 2).tolist() == [[1.0, 0.5], [2.0, -30.0]]


def test_some_of_the_columns_are_read() -> None:
    assert numbers("1.0,,2.0\n3.0,,4.0\n", [0, 2], 3).tolist() == [[1.0, 2.0], [3.0, 4.0]]


@pytest.mark.parametrize("body", ["1.0,2.0\n3.0,\n", "1.0,true\n", '1.0,"2.0"\n', "1.0,2.0\n3.0\n", "1.0,[2.0]\n"])
def test_what_is_no_table_of_numbers_is_refused(body: str) -> None:
    with pytest.raises(ValueError):
        numbers(body, [0, 1], 2)


@pytest.mark.parametrize("empty", [{0}, {1}, {2}, {0, 2}, {1, 2}, {0, 1}])
def test_an_empty_column_leaves_its_cells_empty_wherever_it_stands(empty: set[int]) -> None:
    cells = [[1.5, -2e-30], [0.25, 1e22], [-0.0, 3.0]]
    columns = [None if place in empty else np.array(column) for place, column in enumerate(cells)]
    written = lines(columns, 2).decode().split("\n")[:-1]
    expected = [["" if place in empty else repr(cells[place][row]) for place in range(3)] for row in range(2)]
    assert [[cell and repr(float(cell)) for cell in line.split(",")] for line in written] == expected


def test_a_number_that_is_none_leaves_its_cell_empty() -> None:
    assert lines([np.array([1.5, np.nan]), np.array([np.nan, 2.0])], 2) == b"1.5,\n,2.0\n"
