"""The virtual test stand: a damper, a campaign of tests, and what the data logger would have recorded.

The truth comes from the continuous waveform at 16 times the sampling rate or more. A test starts
from rest before its recording begins and goes on until the damper has forgotten how it started, so
a periodic motion gives a periodic force from the first sample on.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.rig.stand.config import ChannelNoise, PlannedRecord, StandTest, VirtualEntry, Warming, voltage_over
from pzd.rig.stand.frame import force_in_frame
from pzd.rig.stand.waveforms import started
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import Kinematics, kinematics
from pzd.signals.noise import recursion

# ----------------------------------------------------------------------------------------------------
# What the sensors make of the truth: gain, offset, noise and resolution, each drawn by the record's name.


def draw_for(seed: int, *names: str) -> np.random.Generator:
    """Random numbers that depend on the seed and these names alone, whatever else is drawn.

    Parameters
    ----------
    seed : of the run
    names : e.g. the record and the channel
    """
    digests = [hashlib.blake2b(name.encode(), digest_size=8).digest() for name in names]
    key = tuple(int.from_bytes(digest, "little") for digest in digests)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def coloured(count: int, rho: float, draw: np.random.Generator) -> Array:
    """Stationary Gaussian noise of unit variance.

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
    """A channel with its noise, rounded to what it can show.

    Parameters
    ----------
    truth : (n,) what is there
    noise : size and colour of the noise
    resolution : smallest step; 0 for none
    draw : where the numbers come from

    Returns
    -------
    (n,) what is recorded
    """
    size = noise.absolute + noise.share_of_peak * float(np.max(np.abs(truth)))
    shown = truth + size * coloured(truth.size, noise.rho, draw) if size > 0.0 else truth
    return np.round(shown / resolution) * resolution if resolution > 0.0 else shown


# ----------------------------------------------------------------------------------------------------
# How a damper warms with the work done on it, and what the warmth does to its force.


_ROUNDS = 20
_SETTLED = 1e-6
"""Change of the temperature in a round that ends the search [K]."""


def temperature_over(warming: Warming, time: Array, displacement: Array, force: Array) -> Array:
    """Temperature of the damper; constant before time 0.

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
    kept = -math.expm1(-rate) / rate if rate > 0.0 else 1.0
    work = 0.5 * (force[1:] + force[:-1]) * np.diff(displacement)
    first = max(int(np.searchsorted(time, -0.5 * step)), 0)
    above = np.concatenate(([warming.start_degC - ambient], kept * work[first:] / warming.heat_capacity_J_per_K))
    return ambient + np.concatenate((np.full(first, above[0]), recursion(decay, above)))


def warmed(
    warming: Warming, time: Array, displacement: Array, force_at: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Force and temperature of a damper that warms, each computed from the other until they agree.

    Parameters
    ----------
    warming : the heat balance
    time : (n,) at equal steps [s]
    displacement : (n,) [m]
    force_at : gives the force (n,) [N] at a temperature (n,) [degC]

    Returns
    -------
    (n,) force [N] and (n,) temperature [degC]
    """
    temperature = np.full(time.size, warming.start_degC)
    for _ in range(_ROUNDS):
        force = force_at(temperature)
        last, temperature = temperature, temperature_over(warming, time, displacement, force)
        if np.max(np.abs(temperature - last)) <= _SETTLED:
            break
    return force, temperature


# ----------------------------------------------------------------------------------------------------


ForceLaw = Callable[[Damper, Motion, float | None], Array]
"""Gives the force (n,) [N] of a damper in a motion of the actuator, behind a frame of this stiffness [N/m]."""


@dataclass(frozen=True, eq=False)
class StandRecord:
    """One record as the data logger has it, and the truth behind it; every array is (n,)."""

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


def records(
    entry: VirtualEntry, seed: int, folder: Path = Path(), control: Control | None = None
) -> tuple[Record, ...]:
    """What the stand records, with velocity and acceleration derived as for measured files.

    Parameters
    ----------
    entry : the stand
    seed : of every draw; a record's draws depend on the seed and its own name alone
    folder : of the config, for motions that are read
    control : the control signal, whose unit stands in the names

    Returns
    -------
    one record a test, voltage and temperature

    Raises
    ------
    ConfigError : when the file of a motion is missing
    DataError : when the file of a motion cannot be read
    """
    found = []
    for taken in run_campaign(entry, seed, folder, control):
        clean = kinematics(taken.time, taken.displacement, cycles(taken.time, taken.displacement))
        found.append(record_of(taken, clean))
    return tuple(found)


def record_of(taken: StandRecord, clean: Kinematics) -> Record:
    """The record of a test, its velocity and acceleration derived from the recorded displacement."""
    return Record(
        taken.name,
        taken.setting,
        taken.time,
        taken.displacement,
        clean.velocity,
        clean.acceleration,
        taken.force,
        taken.voltage,
        taken.temperature,
    )


