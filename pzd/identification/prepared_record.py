"""Criterion (4) over the records of one condition, and the bounds of the search.

Equation: W_s = sum (F - F_sim)^2 / sum F^2      Source: Makowski and Knap 2021, eq. (4)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pzd.damper.element import element_force, element_force_sensitivities
from pzd.record import Array, Record
from pzd.signals.cycles import Cycles, cycles_of
from pzd.signals.jumps import jumps, jumps_in_cycles
from pzd.signals.nuisance import NuisanceConfig, columns_of
from pzd.signals.period import moving
from pzd.signals.smoothing import REVERSAL_SHARE, reversals

# ----------------------------------------------------------------------------------------------------
# A record made ready for fitting: displacement on a fine grid, force to be met, warm-up and rest left out.
#
# The exact element takes the displacement as linear between samples. A sine sampled at 1 kHz and
# read that way biases k by 0.04 %, so the displacement is first laid on a finer grid by a cubic
# spline. The force at the first sample is unknown to the model (it depends on what went before):
# simulation starts from the measured force, and a warm-up is left out of the
# criterion; so is the rest behind the motion.


FINE_RATE = 4000.0
"""The fine grid has at least this rate [Hz]."""
FINE_ANGLE = 1.0 / 256.0
"""The fine step is at most this share of 1/omega of the fastest half cycle."""
RELAXES = 0.05
"""After the motion has ended the oil relaxes for some time constants C/k, of 3 to 15 ms, and shows k in it [s]."""
FINEST = 64
"""Largest factor between the fine grid and the samples."""


@dataclass(frozen=True, eq=False)
class Trial:
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


def trial_of(record: Record) -> Trial:
    """The record made ready for fitting, its warm-up and the rest after it left out."""
    from scipy.interpolate import CubicSpline

    time, factor, positions = _fine_time(record)
    clock = record.time if positions is not None else np.linspace(record.time[0], record.time[-1], record.time.size)
    return Trial(
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
    order, (_, last) = np.arange(record.time.size), moving(record.displacement)
    counted: NDArray[np.bool_] = (order >= warm_up(record.displacement)) & (order <= last + RELAXES * record.rate)
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


# ----------------------------------------------------------------------------------------------------
# What each record has to do with a fit: its residuals and slopes, what its sensors may have done, what repeats.


@dataclass(frozen=True, eq=False)
class Part:
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


def parts_of(
    records: Sequence[Record],
    trials: Sequence[Trial],
    fitted: tuple[Array, Array],
    nuisance: NuisanceConfig,
    *,
    constant: bool = True,
) -> tuple[Part, ...]:
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
        Part(
            record,
            trial.counted,
            left,
            slope,
            columns_of(record.force[trial.counted] - left, record.rate, nuisance, trial.counted),
            cycles_of(record) if constant else None,
            constant,
        )
        for record, trial, left, slope in zip(
            records, trials, np.split(residuals, ends), np.split(slopes, ends), strict=True
        )
    )


# ----------------------------------------------------------------------------------------------------


LARGEST_PRE_SLIP = 0.45
"""Largest pre-slip deflection T0/k of the search, as a share of the range of displacement."""
AT_BOUND = 1e-3
"""A parameter within this share of a bound, in search coordinates, lies at it."""


class Bingham(NamedTuple):
    """The three parameters of the element, or one number for each of them."""

    friction: float
    damping: float
    stiffness: float


@dataclass(frozen=True, eq=False)
class Objective:
    """What both methods minimise: criterion (4) pooled over the counted samples of the trials."""

    trials: tuple[Trial, ...]
    basis: Array | None = None
    """(N, q) orthonormal forces beside the element whose best multiples are solved inside, by variable projection."""

    @cached_property
    def measured(self) -> Array:
        """(N,) measured force at the counted samples, trial by trial [N]."""
        return np.concatenate([t.force[t.counted] for t in self.trials])

    @cached_property
    def energy(self) -> float:
        """Denominator of the criterion [N2]."""
        return float(self.measured @ self.measured)

    @property
    def lengths(self) -> tuple[int, ...]:
        """Counted samples of each trial."""
        return tuple(int(np.count_nonzero(t.counted)) for t in self.trials)

    def simulated(self, parameters: Bingham) -> Array:
        """(N,) force of the element [N]."""
        return np.concatenate(
            [
                t.met(element_force(t.displacement, t.step, *parameters, float(t.force[0]), every=t.every))
                for t in self.trials
            ]
        )

    def residuals(self, parameters: Bingham) -> Array:
        """(N,) measured less simulated force, the forces beside the element at their best [N]."""
        return self._projected(self.measured - self.simulated(parameters))

    def residuals_and_slopes(self, parameters: Bingham) -> tuple[Array, Array]:
        """(N,) residuals and (N, 3) what T0, C and k do to the force that nothing beside the element makes up."""
        simulated, slopes = self.simulated_and_slopes(parameters)
        return self._projected(self.measured - simulated), self._projected(slopes)

    def simulated_and_slopes(self, parameters: Bingham) -> tuple[Array, Array]:
        """(N,) force of the element and (N, 3) its derivatives by T0, C and k."""
        forces, slopes = [], []
        for t in self.trials:
            force, slope = element_force_sensitivities(
                t.displacement, t.step, *parameters, float(t.force[0]), every=t.every
            )
            forces.append(t.met(force))
            slopes.append(t.met(slope))
        return np.concatenate(forces), np.concatenate(slopes)

    def _projected(self, values: Array) -> Array:
        """What of (N,) or (N, p) forces the basis cannot make up.

        Equation: (I - Q Q') r                      Source: Golub and Pereyra 1973, variable projection
        """
        return values if self.basis is None else values - self.basis @ (self.basis.T @ values)

    def criterion(self, parameters: Bingham) -> float:
        """W_s at the parameters."""
        residuals = self.residuals(parameters)
        return float(residuals @ residuals) / self.energy

    @cached_property
    def scales(self) -> tuple[float, float, float]:
        """Peak force [N], peak speed [m/s] and range of displacement [m] over the trials."""
        speed = max(float(np.max(np.abs(np.diff(t.displacement)))) / t.step for t in self.trials)
        stroke = max(float(np.ptp(t.displacement)) for t in self.trials)
        return float(np.max(np.abs(self.measured))), speed, stroke

    @cached_property
    def bounds(self) -> tuple[Bingham, Bingham]:
        """Smallest and largest parameters worth a look, from the data's own scales.

        T0 up to the peak force; C from 1e-4 to 1e2 of peak force over peak speed; k from 0.1 to
        1e4 of peak force over the range of displacement.
        """
        force, speed, stroke = self.scales
        return (
            Bingham(0.0, 1e-4 * force / speed, 0.1 * force / stroke),
            Bingham(force, 1e2 * force / speed, 1e4 * force / stroke),
        )

    @cached_property
    def search_bounds(self) -> tuple[Array, Array]:
        """(3,) bounds of what least squares searches."""
        low, high = self.bounds
        return (
            np.array([0.0, np.log(low.damping), np.log(low.stiffness)]),
            np.array([LARGEST_PRE_SLIP, np.log(high.damping), np.log(high.stiffness)]),
        )

    def slips(self, parameters: Bingham) -> bool:
        """Whether the element slips within every full stroke: else F(0) would act as a free offset for ever."""
        return parameters.friction <= LARGEST_PRE_SLIP * parameters.stiffness * self.scales[2]

    def at_bounds(self, parameters: Bingham) -> tuple[bool, ...]:
        """Whether each parameter lies at a bound of the search; a friction of zero does not."""
        low, high = self.search_bounds
        x = to_search(parameters, self.scales[2])
        beyond = x >= high - AT_BOUND * np.abs(high)
        below = x <= low + AT_BOUND * np.abs(low)
        return bool(beyond[0]), bool(beyond[1] or below[1]), bool(beyond[2] or below[2])

    def clipped(self, parameters: Bingham) -> Bingham:
        """The parameters, brought inside the bounds."""
        stroke = self.scales[2]
        return from_search(np.clip(to_search(parameters, stroke), *self.search_bounds), stroke)


@dataclass(frozen=True, eq=False)
class Fit:
    """An optimum of the criterion."""

    parameters: Bingham
    criterion: float
    residuals: Array
    """(N,) measured less simulated force at the counted samples [N]."""
    slopes: Array
    """(N, 3) derivatives of the simulated force by T0, C and k."""


def to_search(parameters: Bingham, stroke: float) -> Array:
    """(3,) what least squares searches: pre-slip T0/k as a share of the stroke, the logarithms of C and k."""
    friction, damping, stiffness = parameters
    return np.array([friction / (stiffness * stroke), np.log(damping), np.log(stiffness)])


def from_search(x: Array, stroke: float) -> Bingham:
    """The parameters from what least squares searches."""
    stiffness = float(np.exp(x[2]))
    return Bingham(float(x[0]) * stiffness * stroke, float(np.exp(x[1])), stiffness)


def search_slopes(parameters: Bingham, stroke: float) -> Array:
    """(3, 3) derivatives of T0, C, k (rows) by what least squares searches (columns)."""
    friction, damping, stiffness = parameters
    return np.array([[stiffness * stroke, 0.0, friction], [0.0, damping, 0.0], [0.0, 0.0, stiffness]])
