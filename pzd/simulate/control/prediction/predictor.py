"""What `comfort_predictive` knows and remembers during a ride, as arrays that the compiled loop reads.

The settings of the policy, the damper by levels of the effective voltage, the weighting as modes, the memory of ride
and road, and arrays to work in; `predictor_of` builds them before the first observation.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from pzd.comfort.weighting import WK
from pzd.comfort.weighting import modes as modes_of
from pzd.compiled import compiled
from pzd.damper.compiled.columns import DRIVE, NEUTRAL, STROKE_AND_FLOW, acting
from pzd.damper.compiled.kernels import C, K, row_of
from pzd.damper.effect import ELEMENT
from pzd.damper.flow import breakaway, flow_force
from pzd.record import Array, Complex, Rows
from pzd.simulate.policies.comfort_predictive import ComfortPredictive
from pzd.simulate.ride.model import DynamicDamper
from pzd.simulate.vehicle.car import HalfCar

LEVELS = 129
"""Levels of the effective voltage: what is read at the nearest one is off by a 256th of its range at most."""
FLOWS = 128
"""Cells of the table of flows."""
CURVE = 400
"""Cells of the flow curve that it is read from."""
TOP_FLOW = 3.0
"""Speed of the flow up to which it is tabulated [m/s]; beyond, the table goes on straight."""
HOLD_STEP = 1e-3
"""Longest step of the plant while a voltage is held [s]: a valve of some milliseconds moves in it."""
TAIL_STEP = 2e-3
"""Longest step behind it [s]: a road of 80 Hz has six of them a wave."""
FIXED = 5
"""Fixed voltages that ride along, evenly spaced."""
MEMORY_S = 3.0
"""Time over which mean squares are taken [s]."""
FAINT = 1e-4
"""Mean square of an acceleration from which a ride begins [(m/s2)2]."""
SETTLED = 10.0
"""Time constants after which a valve has followed."""
ORDER = 8
"""Past speeds of the road from which the next is forecast: four sines, or what a random road remembers."""
MODES = 4
"""Pairs of poles of the weighting Wk."""

# --- Places in the state of the plant, and in the memory of ride and road ---


class Plant(IntEnum):
    """Places of the state of the plant (PLANT,), each the first of so many."""

    BODY = 0
    """z, phi [m], [rad] and their rates dz, dphi [m/s], [rad/s]."""
    ELASTIC = 4
    """Elastic deflection of the oil of one damper at each axle [m]."""
    FLOW = 6
    """Speed of the flow in one damper at each axle [m/s]."""
    WEIGHTING = 8
    """Real and imaginary part of every mode of the weighting."""
    WEIGHTED = WEIGHTING + 2 * MODES
    """Weighted acceleration at K [m/s2]."""
    LOAD_1 = WEIGHTED + 1
    """Dynamic load of the wheels of axle 1 [N]."""
    LOAD_2 = WEIGHTED + 2
    """The same at axle 2 [N]."""
    WHEELS = WEIGHTED + 3
    """Height [m] of the wheels of both axles, then its rate [m/s]; they stay 0 where they have no mass."""


PLANT = int(Plant.WHEELS) + 4


class Step(IntEnum):
    """Steps of the plant."""

    OBSERVED = 0
    """Between two observations."""
    HELD = 1
    """While a voltage is held."""
    TAIL = 2
    """Behind it."""


class States(IntEnum):
    """Rows of `Workspace.states`."""

    NOW = 0
    """The ride as it is."""
    END = 1
    """Behind held voltages and tails."""
    HOLDING = 2
    """Behind held voltages, from here on a row for each course of the road."""


class Memory(IntEnum):
    """Places of `Observed.measured`, behind the modes of the weighting."""

    ACCELERATION = 2 * MODES
    """That was measured last at K [m/s2]."""
    OBSERVATIONS = 2 * MODES + 1
    """How many there were."""
    MEAN_LOAD_1 = 2 * MODES + 2
    """Recent mean square of the load of the wheels of axle 1 [N2]."""
    MEAN_LOAD_2 = 2 * MODES + 3
    """The same at axle 2 [N2]."""


class Track(IntEnum):
    """Places of `Observed.tracked`: the last sample of the road under an axle."""

    HEIGHT = 0
    """[m]."""
    RISE = 1
    """[m/s]."""
    SAMPLED = 2
    """When it was taken [s]."""
    HELD_FOR = 3
    """How long it is held [s]."""


class Speed(IntEnum):
    """Places of `RoadForecast.speeds`, behind the past speeds of the road."""

    LAST_HEIGHT = ORDER
    """Of the road at the last choice [m]."""
    EXPECTED = ORDER + 1
    """Speed forecast for the period that goes on [m/s]."""
    MISSED_SQUARES = ORDER + 2
    """Recent squares of the errors of such forecasts [m2/s2]."""
    SPEED_SQUARES = ORDER + 3
    """Recent squares of the speeds [m2/s2]."""
    TOP_SPEED = ORDER + 4
    """The fastest of late [m/s]."""


# --- The predictor ---


class Settings(NamedTuple):
    """The policy's own settings, in observations and steps."""

    observation_s: float
    """Time between two observations: the control period [s]."""
    every: int
    """Observations between two choices."""
    hold_steps: int
    """Steps of the plant while a voltage is held."""
    load_weight: float
    """Weight of the wheel loads [-]."""
    remembered: float
    """Share of a mean square that stays from one observation to the next."""
    margin: float
    """Share of its cost by which a choice must beat that of a voltage held on, on a road that cannot be forecast."""
    courses: int
    """Courses that the road may take: one that is known, or the forecast with its errors added and subtracted."""
    known: bool
    """Whether the road ahead is known."""


