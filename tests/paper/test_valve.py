"""The valve behind the virtual stand: its physics, its calibration, and the config that is written from it."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from pathlib import Path

import pytest
from calibrated_valve import VALVE

from pzd.config import load
from pzd.damper.model import Damper
from pzd.paper.__main__ import written
from pzd.paper.published import LARGE_GAP, PEAK, SMALL_GAP, loop_in, loop_of, published, rig_tests, span
from pzd.paper.valve import STIFFNESS, Valve, calibrate, flow_force, least_stiffness, stand_damper
from pzd.report.reference import Expected

LAMINAR = replace(VALVE, turbulent=0.0, compliance=0.0, zero_error=0.0)
FULL_STROKE = 85e-6
"""Free stroke of the stack at 150 V by its maker [m]."""


@pytest.fixture(scope="module")
def valve() -> Valve:
    return calibrate()


def test_a_rigid_laminar_slot_gives_force_over_the_cube_of_its_width() -> None:
    narrow, wide = (flow_force(LAMINAR, setting, 0.0, 22.0, 0.1) for setting in (SMALL_GAP, LARGE_GAP))
    assert narrow / wide == pytest.approx((0.25 / 0.15) ** 3, rel=1e-9)
    assert wide == pytest.approx(LAMINAR.laminar * 0.1 / 0.25e-3**3, rel=1e-9)


def test_a_rigid_turbulent_slot_gives_force_over_the_square_of_its_width_and_of_the_speed() -> None:
    turbulent = replace(LAMINAR, laminar=0.0, turbulent=VALVE.turbulent)
    narrow, wide = (flow_force(turbulent, setting, 0.0, 22.0, 0.1) for setting in (SMALL_GAP, LARGE_GAP))
    assert narrow / wide == pytest.approx((0.25 / 0.15) ** 2, rel=1e-9)
    assert flow_force(turbulent, SMALL_GAP, 0.0, 22.0, 0.3) == pytest.approx(9.0 * narrow, rel=1e-9)


def test_a_slot_that_pressure_opens_gives_less_than_proportional_forces() -> None:
    soft = replace(LAMINAR, compliance=VALVE.compliance)
    slow, fast = (flow_force(soft, SMALL_GAP, 150.0, 22.0, speed) for speed in (0.05, 0.1))
    assert 1.3 < fast / slow < 1.9


def test_the_full_stroke_of_the_stack_would_raise_the_force_twelve_and_three_and_a_half_times() -> None:
    full = replace(LAMINAR, stroke_150=FULL_STROKE)
    rises = [
        flow_force(full, setting, 150.0, 22.0, 0.1) / flow_force(full, setting, 0.0, 22.0, 0.1)
        for setting in (SMALL_GAP, LARGE_GAP)
    ]
    assert rises == pytest.approx([12.3, 3.48], rel=0.01)


@pytest.mark.parametrize("row", [row for row in rig_tests() if row.quantity == PEAK], ids=lambda row: row.id)
def test_the_calibrated_peaks_are_the_published_ones(row: Expected, valve: Valve) -> None:
    low, high = span(row)
    peak = loop_in(stand_damper(valve, row.setting or ""), row).peak
    assert low * (0.99 if low == high else 1.0) <= peak <= high * (1.01 if low == high else 1.0)


@pytest.mark.parametrize("name", ["F8z-23", "F8z-43"])
def test_the_calibrated_forces_at_zero_velocity_are_the_published_ones(name: str, valve: Valve) -> None:
    row = published()[name]
    assert loop_in(stand_damper(valve, LARGE_GAP), row).force_at_rest == pytest.approx(row.number, rel=2e-3)


def test_the_stack_closes_the_slot_by_less_than_its_maker_states(valve: Valve) -> None:
    assert 0.0 < valve.stroke_50 < valve.stroke_100 < valve.stroke_100_small < valve.stroke_150 < FULL_STROKE
    assert valve.stroke_150 == pytest.approx(59.7e-6, rel=0.01)
    # Stacks show a hysteresis of 10 to 15 % of their stroke.
    assert valve.stroke_100_small - valve.stroke_100 < 0.15 * valve.stroke_150


def test_friction_and_viscosity_fall_at_rates_of_their_own(valve: Valve) -> None:
    assert math.log(170 / 75) / 20 == pytest.approx(0.041, abs=5e-4)
    assert valve.friction_fall == pytest.approx(0.058, rel=0.02)
    assert valve.viscosity_fall == pytest.approx(0.0061, rel=0.02)


def test_the_valve_in_use_is_the_calibrated_one(valve: Valve) -> None:
    assert asdict(VALVE) == pytest.approx(asdict(valve), rel=2e-3)


def test_the_config_holds_the_dampers_of_the_valve(root: Path) -> None:
    text = (root / "configs" / "paper.yaml").read_text(encoding="utf-8")
    lines = {line.strip() for line in text.splitlines()} | {line.split("#")[0].strip() for line in text.splitlines()}
    assert [line for line in written(VALVE).splitlines() if line.strip() not in lines] == []


def test_the_published_forces_bound_the_oil_spring_from_below_only() -> None:
    least = least_stiffness()
    assert least["F8z-43"] == pytest.approx(7.63e5, rel=0.01)
    assert max(least.values()) < STIFFNESS
    row = published()["F8z-43"]
    for stiffness in (least["F8z-43"], 1e7):
        element = Damper(base=({"T0_N": 0.0, "C_Ns_per_m": 1310 / 0.377, "k_N_per_m": stiffness},))
        loop = loop_of(element, row.frequency_Hz or 0.0, row.amplitude_m or 0.0, None, None)
        assert loop.force_at_rest < 1.01 * row.number


def test_the_config_runs_the_tests_of_every_published_force(root: Path) -> None:
    entries = load(root / "configs" / "paper.yaml").rig.virtual or ()
    taken = {
        (entry.setting, planned.voltage, planned.temperature, planned.test.waveform.name)
        for entry in entries
        for planned in entry.plan()
    }
    wanted = {
        (r.setting, r.voltage_V, r.temperature_degC, f"sine-{r.frequency_Hz:g}Hz-{r.amplitude_m:g}m")
        for r in rig_tests()
    }
    assert wanted <= taken
