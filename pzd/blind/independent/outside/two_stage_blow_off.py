"""A blow-off valve that is fully open at a second force, beyond which its seat throttles.

Equation: F = F_1 + C_1 (w - w_1) beyond F_1, and F_2 + C_2 (w - w_2) beyond F_2, C_1 < C < C_2
Source: digressive-progressive valves; Dixon 2007, The Shock Absorber Handbook, ch. 6
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "two_stage_blow_off"
DESCRIBED_BY: tuple[str, ...] = ("relief_valve", "orifice_quadratic")


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a valve that opens between four and seven tenths of the peak force, the wider the stronger."""
    first = float(draw.uniform(0.4, 0.7)) * scale.force
    return {
        "first_force": first,
        "first_slope": scale.damping / (1.0 + 20.0 * strength),
        "second_force": first + float(draw.uniform(0.1, 0.2)) * scale.force,
        "second_slope": float(draw.uniform(1.5, 3.0)) * scale.damping,
    }


def flow_beyond(
    force: float, first_force: float, first_slope: float, second_force: float, second_slope: float
) -> float:
    """Flow speed [m/s] that the valve adds at a force above its first opening [N]."""
    if force <= second_force:
        return (force - first_force) / first_slope
    return (second_force - first_force) / first_slope + (force - second_force) / second_slope
