"""The numbers that the paper prints, each with its id: measured, identified, simulated, stated, claimed, and inputs."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from pzd.damper.model import BaseRow
from pzd.quantities import Control
from pzd.report.reference import SHIPPED, Expected, range_of, read_reference

SMALL_GAP, LARGE_GAP = "gap 0.15 mm", "gap 0.25 mm"
"""The two settings of the valve that the paper tested."""
PEAK, AT_ZERO = "peak_force", "force_at_zero_velocity"
"""Quantities that a test of the damper gives."""
TABLES = {"Table 1": (SMALL_GAP, 22.0), "Table 2": (LARGE_GAP, 22.0), "Table 3": (LARGE_GAP, 43.0)}
"""Setting and temperature of each table of identified parameters."""


WARM_DEGC = 30.0
"""Above this a test counts as the warm one of 43 degC, below it as one of those at 22 and 23 degC [degC]."""


@cache
def published() -> Mapping[str, Expected]:
    """Every published number by its id, in the order of the file."""
    return {row.id: row for row in read_reference(SHIPPED["makowski2021"], Control())}


def rig_tests() -> tuple[Expected, ...]:
    """The measured forces of Figures 4, 5, 6, 8 and 9."""
    return tuple(row for row in published().values() if row.quantity in (PEAK, AT_ZERO))


def table_damper(table: str) -> tuple[BaseRow, ...]:
    """The parameters of one of the paper's tables, by voltage.

    Parameters
    ----------
    table : `Table 1`, `Table 2` or `Table 3`
    """
    rows = [row for row in published().values() if row.figure_or_table == table]
    voltages = sorted({row.voltage_V or 0.0 for row in rows})
    by = {(row.voltage_V or 0.0, row.quantity): row.number for row in rows}
    return tuple(BaseRow(voltage_V=u, T0_N=by[u, "T0"], C_Ns_per_m=by[u, "C"], k_N_per_m=by[u, "k"]) for u in voltages)


def span(row: Expected) -> tuple[float, float]:
    """Smallest and largest number that the paper prints for the test of this row."""
    return range_of(row, rig_tests())
