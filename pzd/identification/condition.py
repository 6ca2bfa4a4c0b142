"""Parameters of one condition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.artefacts import AuxiliaryRow, ParameterRow
from pzd.identification.bingham_fit import (
    Bingham,
    Fit,
    Objective,
    descend,
    fit_evolutionary,
    fit_separable,
)
from pzd.identification.config import IdentifyConfig
from pzd.identification.intervals import half_widths, uncertainty
from pzd.identification.prepared_record import fitted_records, prepare
from pzd.identification.trust import (
    ParameterEvidence,
    misfit_of,
    parameter_evidence,
    parameter_scales,
    partial_sensitivities,
    stationarity,
    trust_of,
)
from pzd.record import SAME_TEMPERATURE, Array, Condition, Record, mid_stroke
from pzd.signals.measures import criterion, rms
from pzd.signals.nuisance import NuisanceConfig
from pzd.signals.segmentation import separate_tests


def identify_condition(
    condition: Condition, config: IdentifyConfig, seed: int
) -> tuple[ParameterRow, AuxiliaryRow | None]:
    """The Bingham parameters of one condition, and what its tests show beside the element."""
    records = [test for record in condition.records for test in separate_tests(record)]
    objective, fit, auxiliary = fit_with_auxiliary(records, config, seed)
    parts = fitted_records(records, objective.trials, (fit.residuals, fit.slopes), config.nuisance)
    misfit = misfit_of(parts)
    noise = uncertainty(fit.slopes, fit.residuals, objective.lengths).half_widths()
    widths = half_widths(parts, misfit)
    scales = parameter_scales(fit.parameters, objective.measured)
    visible = partial_sensitivities(fit.slopes, scales, objective.energy)
    cosines = stationarity(fit.slopes, fit.residuals, objective.energy)
    labels = (condition.setting, condition.voltage, condition.temperature)
    row = parameter_row(
        labels,
        fit.parameters,
        widths,
        parameter_evidence(
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
    whole = Objective(tuple(prepare(r) for r in records))
    plain = _optimum(whole, config, seed)
    if not auxiliary_is_visible(whole, plain):
        return whole, plain, None
    values = auxiliary_start(whole)
    objective = without_auxiliary_force(whole, values)
    fit = _optimum(objective, config, seed)
    values = values + auxiliary_remainder(objective, fit)
    objective = without_auxiliary_force(whole, values)
    fit = descend(objective, fit.parameters)
    auxiliary = significant_auxiliary(records, objective, fit, values, config.nuisance)
    return (whole, plain, None) if auxiliary is None else (objective, fit, auxiliary)


def _optimum(objective: Objective, config: IdentifyConfig, seed: int) -> Fit:
    if config.method == "evolutionary":
        return fit_evolutionary(objective, config.evolutionary, seed)
    return fit_separable(objective)


def parameter_row(
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
        _interval(value, float(width), known, natural)
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


def _interval(value: float, width: float, known: bool, natural: str) -> tuple[float | None, float | None, float | None]:
    """Value and 95 % interval: linear and cut at zero for T0, in the logarithm for C and k."""
    if not known:
        return None, None, None
    if natural == "linear":
        return value, max(value - width, 0.0), value + width
    ratio = float(np.exp(width / value))
    return value, value / ratio, value * ratio


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


# --- Auxiliary forces ---

AUXILIARY_THRESHOLD = 0.0025
"""R.m.s. of what the auxiliaries would explain, as a share of peak force, from which they are tried: the visible
misfit, half of the error of a load cell of class 0.5."""
AUXILIARY_CONFIDENCE = 0.999
"""Level of the interval that must leave out zero for one of them at least."""


@dataclass(frozen=True, eq=False)
class Auxiliary:
    """The forces F_0 + k_g (x - x_m) beside the element."""

    values: Array
    """(2,) F_0 [N] and k_g [N/m]."""
    widths: Array
    """(2,) half widths of their 95 % intervals."""
    middle: float
    """x_m, the middle of the motion of all records concerned [m]."""


def auxiliary_is_visible(objective: Objective, fit: Fit) -> bool:
    """Whether the auxiliaries would, to first order, explain more than a load cell may be wrong by."""
    columns, _ = auxiliary_columns(objective)
    slopes = fit.slopes / np.maximum(np.linalg.norm(fit.slopes, axis=0), np.finfo(float).tiny)
    base, _ = np.linalg.qr(slopes)
    beyond, _ = np.linalg.qr(columns - base @ (base.T @ columns))
    explained = float(np.sum((beyond.T @ fit.residuals) ** 2)) / fit.residuals.size
    return bool(np.sqrt(explained) > AUXILIARY_THRESHOLD * objective.scales[0])


def auxiliary_start(objective: Objective) -> Array:
    """(2,) F_0 and k_g read off without a fit, where the search begins.

    Equation: F = F_0 + k_g (x - x_m) + a sign(v) + b v, by least squares      Source: a damper is odd in its speed
    """
    columns, _ = auxiliary_columns(objective)
    speed = np.concatenate([t.at_samples(np.gradient(t.displacement, t.step))[t.counted] for t in objective.trials])
    terms = np.column_stack([columns, np.sign(speed), speed])
    size = np.linalg.norm(terms, axis=0)
    size[size == 0.0] = 1.0
    found: Array = (np.linalg.lstsq(terms / size, objective.measured, rcond=1e-9)[0] / size)[:2]
    return found


def without_auxiliary_force(objective: Objective, values: Array) -> Objective:
    """The data less F_0 + k_g (x - x_m), what is left of both being solved linearly inside."""
    columns, middle = auxiliary_columns(objective)
    trials = tuple(
        replace(t, force=t.force - values[0] - values[1] * (t.at_samples(t.displacement) - middle))
        for t in objective.trials
    )
    basis, _ = np.linalg.qr(columns)
    return Objective(trials, basis)


def auxiliary_remainder(objective: Objective, fit: Fit) -> Array:
    """(2,) what of F_0 and k_g is left in relieved data at an optimum, to be added to what was taken off."""
    columns, _ = auxiliary_columns(objective)
    left = objective.measured - objective.simulated(fit.parameters)
    return np.asarray(np.linalg.lstsq(columns, left, rcond=None)[0], dtype=np.float64)


def significant_auxiliary(
    records: Sequence[Record], objective: Objective, fit: Fit, values: Array, nuisance: NuisanceConfig
) -> Auxiliary | None:
    """The auxiliaries of a fit to relieved data; None where the tests do not show them.

    Parameters
    ----------
    records : that were fitted
    objective : their data, relieved
    fit : the optimum
    values : (2,) what was taken off, so that nothing remains
    nuisance : what the sensors may differ by from test to test
    """
    columns, middle = auxiliary_columns(objective)
    slopes = np.hstack([objective.simulated_and_slopes(fit.parameters)[1], columns])
    parts = fitted_records(records, objective.trials, (fit.residuals, slopes), nuisance)
    misfit = misfit_of(parts)
    sure = half_widths(parts, misfit, AUXILIARY_CONFIDENCE)[3:]
    if not np.any(np.abs(values) > sure):
        return None
    return Auxiliary(values, half_widths(parts, misfit)[3:], middle)


def subtract_auxiliary(record: Record, auxiliaries: Sequence[AuxiliaryRow]) -> Record:
    """A record less what constant records of its damper showed beside the element, at the nearest temperature.

    Parameters
    ----------
    record : whose voltage moves, so that its own force tells friction and gas less well apart
    auxiliaries : of its setting; where there are several at one temperature, their mean is taken off
    """
    if not auxiliaries:
        return record
    own = record.median_temperature() or 0.0
    apart = [abs((row.temperature_degC or 0.0) - own) for row in auxiliaries]
    near = [row for row, distance in zip(auxiliaries, apart, strict=True) if distance <= min(apart) + SAME_TEMPERATURE]
    forces = [row.F_0_N + row.k_g_N_per_m * (record.displacement - row.zero_m) for row in near]
    return replace(record, force=record.force - np.mean(forces, axis=0))


def auxiliary_columns(objective: Objective) -> tuple[Array, float]:
    """(N, 2) forces of F_0 = 1 N and k_g = 1 N/m at the counted samples, and the middle of the motion [m]."""
    middle = mid_stroke(t.displacement for t in objective.trials)
    x = np.concatenate([t.at_samples(t.displacement)[t.counted] for t in objective.trials]) - middle
    return np.column_stack([np.ones(x.size), x]), middle
