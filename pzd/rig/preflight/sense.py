"""Checks of signs and units: work done by the damper on the rig, and magnitudes that no damper has."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import Finding, RecordEntry
from pzd.record import SAME_TEMPERATURE
from pzd.rig.preflight import PreflightRecord
from pzd.signals.measures import chance_work, work


def sign(test: PreflightRecord) -> Iterator[Finding]:
    """Find cycles with negative work, or a record whose steady force outweighs its loops."""
    record = test.record
    if work(record.displacement, record.force) < -chance_work(record.displacement, record.force):
        yield Finding(
            check="sign",
            where="the whole record",
            size=work(record.displacement, record.force),
            unit="J",
            follows="a steady force over the net displacement outweighs the loops: say fixture: {tare_N: ...}",
        )
        return
    if test.cycles is None:
        return
    number = test.cycles.number(record.time)
    # Each cycle is closed: left open, a small stroke's noise keeps its ends apart, and the force would do work there.
    cycles = rows_of_cycles(number, test.cycles.count)
    works = np.array([work(record.displacement[rows], record.force[rows], closed=True) for rows in cycles])
    negative = np.flatnonzero(works < -chance_work(record.displacement, record.force, cycles=1.0))
    if negative.size:
        first = test.cycles.start + float(negative[0]) * test.cycles.period
        yield Finding(
            check="sign",
            where=f"{negative.size} of {test.cycles.count} cycles, the first at {first:.4g} s",
            size=float(works.min()),
            unit="J",
            follows="the damper does work on the rig there: check the cell, or take these cycles out of the file",
        )


def rows_of_cycles(number: NDArray[np.int64], count: int) -> list[slice]:
    """Return the rows of each cycle: a mask each would take as many bytes as there are samples times cycles.

    Parameters
    ----------
    number : (n,) cycle of each sample, rising through one run of samples and -1 outside
    count : of the cycles
    """
    inside = np.flatnonzero(number >= 0)
    first, last = (int(inside[0]), int(inside[-1]) + 1) if inside.size else (0, 0)
    edges = first + np.searchsorted(number[first:last], np.arange(count + 1))
    return [slice(int(start), int(end)) for start, end in pairwise(edges)]


# --- Units: one read wrongly is most often off by 1000 ---

LEAST_STROKE = 2e-4
"""A smaller stroke [m] is more likely a wrong unit than a test."""
FORCES = (2.0, 5e5)
"""Peak forces [N] outside this range are more likely a wrong unit."""
SPEEDS = (5e-4, 5.0)
"""Peak speeds [m/s] outside this range are more likely a wrong unit of time."""
SHORT_STROKE = 0.05
"""Dampers of vehicles move no further [m]"""
VEHICLE_FORCE = 5e4
"""and give no larger forces [N]; those of bridges and buildings move further."""
TEMPERATURES = (-60.0, 150.0)
"""Outside this range [degC] seals and oil of a damper fail: kelvin or degrees Fahrenheit are likelier."""
CONTROLS = {"V": 1e4, "A": 1e2}
"""Largest control signal by its unit: piezo valves take up to 1 kV, electrorheological ones 5 kV, coils some A."""
HINTS = {"degC": "degC, degF or K", "V": "V or mV", "A": "A or mA"}
"""What may have been mixed up, by unit; else a unit of the motion or the force."""


def scale(test: PreflightRecord) -> Iterator[Finding]:
    """Find strokes, forces, speeds, temperatures and control signals that look like a unit read wrongly."""
    record, control = test.record, test.control
    stroke = float(np.ptp(record.displacement))
    forces = (FORCES[0], VEHICLE_FORCE) if stroke < SHORT_STROKE else FORCES
    sizes = [
        ("stroke", stroke, (LEAST_STROKE, np.inf), "m"),
        ("peak force", float(np.abs(record.force).max()), forces, "N"),
        ("peak speed", float(np.abs(test.clean.velocity).max()), SPEEDS, "m/s"),
    ]
    temperature, voltage = record.median_temperature(), record.median_voltage()
    if temperature is not None:
        sizes.append(("temperature", temperature, TEMPERATURES, "degC"))
    if voltage is not None and control.unit in CONTROLS:
        sizes.append((control.name, abs(voltage), (0.0, CONTROLS[control.unit]), control.unit))
    for what, size, (low, high), unit in sizes:
        if not low <= size <= high:
            hint = HINTS.get(unit, "mm or m, N or kN, s or ms")
            yield Finding(
                check="scale",
                where=f"{what} of the whole record",
                size=size,
                unit=unit,
                follows=f"{low:g} to {high:g} {unit} is usual: check the units ({hint})",
            )


MIXED = (300.0, 3000.0)
"""Ratio of a record's force to the usual one of its rig where it stands in another unit by a thousand;"""
ALIKE_SPEED = 10.0
"""the r.m.s. speeds differ by less: no damper makes a force of 300 times another's of ten times the speed."""


