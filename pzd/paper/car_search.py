"""The cars that section 5 of the paper may have ridden: it leaves a1, a2, J_y and x_K out.

A plausible car has a wheelbase of 2.2 to 3.6 m, its centre of gravity 30 to 70 % behind axle 1,
J_y / (m a1 a2) of 0.7 to 1.3 and K between the axles. The two peaks with constant c of Figure 19 leave a
surface of such cars, over which the two controlled peaks vary widely. Nor does equation (12) say
which of many minimisers is taken, so each of the three tie-breaks has its own closest car.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from importlib.resources import as_file, files
from typing import Literal

import numpy as np

from pzd.compiled import compiled
from pzd.paper.published import published
from pzd.quantities import Control
from pzd.record import Array
from pzd.schema.csvfile import read_rows
from pzd.schema.model import Frozen
from pzd.simulate.config import KM_PER_H
from pzd.simulate.control.demand import (
    LARGEST,
    TIE_BREAKS,
    coefficient_bounds,
    farther_end,
    least_acceleration_forces,
    spring_acceleration,
)
from pzd.simulate.policies import TieBreak
from pzd.simulate.ride.equations import body_acceleration
from pzd.simulate.ride.linear import harmonic_response
from pzd.simulate.ride.model import (
    Axle,
    RoadCoefficients,
    Vehicle,
    road_coefficients,
    vehicle,
    workspace,
)
from pzd.simulate.roads import Profile
from pzd.simulate.vehicle.car import HalfCar
from pzd.simulate.vehicle.suspension import suspension

# ----------------------------------------------------------------------------------------------------
# The paper's controlled ride on a sine, settled, for thousands of cars: ideal forces, fixed step, no records.
#
# Car, road, bounds and tie-break are those of `pzd.simulate`; only the loop is one of its own. The rides of
# `pzd.simulate` balance energies, cut steps and write histories, which takes six times as long (0.075 against 0.012 s a
# car and tie-break): the survey of 690 rows with eight neighbours each would take half an hour instead of minutes.
# Over every sixtieth row of cars.csv the peaks agree to 1e-4 in the median and 1 % at most (fixed steps or a tolerance
# of 1e-9), which is also how far those of `pzd.simulate` move between these two: where the control jumps from one end of
# its range to the other, a peak is not defined more closely. tests/paper/test_car_search.py holds both against each
# other.


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
                a += car.comfort[i] * (workspace[Axle.SPRINGS, i] + workspace[Axle.FORCE, i])
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
        workspace[Axle.LOW, i], workspace[Axle.HIGH, i] = coefficient_bounds(
            workspace[Axle.RATE, i], bounds[0], bounds[1]
        )
    a0 = spring_acceleration(car, workspace[Axle.DEFLECTION])
    if tie == LARGEST and end < 0:
        end = farther_end(a0, car.comfort, workspace[Axle.LOW], workspace[Axle.HIGH])
    least_acceleration_forces(
        a0, car.comfort, workspace[Axle.LOW], workspace[Axle.HIGH], tie, end, workspace[Axle.FORCE]
    )
    rates[0], rates[1] = x[2], x[3]
    rates[2], rates[3] = body_acceleration(
        car,
        workspace[Axle.SPRINGS, 0] + workspace[Axle.FORCE, 0],
        workspace[Axle.SPRINGS, 1] + workspace[Axle.FORCE, 1],
    )
    return end


# ----------------------------------------------------------------------------------------------------


_PRINTED = published()
FREQUENCIES = (2.25, 4.5)
"""Of Figure 19a and 19b [Hz]."""
CONSTANT_PEAKS = (_PRINTED["F19a-c"].number, _PRINTED["F19b-c"].number)
CONTROLLED_PEAKS = (_PRINTED["F19a-ctrl"].number, _PRINTED["F19b-ctrl"].number)
"""Largest |a_K| that Figure 19 prints [m/s2]."""
MASS, STIFFNESS, DAMPING = (_PRINTED[name].number for name in ("IN-m", "IN-k1", "IN-c"))
BOUNDS = (_PRINTED["IN-cmin"].number, _PRINTED["IN-cmax"].number)
AMPLITUDE, SPEED = _PRINTED["IN-A"].number, _PRINTED["IN-V"].number * KM_PER_H
"""Inputs of section 5 in SI."""
WHEELBASES, SHARES, INERTIAS = (2.2, 3.6), (0.3, 0.7), (0.7, 1.3)
"""What is plausible: a1 + a2 [m], a1 / (a1 + a2), J_y / (m a1 a2)."""
TOLERANCE = 0.05
"""How closely a car must meet the two peaks with constant c."""
_IMPLAUSIBLE = 10.0
"""What a car outside of these ranges costs the refinement."""
_ROUNDING = 1e-3
"""How far rounding may carry a car of the grid beyond what is plausible, as a share."""

Pair = tuple[float, float]
Found = Literal["survey", "refined"]


class CarRow(Frozen):
    """One car and one tie-break; a and b are 2.25 and 4.5 Hz, low and high the spread when a parameter moves by 1 %."""

    a1_m: float
    a2_m: float
    pitch_inertia_kgm2: float
    x_K_m: float
    tie_break: TieBreak
    found: Found
    """Whether it stands on the grid of the survey or was refined from there."""
    constant_a_m_per_s2: float
    constant_b_m_per_s2: float
    controlled_a_m_per_s2: float
    controlled_a_low_m_per_s2: float
    controlled_a_high_m_per_s2: float
    controlled_b_m_per_s2: float
    controlled_b_low_m_per_s2: float
    controlled_b_high_m_per_s2: float

    @property
    def car(self) -> HalfCar:
        """The car with the paper's mass and springs."""
        return half_car(self.a1_m, self.a2_m, self.pitch_inertia_kgm2, self.x_K_m)

    @property
    def constant(self) -> Pair:
        """Peaks with constant c [m/s2]."""
        return self.constant_a_m_per_s2, self.constant_b_m_per_s2

    @property
    def controlled(self) -> Pair:
        """Controlled peaks [m/s2]."""
        return self.controlled_a_m_per_s2, self.controlled_b_m_per_s2

    @property
    def miss(self) -> float:
        """How far the worst of all four peaks is from the paper's, as a share of it."""
        return miss(self.constant, self.controlled)


