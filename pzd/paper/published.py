"""The numbers that the paper prints, each with its id, and the settled loop of a damper in a sinusoidal test.

Kinds of numbers: measured, identified, simulated, stated, claimed, and inputs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.quantities import Control
from pzd.record import Array
from pzd.report.reference import SHIPPED, Expected, range_of, read_reference

SMALL_GAP, LARGE_GAP = "gap 0.15 mm", "gap 0.25 mm"
"""The two settings of the valve that the paper tested."""
PEAK, FORCE_AT_REST = "peak_force", "force_at_zero_velocity"
"""Quantities that a test of the damper gives."""
TABLES = {"Table 1": (SMALL_GAP, 22.0), "Table 2": (LARGE_GAP, 22.0), "Table 3": (LARGE_GAP, 43.0)}
"""Setting and temperature of each table of identified parameters."""


@cache
def published() -> Mapping[str, Expected]:
    """Return every published number by its id, in the order of the file.

    >>> published()["F4-0"].number
    2280.0
    """
    return {row.id: row for row in read_reference(SHIPPED["makowski2021"], Control())}


def rig_tests() -> tuple[Expected, ...]:
    """Return the measured forces of Figures 4, 5, 6, 8 and 9."""
    return tuple(row for row in published().values() if row.quantity in (PEAK, FORCE_AT_REST))


def table_damper(table: str) -> tuple[BaseRow, ...]:
    """Return the parameters of one of the paper's tables, by voltage.

    Parameters
    ----------
    table : `Table 1`, `Table 2` or `Table 3`
    """
    rows = [row for row in published().values() if row.figure_or_table == table]
    voltages = sorted({row.voltage_V or 0.0 for row in rows})
    by = {(row.voltage_V or 0.0, row.quantity): row.number for row in rows}
    return tuple(BaseRow(voltage_V=u, T0_N=by[u, "T0"], C_Ns_per_m=by[u, "C"], k_N_per_m=by[u, "k"]) for u in voltages)


def peak_speed(row: Expected) -> float:
    """Return the largest speed of a sinusoidal test [m/s].

    Raises
    ------
    ValueError : when the row is no test of the damper
    """
    frequency, amplitude = _sine_of(row)
    return 2.0 * math.pi * frequency * amplitude


def _sine_of(row: Expected) -> tuple[float, float]:
    if row.frequency_Hz is None or row.amplitude_m is None:
        raise ValueError(f"{row.id} is no test of the damper")
    return row.frequency_Hz, row.amplitude_m


def span(row: Expected) -> tuple[float, float]:
    """Return the smallest and the largest number that the paper prints for the test of this row."""
    return range_of(row, rig_tests())


# --- The settled loop of a damper in a sinusoidal test, exact and free of noise ---


SAMPLES = 2000
"""In a cycle, unless asked for otherwise; a multiple of 4."""
_CYCLES = 2
"""The second is settled: the start decays with C / k, some 20 ms, a small part of one cycle."""


@dataclass(frozen=True, eq=False)
class Loop:
    """One closed cycle: the last sample is the first of the next one; every array is (n,)."""

    displacement: Array
    velocity: Array
    force: Array
    time: Array

    @property
    def peak(self) -> float:
        """Largest |F| [N]."""
        return float(np.max(np.abs(self.force)))

    @property
    def force_at_rest(self) -> float:
        """Mean |F| of both branches at v = 0 [N], where the cycle is one of `loop_of`."""
        quarter = self.force.size // 4
        return float(0.5 * (abs(self.force[quarter]) + abs(self.force[3 * quarter])))


def loop_of(
    damper: Damper,
    frequency: float,
    amplitude: float,
    voltage: float | None = None,
    temperature: float | None = None,
    samples: int = SAMPLES,
) -> Loop:
    """Compute the settled loop of a damper under x = A sin(2 pi f t).

    Parameters
    ----------
    damper : the damper
    frequency : f [Hz]
    amplitude : A [m]
    voltage : constant [V]; None where the damper has none
    temperature : constant [degC]; None where the damper has none
    samples : in a cycle, a multiple of 4

    Returns
    -------
    the loop, of samples + 1 points, the time counted from its first
    """
    rate = 2.0 * math.pi * frequency
    time = np.arange(_CYCLES * samples + 1) / (samples * frequency)
    phase = rate * time
    constant = [None if value is None else np.full(time.size, value) for value in (voltage, temperature)]
    x, v = amplitude * np.sin(phase), amplitude * rate * np.cos(phase)
    force = respond(damper, Motion(time, x, v, -rate * rate * x, *constant))
    last = slice((_CYCLES - 1) * samples, None)
    return Loop(x[last], v[last], force[last], time[: samples + 1])


def loop_in(damper: Damper, row: Expected) -> Loop:
    """Compute the settled loop of a damper in the test of a published row.

    Raises
    ------
    ValueError : when the row is no test of the damper
    """
    return loop_of(damper, *_sine_of(row), row.voltage_V, row.temperature_degC)
