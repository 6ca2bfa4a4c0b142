"""The half-car on its identified dampers in fixed steps: how a ride goes on under voltages that are given ahead.

The same equations as `pzd.simulate.equations`, for a controller that tries many voltages: the body by velocity
Verlet, the oil by its exponential, both of order two and stable however quickly the oil relaxes; no energies are
booked, and dry friction beside the element is rounded where the speed crosses zero.
"""

from __future__ import annotations

import math

from pzd.compiled import compiled, inlined
from pzd.damper.flow import breakaway, flow_force
from pzd.damper.kernels import C, K, branch_steady, parallel_force, row_of
from pzd.damper.regimes import spring_force
from pzd.record import Array
from pzd.simulate.prediction.predictor import BODY_AND_OIL, LOAD_1, LOAD_2, MODES, WEIGHTED, Predictor
from pzd.simulate.ride_model import Vehicle

_ROUNDED = 5e-3
"""Speed over which dry friction beside the element turns round [m/s]: the plant has no events."""
FASTEST = 3.0
"""Speed of the flow up to which it is tabulated [m/s]; beyond, the table goes on straight."""


@inlined
def oil_after(
    plan: Predictor, kind: int, level: int, e: float, speed: float, flow: float, h: float
) -> tuple[float, float]:
    """Elastic deflection of the oil [m] and speed of the flow [m/s] after a step at a constant speed of the rod.

    Equation: e' = e + h (v - theta w' - (1 - theta) w), |F(e')| = flow curve (w'), theta = (3 + z) / (6 + z),
    z = h k / C      Source: Liniger and Willoughby 1970, SIAM J. Numer. Anal. 7(1): fitted to exp(-z), L-stable

    Parameters
    ----------
    plan, kind : see `Predictor`
    level : of the effective voltage in the middle of the step
    e : at the start [m]
    speed : of the rod [m/s]
    flow : at the start [m/s]
    h : length of the step [s]
    """
    theta = plan.theta[kind, level]
    end = e + h * (speed - (1.0 - theta) * flow)
    force = spring(plan, level, end)
    side = 1 if force >= 0.0 else 0
    following = flow_at(plan, kind, level, side, abs(force))
    if side == 0:
        following = -following
    return end - h * theta * following, following


@inlined
def flow_at(plan: Predictor, kind: int, level: int, side: int, force: float) -> float:
    """Speed of the flow [m/s] at the end of a step that would end at a force [N] if nothing flowed; from a table."""
    over = force - plan.edges[level, side]
    if over <= 0.0:
        return 0.0
    table, last = plan.flows[kind, level, side], plan.flows.shape[3] - 2
    place = (last + 1) * math.sqrt(over / plan.reach[kind, level, side])
    cell = min(int(place), last)
    low, high = cell * cell, (cell + 1) * (cell + 1)
    share = ((last + 1) * (last + 1) * over / plan.reach[kind, level, side] - low) / (high - low)
    return float(table[cell] + share * (table[cell + 1] - table[cell]))


@inlined
def spring(plan: Predictor, level: int, e: float) -> float:
    """Force of the oil spring [N] at an elastic deflection [m]."""
    return plan.rows[level, K] * e if plan.straight else spring_force(e, row_of(plan.rows[level]))


@inlined
def parallel_load(x: float, v: float, row: Array) -> float:
    """Force beside the element [N] at an extension [m] and a speed [m/s], without what is there at rest.

    A branch that remembers is taken as the friction of its steady slip.
    """
    rest = parallel_force(0.0, 0.0, 0.0, row)
    elastic = parallel_force(x, 0.0, 0.0, row) - rest
    rubbing = parallel_force(0.0, v, 0.0, row) - rest + branch_steady(math.copysign(1.0, v), row)
    return float(elastic + rubbing * min(abs(v) / _ROUNDED, 1.0))


