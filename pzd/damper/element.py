"""The paper's Bingham element, integrated exactly for a displacement linear between samples.

Equation: F = k (x - y),  C dy/dt + T0 sign(dy/dt) = F      Source: Makowski and Knap 2021, eq. (1)-(3)

Eliminating y gives dF/dt = k dx/dt - (k/C) soft(F, T0), whose right-hand side is continuous:
along one step G = F sign(dx) passes through slip against the motion, stick, and slip with it,
in this order, and each of the three has a closed form.
"""

from __future__ import annotations

import math

import numpy as np

from pzd.compiled import compiled
from pzd.record import Array


def element_force(
    displacement: Array, step: float, friction: float, damping: float, stiffness: float, initial_force: float = 0.0
) -> Array:
    """Force of the Bingham element under a sampled displacement.

    Equation: dF/dt = k dx/dt - (k/C) sign(F) max(|F| - T0, 0)      Source: eq. (1)-(3), y eliminated

    Parameters
    ----------
    displacement : (n,) extension x, linear between samples [m]
    step : sampling interval [s]
    friction : T0 [N]
    damping : C [N s/m]
    stiffness : k [N/m]
    initial_force : F at the first sample [N]

    Returns
    -------
    (n,) force [N]
    """
    force = np.empty_like(displacement)
    _march(displacement, step, friction, damping, stiffness, initial_force, force)
    return force


def element_force_sensitivities(
    displacement: Array, step: float, friction: float, damping: float, stiffness: float, initial_force: float = 0.0
) -> tuple[Array, Array]:
    """Force of the Bingham element and its derivatives by T0, C and k, the initial force held.

    Each piece of the closed form is differentiated at fixed duration; the field is continuous at
    |F| = T0, so the moving switching times add nothing.

    Parameters
    ----------
    displacement : (n,) extension x, linear between samples [m]
    step : sampling interval [s]
    friction : T0 [N]
    damping : C [N s/m]
    stiffness : k [N/m]
    initial_force : F at the first sample [N]

    Returns
    -------
    (n,) force [N] and (n, 3) dF/dT0 [-], dF/dC [m/s], dF/dk [m]
    """
    force = np.empty_like(displacement)
    slopes = np.empty((displacement.size, 3))
    _march_with_slopes(displacement, step, friction, damping, stiffness, initial_force, force, slopes)
    return force, slopes


@compiled
def _march(x: Array, h: float, T0: float, C: float, k: float, F: float, force: Array) -> None:
    rise = -math.expm1(-h * k / C)
    force[0] = F
    for i in range(1, x.size):
        F = advance_force(F, x[i] - x[i - 1], h, T0, C, k, rise)
        force[i] = F


@compiled
def advance_force(F: float, dx: float, h: float, T0: float, C: float, k: float, rise: float) -> float:
    """Force one step later; `rise` is 1 - exp(-h k / C)."""
    s = 1.0 if dx >= 0.0 else -1.0
    G = s * F
    w = abs(dx) / h
    left = h
    if G < -T0:
        end = G + (C * w - T0 - G) * rise
        if end < -T0 or w == 0.0:
            return s * end
        left -= C / k * math.log1p((-T0 - G) / (C * w))
        G = -T0
    if G <= T0:
        end = G + k * w * left
        if end <= T0:
            return s * end
        left -= (T0 - G) / (k * w)
        G = T0
    share = rise if left == h else -math.expm1(-max(left, 0.0) * k / C)
    return s * (G + (T0 + C * w - G) * share)


@compiled
def _march_with_slopes(
    x: Array, h: float, T0: float, C: float, k: float, F: float, force: Array, slopes: Array
) -> None:
    by_T0, by_C, by_k = 0.0, 0.0, 0.0
    force[0] = F
    slopes[0, :] = 0.0
    for i in range(1, x.size):
        dx = x[i] - x[i - 1]
        s = 1.0 if dx >= 0.0 else -1.0
        w = abs(dx) / h
        left = h
        for regime in (-1.0, 0.0, 1.0):
            G = s * F
            if left <= 0.0 or (regime < 0.0 and G >= -T0) or (regime == 0.0 and G > T0):
                continue
            if regime == 0.0:
                used = left if k * w * left <= T0 - G else (T0 - G) / (k * w)
                by_k += s * w * used
                F = s * (G + k * w * used)
            else:
                used = left
                if regime < 0.0 and w > 0.0:
                    used = min(left, C / k * math.log1p((-T0 - G) / (C * w)))
                decay = math.exp(-used * k / C)
                over = F - s * (regime * T0 + C * w)
                by_T0 = by_T0 * decay + s * regime * (1.0 - decay)
                by_C = by_C * decay + s * w * (1.0 - decay) + over * decay * used * k / (C * C)
                by_k = by_k * decay - over * decay * used / C
                F = s * (regime * T0 + C * w) + over * decay
            if regime < 1.0 and used < left:
                F = s * regime * T0 if regime < 0.0 else s * T0  # exactly on the edge of the next regime
            left -= used
        force[i] = F
        slopes[i, 0] = by_T0
        slopes[i, 1] = by_C
        slopes[i, 2] = by_k
