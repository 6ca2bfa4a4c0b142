"""How hard a case drives its damper: what the parameters of the laws are drawn in proportion to."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Scale:
    """Largest values over the tests of a case."""

    force: float
    """Of the plain damper [N]."""
    speed: float
    """Of the piston [m/s]."""
    stroke: float
    """From the middle of the stroke [m]."""
    acceleration: float
    """Of the piston [m/s2]; a high percentile, as corners of a triangle have no acceleration of their own."""
    damping: float
    """C in the middle of the range of the control signal [N s/m]."""
    voltage: float
    """Range of the control signal [V]."""
