"""Records prepared for a fit, and records with the residuals and sensitivities of a fit.

The exact element takes the displacement as linear between samples. A sine sampled at 1 kHz and read that way biases k
by 0.04 %, so the displacement is first interpolated on a finer grid by a cubic spline. The force at the first sample
is unknown to the model, since it depends on what went before: the simulation starts from the measured force, and the
warm-up is left out of the criterion; so is the rest behind the motion.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pzd.parallel.on_disk import beside, one_at_a_time
from pzd.record import Array, Mask, Record
from pzd.signals.cycles import Cycles, cycles_of
from pzd.signals.jumps import hidden_direction, jumps, jumps_in_cycles, unresolved_flanks
from pzd.signals.kinematics import clean_displacement_of, displacement_error_of
from pzd.signals.measures import REVERSAL_SHARE, reversals
from pzd.signals.nuisance import NuisanceConfig, nuisance_columns
from pzd.signals.period import moving_range
from pzd.signals.splines import even_cubic

# --- Preparation ---

FINE_RATE = 4000.0
"""Least rate of the fine grid [Hz]: 0.25 ms is a tenth of the shortest time constant C/k."""
FINE_ANGLE = 1.0 / 256.0
"""Largest fine step, as a share of 1/omega of the fastest half cycle."""
RELAXATION = 0.05
"""Time after the end of the motion that is still fitted [s]: some time constants C/k of 3 to 15 ms, which show k."""
FINEST = 64
"""Most fine steps in one sample."""


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """One record prepared for a fit: displacement on a fine grid, measured force, and the samples that count."""

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
    weight: Array
    """(n,) 1, and 0 at a sample beside a reversal where it is chance whether the friction has turned."""
    positions: Array | None = None
    """(n,) where the samples lie on the fine grid, in fine steps; None where every `factor`-th one is a sample."""

    @property
    def every(self) -> int:
        """Fine steps from one simulated force to the next that is needed."""
        return self.factor if self.positions is None else 1

    def at_counted(self, simulated: Array) -> Array:
        """Read a simulated signal, one row each `every` fine steps, (n,) or (n, p), at the counted samples."""
        return (simulated if self.positions is None else self.at_samples(simulated))[self._counted_rows]

    @cached_property
    def _counted_rows(self) -> slice | NDArray[np.bool_]:
        """Counted samples: nearly always contiguous, and a slice is quicker than a mask."""
        rows = np.flatnonzero(self.counted)
        whole = rows.size > 0 and rows[-1] - rows[0] == rows.size - 1
        return slice(int(rows[0]), int(rows[-1]) + 1) if whole else self.counted

    def at_samples(self, fine: Array) -> Array:
        """Read a signal on the fine grid, (m,) or (m, p), at the n samples."""
        if self.positions is None:
            return fine[:: self.factor]
        low = np.minimum(self.positions.astype(int), fine.shape[0] - 2)
        share = (self.positions - low).reshape(-1, *([1] * (fine.ndim - 1)))
        return np.asarray(fine[low] * (1.0 - share) + fine[low + 1] * share)


def prepare(record: Record) -> PreparedRecord:
    """Prepare a record for a fit, its warm-up and the rest after the motion not counted."""
    time, factor, positions = _fine_time(record)
    return PreparedRecord(
        record.name,
        # Without its noise, which a stiff oil spring would turn into force.
        beside(_on_fine_grid(clean_displacement_of(record), record, time, even=positions is None), record.displacement),
        float((time[-1] - time[0]) / (time.size - 1)),
        factor,
        record.force,
        in_motion(record),
        beside(np.where(_turned_by_chance(record), 0.0, 1.0), record.force),
        positions,
    )


def _turned_by_chance(record: Record) -> Mask:
    """Find the samples (n,) at which noise or sampling leave to chance whether the friction has turned."""
    flanks = unresolved_flanks(record.force, reversals(record.displacement), record.rate)
    return flanks | hidden_direction(clean_displacement_of(record), displacement_error_of(record))


def _on_fine_grid(displacement: Array, record: Record, time: Array, *, even: bool) -> Array:
    """Return a displacement (n,) at the (m,) moments of the fine grid, by a cubic spline through the samples [m]."""
    if even:
        return even_cubic(displacement)(np.linspace(0.0, displacement.size - 1, time.size))
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(record.time, displacement)(time))


def in_motion(record: Record) -> NDArray[np.bool_]:
    """Find the samples (n,) that depend on T0, C and k: after the warm-up, until the motion ends for good.

    At rest the element keeps its last force; creep of a real damper and the zero of the load cell would be fitted as
    friction. A hold between two motions counts.
    """
    order, (_, last) = np.arange(record.time.size), moving_range(record.displacement)
    return np.asarray((order >= warm_up(record.displacement)) & (order <= last + RELAXATION * record.rate))


def warm_up(displacement: Array) -> int:
    """Return the number of samples until the force no longer depends on how the record began.

    The force at the first sample decays only while the element slips. It has slipped both ways once the motion has
    reversed a first time, with more than 10 % of its range before the reversal, and moved as far after it. At most
    half the record is left out.
    """
    turns = reversals(displacement)
    if not turns:
        return displacement.size // 2
    away = np.abs(displacement[turns[0] :] - displacement[turns[0]])
    travelled = turns[0] + int(np.argmax(away > REVERSAL_SHARE * np.ptp(displacement)))
    return min(travelled, displacement.size // 2)


def upsampling_factor(record: Record) -> int:
    """Return the number of fine steps in one sample, from the sampling rate and the fastest half cycle."""
    step = 1.0 / record.rate
    half_cycle = min(np.diff(reversals(record.displacement)), default=record.displacement.size) * step
    wanted = max(FINE_RATE * step, np.pi / half_cycle * step / FINE_ANGLE)
    return int(np.clip(np.ceil(wanted - 1e-6), 1, FINEST))


def _fine_time(record: Record) -> tuple[Array, int, Array | None]:
    """Return the fine time stamps, their factor, and the positions of the samples, None where the clock is regular.

    Stamps off a regular clock by less than half a step are rounded, the clock is not irregular.
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
    """One record with the residuals and sensitivities of a fit; (m,) are its counted samples."""

    record: Record
    counted: NDArray[np.bool_]
    """(n,) mask of the samples that are fitted."""
    residuals: Array
    """(m,) measured less simulated force [N]."""
    slopes: Array
    """(m, p) derivatives of the simulated force by the parameters."""
    nuisances: Array
    """(m, 3) force by one standard deviation of offset, gain and delay of the test [N]."""
    run: Cycles | None
    """Cycles that repeat, None where the motion does not or the control signal moves."""
    constant: bool = True
    """Whether the control signal is constant."""

    @property
    def force(self) -> Array:
        """Measured force (m,) [N]."""
        return self.record.force[self.counted]

    @cached_property
    def whole_cycles(self) -> list[int]:
        """Repeating cycles all of whose samples are counted; none where there are fewer than two."""
        whole = self.run.whole(self.record.time, self.counted) if self.run else []
        return whole if len(whole) > 1 else []

    @cached_property
    def number(self) -> NDArray[np.int64]:
        """Number (m,) of the whole repeating cycle of each sample: 0, 1, ..., and -1 outside."""
        if self.run is None or not self.whole_cycles:
            return np.full(self.residuals.size, -1)
        place = np.full(self.run.count + 1, -1)  # the last entry serves samples outside the run, whose index is -1
        place[self.whole_cycles] = np.arange(len(self.whole_cycles))
        return beside(np.asarray(place[self.run.number(self.record.time)][self.counted]), self.record.force)

    @cached_property
    def calm(self) -> NDArray[np.bool_]:
        """Samples (m,) beside no jump of the force, where its instant is chance."""
        record = self.record
        found = jumps_in_cycles(self.run, record.time, record.force) if self.run else jumps(record.force)
        return np.asarray(found[self.counted] == 0.0)

    def folded(self, values: Array) -> Array | None:
        """Fold values (m,) over the whole repeating cycles (cycles, points); None where there are none."""
        if self.run is None or not self.whole_cycles:
            return None
        everywhere = np.zeros(self.record.time.size)
        everywhere[self.counted] = values
        return self.run.fold(self.record.time, everywhere)[self.whole_cycles]


