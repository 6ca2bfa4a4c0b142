"""Checks of the motion: number of cycles, limits of the stand, resolution, recorded velocity, steps of amplitude."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pzd.artefacts import Finding, RecordEntry
from pzd.rig.preflight import PreflightRecord
from pzd.signals.measures import rms
from pzd.signals.period import moving_range
from pzd.signals.segmentation import steps_between_tests

ENOUGH_CYCLES = 3.0
"""Cycles from which their scatter tells something about the noise."""


def cycle_count(test: PreflightRecord) -> Iterator[Finding]:
    """Find fewer than three cycles."""
    count = test.cycle_count
    if count < ENOUGH_CYCLES:
        yield Finding(
            check="cycles",
            where="the whole record",
            size=count,
            unit="cycles",
            follows=f"fewer than {ENOUGH_CYCLES:g}: noise and repeatability cannot be told from the damper; "
            "record 10 or more",
        )


QUASI_STATIC = 1e-3
"""R.m.s. speed [m/s] up to which a test is quasi-static: a damper of 2000 N s/m gives 2 N there."""


def quasi_static(entries: tuple[RecordEntry, ...]) -> tuple[RecordEntry, ...]:
    """Find tests that are all so slow that they cannot show damping."""
    speeds = [entry.velocity_rms_m_per_s or 0.0 for entry in entries]
    if not entries or max(speeds) > QUASI_STATIC:
        return entries
    return tuple(
        entry.model_copy(
            update={
                "findings": (
                    *entry.findings,
                    Finding(
                        check="speed",
                        where="the whole record, as every other of the rig, r.m.s. speed",
                        size=speed,
                        unit="m/s",
                        follows="quasi-static: friction, gas force and springs show, the damping coefficient does not; "
                        "drive faster tests as well",
                    ),
                )
            }
        )
        for entry, speed in zip(entries, speeds, strict=True)
    )


# --- Limits of the stand, and rest before and after the motion ---

REST = 0.1
"""Share of a record at rest, before and after the motion, above which it is reported."""
MARGIN = 0.05
"""Limits are round numbers: a stand may exceed them by this share."""
FULL = 0.94
"""Share of the cell's range, margin included, from which the force may have been cut off."""


def reach(test: PreflightRecord) -> Iterator[Finding]:
    """Find stroke, speed, frequency and force beyond the stand's limits, and rest before and after the motion."""
    record, limits = test.record, test.limits
    reached = (
        ("stroke", float(np.ptp(record.displacement)), limits.stroke_m, "m"),
        ("speed", float(np.abs(test.clean.velocity).max()), limits.speed_m_per_s, "m/s"),
        ("frequency", test.cycles.frequency if test.cycles else 0.0, limits.frequency_Hz, "Hz"),
        ("force", float(np.abs(record.force).max()), limits.force_N and FULL * limits.force_N, "N"),
    )
    for what, value, limit, unit in reached:
        if limit is not None and value > (1.0 + MARGIN) * limit:
            yield Finding(
                check="reach",
                where=f"{what}, where the stand's limit is {limit:.4g} {unit}",
                size=value,
                unit=unit,
                follows="the stand may not have followed or measured this: check rig.limits, units and the range",
            )
    first, last = moving_range(record.displacement)
    rest = 1.0 - (last - first + 1) / record.time.size
    if rest > REST:
        yield Finding(
            check="rest",
            where=f"before {record.time[first]:.4g} s and after {record.time[last]:.4g} s",
            size=rest,
            unit="-",
            follows="this share of the record says nothing of the damper but how its force settles",
        )


# --- Displacement and velocity channels ---

NOISE_SHARE = 0.005
"""R.m.s. noise of the displacement, as a share of the stroke, above which it is reported."""
GAIN = 0.03
"""Deviation from 1 of the ratio of recorded to derived velocity above which it is reported."""
SHAPE = 0.1
"""R.m.s. of the rest of the velocity, as a share of it, above which it is reported."""


def resolution(test: PreflightRecord) -> Iterator[Finding]:
    """Find noise of the displacement that spoils its derivatives."""
    noise = float(np.std(test.record.displacement - test.clean.displacement))
    share = noise / float(np.ptp(test.record.displacement))
    if share > NOISE_SHARE:
        yield Finding(
            check="resolution",
            where=f"displacement, {share:.2%} of the stroke",
            size=noise,
            unit="m",
            follows="r.m.s. of what does not repeat or is too quick for the motion; stiffness and inertia suffer first",
        )


def recorded_velocity(test: PreflightRecord) -> Iterator[Finding]:
    """Find a recorded velocity of another scale, sign or shape than the derivative of the displacement.

    Such a velocity is left out of the records of files, so that nothing is computed from it.
    """
    recorded, derived = test.record.velocity, test.clean.velocity
    if recorded is derived:
        return
    gain = float(recorded @ derived / (derived @ derived))
    rest = rms(recorded - gain * derived) / rms(derived)
    if abs(gain - 1.0) > GAIN:
        where, cause = "velocity over the rate of displacement", "another unit, sign or filter than the displacement's"
    elif rest > SHAPE:
        where, cause = (
            "what the rate of displacement leaves of the velocity",
            "noise, a delay or a filter in the velocity",
        )
    else:
        return
    yield Finding(
        check="velocity",
        where=f"the whole record, {where}",
        size=gain if abs(gain - 1.0) > GAIN else rest,
        unit="-",
        follows=f"{cause}; left out: the speed is derived from the displacement",
    )


# --- Several tests in one record ---


def steps(test: PreflightRecord) -> Iterator[Finding]:
    """Find steps of amplitude or frequency between stretches of three or more equal cycles."""
    for old, new in steps_between_tests(test.record.time, test.clean.displacement):
        before, after = (f"{1e3 * s.amplitude:.3g} mm at {1.0 / s.period:.3g} Hz" for s in (old, new))
        yield Finding(
            check="steps",
            where=f"displacement, {before} until {old.end:.4g} s, {after} from {new.start:.4g} s",
            size=old.change(new),
            unit="-",
            follows="two tests in one record, identified and diagnosed apart; for two records label each in a column of"
            " its own, and say split: {column: ...}",
        )


CHECKS = (cycle_count, reach, resolution, recorded_velocity, steps)
COMPARISONS = (quasi_static,)
