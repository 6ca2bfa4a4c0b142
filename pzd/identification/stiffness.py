"""Whether the tests show the oil spring: the rigid damper beside the elastic one, and how stiff it is at least.

Where no test slips they show it alone (`oil_spring_alone`).

A stiff oil spring shows for an instant after each reversal alone, so that neither the curvature of the criterion at
1/k = 0 nor at its optimum says how far 1/k may go. Models are compared as wholes instead: what one would change of the
other is a column beside the slopes, and noise, sensors and the parameters that follow say how well its amplitude is
known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pzd.fit.element_coordinates import HARDLY_ELASTIC
from pzd.identification.bingham_fit import Bingham, Fit, Objective, descend, fit_rigid
from pzd.identification.intervals import half_widths
from pzd.identification.prepared_record import FittedRecord, fitted_records, split_by_record
from pzd.identification.trust import EXACT_FIT, LARGEST_RESIDUAL, Misfit, misfit_of
from pzd.record import Array, Record
from pzd.signals.measures import rms
from pzd.signals.nuisance import NuisanceConfig

MUCH_WORSE = 2.0
"""Ratio of the criteria at which a model is rejected whatever the misfit of both, which passes for noise here.

Reason: of ten independent residuals and three parameters, F = 7 is beyond 95 %."""
BISECTIONS = 7
"""Halvings of the logarithm of the bound: it is known to a few percent then."""


def settle_stiffness(
    records: Sequence[Record], objective: Objective, fit: Fit, nuisance: NuisanceConfig
) -> tuple[Fit, float]:
    """Return the rigid damper and the least stiffness [N/m] where the tests do not show the oil spring.

    Parameters
    ----------
    records : that were fitted
    objective : their data
    fit : the optimum over T0, C and k
    nuisance : standard deviations of what differs from test to test

    Returns
    -------
    the fit to be used, and the stiffness from which on k lies in the 95 % interval; infinite where the tests show k
    """
    rigid = fit if np.isinf(fit.parameters.stiffness) else fit_rigid(objective)
    best = min(fit, rigid, key=lambda f: f.criterion)
    if _rejected(records, objective, best, rigid, nuisance):
        return fit, np.inf
    unit = objective.scales[2] / objective.scales[0]
    low, high = np.log(1e-2 * HARDLY_ELASTIC * unit), np.log(unit)
    if np.isfinite(best.parameters.stiffness):
        low = max(low, float(np.log(1.0 / best.parameters.stiffness)))
    start = rigid.parameters
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        start = Bingham(start.friction, start.damping, float(np.exp(-middle)))
        trial = descend(objective, start, free=2)
        if _rejected(records, objective, best, trial, nuisance):
            high = middle
        else:
            low, start = middle, trial.parameters
    return rigid, float(np.exp(-high))


def _rejected(records: Sequence[Record], objective: Objective, best: Fit, other: Fit, nuisance: NuisanceConfig) -> bool:
    """Tell whether a model lies outside the 95 % interval on the line from the best one to it.

    Equation: F_a = F_best + a (F_other - F_best); |1 - a^| > h, a^ and its half width h beside T0 and C
    """
    if other.criterion > MUCH_WORSE * best.criterion and other.criterion > EXACT_FIT:
        return True
    residuals, slopes = objective.residuals_and_slopes(best.parameters)
    change = residuals - other.residuals
    if not np.any(change):
        return False
    columns = np.column_stack([slopes[:, :2], change])
    size = np.linalg.norm(columns, axis=0)
    amplitude = np.linalg.lstsq(columns / np.where(size > 0.0, size, 1.0), residuals, rcond=1e-12)[0][2] / size[2]
    by_record = split_by_record(objective.prepared, residuals, columns)
    fitted = fitted_records(records, objective.prepared, by_record, nuisance)
    return bool(abs(1.0 - amplitude) > half_widths(fitted, Misfit(0.0, 0.0))[2])


# --- Tests in which nothing slips


@dataclass(frozen=True, eq=False)
class OilSpring:
    """The oil spring, where no test slips: all that such tests show."""

    stiffness: float
    """k [N/m]."""
    friction: float
    """Least T0 [N]: half of the largest range that the force of the spring ran through without a slip."""
    records: tuple[FittedRecord, ...]
    """The tests with residuals (m,) and slopes (m, 3) by T0, C and 1/k, the first two zero."""
    misfit: Misfit


def oil_spring_alone(records: Sequence[Record], objective: Objective, nuisance: NuisanceConfig) -> OilSpring | None:
    """Fit the oil spring alone; None where a test shows more of the damper than that.

    Where the spring stands at the start of a record is unknown, and nothing slips that would forget it: each record has
    a mean force of its own, which is neither a preload nor a friction.

    Equation: F_i = m_i + k x, by least squares; T0 >= k X / 2 for the largest range X of a test
                                                            Source: eq. (1) with dy/dt = 0

    Parameters
    ----------
    records : of one condition
    objective : their data
    nuisance : standard deviations of what differs from test to test
    """
    pairs = [(t.at_samples(t.displacement)[t.counted], t.force[t.counted]) for t in objective.prepared]
    moved = [x - x.mean() for x, _ in pairs]
    forces = [force - force.mean() for _, force in pairs]
    x, force = np.concatenate(moved), np.concatenate(forces)
    if not x.any():
        return None
    stiffness = float(x @ force) / float(x @ x)
    if stiffness <= 0.0 or rms(force - stiffness * x) > LARGEST_RESIDUAL * rms(force):
        return None
    by_record: list[tuple[Array, Array]] = [
        (own - stiffness * each, np.outer(each, [0.0, 0.0, -(stiffness**2)]))
        for each, own in zip(moved, forces, strict=True)
    ]
    fitted = fitted_records(records, objective.prepared, by_record, nuisance)
    misfit = misfit_of(fitted)
    friction = 0.5 * stiffness * max(float(np.ptp(each)) for each in moved)
    return None if misfit.is_large else OilSpring(stiffness, friction, fitted, misfit)
