"""Auxiliary forces beside the element in a gas-charged damper: a constant force and a gas spring, fitted with it.

Gas pushes the rod out at every control signal. A Bingham element that has to make up for it gets a
wrong friction and a wrong spring. Both forces are linear in their coefficients, so these are solved
inside the criterion (variable projection) and cost the search nothing. They are carried only where
the tests show them beyond what the sensors' offset, gain and delay, the noise and the misfit of the
element may do; else T0, C and k are those of the element alone. The damper that identify hands on
has neither: what they stand for is named by diagnose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.artefacts import AuxiliaryRow
from pzd.identification.intervals import half_widths
from pzd.identification.prepared_record import Fit, Objective, parts_of
from pzd.identification.trust import misfit_of
from pzd.record import SAME_TEMPERATURE, Array, Record, mid_stroke
from pzd.signals.nuisance import NuisanceConfig

WORTH_A_LOOK = 0.0025
"""R.m.s. of what the auxiliaries would explain, as a share of peak force, from which they are tried: the visible
misfit, half of the error of a load cell of class 0.5."""
BELIEVED = 0.999
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


def columns_of(objective: Objective) -> tuple[Array, float]:
    """(N, 2) forces of F_0 = 1 N and k_g = 1 N/m at the counted samples, and the middle of the motion [m]."""
    middle = mid_stroke(t.displacement for t in objective.trials)
    x = np.concatenate([t.at_samples(t.displacement)[t.counted] for t in objective.trials]) - middle
    return np.column_stack([np.ones(x.size), x]), middle


def worth_fitting(objective: Objective, fit: Fit) -> bool:
    """Whether the auxiliaries would, to first order, explain more than a load cell may be wrong by."""
    columns, _ = columns_of(objective)
    slopes = fit.slopes / np.maximum(np.linalg.norm(fit.slopes, axis=0), np.finfo(float).tiny)
    base, _ = np.linalg.qr(slopes)
    beyond, _ = np.linalg.qr(columns - base @ (base.T @ columns))
    explained = float(np.sum((beyond.T @ fit.residuals) ** 2)) / fit.residuals.size
    return bool(np.sqrt(explained) > WORTH_A_LOOK * objective.scales[0])


def rough_values(objective: Objective) -> Array:
    """(2,) F_0 and k_g read off without a fit, where the search begins.

    Equation: F = F_0 + k_g (x - x_m) + a sign(v) + b v, by least squares      Source: a damper is odd in its speed
    """
    columns, _ = columns_of(objective)
    speed = np.concatenate([t.at_samples(np.gradient(t.displacement, t.step))[t.counted] for t in objective.trials])
    terms = np.column_stack([columns, np.sign(speed), speed])
    size = np.linalg.norm(terms, axis=0)
    size[size == 0.0] = 1.0
    found: Array = (np.linalg.lstsq(terms / size, objective.measured, rcond=1e-9)[0] / size)[:2]
    return found


def relieved(objective: Objective, values: Array) -> Objective:
    """The data less F_0 + k_g (x - x_m), what is left of both being solved linearly inside."""
    columns, middle = columns_of(objective)
    trials = tuple(
        replace(t, force=t.force - values[0] - values[1] * (t.at_samples(t.displacement) - middle))
        for t in objective.trials
    )
    basis, _ = np.linalg.qr(columns)
    return Objective(trials, basis)


def without(record: Record, auxiliaries: Sequence[AuxiliaryRow]) -> Record:
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


def remainder(objective: Objective, fit: Fit) -> Array:
    """(2,) what of F_0 and k_g is left in relieved data at an optimum, to be added to what was taken off."""
    columns, _ = columns_of(objective)
    left = objective.measured - objective.simulated(fit.parameters)
    return np.asarray(np.linalg.lstsq(columns, left, rcond=None)[0], dtype=np.float64)


def auxiliary_of(
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
    columns, middle = columns_of(objective)
    slopes = np.hstack([objective.simulated_and_slopes(fit.parameters)[1], columns])
    parts = parts_of(records, objective.trials, (fit.residuals, slopes), nuisance)
    misfit = misfit_of(parts)
    sure = half_widths(parts, misfit, BELIEVED)[3:]
    if not np.any(np.abs(values) > sure):
        return None
    return Auxiliary(values, half_widths(parts, misfit)[3:], middle)
