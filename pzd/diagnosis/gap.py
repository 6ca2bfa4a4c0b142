"""The gap between simulation and measurement: residual of a record, size, probability by noise, and where it lies."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import Gap, Region
from pzd.diagnosis import thresholds
from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.diagnosis.fit.prediction import PredictedForce, comparable_samples, drawn_calm, unresolved_turns
from pzd.diagnosis.roles import Split
from pzd.record import CONSTANT_SHARE, Array, Mask, Record
from pzd.signals import lack_of_fit
from pzd.signals.harmonics import hum
from pzd.signals.jumps import jump_timing_error, jumps_in_cycles, jumps_in_samples
from pzd.signals.measures import criterion_error, reversals
from pzd.signals.noise import PureError, harmonics_of, pure_error, repeatable_power
from pzd.signals.nuisance import NuisanceConfig, likely_delay, nuisance_forces


@dataclass(frozen=True, eq=False)
class ResidualCheck:
    """Residual of one record against a damper, over the checked samples, with its noise."""

    cleaned: CleanedRecord
    wanted: Mask
    """(n,) checked samples."""
    calm: Mask
    """(n,) samples beside no jump of the force."""
    residual: Array
    """(n,) measured less predicted force [N]."""
    nuisances: Array
    """(n,) part of it explained by offset, gain, delay and mains of the test, and by chance near jumps [N]."""
    variance: float
    """Of one sample by noise [N^2]."""
    power: float
    """Mean square above the noise of what repeats or is smooth [N^2]; about zero without a gap."""
    probability: dict[str, Array]
    """Probability by noise alone, by kind of test (`harmonics`, `trend`, `smooth`)."""
    error: PureError | None
    """Harmonics and noise of the average cycle, where cycles repeat."""
    folded: Array | None
    """(cycles, points) residual less nuisances, where cycles repeat [N]."""
    hum: float
    """Amplitude of the mains among the nuisances [N]; 0 where no line stands out."""
    explained: Array | None
    """(n,) squared smooth part of the residual less its share of noise, where nothing repeats [N^2]."""

    @property
    def cleared(self) -> Array:
        """(n,) residual less nuisances [N]."""
        return self.residual - self.nuisances

    @property
    def predicted(self) -> Array:
        """(n,) force that the damper gives [N]."""
        return self.cleaned.record.force - self.residual

    @property
    def peak(self) -> float:
        """Peak force of the record [N]."""
        return float(np.max(np.abs(self.cleaned.record.force)))


def check_residual(
    given: PredictedForce, cleaned: CleanedRecord, wanted: Mask, config: NuisanceConfig
) -> ResidualCheck:
    """Compare a record with its predicted force, over the wanted samples past the warm-up.

    Parameters
    ----------
    given : force that a damper predicts for the record
    cleaned : the record
    wanted : (n,) samples that are asked for
    config : how far offset, gain and delay of a test may go

    Returns
    -------
    what is left of the force in these samples, and how probable it is by noise alone
    """
    record = cleaned.record
    predicted, residual = given.force, record.force - given.force
    mask = wanted & comparable_samples(cleaned)
    run, peak = cleaned.cycles, float(np.max(np.abs(record.force)))
    # The mains nearly repeat from cycle to cycle, as a gap does.
    mains = hum(record.time, residual, mask, run.frequency if run else 0.0, thresholds.LEAST_HUM * peak)
    without = residual - mains
    calm = jump_bend(cleaned, predicted) + unresolved_turns(given.damper, record.displacement) == 0.0
    variance = _difference_variance(cleaned, without, mask, calm)
    force, shifted = record.force - mains, _shifted(cleaned, predicted)

    def explained_with(late: Array) -> Array:
        """Return the (n,) part explained where a shifted prediction is the one that gain and offset act along [N]."""
        size, timing = np.zeros(force.size), np.zeros(force.size)
        left, own = (
            (force - late)[mask],
            (late[mask], record.rate, variance, config, given.timing[mask], calm[mask], mask),
        )
        size[mask], timing[mask] = nuisance_forces(left, *own)
        near_jumps = _nuisance_near_jumps(force, late, size, timing, closed=run is not None)
        return late - predicted + np.where(mask & ~calm, near_jumps, size + timing)

    # A delay of more than a sample moves a flank; a jump between two samples it moves to chance.
    delay = likely_delay(force[mask], lambda late: shifted(late)[mask], variance, config, calm[mask])
    ways = explained_with(predicted), explained_with(shifted(delay))
    explained = mains + min(ways, key=lambda way: float(np.sum((without - way)[mask] ** 2)))
    folded = _folded(cleaned, residual - explained, mask)
    if folded is not None:
        found = _check_cycles(cleaned, mask, calm, residual, explained, folded, given.shared_variance)
    else:
        drawn = drawn_calm(given, calm, mask)
        found = _check_samples(cleaned, mask, calm, residual, explained, predicted, drawn)
    return replace(found, hum=float(np.max(np.abs(mains))))


def _shifted(cleaned: CleanedRecord, force: Array) -> Callable[[float], Array]:
    """Return a predicted force (n,) [N] as a function of a delay [s], by a cubic that does not overshoot a jump.

    Beyond either end the motion goes on as it did a cycle before or after, where it repeats; else it rests.
    """
    from scipy.interpolate import Akima1DInterpolator

    time, period = cleaned.record.time, 0.0 if cleaned.cycles is None else cleaned.cycles.period
    course = Akima1DInterpolator(time, force, method="makima")

    def late(delay: float) -> Array:
        moments = time - delay
        moments = moments + period * (moments < time[0]) - period * (moments > time[-1])
        return np.asarray(course(np.clip(moments, time[0], time[-1])))

    return lambda delay: late(delay) if delay else force


def jump_bend(cleaned: CleanedRecord, predicted: Array) -> Array:
    """Compute (n,) how far the force bends near a jump [N]; 0 elsewhere."""
    record, run = cleaned.record, cleaned.cycles
    if run is None:
        return jumps_in_samples(record.force, predicted, len(reversals(record.displacement)))
    return jumps_in_cycles(run, record.time, record.force)


def _nuisance_near_jumps(force: Array, predicted: Array, size: Array, timing: Array, *, closed: bool) -> Array:
    """Compute the (n,) part explained by a test and chance near a jump [N]: where its parts leave less, with them.

    Parameters
    ----------
    force, predicted : (n,) [N]
    size, timing : (n,) part explained by offset and gain, and by the delay along the slope [N]
    closed : whether these are whole cycles
    """
    parts = np.zeros(size.size), size, size + timing
    found = np.stack([part + jump_timing_error(force - part, predicted, closed=closed) for part in parts])
    least = np.argmin(np.abs(force - predicted - found), axis=0)
    return np.asarray(np.take_along_axis(found, least[np.newaxis], axis=0)[0])


def _check_cycles(
    cleaned: CleanedRecord,
    mask: Mask,
    calm: Mask,
    residual: Array,
    nuisances: Array,
    folded: Array,
    shared: Array | float,
) -> ResidualCheck:
    error = replace(pure_error(folded), shared=shared)
    trend = lack_of_fit.p_value_of_trend(folded)
    probability = {"harmonics": lack_of_fit.p_values_by_harmonics(error)}
    if trend is not None:
        probability["trend"] = np.array([trend])
    power = float(repeatable_power(error).sum())
    if trend is not None and trend < thresholds.CYCLE_CHANGE_SIGNIFICANCE:
        power += _trend_power(folded, error)
    return ResidualCheck(
        cleaned, mask, calm, residual, nuisances, error.sample_variance, power, probability, error, folded, 0.0, None
    )


def _check_samples(
    cleaned: CleanedRecord,
    mask: Mask,
    calm: Mask,
    residual: Array,
    nuisances: Array,
    predicted: Array,
    drawn: Sequence[tuple[Record, Array]],
) -> ResidualCheck:
    cleared = (residual - nuisances)[mask]
    fit = lack_of_fit.fit_smooth_residual(cleared, cleaned.record, predicted[mask], mask, drawn)
    left = cleared - fit.explained
    variance = min(fit.noise.variance, float(np.mean(left**2)) + float(np.mean(fit.spread)))
    explained = np.zeros(residual.size)
    explained[mask] = fit.explained**2 - fit.spread
    power = float(np.mean(explained[mask]))
    probability = {"smooth": np.array([fit.probability])}
    return ResidualCheck(
        cleaned, mask, calm, residual, nuisances, variance, power, probability, None, None, 0.0, explained
    )


def _folded(cleaned: CleanedRecord, residual: Array, mask: Mask) -> Array | None:
    """Return the wanted whole cycles of the residual, one row each; None where they do not tell noise from misfit."""
    run = cleaned.cycles
    if run is None:
        return None
    time = cleaned.record.time
    whole = run.whole(time, mask)
    folded = run.fold(time, residual)[whole]
    return folded if lack_of_fit.cycles_tell_noise(*folded.shape) else None


OUT_OF_REACH = 0.01
"""Share of a sample in a point of a folded cycle up to which the point counts as apart from it: a hundredth of a jump,
which is small beside noise wherever friction does not hide all else. Not tuned."""


def _difference_variance(cleaned: CleanedRecord, residual: Array, mask: Mask, calm: Mask) -> float:
    """Estimate the variance of the noise from differences, accurate enough for the priors of the nuisances.

    Those beside a jump tell in which sample it fell: as noise, they would hide what the test has of its own.
    """
    folded, beside = _folded(cleaned, residual, mask), _folded(cleaned, np.where(calm, 0.0, 1.0), mask)
    if folded is None or beside is None:
        steps, counted = np.diff(residual[mask]), calm[mask][1:] & calm[mask][:-1]
    else:
        shares = np.abs(beside).max(axis=0)  # the spline of a fold reaches a few samples beyond
        steps, counted = np.diff(folded, axis=0), np.broadcast_to(shares < OUT_OF_REACH, folded[1:].shape)
    counted = counted if np.any(counted) else np.ones(counted.shape, dtype=np.bool_)
    return float(np.mean(steps[counted] ** 2) / 2.0)


def _trend_power(folded: Array, error: PureError) -> float:
    """Compute the mean square of a steady change from cycle to cycle, less its share of noise [N^2]."""
    count, points = folded.shape
    if count < lack_of_fit.TREND_CYCLES:
        return 0.0
    last = min(lack_of_fit.TREND_HARMONICS, harmonics_of(points))
    order = np.arange(count) - (count - 1) / 2.0
    coefficients = np.fft.rfft(folded, axis=1)[:, : last + 1] / points
    slopes = np.abs(order @ coefficients / (order @ order)) ** 2 - error.single[: last + 1] / (order @ order)
    return float((slopes[0] + 2.0 * slopes[1:].sum()) * np.mean(order**2))


# --- Size of the gap and its probability by noise


BLOCKS = 8
"""Blocks over which the scatter of the gap is estimated in a record that does not repeat."""


def held_out_criterion(held_out: Sequence[ResidualCheck], split: Split) -> Gap:
    """Pool criterion (4) over the held-out samples, with noise floor and standard error; `after` equals `before`.

    Equation: W_s = sum r^2 / sum F^2;  floor = sum_records (s^2 + nuisances) / sum F^2 as in `noise_floors`;
    standard error of the ratio over cycles or blocks
                                           Source: Makowski and Knap 2021, eq. (4); Cochran 1977, eq. (6.9)
    """
    errors = np.concatenate([_by_block(j, j.residual**2) for j in held_out])
    forces = np.concatenate([_by_block(j, j.cleaned.record.force**2) for j in held_out])
    total = float(forces.sum())
    criterion = float(errors.sum()) / total
    noise, own = np.sum([noise_floors(j) for j in held_out], axis=0) / total
    return Gap(
        before=criterion,
        after=criterion,
        noise_floor=min(float(noise + own), criterion),  # at most, but for rounding
        tests_own=min(float(own), criterion),
        standard_error=criterion_error(errors, forces),
        held_out=split.held_out,
        hold_out=split.hold_out,
    )


def noise_floors(check: ResidualCheck) -> tuple[float, float]:
    """Compute what noise, and what the test's own nuisances leave of one record, summed over the checked samples [N^2].

    The nuisances count with what they take away, at most: near a jump they move the residual without making it smaller.
    Noise is the scatter between cycles or about a smooth residual, at most what the nuisances leave. So noise never
    exceeds the gap that it is part of.

    Equation: sum min(s^2, mean c^2),  min(sum n^2, sum r^2 - sum c^2),  c = r - n, n the nuisances
    """
    residual, cleared = check.residual[check.wanted], check.cleared[check.wanted]
    nuisances = check.nuisances[check.wanted]
    before, after = float(residual @ residual), float(cleared @ cleared)
    taken = min(max(before - after, 0.0), float(nuisances @ nuisances))
    return min(check.variance * residual.size, after, before), taken


def _by_block(check: ResidualCheck, values: Array) -> Array:
    """Sum (n,) values over the checked samples of each cycle, or of each block."""
    kept = values[check.wanted]
    run = check.cleaned.cycles
    if run is None:
        return np.array([part.sum() for part in np.array_split(kept, min(BLOCKS, max(kept.size, 1)))])
    number = run.number(check.cleaned.record.time)[check.wanted]
    return np.array([kept[number == j].sum() for j in np.unique(number)])


def probability_of_noise(checks: Sequence[ResidualCheck]) -> float:
    """Compute the probability that noise alone looks so in any kind of test (Bonferroni over the kinds)."""
    kinds = {kind for c in checks for kind in c.probability}
    pooled = [lack_of_fit.pooled_p_value([c.probability[k] for c in checks if k in c.probability]) for k in kinds]
    return min(1.0, *(len(kinds) * p for p in pooled))


def visible_gap(checks: Sequence[ResidualCheck]) -> float:
    """Compute the r.m.s. gap above the noise as a share of each record's peak force, pooled over the samples."""
    return _pooled(checks, [c.power / c.peak**2 for c in checks])


