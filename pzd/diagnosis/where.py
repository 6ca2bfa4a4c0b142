"""Where the gap lies: its share by voltage, temperature, speed, position, direction, frequency and time in the run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import Region
from pzd.diagnosis.campaign import ResidualCheck
from pzd.record import Array
from pzd.signals.noise import repeatable_power

Labels = NDArray[np.str_]

DENSER = 1.25
"""A region is reported when it holds so many times more of the gap than of the samples."""
LEAST_SHARE = 0.15
"""A region is reported when it holds at least this share of the gap."""
LEAST_SHARE_OF_THIRD = 0.5
"""A third of the run is reported from this share on: single cycles are noisy."""
MOST_REGIONS = 10
"""Regions reported, at most: what fits in one table of the report."""


@dataclass(frozen=True, eq=False)
class GapDensity:
    """Every checked sample (or point of an average cycle) of all records, with its part of the gap."""

    density: Array
    """(n,) square of the residual less what noise gives; sums to the gap [N^2]."""
    weight: Array
    """(n,) samples that each point stands for."""
    labels: dict[str, Labels]
    """Axis -> (n,) the region in words that each point belongs to."""


def regions(checks: Sequence[ResidualCheck], unit: str, zero: float = 0.0) -> tuple[Region, ...]:
    """The regions in which the gap is denser than elsewhere, most telling first.

    Parameters
    ----------
    checks : records against the damper
    unit : of the control signal
    zero : recorded displacement where that of `checks` is zero [m]

    Returns
    -------
    regions in words with their share of the gap; empty where there is no gap above the noise
    """
    gap = gap_map(checks, unit, zero)
    total = float(gap.density.sum())
    if total <= 0.0:
        return ()
    found: list[tuple[float, Region]] = []
    for labels in gap.labels.values():
        found += _denser(labels, gap.density, gap.weight)
    found += _frequencies(checks)
    found += _thirds(checks)
    found.sort(key=lambda item: -item[0])
    return tuple(region for _, region in found[:MOST_REGIONS]) or (Region(region="everywhere alike", share_of_gap=1.0),)


def gap_map(checks: Sequence[ResidualCheck], unit: str, zero: float = 0.0) -> GapDensity:
    """The gap sample by sample, noise's share taken off; positions are as recorded."""
    points = [_points(j) for j in checks]
    speed = max(float(np.max(np.abs(p["velocity"]))) for p in points)
    stroke = max(float(np.ptp(p["displacement"])) for p in points)
    labels: dict[str, list[Labels]] = {}
    for j, p in zip(checks, points, strict=True):
        for axis, words in _labels(j, p, speed, stroke, unit, zero).items():
            labels.setdefault(axis, []).append(words)
    return GapDensity(
        np.concatenate([p["density"] for p in points]),
        np.concatenate([p["weight"] for p in points]),
        {axis: np.concatenate(words) for axis, words in labels.items() if len(words) == len(checks)},
    )


def _points(j: ResidualCheck) -> dict[str, Array]:
    """Kinematics, density of the gap and weight: along the average cycle, or at every sample."""
    record, run = j.prepared.record, j.prepared.cycles
    if j.folded is None or run is None:
        keep = j.wanted
        names = ("velocity", "displacement", "acceleration")
        motion = {name: getattr(record, name)[keep] for name in names}
        density = (j.cleared**2 - j.variance if j.explained is None else j.explained)[keep]
        voltage = record.voltage[keep] if record.voltage is not None else np.full(density.size, np.nan)
        return {**motion, "density": density, "weight": np.ones(density.size), "voltage": voltage}
    count = j.folded.shape[0]
    mean = j.folded.mean(axis=0)
    motion = {
        "velocity": run.mean(record.time, record.velocity),
        "displacement": run.mean(record.time, record.displacement),
        "acceleration": run.mean(record.time, record.acceleration),
    }
    voltage = np.full(mean.size, record.median_voltage() if record.voltage is not None else np.nan)
    density = count * (mean**2 - j.variance / count)
    return {**motion, "density": density, "weight": np.full(mean.size, float(count)), "voltage": voltage}


