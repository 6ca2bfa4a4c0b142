"""Plain Bingham dampers from everywhere, and their force by an integration that shares nothing with `pzd.damper`."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pzd.blind.independent.damper_space import PEAK_FORCE, levels_of, log_between, with_ends
from pzd.compiled import compiled
from pzd.record import Array


def bingham_levels(u: Sequence[float], growth: Sequence[float], levels: int, speed: float, stroke: float) -> Array:
    """Return T0 [N], C [N s/m] and k [N/m] (levels, 3) of a damper, its limits included: an infinite k is a rigid one.

    Parameters
    ----------
    u : (6,) a point of the unit cube: peak force, friction in it, how rigid, by friction or damping, gain, and whether
        friction or damping says what is rigid
    growth : (2,) change of C and k up to the highest level
    levels : of the control signal
    speed : largest of the tests [m/s]
    stroke : least of the tests, from end to end [m]
    """
    peak, share = log_between(u[0], *PEAK_FORCE), with_ends(u[1])
    return levels_of(share, peak, u[2:], growth, levels, speed, stroke)


_SHARE = 1.0 - math.sqrt(0.5)
"""Diagonal of the method below; with it the method damps whatever is stiff."""
_PARTS = 4
"""Of a step: with them any damper is within 1e-4 of the force but for the sample of a reversal."""
_STILL = 1e-15
"""Travel of the rod in a step that is rounding [m]."""


def plain_force(time: Array, x: Array, T0: float, C: float, compliance: float) -> Array:
    """Integrate the damper without any law, down to the rigid one (1/k = 0), to friction alone and to C alone.

    Equation: F/k = x - y, C dy/dt = F - T0 sign(F) beyond T0, both implicit, so that C may be 0; where 1/k is 0,
    F = T0 sign(dx/dt) + C dx/dt
    Method: diagonally implicit Runge-Kutta of two stages            Source: Alexander 1977, SIAM J. Numer. Anal. 14

    Parameters
    ----------
    time : (2 n + 1,) evenly spaced [s]; two intervals make one step
    x : (2 n + 1,) extension [m]
    T0, C : [N], [N s/m]
    compliance : 1/k [m/N]

    Returns
    -------
    (n + 1,) force [N], from none at the beginning
    """
    force = np.zeros(time.size // 2 + 1)
    _plain_march(x, float(time[2] - time[0]), T0, C, compliance, force)
    return force


@compiled
def _plain_march(x: Array, h: float, T0: float, C: float, compliance: float, force: Array) -> None:
    """Compute the force at every second instant; the rod follows a parabola through three of them."""
    y, last, step = x[0], 0.0, h / _PARTS
    part = _SHARE * step
    for j in range(1, force.size):
        before, bend, rise = x[2 * j - 2], 2.0 * (x[2 * j - 2] - 2.0 * x[2 * j - 1] + x[2 * j]), x[2 * j] - x[2 * j - 2]
        if compliance == 0.0:
            speed = (rise + bend) / h
            still = abs(speed) * h <= _STILL
            last = min(max(last, -T0), T0) if still else math.copysign(T0, speed) + C * speed
        for i in range(_PARTS if compliance > 0.0 else 0):
            inner, outer = (i + _SHARE) / _PARTS, (i + 1.0) / _PARTS
            _, w = _plain_stage(before + inner * (rise - bend + inner * bend) - y, part, T0, C, compliance)
            y += (step - part) * w
            last, w = _plain_stage(before + outer * (rise - bend + outer * bend) - y, part, T0, C, compliance)
            y += part * w
        force[j] = last


@compiled
def _plain_stage(reach: float, part: float, T0: float, C: float, compliance: float) -> tuple[float, float]:
    """Return force [N] and flow speed [m/s] of F/k + t w(F) = reach, over a time t [s]."""
    if abs(reach) <= compliance * T0:
        return reach / compliance, 0.0
    force = (C * reach + math.copysign(part * T0, reach)) / (C * compliance + part)
    return force, (reach - compliance * force) / part
