"""The step response of the damper: voltage and force after a step of voltage at constant speed.

The paper's 9 ms is a time over the whole range, its criterion not stated; a first-order lag needs
2.3 time constants to 90 %. The force answers later than the valve: the oil stiffness relaxes with a
time constant of its own, C / k, 6 to 21 ms for the rows of the paper's tables.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from pzd.artefacts import Response
from pzd.artefacts.identified import RISE_SHARES
from pzd.damper.compiled.columns import value_of
from pzd.damper.compiled.kernels import parallel_forces
from pzd.damper.compose import respond, steady_force, voltage_at_valve
from pzd.damper.confounders import known
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import base_voltages, parallel_rows
from pzd.record import Array
from pzd.simulate.config import SimulateConfig

_NOTED = 0.05
"""Share of a step from which on it is worth a word."""
_STEP = 1e-4
"""Sampling interval [s]."""
_BEFORE, _AFTER = 0.5, 1.0
"""Time at speed before the step of voltage and after it [s]."""


def responses(config: SimulateConfig, damper: Damper, temperature: float | None) -> tuple[Response, ...]:
    """Compute the response of voltage and force to a step over the whole range of voltage, up and down.

    Parameters
    ----------
    config : valve, and the speed at which it is computed
    damper : with its effects
    temperature : [degC]

    Returns
    -------
    two rows a step; nothing where the damper has one voltage only
    """
    voltages = base_voltages(damper)
    if voltages.size < 2:
        return ()
    if "valve_lag" not in damper.effects and config.valve_response_s > 0.0:
        damper = damper.with_effect("valve_lag", {"tau": config.valve_response_s})
    low, high = float(voltages[0]), float(voltages[-1])
    rows: list[Response] = []
    for before, after in ((low, high), (high, low)):
        rows += _step(damper, before, after, config.response_speed_m_per_s, temperature)
    return tuple(rows)


def _step(damper: Damper, before: float, after: float, speed: float, temperature: float | None) -> list[Response]:
    count = np.arange(-round(_BEFORE / _STEP), round(_AFTER / _STEP), dtype=np.float64)
    time: Array = _STEP * (count + 0.5)  # the ramp of one step is at 0
    voltage = np.where(time < 0.0, before, after)
    still = np.zeros_like(time)
    warmth = None if temperature is None else np.full_like(time, temperature)
    motion = Motion(time, speed * time, still + speed, still, voltage, warmth)
    ends = motion.displacement[[0, -1]]
    passing = {name: values for name, values in damper.effects.items() if not _stands_at_rest(damper, name, ends)}
    alone = damper.model_copy(update={"effects": passing})
    force = respond(alone, motion)[time >= 0.0]
    late = _voltage_reached(damper, motion)
    first, last = (float(steady_force(damper, u, temperature, speed)) for u in (before, after))
    since = time[time >= 0.0]
    reached = [_when(since, (force - first) / (last - first), share) for share in RISE_SHARES]
    answers: list[tuple[Literal["voltage", "force"], list[float | None]]] = [("voltage", [*late]), ("force", reached)]
    return [
        Response(
            signal=signal,
            from_voltage_V=before,
            to_voltage_V=after,
            velocity_m_per_s=speed,
            to_63_percent_s=times[0],
            to_90_percent_s=times[1],
            note=_carried(damper, before, after, (first, last)) if signal == "force" else "",
        )
        for signal, times in answers
    ]


def _carried(damper: Damper, before: float, after: float, forces: tuple[float, float]) -> str:
    """Describe the share of the step that the oil stiffness carries at once, if it is worth a word.

    Equation: F = k(U) (x - y): the step of k alone moves F by F_1 (k_2 / k_1 - 1), before the oil flows

    Parameters
    ----------
    damper : with its effects
    before, after : voltages [V]
    forces : at steady slip before and after [N]
    """
    rows = {row.voltage_V: row.k_N_per_m for row in damper.base}
    share = forces[0] * (rows[after] / rows[before] - 1.0) / (forces[1] - forces[0])
    if share < _NOTED:
        return ""
    return (
        f"{100.0 * min(share, 1.0):.0f} % of the step comes before the oil has flowed: k goes with the valve from "
        f"{rows[before] / 1e3:.3g} to {rows[after] / 1e3:.3g} kN/m, and a loaded oil spring changes its force at once"
    )


def _stands_at_rest(damper: Damper, name: str, places: Array) -> bool:
    """Tell whether an effect is a force that is there at rest too, at one of (n,) displacements [m]."""
    if known()[name].place != "parallel":
        return False
    alone = parallel_rows(damper.model_copy(update={"effects": {name: damper.effects[name]}}), base_voltages(damper))
    rest = np.zeros(places.size)
    return alone is not None and any(np.any(parallel_forces(places, rest, rest, row[np.newaxis])) for row in alone)


def _voltage_reached(damper: Damper, motion: Motion) -> list[float | None]:
    """Return when the effective voltage has gone each share of its way [s]; in closed form for a lag alone."""
    drive = {name for name in damper.effects if known()[name].place == "drive"}
    if drive <= {"valve_lag"}:
        tau = value_of(damper, "valve_lag", "tau")
        return [-tau * math.log(1.0 - share) for share in RISE_SHARES]
    effective = voltage_at_valve(damper, motion.voltage, np.array([_STEP]))
    if effective is None or effective[0] == effective[-1]:
        return [None for _ in RISE_SHARES]
    progress = (effective - effective[0]) / (effective[-1] - effective[0])
    return [_when(motion.time[motion.time >= 0.0], progress[motion.time >= 0.0], share) for share in RISE_SHARES]


def _when(time: Array, progress: Array, share: float) -> float | None:
    """Return when a signal last comes up to a share of its way; None where it does not stay there."""
    short = np.flatnonzero(progress < share)
    if short.size == 0:
        return 0.0
    last = int(short[-1])
    if last + 1 >= time.size:
        return None
    way = (share - progress[last]) / (progress[last + 1] - progress[last])
    return float(time[last] + way * (time[last + 1] - time[last]))
