"""The `rig.virtual` block of the config: a virtual test stand, one entry a setting of the damper."""

from __future__ import annotations

import operator
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from pzd.damper.confounders import known
from pzd.damper.effect import NODE_VOLTAGES
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.record import Array
from pzd.rig.stand.waveforms import Waveform, waveforms
from pzd.schema.model import Frozen, safe_name

# --- Voltage and temperature over a test ---


class Steps(Frozen):
    """A voltage that steps through levels, over and over."""

    kind: Literal["steps"]
    """A stepped voltage."""
    voltages_V: tuple[float, ...] = Field(min_length=2)
    """The levels, one after the other."""
    dwell_s: float = Field(default=1.0, gt=0.0)
    """Time from one step to the next."""
    rise_s: float = Field(default=0.002, gt=0.0)
    """Time that the supply takes from one level to the next, linearly; shorter than dwell_s."""

    @model_validator(mode="after")
    def _rises_in_time(self) -> Steps:
        if self.rise_s >= self.dwell_s:
            raise ValueError("rise_s must be shorter than dwell_s")
        return self

    def name(self, unit: str) -> str:
        """Return the name of the programme in names of records: `steps-0-150V`."""
        return f"steps-{'-'.join(f'{level:g}' for level in self.voltages_V)}{unit}"

    def at(self, time: Array, duration: float) -> Array:
        """Compute the voltage (n,) at times (n,) [s]; the first level before 0."""
        levels = np.array(self.voltages_V)
        number = np.maximum(np.floor(time / self.dwell_s), 0.0).astype(int)
        now, last = levels[number % levels.size], levels[np.maximum(number - 1, 0) % levels.size]
        share = np.clip((time - number * self.dwell_s) / self.rise_s, 0.0, 1.0)
        return np.asarray(last + (now - last) * share)


class Ramp(Frozen):
    """A voltage that rises or falls evenly over the whole test."""

    kind: Literal["ramp"]
    """A ramped voltage."""
    start_voltage_V: float
    """Voltage at the beginning, and before."""
    end_voltage_V: float
    """Voltage at the end."""

    def name(self, unit: str) -> str:
        """Return the name of the programme in names of records: `ramp-0-150V`."""
        return f"ramp-{self.start_voltage_V:g}-{self.end_voltage_V:g}{unit}"

    def at(self, time: Array, duration: float) -> Array:
        """Compute the voltage (n,) at times (n,) of a test of this duration [s]."""
        return np.interp(time, [0.0, duration], [self.start_voltage_V, self.end_voltage_V])


class Warming(Frozen):
    """A damper that the work done warms, as one lump.

    Equation: C_h dT/dt = F v - G (T - T_ambient)           Source: heat balance
    """

    kind: Literal["warming"]
    """A temperature that rises with the work done."""
    start_degC: float = Field(gt=-273.15)
    """Temperature when the recording begins."""
    ambient_degC: float | None = Field(default=None, gt=-273.15)
    """Temperature of the surroundings; by default the same."""
    heat_capacity_J_per_K: float = Field(default=1900.0, gt=0.0)
    """C_h; 1900 J/K is 3 kg of steel and 0.3 l of oil."""
    loss_W_per_K: float = Field(default=3.0, ge=0.0)
    """G, by convection and through the clamps."""

    def name(self) -> str:
        """Return the name of the programme in names of records: `warming-22degC`."""
        return f"warming-{self.start_degC:g}degC"


Voltage = float | Annotated[Steps | Ramp, Field(discriminator="kind")]
"""Voltage over a test: one constant number, or a programme."""
Temperature = float | Warming
"""Temperature over a test: one constant number, or warming."""


def voltage_over(programme: Voltage, time: Array, duration: float) -> Array:
    """Compute the voltage (n,) of a programme at times (n,) of a test of this duration [s]."""
    return np.full(time.size, programme) if isinstance(programme, float | int) else programme.at(time, duration)


# --- Tests ---

if TYPE_CHECKING:
    WaveformBlock = Waveform
else:
    WaveformBlock = Annotated[reduce(operator.or_, waveforms().values()), Field(discriminator="kind")]


