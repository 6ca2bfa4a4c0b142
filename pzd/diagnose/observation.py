"""One record as the evidence weighs it: what is simulated, what it is held against, and in which units of noise.

A periodic record under constant conditions is its average cycle, harmonic by harmonic, each in
units of its own noise; any other is its samples, whitened. What offset, gain and delay of the test
may explain within their priors is taken out of both sides once and for all, so that a residual
that is left counts as it should: |r|^2 is minus twice the logarithm of the likelihood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pzd.damper.compose import respond, sampling_steps, value_of
from pzd.damper.effects.sensor_delay import law as moment
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnose.autoregression import Autoregression
from pzd.diagnose.config import NuisanceConfig
from pzd.diagnose.inputs import Prepared, sliced
from pzd.diagnose.jumps import jumps, jumps_in_samples
from pzd.diagnose.noise import PureError, pure_error
from pzd.diagnose.predict import motion_of, warms
from pzd.diagnose.rich import rich_fit
from pzd.diagnose.unsure import Expected
from pzd.identify.trial import warm_up
from pzd.record import Array, Record

RESOLUTION = 3e-4
"""No force is believed to be known better than this share of the record's peak (r.m.s.)."""
SIMULATION_TOLERANCE = 1e-8
"""Of the damper's path, as a share of the force."""
INSTANT = 1e-6
"""Delay by which the slope of a force over time is taken [s]."""
LATEST = 3.0
"""At most so many standard deviations of a test's delay are believed, in what its shift is more than the slope."""
DISCREPANCY = 0.3
"""Of what a model leaves (r.m.s.), this share counts as noise of every harmonic alike while the model is being
fitted: a model that still lacks something must not be bent to where the noise happens to be smallest."""
MOST_HARMONICS = 80
"""Beyond this harmonic of the cycle nothing of a damper's force is left to tell effects apart."""
CYCLE_POINTS = 256
"""A cycle is simulated on at least this many points."""
MOST_POINTS = 2048
"""And on no more: the harmonics that are compared need no finer grid, however slow the test."""


@dataclass(frozen=True, eq=False)
class Observation:
    """What one record, or a part of it, says."""

    name: str
    place: int
    """Which base row it belongs to; -1 where the voltage moves."""
    motion: Motion
    """(m,) what is simulated."""
    first: int
    """Samples of the motion that come before the first one compared."""
    stride: int
    """Motion samples from one compared sample to the next."""
    measured: Array
    """(n,) force [N]."""
    peak: float
    """Largest measured force [N]."""
    noise: PureError | Autoregression
    weights: Array
    """(H + 1,) of the harmonics of an average cycle; empty where samples are compared."""
    frame: Array
    """(w, q) orthonormal columns, in units of noise, along which nuisances move the force."""
    shrink: Array
    """(q,) factor on the residual along each of them."""

    @cached_property
    def steps(self) -> Array:
        """Sampling intervals of the motion [s], one where they are even."""
        return sampling_steps(self.motion.time)

    @property
    def begins_with(self) -> float:
        """Force with which the simulation begins [N]: that of the same phase where the motion repeats."""
        lead = self.first // self.stride
        return float(self.measured[-lead % self.measured.size if isinstance(self.noise, PureError) else 0])

    def at_compared(self, simulated: Array) -> Array:
        """(n,) or (n, p) of what was simulated at the samples that are compared."""
        return simulated[self.first :: self.stride][: self.measured.size]

    def delayed(self, simulated: Array, delay: float) -> Array:
        """(m,) what was simulated as a channel shows it that comes late [s], between the samples by a cubic."""
        from scipy.interpolate import CubicSpline

        if delay == 0.0:
            return simulated
        begin = self.first if isinstance(self.noise, PureError) else 0
        time = self.motion.time[begin:]
        shown = np.asarray(moment(time, delay))
        if begin == 0:
            return np.asarray(CubicSpline(time, simulated)(np.clip(shown, time[0], time[-1])))
        period = time[-1] - time[0] + self.steps[-1]
        whole = np.append(simulated[begin:], simulated[begin])
        cycle = CubicSpline(np.append(time, time[0] + period), whole, bc_type="periodic")
        return np.concatenate([simulated[:begin], cycle(shown)])

    def in_noise(self, values: Array) -> Array:
        """(w,) or (w, p) of a force or its derivatives at the compared samples, in units of noise."""
        flat = self._scaled(values)
        return flat - self.frame @ ((1.0 - self.shrink).reshape(-1, *([1] * (flat.ndim - 1))) * (self.frame.T @ flat))

    def _scaled(self, values: Array) -> Array:
        if isinstance(self.noise, Autoregression):
            return self.noise.whitened(values)
        weights = self.weights.reshape(-1, *([1] * (values.ndim - 1)))
        harmonics = np.fft.rfft(values, axis=0)[: self.weights.size] / len(values) * weights
        return np.concatenate([harmonics.real, harmonics.imag[1:]])


