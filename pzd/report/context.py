"""All that the page tells of, in one place: every artefact, and what sections and pictures both need of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from pzd.artefacts import (
    Characteristics,
    ComfortRow,
    ContinuousVelocityRow,
    Diagnosed,
    Identified,
    ParameterRow,
    PeakVelocityRow,
    RecordEntry,
    ReferenceRow,
    Rides,
    Rig,
    SummaryRow,
    Table,
)
from pzd.damper.compose import static_force
from pzd.damper.confounders import known, module_of
from pzd.damper.fitted_laws import fitted_laws
from pzd.damper.model import BaseRow
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.report.blocks import amount
from pzd.report.config import ReportConfig
from pzd.report.ride_comfort import RatedRide
from pzd.simulate.config import SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.roads.sine import Sine
from pzd.simulate.study.plan import PLAIN_SUFFIX, assumed

# ----------------------------------------------------------------------------------------------------


BASELINES = ("best_fixed_voltage", "best_constant_c", "passive", "constant")
"""What a controlled policy is set beside, the most telling first."""
_OF_A_SINE = 1.5
"""A motion whose peak speed stays within so many times that of a sine is a simple swing."""
_MOST_SAMPLES = 300_000
"""A map of the gap is made from about so many samples."""
REALISTIC = ("dynamic", "table", "ideal")
"""Fidelities, the one nearest to the road first."""


@dataclass(frozen=True)
class Comparison:
    """Rides over one road at one fidelity."""

    controlled: SummaryRow
    others: tuple[SummaryRow, ...]
    """Those that do not control, in the order of `BASELINES`."""


@dataclass(frozen=True, eq=False)
class ReportContext:
    """The whole run, seen from its end."""

    config: ReportConfig
    simulate: SimulateConfig
    rig: Rig
    identified: Identified
    diagnosed: Diagnosed
    table: Table
    rides: Rides
    rated: tuple[RatedRide, ...]
    comfort: tuple[ComfortRow, ...]
    control: Control
    setting: str | None
    expected: tuple[ReferenceRow, ...] | None = None
    """The expected numbers beside those of the run; None where the config names none."""

    @cached_property
    def chosen(self) -> str | None:
        """The setting that diagnose and everything behind it used."""
        settings = {row.setting for row in self.identified.rows}
        return self.setting if self.setting is not None or len(settings) != 1 else next(iter(settings))

    @cached_property
    def records(self) -> tuple[Record, ...]:
        """The records of the chosen setting."""
        return tuple(record for record in self.rig.records if record.setting == self.chosen)

    @cached_property
    def entries(self) -> dict[str, RecordEntry]:
        """What records.json says of each record."""
        return {entry.name: entry for entry in self.rig.entries}

    @cached_property
    def parameters(self) -> tuple[ParameterRow, ...]:
        """The identified rows of the chosen setting."""
        return tuple(row for row in self.identified.rows if row.setting == self.chosen)

    @cached_property
    def final(self) -> tuple[ParameterRow | BaseRow, ...]:
        """T0, C and k of the damper that everything behind uses; without intervals where somebody edited them since."""
        if not self.extended and not self.fitted_law:
            return self.parameters
        return tuple(_fitted(base, self.diagnosed.parameters) or base for base in self.diagnosed.damper.base)

    @cached_property
    def sampled(self) -> tuple[Record, ...]:
        """Records for maps: all of the setting, or every n-th where there are too many to simulate in a short time."""
        total = sum(record.time.size for record in self.records)
        return self.records[:: max(math.ceil(total / _MOST_SAMPLES), 1)]

    def simulated(self, record: Record) -> tuple[Array, Array]:
        """(n,) force of the plain and of the final damper in the motion of a record [N]."""
        if record.name not in self._forces:
            from pzd.damper.compose import respond
            from pzd.damper.motion import Motion

            motion = Motion.of(record)
            start = float(record.force[0])
            before = respond(self.diagnosed.baseline, motion, start)
            after = respond(self.diagnosed.damper, motion, start) if self.extended else before
            self._forces[record.name] = (before, after)
        return self._forces[record.name]

    @cached_property
    def _forces(self) -> dict[str, tuple[Array, Array]]:
        return {}

    @property
    def fitted_law(self) -> bool:
        """Whether identify handed on another law than Bingham's."""
        return any(name in fitted_laws() for name in self.diagnosed.baseline.effects)

    @property
    def model(self) -> str:
        """What the damper before diagnose is called."""
        return "knee law" if self.fitted_law else "simple model"

    @property
    def extended(self) -> bool:
        """Whether diagnose changed the damper."""
        return self.diagnosed.damper != self.diagnosed.baseline

    @cached_property
    def shown(self) -> tuple[Record, ...]:
        """The records shown as force: of each voltage the fastest sine or triangle, spread over the voltages."""
        ordered = sorted(self.records, key=lambda r: (self.swings(r), float(np.abs(r.velocity).max())))
        by_voltage = {self.level(record): record for record in ordered}
        chosen = sorted(by_voltage.values(), key=lambda r: self.level(r) or 0.0)
        if len(chosen) == 1:
            chosen = ordered
        count = min(self.config.records_shown, len(chosen))
        places = {round(place) for place in np.linspace(0, len(chosen) - 1, count)}
        return tuple(chosen[place] for place in sorted(places))

    def swings(self, record: Record) -> bool:
        """Whether the record goes to and fro once a cycle, as a sine or triangle does and a repeated road does not."""
        for m in self.identified.measures:
            if m.record == record.name and m.frequency_Hz is not None:
                return m.peak_velocity_m_per_s <= _OF_A_SINE * 2.0 * math.pi * m.frequency_Hz * m.amplitude_m
        return False

    def level(self, record: Record) -> float | None:
        """The identified voltage nearest to that of a record; its own where none was identified."""
        return self.nearest_level(record.median_voltage())

    def nearest_level(self, voltage: float | None) -> float | None:
        """The identified voltage nearest to one [V]; the one given where none was identified."""
        known = [row.voltage_V for row in self.parameters if row.voltage_V is not None]
        return voltage if voltage is None or not known else min(known, key=lambda level: abs(level - voltage))

    def middle(self, record: Record) -> slice:
        """Two cycles of a simple swing, ten of any other record, from its middle: it may start and end at rest."""
        cycles = self.entries[record.name].cycles if record.name in self.entries else 0.0
        wanted = 2.0 if self.swings(record) else 10.0
        share = min(wanted / max(cycles, 1.0), 1.0)
        start = round(record.time.size * 0.5 * (1.0 - share))
        return slice(start, record.time.size - start)

    @cached_property
    def controlled(self) -> bool:
        """Whether a control signal was recorded; where none was, the page does not speak of one."""
        return any(record.voltage is not None for record in self.records)

    @property
    def ridden(self) -> bool:
        """Whether the damper was ridden in a car."""
        return bool(self.rides.summary)

    def voltage(self, value: float | None) -> str:
        """A value of the control signal with its unit, a dash where there is none."""
        return amount(value, self.control.unit)

    def conditions(self, record: Record) -> str:
        """The conditions of a record; its motion where it has none."""
        parts = [self.voltage(self.level(record))] if record.voltage is not None else []
        if record.temperature is not None:
            parts.append(amount(record.median_temperature(), "degC"))
        return ", ".join(parts) or self.motion(record)

    def motion(self, record: Record) -> str:
        """The frequency and amplitude of a record; its name where it does not repeat, or holds several tests."""
        found = [m for m in self.identified.measures if m.record == record.name]
        if len(found) != 1 or found[0].frequency_Hz is None:
            return record.name
        return f"{amount(found[0].frequency_Hz, 'Hz')}, {amount(1000.0 * found[0].amplitude_m, 'mm')}"

    def road(self, name: str) -> str:
        """A road in words: a sine by its frequency and amplitude, any other by its name."""
        for road in self.simulate.roads:
            if road.name == name and isinstance(road, Sine) and road.label is None:
                return f"{amount(road.frequency_Hz, 'Hz')} sine"
        return name

    @cached_property
    def measures(self) -> dict[tuple[str, str], ComfortRow]:
        """Comfort rows by case and measure."""
        return {(row.case, row.measure): row for row in self.comfort}

    def value(self, case: str, measure: str) -> float | None:
        """A comfort value; None where the edition was not asked for."""
        row = self.measures.get((case, measure))
        return None if row is None else row.value

    @cached_property
    def roads(self) -> tuple[str, ...]:
        """Names of the roads in the order of the rides."""
        return tuple(dict.fromkeys(row.road for row in self.rides.summary))

    def cases(self, road: str, *, plain: bool = False) -> tuple[SummaryRow, ...]:
        """The rides over one road, on the final damper or on the one before diagnose."""
        mine = [row for row in self.rides.summary if row.road == road]
        return tuple(row for row in mine if row.case.endswith(PLAIN_SUFFIX) == plain)

    @cached_property
    def by_case(self) -> dict[str, RatedRide]:
        """The rides as they are rated, by case."""
        return {ride.row.case: ride for ride in self.rated}

    def a_w(self, row: SummaryRow) -> float:
        """Weighted r.m.s. of a ride [m/s2]."""
        return self.by_case[row.case].weighted.a_w_m_per_s2

    def comparisons(self, road: str) -> tuple[Comparison, ...]:
        """The controlled policy beside the others over a road, a fidelity each, the one nearest to a real car first."""
        found = []
        for fidelity in REALISTIC:
            rows = {row.policy: row for row in self.cases(road) if row.fidelity == fidelity}
            controlled = [row for policy, row in rows.items() if self.simulate.is_controlled(policy)]
            others = tuple(rows[policy] for policy in BASELINES if policy in rows)
            if controlled and others:
                found.append(Comparison(controlled[0], others))
        return tuple(found)

    def nearest(self, road: str) -> tuple[SummaryRow, ...]:
        """The rides over a road at the fidelity nearest to a real car at which it was compared, or ridden at all."""
        compared = self.comparisons(road)
        if compared:
            return (compared[0].controlled, *compared[0].others)
        best = min((REALISTIC.index(row.fidelity) for row in self.cases(road)), default=0)
        return tuple(row for row in self.cases(road) if row.fidelity == REALISTIC[best])

    def policy(self, row: SummaryRow) -> str:
        """What drove the dampers, with what it held constant."""
        held = self.by_case[row.case].ridden
        name = row.policy.replace("_", " ").removesuffix(" c")
        if held.damping_Ns_per_m is not None:
            return f"{name} c = {amount(held.damping_Ns_per_m, 'N s/m', 3)}"
        return name if held.voltage_V is None else f"{name} {self.voltage(held.voltage_V)}"

    def dampers(self, row: SummaryRow) -> str:
        """What drove the dampers, and how exactly it was computed."""
        return f"{self.policy(row)}, {row.fidelity}"

    @cached_property
    def assumed(self) -> tuple[str, ...]:
        """What the rides assume since the config does not say it."""
        with_voltage = all(row.voltage_V is not None for row in self.diagnosed.damper.base)
        return assumed(self.simulate, self.diagnosed.damper.effects, with_voltage)

    def without(self, row: SummaryRow) -> SummaryRow | None:
        """The same ride on the damper before diagnose."""
        return next((other for other in self.rides.summary if other.case == f"{row.case}{PLAIN_SUFFIX}"), None)


