"""One condition: the fit by the method named, its intervals, and the row that says what to believe."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import AuxiliaryRow, ParameterRow
from pzd.artefacts.csv_rows import Estimate
from pzd.damper.element import element_force
from pzd.identification.auxiliary import Auxiliary, auxiliary_of, relieved, remainder, rough_values, worth_fitting
from pzd.identification.config import EvolutionaryConfig, IdentifyConfig
from pzd.identification.intervals import half_widths, uncertainty
from pzd.identification.prepared_record import (
    LARGEST_PRE_SLIP,
    Bingham,
    Fit,
    Objective,
    Trial,
    from_search,
    parts_of,
    search_slopes,
    to_search,
    trial_of,
)
from pzd.identification.trust import (
    ParameterEvidence,
    evidence_of,
    misfit_of,
    scales_of,
    stationarity,
    trust_of,
    visible_shares,
)
from pzd.record import Array, Condition, Record
from pzd.signals.criterion import criterion, rms
from pzd.signals.stretches import separate_tests

# ----------------------------------------------------------------------------------------------------
# Starting values read off the dissipative characteristic, as the paper's first stage does.


FLANK = 0.3
"""The slip flank is read where the speed falls and still exceeds this share of its peak: there it surely slips."""
PRE_SLIP = 0.5
"""The pre-slip branch is read where abs(F) stays below this share of the force at the foot of the flank."""


def graphical_start(trials: Sequence[Trial]) -> Bingham:
    """Starting values of T0, C and k from the characteristic of force over speed.

    Equation: abs(F) = T0 + C (abs(v) - tau d abs(v)/dt) on the slip flank; k = dF/dx before slip
              Source: eq. (1)-(3), to first order in tau = C/k

    T0 is where the slip flank, extended, meets zero piston speed (the force measured there is
    larger, the oil spring being still loaded, which the term in tau takes off); C is the flank's
    slope; k the slope of force over displacement where the force passes through zero.

    Parameters
    ----------
    trials : the records of one condition

    Returns
    -------
    T0 [N], C [N s/m], k [N/m], all positive
    """
    speed, slowing, force = _flank(trials)
    peak = max(float(np.max(force, initial=0.0)), np.finfo(float).tiny)
    fastest = max(float(np.max(speed, initial=0.0)), np.finfo(float).tiny)
    terms = np.column_stack([np.ones(speed.size), speed / fastest, slowing / max(np.max(slowing, initial=0.0), 1e-12)])
    intercept, slope, _ = np.linalg.lstsq(terms, force / peak, rcond=1e-3)[0] * peak
    damping = max(slope, 0.05 * peak) / fastest
    friction = float(np.clip(intercept, 0.01 * peak, peak))
    return Bingham(friction, float(damping), _pre_slip_slope(trials, friction))


def _flank(trials: Sequence[Trial]) -> tuple[Array, Array, Array]:
    """Speed, its rate of fall, and force along the direction of motion, on the slip flank."""
    parts = []
    for t in trials:
        velocity = t.at_samples(np.gradient(t.displacement, t.step))
        step = t.step * (t.displacement.size - 1) / (t.force.size - 1)
        speed = np.abs(velocity)
        slowing = -np.gradient(speed, step)
        along = t.force * np.sign(velocity)
        flank = t.counted & (speed > FLANK * np.max(speed)) & (slowing >= 0.0) & (along > 0.0)
        parts.append(np.stack([speed[flank], slowing[flank], along[flank]]))
    speed, slowing, along = np.concatenate(parts, axis=1)
    return speed, slowing, along


def _pre_slip_slope(trials: Sequence[Trial], friction: float) -> float:
    """Slope of force over displacement where the force passes through zero, pooled over all passages."""
    covariance = variance = 0.0
    for t in trials:
        displacement = t.at_samples(t.displacement)[t.counted]
        force = t.force[t.counted]
        for part in _runs(np.abs(force) < PRE_SLIP * friction):
            dx = displacement[part] - displacement[part].mean()
            covariance += float(dx @ (force[part] - force[part].mean()))
            variance += float(dx @ dx)
    if covariance > 0.0:
        return covariance / variance
    stroke = max(float(np.ptp(t.displacement)) for t in trials)
    return 20.0 * friction / stroke


def _runs(inside: NDArray[np.bool_]) -> list[slice]:
    """Stretches of at least three samples inside."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], inside.astype(int), [0]))))
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 3]