def half_car(a1: float, a2: float, inertia: float, comfort_point: float) -> HalfCar:
    """The paper's body on its springs, with what the paper leaves out: a1, a2 [m], J_y [kg m2], x_K [m]."""
    return HalfCar("plausible", MASS, inertia, (a1, a2), (STIFFNESS, STIFFNESS), comfort_point)


def plausible(car: HalfCar) -> bool:
    """Whether proportions are those of a car and K lies between its axles."""
    a1, a2 = car.distances
    shares = (a1 / car.wheelbase, car.pitch_inertia / (car.mass * a1 * a2), car.wheelbase)
    ranges = (SHARES, INERTIAS, WHEELBASES)
    inside = all(
        low * (1.0 - _ROUNDING) <= value <= high * (1.0 + _ROUNDING)
        for value, (low, high) in zip(shares, ranges, strict=True)
    )
    return inside and -a1 <= car.comfort_point <= a2


def constant_peaks(car: HalfCar, damping: float = DAMPING) -> Pair:
    """Largest |a_K| with constant damping at 2.25 and 4.5 Hz, exactly [m/s2]."""
    a, b = (abs(harmonic_response(car, damping, f, AMPLITUDE, SPEED)[1]) for f in FREQUENCIES)
    return a, b


def controlled_peaks(car: HalfCar, tie_break: TieBreak, step: float = STEP) -> Pair:
    """Largest |a_K| under the paper's control at 2.25 and 4.5 Hz, forces ideal within `BOUNDS` [m/s2]."""
    a, b = (settled_peak(car, tie_break, f, AMPLITUDE, SPEED, BOUNDS, step) for f in FREQUENCIES)
    return a, b


def miss(constant: Pair, controlled: Pair) -> float:
    """How far the worst of the four peaks of Figure 19 is missed, as a share of the paper's."""
    wanted = (*CONSTANT_PEAKS, *CONTROLLED_PEAKS)
    return max(abs(found / target - 1.0) for found, target in zip((*constant, *controlled), wanted, strict=True))


def meets_constant(peaks: Pair, tolerance: float = TOLERANCE) -> bool:
    """Whether both peaks with constant c are the paper's within a share."""
    return all(abs(found / target - 1.0) <= tolerance for found, target in zip(peaks, CONSTANT_PEAKS, strict=True))


def candidates() -> Iterator[HalfCar]:
    """The plausible cars of a grid that meet both peaks with constant c within `TOLERANCE`.

    a_K is affine in x_K, so two places of K give it at all of them.
    """
    for wheelbase in np.arange(2.2, 3.61, 0.1):
        for share in np.arange(0.3, 0.71, 0.05):
            for ratio in np.arange(0.7, 1.31, 0.1):
                a1 = float(round(share * wheelbase, 3))
                a2 = float(round(wheelbase - a1, 3))
                car = half_car(a1, a2, float(round(ratio * MASS * a1 * a2, 1)), 0.0)
                yield from _meeting(car, np.round(np.linspace(-a1, a2, 51), 3))