def _fitted(base: BaseRow, rows: Sequence[ParameterRow]) -> ParameterRow | None:
    """The row that was fitted with a base row, None where that has other values now."""
    for row in rows:
        pairs = [(getattr(row, column), getattr(base, column)) for column in ("T0_N", "C_Ns_per_m", "k_N_per_m")]
        here = (row.voltage_V, row.temperature_degC) == (base.voltage_V, base.temperature_degC)
        if here and all(known is None or known == value for known, value in pairs):
            return row
    return None


def effect_in_words(name: str) -> str:
    """What an effect is, in the first sentence of its own documentation."""
    first = (module_of(known()[name]).__doc__ or name).split("\n")[0].rstrip(".")
    return first[0].lower() + first[1:]


def effects_in_words(names: Sequence[str]) -> list[str]:
    """Each effect in words, with its name."""
    return [f"{effect_in_words(name)} ({name})" for name in names]


# ----------------------------------------------------------------------------------------------------
# The force at rest, such as a gas force: a rig measures it, and the table leaves it to the static balance.


def static_force_at(context: ReportContext, voltage: float | None) -> float:
    """What the damper handed on pushes with at rest, at a value of the control signal [N]."""
    return float(static_force(context.diagnosed.damper, voltage))


def static_force_in_words(context: ReportContext, voltages: Sequence[float | None]) -> str:
    """The same over several values, `90 N` or `80 N to 90 N`; empty where it is 0 at all."""
    forces = [static_force_at(context, voltage) for voltage in voltages]
    return " to ".join(dict.fromkeys(amount(end(forces), "N") for end in (min, max))) if any(forces) else ""


