"""The half-car of the paper: body with heave z and pitch phi on two suspensions, equations (5) to (9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.record import Array

GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s2]."""


@dataclass(frozen=True)
class HalfCar:
    """A body on two axles over a road that the wheels never leave; axle 1 leads."""

    name: str
    mass: float
    """Body mass m [kg]."""
    pitch_inertia: float
    """J_y about the centre of gravity [kg m2]."""
    distances: tuple[float, float]
    """a1, a2 from the centre of gravity to the axles, both positive [m]."""
    stiffnesses: tuple[float, float]
    """Spring stiffness at each axle k1, k2 [N/m]."""
    comfort_point: float
    """x_K of point K, positive towards axle 2 [m]."""
    motion_ratios: tuple[float, float] = (1.0, 1.0)
    """Damper extension over suspension deflection at each axle."""
    dampers: tuple[float, float] = (1.0, 1.0)
    """Number of dampers that act at each axle."""

    @property
    def wheelbase(self) -> float:
        """a1 + a2 [m]."""
        return self.distances[0] + self.distances[1]

    def static_loads(self) -> tuple[float, float]:
        """Load of each axle at rest [N].

        Equation: N_10 = m g a2 / (a1 + a2), N_20 = m g a1 / (a1 + a2)      Source: balance of moments
        """
        whole = self.mass * GRAVITY / self.wheelbase
        return whole * self.distances[1], whole * self.distances[0]

    def force_directions(self) -> Array:
        """Directions in which the suspension forces act on (z, phi).

        Equation: H1 = [1, -a1]^T, H2 = [1, a2]^T        Source: Makowski and Knap 2021, eq. (7)

        Returns
        -------
        (2, 2) matrix H = [H1, H2]; deflection = H^T X - xi
        """
        return np.array([[1.0, 1.0], [-self.distances[0], self.distances[1]]])

    def mass_matrix(self) -> Array:
        """Mass matrix of (z, phi).

        Equation: M = diag(m, J_y)                       Source: Makowski and Knap 2021, eq. (6)

        Returns
        -------
        (2, 2) matrix [kg], [kg m2]
        """
        return np.diag([self.mass, self.pitch_inertia])

    def force_to_comfort(self) -> Array:
        """Acceleration at K by each suspension force.

        Equation: D^T = -G^T M^-1 H, G = [1, x_K]^T      Source: Makowski and Knap 2021, eq. (9)

        Returns
        -------
        (2,) D [1/kg]; a_K = D^T (S + T)
        """
        direction = np.array([1.0, self.comfort_point])
        d: Array = -direction @ np.linalg.solve(self.mass_matrix(), self.force_directions())
        return d

    def acceleration(self, forces: Array) -> Array:
        """Acceleration of the body under suspension forces.

        Equation: M d2X/dt2 + H (S + T) = 0              Source: Makowski and Knap 2021, eq. (6)

        Parameters
        ----------
        forces : (2,) or (2, n) sum of spring and damper force S + T at each axle [N]

        Returns
        -------
        (2,) or (2, n) second derivative of (z, phi) [m/s2], [rad/s2]
        """
        return np.asarray(-np.linalg.solve(self.mass_matrix(), self.force_directions() @ forces), dtype=np.float64)
