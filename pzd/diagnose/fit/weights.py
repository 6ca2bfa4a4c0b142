"""How the evidence weighs every record: average cycles or samples, the noise in each, and what is no evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnose.data.cleaning import Prepared
from pzd.diagnose.fit.input_uncertainty import Predicted
from pzd.diagnose.fit.integrated_out import IntegratedOut
from pzd.diagnose.fit.likelihood import RecordLikelihood, responses
from pzd.diagnose.fit.prediction import motion_of, warms
from pzd.identify.trial import in_motion
from pzd.record import Array, Record
from pzd.signals.autoregression import Autoregression
from pzd.signals.between_cycles import PureError, pure_error
from pzd.signals.jumps import jumps, jumps_in_samples
from pzd.signals.left_out import slope_within, unbroken
from pzd.signals.nuisance import NuisanceConfig
from pzd.signals.reversals import reversals
from pzd.signals.smooth_residual import fit_smooth_residual

RESOLUTION = 3e-4
"""No force is believed to be known better than this share of the record's peak (r.m.s.).

Reason: a good load cell is right to 0.03 % of its range; without a floor a quiet record would decide
alone. Not tuned."""
INSTANT = 1e-6
"""Delay by which the slope of a force over time is taken [s].

Reason: far below a sample, far above the rounding of a time stamp."""
LATEST = 3.0
"""At most so many standard deviations of a test's delay are believed, in what its shift is more than the slope.

Reason: the customary bound for what a normal prior still allows."""
DISCREPANCY = 0.3
"""Of what a model leaves (r.m.s.), this share counts as noise of every harmonic alike while the model is being
fitted: a model that still lacks something must not be bent to where the noise happens to be smallest.

Reason: 0 believes the quietest harmonics whatever the model lacks, 1 leaves no evidence; about a tenth of the squares.
Not tuned."""
MOST_HARMONICS = 80
"""Beyond this harmonic of the cycle nothing of a damper's force is left to tell effects apart.

Reason: harmonics of a force whose slope jumps, as at yield, fall with their square: those beyond are below 2e-4 of
the first, and `RESOLUTION` is no finer."""
UNWEIGHTED = 0.05
"""What a plain element leaves [share of the peak, r.m.s.], to set criterion (4) against the wide priors of C and k.

Reason: what identify leaves of a damper that lacks a law is of this size; the priors hold only what no test
shows. Not tuned."""
CYCLE_POINTS = 256
"""A cycle is simulated on at least this many points.

Reason: three points for each of the harmonics that are compared."""
FEWEST_SAMPLES = 2 * CYCLE_POINTS
"""Fewer samples of a motion that does not repeat do not show what colour their noise has."""
MOST_POINTS = 2048
"""And on no more: the harmonics that are compared need no finer grid, however slow the test.

