"""The cars that section 5 of the paper may have ridden: it leaves a1, a2, J_y and x_K out.

A plausible car has a wheelbase of 2.2 to 3.6 m, its centre of gravity 30 to 70 % behind axle 1,
J_y / (m a1 a2) of 0.7 to 1.3 and K between the axles. The two peaks with constant c of Figure 19 leave a
surface of such cars, over which the two controlled peaks vary widely. Nor does equation (12) say
which of many minimisers is taken, so each of the three tie-breaks has its own closest car.

The rides are those of `pzd.simulate`, some 0.1 s a car and tie-break. The peaks in cars.csv were found with fixed steps
of 1 ms. The rides agree with them to 1e-4 in the median and 3 % at most: where the control jumps from one end of its
range to the other, a peak is not defined more closely.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Literal

import numpy as np

from pzd.artefacts import Diagnosed, Table
from pzd.artefacts.table import ForceRow, TableNotes
from pzd.damper.model import BaseRow, Damper
from pzd.paper.published import published
from pzd.quantities import Control
from pzd.record import Array
from pzd.schema.csvfile import read_rows
from pzd.schema.model import Frozen
from pzd.simulate.config import KM_PER_H, CarBlock, SimulateConfig
from pzd.simulate.policies import TieBreak
from pzd.simulate.ride.energy import harmonic_response
from pzd.simulate.roads.sine import Sine
from pzd.simulate.vehicle.car import HalfCar

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
    """One car under one tie-break; a and b are 2.25 and 4.5 Hz, low and high the ends when a parameter moves by 1 %."""

    a1_m: float
    a2_m: float
    pitch_inertia_kgm2: float
    x_K_m: float
    tie_break: TieBreak
    found: Found
    """Whether it is of the grid of the survey or was refined from there."""
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
    def controlled_low(self) -> Pair:
        """Least of them when a parameter moves by 1 % [m/s2]."""
        return self.controlled_a_low_m_per_s2, self.controlled_b_low_m_per_s2

    @property
    def controlled_high(self) -> Pair:
        """Largest of them when a parameter moves by 1 % [m/s2]."""
        return self.controlled_a_high_m_per_s2, self.controlled_b_high_m_per_s2

    @property
    def deviation(self) -> float:
        """Deviation of the worst of all four peaks from the paper's, as a share of it."""
        return largest_deviation(self.constant, self.controlled)


def half_car(a1: float, a2: float, inertia: float, comfort_point: float) -> HalfCar:
    """Return the paper's body on its springs, with what the paper leaves out: a1, a2 [m], J_y [kg m2], x_K [m]."""
    return HalfCar("plausible", MASS, inertia, (a1, a2), (STIFFNESS, STIFFNESS), comfort_point)


def plausible(car: HalfCar) -> bool:
    """Return whether the proportions are those of a car and K lies between its axles."""
    a1, a2 = car.distances
    shares = (a1 / car.wheelbase, car.pitch_inertia / (car.mass * a1 * a2), car.wheelbase)
    ranges = (SHARES, INERTIAS, WHEELBASES)
    inside = all(
        low * (1.0 - _ROUNDING) <= value <= high * (1.0 + _ROUNDING)
        for value, (low, high) in zip(shares, ranges, strict=True)
    )
    return inside and -a1 <= car.comfort_point <= a2


def constant_peaks(car: HalfCar, damping: float = DAMPING) -> Pair:
    """Compute the largest |a_K| with constant damping at 2.25 and 4.5 Hz, exactly [m/s2].

    >>> car = half_car(1.962, 1.068, 2216.0, -0.856)
    >>> [round(float(peak), 3) for peak in constant_peaks(car)]
    [2.185, 3.626]
    """
    a, b = (abs(harmonic_response(car, damping, f, AMPLITUDE, SPEED)[1]) for f in FREQUENCIES)
    return a, b


def controlled_peaks(car: HalfCar, tie_break: TieBreak) -> Pair:
    """Ride under the paper's control at 2.25 and 4.5 Hz, forces ideal within `BOUNDS`; the largest |a_K| [m/s2].

    Equation: T_K in Arg min |a_0 + D^T T|, T_i in [c_min V_i, c_max V_i]     Source: Makowski and Knap 2021, (10)-(12)
    """
    from pzd.simulate.stage import simulate

    block = CarBlock(
        name=car.name,
        mass_kg=car.mass,
        spring_stiffness_N_per_m=car.stiffnesses,
        a1_m=car.distances[0],
        a2_m=car.distances[1],
        pitch_inertia_kgm2=car.pitch_inertia,
        x_K_m=car.comfort_point,
    )
    config = SimulateConfig(
        car=block,
        vehicle_speed_km_per_h=_PRINTED["IN-V"].number,
        roads=tuple(Sine(frequency_Hz=frequency, amplitude_m=AMPLITUDE) for frequency in FREQUENCIES),
        policies=("comfort",),
        fidelities=("ideal",),
        c_min_Ns_per_m=BOUNDS[0],
        c_max_Ns_per_m=BOUNDS[1],
        tie_break=tie_break,
        histories="none",
    )
    a, b = (row.peak_abs_aK_m_per_s2 for row in simulate(config, *_any_damper(), 0, Path()).summary)
    return a, b


