"""Runs beside one another: a difference is told as what it is, and as one only beyond what two measurements scatter."""

from __future__ import annotations

from dataclasses import replace
from html import unescape

import numpy as np
import pytest

from pzd.artefacts import ComfortRow, ForceRow, ParameterRow
from pzd.artefacts.csv_rows import Estimate
from pzd.artefacts.identified import PeakVelocityRow
from pzd.damper.compose import steady_force
from pzd.damper.model import BaseRow, Damper
from pzd.quantities import Control
from pzd.report.runs_page import ComparedRun, beyond, matched, runs_page

VELOCITIES = np.concatenate([-np.linspace(0.4, 0.0, 9), np.linspace(0.0, 0.4, 9)])


def compared(
    name: str,
    friction: float,
    half_width: float = 5.0,
    control: Control | None = None,
    preload: float = 0.0,
    volts: float = 100.0,
) -> ComparedRun:
    """A run on a damper of this friction at 0 and some 100 V, T0 known to so much; a rig feels its preload."""
    control = control or Control()
    base = tuple(
        BaseRow(voltage_V=u, temperature_degC=22.0, T0_N=friction + u, C_Ns_per_m=2000.0, k_N_per_m=2e5)
        for u in (0.0, volts)
    )
    damper = Damper(base=base)
    if preload:
        damper = damper.with_effect("preload_offset", {"F_0": preload})
    rows = tuple(
        ParameterRow.model_validate(
            {
                "setting": None,
                "voltage_V": row.voltage_V,
                "temperature_degC": 22.0,
                **Estimate.around(row.T0_N, half_width).columns("T0_N"),
                **Estimate.around(2000.0, 50.0).columns("C_Ns_per_m"),
                **Estimate(None).columns("k_N_per_m"),
                "W_s": 0.001,
                "rmse_N": 10.0,
                "status": "ok",
            }
        )
        for row in base
    )
    force = tuple(
        ForceRow(
            temperature_degC=22.0,
            voltage_V=row.voltage_V,
            velocity_m_per_s=v,
            force_N=float(steady_force(damper, row.voltage_V, 22.0, v)),
            inside=1,
        )
        for row in base
        for v in VELOCITIES.tolist()
    )
    test = PeakVelocityRow(
        record="r1", setting=None, voltage_V=0.0, temperature_degC=22.0, kind="sine", frequency_Hz=2.0,
        amplitude_m=0.03, middle_m=0.0, rebound_velocity_m_per_s=0.377, rebound_force_N=1000.0,
        compression_velocity_m_per_s=None, compression_force_N=None,
    )  # fmt: skip
    ride = ComfortRow(
        case="sine-passive-dynamic", point="K", edition="ISO 2631-1:1997", measure="a_w", value=friction / 100.0,
        unit="m/s2", status="verified",
    )  # fmt: skip
    return ComparedRun(name, control, rows, None, damper, force, (test,), (ride,))


def text_of(*runs: ComparedRun) -> str:
    return unescape(runs_page(runs)).replace("\u00a0", " ").replace("\u202f", " ").replace("\u2212", "-")


def test_of_two_measurements_of_one_value_a_twentieth_is_told_apart(rng: np.random.Generator) -> None:
    """For intervals that are not alike as well: one three times as wide as the other."""
    drawn = rng.normal(size=(40_000, 2)) * (1.0, 3.0) + 500.0
    told = [beyond(Estimate.around(a, 1.96), Estimate.around(b, 3.0 * 1.96)) for a, b in drawn.tolist()]
    assert np.mean(told) == pytest.approx(0.05, abs=4.0 * np.sqrt(0.05 * 0.95 / len(told)))