Reason: 25 points for each of the harmonics that are compared."""


def record_likelihood(
    p: Prepared, mask: NDArray[np.bool_], place: int, given: Predicted, nuisance: NuisanceConfig
) -> RecordLikelihood | None:
    """The observation of some samples of a record; None where they are too few.

    Parameters
    ----------
    p : the record
    mask : (n,) which of its samples count
    place : its base row; -1 where the voltage moves
    given : what the damper makes of it, along which gain and delay act
    nuisance : priors of the test's own offset, gain and delay
    """
    if not enough(p, mask):
        return None
    return (_of_cycles if _averaged(p) else _of_samples)(p, mask, place, given, nuisance)


def enough(p: Prepared, mask: NDArray[np.bool_]) -> bool:
    """Whether some samples (n,) of a record can be weighed: a whole cycle where it repeats, else a long enough stretch.

    Parameters
    ----------
    p : the record
    mask : (n,) which of its samples count
    """
    if p.cycles is not None and _averaged(p):
        return bool(p.cycles.whole(p.record.time, mask))
    return int(np.count_nonzero(mask & in_motion(p.record))) >= FEWEST_SAMPLES


def _averaged(p: Prepared) -> bool:
    """Whether a record counts as its average cycle; cycles differ where the damper warms, and it would hide that."""
    return p.cycles is not None and not warms(p.record.temperature)


def _of_cycles(
    p: Prepared, mask: NDArray[np.bool_], place: int, given: Predicted, nuisance: NuisanceConfig
) -> RecordLikelihood | None:
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
    left = DISCREPANCY * _left_by(cycle, average, np.gradient(average), error.sample_variance / len(counted))
    floor = ((RESOLUTION * peak) ** 2 + left**2) / (MOST_HARMONICS + 1) + given.displacement_variance
    weights = np.sqrt(2.0 / (error.single / len(counted) + floor))[: MOST_HARMONICS + 1]
    weights[0] /= np.sqrt(2.0)
    motion, lead, factor = _cycle_motion(record, run.period, [_resampled(channel, points) for channel in p.mean_motion])
    bare = RecordLikelihood(
        record.name,
        place,
        motion,
        float(cycle[-(lead // factor) % cycle.size]),
        lead + factor * np.arange(cycle.size),
        np.ones(cycle.size, dtype=np.bool_),
        cycle,
        peak,
        error,
        weights,
        IntegratedOut.nothing(2 * weights.size - 1),
    )
    return with_nuisances(bare, given.damper, nuisance)


def _left_by(measured: Array, force: Array, slope: Array, variance: float) -> float:
    """R.m.s. of what a model leaves above the noise [N], offset, gain and delay of the test taken off."""
    columns = np.column_stack([np.ones(force.size), force, slope])
    residual = measured - force
    residual = residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]
    return float(np.sqrt(max(np.mean(residual**2) - variance, 0.0)))


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
    p: Prepared, mask: NDArray[np.bool_], place: int, given: Predicted, nuisance: NuisanceConfig
) -> RecordLikelihood:
    record, force = p.record, given.force
    mask = mask & in_motion(record)
    first, *_, last = np.flatnonzero(mask)
    start, stop = int(first), int(last) + 1
    compared = mask[start:stop]
    measured = record.force[mask]
    noise = fit_smooth_residual(measured - force[mask], record, force[mask], mask).noise
    peak = float(np.max(np.abs(measured)))
    alike = _samples_alike(record)
    left = alike * (DISCREPANCY * _left_by(measured, force[mask], slope_within(force[mask], mask), noise.variance)) ** 2
    if left > noise.variance:
        noise = Autoregression(np.zeros(0), noise.variance + left)
    noise = Autoregression(noise.coefficients, max(noise.innovation, alike * (RESOLUTION * peak) ** 2))
    motion, places = motion_of(record)
    rows = int(np.count_nonzero(unbroken(compared, noise.coefficients.size)))
    bare = RecordLikelihood(
        record.name,
        place,
        motion,
        float(record.force[0]),
        places[start:stop],
        compared,
        measured,
        peak,
        noise,
        np.zeros(0),
        IntegratedOut.nothing(rows),
    )
    return with_nuisances(bare, given.damper, nuisance, given.timing[mask])


def _samples_alike(record: Record) -> float:
    """Samples that say the same of what a model leaves: it fills as many harmonics of the motion as a cycle shows.

    So what counts as noise has the same density at every sampling rate.
    """
    cycles = max(len(reversals(record.displacement)) / 2.0, 1.0)
    return max(record.time.size / (2.0 * MOST_HARMONICS * cycles), 1.0)


def with_nuisances(
    bare: RecordLikelihood, damper: Damper, nuisance: NuisanceConfig, timing: Array | None = None
) -> RecordLikelihood:
    """The observation with the test's own offset, gain and delay, jumps and instants of the voltage integrated out.

    Equation: V = [-s_d dF/dt, s_o peak, s_g F, jumps, s_t dF/dt_U] in units of noise, see `IntegratedOut`

    A delay shifts the force and does not merely add its slope: what the shift by the likeliest delay d is more than
    that, F(t - d) - F + d dF/dt, is taken off the measured force.
    """
    shown = responses(bare, damper)
    force, averaged = shown(0.0), isinstance(bare.noise, PureError)
    late = (shown(INSTANT) - force) / INSTANT
    columns = np.column_stack(
        [
            nuisance.delay_s * late,
            np.full(force.size, nuisance.offset * bare.peak),
            nuisance.gain * force,
            _neighbours_of(jumps(bare.measured) if averaged else jumps_in_samples(bare.measured, force)),
            *([] if timing is None else [timing]),
        ]
    )
    nuisances = IntegratedOut.of(bare.in_noise(columns))
    likeliest = float(nuisances.likeliest(bare.in_noise(bare.measured - force))[0])
    delay = nuisance.delay_s * float(np.clip(likeliest, -LATEST, LATEST))
    measured = bare.measured - (shown(delay) - force - delay * late)
    return replace(bare, measured=measured, nuisances=nuisances)


def unweighted(weighed: RecordLikelihood, samples: int, peak: float) -> RecordLikelihood:
    """The observation as criterion (4) takes it: every sample alike, and nothing left to the test's own nuisances.

    Equation: |r|^2 = n mean (F - F_sim)^2 / s^2, s alike in all tests of one condition
                                                    Source: Makowski and Knap 2021, eq. (4); Parseval

    Parameters
    ----------
    weighed : the record as the likelihood takes it
    samples : that it counts for
    peak : largest force of its condition [N]
    """
    scale = UNWEIGHTED * peak
    if isinstance(weighed.noise, Autoregression):
        white = Autoregression(np.zeros(0), scale**2)
        return replace(weighed, noise=white, nuisances=IntegratedOut.nothing(weighed.measured.size))
    weights = np.full(weighed.weights.size, np.sqrt(2.0 * samples) / scale)
    weights[0] /= np.sqrt(2.0)
    return replace(weighed, weights=weights, nuisances=IntegratedOut.nothing(2 * weights.size - 1))


def _neighbours_of(bends: Array) -> Array:
    """(n, j) one column a sample beside a jump, as large as the force bends there [N]."""
    beside = np.flatnonzero(bends)
    columns = np.zeros((bends.size, beside.size))
    columns[beside, np.arange(beside.size)] = bends[beside]
    return columns
