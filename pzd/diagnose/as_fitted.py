"""The knee law is handed on as identify fitted it: what is said of the damper where no effect is looked for."""

from __future__ import annotations

from pzd.artefacts import Diagnosed, Diagnosis, Identified, KneeRow, ParameterRow, identified_damper
from pzd.diagnose.config import DiagnoseConfig


def as_fitted(identified: Identified, setting: str | None, config: DiagnoseConfig) -> Diagnosed:
    """The damper with the knee law, unchanged: `none` where it misses nothing visible, else `unexplained`.

    Effects are weighed beside one T0 and C; under another law of the element their evidence would mean something else.

    Parameters
    ----------
    identified : with the knee law of the setting
    setting : of the rig's settings, the one in use
    config : what is visible
    """
    rows, damper = identified.knees.of(setting), identified_damper(identified, setting)
    missed = max(row.missed_share for row in rows)
    left = f"it misses up to {missed:.1%} of peak beyond noise" if missed else "it misses nothing beyond noise"
    law = next(row for row in identified.knees.laws if row.setting == setting)
    diagnosis = Diagnosis.without_effects(
        "unexplained" if missed >= config.visible else "none",
        f"the knee law of 2-identify/knee.csv is handed on as it was fitted, and {left}; {law.reason}; no effect was "
        "looked for: identify.law: bingham looks for them, beside one T0 and C",
        gap=None,
    )
    return Diagnosed(diagnosis.model_copy(update={"zero_m": damper.zero_m}), damper, damper, tuple(map(_row, rows)))


def _row(row: KneeRow) -> ParameterRow:
    """T0, C (mean bleed of both directions) and k of one condition."""
    return ParameterRow(
        setting=row.setting,
        voltage_V=row.voltage_V,
        temperature_degC=row.temperature_degC,
        T0_N=row.friction_N,
        T0_N_low95=row.friction_N_low95,
        T0_N_high95=row.friction_N_high95,
        C_Ns_per_m=0.5 * (row.rebound_bleed_Ns_per_m + row.compression_bleed_Ns_per_m),
        C_Ns_per_m_low95=None,
        C_Ns_per_m_high95=None,
        k_N_per_m=row.k_N_per_m,
        k_N_per_m_low95=row.k_N_per_m_low95,
        k_N_per_m_high95=row.k_N_per_m_high95,
        W_s=row.W_s,
        rmse_N=row.rmse_N,
        status="ok" if row.status == "ok" else "weak: T0, C, k (2-identify/knee.csv says why)",
    )
