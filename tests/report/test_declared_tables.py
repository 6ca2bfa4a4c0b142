"""A table that is declared once says the same in a terminal, on the page, as plain data and as a DataFrame."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from pzd.artefacts import ParameterRow
from pzd.artefacts.csv_rows import Estimate
from pzd.quantities import Control
from pzd.report import tables
from pzd.report.columns import Beyond, Column, Quantity, Span, Table

ROWS = [
    SimpleNamespace(name="a", stroke_m=0.0123456, force=Span(-1234.5, 5.0), share=0.25, setting=None),
    SimpleNamespace(name="b", stroke_m=None, force=Beyond(7.0), share=0.0, setting=None),
]
COLUMNS = (
    Column("setting", "setting", optional=True),
    Column("name", "test"),
    Column("stroke_m", "stroke", "mm", factor=1000.0),
    Column("force", "force", "N"),
    tables.share("share", "outside"),
)


def test_units_stand_in_the_head_in_a_terminal_and_on_a_page() -> None:
    table = Table("Tests", COLUMNS, ROWS, fold=1)
    assert table.lines("  ") == [
        "  test  stroke [mm]  force [N]   outside [%]",
        "  a     12.35        -1234 to 5  25",
        "  b     -            (7)         0",
    ]
    block = table.block()
    assert block.header == ("test", "stroke [mm]", "force [N]", "outside [%]")
    assert block.rows[0] == ("a", "12.3", "\u22121\u202f230 to 5", "25")
    assert block.rows[1] == ("b", "\u2013", "(7)", "0")
    assert block.folded


def test_rows_stand_side_by_side_where_people_compare_them() -> None:
    block = Table("Tests", COLUMNS, ROWS).across()
    assert block.header == ("test", "a", "b")
    assert block.rows == (
        ("stroke [mm]", "12.3", "\u2013"),
        ("force [N]", "\u22121\u202f230 to 5", "(7)"),
        ("outside [%]", "25", "0"),
    )


def test_plain_data_is_in_si_with_an_own_name_for_each_number() -> None:
    columns = (*COLUMNS[1:4], Column("peak", "peak", value=lambda _: Quantity(2.0, "bar")))
    assert Table("Tests", columns, ROWS[:1]).records() == [
        {"name": "a", "stroke_m": 0.0123456, "force_from": -1234.5, "force_to": 5.0, "peak": 2.0, "peak_unit": "bar"}
    ]


def test_the_frame_of_the_parameters_has_the_columns_of_their_file_under_the_name_of_the_control(run: Any) -> None:
    control = Control("current", "A")
    frame = tables.parameters(run.identified.rows, control).to_frame()
    assert list(frame.columns) == [control.renamed(name) for name in ParameterRow.model_fields]
    for name in ("T0_N", "C_Ns_per_m_low95", "status"):
        assert frame[name].tolist() == [getattr(row, name) for row in run.identified.rows]


def test_a_unit_stands_in_the_head_of_estimates_on_the_page_too() -> None:
    rows = [SimpleNamespace(c=Estimate(1510.0, 1490.0, 1530.0))]
    block = Table("Damping", (Column("c", "C", "N s/m"),), rows).block()
    assert block.header == ("C [N s/m]",)
    assert block.rows == (("1\u202f510 (1\u202f490\u00a0to\u00a01\u202f530)",),)
