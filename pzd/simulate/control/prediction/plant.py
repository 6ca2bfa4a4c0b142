"""The half-car on its identified dampers in fixed steps: how a ride goes on under voltages that are given ahead.

The same equations as `pzd.simulate.ride.equations`, for a controller that tries many voltages: body and wheels by velocity
Verlet, the oil by its exponential, both of order two and stable however quickly the oil relaxes; no energies are
booked, and dry friction beside the element is rounded where the speed crosses zero.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pzd.compiled import compiled, inlined
from pzd.damper.compiled.kernels import C, K, branch_steady, parallel_force, row_of
from pzd.damper.flow import breakaway, flow_force
from pzd.damper.regimes import spring_force
from pzd.record import Array, Rows
from pzd.simulate.ride.equations import body_acceleration
from pzd.simulate.ride.model import Vehicle
from pzd.simulate.vehicle.suspension import contact_force

# ----------------------------------------------------------------------------------------------------
# What `comfort_predictive` knows and remembers during a ride, as numbers that the compiled loop reads.


BODY_AND_OIL = 8
"""z, phi, dz, dphi, and of one damper at each axle the elastic deflection of the oil, then the speed of its flow."""
MODES = 4
"""Pairs of poles of the weighting Wk."""
WEIGHTED, LOAD_1, LOAD_2 = range(BODY_AND_OIL + 2 * MODES, BODY_AND_OIL + 2 * MODES + 3)
WHEELS = LOAD_2 + 1
PLANT = WHEELS + 4
"""State of the plant: the above, real and imaginary part of every mode of the weighting, and what they come to:
weighted acceleration [m/s2] and dynamic load of each wheel [N]; height [m] of the wheels of both axles, then its rate
[m/s], which stay 0 where they have no mass."""
OBSERVED, HELD, TAIL = range(3)
"""Steps for which `Predictor.modes` is laid out: between two observations, while a voltage is held, behind it."""
ACCELERATION, OBSERVATIONS, MEAN_LOAD_1, MEAN_LOAD_2 = range(2 * MODES, 2 * MODES + 4)
MEMORY = 2 * MODES + 4
"""What is remembered: the modes of the weighting, the acceleration that was felt last, how often it was, and recent
mean squares of the load of each wheel."""
ORDER = 8
"""Past speeds of the road from which the next is forecast: four sines, or what a random road remembers."""


class Predictor(NamedTuple):
    """Settings, memory and room to work in of one ride; all arrays are empty for other policies."""

    observation_s: float
    """Time between two observations: the control period [s]."""
    every: int
    """Observations between two choices."""
    hold_steps: int
    tail_steps: int
    load_weight: float
    """Weight of the wheel loads."""
    forgotten: float
    """Share of a mean square that stays from one observation to the next."""
    margin: float
    """Share of its cost by which a choice must beat that of a voltage held on, on a road that cannot be forecast."""
    courses: int
    """Courses that the road may take: one that is known, or the forecast with its misses added and subtracted."""
    known: bool
    """Whether the road ahead is known."""
    settled: float
    """Time after which the valve has followed a voltage [s]."""
    lowest: float
    """Effective voltage of the first level [V]."""
    spacing: float
    """Between two levels [V]."""
    candidates: Array
    """(c,) voltages that may be held [V]."""
    tails: Array
    """(t,) voltages that may follow [V]."""
    straight: bool
    """Whether no effect of the stroke acts, so that F = k e."""
    steps: Array
    """(3,) steps of the plant [s], by what they are for, as in all that follows."""
    theta: Array
    """(3, l) share of the flow at the end in a step, at each level."""
    edges: Array
    """(l, 2) force [N] at which the flow begins, in compression and in rebound."""
    reach: Array
    """(3, l, 2) width of the table of flows above it [N]."""
    flows: Array
    """(3, l, 2, n + 1) speed of the flow [m/s], see `pzd.simulate.control.prediction.plant.tabulate_flow`."""
    rows: Array
    """(l, r) parameter rows of the element at each level of the effective voltage."""
    parallel: Array
    """(l, b) rows of the parallel effects."""
    residues: Array
    """(MODES, 2) of the weighting, real and imaginary part."""
    modes: Array
    """(3, MODES, 6) decay and the weights of the acceleration at both ends of a step, real and imaginary part."""
    felt: Array
    """(MEMORY,) see above."""
    chosen: Rows
    """(4,) indices of the candidates of both axles, and of their tails."""
    past: Array
    """(m,) height of the road under axle 1 at the last observations, the newest at `OBSERVATIONS` modulo m [m]."""
    moments: Array
    """(ORDER, ORDER + 1) recent mean products of the road's speeds, and of them with the next one [m2/s2]."""
    fixed: Array
    """(f, PLANT) where the ride would be, had each of f voltages been held from its start."""
    fixed_levels: Rows
    """(f, 3) its level, for one step."""
    fixed_means: Array
    """(f, 3) recent mean squares of weighted acceleration and loads in that ride."""
    met: Array
    """(2, 2) height under both axles at the last observation and now [m]."""
    tracked: Array
    """(2, 4) under each axle: height [m] and rise [m/s] of the last sample, when it was, how long it is held [s]."""
    speeds: Array
    """(ORDER + 5,) last mean speeds of the road, the newest first [m/s]; height at the last choice [m], speed
    forecast for the period that goes on [m/s], recent squares of what such forecasts missed, and of the speeds; the
    fastest of late [m/s]."""
    forecasts: Array
    """(n, n) speeds that each of the last n choices forecast for the n periods behind it, in turn [m/s]."""
    skill: Array
    """(2, n) recent mean products of what was forecast so many periods ahead with what came, and with itself."""
    surprises: Array
    """(q,) what the forecasts of one period missed of the rise between two observations, in turn [m]."""
    noise: Array
    """(q + 1,) what they missed, as one course of the road ahead; the other has it with the other sign [m]."""
    load_weights: Array
    """(2,) of the squared load of each wheel in this choice [1/kg2]."""
    rooms: Array
    """(ORDER + 2, ORDER + 1) to work in."""
    hold_levels: Rows
    """(2, c, 2 hold_steps + 1) level of the effective voltage at every half step."""
    tail_levels: Rows
    """(2, c t, 2 tail_steps + 1)"""
    hold_heights: Array
    """(s, 2, hold_steps + 1) heights of the road under both axles in every course that it may take [m]."""
    tail_heights: Array
    """(s, 2, tail_steps + 1)"""
    ahead: Array
    """(n,) forecast heights under axle 1, one a choice [m]."""
    states: Array
    """(s + 2, PLANT) now, at the end, and behind what is held in every course."""
    kept: Array
    """(2, 2, d) voltages behind each drive effect now and behind what is held, an axle each [V]."""


