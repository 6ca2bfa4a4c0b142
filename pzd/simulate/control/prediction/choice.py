"""Which voltages to hold next: every pair is tried on the plant, followed by every pair of tails.

Once a control period the ride is observed; once a hold the loads are weighed, the road ahead is filled in, and the pair
of voltages with the least cost is chosen.
"""

from __future__ import annotations

import math

from pzd.compiled import compiled, inlined
from pzd.damper.compiled.kernels import effective_voltage_after, keep_voltage
from pzd.record import Array
from pzd.simulate.control.prediction.forecast import fill_forecast, fill_known, learn, observed_height, unforeseen
from pzd.simulate.control.prediction.plant import predicted, weigh
from pzd.simulate.control.prediction.predictor import (
    MODES,
    DamperLevels,
    Memory,
    Observed,
    Plant,
    Predictor,
    Speed,
    States,
    Step,
)
from pzd.simulate.control.sensing import Electronics, copy_into
from pzd.simulate.ride.model import Axle, Command, DynamicDamper, RideModel, RunningRide, State, Vehicle

_STEEPNESS = 4.0
"""Power with which the weight of a load rises as it leaves that of the best fixed voltage: a tenth more load has
twice the weight, since it is of mean squares."""

# --- Observe the ride once a control period ---


@compiled
def observe(sampled: float, ride: RunningRide, plan: Predictor, electronics: Electronics | None) -> bool:
    """Take note of acceleration, loads and road once a control period, and tell whether it is time to choose.

    Parameters
    ----------
    sampled : when what the controller sees was [s]
    ride : its workspace as `motion` left it, or as the sensors gave it
    plan : its memory is changed
    electronics : see `set_control`; its noise is in the road under the axles
    """
    observed, measured, settings = plan.observed, plan.observed.measured, plan.settings
    number, a_K = int(measured[Memory.OBSERVATIONS]), ride.workspace[Axle.COMFORT, 0]
    weigh(measured, 0, measured[Memory.ACCELERATION], a_K, plan.modes[Step.OBSERVED], plan.residues)
    measured[Memory.ACCELERATION] = a_K
    for i in range(2):
        load = ride.workspace[Axle.CONTACT, i]
        observed.road[i, 0] = observed.road[i, 1]
        observed.road[i, 1] = observed_height(sampled, i, ride.model, plan, electronics)
        change = load * load - measured[Memory.MEAN_LOAD_1 + i]
        measured[Memory.MEAN_LOAD_1 + i] += (1.0 - settings.remembered) * change
    measured[Memory.OBSERVATIONS] = number + 1
    innovations, foreseen = plan.forecast.innovations, settings.observation_s * plan.forecast.speeds[Speed.EXPECTED]
    innovations[(number + 1) % innovations.size] = observed.road[0, 1] - observed.road[0, 0] - foreseen
    observed.passed[(number + 1) % observed.passed.size] = observed.road[0, 1]
    if number > 0:
        ride_fixed(ride.model.car, plan)
    return number % settings.every == 0


@compiled
def ride_fixed(car: Vehicle, plan: Predictor) -> None:
    """Bring the ride at each fixed voltage to the present, over the road since the last observation.

    They are the measure of how much wheel load comfort may cost.
    """
    observed, means = plan.observed, plan.observed.fixed_means
    for n in range(observed.fixed.shape[0]):
        state, levels = observed.fixed[n], observed.fixed_levels[n]
        predicted(car, plan, state, levels, levels, observed.road, Step.OBSERVED, math.inf)
        for i in range(3):
            square = state[Plant.WEIGHTED + i] * state[Plant.WEIGHTED + i]
            means[n, i] += (1.0 - plan.settings.remembered) * (square - means[n, i])


# --- Choose once a hold ---


@compiled
def predict(
    time: float, age: float, y: Array, ride: RunningRide, plan: Predictor, electronics: Electronics | None
) -> None:
    """Observe, and choose anew where it is time; see `choose`."""
    if observe(time - age, ride, plan, electronics):
        choose(time, age, y, ride, plan)


@compiled
def choose(time: float, age: float, y: Array, ride: RunningRide, plan: Predictor) -> None:
    """Choose the voltages with which the ride ahead costs least, and leave them in `Predictor.chosen`.

    Equation: (U_1, U_2) = Arg min over U, W in finite sets of J(U for the hold, then W), J of `predicted`
    Source: rollout of base policies, here those that hold W; Bertsekas 2017, Dynamic Programming I, sec. 6.4

    Parameters
    ----------
    time : [s]
    age : of state and workspace, by which they lie behind the voltages that are set [s]
    y : (n,) state
    ride : its workspace as `motion` left it, or as the sensors gave it
    plan : its workspace is filled
    """
    model = ride.model
    _look_ahead(time - age, model, plan)
    weigh_loads(plan.observed, plan.settings.load_weight, plan.workspace.load_weights)
    _fill_levels(time, model.damper, plan, ride.control)
    _fill_now(y, model, plan, ride.workspace)
    held, tails, best = plan.candidates.size, plan.tails.size, math.inf
    if not plan.settings.known:
        best = _best_held_on(model, plan) * (1.0 - plan.settings.margin * unforeseen(plan))
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


