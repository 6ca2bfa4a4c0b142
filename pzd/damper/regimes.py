"""Regimes of the damper (no flow, smooth flow, relief valve open) and the integration of a piece of path inside one.

The state is the elastic deflection e = x - y (paper, eq. 1): a stiffness that varies with the voltage then changes the
force and nothing else. F = k s(e), s the extension of the oil stiffness behind the stroke effects.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pzd.compiled import compiled, inlined
from pzd.damper import flow
from pzd.damper.compiled import kernels
from pzd.damper.compiled.kernels import K, Row
from pzd.damper.element import Element, relaxation, slip

# --- An exponential Rosenbrock method of order 5, with an error estimate of order 4 ---
#
# Equation: y(t + h) = y + h phi_1(Z) r + h^2 phi_2(Z) v + h (2 a phi_3(Z) + 6 b phi_4(Z))
# Source: Luan and Ostermann 2014, J. Comput. Appl. Math. 255, 417-431, method exprb53s3
#
# Z = h J, J and v the derivatives of the rate r by y and by time. The rest of the rate, r + J (y - y0) + v t taken off,
# is approximated by a theta^2 + b theta^3 over the step, a and b from two stages; the end found adds a theta^4. This is
# exact where the rest is such a polynomial, however stiff J is.

STAGES = (0.5, 0.9)
"""Share of the step at which the two stages stand; 0.9 follows from 0.5 by the conditions of order 5."""
COUPLING = (27.0 / 25.0, 729.0 / 125.0)
"""Weights of the first stage in the second one, for phi_3 at either stage's share of Z."""
_SMALL_Z = 1.0  # below it the series is used: the recursion loses digits like |z|^-4
_CAUTION = 2.0  # the stages, of lower order than the whole, have about the same error again
_LEAST_ERROR = 1e-3  # share of the error of order 3 that the error of order 4 has at a tolerance of 1e-9
_SERIES_TERMS = 15  # the last one is below 1e-16 of the sum


class Phi(NamedTuple):
    """phi_k(z) = integral of e^{(1 - s) z} s^{k - 1} / (k - 1)! over s from 0 to 1."""

    one: float
    two: float
    three: float
    four: float
    five: float


@compiled
def phi(z: float) -> Phi:
    """Compute the functions phi_1 to phi_5 of an exponential integrator.

    Equation: phi_{k + 1}(z) = (phi_k(z) - 1/k!)/z, phi_1(z) = (e^z - 1)/z
    Source: Hochbruck and Ostermann 2010, Acta Numerica 19, eq. (2.10)-(2.11)
    """
    if abs(z) < _SMALL_Z:
        five, term = 0.0, 1.0 / 120.0
        for j in range(_SERIES_TERMS):
            five += term
            term *= z / (j + 6.0)
        four = z * five + 1.0 / 24.0
        three = z * four + 1.0 / 6.0
        two = z * three + 0.5
        return Phi(z * two + 1.0, two, three, four, five)
    one = math.expm1(z) / z
    two = (one - 1.0) / z
    three = (two - 0.5) / z
    four = (three - 1.0 / 6.0) / z
    return Phi(one, two, three, four, (four - 1.0 / 24.0) / z)


@inlined
def bend(first: float, second: float) -> tuple[float, float]:
    """Fit a theta^2 + b theta^3 through the rest of the rate at the two stages, and return a and b."""
    c, d = STAGES
    b = (second / (d * d) - first / (c * c)) / (d - c)
    return first / (c * c) - b * c, b


@inlined
def end_corrected(a: float, b: float, end: float, over: Phi) -> tuple[float, float]:
    """Compute the theta^4 correction from the rest at the end of a step, and an error estimate; shares of its length.

    The estimate is the error of the stage 1/2 and the end without the other stage, plus the correction. It is no less
    than a small share of the error of the stage 1/2 alone, since the end may lie on the curve by chance.
    """
    c, d = STAGES
    fourth = (end - a - b) / ((1.0 - c) * (1.0 - d))
    added = fourth * (2.0 * c * d * over.three - 6.0 * (c + d) * over.four + 24.0 * over.five)
    without = fourth * (2.0 * c * over.three - 6.0 * (1.0 + c) * over.four + 24.0 * over.five)
    alone = b * (6.0 * over.four - 2.0 * c * over.three)
    return added, max(_CAUTION * abs(without) + abs(added), _LEAST_ERROR * abs(alone))


