"""Whether the motion stayed within what the stand can do, and whether it moved at all times."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.rig.preflight import Measured
from pzd.signals.period import moving_range

RESTS = 0.1
"""Share of a record at rest, before and after the motion, that is said."""
MARGIN = 0.05
"""A limit is a round number: so much beyond it is none."""
FULL = 0.94
"""Share of the cell's range, margin included, from which it may have been cut off."""


def check(test: Measured) -> list[Finding]:
    """Stroke, speed, frequency and force beyond the stand's limits, and rest before and after the motion."""
    record, limits = test.record, test.limits
    reached = (
        ("stroke", float(np.ptp(record.displacement)), limits.stroke_m, "m"),
        ("speed", float(np.abs(test.clean.velocity).max()), limits.speed_m_per_s, "m/s"),
        ("frequency", test.run.frequency if test.run else 0.0, limits.frequency_Hz, "Hz"),
        ("force", float(np.abs(record.force).max()), limits.force_N and FULL * limits.force_N, "N"),
    )
    found = [
        Finding(
            check="reach",
            where=f"{what}, where the stand's limit is {limit:.4g} {unit}",
            size=value,
            unit=unit,
            follows="the stand may not have followed or measured this: check rig.limits, units and the range",
        )
        for what, value, limit, unit in reached
        if limit is not None and value > (1.0 + MARGIN) * limit
    ]
    first, last = moving_range(record.displacement)
    rest = 1.0 - (last - first + 1) / record.time.size
    if rest > RESTS:
        found.append(
            Finding(
                check="rest",
                where=f"before {record.time[first]:.4g} s and after {record.time[last]:.4g} s",
                size=rest,
                unit="-",
                follows="this share of the record says nothing of the damper but how its force settles",
            )
        )
    return found
