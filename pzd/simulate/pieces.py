"""A long ride, judged piece by piece as it goes: what is kept of its steps does not grow with its length."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pzd.artefacts import SpectrumRow, SummaryRow, WeightedRow, WheelRow
from pzd.comfort.measures import INTEGRATION_TIME_S
from pzd.comfort.weighting import MEMORY_S, weighted
from pzd.record import Array
from pzd.simulate.loop import A_K, COLUMNS, LOST
from pzd.simulate.outcome import Outcome
from pzd.simulate.window import Window

PIECE_S = 120.0
"""Longest piece of a ride [s]: twelve waves of the lowest third-octave band. A shorter ride is one piece."""

Rows = tuple[SummaryRow, Sequence[WheelRow], WeightedRow, Sequence[SpectrumRow], Sequence[SpectrumRow]]
"""Of one piece; the spectrum as components of the road's frequency, where it has one, and in third-octave bands."""


def longest_piece(step: float) -> int:
    """Rows of the longest piece at a step of integration [s]."""
    return max(round(PIECE_S / step), 1)


class Remembered:
    """The end of the pieces so far, as long as the weighting remembers."""

    def __init__(self, step: float) -> None:
        """Begin a ride of so long steps [s]."""
        self._steps = round(MEMORY_S / step)
        self._rows = np.zeros((0, 0))

    def with_piece(self, first: int, rows: Array) -> tuple[Array, int]:
        """Rows (m, c) of the steps from `first` on behind those before them, and the step of the first of all."""
        course = np.vstack([self._rows, rows]) if first > 0 else np.array(rows)
        self._rows = course[-min(self._steps, len(course)) :].copy()
        return course, first + len(rows) - len(course)


class MeanSquare:
    """The weighted r.m.s. of the acceleration at K, from a step on."""

    def __init__(self, first: int, step: float) -> None:
        """Begin a ride that counts from a step on; length of a step [s]."""
        self._first, self._step, self._before = first, step, Remembered(step)
        self._sum, self._count = 0.0, 0

    def take(self, first: int, rows: Array) -> None:
        """Add (m, COURSE_COLUMNS) rows, of the steps from `first` on."""
        course, start = self._before.with_piece(first, rows)
        felt = weighted(course[:, A_K], 1.0 / self._step)[max(self._first, first) - start :]
        self._sum, self._count = self._sum + float(felt @ felt), self._count + felt.size

    def root(self) -> float:
        """The r.m.s. [m/s2]."""
        return math.sqrt(self._sum / max(self._count, 1))


class Pieces:
    """The pieces of one ride, each taken with as much before it as the weighting remembers."""

    def __init__(self, settled: int, step: float, judge: Callable[[Outcome, Window, int], Rows]) -> None:
        """Begin a ride.

        Parameters
        ----------
        settled : the step from which it is judged
        step : [s]
        judge : (piece, its window, steps before it over which a running r.m.s. may reach) -> its rows
        """
        self._settled, self._step, self._judge = settled, step, judge
        self._before = Remembered(step)
        self._count = 0
        self._rows: Rows | None = None
        self._lost: tuple[float, float] = (math.nan, math.nan)

    def take(self, first: int, rows: Array) -> None:
        """Judge (m, COURSE_COLUMNS) rows, of the steps from `first` on; they may be changed afterwards."""
        course, start = self._before.with_piece(first, rows)
        window = Window(max(self._settled, first) - start, len(course) - 1)
        if window.first <= window.last:
            lost = course[window.steps, LOST]
            self._lost = (float(lost[0]) if self._rows is None else self._lost[0], float(lost[-1]))
            lead = min(round(INTEGRATION_TIME_S / self._step), max(first, self._settled) - self._settled)
            piece = Outcome(np.zeros((0, COLUMNS)), course, self._step, outside=0.0, energy_error=0.0)
            rows_of_piece, count = self._judge(piece, window, lead), window.last - window.first + 1
            self._rows = rows_of_piece if self._rows is None else _both(self._rows, self._count, rows_of_piece, count)
            self._count += count

    def joined(self, outcome: Outcome) -> Rows:
        """The rows of the whole ride; the outcome has its energy balance."""
        if self._rows is None:
            raise ValueError("no step of the ride lies behind the settling time")
        summary, wheels, felt, spectrum, bands = self._rows
        whole = {
            "dissipated_J": self._lost[1] - self._lost[0],
            "energy_error": outcome.energy_error,
            "outside_table": outcome.outside,
        }
        return summary.model_copy(update=whole), wheels, felt, spectrum, bands


def _both(one: Rows, n: int, other: Rows, m: int) -> Rows:
    """The rows of two pieces of n and m steps as one.

    Equation: r.m.s. = sqrt((n r_1^2 + m r_2^2) / (n + m)); VDV = (VDV_1^4 + VDV_2^4)^(1/4)
    """

    def mean_square(a: float, b: float) -> float:
        return math.sqrt((n * a * a + m * b * b) / (n + m))

    def joined(rows: Sequence[SpectrumRow], others: Sequence[SpectrumRow]) -> tuple[SpectrumRow, ...]:
        return tuple(
            a.model_copy(update={"rms_m_per_s2": mean_square(a.rms_m_per_s2, b.rms_m_per_s2)})
            for a, b in zip(rows, others, strict=True)
        )

    loads = tuple(
        a.model_copy(
            update={
                "rms_dynamic_load_N": mean_square(a.rms_dynamic_load_N, b.rms_dynamic_load_N),
                "min_contact_force_N": min(a.min_contact_force_N, b.min_contact_force_N),
                "pulling": (n * a.pulling + m * b.pulling) / (n + m),
            }
        )
        for a, b in zip(one[1], other[1], strict=True)
    )
    summary = one[0].model_copy(
        update={
            "peak_abs_aK_m_per_s2": max(one[0].peak_abs_aK_m_per_s2, other[0].peak_abs_aK_m_per_s2),
            "rms_aK_m_per_s2": mean_square(one[0].rms_aK_m_per_s2, other[0].rms_aK_m_per_s2),
            "rms_jerk_m_per_s3": mean_square(one[0].rms_jerk_m_per_s3, other[0].rms_jerk_m_per_s3),
            "peak_deflection_m": max(one[0].peak_deflection_m, other[0].peak_deflection_m),
            "rms_wheel_load_N": max(row.rms_dynamic_load_N for row in loads),
        }
    )
    felt = one[2].model_copy(
        update={
            "duration_s": one[2].duration_s + other[2].duration_s,
            "a_w_m_per_s2": mean_square(one[2].a_w_m_per_s2, other[2].a_w_m_per_s2),
            "peak_m_per_s2": max(one[2].peak_m_per_s2, other[2].peak_m_per_s2),
            "MTVV_m_per_s2": max(one[2].MTVV_m_per_s2, other[2].MTVV_m_per_s2),
            "VDV_m_per_s1_75": (one[2].VDV_m_per_s1_75 ** 4 + other[2].VDV_m_per_s1_75 ** 4) ** 0.25,
        }
    )
    bands = joined(one[4], other[4])
    return summary, loads, felt, joined(one[3], other[3]) if one[3][0].method == other[3][0].method else bands, bands
