"""Records prepared for a fit, and records as a fit leaves them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array, Record
from pzd.signals.cycles import Cycles, cycles_of
from pzd.signals.jumps import jumps, jumps_in_cycles
from pzd.signals.measures import REVERSAL_SHARE, reversals
from pzd.signals.nuisance import NuisanceConfig, nuisance_columns
from pzd.signals.period import moving_range

# --- Preparation ---

FINE_RATE = 4000.0
"""The fine grid has at least this rate [Hz]."""
FINE_ANGLE = 1.0 / 256.0
"""The fine step is at most this share of 1/omega of the fastest half cycle."""
RELAXATION = 0.05
"""After the motion has ended the oil relaxes for some time constants C/k, of 3 to 15 ms, and shows k in it [s]."""
FINEST = 64
"""Largest factor between the fine grid and the samples."""


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """One record as the fit sees it."""

    name: str
    displacement: Array
    """(m,) displacement on the fine grid [m]."""
    step: float
    """Step of the fine grid [s]."""
    factor: int
    """Fine steps in one sample."""
    force: Array
    """(n,) measured force [N]."""
    counted: NDArray[np.bool_]
    """(n,) whether the sample enters the criterion."""
    positions: Array | None = None
    """(n,) where the samples lie on the fine grid, in fine steps; None where every `factor`-th one is a sample."""

    @property
    def every(self) -> int:
        """Fine steps from one simulated force that is needed to the next."""
        return self.factor if self.positions is None else 1

    def met(self, simulated: Array) -> Array:
        """What of a simulated signal, every so many fine steps, (n,) or (n, p), stands against the counted samples."""
        return (simulated if self.positions is None else self.at_samples(simulated))[self._counted_rows]

    @cached_property
    def _counted_rows(self) -> slice | NDArray[np.bool_]:
        """The counted samples: nearly always one piece, which need not be picked out one by one."""
        rows = np.flatnonzero(self.counted)
        whole = rows.size > 0 and rows[-1] - rows[0] == rows.size - 1
        return slice(int(rows[0]), int(rows[-1]) + 1) if whole else self.counted

    def at_samples(self, fine: Array) -> Array:
        """What a fine signal, (m,) or (m, p), reads at the n samples."""
        if self.positions is None:
            return fine[:: self.factor]
        low = np.minimum(self.positions.astype(int), fine.shape[0] - 2)
        share = (self.positions - low).reshape(-1, *([1] * (fine.ndim - 1)))
        return np.asarray(fine[low] * (1.0 - share) + fine[low + 1] * share)


def prepare(record: Record) -> PreparedRecord:
    """The record made ready for fitting, its warm-up and the rest after it left out."""
    from scipy.interpolate import CubicSpline

    time, factor, positions = _fine_time(record)
    clock = record.time if positions is not None else np.linspace(record.time[0], record.time[-1], record.time.size)
    return PreparedRecord(
        record.name,
        CubicSpline(clock, record.displacement)(time),
        float((time[-1] - time[0]) / (time.size - 1)),
        factor,
        record.force,
        in_motion(record),
        positions,
    )


def in_motion(record: Record) -> NDArray[np.bool_]:
    """(n,) whether a sample says something of T0, C and k: past the warm-up, and until the motion ends for good.

    Afterwards the element is stuck at whatever force it had, and what a real damper does then, creep and the zero of
    the load cell, would be fitted as if it were friction. A hold between two motions counts.
    """
    order, (_, last) = np.arange(record.time.size), moving_range(record.displacement)
    counted: NDArray[np.bool_] = (order >= warm_up(record.displacement)) & (order <= last + RELAXATION * record.rate)
    return counted


def warm_up(displacement: Array) -> int:
    """How many samples to leave out until the force no longer depends on how the record began.

    The force at the first sample decays only while the element slips. It has slipped both ways
    once the motion has turned a first time, with more than 10 % of its range before the turn, and
    gone as far again after it. At most half the record is left out.
    """
    turns = reversals(displacement)
    if not turns:
        return displacement.size // 2
    away = np.abs(displacement[turns[0] :] - displacement[turns[0]])
    travelled = turns[0] + int(np.argmax(away > REVERSAL_SHARE * np.ptp(displacement)))
    return min(travelled, displacement.size // 2)


def upsampling_factor(record: Record) -> int:
    """Fine steps in one sample, from the sampling rate and the fastest half cycle of the motion."""
    step = 1.0 / record.rate
    half_cycle = min(np.diff(reversals(record.displacement)), default=record.displacement.size) * step
    wanted = max(FINE_RATE * step, np.pi / half_cycle * step / FINE_ANGLE)
    return int(np.clip(np.ceil(wanted - 1e-6), 1, FINEST))


def _fine_time(record: Record) -> tuple[Array, int, Array | None]:
    """Fine time stamps; their factor; and where samples lie among them, None where the clock is regular.

    Stamps off a regular clock by less than half a step are rounded ones, not an irregular clock.
    """
    time, factor = record.time, upsampling_factor(record)
    clock = np.linspace(time[0], time[-1], time.size)
    if np.max(np.abs(time - clock)) < 0.5 * (clock[1] - clock[0]):
        return np.linspace(time[0], time[-1], (time.size - 1) * factor + 1), factor, None
    count = int(np.ceil((time[-1] - time[0]) * record.rate * factor)) + 1
    fine = np.linspace(time[0], time[-1], count)
    return fine, factor, (time - time[0]) / (fine[1] - fine[0])


# --- After the fit ---


@dataclass(frozen=True, eq=False)
class FittedRecord:
    """One record's part in a fit; (m,) are its counted samples."""

    record: Record
    counted: NDArray[np.bool_]
    """(n,) which samples of the record the fit counts."""
    residuals: Array
    """(m,) measured less simulated force [N]."""
    slopes: Array
    """(m, p) derivatives of the simulated force by the parameters."""
    nuisances: Array
    """(m, 3) force that one standard deviation of the test's offset, gain and delay makes [N]."""
    run: Cycles | None
    """The cycles that repeat, None where the motion does not or the control signal moves."""
    constant: bool = True
    """Whether the control signal stands still."""

    @property
    def force(self) -> Array:
        """(m,) measured force [N]."""
        return self.record.force[self.counted]

    @cached_property
    def number(self) -> NDArray[np.int64]:
        """(m,) the whole repeating cycle of each sample, 0, 1, ..., and -1 for all others; -1 with fewer than two."""
        nothing = np.full(self.residuals.size, -1)
        if self.run is None:
            return nothing
        of_all = self.run.number(self.record.time)
        whole = self.run.whole(self.record.time, self.counted)
        if len(whole) < 2:
            return nothing
        place = np.full(self.run.count + 1, -1)
        place[whole] = np.arange(len(whole))
        found: NDArray[np.int64] = place[of_all][self.counted]
        return found

    @cached_property
    def calm(self) -> NDArray[np.bool_]:
        """(m,) the samples beside no jump of the force, where its instant is chance."""
        record = self.record
        found = jumps_in_cycles(self.run, record.time, record.force) if self.run else jumps(record.force)
        return np.asarray(found[self.counted] == 0.0)

    def folded(self, values: Array) -> Array | None:
        """(cycles, points) of (m,) values over the whole repeating cycles, None with fewer than two."""
        if self.run is None:
            return None
        whole = self.run.whole(self.record.time, self.counted)
        if len(whole) < 2:
            return None
        everywhere = np.zeros(self.record.time.size)
        everywhere[self.counted] = values
        return self.run.fold(self.record.time, everywhere)[whole]


def fitted_records(
    records: Sequence[Record],
    trials: Sequence[PreparedRecord],
    fitted: tuple[Array, Array],
    nuisance: NuisanceConfig,
    *,
    constant: bool = True,
) -> tuple[FittedRecord, ...]:
    """The parts of a fit.

    Parameters
    ----------
    records : that were fitted
    trials : the same, as the fit saw them
    fitted : (N,) residuals and (N, p) slopes of the counted samples, record by record
    nuisance : what may differ from test to test
    constant : whether the control signal stands still, so that the force repeats where the motion does
    """
    residuals, slopes = fitted
    ends = np.cumsum([np.count_nonzero(t.counted) for t in trials])[:-1]
    return tuple(
        FittedRecord(
            record,
            trial.counted,
            left,
            slope,
            nuisance_columns(record.force[trial.counted] - left, record.rate, nuisance, trial.counted),
            cycles_of(record) if constant else None,
            constant,
        )
        for record, trial, left, slope in zip(
            records, trials, np.split(residuals, ends), np.split(slopes, ends), strict=True
        )
    )
