"""The package carries the paper's numbers as they were handed over, and reads them whole."""

from __future__ import annotations

import hashlib
from importlib.resources import files

import pytest

from pzd.paper.published import LARGE_GAP, published, rig_tests, span, table_damper

HANDED_OVER = "5863f2896bea5d2de2b185c63034bd25e156cdcc31d6d1c278031561f79700ce"
"""SHA-256 of the file as it was handed over with the paper: nobody corrects what is printed."""


def test_the_package_holds_the_numbers_byte_for_byte_as_they_were_handed_over() -> None:
    copy = files("pzd.paper").joinpath("published.csv").read_bytes()
    assert hashlib.sha256(copy).hexdigest() == HANDED_OVER


def test_every_number_has_an_id_of_its_own() -> None:
    lines = files("pzd.paper").joinpath("published.csv").read_text(encoding="utf-8").splitlines()
    assert len(published()) == len(lines) - 1


def test_numbers_of_the_paper_read_as_numbers() -> None:
    rows = published()
    assert rows["F4-150"].number == 5370
    assert rows["T1-0-C"].number == 9200
    assert rows["F5-100"].number == 2270
    assert rows["CL-range"].value == "200-250"
    with pytest.raises(ValueError, match="CL-range"):
        _ = rows["CL-range"].number


def test_the_rig_measured_thirteen_peaks_and_two_forces_at_rest() -> None:
    assert len(rig_tests()) == 15


def test_one_test_with_three_values_spans_them() -> None:
    assert span(published()["F6-2"]) == (1514, 1610)
    assert span(published()["F9-23"]) == (2900, 2940)
    assert span(published()["F8-43"]) == (1310, 1310)


def test_a_table_of_the_paper_is_a_damper_by_voltage() -> None:
    rows = table_damper("Table 2")
    assert [row.voltage_V for row in rows] == [0, 50, 100, 150]
    assert (rows[-1].T0_N, rows[-1].C_Ns_per_m, rows[-1].k_N_per_m) == (1325, 2560, 423000)
    assert published()["T2-150-C"].setting == LARGE_GAP
