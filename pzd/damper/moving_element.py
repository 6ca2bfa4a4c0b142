"""One step of an element whose flow curve is straight, while T0, C and k move, where it stays in one regime.

Equation: ds/dt = u + side T0/C - (k/C) s,  F = k s      Source: Makowski and Knap 2021, eq. (1)-(3), y eliminated

With the time tau, d tau = (k/C) dt, this is ds/dtau = g - s, where g = (u C + side T0)/k is the extension of the spring
at which the oil would flow as fast as the rod. Over a step g is nearly a polynomial in tau, and with a polynomial the
integral is a sum of the functions phi_k of an exponential integrator, however stiff the oil is.
"""

from __future__ import annotations

import math

from pzd.compiled import compiled, inlined
from pzd.damper.element import Element, relaxation, slip
from pzd.damper.exponential import phi
from pzd.damper.flow import breakaway, damping, straight
from pzd.damper.kernels import K, Row, effects_alike, stroke_straight
from pzd.damper.pieces import TimeStep
from pzd.damper.regimes import RELIEF, SMOOTH, STICK, deflection_on, regime_of, spring_force

NODES = (1.0 / 3.0, 2.0 / 3.0)
"""Shares of a step between its ends at which g and k/C are taken, for a cubic through four values."""
UNSOLVED = (math.nan, math.nan)


@compiled
def whole_step(e: float, step: TimeStep, tolerance: float) -> tuple[float, float]:
    """Elastic deflection [m] and flow speed [m/s] after a step that sticks or slips all the time.

    Parameters
    ----------
    e : elastic deflection at its start [m]
    step : between rows of which `goes_straight` is true
    tolerance : admissible error, as a share of the force

    Returns
    -------
    both; NaN where the step has to be cut: the regime changes, the rod turns round, or g is no such polynomial
    """
    if step.u0 * step.u1 < 0.0:
        return UNSOLVED
    p, q = step.p0, step.p1
    force = spring_force(e, p)
    regime, side = regime_of(force, p)
    if regime == STICK:
        end = e + 0.5 * (step.u0 + step.u1) * step.h
        return (end, 0.0) if regime_of(spring_force(end, q), q)[0] == STICK else UNSOLVED
    if regime == RELIEF:
        return UNSOLVED
    first = Element(side * breakaway(p, side), damping(p, side), p[K])
    if step.moving:
        last = Element(side * breakaway(q, side), damping(q, side), q[K])
        spring, error = _slipped(force / p[K], first, last, step)
        if error > tolerance * abs(force / p[K]):
            return UNSOLVED
    else:
        last = first
        spring = slip(force, first.T0, step.u0, step.u1, relaxation(step.h, first.C, first.k)) / first.k
    end = deflection_on(side * last.k * spring, q, side)
    if side * spring <= 0.0 or regime_of(last.k * spring, q)[0] != SMOOTH:
        return UNSOLVED
    return end, (last.k * spring - last.T0) * side / last.C


@compiled
def goes_straight(p: Row, q: Row) -> bool:
    """Whether the flow curve has straight branches alone, and nothing but T0, C and k goes from row to row."""
    return effects_alike(p, q) and stroke_straight(p) and straight(p)


@inlined
def _slipped(e: float, first: Element, last: Element, step: TimeStep) -> tuple[float, float]:
    """Extension of the oil spring [m] after slipping through a step, and its error: what the third order adds.

    Parameters
    ----------
    e : at its start [m]
    first, last : with the side that the oil flows to as the sign of T0
    step : its length and speeds
    """
    start, rate = _flowing(first, step.u0)
    second, rate_b = _between(first, last, step, NODES[0])
    third, rate_c = _between(first, last, step, NODES[1])
    end, rate_d = _flowing(last, step.u1)
    span = step.h * (rate + 3.0 * (rate_b + rate_c) + rate_d) / 8.0
    b = step.h * (9.0 * rate + 19.0 * rate_b - 5.0 * rate_c + rate_d) / 72.0 / span
    c = step.h * (rate + 4.0 * rate_b + rate_c) / 9.0 / span
    by_b = (second - start) / b
    bend = (end - start - by_b) / (1.0 - b)
    twist = (bend - ((third - start) / c - by_b) / (c - b)) / (1.0 - c)
    over = phi(-span)
    slipped = e + span * ((start - e) * over.one + (by_b - bend * b) * over.two + 2.0 * bend * over.three)
    added = span * twist * (b * over.two - 2.0 * (1.0 + b) * over.three + 6.0 * over.four)
    return slipped + added, abs(added)


@inlined
def _flowing(at: Element, u: float) -> tuple[float, float]:
    """The extension [m] at which the oil flows as fast as the rod, u [m/s], and k/C [1/s]."""
    return (u * at.C + at.T0) / at.k, at.k / at.C


@inlined
def _between(first: Element, last: Element, step: TimeStep, share: float) -> tuple[float, float]:
    """The same at a share of a step."""
    at = Element(
        first.T0 + (last.T0 - first.T0) * share,
        first.C + (last.C - first.C) * share,
        first.k + (last.k - first.k) * share,
    )
    return _flowing(at, step.u0 + (step.u1 - step.u0) * share)
