"""Laws that switch each damper between its hardest and its softest state."""

from __future__ import annotations

import math

from pzd.compiled import inlined


@inlined
def is_hard(rate: float, signal: float, acceleration: float, crossover: float) -> bool:
    """Whether a switched damper is to be hard.

    Equation: hard where p V > 0, else soft; p = s where |a| <= w_c |s|, else p = a
    Source: Savaresi and Spelta 2007, J. Dyn. Sys. Meas. Control 129(4), with s = dz_i/dt: a damper that pulls the body
    against its motion (p V > 0) is hard. w_c = 0 leaves the acceleration alone, w_c without bound the signal

    Parameters
    ----------
    rate : V_i, speed of the suspension [m/s]
    signal : s that a policy makes of what it senses; its unit goes with that of w_c
    acceleration : a = d2z_i/dt2 of the body above the axle [m/s2]
    crossover : w_c [rad/s]
    """
    decides = acceleration if abs(acceleration) > crossover * abs(signal) else signal
    return decides * rate > 0.0


@inlined
def switched_force(hard: bool, rate: float, low: float, high: float) -> float:
    """The end of the box Omega(V) that is a hard or a soft damper at a speed [N]; the sign bit of 0 picks the side."""
    return high if hard == (math.copysign(1.0, rate) > 0.0) else low
