"""Numbers written by compiled code are to the last character those that `repr` writes."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.schema.decimals import lines
from pzd.schema.shortest import shortest_lines

EDGES = [0.0, -0.0, 1.0, 0.1, 0.3, 2.0 / 3.0, 5e-324, 2.2250738585072014e-308, 1.7976931348623157e308, 1e15, 1e16, 1e22]
EDGES += [1e23, 9999999999999998.0, 12345678901234567.0, 1e-4, 1e-5, 123456.0, -1e-7, 1e100, 9.5, 99999.0, 100000.0]


def written(values: np.ndarray) -> list[str]:
    """Each value as the compiled code writes it."""
    return shortest_lines(values[None, :], np.array([True])).decode().split("\n")[:-1]


@pytest.mark.parametrize("digits", [None, 3, 7])
def test_measured_numbers(rng: np.random.Generator, digits: int | None) -> None:
    values = rng.standard_normal(5000) * 10.0 ** rng.uniform(-8.0, 8.0, 5000)
    if digits is not None:
        values = np.array([float(f"{value:.{digits}g}") for value in values])
    assert written(values) == [repr(value) for value in values.tolist()]


def test_any_float(rng: np.random.Generator) -> None:
    values = rng.integers(0, 2**64, 20_000, dtype=np.uint64).view(np.float64)
    values = values[np.isfinite(values)]
    assert written(values) == [repr(value) for value in values.tolist()]


def test_where_the_neighbours_lie_uneven_and_where_the_form_changes() -> None:
    powers = np.ldexp(1.0, np.arange(-1074, 1024))
    values = np.concatenate([EDGES, powers, np.nextafter(powers, 0.0), np.nextafter(powers, np.inf), -powers])
    values = np.concatenate([values, [float(f"1e{exponent}") for exponent in range(-323, 309)]])
    assert written(values) == [repr(value) for value in values.tolist()]


def test_many_rows_are_written_as_few_are(rng: np.random.Generator) -> None:
    columns = [rng.standard_normal(6000), None, rng.standard_normal(6000), None]
    pieces = [
        lines([None if column is None else column[first : first + 10] for column in columns], 10)
        for first in range(0, 6000, 10)
    ]
    assert lines(columns, 6000) == b"".join(pieces)


def test_empty_columns() -> None:
    assert lines([None, None], 2) == b",\n,\n"
