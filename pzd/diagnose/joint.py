"""The plain damper fitted together with the nuisances of each test.

A fit that knows nothing of gains and offsets settles on a compromise that no test agrees with,
and the compromise looks like a missing effect. From the fit to the samples one or two Gauss-Newton
steps in T0, C, k of each condition and offset, gain, delay of each test lead to the joint optimum.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pzd.damper.element import element_force_sensitivities
from pzd.damper.model import BaseRow, Damper
from pzd.diagnose.config import NuisanceConfig
from pzd.diagnose.inputs import Prepared
from pzd.diagnose.nuisance import columns_of
from pzd.diagnose.predict import counted
from pzd.identify.trial import trial_of
from pzd.record import is_constant, voltage_scale

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

STEPS = 2
"""Gauss-Newton steps; the third changes nothing that matters."""
LARGEST = 0.5
"""A step changes C and k by at most this share."""


def with_nuisances(
    damper: Damper, prepared: Sequence[Prepared], wanted: Sequence[Mask], config: NuisanceConfig
) -> Damper:
    """The damper at the joint optimum of its base rows and the nuisances of the tests.

    Equation: min sum_r |r_r - S_r d - A_r b_r|^2 / s_r^2 + |b_r|^2 + |d / theta|^2      Source: Gauss-Newton

    Parameters
    ----------
    damper : plain, fitted to the same samples
    prepared : records; those with moving voltage are left to the plain fit
    wanted : (n,) mask of each record
    config : priors of the nuisances
    """
    scale = voltage_scale([p.record for p in prepared])
    tests = [
        (p, mask & counted(p))
        for p, mask in zip(prepared, wanted, strict=True)
        if mask.any() and is_constant(p.record, scale)
    ]
    rows = list(damper.base)
    for _ in range(STEPS):
        for i, row in enumerate(rows):
            mine = [(p, mask) for p, mask in tests if nearest_row(rows, p) == i]
            if mine:
                rows[i] = _stepped(row, mine, config)
    return damper.model_copy(update={"base": tuple(rows)})


def nearest_row(rows: Sequence[BaseRow], prepared: Prepared) -> int:
    """Index of the base row at the temperature and voltage nearest to those of a record."""
    voltage, temperature = prepared.record.median_voltage() or 0.0, prepared.record.median_temperature() or 0.0
    away = [(abs((row.temperature_degC or 0.0) - temperature), abs((row.voltage_V or 0.0) - voltage)) for row in rows]
    return min(range(len(rows)), key=lambda i: (round(away[i][0], 6), away[i][1]))


def _stepped(row: BaseRow, tests: Sequence[tuple[Prepared, Mask]], config: NuisanceConfig) -> BaseRow:
    theta = np.array([row.T0_N, row.C_Ns_per_m, row.k_N_per_m])
    normal, right = np.diag(1.0 / np.maximum(theta, 1e-9 * theta.max()) ** 2), np.zeros(3)
    for prepared, mask in tests:
        residual, slopes, columns, variance = _linearised(theta, prepared, mask, config)
        free = columns.T @ columns + variance * np.eye(columns.shape[1])

        def cleared(of: Array, columns: Array = columns, free: Array = free) -> Array:
            return of - columns @ np.linalg.solve(free, columns.T @ of)

        normal += slopes.T @ cleared(slopes) / variance
        right += slopes.T @ cleared(residual) / variance
    new = theta + np.linalg.solve(normal, right)
    new = np.clip(new, np.array([0.0, *(1.0 - LARGEST) * theta[1:]]), np.array([np.inf, *(1.0 + LARGEST) * theta[1:]]))
    return row.model_copy(update={"T0_N": float(new[0]), "C_Ns_per_m": float(new[1]), "k_N_per_m": float(new[2])})


def _linearised(
    theta: Array, prepared: Prepared, mask: Mask, config: NuisanceConfig
) -> tuple[Array, Array, Array, float]:
    """Residual, its slopes by T0, C, k, the columns of the nuisances, and a rough variance of the noise."""
    record = prepared.lead or prepared.record
    trial = trial_of(record)
    T0, C, k = theta.tolist()
    force, slopes = element_force_sensitivities(trial.displacement, trial.step, T0, C, k, float(record.force[0]))
    predicted = trial.at_samples(force)[prepared.lead_samples :]
    residual = prepared.record.force - predicted
    columns = columns_of(predicted, record.rate, config)
    floor = 1e-8 * float(np.max(np.abs(predicted))) ** 2
    variance = max(float(np.mean(np.diff(residual[mask]) ** 2)) / 2.0, floor)
    return residual[mask], trial.at_samples(slopes)[prepared.lead_samples :][mask], columns[mask], variance