# --- Regimes ---

STICK, SMOOTH, RELIEF = 0, 1, 2
"""The regimes: no flow; flow along the smooth curve; relief valve open."""


_GAUSS = (
    (0.18343464249564980, 0.36268378337836198),
    (0.52553240991632899, 0.31370664587788729),
    (0.79666647741362674, 0.22238103445337447),
    (0.96028985649753623, 0.10122853629037626),
)
"""Points and weights of Gauss and Legendre's rule of eight points on (-1, 1), those above 0."""
_PANELS = 32
"""Parts of the deflection that each have them: in a joint with play the extension bends sharply."""


@compiled
def spring_extension(e: float, p: Row) -> float:
    """Compute the extension s of the oil stiffness [m] at an elastic deflection [m]; 0 inside a free play."""
    side = 1.0 if e >= 0.0 else -1.0
    extension = kernels.stroke_law(e, side, p)
    return extension if side * extension > 0.0 else 0.0


@compiled
def spring_force(e: float, p: Row) -> float:
    """Compute F = k s [N] at an elastic deflection [m]; eq. (1) behind the stroke effects."""
    return p[K] * spring_extension(e, p)


@compiled
def spring_energy(e: float, p: Row, k: float) -> float:
    """Compute the energy [J] stored in a stiffness k [N/m] at an elastic deflection [m], behind the stroke effects.

    Equation: k integral s de; k s^2 / 2 where s rises like e
    """
    extension = spring_extension(e, p)
    if extension == 0.0 or kernels.stroke_straight(p):
        return 0.5 * k * extension * extension
    side = 1.0 if e >= 0.0 else -1.0
    start = kernels.stroke_inverse(0.0, side, p)
    half, area = 0.5 * (e - start) / _PANELS, 0.0
    for i in range(_PANELS):
        middle = start + (2.0 * i + 1.0) * half
        for point, weight in _GAUSS:
            low, high = middle - half * point, middle + half * point
            area += weight * (kernels.stroke_law(high, side, p) + kernels.stroke_law(low, side, p))
    return k * half * area


@compiled
def deflection_at(force: float, p: Row) -> float:
    """Compute the elastic deflection [m] at which F = `force` [N], the nearest to zero."""
    return 0.0 if force == 0.0 else kernels.stroke_inverse(force / p[K], math.copysign(1.0, force), p)


@compiled
def deflection_on(force: float, p: Row, side: float) -> float:
    """Compute the elastic deflection [m] at which |F| = `force` [N] on one side."""
    return kernels.stroke_inverse(side * force / p[K], side, p)


@compiled
def regime_of(force: float, p: Row) -> tuple[int, float]:
    """Return the regime and the side (sign of F) of a force [N]."""
    side = 1.0 if force >= 0.0 else -1.0
    if abs(force) <= flow.breakaway(p, side):
        return STICK, side
    return (RELIEF if abs(force) > flow.relief(p, side) else SMOOTH), side


@compiled
def over_yield(e: float, p: Row, side: float) -> float:
    """Compute |F| minus breakaway on one side [N]; inside a free play |F| counts as negative."""
    return p[K] * (side * kernels.stroke_law(e, side, p)) - flow.breakaway(p, side)


@compiled
def beyond(e: float, p: Row, regime: int, side: float) -> tuple[float, int]:
    """Compute the distance of the state beyond its regime, as a force [N], and the edge: -1 low, 1 high.

    Negative inside; `side` is ignored in STICK.
    """
    if regime == STICK:
        return over_yield(e, p, math.copysign(1.0, e)), 1
    below = -over_yield(e, p, side)
    above = flow.breakaway(p, side) - below - flow.relief(p, side)
    if regime == RELIEF:
        return -above, -1
    return (below, -1) if below > above else (above, 1)


@compiled
def onto_edge(e: float, p: Row, regime: int, side: float, way: int) -> tuple[float, int, float]:
    """Return the deflection on the edge that is crossed, and the regime and side beyond it."""
    if regime == STICK:
        side = math.copysign(1.0, e)
    low, high = flow.breakaway(p, side), flow.relief(p, side)
    edge = high if (regime == RELIEF or (regime == SMOOTH and way > 0)) else low
    onto = deflection_on(edge, p, side)
    if way > 0:
        return onto, (SMOOTH if regime == STICK and high > low else RELIEF), side
    if regime == RELIEF and high > low:
        return onto, SMOOTH, side
    if low <= 0.0 and side * deflection_on(0.0, p, side) <= 0.0:  # no free play to stick in
        return 0.0, (SMOOTH if flow.relief(p, -side) > 0.0 else RELIEF), -side
    return onto, STICK, side


