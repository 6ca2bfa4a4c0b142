"""One ride: the car, its road, the law and the damper put together, ridden, and its energies balanced."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.damper.dormand_prince import STAGES
from pzd.schema.errors import DataError
from pzd.simulate.car import HalfCar
from pzd.simulate.config import SimulateConfig
from pzd.simulate.dampers import rubs
from pzd.simulate.dynamic_damper import DynamicDamper
from pzd.simulate.energy import balance_error, stored_energy
from pzd.simulate.linear import ride_exactly
from pzd.simulate.loop import COLUMNS, LOAD_1, OUTSIDE, PEAK_DEFLECTION, SAMPLES, STEPS_DONE, TALLIES, ride
from pzd.simulate.minimise import TIE_BREAKS
from pzd.simulate.outcome import Outcome
from pzd.simulate.plan import Case
from pzd.simulate.profile import Profile
from pzd.simulate.ride_model import (
    BY_COEFFICIENTS,
    BY_TABLE,
    DISSIPATED,
    DYNAMIC,
    FEEDBACK,
    IDEAL,
    MINIMISE,
    SENSED,
    STATES,
    TABLE,
    UNBOUNDED,
    VOLTAGE,
    ControlSpec,
    RideModel,
    TableArrays,
    control,
    road_coefficients,
    vehicle,
    workspace,
)

KM_PER_H = 1.0 / 3.6
_FIDELITIES = {"ideal": IDEAL, "table": TABLE, "dynamic": DYNAMIC}
_AIMS = {"damping": FEEDBACK, "feedback": FEEDBACK, "minimise": MINIMISE, "voltage": VOLTAGE}


@dataclass(frozen=True)
class Clock:
    """Steps of a ride."""

    step: float
    steps: int
    per_control: int
    per_output: int
    settle: int

    @classmethod
    def of(cls, config: SimulateConfig) -> Clock:
        """The clock of a config."""
        h = config.integration_step_s
        return cls(
            h,
            round(config.duration_s / h),
            round(config.control_period_s / h),
            round(1.0 / (config.output_rate_Hz * h)),
            round(config.settle_s / h),
        )


def control_spec_of(config: SimulateConfig, case: Case, car: HalfCar, damper: DynamicDamper) -> ControlSpec:
    """Policy, bounds and fidelity of a case as numbers."""
    policy, fidelity = case.policy, _FIDELITIES[case.fidelity]
    bounds = BY_TABLE
    if fidelity == IDEAL:
        bounds = BY_COEFFICIENTS if config.bounds == "coefficients" else BY_TABLE
        if policy.aim == "damping":
            bounds = UNBOUNDED
    gains = np.zeros((2, SENSED))
    if policy.feedback is not None:
        gains = np.ascontiguousarray(policy.feedback(car, config.constant_damping_Ns_per_m))
    jumps = rubs(damper) if fidelity == DYNAMIC else bounds == BY_TABLE
    return ControlSpec(
        fidelity,
        _AIMS[policy.aim],
        bounds,
        TIE_BREAKS[config.tie_break],
        float(config.c_min_Ns_per_m),
        float(config.c_max_Ns_per_m),
        float(config.passive_voltage_V),
        jumps,
        gains,
    )


def ride_case(
    config: SimulateConfig, case: Case, profile: Profile, grid: TableArrays, damper: DynamicDamper, ends: bool
) -> Outcome:
    """Ride one case.

    Parameters
    ----------
    config : the block
    case : what to ride
    profile : the road
    grid, damper : the damper as table and with its dynamics
    ends : whether the table ends where the rig did, so that a ride beyond is refused

    Returns
    -------
    the ride

    Raises
    ------
    DataError : when the ride needs the table where it ends
    """
    car, clock = config.car.car(), Clock.of(config)
    speed = config.vehicle_speed_km_per_h * KM_PER_H
    if case.fidelity == "ideal" and case.policy.aim == "damping" and profile.smooth:
        frequency = profile.wavenumber * speed / (2.0 * np.pi)
        return ride_exactly(
            car,
            config.constant_damping_Ns_per_m,
            frequency,
            profile.amplitude,
            speed,
            clock.step,
            clock.steps,
            clock.per_output,
            clock.settle,
            float(np.max(grid.reach)),
        )
    own = damper._replace(scratch=np.zeros_like(damper.scratch))  # rides at the same time work in rooms of their own
    model = RideModel(
        vehicle(car, speed),
        road_coefficients(profile, car.wheelbase),
        control_spec_of(config, case, car, damper),
        grid,
        own,
    )
    return ride_of_model(model, clock, config.tolerance, case.name, ends)


def ride_of_model(model: RideModel, clock: Clock, tolerance: float, name: str, ends: bool) -> Outcome:
    """Ride from rest on a level start, and balance the energies; see `ride_case`."""
    acts, scratch, y = control(model.control_spec.voltage), workspace(), np.zeros(STATES)
    comfort = np.zeros(clock.steps + 1)
    history = np.zeros((clock.steps // clock.per_output + 1, COLUMNS))
    tally = np.zeros(TALLIES)
    before = stored_energy(0.0, y, model, acts, scratch)
    ride(
        y,
        model,
        acts,
        scratch,
        clock.steps,
        clock.step,
        tolerance,
        clock.per_control,
        clock.per_output,
        clock.settle,
        comfort,
        history,
        tally,
        np.zeros((STAGES + 1, STATES)),
        np.zeros(STATES),
    )
    if tally[STEPS_DONE] < clock.steps or not np.all(np.isfinite(y)):
        raise DataError(_lost(name, tally[STEPS_DONE] * clock.step, ends, float(np.max(np.abs(scratch[1])))))
    change = stored_energy(clock.steps * clock.step, y, model, acts, scratch) - before
    return Outcome(
        history=history,
        comfort=comfort,
        step=clock.step,
        peak_deflection=float(tally[PEAK_DEFLECTION]),
        wheel_load=float(np.sqrt(np.max(tally[LOAD_1 : LOAD_1 + 2]) / tally[SAMPLES])),
        outside=float(tally[OUTSIDE] / (clock.steps + 1)),
        dissipated=float(y[DISSIPATED]),
        energy_error=balance_error(change, y),
    )


def _lost(name: str, time: float, ends: bool, speed: float) -> str:
    if ends:
        return (
            f"4-table/force.csv: {name}: at {time:.3g} s a damper moves at {speed:.2g} m/s, where the table ends; "
            "test the rig faster, or set table.outside to model or clamp"
        )
    return f"5-simulate/{name}.csv: the ride is lost at {time:.3g} s: the motion has no finite value there"