class DamperLevels(NamedTuple):
    """The damper at l levels of the effective voltage."""

    lowest: float
    """Effective voltage of the first level [V]."""
    spacing: float
    """Between two levels [V]."""
    settled: float
    """Time after which the valve has followed a voltage [s]."""
    straight: bool
    """Whether no effect of the stroke acts, so that F = k e."""
    theta: Array
    """(3, l) share of the flow at the end in a step, a row for each step of the plant."""
    edges: Array
    """(l, 2) force at which the flow begins, in compression and in rebound [N]."""
    widths: Array
    """(3, l, 2) width of the table of flows above it [N]."""
    flows: Array
    """(3, l, 2, n + 1) speed of the flow [m/s], see `tabulate_flow`."""
    rows: Array
    """(l, r) parameter rows of the element, SI."""
    parallel: Array
    """(l, b) rows of the parallel effects, SI."""


class Observed(NamedTuple):
    """What is remembered of the ride and of the road."""

    measured: Array
    """(2 MODES + 4,) modes of the weighting, and what stands behind them, see `Memory`."""
    road: Array
    """(2, 2) height under both axles at the last observation and now [m]."""
    passed: Array
    """(m,) height of the road under axle 1 at the last observations, the newest at their number modulo m [m]."""
    tracked: Array
    """(2, 4) the road under each axle as the sensors gave it last, see `Track`."""
    fixed: Array
    """(f, PLANT) where the ride would be, had each of f voltages been held from its start."""
    fixed_levels: Rows
    """(f, 3) level of each of these voltages, for one step."""
    fixed_means: Array
    """(f, 3) recent mean squares of weighted acceleration [m2/s4] and loads [N2] in that ride."""


class RoadForecast(NamedTuple):
    """How the road goes on under axle 1, a period a choice, by linear prediction of its mean speeds."""

    moments: Array
    """(ORDER, ORDER + 1) recent mean products of the road's speeds, and of them with the next one [m2/s2]."""
    speeds: Array
    """(ORDER + 5,) last mean speeds of the road, the newest first [m/s], and what stands behind, see `Speed`."""
    forecasts: Array
    """(n, n) speeds that each of the last n choices forecast for the n periods behind it, in turn [m/s]."""
    skill: Array
    """(2, n) recent mean products of what was forecast n periods ahead with what came, and with itself [m2/s2]."""
    innovations: Array
    """(q,) rise between two observations less what was forecast of it, in turn [m]."""
    deviation: Array
    """(q + 1,) their sum, as one course of the road ahead; the other has it with the other sign [m]."""
    heights: Array
    """(n,) forecast heights under axle 1, one a choice [m]."""


class Workspace(NamedTuple):
    """Arrays to work in during one choice, of c candidates, t tails and s courses."""

    elimination: Array
    """(ORDER + 2, ORDER + 1) equations of the forecast, and two vectors below them."""
    load_weights: Array
    """(2,) of the squared load of each wheel [1/kg2]."""
    hold_levels: Rows
    """(2, c, 2 hold_steps + 1) level of the effective voltage of each axle at every half step."""
    tail_levels: Rows
    """(2, c t, 2 tail_steps + 1) the same behind what is held."""
    hold_heights: Array
    """(s, 2, hold_steps + 1) heights of the road under both axles in every course [m]."""
    tail_heights: Array
    """(s, 2, tail_steps + 1) the same behind what is held [m]."""
    states: Array
    """(s + 2, PLANT) states of the plant now, at the end, and behind what is held in every course."""
    drive: Array
    """(2, 2, d) voltages behind each drive effect now and behind what is held, an axle each [V]."""


