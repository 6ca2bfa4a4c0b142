"""How quickly voltage and force answer a step of voltage while the damper moves at constant speed.

The paper's 9 ms is a time over the whole range, its criterion not stated; a first-order lag needs
2.3 time constants to 90 %. The force answers later than the valve: the oil spring relaxes with a
time constant of its own, C / k, 6 to 21 ms for the rows of the paper's tables.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from pzd.artefacts import Response
from pzd.damper.compose import respond, steady_force, value_of
from pzd.damper.material import base_voltages
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.record import Array
from pzd.simulate.config import SimulateConfig

SHARES = (0.63, 0.9)
"""Of the whole way."""
_BY_PLACE = ("gas_spring", "end_stop", "preload_offset")  # forces of the place, not of the speed
_STEP = 1e-4
"""Sampling interval [s]."""
_BEFORE, _AFTER = 0.5, 1.0
"""Time at speed before the step of voltage and after it [s]."""


def responses(config: SimulateConfig, damper: Damper, temperature: float | None) -> tuple[Response, ...]:
    """Response of voltage and force to a step over the whole range of voltage, up and down.

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
    passing = {name: values for name, values in damper.effects.items() if name not in _BY_PLACE}
    alone = damper.model_copy(update={"effects": passing})
    force = respond(alone, motion)[time >= 0.0]
    tau = value_of(damper, "valve_lag", "tau")
    late = [-tau * math.log(1.0 - share) for share in SHARES]
    first, last = (float(steady_force(damper, u, temperature, speed)) for u in (before, after))
    since = time[time >= 0.0]
    reached = [_when(since, (force - first) / (last - first), share) for share in SHARES]
    answers: list[tuple[Literal["voltage", "force"], list[float | None]]] = [("voltage", [*late]), ("force", reached)]
    return [
        Response(
            signal=signal,
            from_voltage_V=before,
            to_voltage_V=after,
            velocity_m_per_s=speed,
            to_63_percent_s=times[0],
            to_90_percent_s=times[1],
        )
        for signal, times in answers
    ]


def _when(time: Array, progress: Array, share: float) -> float | None:
    """When a signal last comes up to a share of its way; None where it does not stay there."""
    short = np.flatnonzero(progress < share)
    if short.size == 0:
        return 0.0
    last = int(short[-1])
    if last + 1 >= time.size:
        return None
    way = (share - progress[last]) / (progress[last + 1] - progress[last])
    return float(time[last] + way * (time[last + 1] - time[last]))