# ----------------------------------------------------------------------------------------------------


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

    An oil much faster than the step is quasi-static in it: theta -> 1 and e -> 0, so w' -> v and |F| is the flow curve
    at the speed of the rod, or what holds a rod that sticks; the error is of order one in C / k.

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

    Equation: J = integral a_w^2 + lambda (L_1^2 + L_2^2) dt, a_w = Wk a_K, L_i = S_i + T_i; where the wheels have mass
    L_i = N_i0 - N_i, see `pzd.simulate.vehicle.suspension`

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
    g1, g2 = _wheel(car, state[WHEELS], heights[0, 0]), _wheel(car, state[WHEELS + 1], heights[1, 0])
    dg1, dg2 = state[WHEELS + 2], state[WHEELS + 3]
    h, modes = plan.steps[kind], plan.modes[kind]
    rise1, rise2 = (heights[0, 1] - heights[0, 0]) / h, (heights[1, 1] - heights[1, 0]) / h
    u1 = z + car.arms[0] * phi - g1
    u2 = z + car.arms[1] * phi - g2
    load1 = _load(car, plan, 0, levels1[0], u1, dz + car.arms[0] * dphi - _wheel(car, dg1, rise1), e1)
    load2 = _load(car, plan, 1, levels2[0], u2, dz + car.arms[1] * dphi - _wheel(car, dg2, rise2), e2)
    held1 = _dynamic_load(car, 0, load1, heights[0, 0] - g1, rise1 - dg1)
    held2 = _dynamic_load(car, 1, load2, heights[1, 0] - g2, rise2 - dg2)
    az, aphi = body_acceleration(car, load1, load2)
    ag1, ag2 = _wheel_acceleration(car, 0, load1 - held1), _wheel_acceleration(car, 1, load2 - held2)
    felt = car.comfort[0] * load1 + car.comfort[1] * load2
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
        e1, w1 = oil_after(plan, kind, levels1[2 * n + 1], e1, car.ratio[0] * v1, w1, h)
        e2, w2 = oil_after(plan, kind, levels2[2 * n + 1], e2, car.ratio[1] * v2, w2, h)
        load1 = _load(car, plan, 0, levels1[2 * n + 2], u1, v1, e1)
        load2 = _load(car, plan, 1, levels2[2 * n + 2], u2, v2, e2)
        closer1, closer2 = heights[0, n + 1] - heights[0, n] - g1 + was1, heights[1, n + 1] - heights[1, n] - g2 + was2
        held1 = _dynamic_load(car, 0, load1, heights[0, n + 1] - g1, closer1 / h)
        held2 = _dynamic_load(car, 1, load2, heights[1, n + 1] - g2, closer2 / h)
        lift, turn, rise1, rise2 = az, aphi, ag1, ag2
        az, aphi = body_acceleration(car, load1, load2)
        ag1, ag2 = _wheel_acceleration(car, 0, load1 - held1), _wheel_acceleration(car, 1, load2 - held2)
        dz, dphi = dz + 0.5 * h * (lift + az), dphi + 0.5 * h * (turn + aphi)
        dg1, dg2 = dg1 + 0.5 * h * (rise1 + ag1), dg2 + 0.5 * h * (rise2 + ag2)
        was = felt
        felt = car.comfort[0] * load1 + car.comfort[1] * load2
        weighted = weigh(state, BODY_AND_OIL, was, felt, modes, plan.residues)
        cost += h * (weighted * weighted + plan.load_weights[0] * held1 * held1 + plan.load_weights[1] * held2 * held2)
        if cost > most:
            return math.inf
    state[0], state[1], state[2], state[3], state[4], state[5], state[6], state[7] = z, phi, dz, dphi, e1, e2, w1, w2
    state[WEIGHTED], state[LOAD_1], state[LOAD_2] = weighted, held1, held2
    if car.wheels:
        state[WHEELS], state[WHEELS + 1], state[WHEELS + 2], state[WHEELS + 3] = g1, g2, dg1, dg2
    return cost