# ----------------------------------------------------------------------------------------------------
# The separable method: a coarse grid in two parameters, then least squares with exact sensitivities.
#
# Scaling T0 and C with k scales the force, F = k f(T0/k, C/k), so on the grid the stiffness follows
# linearly from the rest and only delta = T0/k and tau = C/k are searched.


GRID = (12, 10)
"""Points of the grid in delta = T0/k and in tau = C/k."""
GRID_SAMPLES = 10_000
"""The grid is evaluated on at most this many samples, shared out among the trials."""
DESCENTS = 3
"""How many of the best grid points are followed down."""
SAME_OPTIMUM = 1e-6
"""Two descents whose criteria differ by less, relative, have reached the same optimum."""
_REMEMBERED = 2
"""Points whose forces are kept: where a descent stands, and where it has just tried to go."""
TOLERANCE = 1e-12
"""Tolerance of the least squares, relative, on parameters and criterion."""


def fit_separable(objective: Objective) -> Fit:
    """The global optimum of the criterion, from the graphical starting values and the grid.

    Starts are followed down until the best optimum has been reached twice. A second descent need not end: on one whose
    criterion has come this close to an optimum that is known, another does not lie by chance.
    """
    best = descend(objective, graphical_start(objective.trials))
    for start in grid_starts(objective):
        fit = descend(objective, start, best.criterion)
        if fit is None:
            return best
        best = min(best, fit, key=lambda f: f.criterion)
    return best


class _Reached(Exception):  # noqa: N818  # nothing went wrong
    """A descent has come to an optimum that is known."""


