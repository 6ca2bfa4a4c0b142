"""Hysteresis of Bouc and Wen beside a dashpot, a spring and an offset, in its normalised form.

Law: F = c v + k x + alpha z + f0, dz/dt = A v - gamma |v| |z|^(n-1) z - beta v |z|^n. Scaling z and alpha against each
other changes no force, so z is counted in its ultimate value (A/(beta + gamma))^(1/n): then A = beta + gamma = rho,
gamma = sigma rho, abs(z) <= 1, and alpha is the ultimate hysteretic force. sigma >= 1/2, else a loop may give off
energy. n is 1 or 2, whichever fits better, alike at all voltages: for these the equation has closed forms in the travel
of the rod, since z depends on the way and not on the speed. Other n are not tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from pzd.compiled import compiled, compiled_law
from pzd.damper.effects.bouc_wen import hysteresis_after
from pzd.diagnosis.peers import Coefficient, Peer, PeerForm, ShapeParameter, StrokeMotion
from pzd.record import Array

STEEPNESS = np.geomspace(1.0, 3000.0, 9)
"""rho of the grid times the largest amplitude: from a hysteresis that never saturates to one that is nearly a step."""
UNLOADING = (0.5, 0.8, 1.2, 2.0, 5.0, 20.0)
"""sigma of the grid: from an unloading as stiff as at z = 0 to one that is nearly a step."""

_hysteresis_after = compiled_law(hysteresis_after)


def columns(exponent: int, motion: StrokeMotion, shape: Array) -> Array:
    """Return the (n, 4) columns of c, k, alpha and f0, by n, rho [1/m] and sigma [-]."""
    z = np.zeros(motion.displacement.size)
    rho, sigma = (float(value) for value in shape)
    _fill(motion.displacement, motion.velocity, motion.step, rho, sigma, exponent, z)
    after = slice(motion.settling, None)
    x, v = motion.displacement[after], motion.velocity[after]
    return np.column_stack([v, x, z[after], np.ones(v.size)])


def grid(motions: Sequence[StrokeMotion]) -> Array:
    """Return (g, 2) starting values of rho [1/m] and sigma [-]."""
    widest = max(float(np.max(np.abs(motion.displacement))) for motion in motions)
    return np.array([(steep / widest, sigma) for steep in STEEPNESS for sigma in UNLOADING])


@compiled
def _fill(x: Array, v: Array, step: float, rho: float, sigma: float, exponent: int, z: Array) -> None:
    """Integrate z (n,) from 0; the extension is a parabola inside each step, divided where the rod turns round."""
    now = 0.0
    for i in range(1, x.size):
        travel, half = x[i] - x[i - 1], 0.5 * (v[i] - v[i - 1])
        before, after = travel / step - half, travel / step + half
        if before * after < 0.0:
            way = 0.5 * before * before / (before - after) * step
            now = _hysteresis_after(now, way, rho, sigma, exponent)
            travel -= way
        now = _hysteresis_after(now, travel, rho, sigma, exponent)
        z[i] = now


PEER = Peer(
    name="bouc_wen",
    law="F = c v + k x + alpha z + f0, dz/dt = rho (v - sigma |v| |z|^(n-1) z - (1 - sigma) v |z|^n), n = 1 or 2",
    source="Wen 1976, J. Eng. Mech. Div. ASCE 102(2), 249-263; beside a dashpot and a spring: Spencer, Dyke, Sain and "
    "Carlson 1997, J. Eng. Mech. 123(3), 230-238; normalised: Ikhouane and Rodellar 2005, Nonlinear Dynamics 42, 63-78",
    coefficients=(
        Coefficient("c", "N s/m"),
        Coefficient("k", "N/m"),
        Coefficient("alpha", "N"),
        Coefficient("f0", "N"),
    ),
    shape=(
        ShapeParameter("rho", "1/m", 1e-2, 1e8, logarithmic=True),
        ShapeParameter("sigma", "-", 0.5, 1000.0, logarithmic=True),
    ),
    forms=tuple(PeerForm(f"n = {n}", partial(columns, n)) for n in (1, 2)),
    grid=grid,
)