def run_campaign(
    entry: VirtualEntry,
    seed: int,
    folder: Path = Path(),
    control: Control | None = None,
    law: ForceLaw = force_in_frame,
) -> Iterator[StandRecord]:
    """Run the campaign, one record after the other.

    Parameters
    ----------
    entry : the stand
    seed : of every draw
    folder : of the config, for motions that are read
    control : the control signal, whose unit stands in the names
    law : gives the force; another law puts another damper into the stand
    """
    return map(recorder(entry, seed, folder, law), entry.plan(control))


def recorder(
    entry: VirtualEntry, seed: int, folder: Path = Path(), law: ForceLaw = force_in_frame
) -> Callable[[PlannedRecord], StandRecord]:
    """What takes one planned record, in any order; it keeps the motion of the test that it took last.

    Parameters
    ----------
    entry, seed, folder, law : as for `take`
    """
    drive: _Drive | None = None

    def taken(planned: PlannedRecord) -> StandRecord:
        nonlocal drive
        if drive is None or drive.test is not planned.test:
            drive = _drive(entry, planned.test, seed, folder)
        return _taken(entry, planned, drive, seed, law)

    return taken


@dataclass(frozen=True, eq=False)
class _Drive:
    """The motion of the actuator in one test, at the fine rate, lead-in included."""

    test: StandTest
    motion: Motion
    lead: int
    """Fine samples before the recording begins."""
    duration: float


def _drive(entry: VirtualEntry, test: StandTest, seed: int, folder: Path) -> _Drive:
    waveform = test.waveform
    count = round(_duration(test, folder) * entry.rate_Hz)
    fine = entry.rate_Hz * entry.oversampling
    lead = math.ceil(waveform.settling_time * entry.rate_Hz) * entry.oversampling
    time = np.arange(-lead, count * entry.oversampling + 1) / fine
    course = waveform.course(draw_for(seed, "motion", waveform.name), folder)
    return _Drive(test, Motion(time, *started(course, lead / fine)(time)), lead, count / entry.rate_Hz)


def _duration(test: StandTest, folder: Path) -> float:
    if test.duration_s is not None:
        return test.duration_s
    return (test.cycles or test.waveform.usual_cycles) * test.waveform.cycle(folder)


def _taken(entry: VirtualEntry, planned: PlannedRecord, drive: _Drive, seed: int, law: ForceLaw) -> StandRecord:
    motion, force = _truth(entry, planned, drive, law)
    force += entry.fixture.tare_N + entry.fixture.mass_kg * motion.acceleration
    draw = partial(draw_for, seed, planned.name)
    sampled = slice(drive.lead, None, entry.oversampling)
    late = _sensed_force(entry, motion.time, force, sampled, draw("jitter"))
    truth = _sampled(motion, sampled)
    noise, resolution = entry.noise, entry.resolution
    return StandRecord(
        planned.name,
        entry.setting,
        truth.time,
        sensed(truth.displacement, noise.displacement, resolution.displacement_m, draw("displacement")),
        sensed(late, noise.force, resolution.force_N, draw("force")),
        None if truth.voltage is None else sensed(truth.voltage, noise.voltage, resolution.voltage_V, draw("voltage")),
        None
        if truth.temperature is None
        else sensed(truth.temperature, noise.temperature, resolution.temperature_degC, draw("temperature")),
        truth,
        force[sampled],
    )


def _truth(entry: VirtualEntry, planned: PlannedRecord, drive: _Drive, law: ForceLaw) -> tuple[Motion, Array]:
    """Motion, voltage, temperature and force of the damper at the fine rate."""
    motion, stiffness = drive.motion, entry.fixture.stiffness_N_per_m
    if planned.voltage is not None:
        motion = replace(motion, voltage=voltage_over(planned.voltage, motion.time, drive.duration))
    if not isinstance(planned.temperature, Warming):
        if planned.temperature is not None:
            motion = replace(motion, temperature=np.full(motion.time.size, planned.temperature))
        return motion, law(entry.damper, motion, stiffness)
    # Imported where a damper warms: most do not.

    force, temperature = warmed(
        planned.temperature,
        motion.time,
        motion.displacement,
        lambda warm: law(entry.damper, replace(motion, temperature=warm), stiffness),
    )
    return replace(motion, temperature=temperature), force


def _sampled(motion: Motion, sampled: slice) -> Motion:
    channels = (motion.displacement, motion.velocity, motion.acceleration, motion.voltage, motion.temperature)
    return Motion(motion.time[sampled], *(None if one is None else one[sampled] for one in channels))  # type: ignore[arg-type]  # the first three are never None


def _sensed_force(entry: VirtualEntry, time: Array, force: Array, sampled: slice, draw: np.random.Generator) -> Array:
    """The force with the delay, gain and offset of this test."""
    gain, offset, delay = draw.standard_normal(3)
    late = entry.force_delay_s + entry.jitter.delay_s * delay
    shown = force[sampled] if late == 0.0 else np.interp(time[sampled] - late, time, force)
    peak = float(np.max(np.abs(shown)))
    return np.asarray(shown * (1.0 + entry.jitter.gain * gain) + entry.jitter.offset_of_peak * peak * offset)
