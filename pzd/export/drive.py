"""The history that drives a stand: a ramp in, loops that repeat, a ramp out, within the limits of the stand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter, ValidationError

from pzd.artefacts import NextTest
from pzd.artefacts.diagnosis import CYCLES_OF_TEST, STEPS_PER_CYCLE
from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.record import Array, Record
from pzd.rig.config import Limits
from pzd.rig.stand.waveforms import Course, Waveform, started, waveforms
from pzd.schema.errors import ConfigError

RATE_HZ = 1024.0
"""Least rate of the samples, of which a loop takes a whole number [Hz]: a controller interpolates between them."""
_SLACK = 1e-3  # of a limit: what was recorded is known no closer


@dataclass(frozen=True, eq=False)
class Drive:
    """A history over time, its displacement as the stand records it."""

    name: str
    """Of the waveform."""
    step: float
    """Sampling interval [s]."""
    displacement: Array
    """(n,) [m]"""
    signal: Array | None
    """(n,) control signal; None without one."""
    loops: int
    loop_samples: int
    """Samples of a loop; the second begins so many after the first."""
    ramp_samples: int
    """Samples before the first loop, and after the last."""
    middle: float
    """Of the motion, where it begins and ends [m]."""

    @property
    def time(self) -> Array:
        """(n,) times [s]."""
        return np.asarray(self.step * np.arange(self.displacement.size))


@dataclass(frozen=True)
class Plan:
    """What a stand is to do."""

    waveform: Waveform
    middle: float
    """Middle of the motion, in the displacement as recorded [m]."""
    signal: float | tuple[float, ...] | None
    """Control signal: one, two between which it is stepped, or none."""
    within: Limits
    """Of the stand; a limit of None is not known."""
    damper: Damper
    """Whose force the stand has to bear."""
    folder: Path = Path()
    """Of the config, for motions that are read."""


def plan_of(
    found: NextTest | None,
    asked: str | None,
    records: Sequence[Record],
    limits: Limits,
    damper: Damper,
    folder: Path = Path(),
) -> Plan:
    """Return what the stand is to do: the test that diagnose asks for next, or a waveform.

    Parameters
    ----------
    found : the next test
    asked : block of a waveform as under `tests` of a virtual stand, in YAML; None for the next test
    records : of the damper's setting
    limits : of the config; what they leave open is what the records reached
    damper : on the stand
    folder : of the config

    Raises
    ------
    ConfigError : when there is no next test, or the waveform is none
    """
    low = min(float(np.min(record.displacement)) for record in records)
    high = max(float(np.max(record.displacement)) for record in records)
    signals = [record.voltage for record in records if record.voltage is not None]
    reached = {
        "stroke_m": limits.stroke_m or high - low,
        "speed_m_per_s": limits.speed_m_per_s or max(float(np.max(np.abs(record.velocity))) for record in records),
        "voltage_V": limits.voltage_V or _range(signals),
    }
    known = limits.model_copy(update=reached)
    middle, signal = 0.5 * (low + high), float(np.min(signals[0])) if signals else None
    if asked is not None:
        return Plan(_waveform(asked), middle, signal, known, damper, folder)
    if found is None or found.frequency_Hz is None or found.amplitude_m is None:
        raise ConfigError(
            "--to drive: the diagnosis asks for no next test; give one by --waveform, as "
            "--waveform '{kind: sine, frequency_Hz: 2, amplitude_m: 0.01}'"
        )
    kind = found.waveform.partition(",")[0]
    block = {"kind": kind, "frequency_Hz": found.frequency_Hz, "amplitude_m": found.amplitude_m}
    return Plan(
        waveforms()[kind].model_validate(block),
        middle if found.middle_m is None else found.middle_m,
        found.voltage_V,
        known,
        damper,
        folder,
    )


def _range(signals: Sequence[Array]) -> tuple[float, float] | None:
    if not signals:
        return None
    low, high = min(float(np.min(one)) for one in signals), max(float(np.max(one)) for one in signals)
    return (low, high) if low < high else None


def _waveform(text: str) -> Waveform:
    """Read the block of a waveform."""
    import yaml

    try:
        block = yaml.safe_load(text)
        kind = block["kind"]
        return TypeAdapter(waveforms()[kind]).validate_python(block)
    except (yaml.YAMLError, TypeError, KeyError):
        raise ConfigError(
            f"--waveform: takes a block with kind: {', '.join(waveforms())}, as "
            f"'{{kind: sine, frequency_Hz: 2, amplitude_m: 0.01}}' (got {text})"
        ) from None
    except ValidationError as error:
        raise ConfigError(
            f"--waveform: {'.'.join(map(str, one['loc']))}: {one['msg']} (got {one['input']})" for one in error.errors()
        ) from None


def drive(plan: Plan, loops: int = CYCLES_OF_TEST) -> Drive:
    """Return the history: the motion grows smoothly from rest, repeats, and dies down as it grew.

    Parameters
    ----------
    plan : what the stand is to do
    loops : cycles between the ramps

    Raises
    ------
    ConfigError : when it would leave the limits of the stand
    """
    waveform = plan.waveform
    cycle = waveform.cycle(plan.folder)
    per_loop = math.ceil(cycle * RATE_HZ)
    step = cycle / per_loop
    # whole cycles, so that the motion is in phase where the first loop begins and where the last has ended
    ramp = per_loop * math.ceil(waveform.settling_time / cycle)
    course = waveform.course(np.random.default_rng(0), plan.folder)
    if not _repeats(course, cycle):
        raise ConfigError(f"--waveform: takes a motion that repeats, to make loops of (got {waveform.kind})")
    into = started(course, ramp * step)
    time = step * np.arange(-ramp, loops * per_loop)
    parts = into(np.asarray(time)), _ended(course, ramp * step)(np.asarray(step * np.arange(ramp + 1)))
    x, v, a = (np.concatenate(both) for both in zip(*parts, strict=True))
    signal = None
    if isinstance(plan.signal, tuple):
        phase = STEPS_PER_CYCLE * np.arange(-ramp, x.size - ramp) / per_loop
        signal = np.where(phase % 2.0 < 1.0, plan.signal[0], plan.signal[-1])
    elif plan.signal is not None:
        signal = np.full(x.size, plan.signal)
    warm = plan.damper.reference_temperature_degC
    warm = next((row.temperature_degC for row in plan.damper.base), None) if warm is None else warm
    temperature = None if warm is None else np.full(x.size, warm)
    _check(plan, Motion(np.asarray(step * np.arange(x.size)), plan.middle + x, v, a, signal, temperature))
    return Drive(waveform.name, step, plan.middle + x, signal, loops, per_loop, ramp, plan.middle)


def _ended(course: Course, length: float) -> Course:
    """Return the motion from the end of the last loop on, where it dies down to rest: `started`, run backwards."""

    def backwards(time: Array) -> tuple[Array, Array, Array]:
        x, v, a = course(-time)
        return x, -v, a

    dying = started(backwards, length)

    def motion(time: Array) -> tuple[Array, Array, Array]:
        x, v, a = dying(-time)
        return x, -v, a

    return motion


def _repeats(course: Course, cycle: float) -> bool:
    """Return whether a motion is the same a cycle later."""
    first, second = (course(start + cycle * np.linspace(0.0, 1.0, 9)) for start in (0.0, cycle))
    sizes = (float(np.max(np.abs(part))) for part in first)
    apart = (float(np.max(np.abs(one - other))) for one, other in zip(first, second, strict=True))
    return all(gap <= 1e-6 * size for gap, size in zip(apart, sizes, strict=True))


def _check(plan: Plan, motion: Motion) -> None:
    """Refuse a history beyond the limits of the stand."""
    within, signal = plan.within, motion.voltage
    asked = {
        ("stroke", "m", "stroke_m"): 2.0 * float(np.max(np.abs(motion.displacement - plan.middle))),
        ("speed", "m/s", "speed_m_per_s"): float(np.max(np.abs(motion.velocity))),
        ("frequency", "Hz", "frequency_Hz"): plan.waveform.lowest_frequency,
    }
    if within.force_N is not None:
        asked["force", "N", "force_N"] = float(np.max(np.abs(respond(plan.damper, motion))))
    found = [
        f"a {name} of {value:.4g} {unit}, of {limit:.4g} {unit} (rig.limits.{key})"
        for (name, unit, key), value in asked.items()
        if (limit := getattr(within, key)) is not None and math.isfinite(value) and value > (1.0 + _SLACK) * limit
    ]
    if within.voltage_V is not None and signal is not None:
        low, high = within.voltage_V
        if float(np.min(signal)) < low or float(np.max(signal)) > high:
            found.append(f"a control signal of {np.min(signal):g} to {np.max(signal):g}, of {low:g} to {high:g}")
    if found:
        raise ConfigError(f"--to drive: beyond what the stand can do: {one}; ask for less" for one in found)
