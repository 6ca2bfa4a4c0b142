"""One ride: car, road, policy and damper put together, ridden, and the energies balanced."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pzd.record import Array
from pzd.schema.errors import DataError
from pzd.simulate.compiled_ahead import wait
from pzd.simulate.config import SimulateConfig
from pzd.simulate.control.demand import LEAST_LOAD, TIE_BREAKS
from pzd.simulate.control.prediction.predictor import predictor_of
from pzd.simulate.control.sensing import electronics_of, with_noise
from pzd.simulate.policies import SENSED
from pzd.simulate.ride.equations import balance_error, oil_energy, relax_oil, stored_energy
from pzd.simulate.ride.linear import ride_exactly
from pzd.simulate.ride.loop import COLUMNS, COURSE_COLUMNS, FLOWED, OUTSIDE, STEPS_DONE, Clock, records_of, ride_steps
from pzd.simulate.ride.model import (
    AIMS,
    BY_COEFFICIENTS,
    BY_TABLE,
    DYNAMIC,
    FIDELITIES,
    IDEAL,
    UNBOUNDED,
    VOLTAGE,
    Axle,
    ControlSpec,
    DynamicDamper,
    RideModel,
    State,
    TableArrays,
    at_rest,
    ride_of,
    road_coefficients,
    rubs,
    vehicle,
)
from pzd.simulate.ride.outcome import Outcome, SpilledRows, longest_piece
from pzd.simulate.ride.stepper import integrator_of
from pzd.simulate.roads import Profile
from pzd.simulate.study.plan import Case
from pzd.simulate.vehicle.car import HalfCar

CourseSink = Callable[[int, Array], None]
"""Receives the rows of the course from a step on, which are written over afterwards."""


@dataclass(frozen=True)
class SearchResult:
    """The most comfortable ride that a search found within a bound on the wheel load."""

    by: str
    """`search`, or the policy that none of the schedules beats."""
    most_load: float
    """The bound [N]."""
    evaluations: int
    """Rides that the search took."""
    voltages: tuple[tuple[float, ...], ...] = ()
    """Of each axle over a period of the road, from where axle 1 meets its rising zero [V]; empty for a policy."""


@dataclass(frozen=True)
class FixedValues:
    """What a policy may hold constant during a ride, or repeat with the road."""

    voltage: float
    """Of `passive` and the like, and of every valve before the ride [V]."""
    damping: float
    """c of `constant` and the like, per axle [N s/m]."""
    searched: SearchResult | None = None
    """What `best_found` came to."""

    @classmethod
    def of(cls, config: SimulateConfig, grid: TableArrays) -> FixedValues:
        """Return those of the config; by default the voltage of the table that is nearest to 0."""
        nearest = float(grid.voltages[np.argmin(np.abs(grid.voltages))])
        voltage = nearest if config.passive_voltage_V is None else config.passive_voltage_V
        return cls(voltage, config.constant_damping_Ns_per_m)


def clock_of(config: SimulateConfig) -> Clock:
    """Return the steps of a ride."""
    h = config.integration_step_s
    per_output = round(1.0 / (config.output_rate_Hz * h))
    return Clock(h, round(config.duration_s / h), round(config.control_period_s / h), per_output)


def control_spec_of(
    config: SimulateConfig, case: Case, car: HalfCar, damper: DynamicDamper, fixed: FixedValues
) -> ControlSpec:
    """Return policy, bounds and fidelity of a case as numbers.

    Parameters
    ----------
    config : the block simulate
    case : road, policy and fidelity
    car : that is ridden, for the gains of a policy of its own state
    damper : whose friction makes the force jump
    fixed : voltage and damping that a policy may hold
    """
    policy, fidelity = case.policy, FIDELITIES[case.fidelity]
    bounds = BY_TABLE
    if fidelity == IDEAL:
        bounds = BY_TABLE if config.coefficients is None else BY_COEFFICIENTS
        if policy.aim == "damping":
            bounds = UNBOUNDED
    gains, crossover, own = np.zeros((2, SENSED)), 0.0, config.own_block(policy.name)
    if policy.feedback is not None:
        gains = np.ascontiguousarray(policy.feedback(car, fixed.damping, own))
    if policy.switch is not None:
        gains, crossover = policy.switch(car, own)
    jumps = rubs(damper) or damper.slips if fidelity == DYNAMIC else bounds == BY_TABLE
    searched = fixed.searched.voltages if fixed.searched is not None else ()
    return ControlSpec(
        fidelity,
        AIMS[policy.aim],
        bounds,
        LEAST_LOAD if policy.tie_break == "least_load" else TIE_BREAKS[policy.tie_break or config.tie_break],
        *(config.coefficients or (0.0, np.inf)),
        fixed.voltage,
        jumps,
        crossover,
        gains,
        np.array(searched) if searched else np.zeros((2, 1)),
    )


def ride_case(
    config: SimulateConfig,
    case: Case,
    profile: Profile,
    grid: TableArrays,
    damper: DynamicDamper,
    ends: bool,
    fixed: FixedValues | None = None,
    sink: CourseSink | None = None,
    rear: tuple[TableArrays, DynamicDamper] | None = None,
) -> Outcome:
    """Ride one case.

    Parameters
    ----------
    config : the block
    case : what to ride
    profile : the road
    grid, damper : the damper as table and with its dynamics
    ends : whether the table ends where the rig did, so that a ride beyond is refused
    fixed : what the policy holds constant; by default what the config says
    sink : receives the course piece by piece, so that the outcome has none; by default it has all of it
    rear : the damper of axle 2 likewise, where it is another one

    Returns
    -------
    the ride

    Raises
    ------
    DataError : when the ride needs the table where it ends
    """
    wait()
    car, clock, fixed = config.car.car(), clock_of(config), fixed or FixedValues.of(config, grid)
    speed = config.vehicle_speed
    linear = sink is None and case.fidelity == "ideal" and case.policy.aim == "damping" and not car.wheels_have_mass
    if linear and profile.smooth:
        return ride_exactly(car, fixed.damping, profile, speed, clock, float(np.max(grid.reach)))
    own, (rear_grid, behind) = _with_own_memory(damper), rear or (grid, damper)
    behind = own if rear is None else _with_own_memory(behind)
    spec = control_spec_of(config, case, car, damper, fixed)
    if rear is not None:
        spec = spec._replace(jumps=spec.jumps or control_spec_of(config, case, car, behind, fixed).jumps)
    way = road_coefficients(profile, car.wheelbase)
    model = RideModel(vehicle(car, speed), way, spec, grid, own, rear_grid, behind)
    y, ride = at_rest(model.car), ride_of(model)
    plan = None
    if case.policy.aim == "predict":
        wait("prediction")
        plan = predictor_of(config.comfort_predictive, config.control_period_s, own, car, speed, grid.voltages)
    electronics = electronics_of(config.sensors, config.supply, config.control_period_s, y.size, model.car.arms)
    rng = np.random.default_rng(config.sensors.seed)
    count = clock.steps + 1
    rows = count if sink is None else min(longest_piece(clock.step), count)
    records, integrator = records_of(rows, clock.per_output), integrator_of(config.tolerance, y.size)
    spilled = None if sink is None else SpilledRows(COLUMNS)
    relax_oil(0.0, y, ride)
    before = stored_energy(0.0, y, ride)
    for first in range(0, count, rows):
        last = min(first + rows, count)
        if electronics is not None:
            acts_due = -(-last // clock.per_control) - -(-first // clock.per_control)
            electronics = with_noise(electronics, rng, acts_due)
        ride_steps(y, ride, plan, electronics, first, last, clock, integrator, records)
        done = records.tally[STEPS_DONE]
        if done < last - 1 or not np.all(np.isfinite(y)):
            raise DataError(_lost(case.name, done * clock.step, ends, float(np.max(np.abs(ride.workspace[Axle.RATE])))))
        if sink is not None and spilled is not None:
            sink(first, records.course[: last - first])
            spilled.add(records.history[: -(-last // clock.per_output) - -(-first // clock.per_output)])
    ended, moves = clock.steps * clock.step, spec.aim != VOLTAGE
    change = stored_energy(ended, y, ride) - before
    oil_change = y[State.OIL_WORK] if moves else oil_energy(ended, y, ride)  # none at the start
    return Outcome(
        history=records.history if spilled is None else spilled,
        course=records.course if sink is None else np.zeros((0, COURSE_COLUMNS)),
        step=clock.step,
        outside=float(records.tally[OUTSIDE] / count),
        energy_error=balance_error(change, oil_change, y, float(records.tally[FLOWED])),
    )


def _with_own_memory(damper: DynamicDamper) -> DynamicDamper:
    """Return a damper for one ride: those at the same time each have a memory and a scratch row of their own."""
    return damper._replace(scratch=np.zeros_like(damper.scratch), memory=np.zeros_like(damper.memory))


def _lost(name: str, time: float, ends: bool, speed: float) -> str:
    if ends:
        return (
            f"4-table/force.csv: {name}: at {time:.3g} s a damper moves at {speed:.2g} m/s, where the table ends; "
            "test the rig faster, or set table.outside to model or clamp"
        )
    return f"5-simulate/{name}.csv: the ride is lost at {time:.3g} s: the motion has no finite value there"