def gap_with_nuisances(checks: Sequence[ResidualCheck]) -> float:
    """Compute the r.m.s. error above the noise as a share of each record's peak force, pooled over the samples.

    Unlike `visible_gap` it holds what a zero, gain and delay of each test would explain.
    """
    squares = [float(np.mean(c.residual[c.wanted] ** 2)) - c.variance for c in checks]
    return _pooled(checks, [square / c.peak**2 for square, c in zip(squares, checks, strict=True)])


def gap_in_force(checks: Sequence[ResidualCheck]) -> float:
    """Compute the r.m.s. gap above the noise [N], pooled over the samples: the tests of large force count most."""
    return _pooled(checks, [c.power for c in checks])


def _pooled(checks: Sequence[ResidualCheck], squares: Sequence[float]) -> float:
    samples = np.array([np.count_nonzero(c.wanted) for c in checks], dtype=np.float64)
    return float(np.sqrt(max(float(samples @ np.array(squares) / samples.sum()), 0.0)))


# --- Where the gap lies

Labels = NDArray[np.str_]

DENSER = 1.25
"""Ratio of the shares of gap and samples from which a region is reported."""
LEAST_SHARE = 0.15
"""Share of the gap from which a region is reported."""
LEAST_SHARE_OF_THIRD = 0.5
"""Share of the gap from which a third of the run is reported: single cycles are noisy."""
MOST_REGIONS = 10
"""Regions reported, at most: what fits in one table of the report."""


