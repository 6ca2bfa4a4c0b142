"""The half-car on its identified dampers in fixed steps: how a ride goes on under voltages that are given ahead.

The same equations as `pzd.simulate.ride.equations`, for a controller that tries many voltages: body and wheels by
velocity Verlet, the oil by its exponential, both of order two and stable however quickly the oil relaxes; no energies
are integrated, and dry friction beside the element is rounded where the speed crosses zero.
"""

from __future__ import annotations

import math

from pzd.compiled import compiled, inlined
from pzd.damper.compiled.kernels import K, branch_steady, parallel_force, row_of
from pzd.damper.regimes import spring_force
from pzd.record import Array
from pzd.simulate.control.prediction.predictor import MODES, DamperLevels, Plant, Predictor
from pzd.simulate.ride.equations import body_acceleration
from pzd.simulate.ride.model import Vehicle
from pzd.simulate.vehicle.suspension import contact_force

_ROUNDED = 5e-3
"""Speed over which dry friction beside the element turns round [m/s]: the plant has no events."""


@inlined
def oil_after(
    damper: DamperLevels, kind: int, level: int, e: float, speed: float, flow: float, h: float
) -> tuple[float, float]:
    """Return the elastic deflection of the oil [m] and the speed of the flow [m/s] after a step of constant rod speed.

    Equation: e' = e + h (v - theta w' - (1 - theta) w), |F(e')| = flow curve (w'), theta = (3 + z) / (6 + z),
    z = h k / C      Source: Liniger and Willoughby 1970, SIAM J. Numer. Anal. 7(1): fitted to exp(-z), L-stable

    An oil much faster than the step is quasi-static in it: theta -> 1 and e -> 0, so w' -> v and |F| is the flow curve
    at the speed of the rod, or what holds a rod that sticks; the error is of order one in C / k.

    Parameters
    ----------
    damper : the damper by levels
    kind : of the step, see `Step`
    level : of the effective voltage in the middle of the step
    e : at the start [m]
    speed : of the rod [m/s]
    flow : at the start [m/s]
    h : length of the step [s]
    """
    theta = damper.theta[kind, level]
    end = e + h * (speed - (1.0 - theta) * flow)
    force = oil_force(damper, level, end)
    side = 1 if force >= 0.0 else 0
    following = flow_at(damper, kind, level, side, abs(force))
    if side == 0:
        following = -following
    return end - h * theta * following, following


@inlined
def flow_at(damper: DamperLevels, kind: int, level: int, side: int, force: float) -> float:
    """Look up the speed of the flow [m/s] at the end of a step that would end at a force [N] if nothing flowed."""
    over = force - damper.edges[level, side]
    if over <= 0.0:
        return 0.0
    table, last = damper.flows[kind, level, side], damper.flows.shape[3] - 2
    place = (last + 1) * math.sqrt(over / damper.widths[kind, level, side])
    cell = min(int(place), last)
    low, high = cell * cell, (cell + 1) * (cell + 1)
    share = ((last + 1) * (last + 1) * over / damper.widths[kind, level, side] - low) / (high - low)
    return float(table[cell] + share * (table[cell + 1] - table[cell]))


@inlined
def oil_force(damper: DamperLevels, level: int, e: float) -> float:
    """Return the force of the oil stiffness [N] at an elastic deflection [m]."""
    return damper.rows[level, K] * e if damper.straight else spring_force(e, row_of(damper.rows[level]))


@inlined
def parallel_load(x: float, v: float, row: Array) -> float:
    """Return the force beside the element [N] at an extension [m] and a speed [m/s], without what is there at rest.

    A branch that remembers is taken as the friction of its steady slip.
    """
    rest = parallel_force(0.0, 0.0, 0.0, row)
    elastic = parallel_force(x, 0.0, 0.0, row) - rest
    rubbing = parallel_force(0.0, v, 0.0, row) - rest + branch_steady(math.copysign(1.0, v), row)
    return float(elastic + rubbing * min(abs(v) / _ROUNDED, 1.0))


