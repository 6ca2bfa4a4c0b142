"""The virtual test stand: a damper, a campaign of tests, and the records of the data logger.

The true force is computed from the continuous waveform at 16 times the sampling rate or more. A test starts from rest
before its recording begins, early enough for the transient to die out, so a periodic motion gives a periodic force from
the first sample on. Then the warming of the damper, then the sensors: delay, gain, offset, noise and resolution.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.rig.stand.config import ChannelNoise, PlannedRecord, StandTest, VirtualEntry, Warming, voltage_over
from pzd.rig.stand.frame import force_in_frame
from pzd.rig.stand.waveforms import started
from pzd.signals.kinematics import Kinematics
from pzd.signals.noise import recursion

# --- Sensors ---


def draw_for(seed: int, *names: str) -> np.random.Generator:
    """Return a generator that depends on the seed and these names alone, whatever else is drawn.

    Parameters
    ----------
    seed : of the run
    names : e.g. the record and the channel
    """
    digests = [hashlib.blake2b(name.encode(), digest_size=8).digest() for name in names]
    key = tuple(int.from_bytes(digest, "little") for digest in digests)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def coloured(count: int, rho: float, draw: np.random.Generator) -> Array:
    """Draw stationary Gaussian noise of unit variance.

    Equation: e_i = rho e_(i-1) + sqrt(1 - rho^2) g_i, e_0 = g_0      Source: AR(1)

    Parameters
    ----------
    count : number of samples
    rho : correlation from one sample to the next
    draw : where the numbers come from

    Returns
    -------
    (count,)
    """
    innovations = draw.standard_normal(count)
    innovations[1:] *= math.sqrt(1.0 - rho**2)
    return recursion(rho, innovations)


def sensed(truth: Array, noise: ChannelNoise, resolution: float, draw: np.random.Generator) -> Array:
    """Add the noise of a channel to its true values, and round them to its resolution.

    Parameters
    ----------
    truth : (n,)
    noise : size and colour of the noise
    resolution : smallest step; 0 for none
    draw : where the numbers come from

    Returns
    -------
    (n,) as recorded
    """
    size = noise.absolute + noise.share_of_peak * float(np.max(np.abs(truth)))
    shown = truth + size * coloured(truth.size, noise.rho, draw) if size > 0.0 else truth
    return np.round(shown / resolution) * resolution if resolution > 0.0 else shown


# --- Warming ---

_MOST_ITERATIONS = 20
"""Warming is slow and softens the damper by little, so that a few suffice."""
_CONVERGED = 1e-6
"""Change of the temperature in an iteration that ends it [K]: a millionth of what a thermocouple tells apart."""


def temperature_over(warming: Warming, time: Array, displacement: Array, force: Array) -> Array:
    """Integrate the temperature of the damper from time 0 on; it is constant before.

    Equation: C_h dT/dt = F v - G (T - T_ambient)           Source: heat balance of one lump

    Parameters
    ----------
    warming : start, surroundings, heat capacity C_h and loss G
    time : (n,) at equal steps [s]
    displacement : (n,) [m]
    force : (n,) [N]

    Returns
    -------
    (n,) temperature [degC]
    """
    ambient = warming.start_degC if warming.ambient_degC is None else warming.ambient_degC
    step = float((time[-1] - time[0]) / (time.size - 1))
    rate = warming.loss_W_per_K * step / warming.heat_capacity_J_per_K
    decay = math.exp(-rate)
    # Share of the heat of a step that is still there at its end, exact for a constant power.
    remaining = -math.expm1(-rate) / rate if rate > 0.0 else 1.0
    work = 0.5 * (force[1:] + force[:-1]) * np.diff(displacement)
    first = max(int(np.searchsorted(time, -0.5 * step)), 0)
    above = np.concatenate(([warming.start_degC - ambient], remaining * work[first:] / warming.heat_capacity_J_per_K))
    return ambient + np.concatenate((np.full(first, above[0]), recursion(decay, above)))


def warmed(
    warming: Warming, time: Array, displacement: Array, force_at: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Compute force and temperature of a damper that warms, each from the other until they agree.

    Parameters
    ----------
    warming : the heat balance
    time : (n,) at equal steps [s]
    displacement : (n,) [m]
    force_at : force (n,) [N] at a temperature (n,) [degC]

    Returns
    -------
    (n,) force [N] and (n,) temperature [degC]
    """
    temperature = np.full(time.size, warming.start_degC)
    for _ in range(_MOST_ITERATIONS):
        force = force_at(temperature)
        last, temperature = temperature, temperature_over(warming, time, displacement, force)
        if np.max(np.abs(temperature - last)) <= _CONVERGED:
            break
    return force, temperature


# --- Campaign of tests ---

ForceLaw = Callable[[Damper, Motion, float | None], Array]
"""Force (n,) [N] of a damper in a motion of the actuator, behind a frame of this stiffness [N/m]."""


@dataclass(frozen=True, eq=False)
class StandRecord:
    """One test as the data logger records it, and the truth behind it; every array is (n,)."""

    name: str
    setting: str | None
    time: Array
    displacement: Array
    force: Array
    voltage: Array | None
    temperature: Array | None
    truth: Motion
    """Exact motion of the actuator, voltage and temperature at the same instants."""
    true_force: Array
    """Force in the cell before the sensor: fixture included, no gain, offset, delay or noise."""

    def as_record(self, clean: Kinematics) -> Record:
        """Return the record, with velocity and acceleration derived from the recorded displacement."""
        return Record(
            self.name,
            self.setting,
            self.time,
            self.displacement,
            clean.velocity,
            clean.acceleration,
            self.force,
            self.voltage,
            self.temperature,
        )


