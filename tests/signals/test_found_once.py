"""What is found of a record once: within its pass alone, and by the array itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pzd.record import Array, running_median
from pzd.signals.measures import found_once, one_record


def counting() -> tuple[list[Array], Callable[[Array], float]]:
    """Return the arrays that a function was asked about, and the function."""
    asked: list[Array] = []

    @found_once
    def largest(values: Array) -> float:
        asked.append(values)
        return float(values.max())

    return asked, largest


def test_what_is_asked_again_of_a_record_is_not_computed_again() -> None:
    asked, largest = counting()
    first, second = np.arange(3.0), np.arange(4.0)
    with one_record():
        assert [largest(values) for values in (first, second, first, second)] == [2.0, 3.0, 2.0, 3.0]
    assert len(asked) == 2


def test_an_array_that_holds_other_values_by_then_is_asked_anew() -> None:
    _, largest = counting()
    values = np.arange(3.0)
    with one_record():
        assert largest(values) == 2.0
    values *= 2.0
    assert largest(values) == 4.0
    with one_record():
        assert largest(values) == 4.0


def test_arrays_that_come_and_go_are_not_taken_for_one_another() -> None:
    _, largest = counting()
    with one_record():
        assert [largest(np.full(100, float(n))) for n in range(50)] == [float(n) for n in range(50)]


def test_the_running_median_is_that_of_each_window(rng: np.random.Generator) -> None:
    values = rng.integers(0, 9, 70_000).astype(np.float64)  # ties, and more than one block
    for width in (5, 7):
        windows = np.lib.stride_tricks.sliding_window_view(values, width)
        assert np.array_equal(running_median(values, width), np.median(windows, axis=1))