@inlined
def _load(car: Vehicle, plan: Predictor, axle: int, level: int, u: float, v: float, e: float) -> float:
    """Force S + T of an axle [N] at a deflection [m], its rate [m/s] and the elastic deflection of the oil [m]."""
    ratio = car.ratio[axle]
    n = car.dampers[axle] * ratio
    load = car.stiffness[axle] * u + n * spring(plan, level, e)
    if plan.parallel.shape[1] > 0:
        load += n * parallel_load(ratio * u, ratio * v, plan.parallel[level])
    return load


@inlined
def _wheel(car: Vehicle, own: float, road: float) -> float:
    """Of a wheel: its own height [m] or its rate [m/s] where it has mass, else that of the road."""
    return own if car.wheels else road


@inlined
def _dynamic_load(car: Vehicle, axle: int, load: float, squeeze: float, rate: float) -> float:
    """What an axle takes off the road's static load [N], by S + T [N] and how the tyre is squeezed [m], [m/s]."""
    if not car.wheels:
        return load
    return -contact_force(car.static_load[axle], car.tyre_stiffness[axle], car.tyre_damping[axle], squeeze, rate)


@inlined
def _wheel_acceleration(car: Vehicle, axle: int, force: float) -> float:
    """Acceleration of the wheels of an axle [m/s2] under what suspension and road leave [N]; 0 without mass."""
    return force / car.unsprung[axle] if car.wheels else 0.0


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