def regions(checks: Sequence[ResidualCheck], unit: str, displacement_zero: float = 0.0) -> tuple[Region, ...]:
    """Find the regions in which the gap is denser than elsewhere, most telling first.

    Parameters
    ----------
    checks : records against the damper
    unit : of the control signal
    displacement_zero : recorded displacement where that of `checks` is zero [m]

    Returns
    -------
    regions in words with their share of the gap; empty where there is no gap above the noise
    """
    points = [_points(check) for check in checks]
    density, weight = (np.concatenate([p[name] for p in points]) for name in ("density", "weight"))
    if float(density.sum()) <= 0.0:
        return ()
    speed = max(float(np.max(np.abs(p["velocity"]))) for p in points)
    stroke = max(float(np.ptp(p["displacement"])) for p in points)
    labels: dict[str, list[Labels]] = {}
    for check, p in zip(checks, points, strict=True):
        for axis, words in _labels(check, p, speed, stroke, unit, displacement_zero).items():
            labels.setdefault(axis, []).append(words)
    found: list[tuple[float, Region]] = []
    for parts in labels.values():
        if len(parts) == len(checks):  # an axis that some test lacks, such as temperature, divides no whole gap
            found += _denser(np.concatenate(parts), density, weight)
    found += _frequencies(checks, float(density.sum()))
    found += _thirds(checks)
    found.sort(key=lambda item: -item[0])
    return tuple(region for _, region in found[:MOST_REGIONS]) or (Region(region="everywhere alike", share_of_gap=1.0),)


