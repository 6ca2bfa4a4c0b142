"""The visible gap: what of a hidden effect is left once T0, C and k have taken up what they can."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.blind.clean import Clean
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.identify.trial import warm_up
from pzd.record import Array

_STEP = 1e-4
_EVALUATIONS = 30


def gap_after_refit(records: Sequence[Clean], damper: Damper) -> float:
    """What a damper cannot follow of noise-free records, its T0, C and k refitted in every base row.

    Equation: min sqrt(mean ((F - F_sim) / F_peak)^2), F_peak of each record, over all samples of all records

    Parameters
    ----------
    records : without noise
    damper : where the search starts; its base rows are refitted, its effects stay as they are

    Returns
    -------
    share of the peak force
    """
    from scipy.optimize import least_squares

    parts = [_Part(record, damper) for record in records]
    start = np.array([(1.0, 0.0, 0.0) for _ in damper.base]).ravel()
    size = np.sqrt(sum(part.size for part in parts))

    def residuals(x: Array) -> Array:
        rows = _rows(damper, x)
        return np.asarray(np.concatenate([part.residuals(rows) for part in parts]) / size)

    def slopes(x: Array) -> Array:
        return np.asarray(np.concatenate([part.slopes(damper, x) for part in parts]) / size)

    low = np.tile([0.0, -3.0, -3.0], len(damper.base))
    high = np.tile([np.inf, 3.0, 3.0], len(damper.base))
    found = least_squares(residuals, start, jac=slopes, bounds=(low, high), max_nfev=_EVALUATIONS, ftol=1e-6, xtol=1e-6)
    return float(np.sqrt(2.0 * found.cost))


def _rows(damper: Damper, x: Array) -> Damper:
    """The damper at a point of the search: T0 as a ratio, C and k as logarithms of one, row by row."""
    rows = tuple(
        BaseRow(
            voltage_V=row.voltage_V,
            temperature_degC=row.temperature_degC,
            T0_N=row.T0_N * float(friction),
            C_Ns_per_m=row.C_Ns_per_m * float(np.exp(damping)),
            k_N_per_m=row.k_N_per_m * float(np.exp(stiffness)),
        )
        for row, (friction, damping, stiffness) in zip(damper.base, x.reshape(-1, 3), strict=True)
    )
    return damper.model_copy(update={"base": rows})


class _Part:
    """One record in the search, and which of the searched variables it depends on."""

    def __init__(self, record: Clean, damper: Damper) -> None:
        self.record = record
        self.first = warm_up(record.motion.displacement)
        self.size = record.force.size - self.first
        voltages = [row.voltage_V for row in damper.base]
        own, voltage = list(range(len(voltages))), record.motion.voltage
        if voltage is not None and np.ptp(voltage) == 0.0 and voltage[0] in voltages:
            own = [i for i in own if voltages[i] == voltage[0]]
        self.columns = [3 * i + j for i in own for j in range(3)]

    def residuals(self, damper: Damper) -> Array:
        """(m,) what is not followed, as a share of the record's peak."""
        simulated = respond(damper, self.record.motion, float(self.record.force[0]), 1e-7)
        return np.asarray((self.record.force - simulated)[self.first :] / self.record.peak)

    def slopes(self, damper: Damper, x: Array) -> Array:
        """(m, p) derivatives of the residuals by the searched variables."""
        found = np.zeros((self.size, x.size))
        here = self.residuals(_rows(damper, x))
        for column in self.columns:
            moved = x.copy()
            moved[column] += _STEP
            found[:, column] = (self.residuals(_rows(damper, moved)) - here) / _STEP
        return found
