"""Weighted records: simulated motion, measured force and the units of noise in which residuals count.

A periodic record under constant conditions is its average cycle, harmonic by harmonic, each in units of its own noise;
any other is its samples, whitened by an autoregression. What offset, gain and delay of the test may explain within
their priors is integrated out, so that |r|^2 of the residual r is minus twice the logarithm of the likelihood.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pzd.damper.compose import respond, sampling_steps, sensors_of, shown_moments
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import effective_voltage
from pzd.diagnosis.cleaned_records import CleanedRecord, temperature_moves
from pzd.diagnosis.fit.prediction import (
    PredictedForce,
    drawn_calm,
    simulation_motion,
    unresolved_turns,
)
from pzd.identification.prepared_record import in_motion
from pzd.record import Array, Record, Rows
from pzd.signals.jumps import gradient_within_stretches, has_predecessors, jumps, jumps_in_samples
from pzd.signals.lack_of_fit import fit_smooth_residual
from pzd.signals.measures import reversals
from pzd.signals.noise import Autoregression, PureError, pure_error
from pzd.signals.nuisance import DELAYS_TRIED, NuisanceConfig, nuisance_columns
from pzd.signals.splines import cubic, even_cubic, with_ringing

# --- Nuisances


if TYPE_CHECKING:
    from scipy.sparse import csr_array

NEGLIGIBLE_NUISANCE = 1e-3
"""A nuisance that moves all residuals together by less [standard deviations of one] is left out.

Reason: it would change the misfit by a millionth."""


@dataclass(frozen=True, eq=False)
class MarginalisedNuisances:
    """Nuisances of a test with Gaussian priors, integrated out of the residuals.

    Those of single samples, as beside a jump, overlap only where they are neighbours: they go first, by clusters.

    Equation: r' = (I + V V')^(-1/2) r = r - V M V' r, M = R diag((1 - 1/sqrt(1 + s^2))/s^2) R', V' V = R diag(s^2) R';
    of two groups r' = S_2 S_1 r, S_1 of the first alone, S_2 of the second behind it, S_1 V_2: |r'|^2 is the same
                                                                            Source: Gaussian prior, marginal likelihood

    Examples
    --------
    A nuisance that moves the first residual by three standard deviations of noise:

    >>> nuisances = MarginalisedNuisances.from_columns(np.array([[3.0], [0.0]]))
    >>> nuisances.marginalised(np.array([1.0, 1.0])).round(3).tolist()
    [0.316, 1.0]
    """

    columns: Array | csr_array
    """(w, p) change V of the residuals by one standard deviation of each nuisance, in units of noise."""
    inner: Array | csr_array
    """(p, p) M."""
    before: MarginalisedNuisances | None = None
    """Those that are integrated out before."""

    @classmethod
    def from_columns(cls, columns: Array, local: Array | csr_array | None = None) -> MarginalisedNuisances:
        """Prepare some nuisances, without those below `NEGLIGIBLE_NUISANCE`.

        Parameters
        ----------
        columns : (w, p) of nuisances that move all residuals
        local : (w, l) of those that move a few each, integrated out before where they are sparse
        """
        before = None
        if isinstance(local, np.ndarray):
            columns = np.hstack([columns, local])
        elif local is not None and local.nnz:
            before = cls(local, _inner_by_clusters((local.T @ local).tocsr()))
            columns = before.marginalised(columns)
        return cls(columns, _inner(columns.T @ columns), before)

    @classmethod
    def none(cls, residuals: int) -> MarginalisedNuisances:
        """Prepare no nuisances for so many residuals."""
        return cls(np.zeros((residuals, 0)), np.zeros((0, 0)))

    def marginalised(self, values: Array) -> Array:
        """Return values (w,) or (w, k) in units of noise with the nuisances integrated out."""
        left = values if self.before is None else self.before.marginalised(values)
        if not self.inner.shape[0]:
            return left
        return np.asarray(left - self.columns @ (self.inner @ (self.columns.T @ left)))


def _inner(products: Array) -> Array:
    """Return M (..., p, p) of the products V' V (..., p, p), by their eigenvalues, which lose nothing of what shows."""
    squares, right = np.linalg.eigh(products)
    shown = squares > NEGLIGIBLE_NUISANCE**2
    squares = np.where(shown, squares, 1.0)
    shares = np.where(shown, (1.0 - 1.0 / np.sqrt(1.0 + squares)) / squares, 0.0)
    return np.asarray((right * shares[..., np.newaxis, :]) @ np.swapaxes(right, -1, -2))


