"""Whether there are enough cycles to tell noise from the damper."""

from __future__ import annotations

from pzd.artefacts import Finding
from pzd.rig.preflight import Measured
from pzd.signals.measures import reversals

ENOUGH = 3.0
"""Cycles from which their scatter says something about the noise."""


def check(test: Measured) -> list[Finding]:
    """Fewer than three cycles, counted by reversals larger than 10 % of the stroke."""
    count = 0.5 * len(reversals(test.record.displacement))
    if count >= ENOUGH:
        return []
    return [
        Finding(
            check="cycles",
            where="the whole record",
            size=count,
            unit="cycles",
            follows=f"fewer than {ENOUGH:g}: noise and repeatability cannot be told from the damper; record 10 or more",
        )
    ]