@compiled
def predicted(
    car: Vehicle,
    plan: Predictor,
    state: Array,
    levels1: Array,
    levels2: Array,
    heights: Array,
    kind: int,
    most: float,
) -> float:
    """Bring the state through as many steps as the road has, and sum what the ride costs.

    Equation: J = integral a_w^2 + lambda (L_1^2 + L_2^2) dt, a_w = Wk a_K, L_i = S_i + T_i

    Parameters
    ----------
    car : the half-car
    plan : see `Predictor`
    state : (PLANT,) changed in place
    levels1, levels2 : (2 n + 1,) level of the effective voltage of each axle at every half step
    heights : (2, n + 1) of the road under both axles [m]
    kind : of the step, `OBSERVED`, `HELD` or `TAIL`
    most : the cost beyond which nobody asks for more

    Returns
    -------
    cost [m2/s3]; infinite where it goes beyond `most`
    """
    z, phi, dz, dphi, e1, e2, w1, w2 = state[0], state[1], state[2], state[3], state[4], state[5], state[6], state[7]
    h, modes = plan.steps[kind], plan.modes[kind]
    r1, r2 = car.ratio[0], car.ratio[1]
    n1, n2 = car.dampers[0] * r1, car.dampers[1] * r2
    alone = plan.parallel.shape[1] == 0
    u1 = z + car.arms[0] * phi - heights[0, 0]
    u2 = z + car.arms[1] * phi - heights[1, 0]
    load1 = car.stiffness[0] * u1 + n1 * spring(plan, levels1[0], e1)
    load2 = car.stiffness[1] * u2 + n2 * spring(plan, levels2[0], e2)
    if not alone:
        v1 = dz + car.arms[0] * dphi - (heights[0, 1] - heights[0, 0]) / h
        v2 = dz + car.arms[1] * dphi - (heights[1, 1] - heights[1, 0]) / h
        load1 += n1 * parallel_load(r1 * u1, r1 * v1, plan.parallel[levels1[0]])
        load2 += n2 * parallel_load(r2 * u2, r2 * v2, plan.parallel[levels2[0]])
    az = -(load1 + load2) / car.mass
    aphi = -(car.arms[0] * load1 + car.arms[1] * load2) / car.inertia
    felt = car.comfort[0] * load1 + car.comfort[1] * load2
    weight1, weight2 = plan.load_weights[0], plan.load_weights[1]
    weighted = cost = 0.0
    for n in range(heights.shape[1] - 1):
        z += h * (dz + 0.5 * h * az)
        phi += h * (dphi + 0.5 * h * aphi)
        before1, before2 = u1, u2
        u1 = z + car.arms[0] * phi - heights[0, n + 1]
        u2 = z + car.arms[1] * phi - heights[1, n + 1]
        v1, v2 = (u1 - before1) / h, (u2 - before2) / h
        e1, w1 = oil_after(plan, kind, levels1[2 * n + 1], e1, r1 * v1, w1, h)
        e2, w2 = oil_after(plan, kind, levels2[2 * n + 1], e2, r2 * v2, w2, h)
        load1 = car.stiffness[0] * u1 + n1 * spring(plan, levels1[2 * n + 2], e1)
        load2 = car.stiffness[1] * u2 + n2 * spring(plan, levels2[2 * n + 2], e2)
        if not alone:
            load1 += n1 * parallel_load(r1 * u1, r1 * v1, plan.parallel[levels1[2 * n + 2]])
            load2 += n2 * parallel_load(r2 * u2, r2 * v2, plan.parallel[levels2[2 * n + 2]])
        lift, turn = az, aphi
        az = -(load1 + load2) / car.mass
        aphi = -(car.arms[0] * load1 + car.arms[1] * load2) / car.inertia
        dz += 0.5 * h * (lift + az)
        dphi += 0.5 * h * (turn + aphi)
        was = felt
        felt = car.comfort[0] * load1 + car.comfort[1] * load2
        weighted = weigh(state, BODY_AND_OIL, was, felt, modes, plan.residues)
        cost += h * (weighted * weighted + weight1 * load1 * load1 + weight2 * load2 * load2)
        if cost > most:
            return math.inf
    state[0], state[1], state[2], state[3], state[4], state[5], state[6], state[7] = z, phi, dz, dphi, e1, e2, w1, w2
    state[WEIGHTED], state[LOAD_1], state[LOAD_2] = weighted, load1, load2
    return cost


@inlined
def weigh(state: Array, first: int, before: float, now: float, modes: Array, residues: Array) -> float:
    """Weighted acceleration [m/s2] after a step in which the acceleration goes linearly from `before` to `now`.

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


@compiled
def fill_curves(rows: Array, forces: Array) -> None:
    """Fill the (l, 2, m + 1) flow curve [N] of (l, r) parameter rows, a side each, at (j / m)^2 of 3 m/s."""
    last = forces.shape[2] - 1
    for level in range(rows.shape[0]):
        for n in range(2):
            for j in range(last + 1):
                forces[level, n, j] = flow_force(FASTEST * (j / last) ** 2, row_of(rows[level]), 2.0 * n - 1.0)


@compiled
def tabulate_flow(rows: Array, h: float, curves: Array, theta: Array, edges: Array, reach: Array, flows: Array) -> None:
    """Fill the speed of the flow over the force that a step would end at if nothing flowed in it.

    Equation: F = flow curve (w) + k h theta w, inverted; at (j / n)^2 of what w = 3 m/s needs above breakaway

    Parameters
    ----------
    rows : (l, r) parameters of the element at each level of the effective voltage
    h : step [s]
    curves : (l, 2, m + 1) of `fill_curves`
    theta : (l,) filled
    edges, reach : (l, 2) force at which the flow begins, and width of the table above it, a side each [N]; filled
    flows : (l, 2, n + 1) filled [m/s]
    """
    last, fine = flows.shape[2] - 1, curves.shape[2] - 1
    for level in range(rows.shape[0]):
        row = row_of(rows[level])
        z = h * row[K] / row[C]
        theta[level] = (3.0 + z) / (6.0 + z)
        slope = row[K] * h * theta[level]
        for n in range(2):
            edge = breakaway(row, 2.0 * n - 1.0)
            edges[level, n], reach[level, n] = edge, curves[level, n, fine] + slope * FASTEST - edge
            i, before, after = 0, 0.0, 0.0
            for j in range(last + 1):
                over = reach[level, n] * (j / last) ** 2
                while after < over and i < fine:
                    i += 1
                    before, after = after, curves[level, n, i] - edge + slope * FASTEST * (i / fine) ** 2
                low, high = FASTEST * (max(i - 1, 0) / fine) ** 2, FASTEST * (i / fine) ** 2
                flows[level, n, j] = low + (high - low) * (over - before) / (after - before) if after > before else 0.0