@compiled
def speed_at(force: float, p: Row, regime: int, side: float, guess: float) -> float:
    """Compute the flow speed [m/s] at |F| = force by the law of a regime, also beyond its edge."""
    if regime == STICK:
        return 0.0
    if regime == RELIEF:
        edge = flow.relief(p, side)
        return flow.smooth_speed(edge, p, side, guess) + (force - edge) / flow.relief_slope(p, side)
    return flow.smooth_speed(force, p, side, guess)


# --- One piece of the path inside one regime ---
#
# Straight pieces with constant parameters are solved in closed form. The others are integrated by the method above,
# which takes the slope of the flow curve exactly however fast the force settles (large k/C, slow test): in the elastic
# deflection e where the flow curve is inverted in closed form, else in the viscous force s = visc(w), in which w(s) and
# F(s) are both explicit and dF/ds >= 1, so that nothing is inverted. Where the fluid thins and the yield is rounded, e
# again: dF/ds has a cusp at s = 0, falling from T0/(C w_s) to 1, and a slope taken there hides the rest of a piece.

_DIFFERENCE = 1e-3  # of a step, for the drift of the flow curve with moving parameters
_SECOND_DIFFERENCE = 0.03  # of a step, for the change of that drift: a shorter one would show rounding
_NUDGE = 1e-7  # of the integrated variable, for the derivative of its rate: about half the digits of a double


class TimeStep(NamedTuple):
    """One step: length h [s], extension speed from u0 to u1 [m/s], parameter rows from p0 to p1."""

    h: float
    u0: float
    u1: float
    p0: Row
    p1: Row
    moving: bool
    """Whether the two rows differ."""


@inlined
def row_in(step: TimeStep, at: float) -> Row:
    """Interpolate the parameter row at a moment [s] of the step."""
    return kernels.interpolate(step.p0, step.p1, at / step.h) if step.moving else step.p0


@inlined
def about(step: TimeStep, at: float, span: float) -> tuple[float, float]:
    """Return two moments [s] a span to either side; inside the step where k would be extrapolated below zero."""
    before, after = at - span, at + span
    p, q = row_in(step, before), row_in(step, after)
    if p[K] > 0.0 and q[K] > 0.0:
        return before, after
    return max(before, 0.0), min(after, step.h)


@inlined
def extension_speed(step: TimeStep, at: float) -> float:
    """Interpolate dx/dt [m/s] at a moment [s] of the step."""
    return step.u0 + (step.u1 - step.u0) * at / step.h


@compiled
def piece(
    e: float, w: float, at: float, dt: float, regime: int, side: float, step: TimeStep
) -> tuple[float, float, float]:
    """Compute elastic deflection and flow speed after a piece of length dt, and its error estimate as a force [N]."""
    if regime == STICK:
        return e + dt * extension_speed(step, at + 0.5 * dt), 0.0, 0.0
    p = row_in(step, at)
    if not step.moving and kernels.stroke_straight(p) and (regime == RELIEF or flow.straight(p)):
        force = abs(spring_force(e, p))
        slope = flow.relief_slope(p, side) if regime == RELIEF else flow.viscous_force(1.0, p, side)
        pull, pull_after = side * extension_speed(step, at), side * extension_speed(step, at + dt)
        end = slip(force, force - slope * w, pull, pull_after, relaxation(dt, slope, p[K]))
        return deflection_on(end, p, side), w + (end - force) / slope, 0.0
    if flow.speed_explicit(p) or not (kernels.viscous_straight(p) or kernels.yield_sharp(p)):
        end, error = _exponential(e, w, at, dt, regime, side, step, True)
        p = row_in(step, at + dt)
        force = side * p[K] * kernels.stroke_law(end, side, p)
        other = side * p[K] * kernels.stroke_law(end + error, side, p)
        return end, speed_at(force, p, regime, side, w), abs(other - force)
    y = abs(spring_force(e, p)) if regime == RELIEF else flow.viscous_force(w, p, side)
    y, error = _exponential(y, w, at, dt, regime, side, step, False)
    p = row_in(step, at + dt)
    if regime == RELIEF:
        return deflection_on(y, p, side), speed_at(y, p, regime, side, w), abs(error)
    if y < 0.0:
        return deflection_on(flow.breakaway(p, side) + y, p, side), 0.0, abs(error)
    w = flow.viscous_speed(y, p, side)
    error *= flow.smooth_rise(w, p, side)
    return deflection_on(flow.smooth_force_of(y, p, side), p, side), w, abs(error)


