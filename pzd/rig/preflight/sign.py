"""Whether the damper takes work out of every cycle."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.record import Array
from pzd.rig.files.refusals import reversals, work_done
from pzd.rig.measured import Measured

LEAST = 0.05
"""Work that is said, as a share of stroke times range of the force.

A damper that sticks draws a line without area, and what little its noise encloses is fed in as
often as taken out; over many cycles that adds up with the root of their number.
"""


def check(test: Measured) -> list[Finding]:
    """Cycles with negative work, and a record whose steady force outweighs its loops."""
    record = test.record
    least = LEAST * float(np.ptp(record.displacement) * np.subtract(*np.percentile(record.force, (99, 1))))
    if work_done(record.displacement, record.force) < -least * np.sqrt(1.0 + 0.5 * reversals(record.displacement)):
        return [
            Finding(
                check="sign",
                where="the whole record",
                size=work_done(record.displacement, record.force),
                unit="J",
                follows="a steady force over the net displacement outweighs the loops: take the tare out",
            )
        ]
    if test.run is None:
        return []
    number = test.run.number(record.time)
    works = np.array(
        [_area(record.displacement[number == k], record.force[number == k]) for k in range(test.run.count)]
    )
    negative = np.flatnonzero(works < -least)
    if negative.size == 0:
        return []
    first = test.run.start + float(negative[0]) * test.run.period
    return [
        Finding(
            check="sign",
            where=f"{negative.size} of {test.run.count} cycles, the first at {first:.4g} s",
            size=float(works.min()),
            unit="J",
            follows="the damper does work on the rig there: check the cell, or leave these cycles out",
        )
    ]


def _area(displacement: Array, force: Array) -> float:
    """Work over one cycle [J], its last sample joined to its first.

    Left open, a small stroke's noise keeps the ends apart, and the force there would seem to do work.
    """
    step = np.roll(displacement, -1) - displacement
    return float(np.sum(0.5 * (force + np.roll(force, -1)) * step))
