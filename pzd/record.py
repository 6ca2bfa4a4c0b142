"""One rig record in SI, and which records are one condition."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Complex = NDArray[np.complex128]
Rows = NDArray[np.intp]
"""Types of arrays for all of pzd: numbers, which samples, complex numbers, and indices of samples."""

CONSTANT_SHARE = 0.02
"""A voltage whose r.m.s. about its median stays within this share of the scale is constant."""
DIFFERENT_SHARE = 0.1
"""Voltages further apart than this share of the scale were set: a supply scatters by a few hundredths at most."""
SAME_TEMPERATURE = 2.0
"""Records within this many degC are one condition."""


_EQUAL_GAPS = 1e-9
"""Gaps that differ by less than this share are equal but for rounding."""
_EVEN = 1e-3
"""Steps that scatter by less than this share are even: a clock in microseconds at 1 kHz."""


@dataclass(frozen=True, eq=False)
class Record:
    """What one test recorded; every array is (n,), extension positive, in SI and degC."""

    name: str
    setting: str | None
    time: Array
    displacement: Array
    velocity: Array
    acceleration: Array
    force: Array
    voltage: Array | None = None
    temperature: Array | None = None
    pressure: Array | None = None

    @cached_property
    def rate(self) -> float:
        """Sampling rate [Hz], from the median step, or the mean of the usual ones where a coarse clock rounds them."""
        steps = np.diff(self.time)
        middle = float(np.median(steps))
        usual = steps[np.abs(steps - middle) <= 0.5 * middle]  # no gaps
        return float(1.0 / (middle if np.ptp(usual) <= _EVEN * middle else np.mean(usual)))

    def median_voltage(self) -> float | None:
        """The voltage that labels the record, None where none was recorded."""
        return None if self.voltage is None else float(np.median(self.voltage))

    def median_temperature(self) -> float | None:
        """The temperature that labels the record [degC], None where none was recorded."""
        return None if self.temperature is None else float(np.median(self.temperature))


def sliced(record: Record, kept: Mask) -> Record:
    """The record's samples where the mask (n,) is set."""

    def cut(channel: Array | None) -> Array | None:
        return None if channel is None else channel[kept]

    return Record(
        record.name,
        record.setting,
        record.time[kept],
        record.displacement[kept],
        record.velocity[kept],
        record.acceleration[kept],
        record.force[kept],
        cut(record.voltage),
        cut(record.temperature),
        cut(record.pressure),
    )


def clock_fault(time: Array) -> tuple[int, str] | None:
    """The first sample at which a clock (n,) stands still or goes back, and that in words; None where it goes on."""
    wrong = np.flatnonzero(np.diff(time) <= 0.0)
    if not wrong.size:
        return None
    row = int(wrong[0]) + 1
    more = f", and {wrong.size - 1} more such rows" if wrong.size > 1 else ""
    return row, f"time does not increase: {time[row]:.9g} s after {time[row - 1]:.9g} s{more}"


@dataclass(frozen=True, eq=False)
class Condition:
    """Records of one setting taken at one constant voltage and one temperature."""

    setting: str | None
    voltage: float | None
    temperature: float | None
    records: tuple[Record, ...]


def glitches(values: Array, away: Array | None = None) -> NDArray[np.int64]:
    """Rows of up to three samples that jump away from their neighbours and back.

    They stand out of the running median of seven samples by ten robust standard deviations of what stands
    out of it, by four times the steepest usual step, and by 2 % of the usual range.

    Parameters
    ----------
    values : (n,) of any channel
    away : (n,) their deviation from their neighbours, where it is known
    """
    deviation = np.abs(from_neighbours(values) if away is None else away)
    noise = 1.4826 * float(np.median(deviation))
    steepest = float(np.percentile(np.abs(np.diff(values)), 99.0)) if values.size > 1 else 0.0
    low, high = np.percentile(values, (0.5, 99.5))
    least = max(10.0 * noise, 4.0 * steepest, 0.02 * float(high - low), 1e-300)
    rows: NDArray[np.int64] = np.flatnonzero(deviation > least)
    return rows


def from_neighbours(values: Array) -> Array:
    """Deviation (n,) from the running median of seven samples; at the ends from that of the samples there are."""
    half = 3
    if values.size <= 2 * half:
        return np.zeros_like(values)
    padded = np.pad(values, half, mode="reflect")
    middle = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1), axis=1)
    deviation: Array = values - middle
    return deviation


def without_glitches(values: Array) -> Array:
    """The samples of a channel that are no glitches of more than 2 % of its usual magnitude."""
    spread = float(np.ptp(values))
    if spread == 0.0:
        return values  # most control signals, and no median is needed for them
    usual = float(np.median(np.abs(values)))
    if spread <= CONSTANT_SHARE * usual:
        return values
    away = from_neighbours(values)
    rows = glitches(values, away)
    rows = rows[np.abs(away[rows]) > CONSTANT_SHARE * usual]
    return np.delete(values, rows) if rows.size else values


def mid_stroke(displacements: Iterable[Array]) -> float:
    """Middle between the ends of what several tests reached [m], of their displacements (n,) as recorded."""
    ends = [end(displacement) for displacement in displacements for end in (np.min, np.max)]
    return 0.5 * float(min(ends) + max(ends))


