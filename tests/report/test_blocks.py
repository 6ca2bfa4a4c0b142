"""Numbers, times and words as the page writes them."""

from __future__ import annotations

import pytest

from pzd.report.blocks import amount, interval, listed, minutes, number, sentence


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
    ("given", "text"),
    [
        ((1510.0, 1490.0, 1530.0), "1\u202f510 (1\u202f490 to 1\u202f530)"),
        ((0.97123, 0.95, 1.02), "0.971 (0.95 to 1.02)"),
        ((None, None, None), "\u2013"),
        ((5.0, None, None), "5 (no interval)"),
    ],
)
def test_a_number_has_the_digits_that_its_interval_supports_on_the_page(
    given: tuple[float | None, ...], text: str
) -> None:
    assert interval(*given) == text


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
