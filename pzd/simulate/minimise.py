"""The forces within reach that make |a_K| smallest, equations (10) and (12) of the paper.

a_K = a_0 + D^T T is a plane over the box of the admissible forces, so the smallest |a_K| is where
a_K = 0 cuts the box - a whole segment of minimisers - or a corner where it does not. Equation (12)
says nothing about the segment: the tie-break picks its point.
"""

from __future__ import annotations

import math

from pzd.compiled import compiled
from pzd.record import Array
from pzd.simulate.policy import TieBreak

Pair = tuple[float, float]

SMALLEST, EQUAL_SHARE, LARGEST, LEAST_LOAD = range(4)
TIE_BREAKS: dict[TieBreak, int] = {"smallest": SMALLEST, "equal_share": EQUAL_SHARE, "largest": LARGEST}


@compiled
def least_acceleration_forces(
    a0: float, D: Pair, low: Array, high: Array, tie: int, branch: int, forces: Array
) -> None:
    """Fill `forces` (2,) with damper forces within the box that make |a_0 + D^T T| smallest.

    Equation: T_K in Arg min |a_0 + D^T T| over Omega(V)      Source: Makowski and Knap 2021, eq. (10)-(12)

    Parameters
    ----------
    a0 : acceleration at K by the springs alone [m/s2]
    D : acceleration at K by each damper force [1/kg]
    low, high : (2,) the box Omega(V) [N]
    tie : `SMALLEST` Euclidean norm; `EQUAL_SHARE`: each damper goes the same share of its range
        from where it pushes K down most to where it pushes K up most; `LARGEST` Euclidean norm
    branch : the end of the segment that `LARGEST` takes, see `farther_end`
    forces : (2,) filled [N]
    """
    share = _share(a0, D, low, high)
    if tie == EQUAL_SHARE or share <= 0.0 or share >= 1.0:
        for i in range(2):
            start, end = (low[i], high[i]) if D[i] >= 0.0 else (high[i], low[i])
            forces[i] = start + share * (end - start)
        return
    i, first, last = _segment(a0, D, low, high)
    j = 1 - i
    if tie == LARGEST:
        forces[i] = first if branch == 0 else last
    else:
        nearest = -a0 * D[i] / (D[0] * D[0] + D[1] * D[1])
        forces[i] = min(max(nearest, first), last)
    forces[j] = min(max((-a0 - D[i] * forces[i]) / D[j], low[j]), high[j])


@compiled
def least_load_forces(springs: Pair, D: Pair, low: Array, high: Array, forces: Array) -> None:
    """Fill `forces` (2,) with those of the least wheel loads that make |a_K| smallest within the box.

    Equation: a_K = D^T L, L = S + T: the smallest Euclidean norm of L in the box Omega(V) + S
    Source: Makowski and Knap 2021, eq. (9)-(12); section 6 has the wheel load as another criterion

    Parameters
    ----------
    springs : S_i of both axles [N]
    D : acceleration at K by each force [1/kg]
    low, high : (2,) the box Omega(V), shifted meanwhile [N]
    forces : (2,) filled [N]
    """
    for i in range(2):
        low[i] += springs[i]
        high[i] += springs[i]
    least_acceleration_forces(0.0, D, low, high, SMALLEST, 0, forces)
    for i in range(2):
        low[i] -= springs[i]
        high[i] -= springs[i]
        forces[i] = min(max(forces[i] - springs[i], low[i]), high[i])


@compiled
def farther_end(a0: float, D: Pair, low: Array, high: Array) -> int:
    """End of the segment of minimisers (0 or 1) with the larger Euclidean norm."""
    if D[0] == 0.0 and D[1] == 0.0:
        return 0
    i, first, last = _segment(a0, D, low, high)
    j = 1 - i
    at_first = math.hypot(first, (-a0 - D[i] * first) / D[j])
    at_last = math.hypot(last, (-a0 - D[i] * last) / D[j])
    return 0 if at_first >= at_last else 1


@compiled
def _share(a0: float, D: Pair, low: Array, high: Array) -> float:
    """Share of the range of D^T T over the box at which a_K = 0: 0 or 1 where it is out of reach."""
    least, most = 0.0, 0.0
    for i in range(2):
        least += min(D[i] * low[i], D[i] * high[i])
        most += max(D[i] * low[i], D[i] * high[i])
    if -a0 <= least:
        return 0.0
    if -a0 >= most:
        return 1.0
    return (-a0 - least) / (most - least)


@compiled
def _segment(a0: float, D: Pair, low: Array, high: Array) -> tuple[int, float, float]:
    """The damper i with the smaller |D|, and its forces at both ends of the segment a_K = 0."""
    i = 0 if abs(D[0]) <= abs(D[1]) else 1
    j = 1 - i
    first, last = low[i], high[i]
    if D[i] != 0.0:
        one, other = (-a0 - D[j] * low[j]) / D[i], (-a0 - D[j] * high[j]) / D[i]
        first, last = max(first, min(one, other)), min(last, max(one, other))
    if first > last:
        first = last = 0.5 * (first + last)
    return i, first, last