def _labels(
    j: ResidualCheck, p: dict[str, Array], speed: float, stroke: float, unit: str, zero: float
) -> dict[str, Labels]:
    v, x, a = p["velocity"], p["displacement"], p["acceleration"]
    fast = _bands(np.abs(v), _round(np.array([0.1, 0.33, 0.67]) * speed), "abs(v)", "m/s")
    found = {
        "velocity": fast,
        "position": _bands(x + zero, _about(zero, 0.25 * stroke), "x", "m"),
        "direction": np.where(v >= 0.0, "rebound (v > 0)", "compression (v < 0)"),
        "phase": np.where(v * a >= 0.0, "speeding up", "slowing down"),
    }
    if np.all(np.isfinite(p["voltage"])):
        words = _voltages(p["voltage"], unit)
        found["voltage"] = words
        found["velocity and voltage"] = np.char.add(np.char.add(fast, ", "), words)
    temperature = j.prepared.record.median_temperature()
    if temperature is not None:
        found["temperature"] = np.full(v.size, f"{temperature:.0f} degC")
    return found


def _voltages(voltage: Array, unit: str) -> Labels:
    """Voltages to three figures; a moving one in fifths of its range."""
    span = float(np.ptp(voltage))
    if span <= 0.02 * float(np.max(np.abs(voltage))):
        return np.full(voltage.size, f"{float(np.median(voltage)):.3g} {unit}")
    return _bands(voltage, _round(voltage.min() + span * np.array([0.2, 0.4, 0.6, 0.8])), "moving control", unit)


def _bands(values: Array, edges: Array, name: str, unit: str) -> Labels:
    numbers = [f"{edge:.6g}" for edge in edges]
    words = [f"{name} < {numbers[0]} {unit}"]
    words += [f"{low} < {name} < {high} {unit}" for low, high in pairwise(numbers)]
    words.append(f"{name} > {numbers[-1]} {unit}")
    return np.array(words)[np.searchsorted(edges, values)]


def _about(middle: float, distance: float) -> Array:
    """The edges on either side of a middle, to two figures of their distance from it."""
    return np.round([middle - distance, middle + distance], 1 - math.floor(math.log10(distance)))


def _round(edges: Array) -> Array:
    """Edges to two figures, so that the words say what was done."""
    return np.array([float(f"{edge:.2g}") for edge in edges])


def _denser(labels: Labels, density: Array, weight: Array) -> list[tuple[float, Region]]:
    """The regions of one axis that hold more of the gap than of the samples, with by how much."""
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


def _frequencies(checks: Sequence[ResidualCheck]) -> list[tuple[float, Region]]:
    """The octaves of frequency that hold most of the repeatable gap; an offset is one of its own."""
    power: dict[str, float] = {}
    for j in checks:
        if j.error is None or j.prepared.cycles is None:
            continue
        words = [_octave(h * j.prepared.cycles.frequency) for h in range(j.error.mean.size)]
        samples = float(np.count_nonzero(j.wanted))
        for word, part in zip(words, repeatable_power(j.error), strict=True):
            power[word] = power.get(word, 0.0) + samples * float(part)
    total = sum(power.values())
    if total <= 0.0 or len(power) < 2:
        return []
    return _described((word, part / total, 1.0 / len(power)) for word, part in power.items())


def _octave(frequency: float) -> str:
    if frequency <= 0.0:
        return "constant offset of the force"
    octave = int(np.floor(np.log2(frequency) + 1e-9))
    return f"{2.0**octave:g} to {2.0 ** (octave + 1):g} Hz in the force"


def _thirds(checks: Sequence[ResidualCheck]) -> list[tuple[float, Region]]:
    """The third of the run in which the gap is larger."""
    names = ("first third of the run", "middle third of the run", "last third of the run")
    shares, samples = np.zeros(3), np.zeros(3)
    for j in checks:
        kept = np.flatnonzero(j.wanted)
        for third, part in enumerate(np.array_split(kept, 3)):
            shares[third] += float(np.sum(j.cleared[part] ** 2)) - part.size * j.variance
            samples[third] += part.size
    if shares.sum() <= 0.0:
        return []
    found = _described(zip(names, shares / shares.sum(), samples / samples.sum(), strict=True))
    return [item for item in found if item[1].share_of_gap >= LEAST_SHARE_OF_THIRD]
