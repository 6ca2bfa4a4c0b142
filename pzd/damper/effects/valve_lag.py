"""First-order lag of the valve behind the voltage.

Law: tau dUe/dt + Ue = U, exact for U linear over the step. Range: piezo valves 1-10 ms,
magneto-rheological ones 5-50 ms. The 9 ms of the paper is a response time over the whole range,
not this constant (to 90 % of a first-order lag they mean tau = 3.9 ms).
"""

from __future__ import annotations

import math

from pzd.damper.effect import Effect, Parameter, Search, growing

_SEARCH = Search(lambda _: 1.0e-3, (2.0, 10.0, 40.0), logarithmic=True)

EFFECT = Effect(
    name="valve_lag",
    place="drive",
    law="tau dUe/dt + Ue = U",
    parameters=(Parameter("tau", "s", 0.0, 0.0, 0.5, "time constant of the valve and its supply", _SEARCH),),
    source="first-order lag; response times in Makowski and Knap 2021, sec. 1",
    tests=(
        ({"effective": 0.0, "before": 100.0, "now": 100.0, "step": 0.01, "tau": 0.01}, 63.21205588285577),
        ({"effective": 7.0, "before": 0.0, "now": 100.0, "step": 0.01, "tau": 0.0}, 100.0),
    ),
    needs="voltage",
    hidden=growing("tau", lambda _: 0.05),
)


def law(effective: float, before: float, now: float, step: float, tau: float) -> float:
    """Effective voltage [V] after a step [s], the voltage changing linearly from `before` to `now` [V]."""
    if tau <= 0.0:
        return now
    lag = (now - before) * tau / step if step > 0.0 else 0.0
    return now - lag + (effective - before + lag) * math.exp(-step / tau)


def rate(effective: float, now: float, rate: float, tau: float) -> float:
    """Rate of the effective voltage [V/s] at a voltage `now` [V] that changes at `rate` [V/s]."""
    return rate if tau <= 0.0 else (now - effective) / tau
