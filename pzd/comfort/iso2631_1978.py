"""ISO 2631:1978 (withdrawn in 1997): how long a seated person may be exposed to vertical vibration.

The boundaries are an unverified transcription: no printed copy was available. One independent check: a 1976 report of
the Royal Aircraft Establishment puts 1.2 m/s2 at 5 Hz at 1 h (proficiency) and 3 h (exposure limit); this table gives
58 and 197 min.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Literal

import numpy as np

from pzd.comfort.spectrum import Components
from pzd.record import Array

EDITION = "ISO 2631:1978"
TRUST = "unverified transcription"

Boundary = Literal["fatigue_decreased_proficiency", "exposure_limit", "reduced_comfort"]

FACTORS: dict[Boundary, float] = {
    "reduced_comfort": 1.0 / 3.15,
    "fatigue_decreased_proficiency": 1.0,
    "exposure_limit": 2.0,
}
"""Each boundary as a multiple of the tabulated one (6 dB above, 10 dB below)."""

FLAT_TOP_MIN = 4.0
"""The chart is flat from 1 to 4 min: the 1-min column holds up to here."""

_MINUTES = {"24h": 1440.0, "16h": 960.0, "8h": 480.0, "4h": 240.0, "2.5h": 150.0, "1h": 60.0, "25min": 25.0}
_MINUTES |= {"16min": 16.0, "1min": FLAT_TOP_MIN}

NOT_COVERED = "the chart begins at 1 Hz and ends at 80 Hz"
LONGEST_MIN = _MINUTES["24h"]
_SAME = 1e-9  # share within which a value lies on a line of the chart


@dataclass(frozen=True)
class Exposure:
    """Permissible duration of a vibration."""

    minutes: float | None
    """0 over the chart, 1440 (or more) beyond it, None where the chart says nothing [min]."""
    remark: str
    """Position on the chart; empty inside of it."""
    frequency: float | None = None
    """Frequency of the governing component [Hz]."""


@dataclass(frozen=True, eq=False)
class Chart:
    """Tabulated boundary of fatigue-decreased proficiency, a_z."""

    frequency: Array
    """(n,) nominal third-octave centres [Hz]"""
    minutes: Array
    """(m,) times, falling [min]"""
    level: Array
    """(n, m) r.m.s. acceleration [m/s2]"""

    def levels_at(self, frequency: float) -> Array:
        """Interpolate the (m,) boundary [m/s2 r.m.s.] at one frequency, log-log between centres, constant beyond."""
        centres, levels = np.log(self.frequency), np.log(self.level)
        place = min(max(np.log(frequency), centres[0]), centres[-1])
        i = min(max(int(np.searchsorted(centres, place)), 1), centres.size - 1)
        share = (place - centres[i - 1]) / (centres[i] - centres[i - 1])
        return np.asarray(np.exp(levels[i - 1] + share * (levels[i] - levels[i - 1])))


@cache
def chart() -> Chart:
    """Read the boundary table of the package."""
    text = files("pzd.comfort").joinpath("iso2631_1978_az_limits.csv").read_text(encoding="utf-8")
    header, *lines = [line.split(",") for line in text.splitlines() if line]
    values = np.array(lines, dtype=np.float64)
    return Chart(values[:, 0], np.array([_MINUTES[name] for name in header[1:]]), values[:, 1:])


def exposure(acceleration: float, frequency: float, boundary: Boundary) -> Exposure:
    """Compute the time for which a tone may last before it reaches a boundary, interpolated log-log.

    Parameters
    ----------
    acceleration : r.m.s. of the tone [m/s2]
    frequency : of the tone itself, not of the band that holds it [Hz]
    boundary : which boundary

    Returns
    -------
    the time, and its position on the chart
    """
    table = chart()
    if not table.frequency[0] * (1 - _SAME) <= frequency <= table.frequency[-1] * (1 + _SAME):
        return Exposure(None, f"not covered: {NOT_COVERED}", frequency)
    minutes, remark = _time(acceleration, FACTORS[boundary] * table.levels_at(frequency), table.minutes)
    return Exposure(minutes, remark, frequency)


def _time(acceleration: float, levels: Array, times: Array) -> tuple[float, str]:
    """Find the time [min] at which the (m,) levels of a boundary [m/s2] reach an acceleration, and its position."""
    if acceleration > levels[-1] * (1.0 + _SAME):
        return 0.0, "over the chart"
    if acceleration >= levels[-1] * (1.0 - _SAME):
        return FLAT_TOP_MIN, "4 min or less"
    if acceleration < levels[0] * (1.0 - _SAME):
        return LONGEST_MIN, "beyond the chart (more than 24 h)"
    return float(np.exp(np.interp(np.log(acceleration), np.log(levels), np.log(times)))), ""


def shortest(components: Components, boundary: Boundary) -> Exposure:
    """Find the shortest time of all components, each rated by itself, as the standard does with bands.

    A component below 1 Hz or above 80 Hz has no time. It is compared as if it lay at the nearer end of the chart: where
    it would govern there, the vibration is not covered by the standard, and no time is given.
    """
    rated = [
        _rated(float(level), float(frequency), boundary)
        for frequency, level in zip(components.frequency, components.rms, strict=True)
    ]
    covered = [item for item in rated if item[2].minutes is not None]
    worst = min(rated, key=lambda item: item[:2])
    if not covered or worst[:2] < min(item[:2] for item in covered):
        return worst[2]
    return min(covered, key=lambda item: item[:2])[2]


def _rated(acceleration: float, frequency: float, boundary: Boundary) -> tuple[float, float, Exposure]:
    """Rate a component: time at the nearest frequency of the chart [min], minus its share of the lowest line."""
    table = chart()
    nearest = min(max(frequency, float(table.frequency[0])), float(table.frequency[-1]))
    levels = FACTORS[boundary] * table.levels_at(nearest)
    minutes, _ = _time(acceleration, levels, table.minutes)
    return minutes, -float(acceleration / levels[0]), exposure(acceleration, frequency, boundary)