def _inner_by_clusters(products: csr_array) -> csr_array:
    """Return M (p, p) of products V' V (p, p) most of which are zero: cluster by cluster of columns that overlap."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count, cluster = connected_components(products, directed=False)
    sizes, order = np.bincount(cluster, minlength=count), np.argsort(cluster, kind="stable")
    first = np.cumsum(sizes) - sizes
    values, rows, columns = [], [], []
    for size in np.unique(sizes):
        members = order[first[sizes == size][:, np.newaxis] + np.arange(size)]
        across = np.broadcast_to(members[:, :, np.newaxis], (*members.shape, size))
        down = np.swapaxes(across, 1, 2)
        block = products[across.ravel(), down.ravel()].reshape(across.shape)
        values.append(_inner(block).ravel())
        rows.append(across.ravel())
        columns.append(down.ravel())
    places = np.concatenate(rows), np.concatenate(columns)
    return coo_array((np.concatenate(values), places), products.shape).tocsr()


# --- Weighted records


Sensors = Mapping[str, Mapping[str, float]]
"""Parameters of the effects of the sensor, by effect and name: see `pzd.damper.compose.sensors_of`."""
NO_SENSORS: Sensors = {}
SIMULATION_TOLERANCE = 1e-7
"""Tolerance of the path of the element, as a share of the force, in every step by itself.

