"""The forces beside the element that remember: their deflections along a sampled motion."""

from __future__ import annotations

import numpy as np

from pzd.compiled import compiled
from pzd.damper.columns import acting
from pzd.damper.kernels import branch_force, branch_steady, branches_follow
from pzd.damper.motion import Motion
from pzd.record import Array

BRANCHES = len(acting("branch"))
"""How many deflections are remembered."""


def branch_forces(motion: Motion, rows: Array) -> Array:
    """Force of the branches along a motion, from rest at its first sample.

    The extension is a parabola inside each step, cut where the rod turns round: from there to there the laws are exact
    where the parameters stand still. Where they move they are taken as at the end of each step, of order two.

    Parameters
    ----------
    motion : (n,) sampled motion
    rows : (n, m) or (1, m) parameters of the forces beside the element, linear between samples

    Returns
    -------
    (n,) force [N]
    """
    force = np.zeros(motion.time.size)
    _fill(motion.displacement, motion.velocity, motion.time, rows, np.zeros(BRANCHES), force)
    return force


@compiled
def any_slips(rows: Array) -> bool:
    """Whether a branch acts in one of the (n, m) rows of the forces beside the element."""
    found = False
    for i in range(rows.shape[0]):
        found = found or branch_steady(1.0, rows[i]) != 0.0
    return found


@compiled
def _fill(x: Array, v: Array, time: Array, rows: Array, state: Array, force: Array) -> None:
    """Fill `force`, and change the deflections in place."""
    last = rows.shape[0] - 1
    for i in range(1, x.size):
        now = rows[min(i, last)]
        travel, h = x[i] - x[i - 1], time[i] - time[i - 1]
        half = 0.5 * (v[i] - v[i - 1])
        u0, u1 = travel / h - half, travel / h + half
        if u0 * u1 < 0.0:
            way = 0.5 * u0 * u0 / (u0 - u1) * h
            branches_follow(way, state, now)
            travel -= way
        branches_follow(travel, state, now)
        force[i] = branch_force(0.0, state, now)