@cache
def _any_damper() -> tuple[Diagnosed, Table]:
    """Return a damper and its table, which the stage asks for; ideal forces within bounds depend on neither."""
    base = tuple(BaseRow(voltage_V=u, T0_N=0.0, C_Ns_per_m=c, k_N_per_m=1e6) for u, c in enumerate(BOUNDS))
    rows = tuple(
        ForceRow(temperature_degC=None, voltage_V=u, velocity_m_per_s=v, force_N=c * v, inside=1)
        for u, c in enumerate(BOUNDS)
        for v in (-10.0, -0.0, 0.0, 10.0)
    )
    notes = TableNotes(outside="model", reached_m_per_s=10.0, lost=(), not_monotone=())
    return Diagnosed.undiagnosed(Damper(base=base)), Table(rows, (), notes)


def largest_deviation(constant: Pair, controlled: Pair) -> float:
    """Return the largest deviation of the four peaks from those of Figure 19, as a share of the paper's."""
    wanted = (*CONSTANT_PEAKS, *CONTROLLED_PEAKS)
    return max(abs(found / target - 1.0) for found, target in zip((*constant, *controlled), wanted, strict=True))


def meets_constant(peaks: Pair, tolerance: float = TOLERANCE) -> bool:
    """Return whether both peaks with constant c are the paper's within a share."""
    return all(abs(found / target - 1.0) <= tolerance for found, target in zip(peaks, CONSTANT_PEAKS, strict=True))


def candidates() -> Iterator[HalfCar]:
    """Yield the plausible cars of a grid that meet both peaks with constant c within `TOLERANCE`."""
    for wheelbase in np.arange(2.2, 3.61, 0.1):
        for share in np.arange(0.3, 0.71, 0.05):
            for ratio in np.arange(0.7, 1.31, 0.1):
                a1 = float(round(share * wheelbase, 3))
                a2 = float(round(wheelbase - a1, 3))
                car = half_car(a1, a2, float(round(ratio * MASS * a1 * a2, 1)), 0.0)
                yield from _meeting(car, np.round(np.linspace(-a1, a2, 51), 3))


def _meeting(car: HalfCar, places: Array) -> Iterator[HalfCar]:
    """Yield a car with K at those places where it does; a_K is affine in x_K, so that two places give all of them."""
    at_centre, at_metre = (
        [harmonic_response(replace(car, comfort_point=x), DAMPING, f, AMPLITUDE, SPEED)[1] for f in FREQUENCIES]
        for x in (0.0, 1.0)
    )
    peaks = [np.abs(centre + places * (metre - centre)) for centre, metre in zip(at_centre, at_metre, strict=True)]
    for x, a, b in zip(places, *peaks, strict=True):
        found = replace(car, comfort_point=float(x))
        if meets_constant((float(a), float(b))) and plausible(found):
            yield found


def neighbours(car: HalfCar, share: float = 0.01) -> Iterator[HalfCar]:
    """Yield the car with each of a1, a2, J_y and x_K moved by a share, down and up."""
    a1, a2 = car.distances
    for factor in (1.0 - share, 1.0 + share):
        yield replace(car, distances=(a1 * factor, a2))
        yield replace(car, distances=(a1, a2 * factor))
        yield replace(car, pitch_inertia=car.pitch_inertia * factor)
        yield replace(car, comfort_point=car.comfort_point * factor)


def row_of(car: HalfCar, tie_break: TieBreak, found: Found = "survey") -> CarRow:
    """Ride one car under one tie-break, as it is and with each parameter moved by 1 %."""
    constant, controlled = constant_peaks(car), controlled_peaks(car, tie_break)
    spread = np.array([controlled, *(controlled_peaks(other, tie_break) for other in neighbours(car))])
    return CarRow(
        a1_m=car.distances[0],
        a2_m=car.distances[1],
        pitch_inertia_kgm2=car.pitch_inertia,
        x_K_m=car.comfort_point,
        tie_break=tie_break,
        found=found,
        **{
            f"{name}_m_per_s2": round(float(peak), 4)
            for pair, values in (
                ("constant_{}", constant),
                ("controlled_{}", controlled),
                ("controlled_{}_low", spread.min(axis=0)),
                ("controlled_{}_high", spread.max(axis=0)),
            )
            for name, peak in zip((pair.format("a"), pair.format("b")), values, strict=True)
        },
    )


def refined(start: HalfCar, tie_break: TieBreak) -> HalfCar:
    """Search for the plausible car near another whose four peaks are closest to the paper's: half a minute.

    Source: Nelder and Mead 1965, on the largest of the four deviations

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
        if not plausible(car):
            return _IMPLAUSIBLE
        return largest_deviation(constant_peaks(car), controlled_peaks(car, tie_break))

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
    """Read the survey in cars.csv; `tests/studies/car_search.py` computes it anew."""
    with as_file(files("pzd.paper").joinpath("cars.csv")) as path:
        return read_rows(path, CarRow, Control())


def closest(rows: Iterable[CarRow], tie_break: TieBreak | None = None) -> CarRow:
    """Return the row whose worst peak is closest to the paper's, of one tie-break or of all."""
    return min((row for row in rows if tie_break in (None, row.tie_break)), key=lambda row: row.deviation)