Reason: over a record the errors add up, and jump as the parameters move; a search must not take that for a descent.
Looser, it would hardly be faster: most steps of a record lie in one piece."""
CACHED_VOLTAGES = 4
"""Effective voltages kept in the cache: derivatives by a parameter of the drive need three."""


@dataclass(frozen=True, eq=False)
class WeightedRecord:
    """One record, or part of one, with its weights: an observation of the least-squares problem."""

    name: str
    base_row: int
    """Index of its base row; -1 where the voltage moves."""
    motion: Motion
    """(m,) simulated motion."""
    initial_force: float
    """Recorded force at the first sample of the motion [N]: that of the same phase where the motion repeats."""
    sample_indices: Rows
    """(s,) recorded samples among those of the motion, from the first one compared to the last."""
    compared: NDArray[np.bool_]
    """(s,) which of them are compared: n of them, in one stretch or several."""
    measured: Array
    """(n,) force [N]."""
    peak: float
    """Largest measured force [N]."""
    noise: PureError | Autoregression
    weights: Array
    """(H + 1,) of the harmonics of an average cycle; empty where samples are compared."""
    nuisances: MarginalisedNuisances
    """Offset and gain of the test, and its jumps."""
    timing: Array | None = None
    """(n, 1) force by one standard deviation of the instant of the voltage [N]; None where it does not move."""
    delay_s: float = 0.0
    """Standard deviation of the delay of the test [s]; 0 where it has none."""
    first_delay: float = 0.0
    """Delay at which the search for the likeliest one begins [s]."""

    @cached_property
    def steps(self) -> Array:
        """Sampling intervals of the motion [s], one where they are even."""
        return sampling_steps(self.motion.time)

    @cached_property
    def effective_voltage(self) -> Callable[[bytes], Array]:
        """Function from the row of the drive, (d,) as bytes, to the (m,) effective voltage [V]; cached."""
        return lru_cache(CACHED_VOLTAGES)(self._followed)

    def _followed(self, row: bytes) -> Array:
        voltage = self.motion.voltage
        if voltage is None:
            raise ValueError(f"{self.name}: the damper depends on the voltage, and none is given")
        return effective_voltage(voltage, self.steps, np.frombuffer(row).copy())

    def at_compared(self, simulated: Array) -> Array:
        """Select the (n,) or (n, p) simulated values at the compared samples."""
        return simulated[self._compared_indices]

    @cached_property
    def _compared_indices(self) -> Rows:
        return self.sample_indices[self.compared]

    def through_sensors(self, simulated: Array, sensors: Sensors) -> Array:
        """Return simulated values, (m,) or (m, p), as a channel shows them, by a cubic between the samples.

        Parameters
        ----------
        simulated : (m,) force [N], or (m, p) of them
        sensors : effects of the sensor, see `pzd.damper.compose.sensors_of`
        """
        if not sensors:
            return simulated
        begin, time = self._begin, self.motion.time[self._begin :]
        shown = shown_moments(sensors, time)
        if np.array_equal(shown, time):
            return simulated
        return np.concatenate([simulated[:begin], self._course(simulated)(shown)])

    @property
    def _begin(self) -> int:
        """Sample of the motion at which its cycle begins; 0 where it does not repeat."""
        return int(self.sample_indices[0]) if isinstance(self.noise, PureError) else 0

    def _course(self, simulated: Array) -> Callable[[Array], Array]:
        """Return values (m,) or (m, p) along the motion as a function of moments [s], by a cubic between samples."""
        begin, time = self._begin, self.motion.time[self._begin :]
        if begin > 0:
            cycle, step = even_cubic(simulated[begin:], periodic=True), self.steps[0]
            return lambda moments: cycle((moments - time[0]) / step)
        course = cubic(time, simulated)
        return lambda moments: course(np.clip(moments, time[0], time[-1]))

    def delayed(self, simulated: Array, sensors: Sensors = NO_SENSORS) -> Callable[[float], Array]:
        """Return what a channel shows of values along the motion, (m,) or (m, p), where compared, by a delay [s].

        Sensors and delay act in one: a second cubic would round the flank of a dry friction once more, and pay for it.
        """
        course, moments = self._course(simulated), self.motion.time[self._compared_indices]
        return lambda delay: course(shown_moments(sensors, moments - delay))

    def standardised(self, values: Array) -> Array:
        """Return (w,) or (w, p) of a force or its derivatives at the compared samples, in units of noise."""
        return self.nuisances.marginalised(self._scaled(values))

    def own_of_test(self, predicted: Array, nuisance: NuisanceConfig) -> Array:
        """Return (w, 3) residuals by one standard deviation of offset, gain and delay, along a predicted force (n,)."""
        moments = self.motion.time[self.sample_indices]
        rate = (moments.size - 1) / float(moments[-1] - moments[0])
        return self.standardised(nuisance_columns(predicted, rate, nuisance, self.compared))

    def single_samples(self, sizes: Array) -> Array | csr_array:
        """Return (w, j) in units of noise, one column for each of the (n,) sizes at the compared samples [N] but 0.

        They are sparse where the record is compared sample by sample.

        Flanks of several samples are left to chance too, one by one. Counted as evidence but for their instant, those
        of a real damper, which no element has, outweighed everything else: its held-out tests were predicted 2.5 times
        worse.
        """
        places = np.flatnonzero(sizes)
        if isinstance(self.noise, Autoregression):
            return self.noise.whitened_samples(places, sizes[places], sizes.size)[self._unbroken]
        columns = np.zeros((sizes.size, places.size))
        columns[places, np.arange(places.size)] = sizes[places]
        return self._scaled(columns)

    def residual_and_slopes(self, force: Array, slopes: Array, sensors: Sensors = NO_SENSORS) -> Array:
        """Return the residual and its derivatives (w, 1 + p) in units of noise, every nuisance integrated out.

        A delay shifts a force and does not merely add its slope: it is integrated about its likeliest value d.

        Equation: r' = (I + u u')^(-1/2) (F - F(t - d) + u d/s), u = -s dF/dt at t - d, in units of noise
                                                                            Source: Laplace's method

        Parameters
        ----------
        force : (m,) along the motion [N]
        slopes : (m, p) derivatives of what the channel shows of it
        sensors : effects of the sensor, see `pzd.damper.compose.sensors_of`
        """
        if self.delay_s == 0.0:
            shown = self.through_sensors(force, sensors)
            return self.standardised(
                np.column_stack([self.measured - self.at_compared(shown), -self.at_compared(slopes)])
            )
        delayed = self.delayed(force, sensors)
        delay = self.likeliest_delay(delayed)
        shifted = delayed(delay)
        late = (delayed(delay + DELAY_STEP) - shifted) * (self.delay_s / DELAY_STEP)
        values = np.column_stack(
            [self.measured - shifted + late * (delay / self.delay_s), -self.delayed(slopes)(delay), late]
        )
        scaled = self.standardised(values)
        found, own = scaled[:, :-1], scaled[:, -1]
        square = float(own @ own)
        if square == 0.0:
            return found
        return np.asarray(found - np.outer(own, own @ found) * ((1.0 - 1.0 / np.sqrt(1.0 + square)) / square))

    def delay_among_jumps(self, at: Callable[[float], Array]) -> float:
        """Find the delay [s] of least misfit among `DELAYS_TRIED`: where the force jumps, its slope leads no further.

        See `likeliest_delay`, which goes on from there.
        """
        shares = np.linspace(-MOST_DEVIATIONS, MOST_DEVIATIONS, DELAYS_TRIED)
        left = self.standardised(np.column_stack([self.measured - at(share * self.delay_s) for share in shares]))
        return float(self.delay_s * shares[np.argmin(np.sum(left**2, axis=0) + shares**2)])

    def likeliest_delay(self, at: Callable[[float], Array]) -> float:
        """Find the likeliest delay [s] of a force at the compared samples, a function of it, by Gauss and Newton."""
        delay = self.first_delay
        for _ in range(SHIFTS):
            force = at(delay)
            late = (at(delay + DELAY_STEP) - force) * (self.delay_s / DELAY_STEP)
            left, own = self.standardised(np.column_stack([self.measured - force, late])).T
            square = float(own @ own)
            share = (float(own @ left) + square * delay / self.delay_s) / (1.0 + square)
            before, delay = delay, self.delay_s * float(np.clip(share, -MOST_DEVIATIONS, MOST_DEVIATIONS))
            if abs(delay - before) < SAME_DELAY * self.delay_s:
                break
        return delay

    @cached_property
    def _unbroken(self) -> NDArray[np.bool_]:
        """Which whitened samples count: those whose predecessors, as many as the noise remembers, are compared too."""
        return has_predecessors(
            self.compared, self.noise.coefficients.size if isinstance(self.noise, Autoregression) else 0
        )

    def _scaled(self, values: Array) -> Array:
        if isinstance(self.noise, Autoregression):
            return self.noise.whitened(values)[self._unbroken]
        weights = self.weights.reshape(-1, *([1] * (values.ndim - 1)))
        harmonics = np.fft.rfft(values, axis=0)[: self.weights.size] / len(values) * weights
        return np.concatenate([harmonics.real, harmonics.imag[1:]])


def prompt_force(observation: WeightedRecord, damper: Damper) -> tuple[Array, Sensors]:
    """Simulate the (m,) force of a damper along the motion of an observation [N]; return it with the sensors."""
    sensors = sensors_of(damper)
    prompt = damper.without_effects(*sensors)
    return respond(prompt, observation.motion, observation.initial_force, SIMULATION_TOLERANCE), sensors


def shown_force(observation: WeightedRecord, damper: Damper) -> Array:
    """Simulate the (m,) force of a damper along the motion of an observation, as the channel shows it [N]."""
    return observation.through_sensors(*prompt_force(observation, damper))


def residuals_of(observations: Sequence[WeightedRecord], damper: Damper) -> list[Array]:
    """Compute the residuals (w,) of a damper in each test, in units of noise."""
    found = []
    for o in observations:
        force, sensors = prompt_force(o, damper)
        found.append(o.residual_and_slopes(force, np.zeros((force.size, 0)), sensors)[:, 0])
    return found


# --- Weights of a record


RESOLUTION = 3e-4
"""Resolution of the force as a share of the record's peak (r.m.s.): a floor of the noise.

