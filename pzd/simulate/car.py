"""The half-car of the paper, equations (5) to (9): body with heave z and pitch phi; its wheels may have mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.record import Array

GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s2]."""


@dataclass(frozen=True)
class HalfCar:
    """A body on two axles; axle 1 leads. Wheels without mass never leave the road, those with mass stand on tyres."""

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
    unsprung_masses: tuple[float, float] = (0.0, 0.0)
    """Mass of the wheels of each axle with what moves with them m1, m2 [kg]; zero: they follow the road."""
    tyre_stiffnesses: tuple[float, float] = (0.0, 0.0)
    """Stiffness of the tyres of each axle k_t1, k_t2 [N/m]."""
    tyre_dampings: tuple[float, float] = (0.0, 0.0)
    """Damping of the tyres of each axle c_t1, c_t2 [N s/m]."""

    @property
    def wheels_have_mass(self) -> bool:
        """Whether the wheels move by themselves, on tyres."""
        return min(self.unsprung_masses) > 0.0

    @property
    def wheelbase(self) -> float:
        """a1 + a2 [m]."""
        return self.distances[0] + self.distances[1]

    def body_loads(self) -> tuple[float, float]:
        """Weight of the body on each axle [N].

        Equation: B_1 = m g a2 / (a1 + a2), B_2 = m g a1 / (a1 + a2)      Source: balance of moments
        """
        whole = self.mass * GRAVITY / self.wheelbase
        return whole * self.distances[1], whole * self.distances[0]

    def static_loads(self) -> tuple[float, float]:
        """Force between road and wheels of each axle at rest [N].

        Equation: N_i0 = B_i + m_i g      Source: balance of the wheels
        """
        one, two = (b + m * GRAVITY for b, m in zip(self.body_loads(), self.unsprung_masses, strict=True))
        return one, two

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

    def mobility(self) -> Array:
        """How the suspensions accelerate under their own forces.

        Equation: dV/dt = -W (S + T) - (what wheels or road do without them), W = H^T M^-1 H + diag(1 / m_i)
        Source: from eq. (6), and m_i d2zeta_i/dt2 = S_i + T_i + N_i - N_i0 where the wheels have mass

        Returns
        -------
        (2, 2) matrix W [1/kg]
        """
        H = self.force_directions()
        W: Array = H.T @ np.linalg.solve(self.mass_matrix(), H)
        return W + np.diag(1.0 / np.array(self.unsprung_masses)) if self.wheels_have_mass else W

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
