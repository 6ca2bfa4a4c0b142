"""A damper as somebody measured it: force over velocity, one curve or one for each value of the control signal.

Such a damper has neither an oil spring nor effects: it answers at once with the force of the curve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.record import Array

FEWEST = 2
"""Points of a curve."""


@dataclass(frozen=True, eq=False)
class ForceCurve:
    """Force over velocity, monotone between the points, along the last straight line beyond them."""

    velocity: Array
    """(n,) rising, with both signs; rebound positive [m/s]."""
    force: Array
    """(n, m) a column for each value of the control signal [N]."""
    voltages: Array
    """(m,) rising [V]; a single 0 where there is no control signal."""
    has_voltage: bool
    """Whether there is a control signal."""

    @property
    def reached(self) -> float:
        """Largest speed that was measured in both directions [m/s]."""
        return float(min(-self.velocity[0], self.velocity[-1]))

    def at(self, velocity: Array, voltage: Array | float) -> Array:
        """Compute the force at velocities and voltages, which are broadcast; the voltage is held beyond the outermost.

        Equation: piecewise cubic, monotone where the points are      Source: Fritsch and Butland 1984, SIAM J. Sci.
        Stat. Comput. 5(2)

        Parameters
        ----------
        velocity : rate of extension [m/s]
        voltage : control signal [V]

        Returns
        -------
        force [N] in the broadcast shape
        """
        v, u = np.broadcast_arrays(np.asarray(velocity, np.float64), np.asarray(voltage, np.float64))
        columns = self._columns(v.ravel())
        place = np.interp(u.ravel(), self.voltages, np.arange(self.voltages.size, dtype=np.float64))
        low = np.minimum(place.astype(np.int64), max(self.voltages.size - 2, 0))
        high, rows = np.minimum(low + 1, self.voltages.size - 1), np.arange(v.size)
        share = place - low
        return np.asarray(((1.0 - share) * columns[rows, low] + share * columns[rows, high]).reshape(v.shape))

    def _columns(self, velocity: Array) -> Array:
        """Compute the (k, m) force of every curve at (k,) velocities."""
        from scipy.interpolate import PchipInterpolator

        within = np.clip(velocity, self.velocity[0], self.velocity[-1])
        found = PchipInterpolator(self.velocity, self.force, axis=0)(within)
        for end, next_one in ((0, 1), (-1, -2)):
            slope = (self.force[end] - self.force[next_one]) / (self.velocity[end] - self.velocity[next_one])
            beyond = velocity < self.velocity[0] if end == 0 else velocity > self.velocity[-1]
            found[beyond] = self.force[end] + slope * (velocity[beyond, np.newaxis] - self.velocity[end])
        return np.asarray(found)


def curve_of(velocity: Array, force: Array, voltages: Array | None, sign: int) -> ForceCurve:
    """Return the curve of measured points, rebound positive.

    Parameters
    ----------
    velocity : (n,) in any order [m/s]
    force : (n, m) a column for each of the voltages [N]
    voltages : (m,) in any order [V]; None where there is no control signal
    sign : -1 where compression is counted positive: in velocity and force, or in the force alone where it has the sign
        opposite to that of the velocity

    Raises
    ------
    ValueError : when they are no curve of a damper
    """
    if velocity.size < FEWEST:
        raise ValueError(f"velocity: a curve needs {FEWEST} points at least (got {velocity.size})")
    opposed = float(np.sum(force * velocity[:, np.newaxis])) < 0.0
    if opposed and sign > 0:
        raise ValueError(
            "force: has the sign opposite to that of the velocity, so the damper would drive the car; say sign=-1 "
            "where it counts compression positive (got sign=1)"
        )
    if sign < 0:
        force, velocity = -force, velocity if opposed else -velocity
    order = np.argsort(velocity, kind="stable")
    v, forces = velocity[order], force[order]
    twice = np.flatnonzero(np.diff(v) == 0.0)
    if twice.size:
        raise ValueError(f"velocity: {v[twice[0]]:g} m/s stands twice; give the force at each velocity once")
    if not v[0] < 0.0 < v[-1]:
        raise ValueError(
            f"velocity: must reach from compression to rebound, below and above 0 (got {v[0]:g} to {v[-1]:g} m/s)"
        )
    if voltages is None:
        return ForceCurve(v, forces, np.zeros(1), has_voltage=False)
    by_voltage = np.argsort(voltages, kind="stable")
    if np.any(np.diff(voltages[by_voltage]) == 0.0):
        raise ValueError("voltage: one stands twice; give one column of forces for each")
    return ForceCurve(v, forces[:, by_voltage], voltages[by_voltage], has_voltage=True)
