"""Parameters of one condition: fit, intervals and status, with the auxiliary forces of a gas-charged damper.

Gas pushes the rod out at every control signal, and a Bingham element that has to replace it gets a wrong friction and a
wrong stiffness. A constant force and a gas spring beside the element are linear in their coefficients, so these are
profiled out of the criterion (variable projection) and cost the search nothing. They are kept only where the tests show
them beyond offset, gain and delay of the sensors, the noise and the misfit of the element; else T0, C and k are those
of the element alone. The damper that identify hands on has neither: diagnose names the effect.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.artefacts import AuxiliaryRow, ParameterRow
from pzd.fit.spread import NuisanceEquations, estimated_spread
from pzd.identification import trust
from pzd.identification.bingham_fit import Bingham, Fit, Objective, descend, fit_evolutionary, fit_separable
from pzd.identification.config import IdentifyConfig
from pzd.identification.intervals import (
    AS_BEFOREHAND,
    VarianceSources,
    half_widths,
    interval_columns,
    label_columns,
    nuisance_equations_of,
    uncertainty,
    variance_sources,
)
from pzd.identification.prepared_record import FittedRecord, fitted_records, prepare, split_by_record
from pzd.identification.stiffness import OilSpring, oil_spring_alone, settle_stiffness
from pzd.identification.trust import ParameterEvidence, Reservation
from pzd.parallel.on_disk import one_at_a_time
from pzd.quantities import BINGHAM, DAMPING, STIFFNESS
from pzd.record import SAME_TEMPERATURE, Array, Condition, Labels, Mask, Record, mid_stroke
from pzd.signals.measures import VISIBLE, criterion, rms
from pzd.signals.nuisance import NuisanceConfig
from pzd.signals.segmentation import separate_tests

# --- Fit of one condition ---


def identify_condition(
    condition: Condition, config: IdentifyConfig, seed: int
) -> tuple[ParameterRow, AuxiliaryRow | None]:
    """Identify the Bingham parameters of one condition alone, and the forces that its tests show beside the element.

    Parameters
    ----------
    condition : whose records are fitted
    config : the method, and standard deviations of what differs from test to test
    seed : of the evolutionary search
    """
    estimate, auxiliary = estimate_condition(condition, config, seed)
    (row,) = rows_of([estimate])
    return row, auxiliary


def estimate_condition(
    condition: Condition, config: IdentifyConfig, seed: int
) -> tuple[Estimate | ParameterRow, AuxiliaryRow | None]:
    """Fit one condition; its intervals are given by `rows_of`, which sees the other conditions of the stand too.

    Parameters
    ----------
    condition : whose records are fitted
    config : the method, and standard deviations of what differs from test to test
    seed : of the evolutionary search

    Returns
    -------
    the estimate, or a row where that hangs on no other test; and the forces that the tests show beside the element
    """
    records = [test for record in condition.records for test in separate_tests(record)]
    whole = Objective(tuple(prepare(r) for r in one_at_a_time(records)))
    if spring := oil_spring_alone(records, whole, config.nuisance):
        return _oil_spring_row(condition.labels, spring, whole.measured), None
    objective, fit, auxiliary = fit_with_auxiliary(records, config, seed, whole)
    fit, stiffest = settle_stiffness(records, objective, fit, config.nuisance)
    by_record = objective.fitted_by_record(fit.parameters)
    fitted = fitted_records(records, objective.prepared, by_record, config.nuisance)
    estimate = estimate_of(objective, [(condition.labels, fit.parameters)], fitted, stiffest=stiffest)
    return estimate, None if auxiliary is None else _auxiliary_row(condition.labels, auxiliary)


def rows_of(estimates: Sequence[Estimate | ParameterRow]) -> list[ParameterRow]:
    """Return the rows of the conditions of one stand, with intervals by how far all its tests differ.

    Parameters
    ----------
    estimates : of its conditions; a row where that hangs on no other test
    """
    shown = [each.nuisances for each in estimates if isinstance(each, Estimate)]
    spread = estimated_spread(shown) if shown else AS_BEFOREHAND
    return [row for each in estimates for row in (each.rows(spread) if isinstance(each, Estimate) else [each])]


def fit_with_auxiliary(
    records: Sequence[Record], config: IdentifyConfig, seed: int, whole: Objective | None = None
) -> tuple[Objective, Fit, Auxiliary | None]:
    """Fit the element, and where the records show forces beside it, fit it again to the remainder.

    Parameters
    ----------
    records : of one condition
    config : the method, and standard deviations of what differs from test to test
    seed : of the evolutionary search
    whole : their data, where these are prepared

    Returns
    -------
    the data as fitted, the optimum, and the forces beside the element; None where there are none
    """
    whole = whole or Objective(tuple(prepare(r) for r in one_at_a_time(records)))
    element_alone = _optimum(whole, config, seed)
    if not auxiliary_is_visible(whole, element_alone):
        return whole, element_alone, None
    values = auxiliary_start(whole)
    objective = without_auxiliary_force(whole, values)
    starts = _optimum(objective, config, seed), descend(objective, element_alone.parameters)
    fit = min(starts, key=lambda f: f.criterion)
    values = values + auxiliary_remainder(objective, fit)
    objective = without_auxiliary_force(whole, values)
    fit = descend(objective, fit.parameters)

    def missed() -> trust.Misfit:
        alone = whole.fitted_by_record(element_alone.parameters)
        return trust.misfit_of(fitted_records(records, whole.prepared, alone, config.nuisance))

    auxiliary = significant_auxiliary(records, objective, fit, values, config.nuisance, missed)
    return (whole, element_alone, None) if auxiliary is None else (objective, fit, auxiliary)


def _optimum(objective: Objective, config: IdentifyConfig, seed: int) -> Fit:
    """Return the optimum by the method of the config."""
    if config.method == "evolutionary":
        return fit_evolutionary(objective, config.evolutionary, seed)
    return fit_separable(objective)


# --- Rows ---


@dataclass(frozen=True, eq=False)
class FittedRow:
    """The optimum of one row, and what speaks for and against it whatever its intervals."""

    labels: Labels
    parameters: Bingham
    by_noise: Array
    """(3,) half widths of the 95 % intervals of T0, C and 1/k by noise alone."""
    energy: float
    """Sum of F^2 over the samples on which it is judged [N2]."""
    reserved: tuple[Reservation, ...]
    missed: tuple[float, float]
    """W_s and r.m.s. residual [N]."""
    stiffest: float | None


@dataclass(frozen=True, eq=False)
class Estimate:
    """A fit of T0, C and k of one row or several, reduced to a few numbers a test; intervals are still to be given."""

    optimum: tuple[FittedRow, ...]
    sources: VarianceSources
    nuisances: NuisanceEquations
    """Of offset, gain and delay of every test."""
    gram: Array
    """(p, p) J'J of the force by T0, C and 1/k of every row."""
    force_rms: float
    speed: float
    """Largest speed [m/s]."""

    def rows(self, spread: Array = AS_BEFOREHAND) -> list[ParameterRow]:
        """Return a row of the condition, or one a voltage node.

        Parameters
        ----------
        spread : (3,) of offsets, gains and delays of the tests of this stand, as shares of their prior
        """
        widths = self.sources.half_widths(spread=spread).reshape(-1, 3)
        scales = np.stack(
            [
                trust.parameter_scales(row.parameters, width, self.force_rms, self.speed)
                for row, width in zip(self.optimum, widths, strict=True)
            ]
        )
        shares = trust.partial_sensitivities(self.gram, scales.ravel(), 1.0).reshape(-1, 3)
        return [_judged_row(*each) for each in zip(self.optimum, widths, scales, shares, strict=True)]


