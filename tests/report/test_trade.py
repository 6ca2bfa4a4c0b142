"""The knee law on the page and in the terminal: rebound and compression in the language of the trade."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pzd.artefacts import Characteristics, ClickRow, KneeForceRow, KneeRow, Knees, LawRow, PredictedRow, UnitRow
from pzd.artefacts.identified import AsItStandsRow
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.report import tables
from pzd.report.columns import TERMINAL
from pzd.report.damper_models import DamperModels
from pzd.report.diagnosis_text import diagnosis_lines

PLACE = {"setting": "gap 0.25 mm", "voltage_V": 0.0, "temperature_degC": 22.0}
VALUES = {
    "rebound_bleed_Ns_per_m": 1530.0,
    "rebound_knee_force_N": 167.0,
    "rebound_knee_velocity_m_per_s": 0.085,
    "rebound_blow_off_Ns_per_m": 640.0,
    "compression_bleed_Ns_per_m": 650.0,
    "compression_knee_force_N": None,
    "compression_knee_velocity_m_per_s": None,
    "compression_blow_off_Ns_per_m": None,
    "friction_N": 37.0,
    "gas_force_N": -288.0,
    "gas_spring_N_per_m": 2840.0,
    "k_N_per_m": 1e7,
}


def knees() -> Knees:
    """One condition whose compression is straight, two clicks, and a test kept back."""
    ends = {
        f"{name}_{end}": value and value + side * abs(value) / 20.0
        for name, value in VALUES.items()
        for end, side in (("low95", -1.0), ("high95", 1.0))
    }
    rest = {"zero_m": 0.0, "reached_m_per_s": 0.2, "W_s": 6e-4, "rmse_N": 7.5, "missed_share": 0.013, "status": "ok"}
    row = KneeRow.model_validate({**PLACE, **VALUES, **ends, **rest})
    forces = [
        KneeForceRow(
            **PLACE, velocity_m_per_s=v, rebound_force_N=r, compression_force_N=c, gas_force_N=-288.0, inside=i
        )
        for v, r, c, i in ((0.131, -92.0, -410.0, 1), (0.262, -7.0, -460.0, 0))
    ]
    click = ClickRow(
        setting="R# C8",
        voltage_V=None,
        temperature_degC=None,
        from_click=3.0,
        to_click=5.0,
        velocity_m_per_s=0.131,
        rebound_N_per_click=21.5,
        compression_N_per_click=0.4,
    )
    predicted = PredictedRow(record="r00", **PLACE, W_s_bingham=0.0085, W_s_knee=0.00085)
    law = LawRow(
        setting="gap 0.25 mm", law="knee", tests=6, W_s_bingham=0.0085, W_s_knee=0.00085, reason="predicts better"
    )
    pressure = UnitRow(
        setting="gas # psi",
        voltage_V=None,
        temperature_degC=None,
        unit="psi",
        from_value=100.0,
        to_value=150.0,
        velocity_m_per_s=0.131,
        rebound_N_per_unit=0.17,
        compression_N_per_unit=0.23,
        gas_force_N_per_unit=-1.37,
    )
    return Knees((row,), tuple(forces), (click,), (predicted,), (law,), (pressure,))


def knock() -> AsItStandsRow:
    return AsItStandsRow(
        record="knock-7",
        **PLACE,
        rebound_force_N=2350.0,
        compression_force_N=-678.0,
        rebound_velocity_m_per_s=1.23,
        compression_velocity_m_per_s=-0.456,
        stroke_m=0.0321,
        duration_s=0.654,
    )


def with_knee(run: Any) -> Any:
    """The run on a damper with the knee law, handed on as it was fitted."""
    damper = Damper(base=run.diagnosed.baseline.base).with_effect(
        "knee", {"beta": 0.4, "F_reb": 900.0, "C_reb": 600.0, "F_comp": 700.0, "C_comp": 500.0}
    )
    diagnosis = run.diagnosed.diagnosis.without_effects("none", "the knee law is handed on", gap=None)
    shown = replace(run.identified.characteristics, as_it_stands=(knock(),))
    return replace(
        run,
        identified=replace(run.identified, knees=knees(), characteristics=shown),
        diagnosed=replace(run.diagnosed, diagnosis=diagnosis, damper=damper, baseline=damper, parameters=()),
    )


@pytest.fixture(scope="module")
def words_only() -> Iterator[None]:
    """No pictures, which take most of the time of a page: all claims here are about its text."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("pzd.report.page.pictures", lambda plots, context, jobs: defaultdict(tuple))
        yield


