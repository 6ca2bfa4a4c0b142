"""One condition: the fit by the method named, its intervals, and the row that says what to believe."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.artefacts import ParameterRow
from pzd.identify.config import IdentifyConfig
from pzd.identify.evolutionary import fit_evolutionary
from pzd.identify.intervals import uncertainty
from pzd.identify.objective import Bingham, Fit, Objective
from pzd.identify.separable import fit_separable
from pzd.identify.trial import trial_of
from pzd.identify.trust import Evidence, friction_scale, is_stationary, judge, lies_at_bound, visible_shares
from pzd.record import Array, Condition, Record

NAMES = ("T0", "C", "k")


def fit_condition(condition: Condition, config: IdentifyConfig, seed: int) -> ParameterRow:
    """The Bingham parameters of one condition, pooled over its records."""
    objective, fit = fit_records(condition.records, config, seed)
    widths = uncertainty(fit.slopes, fit.residuals, objective.lengths).half_widths()
    low, high = objective.bounds
    bounded = [lies_at_bound(p, a, b) for p, a, b in zip(fit.parameters, low, high, strict=True)]
    evidence = evidence_of(fit.parameters, widths, fit.slopes, objective.measured, fit.residuals, bounded)
    return row_of(
        (condition.setting, condition.voltage, condition.temperature),
        fit.parameters,
        widths,
        evidence,
        (objective.measured, fit.residuals),
    )


def fit_records(records: Sequence[Record], config: IdentifyConfig, seed: int) -> tuple[Objective, Fit]:
    """The optimum of criterion (4) over the records, by the method that the config names."""
    objective = Objective(tuple(trial_of(r) for r in records))
    if config.method == "evolutionary":
        return objective, fit_evolutionary(objective, config.evolutionary, seed)
    return objective, fit_separable(objective)


def evidence_of(
    parameters: Bingham, widths: Array, slopes: Array, measured: Array, residuals: Array, bounded: Sequence[bool]
) -> list[Evidence]:
    """What the data say of T0, C and k.

    Parameters
    ----------
    parameters : the optimum
    widths : (3,) half widths of the 95 % intervals
    slopes : (N, 3) derivatives of the simulated force
    measured : (N,) force [N]
    residuals : (N,) measured less simulated force [N]
    bounded : whether each parameter lies at a bound of the search
    """
    energy = float(measured @ measured)
    scales = np.array([friction_scale(parameters.friction, measured), parameters.damping, parameters.stiffness])
    visible = visible_shares(slopes, scales, energy)
    stationary = is_stationary(slopes, residuals, energy)
    if parameters.friction == 0.0:  # the optimum lies at the natural bound, where the slope need not vanish
        stationary = (True, *stationary[1:])
    return [
        Evidence(*facts)
        for facts in zip(NAMES, scales.tolist(), widths.tolist(), visible.tolist(), bounded, stationary, strict=True)
    ]


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