def grid_starts(objective: Objective, count: int = DESCENTS) -> list[Bingham]:
    """The best points of the grid, best first.

    Equation: k = sum F f / sum f^2 with f = F(T0/k, C/k, 1)      Source: eq. (1)-(3), scaled by k
    """
    _, _, stroke = objective.scales
    pieces = [_piece(t, GRID_SAMPLES // len(objective.trials)) for t in objective.trials]
    slowest = max((t.displacement.size - 1) * t.step for t in objective.trials)
    deltas = np.geomspace(1e-4, LARGEST_PRE_SLIP, GRID[0]) * stroke
    taus = np.geomspace(min(p[1] for p in pieces), 0.1 * slowest, GRID[1])
    found: list[tuple[float, Bingham]] = []
    for delta in deltas:
        for tau in taus:
            match, energy = _overlap(pieces, float(delta), float(tau))
            if match > 0.0:
                k = match / energy
                found.append((-match * k, Bingham(float(delta) * k, float(tau) * k, k)))
    return [objective.clipped(start) for _, start in sorted(found)[:count]]


@overload
def descend(objective: Objective, start: Bingham) -> Fit: ...
@overload
def descend(objective: Objective, start: Bingham, known: float) -> Fit | None: ...
def descend(objective: Objective, start: Bingham, known: float | None = None) -> Fit | None:
    """The optimum reached from a starting point by trust-region least squares within the bounds.

    Parameters
    ----------
    objective : what is minimised
    start : where from
    known : criterion of an optimum that is known already

    Returns
    -------
    the optimum; None as soon as the known one is reached, which is that much of the way saved
    """
    from scipy.optimize import least_squares

    stroke = objective.scales[2]
    norm = np.sqrt(objective.energy)
    low, high = objective.search_bounds

    def reduced(fit: Fit) -> Array:
        """(4, 4) triangle whose last column and first three have the products of residuals and slopes."""
        together = np.column_stack([fit.slopes @ -search_slopes(fit.parameters, stroke), fit.residuals])
        together /= norm
        return np.asarray(np.linalg.qr(together, mode="r"))

    memory: dict[bytes, tuple[Fit, Array]] = {}

    def at(x: Array) -> tuple[Fit, Array]:
        key = x.tobytes()
        if key not in memory:
            if len(memory) == _REMEMBERED:
                memory.pop(next(iter(memory)))
            fit = _fit_at(objective, from_search(x, stroke))
            memory[key] = fit, reduced(fit)
        return memory[key]

    def residuals_at(x: Array) -> Array:
        fit, triangle = at(x)
        if known is not None and abs(fit.criterion - known) <= SAME_OPTIMUM * known:
            raise _Reached
        return triangle[:, 3]

    def slopes_at(x: Array) -> Array:
        return at(x)[1][:, :3]

    inside = np.clip(to_search(start, stroke), low + 1e-9, high - 1e-9)
    try:
        found = least_squares(
            residuals_at,
            inside,
            jac=slopes_at,
            bounds=(low, high),
            x_scale="jac",
            xtol=TOLERANCE,
            ftol=TOLERANCE,
            gtol=TOLERANCE,
            max_nfev=100,
        )
    except _Reached:
        return None
    return at(found.x)[0]


def _fit_at(objective: Objective, parameters: Bingham) -> Fit:
    """The parameters as a fit, however good."""
    residuals, slopes = objective.residuals_and_slopes(parameters)
    return Fit(parameters, float(residuals @ residuals) / objective.energy, residuals, slopes)


def _piece(trial: Trial, samples: int) -> tuple[Array, float, Array, int]:
    """Coarse displacement, its step, the force, and the first counted sample, of the trial's first part."""
    first = int(np.argmax(trial.counted))
    stop = max(first + samples, 2 * first)
    displacement = np.ascontiguousarray(trial.at_samples(trial.displacement)[:stop])
    step = trial.step * (trial.displacement.size - 1) / (trial.force.size - 1)
    return displacement, step, trial.force[:stop], first


def _overlap(pieces: list[tuple[Array, float, Array, int]], delta: float, tau: float) -> tuple[float, float]:
    """Sums of F f and of f^2 over the pieces."""
    match = energy = 0.0
    for displacement, step, force, first in pieces:
        shape = element_force(displacement, step, delta, tau, 1.0)[first:]
        match += float(force[first:] @ shape)
        energy += float(shape @ shape)
    return match, energy


# ----------------------------------------------------------------------------------------------------
# The evolutionary method, for the paper's genetic algorithm: differential evolution, then least squares.


LEAST_FRICTION = 1e-4
"""Smallest friction of the search, as a share of the peak force: its logarithm needs one."""
OUTSIDE = 10.0
"""What the search sees for a parameter set that the bounds of the other method leave out."""
LEAST_SPREAD = 1e-8
"""Spread of the criterion over the population at which the search ends in any case; the rest is polish."""


def fit_evolutionary(objective: Objective, config: EvolutionaryConfig, seed: int) -> Fit:
    """The optimum that the evolutionary search finds, brought to the bottom by least squares."""
    return descend(objective, search(objective, config, seed))


def search(objective: Objective, config: EvolutionaryConfig, seed: int) -> Bingham:
    """The best member of the last generation of a differential evolution on the criterion.

    Equation: minimise W_s over log T0, log C, log k      Source: Makowski and Knap 2021, eq. (4); Storn and Price 1997

    Parameters
    ----------
    objective : criterion and bounds, the same as of the separable method
    config : population, generations, tolerance
    seed : of the random draws

    Returns
    -------
    parameters, not yet polished
    """
    from scipy.optimize import Bounds, differential_evolution

    low, high = objective.bounds
    low = low._replace(friction=LEAST_FRICTION * high.friction)

    def criterion(logarithms: Array) -> float:
        parameters = Bingham(*(float(p) for p in np.exp(logarithms)))
        return objective.criterion(parameters) if objective.slips(parameters) else OUTSIDE

    found = differential_evolution(
        criterion,
        Bounds(np.log(low), np.log(high)),
        popsize=config.population,
        maxiter=config.generations,
        tol=config.tolerance,
        atol=LEAST_SPREAD,
        seed=seed,
        init="sobol",
        polish=False,
    )
    return Bingham(*(float(p) for p in np.exp(found.x)))


# ----------------------------------------------------------------------------------------------------


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
        **Estimate.around(force, of_force).columns("F_0_N"),
        **Estimate.around(stiffness, of_stiffness).columns("k_g_N_per_m"),
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
        **Estimate(*friction).columns("T0_N"),
        **Estimate(*damping).columns("C_Ns_per_m"),
        **Estimate(*stiffness).columns("k_N_per_m"),
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
