"""The virtual test stand: a damper, a campaign of tests, and what the data logger would have recorded.

The truth comes from the continuous waveform at 16 times the sampling rate or more. A test starts
from rest before its recording begins and goes on until the damper has forgotten how it started, so
a periodic motion gives a periodic force from the first sample on.
"""

from __future__ import annotations

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
from pzd.rig.stand.config import PlannedRecord, StandTest, VirtualEntry
from pzd.rig.stand.frame import force_in_frame
from pzd.rig.stand.programmes import Warming, voltage_over
from pzd.rig.stand.sensors import draw_for, sensed
from pzd.rig.stand.waveform import started
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import Kinematics, kinematics

ForceLaw = Callable[[Damper, Motion, float | None], Array]
"""Gives the force (n,) [N] of a damper in a motion of the actuator, behind a frame of this stiffness [N/m]."""


@dataclass(frozen=True, eq=False)
class Taken:
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
    for taken in take(entry, seed, folder, control):
        clean = kinematics(taken.time, taken.displacement, cycles(taken.time, taken.displacement))
        found.append(record_of(taken, clean))
    return tuple(found)


def record_of(taken: Taken, clean: Kinematics) -> Record:
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


def take(
    entry: VirtualEntry,
    seed: int,
    folder: Path = Path(),
    control: Control | None = None,
    law: ForceLaw = force_in_frame,
) -> Iterator[Taken]:
    """Run the campaign, one record after the other.

    Parameters
    ----------
    entry : the stand
    seed : of every draw
    folder : of the config, for motions that are read
    control : the control signal, whose unit stands in the names
    law : gives the force; another law puts another damper into the stand
    """
    return map(taker(entry, seed, folder, law), entry.plan(control))


def taker(
    entry: VirtualEntry, seed: int, folder: Path = Path(), law: ForceLaw = force_in_frame
) -> Callable[[PlannedRecord], Taken]:
    """What takes one planned record, in any order; it keeps the motion of the test that it took last.

    Parameters
    ----------
    entry, seed, folder, law : as for `take`
    """
    drive: _Drive | None = None

    def taken(planned: PlannedRecord) -> Taken:
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


def _taken(entry: VirtualEntry, planned: PlannedRecord, drive: _Drive, seed: int, law: ForceLaw) -> Taken:
    motion, force = _truth(entry, planned, drive, law)
    force += entry.fixture.tare_N + entry.fixture.mass_kg * motion.acceleration
    draw = partial(draw_for, seed, planned.name)
    sampled = slice(drive.lead, None, entry.oversampling)
    late = _sensed_force(entry, motion.time, force, sampled, draw("jitter"))
    truth = _sampled(motion, sampled)
    noise, resolution = entry.noise, entry.resolution
    return Taken(
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
    from pzd.rig.stand.warming import warmed

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