@compiled
def predicted(
    car: Vehicle, plan: Predictor, state: Array, levels1: Array, levels2: Array, heights: Array, kind: int, most: float
) -> float:
    """Integrate the plant through as many steps as the road has, and sum the cost of the ride.

    Equation: J = integral a_w^2 + lambda (L_1^2 + L_2^2) dt, a_w = Wk a_K, L_i = S_i + T_i; where the wheels have mass
    L_i = N_i0 - N_i, see `pzd.simulate.vehicle.suspension`

    Parameters
    ----------
    car : the half-car
    plan : see `Predictor`
    state : (PLANT,) changed in place
    levels1, levels2 : (2 n + 1,) level of the effective voltage of each axle at every half step
    heights : (2, n + 1) of the road under both axles [m]
    kind : of the step, see `Step`
    most : cost beyond which the integration stops [m2/s3]

    Returns
    -------
    cost [m2/s3]; infinite where it goes beyond `most`
    """
    z, phi, dz, dphi, e1, e2, w1, w2 = state[0], state[1], state[2], state[3], state[4], state[5], state[6], state[7]
    wheels = state[Plant.WHEELS :]
    g1, g2 = _wheel(car, wheels[0], heights[0, 0]), _wheel(car, wheels[1], heights[1, 0])
    dg1, dg2 = wheels[2], wheels[3]
    h, modes, weights = plan.steps[kind], plan.modes[kind], plan.workspace.load_weights
    rise1, rise2 = (heights[0, 1] - heights[0, 0]) / h, (heights[1, 1] - heights[1, 0]) / h
    u1 = z + car.arms[0] * phi - g1
    u2 = z + car.arms[1] * phi - g2
    load1 = _load(car, plan.damper, 0, levels1[0], u1, dz + car.arms[0] * dphi - _wheel(car, dg1, rise1), e1)
    load2 = _load(car, plan.damper, 1, levels2[0], u2, dz + car.arms[1] * dphi - _wheel(car, dg2, rise2), e2)
    tyre1 = _dynamic_load(car, 0, load1, heights[0, 0] - g1, rise1 - dg1)
    tyre2 = _dynamic_load(car, 1, load2, heights[1, 0] - g2, rise2 - dg2)
    az, aphi = body_acceleration(car, load1, load2)
    ag1, ag2 = _wheel_acceleration(car, 0, load1 - tyre1), _wheel_acceleration(car, 1, load2 - tyre2)
    a_K = car.comfort[0] * load1 + car.comfort[1] * load2
    weighted = cost = 0.0
    for n in range(heights.shape[1] - 1):
        z += h * (dz + 0.5 * h * az)
        phi += h * (dphi + 0.5 * h * aphi)
        before1, before2, was1, was2 = u1, u2, g1, g2
        g1 = _wheel(car, g1 + h * (dg1 + 0.5 * h * ag1), heights[0, n + 1])
        g2 = _wheel(car, g2 + h * (dg2 + 0.5 * h * ag2), heights[1, n + 1])
        u1 = z + car.arms[0] * phi - g1
        u2 = z + car.arms[1] * phi - g2
        v1, v2 = (u1 - before1) / h, (u2 - before2) / h
        e1, w1 = oil_after(plan.damper, kind, levels1[2 * n + 1], e1, car.ratio[0] * v1, w1, h)
        e2, w2 = oil_after(plan.damper, kind, levels2[2 * n + 1], e2, car.ratio[1] * v2, w2, h)
        load1 = _load(car, plan.damper, 0, levels1[2 * n + 2], u1, v1, e1)
        load2 = _load(car, plan.damper, 1, levels2[2 * n + 2], u2, v2, e2)
        closer1, closer2 = heights[0, n + 1] - heights[0, n] - g1 + was1, heights[1, n + 1] - heights[1, n] - g2 + was2
        tyre1 = _dynamic_load(car, 0, load1, heights[0, n + 1] - g1, closer1 / h)
        tyre2 = _dynamic_load(car, 1, load2, heights[1, n + 1] - g2, closer2 / h)
        lift, turn, rise1, rise2 = az, aphi, ag1, ag2
        az, aphi = body_acceleration(car, load1, load2)
        ag1, ag2 = _wheel_acceleration(car, 0, load1 - tyre1), _wheel_acceleration(car, 1, load2 - tyre2)
        dz, dphi = dz + 0.5 * h * (lift + az), dphi + 0.5 * h * (turn + aphi)
        dg1, dg2 = dg1 + 0.5 * h * (rise1 + ag1), dg2 + 0.5 * h * (rise2 + ag2)
        before = a_K
        a_K = car.comfort[0] * load1 + car.comfort[1] * load2
        weighted = weigh(state, Plant.WEIGHTING, before, a_K, modes, plan.residues)
        cost += h * (weighted * weighted + weights[0] * tyre1 * tyre1 + weights[1] * tyre2 * tyre2)
        if cost > most:
            return math.inf
    state[0], state[1], state[2], state[3], state[4], state[5], state[6], state[7] = z, phi, dz, dphi, e1, e2, w1, w2
    state[Plant.WEIGHTED], state[Plant.LOAD_1], state[Plant.LOAD_2] = weighted, tyre1, tyre2
    if car.wheels:
        wheels[0], wheels[1], wheels[2], wheels[3] = g1, g2, dg1, dg2
    return cost


