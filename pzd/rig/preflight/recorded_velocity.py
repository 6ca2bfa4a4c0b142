"""Whether a recorded velocity is the rate of the recorded displacement."""

from __future__ import annotations

from pzd.artefacts import Finding
from pzd.rig.preflight import Measured
from pzd.signals.measures import rms

GAIN = 0.03
"""Deviation of the ratio of both speeds from one that is said."""
SHAPE = 0.1
"""R.m.s. of the rest, as a share of the speed, that is said."""


def check(test: Measured) -> list[Finding]:
    """Another scale, another sign or another shape than the displacement's rate."""
    recorded, derived = test.record.velocity, test.clean.velocity
    if recorded is derived:
        return []
    gain = float(recorded @ derived / (derived @ derived))
    rest = rms(recorded - gain * derived) / rms(derived)
    if abs(gain - 1.0) > GAIN:
        return [
            Finding(
                check="velocity",
                where="the whole record, velocity over the rate of displacement",
                size=gain,
                unit="-",
                follows="another unit, sign or filter than the displacement's; leave the column out to have it derived",
            )
        ]
    if rest > SHAPE:
        return [
            Finding(
                check="velocity",
                where="the whole record, what the rate of displacement leaves of the velocity",
                size=rest,
                unit="-",
                follows="noise, a delay or a filter in the velocity; leave the column out to have it derived",
            )
        ]
    return []
