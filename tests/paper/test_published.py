"""The package carries the paper's numbers as they were handed over, each with the number of a run that it is about."""

from __future__ import annotations

import csv
import hashlib
import io
from pathlib import Path

import pytest

from pzd.paper.published import LARGE_GAP, published, rig_tests, span, table_damper
from pzd.report.reference import SHIPPED

HANDED_OVER = "ac355c9c64625f559d88f069463124166105db14a9fff45693de9aa867842756"
"""SHA-256 of the cells as they were handed over with the paper, notes left out: nobody corrects what is printed."""


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_the_package_holds_every_cell_as_it_was_handed_over() -> None:
    added = {"note", "policy", "fidelity", "selector"}
    rows = rows_of(SHIPPED["makowski2021"].read_text(encoding="utf-8"))
    cells = "\n".join("\t".join(text for name, text in row.items() if name not in added) for row in rows)
    assert hashlib.sha256(cells.encode()).hexdigest() == HANDED_OVER


def test_the_notes_begin_as_they_were_handed_over(shared: Path) -> None:
    given = rows_of((shared / "paper" / "published.csv").read_text(encoding="utf-8"))
    ours = rows_of(SHIPPED["makowski2021"].read_text(encoding="utf-8"))
    notes = {row["id"]: row["note"] for row in given}
    assert [row["id"] for row in ours if not row["note"].startswith(notes[row["id"]])] == []


def test_every_number_but_three_names_what_it_is_compared_with() -> None:
    assert [row.id for row in published().values() if not row.selector] == ["POWER", "TEMP-start", "TEMP-end"]


def test_every_number_has_an_id_of_its_own() -> None:
    lines = SHIPPED["makowski2021"].read_text(encoding="utf-8").splitlines()
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
