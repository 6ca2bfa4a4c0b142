"""One condition: the fit by the method named, its intervals, and the row that says what to believe."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.artefacts import AuxiliaryRow, ParameterRow
from pzd.identify.auxiliary import Auxiliary, auxiliary_of, relieved, remainder, rough_values, worth_fitting
from pzd.identify.config import IdentifyConfig
from pzd.identify.determination import evidence_of, scales_of
from pzd.identify.evolutionary import fit_evolutionary
from pzd.identify.intervals import half_widths
from pzd.identify.misfit import misfit_of
from pzd.identify.noise_alone import uncertainty
from pzd.identify.objective import Bingham, Fit, Objective
from pzd.identify.part import parts_of
from pzd.identify.separable import descend, fit_separable
from pzd.identify.trial import trial_of
from pzd.identify.trust import ParameterEvidence, stationarity, trust_of, visible_shares
from pzd.record import Array, Condition, Record
from pzd.signals.criterion import criterion
from pzd.signals.root_mean_square import rms
from pzd.signals.stretches import separate_tests


def identify_condition(
    condition: Condition, config: IdentifyConfig, seed: int
) -> tuple[ParameterRow, AuxiliaryRow | None]:
    """The Bingham parameters of one condition, and what its tests show beside the element."""
    records = [test for record in condition.records for test in separate_tests(record)]
    objective, fit, auxiliary = fit_with_auxiliary(records, config, seed)
    parts = parts_of(records, objective.trials, (fit.residuals, fit.slopes), config.nuisance)
    misfit = misfit_of(parts)
    noise = uncertainty(fit.slopes, fit.residuals, objective.lengths).half_widths()
    widths = half_widths(parts, misfit)
    scales = scales_of(fit.parameters, objective.measured)
    visible = visible_shares(fit.slopes, scales, objective.energy)
    cosines = stationarity(fit.slopes, fit.residuals, objective.energy)
    labels = (condition.setting, condition.voltage, condition.temperature)
    row = row_of(
        labels,
        fit.parameters,
        widths,
        evidence_of(
            objective, fit.parameters, fit.criterion, np.stack([scales, noise, widths, visible, cosines]), misfit
        ),
        (objective.measured, fit.residuals),
    )
    return row, None if auxiliary is None else _auxiliary_row(labels, auxiliary)


def fit_with_auxiliary(
    records: Sequence[Record], config: IdentifyConfig, seed: int
) -> tuple[Objective, Fit, Auxiliary | None]:
    """The optimum over the records; where they show forces beside the element, over what these leave.

    Parameters
    ----------
    records : of one condition
    config : the method, and what the sensors may differ by
    seed : of the evolutionary search

    Returns
    -------
    the data as fitted, the optimum, and what stands beside the element; None where nothing does
    """
    whole = Objective(tuple(trial_of(r) for r in records))
    plain = _optimum(whole, config, seed)
    if not worth_fitting(whole, plain):
        return whole, plain, None
    values = rough_values(whole)
    objective = relieved(whole, values)
    fit = _optimum(objective, config, seed)
    values = values + remainder(objective, fit)
    objective = relieved(whole, values)
    fit = descend(objective, fit.parameters)
    auxiliary = auxiliary_of(records, objective, fit, values, config.nuisance)
    return (whole, plain, None) if auxiliary is None else (objective, fit, auxiliary)


def _optimum(objective: Objective, config: IdentifyConfig, seed: int) -> Fit:
    if config.method == "evolutionary":
        return fit_evolutionary(objective, config.evolutionary, seed)
    return fit_separable(objective)


def _auxiliary_row(labels: tuple[str | None, float | None, float | None], found: Auxiliary) -> AuxiliaryRow:
    (force, stiffness), (of_force, of_stiffness) = found.values.tolist(), found.widths.tolist()
    return AuxiliaryRow(
        setting=labels[0],
        voltage_V=labels[1],
        temperature_degC=labels[2],
        F_0_N=force,
        F_0_N_low95=force - of_force,
        F_0_N_high95=force + of_force,
        k_g_N_per_m=stiffness,
        k_g_N_per_m_low95=stiffness - of_stiffness,
        k_g_N_per_m_high95=stiffness + of_stiffness,
        zero_m=found.middle,
    )


def row_of(
    labels: tuple[str | None, float | None, float | None],
    parameters: Bingham,
    widths: Array,
    evidence: Sequence[ParameterEvidence],
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
    trust = trust_of(evidence)
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
        W_s=criterion(residuals, measured),
        rmse_N=rms(residuals),
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