def run_campaign(
    entry: VirtualEntry, seed: int, control: Control | None = None, law: ForceLaw = force_in_frame
) -> Iterator[StandRecord]:
    """Record every test of a campaign, one after the other.

    Parameters
    ----------
    entry : the stand
    seed : of every draw; the draws of a record depend on the seed and its own name alone
    control : the control signal, whose unit stands in the names
    law : computes the force; another law puts another damper into the stand
    """
    return map(recorder(entry, seed, law=law), entry.plan(control))


def recorder(
    entry: VirtualEntry, seed: int, folder: Path = Path(), law: ForceLaw = force_in_frame
) -> Callable[[PlannedRecord], StandRecord]:
    """Return what records one planned test, in any order; it remembers the motion of the last one.

    Parameters
    ----------
    entry, seed : as for `run_campaign`
    folder : of the config, for motions that are read; the record raises ConfigError where the file of one is missing,
        and DataError where it cannot be read
    law : as for `run_campaign`
    """
    last: _Drive | None = None

    def record(planned: PlannedRecord) -> StandRecord:
        nonlocal last
        if last is None or last.test is not planned.test:
            last = _drive(entry, planned.test, seed, folder)
        return _record(entry, planned, last, seed, law)

    return record


@dataclass(frozen=True, eq=False)
class _Drive:
    """Motion of the actuator in one test, at the fine rate, lead-in included."""

    test: StandTest
    motion: Motion
    lead: int
    """Fine samples before the recording begins."""
    duration: float
    """Of the recording [s]."""


def _drive(entry: VirtualEntry, test: StandTest, seed: int, folder: Path) -> _Drive:
    waveform, duration = test.waveform, test.duration_s
    if duration is None:
        duration = (test.cycles or waveform.usual_cycles) * waveform.cycle(folder)
    count = round(duration * entry.rate_Hz)
    fine = entry.rate_Hz * entry.oversampling
    lead = math.ceil(waveform.settling_time * entry.rate_Hz) * entry.oversampling
    time = np.arange(-lead, count * entry.oversampling + 1) / fine
    course = waveform.course(draw_for(seed, "motion", waveform.name), folder)
    return _Drive(test, Motion(time, *started(course, lead / fine)(time)), lead, count / entry.rate_Hz)


def _record(entry: VirtualEntry, planned: PlannedRecord, drive: _Drive, seed: int, law: ForceLaw) -> StandRecord:
    motion, force = _truth(entry, planned, drive, law)
    force += entry.fixture.tare_N + entry.fixture.mass_kg * motion.acceleration
    rows = slice(drive.lead, None, entry.oversampling)
    channels = (motion.displacement, motion.velocity, motion.acceleration, motion.voltage, motion.temperature)
    truth = Motion(motion.time[rows], *(None if one is None else one[rows] for one in channels))  # type: ignore[arg-type]  # the first three are never None
    noise, resolution = entry.noise, entry.resolution

    def channel(name: str, values: Array, of_channel: ChannelNoise, step: float) -> Array:
        return sensed(values, of_channel, step, draw_for(seed, planned.name, name))

    delayed = _through_cell(entry, motion.time, force, rows, draw_for(seed, planned.name, "jitter"))
    voltage, temperature = truth.voltage, truth.temperature
    if voltage is not None:
        voltage = channel("voltage", voltage, noise.voltage, resolution.voltage_V)
    if temperature is not None:
        temperature = channel("temperature", temperature, noise.temperature, resolution.temperature_degC)
    return StandRecord(
        planned.name,
        entry.setting,
        truth.time,
        channel("displacement", truth.displacement, noise.displacement, resolution.displacement_m),
        channel("force", delayed, noise.force, resolution.force_N),
        voltage,
        temperature,
        truth,
        force[rows],
    )


def _truth(entry: VirtualEntry, planned: PlannedRecord, drive: _Drive, law: ForceLaw) -> tuple[Motion, Array]:
    """Motion with voltage and temperature, and force of the damper, at the fine rate."""
    motion, stiffness = drive.motion, entry.fixture.stiffness_N_per_m
    if planned.voltage is not None:
        motion = replace(motion, voltage=voltage_over(planned.voltage, motion.time, drive.duration))
    if not isinstance(planned.temperature, Warming):
        if planned.temperature is not None:
            motion = replace(motion, temperature=np.full(motion.time.size, planned.temperature))
        return motion, law(entry.damper, motion, stiffness)
    force, temperature = warmed(
        planned.temperature,
        motion.time,
        motion.displacement,
        lambda warm: law(entry.damper, replace(motion, temperature=warm), stiffness),
    )
    return replace(motion, temperature=temperature), force


def _through_cell(entry: VirtualEntry, time: Array, force: Array, rows: slice, draw: np.random.Generator) -> Array:
    """Force with the delay, gain and offset of this test."""
    gain, offset, jitter = draw.standard_normal(3)
    delay = entry.force_delay_s + entry.jitter.delay_s * jitter
    shown = force[rows] if delay == 0.0 else np.interp(time[rows] - delay, time, force)
    peak = float(np.max(np.abs(shown)))
    return np.asarray(shown * (1.0 + entry.jitter.gain * gain) + entry.jitter.offset_of_peak * peak * offset)