def split_by_record(
    prepared: Sequence[PreparedRecord], residuals: Array, slopes: Array
) -> Iterator[tuple[Array, Array]]:
    """Yield the residuals (m,) and slopes (m, p) of each record of (N,) and (N, p) of the counted samples of all."""
    ends = np.cumsum([np.count_nonzero(each.counted) for each in prepared])[:-1]
    yield from zip(np.split(residuals, ends), np.split(slopes, ends), strict=True)


def fitted_records(
    records: Sequence[Record],
    prepared: Sequence[PreparedRecord],
    fitted: Iterable[tuple[Array, Array]],
    nuisance: NuisanceConfig,
    *,
    constant: bool = True,
) -> tuple[FittedRecord, ...]:
    """Put the residuals and sensitivities of a fit beside the records.

    Parameters
    ----------
    records : that were fitted
    prepared : the same, prepared
    fitted : (m,) residuals and (m, p) slopes of the counted samples of each record
    nuisance : standard deviations of what differs from test to test
    constant : whether the control signal is constant, so that the force repeats where the motion does
    """
    found = []
    for record, each, (one, slopes) in one_at_a_time(zip(records, prepared, fitted, strict=True)):
        counted = each.counted
        nuisances = nuisance_columns(record.force[counted] - one, record.rate, nuisance, counted)
        nuisances *= each.weight[counted, None]
        run = cycles_of(record) if constant else None
        left, slope, nuisances = (beside(values, record.force) for values in (one, slopes, nuisances))
        found.append(FittedRecord(record, counted, left, slope, nuisances, run, constant))
    return tuple(found)