class StandTest(Frozen):
    """One waveform, run at every voltage and every temperature asked for: one record each."""

    waveform: WaveformBlock
    """The motion of the actuator."""
    cycles: float | None = Field(default=None, gt=0.0)
    """Length in cycles of the waveform; by default 10 of a sine or triangle and of the lowest of several tones, 2 of a
    sweep, random motion or road, 1 of a file."""
    duration_s: float | None = Field(default=None, gt=0.0)
    """Length in seconds, instead of cycles."""
    voltages_V: tuple[Voltage, ...] | None = Field(default=None, min_length=1)
    """Voltages of this test; by default those of the entry."""
    temperatures_degC: tuple[Temperature, ...] | None = Field(default=None, min_length=1)
    """Temperatures of this test; by default those of the entry."""
    repeats: int = Field(default=1, ge=1)
    """How often each record is taken, with noise of its own."""

    @model_validator(mode="after")
    def _one_length(self) -> StandTest:
        if self.cycles is not None and self.duration_s is not None:
            raise ValueError("say cycles or duration_s, not both")
        return self


# --- Fixture and sensors ---


class StandFixture(Frozen):
    """What stands between the damper and the sensors of the virtual stand."""

    mass_kg: float = Field(default=0.0, ge=0.0)
    """Moving mass between the load cell and the damper: the cell shows F + m a of the actuator."""
    stiffness_N_per_m: float | None = Field(default=None, gt=0.0)
    """Stiffness of frame and joints: the damper is extended by F / k_frame less than the actuator moves."""
    tare_N: float = 0.0
    """Force that the cell shows without a damper."""


class ChannelNoise(Frozen):
    """Gaussian noise of one channel; exactly one of an absolute size and a share, or neither."""

    share_of_peak: float = Field(default=0.0, ge=0.0)
    """Standard deviation as a share of the record's largest magnitude."""
    rho: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Correlation from one sample to the next: 0 white, 0.9 coloured."""

    @property
    def absolute(self) -> float:
        """Standard deviation in the unit of the channel, which only the channel's own block can give; else 0."""
        return next((float(size) for name, size in self if name.startswith("sd_")), 0.0)

    @model_validator(mode="after")
    def _one_size(self) -> ChannelNoise:
        if self.share_of_peak > 0.0 and self.absolute > 0.0:
            raise ValueError("say the size of the noise once: as share_of_peak or in the unit of the channel")
        return self


class ForceNoise(ChannelNoise):
    """Noise of the force."""

    sd_N: float = Field(default=0.0, ge=0.0)
    """Standard deviation."""


class DisplacementNoise(ChannelNoise):
    """Noise of the displacement."""

    sd_m: float = Field(default=0.0, ge=0.0)
    """Standard deviation."""


class VoltageNoise(ChannelNoise):
    """Noise of the recorded control signal; the valve sees none of it."""

    sd_voltage_V: float = Field(default=0.0, ge=0.0)
    """Standard deviation."""


class TemperatureNoise(ChannelNoise):
    """Noise of the recorded temperature."""

    sd_degC: float = Field(default=0.0, ge=0.0)
    """Standard deviation."""


class Noise(Frozen):
    """Noise of every channel; none by default."""

    displacement: DisplacementNoise = DisplacementNoise()
    """Of the displacement."""
    force: ForceNoise = ForceNoise()
    """Of the force."""
    voltage: VoltageNoise = VoltageNoise()
    """Of the control signal."""
    temperature: TemperatureNoise = TemperatureNoise()
    """Of the temperature."""


class Resolution(Frozen):
    """The smallest step that each channel can show; 0 for none."""

    displacement_m: float = Field(default=0.0, ge=0.0)
    """Of the displacement."""
    force_N: float = Field(default=0.0, ge=0.0)
    """Of the force."""
    voltage_V: float = Field(default=0.0, ge=0.0)
    """Of the control signal."""
    temperature_degC: float = Field(default=0.0, ge=0.0)
    """Of the temperature."""


class Jitter(Frozen):
    """What differs from test to test: standard deviations of what is drawn anew for every record."""

    gain: float = Field(default=0.0, ge=0.0)
    """Of the gain of the force channel, as a share."""
    offset_of_peak: float = Field(default=0.0, ge=0.0)
    """Of an offset of the force, as a share of the record's largest force."""
    delay_s: float = Field(default=0.0, ge=0.0)
    """Of a delay of the force behind the displacement."""