def observations(
    prepared: Sequence[Prepared],
    kept: Sequence[NDArray[np.bool_]],
    places: Sequence[int],
    simulated: Sequence[Expected],
    nuisance: NuisanceConfig,
) -> tuple[Observation, ...]:
    """The observations of some samples of some records.

    Parameters
    ----------
    prepared : the records
    kept : (n,) which samples of each count
    places : the base row of each
    simulated : what the damper makes of each, along which gain and delay act
    nuisance : priors of the tests' own offset, gain and delay
    """
    found = []
    for p, mask, place, given in zip(prepared, kept, places, simulated, strict=True):
        if np.any(mask):
            # Cycles differ where the damper warms, and their average would hide it.
            averaged = p.cycles is not None and place >= 0 and not warms(p.record.temperature)
            build = _of_cycles if averaged else _of_samples
            made = build(p, mask, place, given, nuisance)
            found += [made] if made is not None else []
    return tuple(found)


def _of_cycles(
    p: Prepared, mask: NDArray[np.bool_], place: int, given: Expected, nuisance: NuisanceConfig
) -> Observation | None:
    run = p.cycles
    if run is None:
        return None
    time, record, force = p.record.time, p.record, given.force
    whole = run.fold(time, record.force)
    numbers = run.number(time)
    counted = [n for n in range(run.count) if np.all(mask[numbers == n])]
    if not counted:
        return None
    error = pure_error(whole - run.fold(time, force))
    points = min(error.points, MOST_POINTS)
    cycle = _resampled(whole[counted].mean(axis=0), points)
    peak = float(np.max(np.abs(cycle)))
    average = _resampled(run.mean(time, force), points)
    left = DISCREPANCY * _left_by(cycle, average, error.sample_variance / len(counted))
    floor = ((RESOLUTION * peak) ** 2 + left**2) / error.single.size + given.unsure
    weights = np.sqrt(2.0 / (error.single / len(counted) + floor))[: MOST_HARMONICS + 1]
    weights[0] /= np.sqrt(2.0)
    bare = Observation(
        record.name,
        place,
        *_cycle_motion(record, run.period, [_resampled(run.mean(time, c), points) for c in _kinematics(record)]),
        cycle,
        peak,
        error,
        weights,
        np.zeros((2 * weights.size - 1, 0)),
        np.zeros(0),
    )
    return with_nuisances(bare, given.damper, nuisance)


def _left_by(measured: Array, force: Array, variance: float) -> float:
    """R.m.s. of what a model leaves above the noise [N], offset, gain and delay of the test taken off."""
    columns = np.column_stack([np.ones(force.size), force, np.gradient(force)])
    residual = measured - force
    residual = residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]
    return float(np.sqrt(max(np.mean(residual**2) - variance, 0.0)))


def _kinematics(record: Record) -> tuple[Array, Array, Array]:
    return record.displacement, record.velocity, record.acceleration


def _cycle_motion(record: Record, period: float, channels: Sequence[Array]) -> tuple[Motion, int, int]:
    """A cycle of the mean motion, half a cycle before it to settle in, on a grid fine enough to simulate."""
    points = channels[0].size
    factor = int(np.ceil(CYCLE_POINTS / points))
    fine: Array = np.stack([_resampled(channel, points * factor) for channel in channels])
    lead = points // 2 * factor  # it holds a reversal, after which the element has forgotten how it began
    led = np.concatenate([fine[:, -lead:], fine], axis=1)
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
    """A periodic channel on more points or fewer, by its own harmonics."""
    if points == cycle.size:
        return cycle
    return np.asarray(np.fft.irfft(np.fft.rfft(cycle), points) * (points / cycle.size), dtype=np.float64)