def mixed_units(entries: tuple[RecordEntry, ...]) -> tuple[RecordEntry, ...]:
    """Find records whose force is some thousand times smaller or larger than in the others of a like speed."""
    return tuple(
        entry.model_copy(update={"findings": (*entry.findings, *_mixed(entry, [e for e in entries if e is not entry]))})
        for entry in entries
    )


def _mixed(entry: RecordEntry, others: list[RecordEntry]) -> Iterator[Finding]:
    mine, speed = entry.force_rms_N, entry.velocity_rms_m_per_s
    alike = [
        other.force_rms_N
        for other in others
        if other.force_rms_N
        and other.velocity_rms_m_per_s
        and speed
        and 1.0 / ALIKE_SPEED < other.velocity_rms_m_per_s / speed < ALIKE_SPEED
    ]
    if not alike or not mine:
        return
    usual = float(np.median(alike))
    ratio = mine / usual
    if MIXED[0] < max(ratio, 1.0 / ratio) < MIXED[1]:
        yield Finding(
            check="scale",
            where=f"force, r.m.s. {mine:.4g} N, where {usual:.4g} N is usual in the other records at a like speed",
            size=ratio,
            unit="-",
            follows="N and kN are mixed over the files: say units: {force: ...} for each kind in an entry of its own",
        )


SAME_RMS = 0.01
"""Relative difference of r.m.s. displacement and speed up to which two tests ran the same motion."""
ANOTHER_LEVEL = 1.3
"""Ratio of the forces of one motion from which they are of two levels: warming and repeats stay below."""


def unseen_levels(entries: tuple[RecordEntry, ...]) -> tuple[RecordEntry, ...]:
    """Find tests without a control signal whose force is much larger than that of another one of the same motion."""
    return tuple(
        entry.model_copy(update={"findings": (*entry.findings, *_another_level(entry, entries))}) for entry in entries
    )


def _another_level(entry: RecordEntry, entries: tuple[RecordEntry, ...]) -> Iterator[Finding]:
    forces = {other.name: other.force_rms_N for other in entries if other.force_rms_N and _one_condition(entry, other)}
    if not entry.force_rms_N or not forces:
        return
    least = min(forces, key=lambda name: forces[name])
    ratio = entry.force_rms_N / forces[least]
    if ANOTHER_LEVEL < ratio < MIXED[0]:
        yield Finding(
            check="level",
            where=f"force, r.m.s. {entry.force_rms_N:.4g} N, where {least} has {forces[least]:.4g} N in the "
            "same motion",
            size=ratio,
            unit="-",
            follows="one fit to both is neither: if a control signal, a setting or a temperature differed, say which, "
            "by columns, constants, pattern, preamble or setting",
        )


def _one_condition(one: RecordEntry, other: RecordEntry) -> bool:
    """Whether two tests ran the same motion at one temperature, if known, and no control signal tells them apart."""
    warmth, other_warmth = one.temperature_degC, other.temperature_degC
    motions = (
        (one.displacement_rms_m, other.displacement_rms_m),
        (one.velocity_rms_m_per_s, other.velocity_rms_m_per_s),
    )
    return (
        one.setting == other.setting
        and None in (one.voltage_V, other.voltage_V)
        and (warmth is None or other_warmth is None or abs(warmth - other_warmth) <= SAME_TEMPERATURE)
        and all(a is not None and b is not None and abs(a - b) <= SAME_RMS * max(a, b) for a, b in motions)
    )


CHECKS = (sign, scale)
COMPARISONS = (mixed_units, unseen_levels)