@pytest.mark.parametrize(
    ("one", "other", "told"),
    [
        (Estimate(1.0, 0.9, 1.5), Estimate(1.4, 1.3, 1.41), False),  # towards one another: 0.5 and 0.1
        (Estimate(1.4, 1.3, 1.41), Estimate(1.0, 0.9, 1.5), False),
        (Estimate(1.0, 0.2, 1.1), Estimate(1.4, 1.3, 1.9), True),  # away from one another they may be wide
        (Estimate(1.0), Estimate(9.0, 8.0, 9.5), None),
        (Estimate(None), Estimate(9.0, 8.0, 9.5), None),
    ],
)
def test_an_interval_counts_on_the_side_of_the_other_value(one: Estimate, other: Estimate, told: bool | None) -> None:
    assert beyond(one, other) is told


def test_what_differs_beyond_the_intervals_leads_the_page() -> None:
    page = text_of(compared("new", 300.0), compared("worn", 330.0))
    assert "Where does worn differ from new?" in page
    assert "T0 (up to +10 %)" in page
    assert "C (up to" not in page
    assert "The curves differ by up to 30 N" in page
    rows = page.partition('aria-label="T0"')[2].partition("</table>")[0].split("<tr>")
    assert [("0 V" in row, ">10, beyond<" in row) for row in rows[2:3]] == [(True, True)]
    assert "sine-passive-dynamic" in page


def test_what_the_intervals_cover_is_no_difference() -> None:
    page = text_of(compared("new", 300.0, half_width=40.0), compared("worn", 330.0, half_width=40.0))
    assert "Nothing beyond the intervals" in page
    assert ">10, within<" in page
    assert ", beyond<" not in page


def test_a_preload_that_the_table_leaves_to_the_balance_is_seen_in_the_curves() -> None:
    page = text_of(compared("new", 300.0), compared("worn", 300.0, preload=80.0))
    assert "The curves differ by up to 80 N" in page


def test_voltages_of_a_supply_that_scatters_are_one_and_those_of_another_signal_are_not() -> None:
    near = text_of(compared("a", 300.0), compared("b", 300.0, volts=101.0))
    assert near.count("Force over velocity at ") == 2
    apart = text_of(compared("a", 300.0), compared("b", 300.0, volts=110.0))
    assert apart.count("Force over velocity at ") == 3
    ampere = text_of(compared("a", 300.0), compared("b", 300.0, control=Control("current", "A")))
    assert ampere.count("Force over velocity at ") == 4
    assert "100 A" in ampere


def test_settings_count_where_a_run_has_several_and_none_is_lost() -> None:
    one, other = compared("a", 300.0), compared("b", 300.0)

    def at(run: ComparedRun, *settings: str) -> ComparedRun:
        rows = [row for row in run.parameters if isinstance(row, ParameterRow)]
        return replace(run, parameters=tuple(row.model_copy(update={"setting": s}) for s in settings for row in rows))

    def places(*runs: ComparedRun) -> list[tuple[str | None, float | None, list[str]]]:
        return [(p.setting, p.voltage, list(p.rows)) for p in matched(runs, lambda run: run.parameters)]

    assert places(at(one, "soft"), other) == [(None, 0.0, ["a", "b"]), (None, 100.0, ["a", "b"])]
    assert places(at(one, "soft", "hard"), at(other, "soft")) == [
        ("hard", 0.0, ["a"]), ("hard", 100.0, ["a"]), ("soft", 0.0, ["a", "b"]), ("soft", 100.0, ["a", "b"]),
    ]  # fmt: skip


def test_a_run_without_a_table_is_told_by_its_parameters_alone() -> None:
    other = compared("b", 330.0)
    bare = ComparedRun("b", other.control, other.parameters, None, None, (), (), ())
    page = text_of(compared("a", 300.0), bare)
    assert "No other run has it." in page
    assert "T0 (up to +10 %)" in page
    curve = ComparedRun("curve", other.control, (), None, None, other.force, (), ())
    assert "No parameter is known of both" in text_of(bare, curve)
    assert "No run has a table of force" in text_of(bare, ComparedRun("c", bare.control, (), None, None, (), (), ()))


def test_of_more_runs_each_is_compared_with_the_first() -> None:
    page = text_of(compared("a", 300.0), compared("b", 330.0), compared("c", 270.0))
    assert "Where does b differ from a?" in page
    assert "Where does c differ from a?" in page
    assert "T0 (up to -10 %)" in page