@compiled
def weigh_loads(observed: Observed, weight: float, weights: Array) -> None:
    """Fill the weights (2,) of the wheel loads in this choice [1/kg2].

    Equation: lambda_i = w A / B (B_i / B)^q, B_i = <L_i^2>; A = <a_w^2> and B = max <L_i^2> of the ride at the fixed
    voltage with the least A

    Both terms of the cost are shares of what a fixed voltage does on the same road, so that one weight w serves
    roads of any height; the power holds the loads where they are at the fixed voltage.
    """
    means, best = observed.fixed_means, 0
    for n in range(1, observed.fixed.shape[0]):
        if means[n, 0] < means[best, 0]:
            best = n
    load = max(means[best, 1], means[best, 2])
    for i in range(2):
        rise = observed.measured[Memory.MEAN_LOAD_1 + i] / load
        weights[i] = weight * means[best, 0] / load * rise**_STEEPNESS


@inlined
def _fill_now(y: Array, model: RideModel, plan: Predictor, workspace: Array) -> None:
    """Fill the state of the plant by that of the ride."""
    now = plan.workspace.states[States.NOW]
    for n in range(4):
        now[Plant.BODY + n] = y[State.HEAVE + n]
    for i in range(2):
        now[Plant.ELASTIC + i] = workspace[Axle.OIL_DEFLECTION, i]
        now[Plant.FLOW + i] = workspace[Axle.FLOW, i]
    for n in range(2 * MODES):
        now[Plant.WEIGHTING + n] = plan.observed.measured[n]
    if model.car.wheels:
        for n in range(4):
            now[Plant.WHEELS + n] = y[State.WHEEL_1 + n]


@compiled
def _best_held_on(model: RideModel, plan: Predictor) -> float:
    """Return the cost of the best voltage that is also a tail, held on at both axles; it is left in `chosen`."""
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
    car, road, workspace = model.car, model.road_coefficients, plan.workspace
    hold = plan.settings.hold_steps * plan.steps[Step.HELD]
    if plan.settings.known:
        fill_known(time, car, road, plan.steps[Step.HELD], workspace.hold_heights[0])
        fill_known(time + hold, car, road, plan.steps[Step.TAIL], workspace.tail_heights[0])
        return
    learn(plan, plan.observed.passed[int(plan.observed.measured[Memory.OBSERVATIONS]) % plan.observed.passed.size])
    delay = (road.behind[1] - road.behind[0]) / car.speed
    for course in range(plan.settings.courses):
        fill_forecast(plan, course, 0.0, delay, plan.steps[Step.HELD], workspace.hold_heights[course])
        fill_forecast(plan, course, hold, delay, plan.steps[Step.TAIL], workspace.tail_heights[course])


@inlined
def _held_cost(model: RideModel, plan: Predictor, i: int, j: int, most: float) -> float:
    """Return the cost of holding a pair of candidates in all courses together; their states are left in `states`."""
    workspace, cost = plan.workspace, 0.0
    for course in range(plan.settings.courses):
        state, heights = workspace.states[States.HOLDING + course], workspace.hold_heights[course]
        copy_into(workspace.states[States.NOW], state)
        one, two = workspace.hold_levels[0, i], workspace.hold_levels[1, j]
        cost += predicted(model.car, plan, state, one, two, heights, Step.HELD, most - cost)
    return cost


@inlined
def _tail_cost(model: RideModel, plan: Predictor, a: int, b: int, cost: float, most: float) -> float:
    """Return the cost of what was held and of a pair of tails behind it, in all courses together."""
    workspace = plan.workspace
    for course in range(plan.settings.courses):
        if cost < most:
            state, heights = workspace.states[States.END], workspace.tail_heights[course]
            copy_into(workspace.states[States.HOLDING + course], state)
            one, two = workspace.tail_levels[0, a], workspace.tail_levels[1, b]
            cost += predicted(model.car, plan, state, one, two, heights, Step.TAIL, most - cost)
    return cost


@compiled
def _fill_levels(time: float, damper: DynamicDamper, plan: Predictor, control: Array) -> None:
    """Fill the levels of the effective voltage under every candidate, and under every tail behind it."""
    hold, workspace = plan.settings.hold_steps * plan.steps[Step.HELD], plan.workspace
    for axle in range(2):
        now, behind = workspace.drive[0, axle], workspace.drive[1, axle]
        copy_into(control[Command.BEHIND :, axle], now)
        keep_voltage(control[Command.SET, axle], time - control[Command.SINCE, 0], now, damper.drive)
        for i in range(plan.candidates.size):
            _follow(plan.damper, damper, plan.candidates[i], plan.steps[Step.HELD], now, workspace.hold_levels[axle, i])
            for j in range(plan.tails.size):
                copy_into(now, behind)
                keep_voltage(plan.candidates[i], hold, behind, damper.drive)
                levels = workspace.tail_levels[axle, i * plan.tails.size + j]
                _follow(plan.damper, damper, plan.tails[j], plan.steps[Step.TAIL], behind, levels)


@inlined
def _follow(table: DamperLevels, damper: DynamicDamper, voltage: float, h: float, behind: Array, levels: Array) -> None:
    """Fill the (2 n + 1,) levels of the effective voltage while a voltage is held, a half step apart."""
    level = 0
    for n in range(levels.size):
        if n == 0 or (n - 1) * 0.5 * h < table.settled:
            effective, _ = effective_voltage_after(voltage, 0.5 * n * h, behind, damper.drive)
            place = (effective - table.lowest) / table.spacing
            level = min(max(int(place + 0.5), 0), table.rows.shape[0] - 1)
        levels[n] = level
