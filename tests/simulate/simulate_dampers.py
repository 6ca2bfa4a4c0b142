"""A damper after Table 2 of the paper, and its table, without the stages that make them."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import ForceRow, Table, TableNotes
from pzd.damper.compose import steady_force
from pzd.damper.model import BaseRow, Damper

TABLE_2 = (
    (0.0, 301.0, 2720.0, 199e3),
    (50.0, 356.0, 3300.0, 358e3),
    (100.0, 796.0, 3040.0, 375e3),
    (150.0, 1325.0, 2560.0, 423e3),
)
"""Voltage [V], T0 [N], C [N s/m], k [N/m]."""


def damper_after_table_2() -> Damper:
    return Damper(
        base=tuple(
            BaseRow(voltage_V=u, temperature_degC=22.0, T0_N=t, C_Ns_per_m=c, k_N_per_m=k) for u, t, c, k in TABLE_2
        )
    )


def table_of(damper: Damper, outside: str = "model", reached: float = 0.4, top: float = 1.2) -> Table:
    speeds = np.linspace(0.0, top, 25)
    velocity = np.concatenate([-speeds[::-1], speeds])
    rows = []
    for voltage in sorted({row.voltage_V for row in damper.base}, key=lambda u: u or 0.0):
        asked = np.copysign(np.minimum(np.abs(velocity), reached if outside == "clamp" else np.inf), velocity)
        for v, force in zip(velocity, steady_force(damper, voltage, 22.0, asked), strict=True):
            inside = abs(v) <= reached
            rows.append(
                ForceRow(
                    temperature_degC=22.0,
                    voltage_V=voltage,
                    velocity_m_per_s=float(v),
                    force_N=float(force) if inside or outside != "error" else None,
                    inside=1 if inside else 0,
                )
            )
    notes = TableNotes(outside=outside, reached_m_per_s=reached, lost=(), not_monotone=())
    return Table(tuple(rows), (), notes)
