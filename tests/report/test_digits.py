"""Every number has the digits that its interval supports, and the unit of the config."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.artefacts import Characteristics, Gap, Identified, ParameterRow
from pzd.artefacts.identified import GasAndFrictionRow, PeakVelocityRow
from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.verdict import hold_out_note
from pzd.force_table.force import lost, not_monotone
from pzd.quantities import Control
from pzd.report import tables
from pzd.report.columns import PAGE, TERMINAL
from pzd.report.damper_models import effect_in_words
from pzd.report.diagnosis_text import diagnosis_lines
from pzd.schema.errors import supported
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
def test_the_mark_of_an_undetermined_row_names_the_conditions_that_it_has(
    voltage: float | None, temperature: float | None, told: str
) -> None:
    (mark,) = Identified((row(voltage, temperature),), ()).untrusted(PRESSURE)
    assert mark.startswith(told)


def test_a_number_has_the_digits_that_its_interval_supports() -> None:
    assert supported(1234.5678, 1200.0, 1260.0) == "1235"
    assert supported(0.123456, 0.11, 0.13) == "0.123"
    assert supported(-0.0001, -3.0, 3.0) == "0"
    assert supported(1.23456e6, 1.2e6, 1.3e6) == "1.23e+06"


@pytest.mark.parametrize(("friction", "shown"), [(6.3e-25, "0 (no interval)"), (0.25, "0.25 (no interval)")])
def test_an_edited_friction_below_what_a_load_cell_shows_is_zero(friction: float, shown: str) -> None:
    base = BaseRow(T0_N=friction, C_Ns_per_m=1e3, k_N_per_m=1e5)
    assert tables.parameters([base], Control()).block().rows[0][0] == shown


def static(gas: float) -> Characteristics:
    """A friction of 120.34 N beside a gas force, read from forces of 445.67 N."""
    place = {"setting": None, "voltage_V": None, "temperature_degC": None}
    tests = tuple(
        PeakVelocityRow(
            record="r", kind="sine", frequency_Hz=1.0, amplitude_m=0.025, middle_m=0.0, **place,
            rebound_velocity_m_per_s=speed, rebound_force_N=force + gas,
            compression_velocity_m_per_s=-speed, compression_force_N=gas - force,
        )
        for speed, force in ((0.131, 445.67), (0.524, 1063.5))
    )  # fmt: skip
    row = GasAndFrictionRow(gas_force_N=gas, friction_N=120.34, velocity_m_per_s=0.131, middle_m=0.0,
                            method="extrapolated to rest", **place)  # fmt: skip
    return Characteristics(peak_velocity=tests, gas_and_friction=(row,))


@pytest.mark.parametrize(
    ("gas", "printed", "drawn"),
    [(0.0235, ("0", "120.3"), ("0", "120")), (-0.04, ("0", "120.3"), ("0", "120")),
     (90.24, ("90.2", "120.3"), ("90", "120"))],
)  # fmt: skip
def test_a_static_force_has_the_digits_of_the_forces_that_it_was_read_from(
    gas: float, printed: tuple[str, str], drawn: tuple[str, str]
) -> None:
    *_, table = tables.characteristics(static(gas), Control())
    assert table.cells(TERMINAL)[1][:2] == printed
    assert tuple(cell.replace("\xa0N", "") for cell in table.cells(PAGE)[1][:2]) == drawn


def test_weak_evidence_says_what_was_held_out() -> None:
    assert hold_out_note("records") == ""
    assert "held out were cycles of tests that were also fitted" in hold_out_note("cycles")
    assert "mixed" not in hold_out_note("mixed")
    assert "held out were some whole tests, and parts of tests" in hold_out_note("mixed")


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("records", "(2 records)"),
        ("cycles", "(cycles of 2 records)"),
        ("segments", "(segments of 2 records)"),
        ("mixed", "(2 records, whole or in part)"),
    ],
)
def test_the_line_on_the_gap_says_of_how_many_records_something_was_held_out(kind: str, told: str) -> None:
    gap = Gap.model_validate({**diagnosis().gap.model_dump(), "hold_out": kind})
    lines = diagnosis_lines(diagnosis().model_copy(update={"gap": gap}), Control())
    assert told in lines[2]


def test_the_words_for_a_sensor_delay_leave_open_which_channel_is_late() -> None:
    words = effect_in_words("sensor_delay")
    assert "late" not in words
    assert "delay between" in words


def test_notes_of_the_force_table_name_the_control_of_the_config() -> None:
    falls = Damper(base=tuple(BaseRow(voltage_V=u, T0_N=100.0 - u, C_Ns_per_m=1e3, k_N_per_m=1e5) for u in (0.0, 50.0)))
    dips = falls.model_copy(update={"base": (*falls.base, BaseRow(voltage_V=90.0, T0_N=300.0, C_Ns_per_m=1e3,
                                                                  k_N_per_m=1e5))})  # fmt: skip
    speeds = np.array([-1.0, -0.0, 0.0, 1.0])
    notes = not_monotone(dips, (None,), speeds, PRESSURE)
    assert notes
    assert all("from 0 to 50 bar; the lowest pressure that gives the force is taken" in note for note in notes)


def test_notes_of_the_force_table_give_a_reason_for_each_effect_that_it_leaves_out() -> None:
    row = BaseRow(T0_N=300.0, C_Ns_per_m=1800.0, k_N_per_m=4e5)
    effects = {"preload_offset": {"F_0": 90.0}, "gas_spring": {"k_g": 3e3}, "orifice_quadratic": {"q": 500.0}}
    assert lost(Damper(base=(row,), effects=effects), (None,), np.array([-1.0, -0.0, 0.0, 1.0])) == (
        "memory of the oil spring k: the force lags by C/k = 4.5 ms",
        "preload_offset: F_0 (it acts at rest too, and is left to the static balance)",
        "gas_spring: k_g x (steady slip does not show it)",
    )
    two = (row, row.model_copy(update={"voltage_V": 150.0, "C_Ns_per_m": 3600.0}))
    assert lost(Damper(base=two), (None,), np.array([-1.0, 1.0]))[0].endswith("C/k = 4.5 to 9 ms")
