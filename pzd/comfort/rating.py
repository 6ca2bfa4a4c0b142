"""A measured vibration rated by ISO 2631-1:1997: weightings by position and axis, measures, health, motion sickness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pzd.comfort import directive
from pzd.comfort.iso2631_1997 import HEALTH_ZONES, Evaluation, evaluate
from pzd.comfort.weighting import WC, WD, WE, WF, WJ, WK, Weighting, weighted_record
from pzd.quantities import GRAVITY
from pzd.record import Array
from pzd.schema.errors import ConfigError
from pzd.schema.model import nearest
from pzd.signals.measures import rms

UNITS = {"m/s2": 1.0, "g": GRAVITY, "rad/s2": 1.0}
"""Units of a record, each in SI."""
FEWEST = 2
"""Samples of a record."""
SLOWEST_HZ = 4.0 * WK.f4
"""Rate below which the vertical weighting would miss its own most sensitive band, up to 12.5 Hz and beyond."""
WHOLE_HZ = 200.0
"""Rate from which all bands of Wk and Wd up to 80 Hz are in a record."""


@dataclass(frozen=True)
class Direction:
    """Weighting and factors of one axis at one position."""

    weighting: Weighting
    comfort: float
    """k of the vibration total value in an assessment of comfort; m/rad for a rotation."""
    health: float | None = None
    """k in an assessment of health, for a seated person at the seat alone."""


POSITIONS: dict[str, dict[str, Direction]] = {
    "seat": {
        "x": Direction(WD, 1.0, 1.4),
        "y": Direction(WD, 1.0, 1.4),
        "z": Direction(WK, 1.0, 1.0),
        "rx": Direction(WE, 0.63),
        "ry": Direction(WE, 0.4),
        "rz": Direction(WE, 0.2),
    },
    "back": {"x": Direction(WC, 0.8), "y": Direction(WD, 0.5), "z": Direction(WD, 0.4)},
    "feet": {"x": Direction(WK, 0.25), "y": Direction(WK, 0.25), "z": Direction(WK, 0.4)},
    "standing": {"x": Direction(WD, 1.0), "y": Direction(WD, 1.0), "z": Direction(WK, 1.0)},
    "lying": {"x": Direction(WK, 1.0), "y": Direction(WD, 1.0), "z": Direction(WD, 1.0)},
    "head": {"x": Direction(WJ, 1.0)},
}
"""Where it is measured: the supporting surface of a seat, the backrest, the floor at the feet of a seated person, the
floor of one who stands, the surface under the pelvis of one who lies (x vertical), or under the head.
Source: ISO 2631-1:1997, 7.2.3, 8.2.2 and Tables 1 and 2."""


@dataclass(frozen=True, eq=False)
class AxisRating:
    """One axis."""

    axis: str
    direction: Direction
    measures: Evaluation
    weighted: Array
    """(n,) weighted acceleration [m/s2]."""


@dataclass(frozen=True)
class Health:
    """Daily exposure of the axis with the largest 1.4 a_wx, 1.4 a_wy, a_wz, and the dose of that with the largest."""

    hours: float
    """Of exposure per day."""
    a8: float
    """A(8) [m/s2]."""
    vdv: float
    """Dose of a day [m/s^1.75]."""

    @property
    def by_directive(self) -> tuple[str, str]:
        """Where A(8) and the dose lie relative to the action and limit values of Directive 2002/44/EC."""
        return (
            directive.zone(self.a8, directive.ACTION, directive.LIMIT),
            directive.zone(self.vdv, directive.ACTION_VDV, directive.LIMIT_VDV),
        )

    @property
    def zones(self) -> dict[str, str]:
        """Where A(8) lies relative to the health guidance caution zone, for each reading of its limits."""
        return {
            name: "below" if self.a8 < low else "within" if self.a8 <= high else "above"
            for name, (low, high) in HEALTH_ZONES.items()
        }


@dataclass(frozen=True, eq=False)
class Rating:
    """One measured vibration rated."""

    position: str
    axes: tuple[AxisRating, ...]
    rate: float
    """Sampling rate [Hz]."""
    duration: float
    """[s]"""
    hours: float
    """Of exposure per day."""
    msdv: float | None
    """Motion sickness dose value by Wf of the vertical axis of a seated or standing person [m/s^1.5]."""
    notes: tuple[str, ...]
    """What the record cannot show."""

    @property
    def a_v(self) -> float:
        """Vibration total value.

        Equation: a_v = sqrt(sum k^2 a_w^2), k for comfort         Source: ISO 2631-1:1997, eq. (10)
        """
        return float(np.sqrt(sum((one.direction.comfort * one.measures.a_w) ** 2 for one in self.axes)))

    @property
    def health(self) -> Health | None:
        """Daily exposure; None where no axis is assessed for health."""
        found = [(one.direction.health, one.measures) for one in self.axes if one.direction.health is not None]
        if not found:
            return None
        a8 = max(k * directive.daily_exposure(one.a_w, self.hours) for k, one in found)
        vdv = max(k * directive.daily_dose(one.vdv, self.duration, self.hours) for k, one in found)
        return Health(self.hours, a8, vdv)


def rated(
    acceleration: Array, rate: float, axes: Sequence[str] = ("z",), position: str = "seat", hours: float = 8.0
) -> Rating:
    """Rate a measured vibration; a constant part of it, such as gravity, does not count.

    Parameters
    ----------
    acceleration : (n, m) a column an axis [m/s2], of a rotation [rad/s2]
    rate : sampling rate [Hz]
    axes : m of those of the position
    position : where it was measured
    hours : of exposure per day

    Raises
    ------
    ConfigError : when there is no such position or axis, or the record is too short or too slow for a rating
    """
    if position not in POSITIONS:
        raise ConfigError(f"position: {_one_of(position, POSITIONS)}")
    known = POSITIONS[position]
    for axis in axes:
        if axis not in known:
            raise ConfigError(f"axis: at the {position} {_one_of(axis, known)}")
    if len(set(axes)) < len(axes):
        raise ConfigError(f"axis: one is named twice (got {', '.join(axes)})")
    if not rate >= SLOWEST_HZ:
        raise ConfigError(f"rate: a rating needs {SLOWEST_HZ:g} samples a second at least (got {rate:g} Hz)")
    if not 0.0 < hours <= 24.0:
        raise ConfigError(f"hours: must be above 0 and 24 at most (got {hours:g})")
    if acceleration.shape[0] < FEWEST:
        raise ConfigError(f"acceleration: a rating needs {FEWEST} samples at least (got {acceleration.shape[0]})")
    found = []
    for axis, values in zip(axes, acceleration.T, strict=True):
        history = weighted_record(np.ascontiguousarray(values), rate, known[axis].weighting)
        found.append(AxisRating(axis, known[axis], evaluate(history, rate), history))
    duration = acceleration.shape[0] / rate
    vertical = [values for axis, values in zip(axes, acceleration.T, strict=True) if axis == "z"]
    sick = None
    if vertical and position in ("seat", "standing"):
        sick = motion_sickness_dose(weighted_record(np.ascontiguousarray(vertical[0]), rate, WF), rate)
    notes = [*_notes(rate, duration, sick is not None), *(note for values in vertical for note in _in_g(values))]
    return Rating(position, tuple(found), rate, duration, hours, sick, tuple(notes))


def motion_sickness_dose(weighted: Array, rate: float) -> float:
    """Compute the motion sickness dose value.

    Equation: MSDVz = sqrt(int a_w^2 dt)                       Source: ISO 2631-1:1997, Annex D

    Parameters
    ----------
    weighted : (n,) acceleration weighted by Wf [m/s2]
    rate : sampling rate [Hz]

    Returns
    -------
    [m/s^1.5]
    """
    return rms(weighted) * float(np.sqrt(weighted.size / rate))


def _one_of(given: str, known: dict[str, Direction] | dict[str, dict[str, Direction]]) -> str:
    near = nearest(given, known)
    return f"must be one of {', '.join(known)}" + (f"; did you mean {near}?" if near else "") + f" (got {given})"


def _notes(rate: float, duration: float, with_sickness: bool) -> list[str]:
    found = []
    if rate < WHOLE_HZ:
        found.append(f"sampled at {rate:g} Hz: what is faster than {0.5 * rate:g} Hz is not in the record")
    if duration < 1.0:
        found.append("shorter than 1 s: MTVV is the r.m.s. of the whole")
    if with_sickness and duration < 1.0 / WF.f1:
        found.append(f"shorter than {1.0 / WF.f1:g} s: the motion sickness dose has not seen one swing of 0.1 Hz")
    return found


ONE_G = 0.05
"""By how much the mean of a vertical acceleration may differ from 1 and be gravity in g: a sensor that leans by 18
degrees reads as much less."""


def _in_g(vertical: Array) -> list[str]:
    """Say where a vertical acceleration looks like one in g: its mean is that of gravity."""
    mean = float(np.mean(vertical))
    if abs(abs(mean) - 1.0) > ONE_G or np.std(vertical) > 1.0:
        return []
    return [f"its mean is {mean:.3g} m/s2: in g that would be gravity; is the unit g?"]


def same_in(unit: str, acceleration: Array) -> Array:
    """Return an acceleration in SI.

    Raises
    ------
    ConfigError : when the unit is none of an acceleration
    """
    if unit not in UNITS:
        raise ConfigError(f"unit: must be one of {', '.join(UNITS)} (got {unit})")
    return acceleration * UNITS[unit]


def rows_of(rating: Rating) -> list[dict[str, object]]:
    """Return a row of plain numbers for each axis, under the names of the measures."""
    return [
        {
            "position": rating.position,
            "axis": one.axis,
            "weighting": one.direction.weighting.name,
            "k": one.direction.comfort,
            "a_w": one.measures.a_w,
            "mtvv": one.measures.mtvv,
            "vdv": one.measures.vdv,
            "crest_factor": one.measures.crest,
            "peak": one.measures.peak,
            "duration_s": rating.duration,
            "also_report": "; ".join(one.measures.beyond),
        }
        for one in rating.axes
    ]


def as_data(rating: Rating) -> dict[str, object]:
    """Return a rating as plain data, for other programs."""
    health = rating.health
    data: dict[str, object] = {
        "edition": "ISO 2631-1:1997",
        "position": rating.position,
        "rate_Hz": rating.rate,
        "duration_s": rating.duration,
    }
    for name in ("a_w", "mtvv", "vdv", "crest_factor"):
        values = {str(row["axis"]): row[name] for row in rows_of(rating)}
        data[name] = next(iter(values.values())) if len(values) == 1 else values
    data |= {"a_v": rating.a_v, "msdv": rating.msdv, "axes": rows_of(rating), "health": None}
    if health is not None:
        a8, vdv = health.by_directive
        data["health"] = {
            "hours": health.hours,
            "A8_m_per_s2": health.a8,
            "VDV_m_per_s1_75": health.vdv,
            "directive_A8": a8,
            "directive_VDV": vdv,
            "caution_zone": health.zones,
        }
    return data | {"notes": list(rating.notes)}
