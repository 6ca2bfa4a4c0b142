"""Whether the displacement is clean enough to be differentiated."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.rig.preflight import Measured

SHARE = 0.005
"""R.m.s. of the noise, as a share of the stroke, that is said."""


def check(test: Measured) -> list[Finding]:
    """Noise of the displacement beyond half a percent of the stroke."""
    noise = float(np.std(test.record.displacement - test.clean.displacement))
    share = noise / float(np.ptp(test.record.displacement))
    if share <= SHARE:
        return []
    return [
        Finding(
            check="resolution",
            where=f"displacement, {share:.2%} of the stroke",
            size=noise,
            unit="m",
            follows="r.m.s. of what does not repeat or is too quick for the motion; stiffness and inertia suffer first",
        )
    ]