def _judged_row(row: FittedRow, widths: Array, scales: Array, shares: Array) -> ParameterRow:
    """Return a row judged by (3,) half widths of its intervals, scales, and forces that no other parameter replaces."""
    sensitivities = shares / np.sqrt(row.energy)
    evidence = [
        ParameterEvidence(name, scale, by_noise, width, share, against.veto, against.doubt, against.shown)
        for name, scale, by_noise, width, share, against in zip(
            trust.PARAMETER_NAMES,
            scales.tolist(),
            row.by_noise.tolist(),
            widths.tolist(),
            sensitivities.tolist(),
            row.reserved,
            strict=True,
        )
    ]
    return parameter_row(row.labels, row.parameters, widths, evidence, row.missed, row.stiffest)


def estimate_of(
    objective: Objective,
    optimum: Sequence[tuple[Labels, Bingham]],
    records: Sequence[FittedRecord],
    touched: Mask | None = None,
    stiffest: float | None = None,
) -> Estimate:
    """Collect what the rows of a fit need: one of a condition, or one a voltage node.

    Parameters
    ----------
    objective : the data
    optimum : labels and parameters of each row
    records : with residuals (m,) and slopes (m, 3 rows)
    touched : (N, rows) samples on which each row is judged; None for all
    stiffest : stiffness from which on the tests do not tell k from infinity [N/m]; None where it was not looked for
    """
    misfit = trust.misfit_of(records)
    noise = uncertainty([(r.slopes, r.residuals) for r in records]).half_widths().reshape(-1, 3)
    gram = np.sum([r.slopes.T @ r.slopes for r in one_at_a_time(records)], axis=0)
    pull = np.sum([r.slopes.T @ r.residuals for r in one_at_a_time(records)], axis=0)
    residuals = np.concatenate([r.residuals for r in one_at_a_time(records)])
    cosines = trust.stationarity(gram, pull, float(residuals @ residuals), objective.energy).reshape(-1, 3)
    rows = []
    for i, (labels, parameters) in enumerate(optimum):
        here = touched[:, i] if touched is not None and np.any(touched[:, i]) else slice(None)
        measured, missed = objective.measured[here], misses(residuals[here], objective.measured[here])
        unsettled = trust.not_converged(objective, parameters, cosines[i], whole=touched is None)
        reserved = trust.reservations(objective, parameters, missed[0], unsettled, misfit, stiffest)
        rows.append(FittedRow(labels, parameters, noise[i], float(measured @ measured), reserved, missed, stiffest))
    sources, nuisances = variance_sources(records, misfit), nuisance_equations_of(records)
    return Estimate(tuple(rows), sources, nuisances, gram, rms(objective.measured), objective.scales[1])