Reason: a good load cell is right to 0.03 % of its range; without a floor a quiet record would decide alone. Not tuned.
"""
DELAY_STEP = 1e-6
"""Delay by which the slope of a force over time is differenced [s].

Reason: far below a sample, far above the rounding of a time stamp."""
MOST_DEVIATIONS = 3.0
"""Standard deviations of a test's delay to which the part of the shift beyond its slope is limited.

Reason: the customary bound for what a normal prior still allows."""
SHIFTS = 12
"""Most steps in which the likeliest delay of a test is found, each along the slope of the force.

Reason: a jump of dry friction goes by a sample or two a step."""
SAME_DELAY = 1e-4
"""Change of the delay at which its search ends [standard deviations]: the misfit changes by its square."""
DISCREPANCY = 0.3
"""Share of what a model leaves (r.m.s.) that counts as noise of every harmonic alike while the model is being fitted: a
model that still lacks something must not be bent to where the noise happens to be smallest.

Reason: 0 believes the quietest harmonics whatever the model lacks, 1 leaves no evidence; about a tenth of the squares.
Not tuned."""
MOST_HARMONICS = 80
"""Highest harmonic of the cycle that is compared.

Reason: harmonics of a force whose slope jumps, as at yield, fall with their square: those beyond are below 2e-4 of the
first, and `RESOLUTION` is no finer."""
EQUAL_WEIGHT_DEVIATION = 0.05
"""Residual of the element without effects [share of the peak, r.m.s.], by which criterion (4) is set against the wide
priors of C and k.

