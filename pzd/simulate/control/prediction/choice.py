"""Which voltages to hold next: every pair is tried on the plant, followed by every pair of tails."""

from __future__ import annotations

import math

from pzd.compiled import compiled, inlined
from pzd.damper.compiled.kernels import effective_voltage_after, keep_voltage
from pzd.record import Array
from pzd.simulate.control.prediction.plant import (
    ACCELERATION,
    BODY_AND_OIL,
    HELD,
    MEAN_LOAD_1,
    MODES,
    OBSERVATIONS,
    OBSERVED,
    TAIL,
    WEIGHTED,
    WHEELS,
    Predictor,
    predicted,
    weigh,
)
from pzd.simulate.control.prediction.road import EXPECTED, fill_forecast, fill_known, height_met, learn, unforeseen
from pzd.simulate.control.sensing import Electronics, copy_into
from pzd.simulate.ride.model import (
    Axle,
    Command,
    DynamicDamper,
    RideModel,
    State,
    Vehicle,
)

# ----------------------------------------------------------------------------------------------------
# What the ride would be, had a voltage been held from its start: the measure of how much load comfort may cost.


_STEEPNESS = 4.0
"""Power with which the weight of a load rises as it leaves that of the best fixed voltage: a tenth more load has
twice the weight."""


@compiled
def ride_fixed(car: Vehicle, plan: Predictor) -> None:
    """Bring the ride at each fixed voltage to the present, over the road that was met since the last observation."""
    for n in range(plan.fixed.shape[0]):
        state, levels = plan.fixed[n], plan.fixed_levels[n]
        predicted(car, plan, state, levels, levels, plan.met, OBSERVED, math.inf)
        for i in range(3):
            square = state[WEIGHTED + i] * state[WEIGHTED + i]
            plan.fixed_means[n, i] += (1.0 - plan.forgotten) * (square - plan.fixed_means[n, i])


@compiled
def weigh_loads(plan: Predictor) -> None:
    """Fill the weights of the wheel loads in this choice.

    Equation: lambda_i = w A / B (B_i / B)^q, B_i = <L_i^2>; A = <a_w^2> and B = max <L_i^2> of the ride at the fixed
    voltage with the least A

    Both terms of the cost are shares of what a fixed voltage does on the same road, so that one weight w serves
    roads of any height; the power holds the loads where they are at the fixed voltage.
    """
    best = 0
    for n in range(1, plan.fixed.shape[0]):
        if plan.fixed_means[n, 0] < plan.fixed_means[best, 0]:
            best = n
    load = max(plan.fixed_means[best, 1], plan.fixed_means[best, 2])
    for i in range(2):
        rise = plan.felt[MEAN_LOAD_1 + i] / load
        plan.load_weights[i] = plan.load_weight * plan.fixed_means[best, 0] / load * rise**_STEEPNESS


# ----------------------------------------------------------------------------------------------------


NOW, END, HOLDING = range(3)
"""Rows of `Predictor.states`."""


@compiled
def observe(
    sampled: float, model: RideModel, plan: Predictor, electronics: Electronics | None, workspace: Array
) -> bool:
    """Take note of acceleration and road once a control period; whether it is time to choose.

    Parameters
    ----------
    sampled : when what the controller sees was [s]
    model : the ride
    plan : its memory is changed
    electronics : see `set_control`; its noise is in the road under the axles
    workspace : as `motion` left it, or as the sensors gave it
    """
    number = int(plan.felt[OBSERVATIONS])
    felt = workspace[Axle.COMFORT, 0]
    weigh(plan.felt, 0, plan.felt[ACCELERATION], felt, plan.modes[OBSERVED], plan.residues)
    plan.felt[ACCELERATION] = felt
    for i in range(2):
        load = workspace[Axle.CONTACT, i]
        plan.met[i, 0] = plan.met[i, 1]
        plan.met[i, 1] = height_met(sampled, i, model, plan, electronics)
        plan.felt[MEAN_LOAD_1 + i] += (1.0 - plan.forgotten) * (load * load - plan.felt[MEAN_LOAD_1 + i])
    plan.felt[OBSERVATIONS] = number + 1
    rise = plan.met[0, 1] - plan.met[0, 0] - plan.observation_s * plan.speeds[EXPECTED]
    plan.surprises[(number + 1) % plan.surprises.size] = rise
    plan.past[(number + 1) % plan.past.size] = plan.met[0, 1]
    if number > 0:
        ride_fixed(model.car, plan)
    return number % plan.every == 0


