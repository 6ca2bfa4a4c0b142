"""The lower mount slips in its seat: it holds until the force exceeds its friction, then slides until it is caught.

Equation: at rest while |F - k_f u| <= F_s, then c_f du/dt = F - k_f u - F_k sign(F - k_f u) until |F - k_f u| <= F_k
Source: Coulomb friction with a higher friction at rest; Armstrong-Helouvry et al. 1994, Automatica 30
"""

from __future__ import annotations

import math

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "frame_stick_slip"
DESCRIBED_BY: tuple[str, ...] = ()
SETTLES = 1e-3
"""Time in which a sliding mount comes to rest [s]."""


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a mount that slides by about that share of a twentieth of the stroke at the peak force."""
    holds = float(draw.uniform(0.4, 0.7)) * scale.force
    stiffness = scale.force / (strength * 0.2 * scale.stroke)
    return {"mount_stiffness": stiffness, "mount_holds": holds, "mount_slides": float(draw.uniform(0.4, 0.8)) * holds}


def slips(load: float, slipping: bool, mount_holds: float, mount_slides: float) -> bool:
    """Whether the mount slides on under the load that its seat's spring leaves to friction [N]."""
    return abs(load) > (mount_slides if slipping else mount_holds)


def slip_rate(load: float, mount_stiffness: float, mount_slides: float) -> float:
    """Speed of the sliding mount [m/s]; it comes to rest within a millisecond or two."""
    over = max(abs(load) - mount_slides, 0.0)
    return math.copysign(over / (mount_stiffness * SETTLES), load)