class Predictor(NamedTuple):
    """Settings, knowledge, memory and workspace of one ride."""

    settings: Settings
    steps: Array
    """(3,) length of each step of the plant [s]: see `Step`."""
    candidates: Array
    """(c,) voltages that may be held [V]."""
    tails: Array
    """(t,) voltages that may follow [V]."""
    chosen: Rows
    """(4,) indices of the candidates of both axles, and of their tails."""
    residues: Array
    """(MODES, 2) of the weighting, real and imaginary part."""
    modes: Array
    """(3, MODES, 6) decay, and weights of the acceleration at both ends of each step of the plant, real and imaginary
    part."""
    damper: DamperLevels
    observed: Observed
    forecast: RoadForecast
    workspace: Workspace


def predictor_of(
    own: ComfortPredictive,
    control_period: float,
    damper: DynamicDamper,
    car: HalfCar,
    vehicle_speed: float,
    voltages: Array,
) -> Predictor:
    """Build the predictor before its first observation.

    Parameters
    ----------
    own : settings of the policy
    control_period : time between two observations [s]
    damper : the identified damper at the temperature of the ride
    car : the half-car
    vehicle_speed : [m/s]
    voltages : (m,) of the table, rising [V]
    """
    lowest, highest = float(voltages[0]), float(voltages[-1])
    # the share keeps a quotient that is whole but for rounding from one step more
    hold_steps = math.ceil(own.hold_s / HOLD_STEP * (1.0 - 1e-9))
    tail = own.horizon_s - own.hold_s
    tail_steps = math.ceil(tail / TAIL_STEP * (1.0 - 1e-9))
    steps = (control_period, own.hold_s / hold_steps, tail / tail_steps)
    known = own.road == "known"
    settings = Settings(
        observation_s=control_period,
        every=round(own.hold_s / control_period),
        hold_steps=hold_steps,
        load_weight=own.load_weight,
        remembered=math.exp(-control_period / MEMORY_S),
        margin=own.margin,
        courses=1 if known else 2,
        known=known,
    )
    poles, residues = modes_of(WK)
    periods = math.ceil(own.horizon_s / own.hold_s) + 1
    return Predictor(
        settings=settings,
        steps=np.array(steps),
        candidates=np.linspace(lowest, highest, own.voltages),
        tails=np.linspace(lowest, highest, own.tails),
        chosen=np.zeros(4, dtype=np.intp),
        residues=np.stack([residues.real, residues.imag], axis=1),
        modes=np.stack([_modes(poles, h) for h in steps]),
        damper=_levels(damper, lowest, (highest - lowest) / (LEVELS - 1) or 1.0, steps),
        observed=_nothing_observed(math.ceil(car.wheelbase / vehicle_speed / control_period) + 3, car.mass),
        forecast=RoadForecast(
            moments=np.zeros((ORDER, ORDER + 1)),
            speeds=np.zeros(ORDER + 5),
            forecasts=np.zeros((periods, periods)),
            skill=np.zeros((2, periods)),
            innovations=np.zeros(math.ceil(own.horizon_s / control_period)),
            deviation=np.zeros(math.ceil(own.horizon_s / control_period) + 1),
            heights=np.zeros(periods),
        ),
        workspace=Workspace(
            elimination=np.zeros((ORDER + 2, ORDER + 1)),
            load_weights=np.zeros(2),
            hold_levels=np.zeros((2, own.voltages, 2 * hold_steps + 1), dtype=np.intp),
            tail_levels=np.zeros((2, own.voltages * own.tails, 2 * tail_steps + 1), dtype=np.intp),
            hold_heights=np.zeros((settings.courses, 2, hold_steps + 1)),
            tail_heights=np.zeros((settings.courses, 2, tail_steps + 1)),
            states=np.zeros((2 + settings.courses, PLANT)),
            drive=np.zeros((2, 2, damper.drive.size)),
        ),
    )


def _nothing_observed(passed: int, mass: float) -> Observed:
    """Return the memory of a ride on a road that was level so far, its mean squares faint but not 0."""
    faint = FAINT * np.array([1.0, (0.5 * mass) ** 2, (0.5 * mass) ** 2])
    measured = np.zeros(2 * MODES + 4)
    measured[[Memory.MEAN_LOAD_1, Memory.MEAN_LOAD_2]] = faint[1:]
    levels = np.linspace(0, LEVELS - 1, FIXED).astype(np.intp)
    return Observed(
        measured=measured,
        road=np.zeros((2, 2)),
        passed=np.zeros(passed),
        tracked=np.zeros((2, 4)),
        fixed=np.zeros((FIXED, PLANT)),
        fixed_levels=np.repeat(levels[:, np.newaxis], 3, axis=1),
        fixed_means=np.tile(faint, (FIXED, 1)),
    )


