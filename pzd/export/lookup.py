"""The path of the element over one fixed step as a table, for targets whose time is bounded.

What takes a varying number of pieces, the path of the oil spring between stick, slip and relief, becomes a look-up: its
elastic deflection a step later over the deflection and the extension speed, at each of a row of control signals and at
the temperatures of the table of force. What is beside the element, and the drive, are closed forms and stay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from pzd.damper.compiled.kernels import T0, C, K, interpolate, row_of
from pzd.damper.compose import TOLERANCE
from pzd.damper.flow import flow_force
from pzd.damper.parameter_rows import element_rows
from pzd.damper.path import NO_VARIABLES, advance, deflections, march, off_the_limits, sensitivities_to
from pzd.damper.regimes import TimeStep, spring_force
from pzd.export.content import Content
from pzd.export.dynamics import Dynamics, array, head, real
from pzd.record import Array

STEP = 1e-3
"""The fixed step [s]."""
DEFLECTIONS, SPEEDS = 97, 49
"""Nodes of the table over each."""
PARTS = 8
"""Parts into which the table cuts each interval between the control signals of the damper."""
_ROOM = 1.1  # of the largest steady force: what the path reaches beyond it under a falling speed
_TRIALS, _MOTIONS = 2000, 40  # steps of each motion by which the error is measured, and the least number of them


@dataclass(frozen=True, eq=False)
class LookupPath:
    """The table, and how far it is from the march."""

    temperatures: Array
    """(t,) rising [degC]."""
    signals: Array
    """(m,) rising, the effective control signal."""
    most: Array
    """(t, m) largest deflection of the table [m], from the negative of which it begins."""
    speed: float
    """Largest extension speed of the table [m/s]."""
    after: Array
    """(t, m, `DEFLECTIONS`, `SPEEDS`) deflection a step later, as a share of `most`, over that before."""
    rows: Array
    """(t, m, r) rows of the element."""
    error_N: float
    """Largest difference of the force to the march over the region."""
    peak_N: float
    """Largest force there."""


def lookup_path(content: Content) -> LookupPath:
    """Compute the table, and its largest error within the speeds, control signals and temperatures that it covers.

    Parameters
    ----------
    content : the damper
    """
    damper, dynamics = content.damper, Dynamics.of(content.damper)
    temperatures = np.array([t for t in content.temperatures if t is not None] or [dynamics.reference])
    signals = dynamics.signals
    if signals.size > 1:
        signals = np.interp(np.arange(PARTS * (signals.size - 1) + 1) / PARTS, np.arange(signals.size), signals)
    at_temperatures = [element_rows(damper, signals, float(T)) for T in temperatures]
    rows = np.stack([np.broadcast_to(row, (signals.size, row.shape[1])) for row in at_temperatures])
    speed = float(content.grid.velocities[-1])
    most, after = np.empty(rows.shape[:2]), np.empty((*rows.shape[:2], DEFLECTIONS, SPEEDS))
    for place in np.ndindex(rows.shape[:2]):
        most[place], after[place] = _at_node(rows[place][np.newaxis], speed)
    found = LookupPath(temperatures, signals, most, speed, after, rows, 0.0, 0.0)
    return _measured(found)


def _at_node(row: Array, speed: float) -> tuple[float, Array]:
    """Return the largest deflection [m], and the (`DEFLECTIONS`, `SPEEDS`) shares of it a step later."""
    limit = max(flow_force(speed, row_of(row[0]), side) for side in (1.0, -1.0))
    most = float(np.max(np.abs(deflections(_ROOM * limit * np.array([1.0, -1.0]), row))))
    own = _of_the_path(row)
    nothing, p = sensitivities_to(NO_VARIABLES, own), row_of(own[0])
    after = np.empty((DEFLECTIONS, SPEEDS))
    for i, e in enumerate(np.linspace(-most, most, DEFLECTIONS)):
        for j, u in enumerate(np.linspace(-speed, speed, SPEEDS)):
            state = np.array([e, 0.0])
            advance(state, TimeStep(STEP, u, u, p, p, False), TOLERANCE, nothing, 0)
            after[i, j] = state[0]
    return most, after / most


def _of_the_path(row: Array) -> Array:
    """Return the (1, r) row off the limits of the element, as the path has it."""
    moved = row.copy()
    moved[:, C], moved[:, K] = off_the_limits(row[:, T0], row[:, C], row[:, K])
    return moved


def _measured(found: LookupPath) -> LookupPath:
    """Return the table with its largest error: at every node and midway between, along motions of many frequencies."""
    draw = np.random.default_rng(0)
    error, peak = 0.0, 0.0
    places = list(product(range(found.temperatures.size), np.arange(0.0, found.signals.size - 0.5, 0.5).tolist()))
    for t, place in places * -(-_MOTIONS // len(places)):
        s = min(int(place), max(found.signals.size - 2, 0))
        low, high = found.rows[t, s], found.rows[t, min(s + 1, found.signals.size - 1)]
        p = interpolate(row_of(low), row_of(high), place - s)
        speed = _speeds(draw, found.speed)
        x = np.concatenate([[0.0], np.cumsum(speed) * STEP])
        row = _of_the_path(np.array([p]))
        ours = march(x, np.zeros(1), np.array([STEP]), row, 0.0, TOLERANCE)[1:]
        p, e = row_of(row[0]), 0.0
        for u, force in zip(speed.tolist(), ours.tolist(), strict=True):
            e = _looked_up(found, e, u, t, s, place - s)
            error = max(error, abs(spring_force(e, p) - force))
        peak = max(peak, float(np.max(np.abs(ours))))
    return replace(found, error_N=error, peak_N=peak)


def _speeds(draw: np.random.Generator, largest: float) -> Array:
    """Return the (`_TRIALS`,) extension speed of a motion [m/s]."""
    time = STEP * np.arange(_TRIALS)
    frequencies, shifts = np.exp(draw.uniform(np.log(0.3), np.log(20.0), 4)), draw.uniform(0.0, 2.0 * np.pi, 4)
    speed = np.sum(np.sin(2.0 * np.pi * np.outer(frequencies, time) + shifts[:, np.newaxis]), axis=0)
    return np.asarray(speed * largest / np.max(np.abs(speed)))


def _looked_up(found: LookupPath, e: float, u: float, t: int, s: int, share: float) -> float:
    """Return the deflection a step later [m], as `looked_up` of `sources/element.c` does."""
    above = min(s + 1, found.signals.size - 1)
    most = found.most[t, s] + share * (found.most[t, above] - found.most[t, s])
    rise = min(max((e + most) / (2.0 * most), 0.0), 1.0) * (DEFLECTIONS - 1)
    fast = min(max((u + found.speed) / (2.0 * found.speed), 0.0), 1.0) * (SPEEDS - 1)
    i, j = min(int(rise), DEFLECTIONS - 2), min(int(fast), SPEEDS - 2)
    a, b = rise - i, fast - j
    at_nodes = []
    for table in (found.after[t, s], found.after[t, above]):
        low = table[i, j] + a * (table[i + 1, j] - table[i, j])
        high = table[i, j + 1] + a * (table[i + 1, j + 1] - table[i, j + 1])
        at_nodes.append(float(low + b * (high - low)))
    return float(most * (at_nodes[0] + share * (at_nodes[1] - at_nodes[0])))


def lookup_data(content: Content, found: LookupPath) -> str:
    """Write the table as constants, its largest error in the comment before them.

    Parameters
    ----------
    content : the damper
    found : its table
    """
    low, high = found.signals[0], found.signals[-1]
    warm = f"{found.temperatures[0]:g} to {found.temperatures[-1]:g} degC"
    sizes = {
        "LOOKUP_TEMPERATURES": found.temperatures.size,
        "LOOKUP_SIGNALS": found.signals.size,
        "LOOKUP_DEFLECTIONS": DEFLECTIONS,
        "LOOKUP_SPEEDS": SPEEDS,
    }
    return "".join(
        (
            head(content),
            "/* The path over one step of LOOKUP_STEP, held beyond the table. Largest error of the force, for held\n",
            f" * control signals of {low:g} to {high:g}, {warm} and speeds up to {found.speed:g} m/s:\n",
            f" * {found.error_N:.3g} N of {found.peak_N:.4g} N. */\n",
            '#ifndef LOOKUP_DATA_H\n#define LOOKUP_DATA_H\n#include "real.h"\n',
            *(f"#define {name} {size}\n" for name, size in sizes.items()),
            f"#define LOOKUP_STEP {real(STEP)}\n#define LOOKUP_SPEED {real(found.speed)}\n",
            array("real", "LOOKUP_AT_TEMPERATURE", found.temperatures, real),
            array("real", "LOOKUP_AT_SIGNAL", found.signals, real),
            array("real", "LOOKUP_MOST", found.most, real),
            array("real", "LOOKUP_AFTER", found.after, lambda value: f"R({value:.9g})".replace("R(0)", "R(0.0)")),
            "#endif\n",
        )
    )
