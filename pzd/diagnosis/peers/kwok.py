"""Hyperbolic tangent of the velocity with a hysteresis by the side of the stroke, six parameters.

Law: F = c v + k x + alpha tanh(beta v + delta sign(x)) + f0. It has no state: delta opens the loop of force over
velocity by shifting it where the stroke is beyond its middle. beta is 50 to 300 s/m for the dampers of the source,
delta below 1. As F is alike for (alpha, beta, delta) and their negatives, beta is kept above 0.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.diagnosis.peers import Coefficient, Peer, PeerForm, ShapeParameter, StrokeMotion
from pzd.record import Array

SLOPES = np.geomspace(0.5, 300.0, 10)
"""beta of the grid times the peak velocity: from a tangent that is nearly straight to one that is nearly a step."""
LOOPS = np.linspace(-3.0, 3.0, 9)
"""delta of the grid: beyond 3 the tangent has reached 0.995 at rest."""


def columns(motion: StrokeMotion, shape: Array) -> Array:
    """Return the (n, 4) columns of c, k, alpha and f0, by beta [s/m] and delta [-]."""
    x, v = motion.displacement[motion.settling :], motion.velocity[motion.settling :]
    beta, delta = shape
    return np.column_stack([v, x, np.tanh(beta * v + delta * np.sign(x)), np.ones(v.size)])


def grid(motions: Sequence[StrokeMotion]) -> Array:
    """Return (g, 2) starting values of beta [s/m] and delta [-]."""
    fastest = max(float(np.max(np.abs(motion.velocity))) for motion in motions)
    return np.array([(slope / fastest, loop) for slope in SLOPES for loop in LOOPS])


PEER = Peer(
    name="kwok",
    law="F = c v + k x + alpha tanh(beta v + delta sign(x)) + f0",
    source="Kwok, Ha, Nguyen, Li and Samali 2006, Sensors and Actuators A 132(2), 441-451",
    coefficients=(
        Coefficient("c", "N s/m"),
        Coefficient("k", "N/m"),
        Coefficient("alpha", "N"),
        Coefficient("f0", "N"),
    ),
    shape=(ShapeParameter("beta", "s/m", 1e-3, 1e6, logarithmic=True), ShapeParameter("delta", "-", -10.0, 10.0)),
    forms=(PeerForm("", columns),),
    grid=grid,
)