def voltage_scale(records: Iterable[Record]) -> float:
    """The larger of the rig's voltage span and its largest magnitude [V], glitches aside; 0 without voltages."""
    voltages = [without_glitches(record.voltage) for record in records if record.voltage is not None]
    extremes = [(float(voltage.min()), float(voltage.max())) for voltage in voltages]
    if not extremes:
        return 0.0
    low, high = min(e[0] for e in extremes), max(e[1] for e in extremes)
    return max(high - low, abs(low), abs(high))


def is_constant(record: Record, scale: float) -> bool:
    """Whether the record's voltage stands still, glitches aside: r.m.s. about the median within 2 % of the scale."""
    if record.voltage is None:
        return True
    deviation = without_glitches(record.voltage) - np.median(record.voltage)
    return bool(np.sqrt(np.mean(deviation**2)) <= CONSTANT_SHARE * scale)


def conditions(
    records: Sequence[Record], voltage_within: float | None = None, temperature_within: float = SAME_TEMPERATURE
) -> tuple[tuple[Condition, ...], tuple[Record, ...]]:
    """Group the constant records of every setting into conditions; the moving ones come second.

    Parameters
    ----------
    records : the rig's records, of any setting
    voltage_within : largest spread of voltage inside one condition [V]; None for 2 % of the scale
    temperature_within : largest spread of temperature inside one condition [degC]

    Returns
    -------
    conditions sorted by setting, voltage and temperature; and the records whose voltage moves
    """
    scale = voltage_scale(records)
    within = CONSTANT_SHARE * scale if voltage_within is None else voltage_within
    still = [r for r in records if is_constant(r, scale)]
    alike: list[tuple[str | None, list[Record]]] = []
    for setting in sorted({r.setting for r in still}, key=lambda s: s or ""):
        mine = [r for r in still if r.setting == setting]
        for at_voltage in _bands(mine, [r.median_voltage() for r in mine], within):
            bands = _bands(at_voltage, [r.median_temperature() for r in at_voltage], temperature_within)
            alike.extend((setting, members) for members in bands)
    found = [_condition(*each, (within, temperature_within)) for each in alike]
    if len({_labels(each) for each in found}) < len(found):
        found = [_condition(*each, (0.0, 0.0)) for each in alike]
    return tuple(found), tuple(r for r in records if not is_constant(r, scale))


def merged_voltages(records: Sequence[Record], voltage_within: float) -> tuple[float, float] | None:
    """Lowest and highest voltage of the constant records, where one condition would hold them all though they differ.

    Parameters
    ----------
    records : the rig's records, of any setting
    voltage_within : largest spread of voltage inside one condition [V]

    Returns
    -------
    None where they make several conditions, or where they are scatter about one voltage
    """
    scale = voltage_scale(records)
    voltages = [r.median_voltage() for r in records if is_constant(r, scale)]
    known = [voltage for voltage in voltages if voltage is not None]
    spread = max(known) - min(known) if known else 0.0
    return (min(known), max(known)) if DIFFERENT_SHARE * scale < spread <= voltage_within else None


def _level(values: Array, finest: float) -> float:
    """The median of a channel that stands still, without the digits that its noise made.

    Parameters
    ----------
    values : (n,) of one condition
    finest : a difference that counts [unit of the values]

    Returns
    -------
    rounded to the largest power of ten within both the robust standard deviation and a tenth of what counts; as it is
    where most samples are alike
    """
    middle = float(np.median(values))
    step = min(1.4826 * float(np.median(np.abs(values - middle))), 0.1 * finest)
    return round(middle, -math.floor(math.log10(step))) + 0.0 if step > 0.0 else middle


def _condition(setting: str | None, members: Sequence[Record], finest: tuple[float, float]) -> Condition:
    """Of records alike, voltage and temperature told no finer than what differs by so much."""
    voltages = [r.voltage for r in members if r.voltage is not None]
    temperatures = [r.temperature for r in members if r.temperature is not None]
    return Condition(
        setting,
        _level(np.concatenate(voltages), finest[0]) if voltages else None,
        _level(np.concatenate(temperatures), finest[1]) if temperatures else None,
        tuple(members),
    )


def _labels(condition: Condition) -> tuple[str | None, float | None, float | None]:
    return condition.setting, condition.voltage, condition.temperature


def _bands(records: Sequence[Record], labels: Sequence[float | None], within: float) -> list[list[Record]]:
    """Split records into bands of labels no wider than `within`, lowest first; no label is a band of its own."""
    unknown = [record for record, label in zip(records, labels, strict=True) if label is None]
    known = sorted(((label, i) for i, label in enumerate(labels) if label is not None), key=lambda one: one[0])
    parts = _parted(np.array([label for label, _ in known]), within) if known else []
    bands = [[records[i] for _, i in known[part]] for part in parts]
    return [unknown, *bands] if unknown else bands


def _parted(rising: Array, within: float) -> list[slice]:
    """Ranges of (n,) rising numbers no wider than `within`: cut at the widest gap, of equal ones at the middlemost."""
    if rising[-1] - rising[0] <= within:
        return [slice(0, rising.size)]
    gaps = np.diff(rising)
    widest = np.flatnonzero(gaps >= gaps.max() * (1.0 - _EQUAL_GAPS)) + 1
    cut = int(widest[np.argmin(np.abs(widest - 0.5 * rising.size))])
    above = (slice(cut + part.start, cut + part.stop) for part in _parted(rising[cut:], within))
    return [*_parted(rising[:cut], within), *above]