def _points(check: ResidualCheck) -> dict[str, Array]:
    """Return motion, density of the gap [N^2] and number of samples: along the average cycle, or at every sample.

    The density is the squared residual less its share of noise; it sums to the gap.
    """
    record, run = check.cleaned.record, check.cleaned.cycles
    names = ("velocity", "displacement", "acceleration")
    if check.folded is None or run is None:
        keep = check.wanted
        motion = {name: getattr(record, name)[keep] for name in names}
        density = (check.cleared**2 - check.variance if check.explained is None else check.explained)[keep]
        voltage = record.voltage[keep] if record.voltage is not None else np.full(density.size, np.nan)
        return {**motion, "density": density, "weight": np.ones(density.size), "voltage": voltage}
    count = check.folded.shape[0]
    mean = check.folded.mean(axis=0)
    motion = {name: run.mean(record.time, getattr(record, name)) for name in names}
    voltage = np.full(mean.size, record.median_voltage() if record.voltage is not None else np.nan)
    density = count * (mean**2 - check.variance / count)
    return {**motion, "density": density, "weight": np.full(mean.size, float(count)), "voltage": voltage}


def _labels(
    check: ResidualCheck, p: dict[str, Array], speed: float, stroke: float, unit: str, displacement_zero: float
) -> dict[str, Labels]:
    """Return by axis the (n,) region in words that each point belongs to; positions as recorded."""
    v, x, a = p["velocity"], p["displacement"], p["acceleration"]
    distance = 0.25 * stroke  # edges to two figures of it
    sides = np.round([displacement_zero - distance, displacement_zero + distance], 1 - math.floor(math.log10(distance)))
    fast = _bands(np.abs(v), _rounded(np.array([0.1, 0.33, 0.67]) * speed), "abs(v)", "m/s")
    found = {
        "velocity": fast,
        "position": _bands(x + displacement_zero, sides, "x", "m"),
        "direction": np.where(v >= 0.0, "rebound (v > 0)", "compression (v < 0)"),
        "phase": np.where(v * a >= 0.0, "speeding up", "slowing down"),
    }
    if np.all(np.isfinite(p["voltage"])):
        words = _voltages(p["voltage"], unit)
        found["voltage"] = words
        found["velocity and voltage"] = np.char.add(np.char.add(fast, ", "), words)
    temperature = check.cleaned.record.median_temperature()
    if temperature is not None:
        found["temperature"] = np.full(v.size, f"{temperature:.0f} degC")
    return found