# ----------------------------------------------------------------------------------------------------
# What each policy makes of a road: comfort against the load of the wheels.


_FEWEST = 2
"""With fewer policies that control there is nothing to choose between; `Comparison` says what the one is worth."""


def of_road(context: ReportContext, road: str) -> tuple[SummaryRow, ...]:
    """The rides of all policies over a road, the most comfortable first.

    At the fidelity nearest to a real car at which two policies or more control; nothing where there is none.
    """
    for fidelity in REALISTIC:
        rows = [row for row in context.cases(road) if row.fidelity == fidelity]
        if sum(policies()[row.policy].controlled for row in rows) >= _FEWEST:
            return tuple(sorted(rows, key=context.a_w))
    return ()


def unbeaten(context: ReportContext, rows: Sequence[SummaryRow]) -> tuple[SummaryRow, ...]:
    """The rides than which none is more comfortable with less wheel load, in the order given."""

    def beats(one: SummaryRow, other: SummaryRow) -> bool:
        return context.a_w(one) < context.a_w(other) and one.rms_wheel_load_N < other.rms_wheel_load_N

    return tuple(row for row in rows if not any(beats(other, row) for other in rows))


def name_of(policy: str) -> str:
    """A policy as it is called on the page."""
    return policy.replace("_", " ")


