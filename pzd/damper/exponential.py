"""The functions and weights of an exponential Rosenbrock method of order 5, with an error of order 4.

Equation: y(t + h) = y + h phi_1(Z) r + h^2 phi_2(Z) v + h (2 a phi_3(Z) + 6 b phi_4(Z))
Source: Luan and Ostermann 2014, J. Comput. Appl. Math. 255, 417-431, method exprb53s3

Z = h J, J and v the derivatives of the rate r by y and by time. What the rate does beside r + J (y - y0) + v t is
taken as a theta^2 + b theta^3 over the step, a and b from two stages, and the end found puts a theta^4 to it; this is
exact where that is all there is, however stiff J is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pzd.compiled import compiled, inlined

STAGES = (0.5, 0.9)
"""Share of the step at which the two stages stand; 0.9 follows from 0.5 by the conditions of order 5."""
COUPLING = (27.0 / 25.0, 729.0 / 125.0)
"""What the second stage takes of what the first one shows, by phi_3 at either stage's share of Z."""
_SMALL = 1.0  # below it the series is used: the recursion loses digits like |z|^-4
_CAUTION = 2.0  # the stages, of lower order than the whole, miss about as much again
_CHANCE = 1e-3  # at a tolerance of 1e-9 the error of order 4 is about so much of that of order 3
_SERIES = 15  # terms, the last below 1e-16 of the sum


class Phi(NamedTuple):
    """phi_k(z) = integral of e^{(1 - s) z} s^{k - 1} / (k - 1)! over s from 0 to 1."""

    one: float
    two: float
    three: float
    four: float
    five: float


@compiled
def phi(z: float) -> Phi:
    """The functions phi_1 to phi_5 of an exponential integrator.

    Equation: phi_{k + 1}(z) = (phi_k(z) - 1/k!)/z, phi_1(z) = (e^z - 1)/z
    Source: Hochbruck and Ostermann 2010, Acta Numerica 19, eq. (2.10)-(2.11)
    """
    if abs(z) < _SMALL:
        five, term = 0.0, 1.0 / 120.0
        for j in range(_SERIES):
            five += term
            term *= z / (j + 6.0)
        four = z * five + 1.0 / 24.0
        three = z * four + 1.0 / 6.0
        two = z * three + 0.5
        return Phi(z * two + 1.0, two, three, four, five)
    one = math.expm1(z) / z
    two = (one - 1.0) / z
    three = (two - 0.5) / z
    four = (three - 1.0 / 6.0) / z
    return Phi(one, two, three, four, (four - 1.0 / 24.0) / z)


@inlined
def bend(first: float, second: float) -> tuple[float, float]:
    """Coefficients a and b of a theta^2 + b theta^3 through what the two stages show beside the linear rate."""
    c, d = STAGES
    b = (second / (d * d) - first / (c * c)) / (d - c)
    return first / (c * c) - b * c, b


@inlined
def end_corrected(a: float, b: float, end: float, over: Phi) -> tuple[float, float]:
    """What the end of a step adds to it, theta^4 put through it, and the error of the whole; shares of its length.

    The error is what the stage 1/2 and the end would miss by themselves, and what the end has added. It is no less than
    a small share of what the stage 1/2 alone would miss: the end may lie on the curve by chance.
    """
    c, d = STAGES
    fourth = (end - a - b) / ((1.0 - c) * (1.0 - d))
    added = fourth * (2.0 * c * d * over.three - 6.0 * (c + d) * over.four + 24.0 * over.five)
    without = fourth * (2.0 * c * over.three - 6.0 * (1.0 + c) * over.four + 24.0 * over.five)
    alone = b * (6.0 * over.four - 2.0 * c * over.three)
    return added, max(_CAUTION * abs(without) + abs(added), _CHANCE * abs(alone))