def _meeting(car: HalfCar, places: Array) -> Iterator[HalfCar]:
    at_centre, at_metre = (
        [harmonic_response(replace(car, comfort_point=x), DAMPING, f, AMPLITUDE, SPEED)[1] for f in FREQUENCIES]
        for x in (0.0, 1.0)
    )
    peaks = [np.abs(zero + places * (one - zero)) for zero, one in zip(at_centre, at_metre, strict=True)]
    for x, a, b in zip(places, *peaks, strict=True):
        found = replace(car, comfort_point=float(x))
        if meets_constant((float(a), float(b))) and plausible(found):
            yield found


def neighbours(car: HalfCar, share: float = 0.01) -> Iterator[HalfCar]:
    """The car with each of a1, a2, J_y and x_K moved by a share, down and up."""
    a1, a2 = car.distances
    for factor in (1.0 - share, 1.0 + share):
        yield replace(car, distances=(a1 * factor, a2))
        yield replace(car, distances=(a1, a2 * factor))
        yield replace(car, pitch_inertia=car.pitch_inertia * factor)
        yield replace(car, comfort_point=car.comfort_point * factor)


def row_of(car: HalfCar, tie_break: TieBreak, found: Found = "survey") -> CarRow:
    """The peaks of one car under one tie-break, and their spread when each parameter moves by 1 %."""
    constant, controlled = constant_peaks(car), controlled_peaks(car, tie_break)
    spread = np.array([controlled, *(controlled_peaks(other, tie_break) for other in neighbours(car))])
    low, high = spread.min(axis=0), spread.max(axis=0)
    return CarRow(
        a1_m=car.distances[0],
        a2_m=car.distances[1],
        pitch_inertia_kgm2=car.pitch_inertia,
        x_K_m=car.comfort_point,
        tie_break=tie_break,
        found=found,
        constant_a_m_per_s2=_rounded(constant[0]),
        constant_b_m_per_s2=_rounded(constant[1]),
        controlled_a_m_per_s2=_rounded(controlled[0]),
        controlled_a_low_m_per_s2=_rounded(low[0]),
        controlled_a_high_m_per_s2=_rounded(high[0]),
        controlled_b_m_per_s2=_rounded(controlled[1]),
        controlled_b_low_m_per_s2=_rounded(low[1]),
        controlled_b_high_m_per_s2=_rounded(high[1]),
    )


def _rounded(peak: float) -> float:
    return float(round(peak, 4))


def refined(start: HalfCar, tie_break: TieBreak) -> HalfCar:
    """The plausible car near another whose four peaks are closest to the paper's: seconds.

    Source: Nelder and Mead 1965, on the largest of the four misses

    Parameters
    ----------
    start : a plausible car
    tie_break : which of many minimisers

    Returns
    -------
    the car, to the millimetre and the kg m2
    """
    from scipy.optimize import minimize

    scale = np.array([1.0, 1.0, 1000.0, 1.0])

    def car_at(x: Array) -> HalfCar:
        a1, a2, inertia, place = (float(value) for value in x * scale)
        return half_car(round(a1, 3), round(a2, 3), round(inertia, 0), round(place, 3))

    def cost(x: Array) -> float:
        car = car_at(x)
        return miss(constant_peaks(car), controlled_peaks(car, tie_break)) if plausible(car) else _IMPLAUSIBLE

    first = np.array([*start.distances, start.pitch_inertia, start.comfort_point]) / scale
    simplex = first * (1.0 + 0.03 * np.vstack([np.zeros(4), np.eye(4)]))
    found = minimize(
        cost,
        first,
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": 160, "xatol": 1e-4, "fatol": 1e-4},
    )
    return car_at(found.x)


def stored() -> tuple[CarRow, ...]:
    """The survey as it was computed last; `tests/studies/car_search.py` computes it anew."""
    with as_file(files("pzd.paper").joinpath("cars.csv")) as path:
        return read_rows(path, CarRow, Control())


def closest(rows: Iterable[CarRow], tie_break: TieBreak | None = None) -> CarRow:
    """The row whose worst peak is closest to the paper's, of one tie-break or of all."""
    return min((row for row in rows if tie_break in (None, row.tie_break)), key=lambda row: row.miss)