# ----------------------------------------------------------------------------------------------------
# Which characteristics the page shows, and which share a colour: those of one control value, or of one setting.


Row = TypeVar("Row", PeakVelocityRow, ContinuousVelocityRow)


def characteristics_of(context: ReportContext) -> Characteristics:
    """What the tests of the chosen setting show without any model; of every setting where nothing else is set."""
    found = context.identified.characteristics
    voltages = {row.voltage_V for row in found.peak_velocity} | {row.voltage_V for row in found.warm_up}
    if voltages <= {None} and not found.steps:
        return found
    return Characteristics(
        tuple(row for row in found.peak_velocity if row.setting == context.chosen),
        tuple(row for row in found.continuous_velocity if row.setting == context.chosen),
        tuple(row for row in found.gas_and_friction if row.setting == context.chosen),
        tuple(row for row in found.steps if row.setting == context.chosen),
        tuple(row for row in found.warm_up if row.setting == context.chosen),
        tuple(row for row in found.as_it_stands if row.setting == context.chosen),
    )


def coloured(context: ReportContext, rows: Sequence[Row]) -> Mapping[str, list[Row]]:
    """Rows by the label of their colour, lowest control value first; one label without text where nothing differs.

    Parameters
    ----------
    context : the run, which says whether there is a control signal
    rows : of the chosen setting, or of all where there is no control signal
    """
    controlled = any(row.voltage_V is not None for row in rows)
    found: dict[str, list[Row]] = {}
    for row in sorted(rows, key=lambda row: (row.voltage_V or 0.0, row.setting or "")):
        label = context.voltage(context.nearest_level(row.voltage_V)) if controlled else row.setting or ""
        found.setdefault(label, []).append(row)
    return found


def place_of(row: PeakVelocityRow | ContinuousVelocityRow) -> tuple[str | None, float | None, float | None]:
    """The condition of a row."""
    return row.setting, row.voltage_V, row.temperature_degC
