"""Whether single samples jump away and back."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.record import deviation_from_median, glitches
from pzd.rig.preflight import Measured
from pzd.schema.errors import counted

EDGE = 3
"""Samples at either end of force and displacement that have too few neighbours to tell a spike from a kink."""


def check(test: Measured) -> list[Finding]:
    """Samples of a channel that jump away from their neighbours and back."""
    found: list[Finding] = []
    for channel in test.channels():
        away = deviation_from_median(channel.values)
        deviation, rows = np.abs(away), glitches(channel.values, away)
        if channel.least is None:
            rows = rows[(rows >= EDGE) & (rows < deviation.size - EDGE)]
        else:
            rows = rows[deviation[rows] > channel.least]
        if rows.size:
            worst = int(rows[np.argmax(deviation[rows])])
            what = "in the displacement a spike spoils the speed nearby as well"
            if channel.least is not None:
                what = "the record's label is the median, which it does not move"
            found.append(
                Finding(
                    check="spikes",
                    where=f"{channel.name}, {counted(rows.size, 'sample')}, "
                    f"the largest at {test.record.time[worst]:.6g} s",
                    size=float(away[worst]),
                    unit=channel.unit,
                    follows=f"not corrected; {what}",
                )
            )
    return found
