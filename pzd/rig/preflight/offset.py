"""Whether the force stands off zero: a tare, a preload, gas pressure."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.rig.preflight import Measured
from pzd.rig.reference_fit import fit_reference, unit_force

SHARE = 0.04
"""Offset that is said, as a share of half the force's range."""
SLIPS = 0.02
"""Least share of the samples at which the element must slip, either way.

Friction that sticks keeps any force within T0 from before the record, which is no offset.
"""


def check(test: Measured) -> list[Finding]:
    """The force that is left at mid-stroke beside a Bingham element, a spring and inertia.

    Equation: F = F_0 + k f(T0/k, C/k) + c_1 x + c_2 a               Source: least squares on a coarse element
    """
    part, element = fit_reference(test)
    force = part.force_later(np.zeros(1))[0]
    unit = unit_force(part, element.friction_extension, element.lag)
    slips = min(np.mean(sign * unit > element.friction_extension) for sign in (1.0, -1.0))
    if slips < SLIPS or not element.explains():
        return []
    x = part.displacement - 0.5 * float(part.displacement.max() + part.displacement.min())
    bend = np.gradient(np.gradient(x))
    columns = (np.ones(x.size), unit, x, bend)
    design = np.stack([column / (np.abs(column).max() or 1.0) for column in columns], axis=1)
    offset = float(np.linalg.lstsq(design, force, rcond=None)[0][0])
    low, high = np.percentile(test.record.force, (1, 99))
    share = offset / (0.5 * float(high - low) or 1.0)
    if abs(share) <= SHARE:
        return []
    return [
        Finding(
            check="offset",
            where=f"force, {share:+.1%} of half its range",
            size=offset,
            unit="N",
            follows="a tare (fixture: {tare_N: ...} takes it out), a preload, or rebound unlike compression",
        )
    ]
