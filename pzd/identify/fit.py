"""One condition: the fit by the method named, its intervals, and the row that says what to believe."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.artefacts import ParameterRow
from pzd.identify.config import IdentifyConfig
from pzd.identify.determination import evidence_of, scales_of
from pzd.identify.evolutionary import fit_evolutionary
from pzd.identify.intervals import half_widths
from pzd.identify.misfit import misfit_of
from pzd.identify.noise_alone import uncertainty
from pzd.identify.objective import Bingham, Fit, Objective
from pzd.identify.part import parts_of
from pzd.identify.separable import fit_separable
from pzd.identify.trial import trial_of
from pzd.identify.trust import Evidence, judge, stationarity, visible_shares
from pzd.record import Array, Condition, Record


def fit_condition(condition: Condition, config: IdentifyConfig, seed: int) -> ParameterRow:
    """The Bingham parameters of one condition, pooled over its records."""
    objective, fit = fit_records(condition.records, config, seed)
    parts = parts_of(condition.records, objective.trials, (fit.residuals, fit.slopes), config.nuisance)
    misfit = misfit_of(parts)
    noise = uncertainty(fit.slopes, fit.residuals, objective.lengths).half_widths()
    widths = half_widths(parts, misfit)
    scales = scales_of(fit.parameters, objective.measured)
    visible = visible_shares(fit.slopes, scales, objective.energy)
    cosines = stationarity(fit.slopes, fit.residuals, objective.energy)
    return row_of(
        (condition.setting, condition.voltage, condition.temperature),
        fit.parameters,
        widths,
        evidence_of(
            objective, fit.parameters, fit.criterion, np.stack([scales, noise, widths, visible, cosines]), misfit
        ),
        (objective.measured, fit.residuals),
    )


def fit_records(records: Sequence[Record], config: IdentifyConfig, seed: int) -> tuple[Objective, Fit]:
    """The optimum of criterion (4) over the records, by the method that the config names."""
    objective = Objective(tuple(trial_of(r) for r in records))
    if config.method == "evolutionary":
        return objective, fit_evolutionary(objective, config.evolutionary, seed)
    return objective, fit_separable(objective)


def row_of(
    labels: tuple[str | None, float | None, float | None],
    parameters: Bingham,
    widths: Array,
    evidence: Sequence[Evidence],
    fitted: tuple[Array, Array],
) -> ParameterRow:
    """The row of one condition or node; what is undetermined has no number.

    Parameters
    ----------
    labels : setting, voltage, temperature
    parameters : the optimum
    widths : (3,) half widths of the 95 % intervals
    evidence : on T0, C and k
    fitted : (N,) measured force and (N,) residuals of the samples that the row was fitted to
    """
    trust = judge(evidence)
    friction, damping, stiffness = (
        _bounds(value, float(width), known, natural)
        for value, width, known, natural in zip(
            parameters, widths, trust.determined, ("linear", "log", "log"), strict=True
        )
    )
    measured, residuals = fitted
    return ParameterRow(
        setting=labels[0],
        voltage_V=labels[1],
        temperature_degC=labels[2],
        T0_N=friction[0],
        T0_N_low95=friction[1],
        T0_N_high95=friction[2],
        C_Ns_per_m=damping[0],
        C_Ns_per_m_low95=damping[1],
        C_Ns_per_m_high95=damping[2],
        k_N_per_m=stiffness[0],
        k_N_per_m_low95=stiffness[1],
        k_N_per_m_high95=stiffness[2],
        W_s=float(residuals @ residuals / (measured @ measured)),
        rmse_N=float(np.sqrt(np.mean(residuals**2))),
        status=trust.status,
    )


def _bounds(value: float, width: float, known: bool, natural: str) -> tuple[float | None, float | None, float | None]:
    """Value and 95 % interval: linear and cut at zero for T0, in the logarithm for C and k."""
    if not known:
        return None, None, None
    if natural == "linear":
        return value, max(value - width, 0.0), value + width
    ratio = float(np.exp(width / value))
    return value, value / ratio, value * ratio
