"""What a real damper leaves of Figure 19: peaks by table and with dynamics, for both gaps, as the README has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest

from pzd.artefacts import Identified, ReferenceRow, Rig, base_of
from pzd.config import RunConfig
from pzd.paper.figures.sources import SettingRides, rides_on
from pzd.paper.published import LARGE_GAP, SMALL_GAP
from pzd.quantities import Control

PEAKS = {
    (LARGE_GAP, "table"): (2.00, 2.40),
    (LARGE_GAP, "dynamic"): (2.02, 2.50),
    (SMALL_GAP, "table"): (2.46, 3.99),
    (SMALL_GAP, "dynamic"): (2.68, 4.13),
}
"""Controlled peaks at 2.25 and 4.5 Hz [m/s2]."""
LEAST_DAMPING = {LARGE_GAP: 3497.0, SMALL_GAP: 16688.0}
"""Smallest force over speed at any voltage [N s/m]."""


@pytest.fixture(scope="module")
def rides_by_gap(config: RunConfig, rig: Rig, identified: Identified) -> Mapping[str, SettingRides]:
    real = config.simulate.model_copy(update={"policies": ("comfort",), "fidelities": ("table", "dynamic")})
    found = {}
    for gap in (LARGE_GAP, SMALL_GAP):
        mine = replace(rig, records=tuple(record for record in rig.records if record.setting == gap))
        found[gap] = rides_on(base_of(identified.rows, gap), gap, mine, real, config.table, Control())
    return found


@pytest.mark.ci
@pytest.mark.parametrize(("gap", "fidelity"), PEAKS)
def test_controlled_peaks_of_a_real_damper(rides_by_gap: Mapping[str, SettingRides], gap: str, fidelity: str) -> None:
    rows = [row for row in rides_by_gap[gap].rides.summary if row.fidelity == fidelity]
    assert [row.peak_abs_aK_m_per_s2 for row in rows] == pytest.approx(PEAKS[gap, fidelity], rel=0.01)


@pytest.mark.ci
@pytest.mark.parametrize("gap", LEAST_DAMPING)
def test_no_voltage_is_as_soft_as_c_min(rides_by_gap: Mapping[str, SettingRides], config: RunConfig, gap: str) -> None:
    assert rides_by_gap[gap].least_damping == pytest.approx(LEAST_DAMPING[gap], rel=0.01)
    assert rides_by_gap[gap].least_damping > 4.0 * config.simulate.c_min_Ns_per_m


@pytest.mark.ci
def test_the_smaller_gap_is_harder_than_constant_c(
    rides_by_gap: Mapping[str, SettingRides], beside: dict[str, ReferenceRow]
) -> None:
    constant = (beside["F19a-c"].computed, beside["F19b-c"].computed)
    rows = [row for row in rides_by_gap[SMALL_GAP].rides.summary if row.fidelity == "table"]
    assert all(peak is not None and row.peak_abs_aK_m_per_s2 > peak for row, peak in zip(rows, constant, strict=True))


def test_by_the_table_the_exposure_time_grows_to_minutes_at_most(beside: dict[str, ReferenceRow]) -> None:
    assert "table 4." in beside["EXPa-ctrl"].note
    assert "table 0 min" in beside["EXPb-ctrl"].note
