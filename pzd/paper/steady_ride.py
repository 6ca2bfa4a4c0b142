"""The paper's controlled ride on a sine, settled, for thousands of cars: ideal forces, fixed step, no records.

Car, road, bounds and tie-break are those of `pzd.simulate`; only the loop is one of its own. The rides of
`pzd.simulate` balance energies, cut steps and write histories, which takes six times as long (0.075 against 0.012 s a
car and tie-break): the survey of 690 rows with eight neighbours each would take half an hour instead of minutes.
Over every sixtieth row of cars.csv the peaks agree to 1e-4 in the median and 1 % at most (fixed steps or a tolerance
of 1e-9), which is also how far those of `pzd.simulate` move between these two: where the control jumps from one end of
its range to the other, a peak is not defined more closely. tests/paper/test_car_search.py holds both against each
other.
"""

from __future__ import annotations

import math

import numpy as np

from pzd.compiled import compiled
from pzd.record import Array
from pzd.simulate.admissible import coefficient_bounds
from pzd.simulate.car import HalfCar
from pzd.simulate.demand import spring_acceleration
from pzd.simulate.equations import body_acceleration
from pzd.simulate.kinematics import suspension
from pzd.simulate.minimise import LARGEST, TIE_BREAKS, farther_end, least_acceleration_forces
from pzd.simulate.policy import TieBreak
from pzd.simulate.profile import Profile
from pzd.simulate.ride_model import (
    DEFLECTION,
    FORCE,
    HIGH,
    LOW,
    RATE,
    SPRINGS,
    RoadCoefficients,
    Vehicle,
    road_coefficients,
    vehicle,
    workspace,
)

STEP, SETTLE, DURATION = 0.001, 8.0, 16.0
"""Step of integration, time before the peak is taken, and end of the ride [s]."""
_BODY = 4
"""States: z, phi and their rates."""


def settled_peak(
    car: HalfCar,
    tie_break: TieBreak,
    frequency: float,
    amplitude: float,
    vehicle_speed: float,
    bounds: tuple[float, float],
    step: float = STEP,
) -> float:
    """Largest |a_K| of the settled ride under the paper's control on a sine.

    Equation: T_K in Arg min |a_0 + D^T T|, T_i in [c_min V_i, c_max V_i]     Source: Makowski and Knap 2021, (10)-(12)

    Parameters
    ----------
    car : the half-car
    tie_break : which of many minimisers
    frequency : that the car feels [Hz]
    amplitude : of the road [m]
    vehicle_speed : [m/s]
    bounds : c_min, c_max [N s/m]
    step : of integration [s]

    Returns
    -------
    peak between `SETTLE` and `DURATION` [m/s2]
    """
    road = Profile(amplitude=amplitude, wavenumber=2.0 * math.pi * frequency / vehicle_speed)
    return float(
        _peak(
            vehicle(car, vehicle_speed),
            road_coefficients(road, car.wheelbase),
            bounds,
            TIE_BREAKS[tie_break],
            step,
            round(DURATION / step),
            round(SETTLE / step),
            workspace(),
            np.zeros((6, _BODY)),
        )
    )


@compiled
def _peak(
    car: Vehicle,
    road: RoadCoefficients,
    bounds: tuple[float, float],
    tie: int,
    step: float,
    steps: int,
    settle: int,
    workspace: Array,
    scratch: Array,
) -> float:
    """Largest |a_K| at the steps from `settle` on; scratch (6, 4) holds the state, a trial state and four rates."""
    x, trial, rates = scratch[0], scratch[1], scratch[2:]
    peak = 0.0
    for n in range(steps + 1):
        time = n * step
        end = _rates(time, x, car, road, bounds, tie, -1, workspace, rates[0])
        if n >= settle:
            a = 0.0
            for i in range(2):
                a += car.comfort[i] * (workspace[SPRINGS, i] + workspace[FORCE, i])
            peak = max(peak, abs(a))
        for stage in range(1, 4):
            part = step if stage == 3 else 0.5 * step
            for i in range(_BODY):
                trial[i] = x[i] + part * rates[stage - 1, i]
            _rates(time + part, trial, car, road, bounds, tie, end, workspace, rates[stage])
        for i in range(_BODY):
            x[i] += step / 6.0 * (rates[0, i] + 2.0 * rates[1, i] + 2.0 * rates[2, i] + rates[3, i])
    return peak


@compiled
def _rates(
    time: float,
    x: Array,
    car: Vehicle,
    road: RoadCoefficients,
    bounds: tuple[float, float],
    tie: int,
    end: int,
    workspace: Array,
    rates: Array,
) -> int:
    """Fill the derivative of the body's state; the end of the segment that `largest` takes is chosen where it is -1."""
    suspension(time, x, car, road, workspace)
    for i in range(2):
        workspace[LOW, i], workspace[HIGH, i] = coefficient_bounds(workspace[RATE, i], bounds[0], bounds[1])
    a0 = spring_acceleration(car, workspace[DEFLECTION])
    if tie == LARGEST and end < 0:
        end = farther_end(a0, car.comfort, workspace[LOW], workspace[HIGH])
    least_acceleration_forces(a0, car.comfort, workspace[LOW], workspace[HIGH], tie, end, workspace[FORCE])
    rates[0], rates[1] = x[2], x[3]
    rates[2], rates[3] = body_acceleration(
        car, workspace[SPRINGS, 0] + workspace[FORCE, 0], workspace[SPRINGS, 1] + workspace[FORCE, 1]
    )
    return end