def misses(residuals: Array, measured: Array) -> tuple[float, float]:
    """Return W_s and the r.m.s. residual [N] of (N,) samples."""
    return criterion(residuals, measured), rms(residuals)


def parameter_row(
    labels: Labels,
    parameters: Bingham,
    widths: Array,
    evidence: Sequence[ParameterEvidence],
    missed: tuple[float, float],
    stiffest: float | None = None,
) -> ParameterRow:
    """Return the row of one condition or node; an undetermined parameter has no number.

    Parameters
    ----------
    labels : setting, voltage, temperature
    parameters : the optimum
    widths : (3,) half widths of the 95 % intervals of T0, C and 1/k
    evidence : on T0, C and k
    missed : W_s and r.m.s. residual [N]
    stiffest : stiffness from which on the tests do not tell k from infinity [N/m], the lower end of its interval
    """
    status, determined = trust.trust_of(evidence)
    cells = label_columns(labels)
    names = zip((quantity.column for quantity in BINGHAM), ("positive", "positive", "inverse"), strict=True)
    for (name, scale), value, width, known in zip(names, parameters, widths, determined, strict=True):
        cells |= interval_columns(name, value if known else None, float(width), scale)
        if not known and name == DAMPING.column and np.isfinite(width):
            cells |= {**interval_columns(name, value, float(width), scale), name: None}
    if stiffest is not None and np.isfinite(stiffest):
        cells[f"{STIFFNESS.column}_low95"] = stiffest
    cells |= {"W_s": missed[0], "rmse_N": missed[1], "status": status}
    return ParameterRow.model_validate(cells)