@pytest.fixture(scope="module")
def page(run, words_only: None, tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("page")
    return with_knee(run).told(folder=folder).page


def test_a_knee_law_that_misses_nothing_visible_has_no_gap_in_the_terminal_nor_on_the_page(page: str, run: Any) -> None:
    lines = diagnosis_lines(with_knee(run).diagnosed.diagnosis, Control())
    assert "gap: not computed, for the knee law misses nothing visible" in lines
    assert "The gap was not computed, for the knee law misses nothing visible." in page
    assert "The knee law misses nothing visible, so that no effect was tried beside it." in page
    assert "could not be measured" not in page


def test_the_page_has_force_knee_bleed_blow_off_gas_and_friction_of_each_direction(page: str) -> None:
    for cell in (
        "rebound",
        "compression",
        "1\u202f530",
        "640",
        "0.085",
        "\u2212288",
        "(\u22127)",
        "\u2212410",
    ):
        assert cell in page
    assert "21.5" in page
    assert "Law of the element that identify chose" in page


def test_the_page_has_the_force_a_psi_and_that_of_the_gas_itself(page: str) -> None:
    for cell in ("gas # psi", "100 to 150\u00a0psi", "0.17\u00a0N/psi", "0.23\u00a0N/psi", "\u22121.37\u00a0N/psi"):
        assert cell in page


def test_the_page_has_the_extremes_of_a_record_that_is_neither_sine_nor_constant_velocity(page: str) -> None:
    ends = ("\u2212678 to 2\u202f350", "\u22120.456 to 1.23")
    for cell in ("knock-7", *ends, "32.1", "0.654"):
        assert cell in page


def terminal(title: str) -> list[tuple[str, ...]]:
    """Heads and rows of a table of the knee law as the terminal has them."""
    (found,) = (table for table in tables.knee(knees(), Control()) if table.title.startswith(title))
    return found.cells(TERMINAL)


def test_the_terminal_has_the_extremes_of_such_a_record_and_the_force_a_psi() -> None:
    (table,) = tables.characteristics(Characteristics(as_it_stands=(knock(),)), Control())
    head, row = table.cells(TERMINAL)
    assert row[head.index("force [N]")] == "-678 to 2350"
    assert row[head.index("velocity [m/s]")] == "-0.456 to 1.23"
    _, row = terminal("Force a unit")
    assert row[-5:] == ("100 to 150 psi", "0.131", "0.17 N/psi", "0.23 N/psi", "-1.37 N/psi")


def test_the_page_does_not_call_a_knee_a_missing_effect(page: str) -> None:
    assert "What is missing from the knee law?" in page
    assert "Nothing that these tests can see" in page
    assert "simple model fails" not in page
    assert "library of effects does not explain" not in page


def test_what_belongs_to_the_law_is_not_among_what_was_added(run: Any) -> None:
    diagnosed = with_knee(run).diagnosed
    with_play = replace(diagnosed, damper=diagnosed.baseline.with_effect("lash", {"delta": 5e-4}))
    models = DamperModels(with_play, ())
    assert (models.added, models.fitted_law, models.extended) == (("lash",), True, True)


def test_without_a_knee_law_the_page_says_nothing_of_it(run, words_only: None, tmp_path: Path) -> None:
    assert "knee" not in run.told(folder=tmp_path).page


def test_the_terminal_has_a_dash_for_the_knee_of_a_direction_that_has_none() -> None:
    head, rebound, _ = terminal("Force at the speeds")
    assert rebound[head.index("at 0.131 m/s [N]")] == "-92"
    assert rebound[head.index("at 0.262 m/s [N]")] == "(-7)"
    head, rebound, compression = terminal("Bleed, knee")
    assert rebound[head.index("knee [m/s]")].startswith("0.085 (")
    assert compression[head.index("knee [N]")] == "-"
    assert terminal("Force a click")[1][-2:] == ("21.5", "0.4")


def test_a_run_without_a_knee_law_prints_no_table_of_it() -> None:
    assert not any(table.lines() for table in tables.knee(Knees(), Control()))
