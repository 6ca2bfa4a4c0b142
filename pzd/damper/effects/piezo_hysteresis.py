"""Hysteresis of the piezo stack: it follows a reversal of the voltage only after 2 r.

Law: play (backlash) operator of half-width r on U. Range: stacks show 10-15 % of stroke,
so r up to about 10 V on 150 V.
"""

from __future__ import annotations

from pzd.damper.effect import Effect, Parameter, Search, growing

_SEARCH = Search(lambda s: s.voltage, (0.03, 0.1))

EFFECT = Effect(
    name="piezo_hysteresis",
    place="drive",
    law="Ue = max(U - r, min(U + r, Ue))",
    parameters=(
        Parameter(
            "r", "V", 0.0, 0.0, 1.0e4, "half-width of the play; V stands for the unit of the control signal", _SEARCH
        ),
    ),
    source="Prandtl-Ishlinskii play operator; Brokate and Sprekels 1996, Hysteresis and Phase Transitions",
    tests=(
        ({"effective": 0.0, "now": 30.0, "r": 10.0}, 20.0),
        ({"effective": 20.0, "now": 15.0, "r": 10.0}, 20.0),
        ({"effective": 20.0, "now": 5.0, "r": 10.0}, 15.0),
    ),
    needs="voltage",
    order=1,  # the stack follows what valve and supply have delayed
    hidden=growing("r", lambda s: 0.15 * s.voltage),
)


def law(effective: float, now: float, r: float) -> float:
    """Effective voltage [V] when the voltage arrives at `now` [V]."""
    return max(now - r, min(now + r, effective))


def rate(effective: float, now: float, rate: float, r: float) -> float:
    """Rate of the effective voltage [V/s] at a voltage `now` [V] that changes at `rate` [V/s]."""
    inside_play = abs(now - effective) < r * (1.0 - 1e-9)  # rounding of the law itself is no play
    return 0.0 if inside_play or (now - effective) * rate < 0.0 else rate