@inlined
def _load(car: Vehicle, damper: DamperLevels, axle: int, level: int, u: float, v: float, e: float) -> float:
    """Return the force S + T of an axle [N] at a deflection [m], its rate [m/s] and an elastic deflection [m]."""
    ratio = car.ratio[axle]
    n = car.dampers[axle] * ratio
    load = car.stiffness[axle] * u + n * oil_force(damper, level, e)
    if damper.parallel.shape[1] > 0:
        load += n * parallel_load(ratio * u, ratio * v, damper.parallel[level])
    return load


@inlined
def _wheel(car: Vehicle, own: float, road: float) -> float:
    """Return the height [m] of a wheel or its rate [m/s]: its own where it has mass, else that of the road."""
    return own if car.wheels else road


@inlined
def _dynamic_load(car: Vehicle, axle: int, load: float, squeeze: float, rate: float) -> float:
    """Return what an axle takes off the static load [N], by S + T [N] and how the tyre is squeezed [m], [m/s]."""
    if not car.wheels:
        return load
    return -contact_force(car.static_load[axle], car.tyre_stiffness[axle], car.tyre_damping[axle], squeeze, rate)


@inlined
def _wheel_acceleration(car: Vehicle, axle: int, force: float) -> float:
    """Return the acceleration of the wheels of an axle [m/s2] under a net force [N]; 0 without mass."""
    return force / car.unsprung[axle] if car.wheels else 0.0


@inlined
def weigh(state: Array, first: int, before: float, now: float, modes: Array, residues: Array) -> float:
    """Return the weighted acceleration [m/s2] after a step in which the acceleration goes linearly between two values.

    Equation: dx_j/dt = p_j x_j + a, a_w = 2 Re sum r_j x_j      Source: `pzd.comfort.weighting.modes`, exact

    Parameters
    ----------
    state : (first + 2 MODES,) real and imaginary parts from `first` on, changed in place
    first : place of the first of them
    before, now : acceleration at both ends [m/s2]
    modes : (MODES, 6) for the length of the step
    residues : (MODES, 2)
    """
    weighted = 0.0
    for j in range(MODES):
        re, im = state[first + 2 * j], state[first + 2 * j + 1]
        following = modes[j, 0] * re - modes[j, 1] * im + modes[j, 2] * before + modes[j, 4] * now
        im = modes[j, 0] * im + modes[j, 1] * re + modes[j, 3] * before + modes[j, 5] * now
        state[first + 2 * j], state[first + 2 * j + 1] = following, im
        weighted += residues[j, 0] * following - residues[j, 1] * im
    return 2.0 * weighted
