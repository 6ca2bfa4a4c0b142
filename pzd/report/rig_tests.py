"""The rig tests of the setting in use: their conditions, and which of them the page shows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from pzd.artefacts import Characteristics, Identified, RecordEntry, Rig
from pzd.identification.prepared_record import warm_up
from pzd.quantities import Control
from pzd.record import Record, is_constant, voltage_scale
from pzd.report.blocks import amount, number, shortened

_SINE_SPEED_RATIO = 1.5
"""A motion whose peak speed is at most so many times that of a sine of its amplitude is a simple swing.

A triangle has 2/pi times that speed, a repeated road several times."""
_MOST_SAMPLES = 300_000
"""Maps and spectra are made from about so many samples: simulating more takes longer than the rest of the page."""
_MOST_VOLTAGES = 3
"""Voltages that a row of small pictures has room for: the lowest, the highest and one between."""


def setting_in_use(identified: Identified, setting: str | None) -> str | None:
    """Return the setting that diagnose and everything behind it used: the only one where the config names none."""
    settings = {row.setting for row in identified.rows}
    return setting if setting is not None or len(settings) != 1 else next(iter(settings))


def settled(record: Record) -> slice:
    """Return the samples of a record that do not depend on how it began."""
    return slice(warm_up(record.displacement), None)


@dataclass(frozen=True, eq=False)
class RigTests:
    """The records of one setting, with what was measured in them."""

    rig: Rig
    identified: Identified
    control: Control
    setting: str | None
    records_shown: int
    """How many records are shown as measured and simulated force."""

    @cached_property
    def records(self) -> tuple[Record, ...]:
        """The records of the setting."""
        return tuple(record for record in self.rig.records if record.setting == self.setting)

    @cached_property
    def entries(self) -> dict[str, RecordEntry]:
        """Entries of records.json by the name of the record."""
        return {entry.name: entry for entry in self.rig.entries}

    @cached_property
    def controlled(self) -> bool:
        """Whether a control signal was recorded; where none was, the page does not speak of one."""
        return any(record.voltage is not None for record in self.records)

    @cached_property
    def characteristics(self) -> Characteristics:
        """What the tests show without any model; of every setting where nothing but the setting was varied."""
        found = self.identified.characteristics
        voltages = {row.voltage_V for row in found.peak_velocity} | {row.voltage_V for row in found.warm_up}
        if voltages <= {None} and not found.steps:
            return found
        tables = (getattr(found, table.name) for table in fields(found))
        return Characteristics(*(tuple(row for row in rows if row.setting == self.setting) for rows in tables))

    # --- Conditions of a record ---

    def level(self, record: Record) -> float | None:
        """Return the identified voltage nearest to that of a record; its own where none was identified."""
        return self.nearest_level(record.median_voltage())

    def nearest_level(self, voltage: float | None) -> float | None:
        """Return the identified voltage nearest to one [V]; the one given where none was identified."""
        rows = (row for row in self.identified.rows if row.setting == self.setting)
        levels = [row.voltage_V for row in rows if row.voltage_V is not None]
        return voltage if voltage is None or not levels else min(levels, key=lambda level: abs(level - voltage))

    def conditions(self, record: Record) -> str:
        """Return the conditions of a record in words; its motion where it has none."""
        parts = [self._signal(record)] if record.voltage is not None else []
        if record.temperature is not None:
            parts.append(amount(record.median_temperature(), "degC"))
        return ", ".join(parts) or self.motion(record)

    def _signal(self, record: Record) -> str:
        """Return the control signal of a record in words: its level, or from where to where it moves."""
        if record.voltage is None or not self.moves(record):
            return amount(self.level(record), self.control.unit)
        low, high = np.percentile(record.voltage, (1.0, 99.0))
        return f"{number(float(low), 3)} to {amount(float(high), self.control.unit, 3)}"

    def moves(self, record: Record) -> bool:
        """Tell whether the control signal moves in a record: no mean of its cycles is a cycle then."""
        return record.name in self._moving

    @cached_property
    def _moving(self) -> frozenset[str]:
        scale = voltage_scale(self.records)
        return frozenset(record.name for record in self.records if not is_constant(record, scale))

    def motion(self, record: Record) -> str:
        """Return frequency and amplitude of a record; its name where it does not repeat or holds several tests."""
        found = self._swing(record)
        return ", ".join((amount(found[0], "Hz"), amount(1000.0 * found[1], "mm"))) if found else record.name

    def by_motion(self, records: Sequence[Record]) -> list[Record]:
        """Return records by frequency, amplitude and control signal, those that do not repeat last, as they came."""

        def key(one: Record) -> tuple[float, ...]:
            # To the digits that `motion` shows: as measured no two tests have the same amplitude.
            swing = [float(f"{value:.3g}") for value in self._swing(one) or (math.inf, math.inf)]
            return (*swing, (self.level(one) or 0.0) if np.isfinite(swing[0]) else 0.0)

        return sorted(records, key=key)

    def _swing(self, record: Record) -> tuple[float, float] | None:
        """Return frequency [Hz] and amplitude [m]; None where a record does not repeat or holds several tests."""
        found = [m for m in self.identified.measures if m.record == record.name]
        if len(found) != 1 or found[0].frequency_Hz is None:
            return None
        return found[0].frequency_Hz, found[0].amplitude_m

    def labels(self, records: Sequence[Record]) -> list[str]:
        """Return each test by its motion and conditions, with its name where others have the same or it has no motion.

        Names of files may be long, and are shortened.
        """
        ways = [tuple(dict.fromkeys((self.motion(one), self.conditions(one)))) for one in records]
        return [
            ", ".join(
                shortened(part) if part == record.name else part
                for part in (*way, *([record.name] if ways.count(way) > 1 else ()))
            )
            for way, record in zip(ways, records, strict=True)
        ]

    def is_simple_swing(self, record: Record) -> bool:
        """Tell whether a record has one swing a cycle, as a sine or triangle has and a repeated road has not."""
        for m in self.identified.measures:
            if m.record == record.name and m.frequency_Hz is not None:
                sine_speed = 2.0 * math.pi * m.frequency_Hz * m.amplitude_m
                return m.peak_velocity_m_per_s <= _SINE_SPEED_RATIO * sine_speed
        return False

    # --- Choices of records and samples ---

    @cached_property
    def sampled(self) -> tuple[Record, ...]:
        """Records for maps and spectra: all, or every n-th where there are too many samples to simulate quickly."""
        total = sum(record.time.size for record in self.records)
        return self.records[:: max(math.ceil(total / _MOST_SAMPLES), 1)]

    @cached_property
    def shown(self) -> tuple[Record, ...]:
        """The records shown as force: of each voltage the fastest sine or triangle, spread over the voltages."""
        constant = [record for record in self.records if not self.moves(record)] or self.records
        ordered = sorted(constant, key=lambda r: (self.is_simple_swing(r), float(np.abs(r.velocity).max())))
        by_voltage = {self.level(record): record for record in ordered}
        chosen = sorted(by_voltage.values(), key=lambda r: self.level(r) or 0.0)
        if len(chosen) == 1:
            chosen = ordered
        count = min(self.records_shown, len(chosen))
        places = {round(place) for place in np.linspace(0, len(chosen) - 1, count)}
        return tuple(chosen[place] for place in sorted(places))

    def middle(self, record: Record) -> slice:
        """Return the middle of a record, which may start and end at rest: two cycles of a simple swing, else ten."""
        cycles = self.entries[record.name].cycles if record.name in self.entries else 0.0
        wanted = 2.0 if self.is_simple_swing(record) else 10.0
        share = min(wanted / max(cycles, 1.0), 1.0)
        start = round(record.time.size * 0.5 * (1.0 - share))
        return slice(start, record.time.size - start)

    def by_motion_of_voltage(self) -> tuple[list[Record], list[Record]]:
        """Part the sampled records into those of constant and those of varying voltage."""
        constant = [record for record in self.sampled if not self.moves(record)]
        return constant, [record for record in self.sampled if self.moves(record)]

    def at_some_voltages(self) -> dict[str, list[Record]]:
        """Return sampled records of the lowest, a middle and the highest voltage by label; under "" without control."""
        constant = self.by_motion_of_voltage()[0] or list(self.sampled)
        levels = sorted({self.level(record) or 0.0 for record in constant})
        places = np.linspace(0, len(levels) - 1, min(_MOST_VOLTAGES, len(levels)))
        chosen: list[float] = [levels[round(place)] for place in places]
        return {
            amount(level, self.control.unit) if self.controlled else "": [
                record for record in constant if (self.level(record) or 0.0) == level
            ]
            for level in chosen
        }
