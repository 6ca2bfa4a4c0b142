"""Whether the damper takes work out of every cycle."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.rig.preflight import Measured
from pzd.signals.measures import chance_work, work


def check(test: Measured) -> list[Finding]:
    """Cycles with negative work, and a record whose steady force outweighs its loops."""
    record = test.record
    if work(record.displacement, record.force) < -chance_work(record.displacement, record.force):
        return [
            Finding(
                check="sign",
                where="the whole record",
                size=work(record.displacement, record.force),
                unit="J",
                follows="a steady force over the net displacement outweighs the loops: take the tare out",
            )
        ]
    if test.run is None:
        return []
    number = test.run.number(record.time)
    # Each cycle is closed: left open, a small stroke's noise keeps its ends apart, and the force would do work there.
    cycles = [number == k for k in range(test.run.count)]
    works = np.array([work(record.displacement[rows], record.force[rows], closed=True) for rows in cycles])
    negative = np.flatnonzero(works < -chance_work(record.displacement, record.force, cycles=1.0))
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