def _voltages(voltage: Array, unit: str) -> Labels:
    """Label voltages to three figures; a moving one in fifths of its range."""
    span = float(np.ptp(voltage))
    if span <= CONSTANT_SHARE * float(np.max(np.abs(voltage))):
        return np.full(voltage.size, f"{float(np.median(voltage)):.3g} {unit}")
    return _bands(voltage, _rounded(voltage.min() + span * np.array([0.2, 0.4, 0.6, 0.8])), "moving control", unit)


def _bands(values: Array, edges: Array, name: str, unit: str) -> Labels:
    numbers = [f"{edge:.6g}" for edge in edges]
    words = [f"{name} < {numbers[0]} {unit}"]
    words += [f"{low} < {name} < {high} {unit}" for low, high in pairwise(numbers)]
    words.append(f"{name} > {numbers[-1]} {unit}")
    return np.array(words)[np.searchsorted(edges, values)]


def _rounded(edges: Array) -> Array:
    """Round edges to two figures, so that the labels state them exactly."""
    return np.array([float(f"{edge:.2g}") for edge in edges])


def _denser(labels: Labels, density: Array, weight: Array) -> list[tuple[float, Region]]:
    """Return the regions of one axis that hold more of the gap than of the samples, with the difference."""
    names, index = np.unique(labels, return_inverse=True)
    if names.size < 2:
        return []
    shares = np.bincount(index, density) / density.sum()
    samples = np.bincount(index, weight) / weight.sum()
    return _described(zip(names, shares, samples, strict=True))


