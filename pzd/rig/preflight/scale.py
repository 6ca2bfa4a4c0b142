"""Whether the numbers are of the size that a damper's are: a unit read wrongly is off by 1000."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.rig.preflight import Measured

LEAST_STROKE = 2e-4
"""A smaller stroke [m] is more likely a wrong unit than a test."""
FORCES = (2.0, 5e5)
"""Peak forces [N] outside this range are more likely a wrong unit."""
SPEEDS = (5e-4, 5.0)
"""Peak speeds [m/s] outside this range are more likely a wrong unit of time."""


def check(test: Measured) -> list[Finding]:
    """Strokes, forces and speeds that look like a unit read wrongly."""
    sizes = (
        ("stroke", float(np.ptp(test.record.displacement)), (LEAST_STROKE, np.inf), "m"),
        ("peak force", float(np.abs(test.record.force).max()), FORCES, "N"),
        ("peak speed", float(np.abs(test.clean.velocity).max()), SPEEDS, "m/s"),
    )
    return [
        Finding(
            check="scale",
            where=f"{what} of the whole record",
            size=size,
            unit=unit,
            follows=f"{low:g} to {high:g} {unit} is usual: check the units (mm or m, N or kN, s or ms)",
        )
        for what, size, (low, high), unit in sizes
        if not low <= size <= high
    ]
