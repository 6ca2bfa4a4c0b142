"""Every number is told with the digits that its interval supports, and in the unit of the config."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.artefacts import Gap, Identified, ParameterRow
from pzd.cli.diagnosis import diagnosis_lines
from pzd.cli.layout import interval
from pzd.damper.model import BaseRow, Damper
from pzd.diagnose.verdict import weak
from pzd.quantities import Control
from pzd.report import wording
from pzd.report.context import effect_in_words
from pzd.report.sections.damper import parameter
from pzd.schema.wording import supported
from pzd.table.notes import not_monotone
from tests.test_cli import diagnosis

PRESSURE = Control("pressure", "bar")


def row(voltage: float | None, temperature: float | None) -> ParameterRow:
    bounds = {f"{name}{end}": None for name in ("T0_N", "C_Ns_per_m", "k_N_per_m") for end in ("", "_low95", "_high95")}
    return ParameterRow(
        setting=None, voltage_V=voltage, temperature_degC=temperature, W_s=0.1, rmse_N=1.0,
        status="undetermined: T0, C (one speed)", **bounds,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("voltage", "temperature", "told"),
    [
        (50.0, 23.456789012345, "rig, 50 bar, 23.46 degC: "),
        (None, None, "rig: "),
        (None, 20.0, "rig, 20 degC: "),
        (0.0, None, "rig, 0 bar: "),
    ],
)
def test_an_undetermined_row_is_told_by_the_conditions_that_it_has(
    voltage: float | None, temperature: float | None, told: str
) -> None:
    (mark,) = Identified((row(voltage, temperature),), ()).untrusted(PRESSURE)
    assert mark.startswith(told)


def test_a_number_has_the_digits_that_its_interval_supports() -> None:
    assert supported(1234.5678, 1200.0, 1260.0) == "1235"
    assert supported(0.123456, 0.11, 0.13) == "0.123"
    assert supported(-0.0001, -3.0, 3.0) == "0"
    assert supported(1.23456e6, 1.2e6, 1.3e6) == "1.23e+06"
    assert interval(6.3e-25, 0.0, 12.4) == "0 (0 to 12)"
    assert interval(301.23456, 300.71, 301.77) == "301.2 (300.7 to 301.8)"
    assert interval(5.0, 5.0, 5.0) == "5 (5 to 5)"


def test_a_friction_of_nothing_is_zero_on_the_page() -> None:
    assert wording.interval(6.3e-25, 0.0, 12.4) == "0 (0 to 12.4)"
    assert wording.interval(6.3, 0.0, 12.4) == "6.3 (0 to 12.4)"
    assert parameter(6.3e-25) == "0"
    assert parameter(0.25) == "0.25"


def test_what_was_held_out_is_told_in_words() -> None:
    assert weak("records") == ""
    assert "held out were cycles of tests that were also fitted" in weak("cycles")
    assert "mixed" not in weak("mixed")
    assert "held out were some whole tests, and parts of tests" in weak("mixed")


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("records", "(2 records)"),
        ("cycles", "(cycles of 2 records)"),
        ("segments", "(segments of 2 records)"),
        ("mixed", "(2 records, whole or in part)"),
    ],
)
def test_the_story_says_of_how_many_records_something_was_held_out(kind: str, told: str) -> None:
    gap = Gap.model_validate({**diagnosis().gap.model_dump(), "hold_out": kind})
    lines = diagnosis_lines(diagnosis().model_copy(update={"gap": gap}), Control())
    assert told in lines[2]


def test_a_delay_of_either_sign_is_told_without_saying_which_channel_is_late() -> None:
    words = effect_in_words("sensor_delay")
    assert "late" not in words
    assert "different instants" in words


def test_the_table_is_about_the_control_of_the_config() -> None:
    falls = Damper(base=tuple(BaseRow(voltage_V=u, T0_N=100.0 - u, C_Ns_per_m=1e3, k_N_per_m=1e5) for u in (0.0, 50.0)))
    dips = falls.model_copy(update={"base": (*falls.base, BaseRow(voltage_V=90.0, T0_N=300.0, C_Ns_per_m=1e3,
                                                                  k_N_per_m=1e5))})  # fmt: skip
    speeds = np.array([-1.0, -0.0, 0.0, 1.0])
    notes = not_monotone(dips, (None,), speeds, PRESSURE)
    assert notes
    assert all("from 0 to 50 bar; the lowest pressure that gives the force is taken" in note for note in notes)