def _modes(poles: Complex, h: float) -> Array:
    """Return the (MODES, 6) decay of every mode over a step [s], and what the acceleration at its start and end adds.

    Equation: x(h) = e^z x(0) + h (phi_1 - phi_2) a(0) + h phi_2 a(h), z = p h, phi_k as in `pzd.damper.element`
    """
    z = poles * h
    first = np.expm1(z) / z
    second = (first - 1.0) / z
    parts = (np.exp(z), h * (first - second), h * second)
    return np.stack([part for value in parts for part in (value.real, value.imag)], axis=1)


# --- The damper by levels of the effective voltage ---


def _levels(damper: DynamicDamper, lowest: float, spacing: float, steps: tuple[float, ...]) -> DamperLevels:
    """Tabulate the damper from the lowest effective voltage on, a spacing apart [V], for every step [s]."""
    effective = lowest + spacing * np.arange(LEVELS, dtype=np.float64)
    rows = _over(damper.voltages, damper.rows, effective)
    theta, edges = np.zeros((len(steps), LEVELS)), np.zeros((LEVELS, 2))
    widths, flows = np.zeros((len(steps), LEVELS, 2)), np.zeros((len(steps), LEVELS, 2, FLOWS + 1))
    curves = np.zeros((LEVELS, 2, CURVE + 1))
    fill_curves(rows, curves)
    for n, h in enumerate(steps):
        tabulate_flow(rows, h, curves, theta[n], edges, widths[n], flows[n])
    stroke = {effect.name for effect in acting("stroke")}
    bent = [len(ELEMENT) + n for n, column in enumerate(STROKE_AND_FLOW) if column[0] in stroke]
    neutral = [NEUTRAL[STROKE_AND_FLOW[n - len(ELEMENT)]] for n in bent]
    return DamperLevels(
        lowest=lowest,
        spacing=spacing,
        settled=SETTLED * float(damper.drive[DRIVE.index(("valve_lag", "tau"))]),
        straight=bool(np.all(rows[:, bent] == neutral)),
        theta=theta,
        edges=edges,
        widths=widths,
        flows=flows,
        rows=rows,
        parallel=np.zeros((LEVELS, 0)) if damper.alone else _over(damper.voltages, damper.parallel, effective),
    )


def _over(nodes: Array, rows: Array, effective: Array) -> Array:
    """Interpolate (l, r) rows at (l,) effective voltages [V], held beyond the (m,) nodes; infinities stand."""
    place = np.interp(effective, nodes, np.arange(nodes.size))
    below = place.astype(np.intp)
    above, share = np.minimum(below + 1, nodes.size - 1), (place - below)[:, np.newaxis]
    same = rows[below] == rows[above]
    with np.errstate(invalid="ignore"):
        return np.where(same, rows[below], rows[below] + share * (rows[above] - rows[below]))


@compiled
def fill_curves(rows: Array, forces: Array) -> None:
    """Fill the (l, 2, m + 1) flow curve [N] of (l, r) parameter rows, a side each, at (j / m)^2 of `TOP_FLOW`."""
    last = forces.shape[2] - 1
    for level in range(rows.shape[0]):
        for n in range(2):
            for j in range(last + 1):
                forces[level, n, j] = flow_force(TOP_FLOW * (j / last) ** 2, row_of(rows[level]), 2.0 * n - 1.0)


@compiled
def tabulate_flow(
    rows: Array, h: float, curves: Array, theta: Array, edges: Array, widths: Array, flows: Array
) -> None:
    """Fill the speed of the flow over the force that a step would end at if nothing flowed in it.

    Equation: F = flow curve (w) + k h theta w, inverted; at (j / n)^2 of what w = 3 m/s needs above breakaway

    Parameters
    ----------
    rows : (l, r) parameters of the element at each level of the effective voltage
    h : step [s]
    curves : (l, 2, m + 1) of `fill_curves`
    theta : (l,) filled
    edges, widths : (l, 2) force at which the flow begins, and width of the table above it, a side each [N]; filled
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
            edges[level, n], widths[level, n] = edge, curves[level, n, fine] + slope * TOP_FLOW - edge
            i, before, after = 0, 0.0, 0.0
            for j in range(last + 1):
                over = widths[level, n] * (j / last) ** 2
                while after < over and i < fine:
                    i += 1
                    before, after = after, curves[level, n, i] - edge + slope * TOP_FLOW * (i / fine) ** 2
                low, high = TOP_FLOW * (max(i - 1, 0) / fine) ** 2, TOP_FLOW * (i / fine) ** 2
                flows[level, n, j] = low + (high - low) * (over - before) / (after - before) if after > before else 0.0
