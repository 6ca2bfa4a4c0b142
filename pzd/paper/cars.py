"""The cars that section 5 of the paper may have ridden: it leaves a1, a2, J_y and x_K out.

A plausible car has a wheelbase of 2.2 to 3.6 m, its centre of gravity 30 to 70 % behind axle 1,
J_y / (m a1 a2) of 0.7 to 1.3 and K between the axles. The two peaks with constant c of Figure 19 leave a
surface of such cars, over which the two controlled peaks vary widely. Nor does equation (12) say
which of many minimisers is taken, so each of the three tie-breaks has its own closest car.

`tests/studies/car_search.py` made the survey in cars.csv.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib.resources import as_file, files
from typing import Literal

from pzd.paper.published import published
from pzd.quantities import Control
from pzd.schema.csvfile import read_rows
from pzd.schema.model import Frozen
from pzd.simulate.config import KM_PER_H
from pzd.simulate.policies import TieBreak
from pzd.simulate.ride.linear import harmonic_response
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

Pair = tuple[float, float]
"""At 2.25 and at 4.5 Hz."""
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


def constant_peaks(car: HalfCar, damping: float = DAMPING) -> Pair:
    """Compute the largest |a_K| with constant damping at 2.25 and 4.5 Hz, exactly [m/s2].

    >>> car = half_car(1.962, 1.068, 2216.0, -0.856)
    >>> [round(float(peak), 3) for peak in constant_peaks(car)]
    [2.185, 3.626]
    """
    a, b = (abs(harmonic_response(car, damping, f, AMPLITUDE, SPEED)[1]) for f in FREQUENCIES)
    return a, b


def largest_deviation(constant: Pair, controlled: Pair) -> float:
    """Return the largest deviation of the four peaks from those of Figure 19, as a share of the paper's."""
    wanted = (*CONSTANT_PEAKS, *CONTROLLED_PEAKS)
    return max(abs(found / target - 1.0) for found, target in zip((*constant, *controlled), wanted, strict=True))


def stored() -> tuple[CarRow, ...]:
    """Read the survey in cars.csv."""
    with as_file(files("pzd.paper").joinpath("cars.csv")) as path:
        return read_rows(path, CarRow, Control())


def closest(rows: Iterable[CarRow], tie_break: TieBreak | None = None) -> CarRow:
    """Return the row whose worst peak is closest to the paper's, of one tie-break or of all."""
    return min((row for row in rows if tie_break in (None, row.tie_break)), key=lambda row: row.deviation)