def _oil_spring_row(labels: Labels, spring: OilSpring, measured: Array) -> ParameterRow:
    """Return the row of tests in which nothing slips: k, and the least T0 there is.

    Parameters
    ----------
    labels : setting, voltage, temperature
    spring : the oil spring
    measured : (N,) force of its tests [N]
    """
    compliance = 1.0 / spring.stiffness
    noise = uncertainty([(r.slopes, r.residuals) for r in spring.records]).half_widths()
    widths = half_widths(spring.records, spring.misfit)
    slopes, residuals = (np.concatenate([getattr(r, n) for r in spring.records]) for n in ("slopes", "residuals"))
    shown = rms(slopes[:, 2]) * compliance / rms(measured)
    no_slip = f"no test slips: T0 is above {spring.friction:.3g} N, and only a longer stroke shows more"
    evidence = [
        ParameterEvidence("T0", 0.0, float(noise[0]), float(widths[0]), 0.0, no_slip),
        ParameterEvidence("C", 0.0, float(noise[1]), float(widths[1]), 0.0, no_slip),
        ParameterEvidence("k", compliance, float(noise[2]), float(widths[2]), shown),
    ]
    found = Bingham(spring.friction, 0.0, spring.stiffness)
    row = parameter_row(labels, found, widths, evidence, misses(residuals, measured))
    return row.model_copy(update={"T0_N_low95": spring.friction})


def _auxiliary_row(labels: Labels, found: Auxiliary) -> AuxiliaryRow:
    """Return the row of the forces beside the element."""
    cells = label_columns(labels)
    for name, value, width in zip(("F_0_N", "k_g_N_per_m"), found.values, found.widths, strict=True):
        cells |= interval_columns(name, float(value), float(width), "linear")
    return AuxiliaryRow.model_validate({**cells, "zero_m": found.middle})


# --- Auxiliary forces ---

AUXILIARY_CONFIDENCE = 0.999
"""Level of the interval that has to exclude zero for at least one of the two forces."""


@dataclass(frozen=True, eq=False)
class Auxiliary:
    """Forces F_0 + k_g (x - x_m) beside the element."""

    values: Array
    """(2,) F_0 [N] and k_g [N/m]."""
    widths: Array
    """(2,) half widths of their 95 % intervals."""
    middle: float
    """x_m, the middle of the motion of all records concerned [m]."""


def auxiliary_columns(objective: Objective) -> tuple[Array, float]:
    """Return the forces (N, 2) of F_0 = 1 N and k_g = 1 N/m at the samples that weigh, and the mid-stroke [m]."""
    middle = mid_stroke(t.displacement for t in one_at_a_time(objective.prepared))
    counted = [t.at_samples(t.displacement)[t.counted] for t in one_at_a_time(objective.prepared)]
    x = np.concatenate(counted) - middle
    return np.column_stack([np.ones(x.size), x]) * objective.weight[:, None], middle


def auxiliary_is_visible(objective: Objective, fit: Fit) -> bool:
    """Tell whether the forces would explain, to first order, more than a load cell may be wrong by."""
    columns, _ = auxiliary_columns(objective)
    triangles, first = [], 0
    for residuals, slopes in objective.fitted_by_record(fit.parameters):
        own = columns[first : first + residuals.size]
        triangles.append(np.linalg.qr(np.column_stack([slopes, own, residuals]), mode="r"))
        first += residuals.size
    few = np.concatenate(triangles)  # with the inner products of all samples
    size = np.linalg.norm(few[:, :3], axis=0)
    base, _ = np.linalg.qr(few[:, :3][:, size > 0.0] / size[size > 0.0])
    beyond, _ = np.linalg.qr(few[:, 3:5] - base @ (base.T @ few[:, 3:5]))
    explained = float(np.sum((beyond.T @ few[:, 5]) ** 2)) / first
    return bool(np.sqrt(explained) > VISIBLE * objective.scales[0])