@compiled
def predict(
    time: float,
    age: float,
    y: Array,
    model: RideModel,
    plan: Predictor,
    electronics: Electronics | None,
    control: Array,
    workspace: Array,
) -> None:
    """Observe, and choose anew where it is time; see `choose`."""
    if observe(time - age, model, plan, electronics, workspace):
        choose(time, age, y, model, plan, control, workspace)


@compiled
def choose(
    time: float, age: float, y: Array, model: RideModel, plan: Predictor, control: Array, workspace: Array
) -> None:
    """Choose the voltages with which the ride ahead costs least; they are left in `Predictor.chosen`.

    Equation: (U_1, U_2) = Arg min over U, W in finite sets of J(U for the hold, then W), J of `predicted`
    Source: rollout of base policies, here those that hold W; Bertsekas 2017, Dynamic Programming I, sec. 6.4

    Parameters
    ----------
    time : [s]
    age : of state and workspace, by which they lie behind the voltages that are set [s]
    y : (n,) state
    model : the ride
    plan : its rooms are filled
    control, workspace : what the controller last set, and the workspace as `motion` left it, see `ride_model`
    """
    _look_ahead(time - age, model, plan)
    weigh_loads(plan)
    _fill_levels(time, model.damper, plan, control)
    _fill_now(y, model, plan, workspace)
    held, tails, best = plan.candidates.size, plan.tails.size, math.inf
    if not plan.known:
        best = _best_held_on(model, plan) * (1.0 - plan.margin * unforeseen(plan))
    last1, last2, after1, after2 = plan.chosen[0], plan.chosen[1], plan.chosen[2], plan.chosen[3]
    for m in range(held * held):  # the last choice first: what costs more is not followed to its end
        i, j = (last1 + m // held) % held, (last2 + m % held) % held
        first = _held_cost(model, plan, i, j, best)
        if first >= best:
            continue
        for n in range(tails * tails):
            a, b = (after1 + n // tails) % tails, (after2 + n % tails) % tails
            cost = _tail_cost(model, plan, i * tails + a, j * tails + b, first, best)
            if cost < best:
                best = cost
                plan.chosen[0], plan.chosen[1], plan.chosen[2], plan.chosen[3] = i, j, a, b


@inlined
def _fill_now(y: Array, model: RideModel, plan: Predictor, workspace: Array) -> None:
    """Fill the state of the plant by that of the ride."""
    now, felt = plan.states[NOW], plan.felt
    for n in range(State.OIL_1):
        now[n] = y[n]
    for i in range(2):
        now[State.OIL_1 + i] = workspace[Axle.OIL_DEFLECTION, i]
        now[State.OIL_1 + 2 + i] = workspace[Axle.FLOW, i]
    for n in range(2 * MODES):
        now[BODY_AND_OIL + n] = felt[n]
    if model.car.wheels:
        for n in range(4):
            now[WHEELS + n] = y[State.WHEEL_1 + n]


@compiled
def _best_held_on(model: RideModel, plan: Predictor) -> float:
    """Cost of the best voltage that is also a tail, held on at both axles; it is left in `Predictor.chosen`."""
    best = math.inf
    held, tails = plan.candidates.size, plan.tails.size
    for a in range(tails):
        i = int(a * (held - 1.0) / max(tails - 1, 1) + 0.5)
        cost = _tail_cost(model, plan, i * tails + a, i * tails + a, _held_cost(model, plan, i, i, best), best)
        if cost < best:
            best = cost
            plan.chosen[0], plan.chosen[1], plan.chosen[2], plan.chosen[3] = i, i, a, a
    return best


@compiled
def _look_ahead(time: float, model: RideModel, plan: Predictor) -> None:
    """Fill the road ahead in every course that it may take."""
    car, road = model.car, model.road_coefficients
    hold = plan.hold_steps * plan.steps[HELD]
    if plan.known:
        fill_known(time, car, road, plan.steps[HELD], plan.hold_heights[0])
        fill_known(time + hold, car, road, plan.steps[TAIL], plan.tail_heights[0])
        return
    learn(plan, plan.past[int(plan.felt[OBSERVATIONS]) % plan.past.size])
    delay = (road.behind[1] - road.behind[0]) / car.speed
    for course in range(plan.courses):
        fill_forecast(plan, course, 0.0, delay, plan.steps[HELD], plan.hold_heights[course])
        fill_forecast(plan, course, hold, delay, plan.steps[TAIL], plan.tail_heights[course])


@inlined
def _held_cost(model: RideModel, plan: Predictor, i: int, j: int, most: float) -> float:
    """Cost of holding a pair of candidates in all courses together; their states are left in `Predictor.states`."""
    cost = 0.0
    for course in range(plan.courses):
        state, levels = plan.states[HOLDING + course], plan.hold_levels
        copy_into(plan.states[NOW], state)
        heights = plan.hold_heights[course]
        cost += predicted(
            model.car,
            plan,
            state,
            levels[0, i],
            levels[1, j],
            heights,
            HELD,
            most - cost,
        )
    return cost


@inlined
def _tail_cost(model: RideModel, plan: Predictor, a: int, b: int, cost: float, most: float) -> float:
    """Cost of what was held and of a pair of tails behind it, in all courses together."""
    for course in range(plan.courses):
        if cost < most:
            state, levels = plan.states[END], plan.tail_levels
            copy_into(plan.states[HOLDING + course], state)
            heights = plan.tail_heights[course]
            cost += predicted(
                model.car,
                plan,
                state,
                levels[0, a],
                levels[1, b],
                heights,
                TAIL,
                most - cost,
            )
    return cost


@compiled
def _fill_levels(time: float, damper: DynamicDamper, plan: Predictor, control: Array) -> None:
    """Fill the levels of the effective voltage under every candidate, and under every tail behind it."""
    hold = plan.hold_steps * plan.steps[HELD]
    for axle in range(2):
        now, behind = plan.kept[0, axle], plan.kept[1, axle]
        copy_into(control[Command.BEHIND :, axle], now)
        keep_voltage(control[Command.SET, axle], time - control[Command.SINCE, 0], now, damper.drive)
        for i in range(plan.candidates.size):
            _follow(plan, damper, plan.candidates[i], plan.steps[HELD], now, plan.hold_levels[axle, i])
            for j in range(plan.tails.size):
                copy_into(now, behind)
                keep_voltage(plan.candidates[i], hold, behind, damper.drive)
                levels = plan.tail_levels[axle, i * plan.tails.size + j]
                _follow(plan, damper, plan.tails[j], plan.steps[TAIL], behind, levels)


@inlined
def _follow(plan: Predictor, damper: DynamicDamper, voltage: float, h: float, kept: Array, levels: Array) -> None:
    """Fill the (2 n + 1,) levels of the effective voltage while a voltage is held, a half step apart."""
    level = 0
    for n in range(levels.size):
        if n == 0 or (n - 1) * 0.5 * h < plan.settled:
            effective, _ = effective_voltage_after(voltage, 0.5 * n * h, kept, damper.drive)
            place = (effective - plan.lowest) / plan.spacing
            level = min(max(int(place + 0.5), 0), plan.rows.shape[0] - 1)
        levels[n] = level
