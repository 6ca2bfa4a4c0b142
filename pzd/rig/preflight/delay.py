"""Whether force and displacement were recorded at the same instants."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.record import is_constant, voltage_scale
from pzd.rig.preflight import Measured
from pzd.rig.reference_fit import VISIBLE, fit_reference, fitted

LEAST_DELAY = 1e-3
"""Smallest delay that is said [s]; what is less is within the nuisances of a diagnosis."""
EXPLAINS = 0.25
"""The delay has to leave less than this share of the squares that the element without it leaves."""
LONGEST = 0.03
"""Largest delay looked for [s], or a twentieth of the cycle where that is less."""
TRIES = 31


def check(test: Measured) -> list[Finding]:
    """A delay of the force against the displacement that a plain Bingham element asks for."""
    if not is_constant(test.record, voltage_scale([test.record])):
        return []
    part, undelayed = fit_reference(test)
    longest = min(LONGEST, test.run.period / 20.0) if test.run else LONGEST
    delays = np.linspace(-longest, longest, TRIES)
    best = fitted(part, part.force_later(delays))
    delay = float(delays[best.force])
    found = abs(delay) >= max(LEAST_DELAY, 0.5 * part.step) and best.force not in (0, TRIES - 1)
    if not found or undelayed.left < VISIBLE or best.left > EXPLAINS * undelayed.left:
        return []
    return [
        Finding(
            check="delay",
            where=f"the force is {'late' if delay > 0.0 else 'early'} against the displacement, the whole record",
            size=delay,
            unit="s",
            follows=f"it takes {1.0 - best.left / undelayed.left:.0%} of what a Bingham element leaves; not corrected",
        )
    ]