@compiled
def _exponential(
    y: float, w: float, at: float, dt: float, regime: int, side: float, step: TimeStep, explicit: bool
) -> tuple[float, float]:
    """Compute the integrated variable after dt, and its error estimate, by the exponential Rosenbrock method."""
    rate = _rate(y, w, at, regime, side, step, explicit)
    by_y, by_time = _slopes(y, rate, w, at, dt, regime, side, step, explicit)
    z, c, d = by_y * dt, STAGES[0], STAGES[1]
    over, half, late = phi(z), phi(c * z), phi(d * z)
    way, drift = rate * dt, by_time * dt * dt
    first = y + c * way * half.one + c * c * drift * half.two
    rest = _rate(first, w, at + c * dt, regime, side, step, explicit) - rate
    rest -= by_y * (first - y) + by_time * c * dt
    second = y + d * way * late.one + d * d * drift * late.two
    second += dt * rest * (COUPLING[0] * half.three + COUPLING[1] * late.three)
    later = _rate(second, w, at + d * dt, regime, side, step, explicit) - rate
    later -= by_y * (second - y) + by_time * d * dt
    a, b = bend(rest, later)
    end = y + way * over.one + drift * over.two + dt * (2.0 * a * over.three + 6.0 * b * over.four)
    last = _rate(end, w, at + dt, regime, side, step, explicit) - rate - by_y * (end - y) - by_time * dt
    added, error = end_corrected(a, b, last, over)
    return end + dt * added, dt * error


@compiled
def _slopes(
    y: float, rate: float, w: float, at: float, dt: float, regime: int, side: float, step: TimeStep, explicit: bool
) -> tuple[float, float]:
    """Compute the derivatives of the rate of the integrated variable by itself and by time."""
    p = row_in(step, at)
    if explicit:
        force = side * p[K] * kernels.stroke_law(y, side, p)
        rise = flow.relief_slope(p, side) if regime == RELIEF else flow.smooth_slope(w, force, p, side)
        by_y = -p[K] * kernels.stroke_slope(y, side, p) / rise
    else:
        nudge = _NUDGE * max(y, p[K] * 1e-9)
        by_y = (_rate(y + nudge, w, at, regime, side, step, explicit) - rate) / nudge
    if not step.moving:
        if explicit:
            return by_y, (step.u1 - step.u0) / step.h
        return by_y, (_rate(y, w, at + dt, regime, side, step, explicit) - rate) / dt  # linear in time
    before, after = about(step, at, _SECOND_DIFFERENCE * step.h)
    ahead = _rate(y, w, after, regime, side, step, explicit)
    return by_y, (ahead - _rate(y, w, before, regime, side, step, explicit)) / (after - before)


@compiled
def _rate(y: float, guess: float, at: float, regime: int, side: float, step: TimeStep, explicit: bool) -> float:
    """Compute the rate of the integrated variable.

    Equation: de/dt = u(t) - side w(|F|)      Source: eq. (1), the flow curve inverted
    """
    if not explicit:
        return _rate_of_force(y, at, regime, side, step)
    p = row_in(step, at)
    force = side * p[K] * kernels.stroke_law(y, side, p)
    return extension_speed(step, at) - side * speed_at(force, p, regime, side, guess)


@compiled
def _rate_of_force(y: float, at: float, regime: int, side: float, step: TimeStep) -> float:
    """Compute the rate of s in SMOOTH, of |F| in RELIEF.

    Equation: d|F|/dt = k s'(e) (side u - w) + (dk/dt)/k |F| + k ds/dt at e; in SMOOTH minus the
    rate of the flow curve at constant s
    """
    p = row_in(step, at)
    pull = side * extension_speed(step, at)
    softening = (step.p1[K] - step.p0[K]) / (step.h * p[K]) if step.moving else 0.0
    bent = not kernels.stroke_straight(p) or (step.moving and kernels.stroke_moves(step.p0, step.p1))
    if regime == RELIEF:
        rate = p[K] * (pull - speed_at(y, p, regime, side, 0.0))
        return (_behind_stroke(rate, y, at, p, side, step) if bent else rate) + softening * y
    s = max(y, 0.0)
    w = flow.viscous_speed(s, p, side)
    rate = p[K] * (pull - w)
    if bent:
        rate = _behind_stroke(rate, flow.smooth_force_of(s, p, side), at, p, side, step)
    if step.moving:
        before, after = about(step, at, _DIFFERENCE * step.h)
        ahead = flow.smooth_force_of(s, row_in(step, after), side)
        behind = flow.smooth_force_of(s, row_in(step, before), side)
        rate += softening * flow.smooth_force_of(s, p, side) - (ahead - behind) / (after - before)
    return rate / flow.smooth_rise(w, p, side)


