"""Work along a path of force over displacement."""

from __future__ import annotations

import numpy as np

from pzd.record import Array
from pzd.signals.reversals import reversals

CHANCE = 0.05
"""Work of one cycle that may be chance, as a share of stroke times range of the force.

Reason: a damper that sticks draws a line without area, and what little its noise encloses is fed in as often as taken
out; a loop of dry friction alone has ten times this and more."""


def work(displacement: Array, force: Array, closed: bool = False) -> float:
    """Work done on the damper along the path.

    Equation: W = integral of F dx, the area of the loop of force over displacement      Source: definition

    Parameters
    ----------
    displacement : (n,) extension [m]
    force : (n,) force [N]
    closed : whether the last sample is followed by the first, as in an average cycle

    Returns
    -------
    work [J]
    """
    if closed:
        displacement, force = np.append(displacement, displacement[0]), np.append(force, force[0])
    return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(displacement)))


def work_of_chance(displacement: Array, force: Array, cycles: float | None = None) -> float:
    """Work [J] that chance may do over a path; over many cycles it adds up with the root of their number.

    Parameters
    ----------
    displacement : (n,) extension [m]
    force : (n,) force [N]
    cycles : how many there are; by the turns of the motion where it is not said
    """
    of_cycle = CHANCE * float(np.ptp(displacement) * np.subtract(*np.percentile(force, (99, 1))))
    return of_cycle * float(np.sqrt(1.0 + 0.5 * len(reversals(displacement)) if cycles is None else cycles))