Reason: what identify leaves of a damper that lacks a law is of this size; the priors hold only what no test shows. Not
tuned."""
CYCLE_POINTS = 256
"""Least number of points on which a cycle is simulated.

Reason: three points for each of the harmonics that are compared."""
FEWEST_SAMPLES = 2 * CYCLE_POINTS
"""Fewest samples of a motion that does not repeat.

Reason: fewer do not show the spectrum of their noise."""
FORGOTTEN = 1e-3
"""Share of the error of the first force that may be left where a cycle begins.

Reason: offset and gain of the test, a hundredth of the peak, are then below `RESOLUTION`."""
MOST_LEAD = 8
"""Half cycles in front of a cycle, at most: an element that remembers longer is a spring."""
MOST_POINTS = 2048
"""Largest number of points of a cycle: the compared harmonics need no finer grid, however slow the test.

Reason: 25 points for each of the harmonics that are compared."""


def weighted_record(
    p: CleanedRecord, mask: NDArray[np.bool_], base_row: int, given: PredictedForce, nuisance: NuisanceConfig
) -> WeightedRecord | None:
    """Weigh some samples of a record; None where they are too few.

    Parameters
    ----------
    p : the record
    mask : (n,) samples to be compared
    base_row : its base row; -1 where the voltage moves
    given : predicted force, along which gain and delay act
    nuisance : priors of the test's own offset, gain and delay
    """
    bare = weighed_by_noise(p, mask, base_row, given)
    return None if bare is None else with_nuisances(bare, given.damper, nuisance)


def weighed_by_noise(
    p: CleanedRecord, mask: NDArray[np.bool_], base_row: int, given: PredictedForce
) -> WeightedRecord | None:
    """Weigh some samples of a record by noise alone, no nuisance integrated out; see `weighted_record`."""
    if not enough_samples(p, mask):
        return None
    return (_from_cycles if _is_averaged(p) else _from_samples)(p, mask, base_row, given)


def enough_samples(p: CleanedRecord, mask: NDArray[np.bool_]) -> bool:
    """Whether some samples (n,) of a record can be weighed: a whole cycle where it repeats, else a long enough stretch.

    Parameters
    ----------
    p : the record
    mask : (n,) samples to be compared
    """
    if p.cycles is not None and _is_averaged(p):
        return bool(p.cycles.whole(p.record.time, mask))
    return int(np.count_nonzero(mask & in_motion(p.record))) >= FEWEST_SAMPLES


def _is_averaged(p: CleanedRecord) -> bool:
    """Whether a record counts as its average cycle; cycles differ where the damper warms, and it would hide that."""
    return p.cycles is not None and not temperature_moves(p.record.temperature)


def _from_cycles(
    p: CleanedRecord, mask: NDArray[np.bool_], base_row: int, given: PredictedForce
) -> WeightedRecord | None:
    run = p.cycles
    if run is None:
        return None
    time, record, whole = p.record.time, p.record, p.folded
    counted = run.whole(time, mask)
    simulated = run.fold(time, given.force)
    error = pure_error(whole - simulated)
    points = min(error.points, MOST_POINTS)
    cycle = _resampled(whole[counted].mean(axis=0), points)
    peak = float(np.max(np.abs(cycle)))
    average = _resampled(simulated.mean(axis=0), points)
    # A cycle on fewer points than it has samples has lost as much of its noise.
    variance = error.sample_variance / len(counted) * points / error.points
    left = DISCREPANCY * _model_discrepancy(cycle, average, np.gradient(average), variance)
    floor = ((RESOLUTION * peak) ** 2 + left**2) / (MOST_HARMONICS + 1) + given.shared_variance
    weights = np.sqrt(2.0 / (error.single / len(counted) + floor))[: MOST_HARMONICS + 1]
    weights[0] /= np.sqrt(2.0)
    slowest = max(row.C_Ns_per_m / row.k_N_per_m for row in given.damper.base)
    halves = int(np.clip(np.ceil(-np.log(FORGOTTEN) * slowest / (0.5 * run.period)), 1, MOST_LEAD))
    channels = [_resampled(channel, points) for channel in p.mean_motion]
    motion, lead, factor = _cycle_motion(record, run.period, channels, halves)
    return WeightedRecord(
        record.name,
        base_row,
        motion,
        float(cycle[-(lead // factor) % cycle.size]),
        lead + factor * np.arange(cycle.size),
        np.ones(cycle.size, dtype=np.bool_),
        cycle,
        peak,
        error,
        weights,
        MarginalisedNuisances.none(2 * weights.size - 1),
    )


def _model_discrepancy(measured: Array, force: Array, slope: Array, variance: float) -> float:
    """Compute the r.m.s. residual of a model above the noise [N], offset, gain and delay of the test fitted.

    Samples beside a jump count: without them a rigid damper is trusted so far that what is missing beside it, as a gas
    charge as large as its friction, is not found.
    """
    columns = np.column_stack([np.ones(force.size), force, slope])
    residual = measured - force
    residual = residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]
    return float(np.sqrt(max(np.mean(residual**2) - variance, 0.0)))


def _cycle_motion(record: Record, period: float, channels: Sequence[Array], halves: int) -> tuple[Motion, int, int]:
    """Return a cycle of the mean motion, with half cycles in front to settle, on a grid fine enough to simulate."""
    points = channels[0].size
    factor = int(np.ceil(CYCLE_POINTS / points))
    fine: Array = np.stack([_resampled(channel, points * factor) for channel in channels])
    # Each half holds a reversal, after which a friction has forgotten how it began; a spring forgets by C/k.
    lead = halves * (points // 2) * factor
    led = np.concatenate([np.tile(fine, halves)[:, -lead:], fine], axis=1)
    count = led.shape[1]
    time: Array = np.arange(count, dtype=np.float64) * (period / (points * factor))
    temperature = record.median_temperature()
    voltage = record.median_voltage()
    motion = Motion(
        time,
        led[0],
        led[1],
        led[2],
        None if voltage is None else np.full(count, voltage),
        None if temperature is None else np.full(count, temperature),
    )
    return motion, lead, factor


def _resampled(cycle: Array, points: int) -> Array:
    """Resample a periodic channel to another number of points by its harmonics."""
    if points == cycle.size:
        return cycle
    return np.asarray(np.fft.irfft(np.fft.rfft(cycle), points) * (points / cycle.size), dtype=np.float64)


def _from_samples(p: CleanedRecord, mask: NDArray[np.bool_], base_row: int, given: PredictedForce) -> WeightedRecord:
    record, force = p.record, given.force
    mask = mask & in_motion(record)
    first, *_, last = np.flatnonzero(mask)
    start, stop = int(first), int(last) + 1
    compared = mask[start:stop]
    measured = record.force[mask]
    calm = jumps_in_samples(record.force, force) + unresolved_turns(given.damper, record.displacement) == 0.0
    smooth = fit_smooth_residual(measured - force[mask], record, force[mask], mask, drawn_calm(given, calm, mask))
    noise = Autoregression(smooth.noise.coefficients, smooth.noise.innovation * smooth.excess)
    peak = float(np.max(np.abs(measured)))
    alike = _samples_per_harmonic(record)
    slope = gradient_within_stretches(force[mask], mask)
    discrepancy = _model_discrepancy(measured, force[mask], slope, noise.variance)
    left = alike * (DISCREPANCY * discrepancy) ** 2
    if left > noise.variance:
        noise = Autoregression(np.zeros(0), noise.variance + left)
    noise = Autoregression(noise.coefficients, max(noise.innovation, alike * (RESOLUTION * peak) ** 2))
    motion, places = simulation_motion(record)
    rows = int(np.count_nonzero(has_predecessors(compared, noise.coefficients.size)))
    return WeightedRecord(
        record.name,
        base_row,
        motion,
        float(record.force[0]),
        places[start:stop],
        compared,
        measured,
        peak,
        noise,
        np.zeros(0),
        MarginalisedNuisances.none(rows),
        given.timing[mask],
    )


def _samples_per_harmonic(record: Record) -> float:
    """Compute how many samples carry the same model error: it fills as many harmonics of the motion as a cycle shows.

    So what counts as noise has the same density at every sampling rate.
    """
    cycles = max(len(reversals(record.displacement)) / 2.0, 1.0)
    return max(record.time.size / (2.0 * MOST_HARMONICS * cycles), 1.0)


def with_nuisances(bare: WeightedRecord, damper: Damper, nuisance: NuisanceConfig) -> WeightedRecord:
    """Integrate out the test's own offset and gain, jumps and instants of the voltage, and find its likeliest delay.

    Cycles are folded by splines and a delayed force is read from one, which ring beside jumps: that is left out too.

    Equation: V = [s_o peak, s_g F, jumps, s_t dF/dt_U] in units of noise, see `MarginalisedNuisances`
    """
    averaged, delayed = isinstance(bare.noise, PureError), bare.delayed(*prompt_force(bare, damper))
    turns = unresolved_turns(damper, bare.at_compared(bare.motion.displacement), closed=averaged)
    found = replace(bare, delay_s=nuisance.delay_s)
    for _ in range(2):  # the second with the force where the likeliest delay puts it
        force = delayed(found.first_delay)
        bends = jumps(bare.measured, closed=True) if averaged else jumps_in_samples(bare.measured, force)
        columns = [np.full(force.size, nuisance.offset * bare.peak), nuisance.gain * force]
        whole = bare.standardised(np.column_stack([*columns, *([] if bare.timing is None else [bare.timing])]))
        beside = bare.single_samples(with_ringing(np.maximum(bends, turns), closed=averaged))
        found = replace(found, nuisances=MarginalisedNuisances.from_columns(whole, beside))
        if nuisance.delay_s > 0.0:
            if np.any(bends) or np.any(turns):
                found = replace(found, first_delay=found.delay_among_jumps(delayed))
            found = replace(found, first_delay=found.likeliest_delay(delayed))
    return found


def equally_weighted(weighed: WeightedRecord, samples: int, peak: float) -> WeightedRecord:
    """Weigh an observation as criterion (4) does: every sample alike, and no nuisances.

    Equation: |r|^2 = n mean (F - F_sim)^2 / s^2, s alike in all tests of one condition
                                                    Source: Makowski and Knap 2021, eq. (4); Parseval

    Parameters
    ----------
    weighed : the record as the likelihood takes it
    samples : that it counts for
    peak : largest force of its condition [N]
    """
    scale = EQUAL_WEIGHT_DEVIATION * peak
    if isinstance(weighed.noise, Autoregression):
        white = Autoregression(np.zeros(0), scale**2)
        nothing = MarginalisedNuisances.none(weighed.measured.size)
        return replace(weighed, noise=white, nuisances=nothing, delay_s=0.0)
    weights = np.full(weighed.weights.size, np.sqrt(2.0 * samples) / scale)
    weights[0] /= np.sqrt(2.0)
    nothing = MarginalisedNuisances.none(2 * weights.size - 1)
    return replace(weighed, weights=weights, nuisances=nothing, delay_s=0.0)