def _described(shares: Iterable[tuple[str, float, float]]) -> list[tuple[float, Region]]:
    return [
        (share - samples, Region(region=str(name), share_of_gap=float(min(share, 1.0))))
        for name, share, samples in shares
        if share >= LEAST_SHARE and share >= DENSER * samples
    ]


def _frequencies(checks: Sequence[ResidualCheck], whole: float) -> list[tuple[float, Region]]:
    """Return the octaves of frequency that hold most of the gap; an offset is one of its own.

    Parameters
    ----------
    checks : records against the damper; one without cycles has no octaves, and its share is in none
    whole : the gap of all records, as their octaves are summed [N^2]
    """
    power: dict[str, float] = {}
    for check in checks:
        if check.error is None or check.cleaned.cycles is None:
            continue
        words = [_octave(h * check.cleaned.cycles.frequency) for h in range(check.error.mean.size)]
        samples = float(np.count_nonzero(check.wanted))
        for word, part in zip(words, repeatable_power(check.error), strict=True):
            power[word] = power.get(word, 0.0) + samples * float(part)
    total = max(whole, sum(max(part, 0.0) for part in power.values()))
    if len(power) < 2:
        return []
    return _described((word, part / total, 1.0 / len(power)) for word, part in power.items())


def _octave(frequency: float) -> str:
    if frequency <= 0.0:
        return "constant offset of the force"
    octave = int(np.floor(np.log2(frequency) + 1e-9))
    return f"{2.0**octave:g} to {2.0 ** (octave + 1):g} Hz in the force"


def _thirds(checks: Sequence[ResidualCheck]) -> list[tuple[float, Region]]:
    """Return the third of the run in which the gap is larger."""
    names = ("first third of the run", "middle third of the run", "last third of the run")
    shares, samples = np.zeros(3), np.zeros(3)
    for check in checks:
        kept = np.flatnonzero(check.wanted)
        for third, part in enumerate(np.array_split(kept, 3)):
            shares[third] += float(np.sum(check.cleared[part] ** 2)) - part.size * check.variance
            samples[third] += part.size
    if shares.sum() <= 0.0:
        return []
    found = _described(zip(names, shares / shares.sum(), samples / samples.sum(), strict=True))
    return [item for item in found if item[1].share_of_gap >= LEAST_SHARE_OF_THIRD]
