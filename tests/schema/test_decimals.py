"""Numbers in a column file read back to the last bit, in no more digits than that takes."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.schema.csvfile import lines, numbers

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
def test_measured_numbers(rng: np.random.Generator, figures: int | None) -> None:
    values = rng.standard_normal(5000) * 10.0 ** rng.uniform(-8.0, 8.0, 5000)
    if figures is not None:
        values = np.array([float(f"{value:.{figures}g}") for value in values])
    all_read_back(values)


def test_any_float(rng: np.random.Generator) -> None:
    values = rng.integers(0, 2**64, 20_000, dtype=np.uint64).view(np.float64)
    all_read_back(values[np.isfinite(values)])


def test_where_the_neighbours_lie_uneven_and_where_the_form_changes() -> None:
    powers = np.ldexp(1.0, np.arange(-1074, 1024))
    all_read_back(np.concatenate([EDGES, powers, np.nextafter(powers, 0.0), np.nextafter(powers, np.inf), -powers]))


def test_a_block_of_rows_is_written_as_the_rows_alone_are(rng: np.random.Generator) -> None:
    columns = [rng.standard_normal(600), None, rng.standard_normal(600), None]
    pieces = [lines([None if c is None else c[first : first + 10] for c in columns], 10) for first in range(0, 600, 10)]
    assert lines(columns, 600) == b"".join(pieces)


def test_empty_columns() -> None:
    assert lines([None, None], 2) == b",\n,\n"
    assert lines([np.empty(0)], 0) == b""


def test_what_json_does_not_know() -> None:
    assert numbers("+1.,.5\n 2.0 ,-3E1\n", [0, 1], 2).tolist() == [[1.0, 0.5], [2.0, -30.0]]


def test_some_of_the_columns() -> None:
    assert numbers("1.0,,2.0\n3.0,,4.0\n", [0, 2], 3).tolist() == [[1.0, 2.0], [3.0, 4.0]]


@pytest.mark.parametrize("body", ["1.0,2.0\n3.0,\n", "1.0,true\n", '1.0,"2.0"\n', "1.0,2.0\n3.0\n", "1.0,[2.0]\n"])
def test_what_is_no_table_of_numbers(body: str) -> None:
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
