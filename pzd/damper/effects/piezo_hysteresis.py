"""The piezo stack follows the voltage with play: it turns only after 2 r of reversal.

Law: play (backlash) operator of half-width r on U. Range: stacks show 10-15 % of stroke,
so r up to about 10 V on 150 V.
"""

from __future__ import annotations

from pzd.damper.effect import Effect, Parameter, Search

EFFECT = Effect(
    name="piezo_hysteresis",
    place="drive",
    law="Ue = max(U - r, min(U + r, Ue))",
    parameters=(
        Parameter(
            "r",
            "V",
            0.0,
            0.0,
            1.0e4,
            "half-width of the play, in the unit of the control signal",
            Search(lambda s: s.voltage, (0.03, 0.1)),
        ),
    ),
    source="Prandtl-Ishlinskii play operator; Brokate and Sprekels 1996, Hysteresis and Phase Transitions",
    tests=(
        ({"effective": 0.0, "now": 30.0, "r": 10.0}, 20.0),
        ({"effective": 20.0, "now": 15.0, "r": 10.0}, 20.0),
        ({"effective": 20.0, "now": 5.0, "r": 10.0}, 15.0),
    ),
    needs="voltage",
)


def law(effective: float, now: float, r: float) -> float:
    """Voltage felt [V] when the voltage arrives at `now` [V]."""
    return max(now - r, min(now + r, effective))