@compiled
def _behind_stroke(rate: float, force: float, at: float, p: Row, side: float, step: TimeStep) -> float:
    """Compute the rate of |F| [N/s] behind the stroke effects from its rate without them.

    Equation: d|F|/dt = s'(e) rate + k ds/dt at constant e
    """
    e = deflection_on(force, p, side)
    rate *= kernels.stroke_slope(e, side, p)
    if step.moving:
        before, after = about(step, at, _DIFFERENCE * step.h)
        ahead = kernels.stroke_law(e, side, row_in(step, after))
        behind = kernels.stroke_law(e, side, row_in(step, before))
        rate += p[K] * side * (ahead - behind) / (after - before)
    return rate


# --- A whole step in one regime, with a straight flow curve and T0, C and k that vary ---
#
# Equation: ds/dt = u + side T0/C - (k/C) s,  F = k s      Source: Makowski and Knap 2021, eq. (1)-(3), y eliminated
#
# With the time tau, d tau = (k/C) dt, this is ds/dtau = g - s, where g = (u C + side T0)/k is the extension of the oil
# stiffness at which the flow is as fast as the rod. Over a step g is nearly a polynomial in tau, and with a polynomial
# the integral is a sum of the functions phi_k of an exponential integrator, however large k/C is.

NODES = (1.0 / 3.0, 2.0 / 3.0)
"""Shares of a step at which g and k/C are evaluated besides its ends, for a cubic through four values."""


UNSOLVED = (math.nan, math.nan)
"""Result of a step that has to be solved piece by piece."""


@compiled
def whole_step(e: float, step: TimeStep, tolerance: float) -> tuple[float, float]:
    """Compute elastic deflection [m] and flow speed [m/s] after a step that sticks or slips throughout.

    Parameters
    ----------
    e : elastic deflection at its start [m]
    step : between rows for which `is_straight` is true
    tolerance : admissible error, as a share of the force

    Returns
    -------
    both; NaN where the regime changes, the rod reverses, or g is not close enough to a polynomial
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
    first = Element(side * flow.breakaway(p, side), flow.damping(p, side), p[K])
    if step.moving:
        last = Element(side * flow.breakaway(q, side), flow.damping(q, side), q[K])
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
def is_straight(p: Row, q: Row) -> bool:
    """Return whether the flow curve has straight branches alone, and T0, C and k alone differ between two rows."""
    return kernels.effects_alike(p, q) and kernels.stroke_straight(p) and flow.straight(p)


@inlined
def _slipped(e: float, first: Element, last: Element, step: TimeStep) -> tuple[float, float]:
    """Compute the extension s [m] after slip over one step, and its error: the contribution of the third order.

    Parameters
    ----------
    e : at its start [m]
    first, last : elements at start and end, with the direction of flow as the sign of T0
    step : the step
    """
    start, rate = _g_and_rate(first, step.u0)
    second, rate_b = _between(first, last, step, NODES[0])
    third, rate_c = _between(first, last, step, NODES[1])
    end, rate_d = _g_and_rate(last, step.u1)
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
def _g_and_rate(at: Element, u: float) -> tuple[float, float]:
    """Compute g, the extension [m] at which the flow is as fast as the rod, u [m/s], and k/C [1/s]."""
    return (u * at.C + at.T0) / at.k, at.k / at.C


@inlined
def _between(first: Element, last: Element, step: TimeStep, share: float) -> tuple[float, float]:
    """Compute g and k/C at a share of a step."""
    at = Element(
        first.T0 + (last.T0 - first.T0) * share,
        first.C + (last.C - first.C) * share,
        first.k + (last.k - first.k) * share,
    )
    return _g_and_rate(at, step.u0 + (step.u1 - step.u0) * share)
