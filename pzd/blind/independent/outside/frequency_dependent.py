"""Frequency-selective damping: a spool closes a bypass as the low-passed force builds up.

Equation: tau ds/dt = F - s,  C (1 - a (1 - min(|s|/F_c, 1)))
Source: principle of dampers with frequency-selective valves; Dixon 2007, The Shock Absorber Handbook, ch. 9
"""

from __future__ import annotations

from numpy.random import Generator

from pzd.blind.independent.bingham import Scale

NAME = "frequency_dependent"
DESCRIBED_BY: tuple[str, ...] = ()


def drawn(draw: Generator, scale: Scale, strength: float) -> dict[str, float]:
    """Parameters of a bypass that takes up to that share of C away."""
    return {
        "bypass": min(0.8, strength),
        "bypass_lag": float(draw.uniform(0.05, 0.3)),
        "bypass_force": float(draw.uniform(0.3, 0.8)) * scale.force,
    }


def damping_factor(spool: float, bypass: float, bypass_force: float) -> float:
    """Factor on C while the spool feels a low-passed force [N]."""
    return 1.0 - bypass * (1.0 - min(abs(spool) / bypass_force, 1.0))


def spool_rate(force: float, spool: float, bypass_lag: float) -> float:
    """Rate of the low-passed force [N/s]."""
    return (force - spool) / bypass_lag
