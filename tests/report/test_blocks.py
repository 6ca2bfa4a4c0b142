"""Numbers, times and words as the page writes them."""

from __future__ import annotations

import pytest

from pzd.artefacts.csv_rows import Estimate
from pzd.report.blocks import amount, listed, minutes, number, sentence
from pzd.report.columns import PAGE, TERMINAL


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1510.0, "1\u202f510"),
        (1513.7, "1\u202f510"),
        (0.99996, "1"),
        (999.96, "1\u202f000"),
        (-0.0123456, "\u22120.0123"),
        (0.0009, "0.0009"),
        (3.2e-9, "3.2\u00a0\u00d7\u00a010⁻⁹"),
        (-2.5e7, "\u22122.5\u00a0\u00d7\u00a010⁷"),
        (22.0, "22"),
        (100.0, "100"),
        (None, "\u2013"),
        (float("inf"), "\u2013"),
    ],
)
def test_a_number_has_three_digits_and_thin_spaces(value: float | None, text: str) -> None:
    assert number(value) == text


def test_a_number_keeps_its_unit_and_none_has_none() -> None:
    assert amount(2.2, "m/s2") == "2.2\u00a0m/s²"
    assert amount(None, "m/s2") == "\u2013"
    assert amount(1.4, "-") == "1.4"


@pytest.mark.parametrize(
    ("estimate", "page", "terminal"),
    [
        (Estimate(1510.0, 1490.0, 1530.0), "1\u202f510 (1\u202f490 to 1\u202f530)", "1510 (1490 to 1530)"),
        (Estimate(0.97123, 0.95, 1.02), "0.971 (0.95 to 1.02)", "0.971 (0.95 to 1.02)"),
        (Estimate(6.3e-25, 0.0, 12.4), "0 (0 to 12)", "0 (0 to 12)"),
        (Estimate(301.23456, 300.71, 301.77), "301.2 (300.7 to 301.8)", "301.2 (300.7 to 301.8)"),
        (Estimate(5.0, 5.0, 5.0), "5 (5 to 5)", "5 (5 to 5)"),
        (Estimate(None), "\u2013", "-"),
        (Estimate(5.0), "5 (no interval)", "5 (no interval)"),
    ],
)
def test_an_estimate_has_the_digits_that_its_interval_supports_on_the_page_and_in_the_terminal(
    estimate: Estimate, page: str, terminal: str
) -> None:
    assert PAGE.interval(estimate).replace("\u00a0to\u00a0", " to ") == page
    assert " to " not in PAGE.interval(estimate)  # a narrow cell parts the value from its interval
    assert TERMINAL.interval(estimate) == terminal


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0 min"),
        (53.9, "54 min"),
        (59.7, "1 h"),
        (197.0, "3 h 17 min"),
        (240.0, "4 h"),
        (1440.0, "> 24 h"),
    ],
)
def test_a_time_of_exposure_is_written_in_hours_and_minutes(value: float, text: str) -> None:
    assert minutes(value).replace("\u00a0", " ") == text


def test_words_are_joined_to_an_enumeration_and_a_sentence() -> None:
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"], "or") == "a, b or c"
    assert listed([]) == ""
    assert sentence("it holds") == "It holds."
    assert sentence("") == ""
