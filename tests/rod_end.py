"""A damper with gas whose rod end has play: a joint that can only push and pull, solved by itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from pzd.damper.motion import Motion
from pzd.record import Array

FINE = 1e-5
"""Step [s]: a thousandth of the shortest time in which the oil of these dampers relaxes would be less; the error of the
force falls with its square."""


def sine(frequency: float, amplitude: float, cycles: int = 3, rate: float = 1000.0) -> Motion:
    """A sine about the middle of the stroke."""
    time = np.arange(0.0, cycles / frequency, 1.0 / rate)
    w = 2.0 * np.pi * frequency
    x, v = amplitude * np.sin(w * time), amplitude * w * np.cos(w * time)
    return Motion(time, x, v, -(w**2) * x, None)


@dataclass(frozen=True)
class RodEnd:
    """T0, C and k in series, a gas beside them, and the play through which the rig moves it all."""

    T0: float
    C: float
    k: float
    gas: float
    """Force with which it pushes the rod out at mid-stroke [N]."""
    stiffness: float
    """By which the gas hardens [N/m]."""
    play: float
    """Whole width [m]."""

    def force(self, motion: Motion) -> Array:
        """Force on the rig [N], of a rod without mass: where the joint is free it bears nothing."""
        fine = np.arange(motion.time[0], motion.time[-1] + FINE, FINE)
        x = np.interp(fine, motion.time, motion.displacement)
        found = _solved(x, FINE, self.T0, self.C, self.k, self.gas, self.stiffness, self.play)
        return np.asarray(np.interp(motion.time, fine, found))


@njit(cache=False)
def _solved(x: Array, step: float, T0: float, C: float, k: float, gas: float, stiffness: float, play: float) -> Array:
    force = np.empty(x.size)
    y, first, speed = x[0], 0.0, 0.0
    for i in range(x.size):
        for half in range(2):  # Heun: the slope at either end of the step
            at = x[min(i + half, x.size - 1)]
            reached = y if half == 0 else y + step * first
            free = (k * reached + gas) / (k + stiffness)  # where the rod stands that nothing holds
            rod = min(max(free, at - 0.5 * play), at + 0.5 * play)
            oil = k * (rod - reached)
            speed = np.sign(oil) * max(abs(oil) - T0, 0.0) / C
            if half == 0:
                force[i], first = oil - gas + stiffness * rod, speed
        y += 0.5 * step * (first + speed)
    return force