# --- The stand, and its plan of records ---


@dataclass(frozen=True)
class PlannedRecord:
    """One record that the stand is going to take."""

    name: str
    test: StandTest
    voltage: Voltage | None
    temperature: Temperature | None


class VirtualEntry(Frozen):
    """A virtual stand with one damper in it."""

    setting: str | None = Field(default=None, min_length=1)
    """Which setting of the damper this is; its name leads the names of the records."""
    damper: Damper
    """The damper in the stand, with any effects."""
    tests: tuple[StandTest, ...] = Field(min_length=1)
    """What the stand runs."""
    voltages_V: tuple[Voltage, ...] | None = Field(default=None, min_length=1)
    """Voltages at which every test is run: numbers, `{kind: steps}` or `{kind: ramp}`. By default no voltage is
    recorded, which suits a damper without a valve."""
    temperatures_degC: tuple[Temperature, ...] | None = Field(default=None, min_length=1)
    """Temperatures at which every test is run: numbers or `{kind: warming}`. By default none is recorded."""
    fixture: StandFixture = StandFixture()
    """Mass, frame and tare of the stand."""
    noise: Noise = Noise()
    """Noise of the channels."""
    resolution: Resolution = Resolution()
    """Quantisation of the channels."""
    jitter: Jitter = Jitter()
    """What differs from test to test."""
    force_delay_s: float = Field(default=0.0, ge=0.0)
    """Delay of the force channel behind the displacement, in every record."""
    rate_Hz: float = Field(default=1000.0, gt=0.0)
    """Sampling rate of the records."""
    oversampling: int = Field(default=16, ge=16)
    """The truth is computed from the continuous waveform at this many times the sampling rate."""

    @model_validator(mode="after")
    def _complete(self) -> VirtualEntry:
        faults = [*self._missing("voltages_V", _needs_voltage(self.damper))]
        faults += self._missing("temperatures_degC", _needs_temperature(self.damper))
        names = [planned.name for planned in self.plan()]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            faults.append(f"two records would be called {', '.join(twice)}; give a waveform a label, or use repeats")
        if faults:
            raise ValueError("; ".join(faults))
        return self

    def _missing(self, field: str, reason: str | None) -> Iterator[str]:
        absent = getattr(self, field) is None and any(getattr(test, field) is None for test in self.tests)
        if reason and absent:
            yield f"{field} is missing: {reason}"

    def plan(self, control: Control | None = None) -> tuple[PlannedRecord, ...]:
        """Return every record that the stand is going to take, in order, with its name.

        Parameters
        ----------
        control : the control signal, whose unit stands in the names
        """
        unit = (control or Control()).unit
        return tuple(
            PlannedRecord(self._name(test, voltage, temperature, number, unit), test, voltage, temperature)
            for test in self.tests
            for temperature in test.temperatures_degC or self.temperatures_degC or (None,)
            for voltage in test.voltages_V or self.voltages_V or (None,)
            for number in range(1, test.repeats + 1)
        )

    def _name(
        self, test: StandTest, voltage: Voltage | None, temperature: Temperature | None, number: int, unit: str
    ) -> str:
        parts = [self.setting or "", test.waveform.name]
        if voltage is not None:
            parts.append(f"{voltage:g}{unit}" if isinstance(voltage, float | int) else voltage.name(unit))
        if temperature is not None:
            parts.append(f"{temperature:g}degC" if isinstance(temperature, float | int) else temperature.name())
        if test.repeats > 1:
            parts.append(str(number))
        return safe_name("-".join(part for part in parts if part))


def _needs_voltage(damper: Damper) -> str | None:
    """Return why a damper cannot be tested without a voltage, None where it can."""
    if len({row.voltage_V for row in damper.base}) > 1:
        return "the damper has base rows at several voltages"
    for name, values in damper.effects.items():
        if NODE_VOLTAGES in values or known()[name].place == "drive":
            return f"{name} depends on the voltage"
    return None


def _needs_temperature(damper: Damper) -> str | None:
    """Return why a damper cannot be tested without a temperature, None where it can."""
    if len({row.temperature_degC for row in damper.base}) > 1:
        return "the damper has base rows at several temperatures"
    material = [name for name in damper.effects if known()[name].place == "material"]
    return f"{material[0]} depends on the temperature" if material else None