def _of_samples(
    p: Prepared, mask: NDArray[np.bool_], place: int, given: Expected, nuisance: NuisanceConfig
) -> Observation | None:
    record, force = p.record, given.force
    start = max(int(np.argmax(mask)), warm_up(record.displacement))
    stop = int(mask.size - np.argmax(mask[::-1]))
    if stop - start < 2 * CYCLE_POINTS:
        return None
    noise = rich_fit(record.force[start:stop] - force[start:stop], _part(record, start, stop), force[start:stop]).noise
    peak = float(np.max(np.abs(record.force[start:stop])))
    left = DISCREPANCY * _left_by(record.force[start:stop], force[start:stop], noise.variance)
    if left**2 > noise.variance:
        noise = Autoregression(np.zeros(0), noise.variance + left**2)
    noise = Autoregression(noise.coefficients, max(noise.innovation, (RESOLUTION * peak) ** 2))
    motion, factor = motion_of(record, constant=p.constant)
    bare = Observation(
        record.name,
        place,
        motion,
        start * factor,
        factor,
        record.force[start:stop],
        peak,
        noise,
        np.zeros(0),
        np.zeros((stop - start - noise.coefficients.size, 0)),
        np.zeros(0),
    )
    return with_nuisances(bare, given.damper, nuisance, given.timing[start:stop])


def _part(record: Record, start: int, stop: int) -> Record:
    kept = np.zeros(record.time.size, dtype=np.bool_)
    kept[start:stop] = True
    return sliced(record, kept)


def response(observation: Observation, damper: Damper, late: float = 0.0) -> Array:
    """(n,) force that a damper gives at the compared samples [N], shown by a channel that comes later by `late` [s]."""
    o, tau = observation, value_of(damper, "sensor_delay", "tau")
    prompt = damper.model_copy(update={"effects": {n: e for n, e in damper.effects.items() if n != "sensor_delay"}})
    force = respond(prompt, o.motion, o.begins_with, SIMULATION_TOLERANCE)
    return o.at_compared(o.delayed(force, tau + late))


def with_nuisances(
    bare: Observation, damper: Damper, nuisance: NuisanceConfig, timing: Array | None = None
) -> Observation:
    """The observation with the test's own offset, gain and delay, jumps and instants of the voltage integrated out.

    Equation: r' = (I + V V')^(-1/2) r, V = [-s_d dF/dt, s_o peak, s_g F, jumps, s_t dF/dt_U] in units of noise
                                                    Source: Gaussian prior, marginal likelihood

    A delay shifts the force and does not merely add its slope: what the shift by the likeliest delay d is more than
    that, F(t - d) - F + d dF/dt, is taken off the measured force.
    """
    force, averaged = response(bare, damper), isinstance(bare.noise, PureError)
    late = (response(bare, damper, INSTANT) - force) / INSTANT
    columns = np.column_stack(
        [
            nuisance.delay_s * late,
            np.full(force.size, nuisance.offset * bare.peak),
            nuisance.gain * force,
            _beside(jumps(bare.measured) if averaged else jumps_in_samples(bare.measured, force)),
            *([] if timing is None else [timing]),
        ]
    )
    left, size, right = np.linalg.svd(bare.in_noise(columns), full_matrices=False)
    likeliest = right[:, 0] @ (size / (1.0 + size**2) * (left.T @ bare.in_noise(bare.measured - force)))
    delay = nuisance.delay_s * float(np.clip(likeliest, -LATEST, LATEST))
    measured = bare.measured - (response(bare, damper, delay) - force - delay * late)
    return replace(bare, measured=measured, frame=left, shrink=1.0 / np.sqrt(1.0 + size**2))


def _beside(bends: Array) -> Array:
    """(n, j) one column a sample beside a jump, as large as the force bends there [N]."""
    beside = np.flatnonzero(bends)
    columns = np.zeros((bends.size, beside.size))
    columns[beside, np.arange(beside.size)] = bends[beside]
    return columns
