"""Turbulent flow through a sharp orifice: a force that grows with the square of the flow.

Law: + q w^2, w = |dy/dt|. Range: 1-50 % of the peak force of a hydraulic damper.
"""

from __future__ import annotations

import math

from pzd.damper.effect import Effect, Parameter, Search, growing

_SEARCH = Search(lambda s: s.force / s.speed**2, (0.05,))

EFFECT = Effect(
    name="orifice_quadratic",
    place="flow",
    law="+ q w^2",
    parameters=(Parameter("q", "N s2/m2", 0.0, 0.0, 1.0e8, "force over the square of the flow speed", _SEARCH),),
    source="orifice equation dp = rho Q^2 / (2 Cd^2 A^2); Merritt 1967, Hydraulic Control Systems",
    tests=(({"w": 0.3, "q": 1500.0}, 135.0),),
    hidden=growing("q", lambda s: s.force / s.speed**2),
)


def extra_force(w: float, q: float) -> float:
    """Force [N] added to friction and viscous force at a flow speed w >= 0 [m/s]."""
    return q * w * w


def extra_slope(w: float, q: float) -> float:
    """Compute the derivative of the law by w [N s/m]."""
    return 2.0 * q * w


def extra_speed(force: float, C: float, q: float) -> float:
    """Flow speed w [m/s] at which C w and the law together take a force >= 0 [N]."""
    return 2.0 * force / (C + math.sqrt(C * C + 4.0 * q * force))
