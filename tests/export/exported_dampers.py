"""Dampers of every kind that a run may hand on, each with its table, as the formats are given them."""

from __future__ import annotations

from typing import Any

import numpy as np

from pzd.artefacts import Table, TableNotes
from pzd.damper.model import BaseRow, Damper
from pzd.export.content import Content
from pzd.force_table.config import TableConfig
from pzd.force_table.force import ReachedSpeeds, force_rows, grid, temperatures_of, voltages_of
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


def with_effects(damper: Damper, **effects: dict[str, Any]) -> Damper:
    """The damper with effects beside its own."""
    return Damper(
        base=damper.base, effects={**damper.effects, **effects}, reference_temperature_degC=30.0, zero_m=0.004
    )


BESIDE = {
    "fluid_inertia": {"m": 12.0},
    "gas_spring": {"k_g": 3000.0},
    "preload_offset": {"F_0": -80.0},
    "accumulator": {"F_g": 250.0, "L": 0.04},
    "end_stop": {"k_e": 3e4, "x_e": 0.02},
    "stribeck_friction": {"F_s": 120.0, "v_s": 0.05},
    "position_damping": {"c_p": 250.0, "x_p": 0.004, "b_p": 0.03},
    "second_branch": {"T0_2": (60.0, 300.0), "k_2": (9e4, 4e4), "at_voltage_V": (0.0, 150.0)},
}
IN_THE_FLOW = {
    "asymmetry": {"alpha": -0.3},
    "viscous_asymmetry": {"alpha_C": 0.25},
    "orifice_quadratic": {"q": (1500.0, 4000.0), "at_voltage_V": (0.0, 120.0)},
    "relief_valve": {"F_r": 900.0, "C_r": 800.0},
}
KNEE = {"beta": 0.4, "F_reb": 950.0, "C_reb": 700.0, "F_comp": 800.0, "C_comp": 400.0}
EXPORTED = {
    "plain": DAMPERS["plain"],
    "passive": DAMPERS["passive"],
    "single": DAMPERS["single"],
    "warm": DAMPERS["warm"],
    "frictionless": Damper(base=tuple(row.model_copy(update={"T0_N": 0.0}) for row in CONTROLLED)),
    "stiff": Damper(base=tuple(row.model_copy(update={"k_N_per_m": 1e9}) for row in CONTROLLED)),
    "orifice": with_effects(DAMPERS["plain"], orifice_quadratic={"q": 2500.0}),
    "relief": with_effects(DAMPERS["plain"], relief_valve={"F_r": 1000.0, "C_r": 500.0}),
    "knee": with_effects(
        DAMPERS["plain"],
        knee=KNEE | {"q_reb": 9000.0, "q_comp": 4000.0, "s_reb": 60.0, "s_comp": 25.0},
        seal={"F_s": 30.0, "v_s": 2e-3},
    ),
    "knee and relief": with_effects(DAMPERS["plain"], knee=KNEE, **IN_THE_FLOW),
    "lash": with_effects(DAMPERS["plain"], lash={"delta": 8e-4}),
    "play": with_effects(DAMPERS["plain"], piezo_hysteresis={"r": 12.0}),
    "drift": with_effects(DAMPERS["plain"], temperature_drift={"beta_T0": 0.01, "beta_C": 0.02}),
    "beside": with_effects(DAMPERS["plain"], **BESIDE),
    "lag": with_effects(DAMPERS["plain"], valve_lag={"tau": 0.004}),
    "lag and play": with_effects(DAMPERS["plain"], valve_lag={"tau": 0.02}, piezo_hysteresis={"r": 9.0}),
    "rounded": with_effects(DAMPERS["plain"], rounded_yield={"w_s": 0.02}),
    "rounded and orifice": with_effects(DAMPERS["plain"], rounded_yield={"w_s": 0.1}, **IN_THE_FLOW),
    "thinning": with_effects(DAMPERS["plain"], shear_thinning={"n": 0.7}),
    "thinning and rounded": with_effects(
        DAMPERS["plain"], shear_thinning={"n": (0.5, 0.9), "at_voltage_V": (0.0, 100.0)}, rounded_yield={"w_s": 0.03}
    ),
    "hysteresis": with_effects(DAMPERS["plain"], bouc_wen={"F_h": 150.0, "x_h": 2e-3, "sigma": 1.5}),
    "pocket": with_effects(DAMPERS["plain"], cavitation={"d_c": 2e-3, "F_c": 80.0}),
    "pocket in compression": with_effects(DAMPERS["plain"], cavitation={"d_c": -1e-3, "F_c": 400.0}),
    "frame": with_effects(DAMPERS["plain"], frame_compliance={"d_f": 8e-4, "F_f": 60.0}),
    "joint": with_effects(DAMPERS["plain"], preload_offset={"F_0": -250.0}, mount_play={"delta": 6e-4, "F_m": 250.0}),
    "rigid": Damper(base=tuple(row.model_copy(update={"k_N_per_m": np.inf}) for row in CONTROLLED)),
    "elasto-plastic": Damper(base=tuple(row.model_copy(update={"C_Ns_per_m": 0.0}) for row in CONTROLLED)),
    "rig": with_effects(DAMPERS["plain"], sensor_delay={"tau": 0.002}),
    "all": with_effects(
        DAMPERS["warm"],
        **BESIDE,
        **IN_THE_FLOW,
        lash={"delta": 3e-4},
        cavitation={"d_c": 3e-4, "F_c": 80.0},
        frame_compliance={"d_f": 4e-4, "F_f": 60.0},
        mount_play={"delta": 2e-4, "F_m": -150.0},
        bouc_wen={"F_h": 90.0, "x_h": 1e-3, "sigma": 0.8},
        rounded_yield={"w_s": 0.01},
        shear_thinning={"n": 0.9},
        valve_lag={"tau": 0.01},
        piezo_hysteresis={"r": 5.0},
        temperature_drift={"beta_T0": 0.004, "beta_C": (0.01, 0.002), "at_voltage_V": (0.0, 150.0)},
    ),
}
"""Together they have every effect of the library, each alone and all at once."""
EXPORTED["all but the lag"] = EXPORTED["all"].without_effects("valve_lag")


def content_of(damper: Damper, **table: Any) -> Content:
    """What is exported of a damper whose rig reached 0.6 m/s."""
    config = TableConfig(**table)
    temperatures, voltages = temperatures_of(damper), voltages_of(damper)
    envelope = ReachedSpeeds(
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
