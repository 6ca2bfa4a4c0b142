"""Dampers of every kind that a run may hand on, each with its table, as the formats are given them."""

from __future__ import annotations

from typing import Any

import numpy as np

from pzd.artefacts import Table, TableNotes
from pzd.damper.model import BaseRow, Damper
from pzd.export.content import Content
from pzd.force_table.config import TableConfig
from pzd.force_table.force import OperatingEnvelope, force_rows, grid, temperatures_of, voltages_of
from pzd.force_table.lookup import inverse_rows
from pzd.quantities import Control
from pzd.simulate.cars import cars

POINTS = 2000
"""Points at which a second implementation is held to ours."""


def base(*rows: tuple[float | None, float | None, float, float, float]) -> tuple[BaseRow, ...]:
    """Rows of voltage, temperature, T0, C and k."""
    return tuple(BaseRow(voltage_V=U, temperature_degC=T, T0_N=a, C_Ns_per_m=b, k_N_per_m=c) for U, T, a, b, c in rows)


CONTROLLED = base(
    (0.0, 22.0, 301.0, 2720.0, 199e3), (50.0, 22.0, 357.0, 3310.0, 359e3), (150.0, 22.0, 1325.0, 2550.0, 423e3)
)
DAMPERS = {
    "plain": Damper(base=CONTROLLED),
    "orifice": Damper(base=CONTROLLED, effects={"orifice_quadratic": {"q": 2500.0}, "asymmetry": {"alpha": 0.2}}),
    "warm": Damper(
        base=base(
            (0.0, 20.0, 300.0, 2700.0, 2e5),
            (0.0, 60.0, 250.0, 2000.0, 1.8e5),
            (150.0, 20.0, 1300.0, 2500.0, 4e5),
            (150.0, 60.0, 1000.0, 2100.0, 3.6e5),
        )
    ),
    "single": Damper(base=CONTROLLED[1:2]),
    "passive": Damper(base=base((None, None, 60.0, 1900.0, 3e5)), effects={"asymmetry": {"alpha": 0.4}}),
}
"""Of one temperature and of two, with effects, and with one control signal or none."""


def content_of(damper: Damper, **table: Any) -> Content:
    """What is exported of a damper whose rig reached 0.6 m/s."""
    config = TableConfig(**table)
    temperatures, voltages = temperatures_of(damper), voltages_of(damper)
    envelope = OperatingEnvelope(
        np.array([t or 0.0 for t in temperatures]),
        np.array([u or 0.0 for u in voltages]),
        np.full((len(temperatures), len(voltages)), 0.6),
    )
    notes = TableNotes(outside=config.outside, reached_m_per_s=0.6, lost=(), not_monotone=())
    rows = force_rows(config, damper, grid(config, damper, temperatures, envelope), envelope)
    forward = Table(rows, (), notes)
    return Content(
        name="my-run",
        version="0.1.0",
        config="my-run.yaml",
        control=Control(),
        damper=damper,
        table=Table(rows, inverse_rows(config, forward), notes),
        force_levels=config.force_levels,
        car=cars()["makowski2021"],
        tie_break="equal_share",
    )


def largest(content: Content) -> float:
    """The largest force of a table [N]."""
    return float(np.nanmax(np.abs(content.grid.forces)))