def auxiliary_start(objective: Objective) -> Array:
    """Estimate F_0 and k_g (2,) without a fit of the element, as a start.

    Equation: F = F_0 + k_g (x - x_m) + a sign(v) + b v, by least squares      Source: a damper is odd in its speed
    """
    columns, _ = auxiliary_columns(objective)
    speed = np.concatenate([t.at_samples(np.gradient(t.displacement, t.step))[t.counted] for t in objective.prepared])
    terms = np.column_stack([columns, np.sign(speed) * objective.weight, speed * objective.weight])
    size = np.linalg.norm(terms, axis=0)
    size[size == 0.0] = 1.0
    measured = objective.measured * objective.weight
    return np.asarray((np.linalg.lstsq(terms / size, measured, rcond=1e-9)[0] / size)[:2])


def without_auxiliary_force(objective: Objective, values: Array) -> Objective:
    """Subtract F_0 + k_g (x - x_m) from the data; the remainder of both forces is profiled out."""
    columns, middle = auxiliary_columns(objective)
    prepared = tuple(
        replace(t, force=t.force - values[0] - values[1] * (t.at_samples(t.displacement) - middle))
        for t in objective.prepared
    )
    basis, _ = np.linalg.qr(columns)
    return Objective(prepared, basis)


def auxiliary_remainder(objective: Objective, fit: Fit) -> Array:
    """Estimate the remainder of F_0 and k_g (2,) at an optimum, to be added to what was subtracted."""
    columns, _ = auxiliary_columns(objective)
    left = (objective.measured - objective.simulated(fit.parameters)) * objective.weight
    return np.asarray(np.linalg.lstsq(columns, left, rcond=None)[0], dtype=np.float64)


def significant_auxiliary(
    records: Sequence[Record],
    objective: Objective,
    fit: Fit,
    values: Array,
    nuisance: NuisanceConfig,
    missed: Callable[[], trust.Misfit],
) -> Auxiliary | None:
    """Return the forces with their intervals; None where the tests do not show them.

    Of few cycles an interval is wide. Where the element alone misses something and with these forces nothing, either
    needs to be there by the customary interval alone: T0 and C would pay for what is left out.

    Parameters
    ----------
    records : that were fitted
    objective : their data, the forces subtracted
    fit : the optimum
    values : (2,) forces that were subtracted, so that no remainder is left
    nuisance : standard deviations of what differs from test to test
    missed : gives the misfit of the element alone
    """
    columns, middle = auxiliary_columns(objective)
    slopes = np.hstack([objective.simulated_and_slopes(fit.parameters)[1] * objective.weight[:, None], columns])
    by_record = split_by_record(objective.prepared, fit.residuals, slopes)
    fitted = fitted_records(records, objective.prepared, by_record, nuisance)
    misfit = trust.misfit_of(fitted)
    widths = half_widths(fitted, misfit)[3:]
    certain = np.any(np.abs(values) > half_widths(fitted, misfit, AUXILIARY_CONFIDENCE)[3:])
    if not certain and not (np.any(np.abs(values) > widths) and misfit.share == 0.0 and missed().share > 0.0):
        return None
    return Auxiliary(values, widths, middle)


def subtract_auxiliary(record: Record, auxiliaries: Sequence[AuxiliaryRow]) -> Record:
    """Subtract from a record the forces that constant records show beside the element, at the nearest temperature.

    Parameters
    ----------
    record : of moving voltage, whose own force tells friction and gas less well apart
    auxiliaries : of its setting; the mean of those at one temperature is subtracted
    """
    if not auxiliaries:
        return record
    own = record.median_temperature() or 0.0
    apart = [abs((row.temperature_degC or 0.0) - own) for row in auxiliaries]
    near = [row for row, distance in zip(auxiliaries, apart, strict=True) if distance <= min(apart) + SAME_TEMPERATURE]
    forces = [row.F_0_N + row.k_g_N_per_m * (record.displacement - row.zero_m) for row in near]
    return replace(record, force=record.force - np.mean(forces, axis=0))
