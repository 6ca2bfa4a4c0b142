"""The half-car of the paper, equations (5) to (9), and its modes: heave z, pitch phi, and wheels that may have mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.quantities import GRAVITY
from pzd.record import Array, Complex


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
        """Return the weight of the body on each axle [N].

        Equation: B_1 = m g a2 / (a1 + a2), B_2 = m g a1 / (a1 + a2)      Source: balance of moments
        """
        whole = self.mass * GRAVITY / self.wheelbase
        return whole * self.distances[1], whole * self.distances[0]

    def static_loads(self) -> tuple[float, float]:
        """Return the force between road and wheels of each axle at rest [N].

        Equation: N_i0 = B_i + m_i g      Source: balance of the wheels
        """
        one, two = (b + m * GRAVITY for b, m in zip(self.body_loads(), self.unsprung_masses, strict=True))
        return one, two

    def force_directions(self) -> Array:
        """Return the directions in which the suspension forces act on (z, phi).

        Equation: H1 = [1, -a1]^T, H2 = [1, a2]^T        Source: Makowski and Knap 2021, eq. (7)

        Returns
        -------
        (2, 2) matrix H = [H1, H2]; deflection = H^T X - xi
        """
        return np.array([[1.0, 1.0], [-self.distances[0], self.distances[1]]])

    def mass_matrix(self) -> Array:
        """Return the mass matrix of (z, phi).

        Equation: M = diag(m, J_y)                       Source: Makowski and Knap 2021, eq. (6)

        Returns
        -------
        (2, 2) matrix [kg], [kg m2]
        """
        return np.diag([self.mass, self.pitch_inertia])

    def force_to_comfort(self) -> Array:
        """Return the acceleration at K by each suspension force.

        Equation: D^T = -G^T M^-1 H, G = [1, x_K]^T      Source: Makowski and Knap 2021, eq. (9)

        Returns
        -------
        (2,) D [1/kg]; a_K = D^T (S + T)
        """
        direction = np.array([1.0, self.comfort_point])
        return np.asarray(-direction @ np.linalg.solve(self.mass_matrix(), self.force_directions()))

    def mobility(self) -> Array:
        """Return how the suspensions accelerate under their own forces.

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
        """Return the acceleration of the body under suspension forces.

        Equation: M d2X/dt2 + H (S + T) = 0              Source: Makowski and Knap 2021, eq. (6)

        Parameters
        ----------
        forces : (2,) or (2, n) sum of spring and damper force S + T at each axle [N]

        Returns
        -------
        (2,) or (2, n) second derivative of (z, phi) [m/s2], [rad/s2]
        """
        return np.asarray(-np.linalg.solve(self.mass_matrix(), self.force_directions() @ forces), dtype=np.float64)


# --- Modes: bounce, pitch and the hop of the wheels, with frequencies and damping ratios ---

_STEPS = 100
"""In so many steps the damping is raised from none, so that each pair of eigenvalues is followed to its mode."""


@dataclass(frozen=True)
class Mode:
    """A mode of vibration of a car, its wheels on the road."""

    name: str
    frequency_Hz: float
    """Undamped."""
    damping_ratio: float
    """1 is critical."""


def modes(car: HalfCar, damping: float) -> tuple[Mode, ...]:
    """Compute frequencies and damping ratios of a car on constant dampers.

    Equation: (K - w^2 M) q = 0; (l^2 M + l C + K) q = 0, w_d^2 = l1 l2, D = -(l1 + l2) / (2 w_d)
    Source: eq. (6) with T_i = c V_i, q = (z, phi) and, where the wheels have mass, their heights

    Parameters
    ----------
    car : the half-car
    damping : c of each axle [N s/m]

    Returns
    -------
    bounce and pitch, and the hop of the wheels of both axles where they have mass. Bounce is the motion of the body
    with more of its kinetic energy in heave, and wheels hop at the axle that has more of it

    >>> from pzd.simulate.cars import cars
    >>> [(mode.name, round(mode.frequency_Hz, 2)) for mode in modes(cars()["makowski2021"], damping=4500.0)]
    [('bounce', 1.33), ('pitch', 1.73)]
    """
    from scipy.linalg import eigh

    M, K, C = matrices(car, damping)
    squares, shapes = eigh(K, M)
    names = _names(car, np.diag(M)[:, None] * shapes**2)
    pairs = _followed(M, K, C, np.sqrt(squares))
    ratios = (-pairs.sum(axis=1) / (2.0 * np.sqrt(pairs.prod(axis=1)))).real
    found = zip(names, np.sqrt(squares) / (2.0 * np.pi), ratios, strict=True)
    return tuple(sorted((Mode(n, float(f), float(d)) for n, f, d in found), key=lambda mode: _ORDER.index(mode.name)))


_ORDER = ("bounce", "pitch", "wheel hop, axle 1", "wheel hop, axle 2")


def matrices(car: HalfCar, damping: float) -> tuple[Array, Array, Array]:
    """Return mass, stiffness and damping matrix of (z, phi), and of the heights of wheels that have mass.

    Parameters
    ----------
    car : the half-car
    damping : c of each axle [N s/m]

    Returns
    -------
    M, K, C (2, 2) or (4, 4)
    """
    H = car.force_directions()
    if not car.wheels_have_mass:
        return car.mass_matrix(), H @ np.diag(car.stiffnesses) @ H.T, damping * H @ H.T
    E = np.vstack([H, -np.eye(2)])
    M = np.diag([car.mass, car.pitch_inertia, *car.unsprung_masses])
    K = E @ np.diag(car.stiffnesses) @ E.T + np.diag([0.0, 0.0, *car.tyre_stiffnesses])
    C = damping * E @ E.T + np.diag([0.0, 0.0, *car.tyre_dampings])
    return M, K, C


def _names(car: HalfCar, energy: Array) -> list[str]:
    """Name the modes by the kinetic energy (n, n) of each coordinate in each, a column a mode."""
    body = np.argsort(energy[2:].sum(axis=0), kind="stable")[:2]
    names = ["wheel hop"] * energy.shape[1]
    bounce = body[np.argmax(energy[0, body])]
    for mode in body:
        names[mode] = "bounce" if mode == bounce else "pitch"
    if car.wheels_have_mass:
        hops = [mode for mode, name in enumerate(names) if name == "wheel hop"]
        front = max(hops, key=lambda mode: energy[2, mode] / energy[2:, mode].sum())
        for mode in hops:
            names[mode] += ", axle 1" if mode == front else ", axle 2"
    return names


def _followed(M: Array, K: Array, C: Array, undamped: Array) -> Complex:
    """Follow the (n, 2) eigenvalues of each mode from its undamped frequency [rad/s] on."""
    from scipy.optimize import linear_sum_assignment

    n = len(M)
    inverse = np.linalg.inv(M)
    pairs = np.stack([1j * undamped, -1j * undamped], axis=1).ravel()
    for share in np.arange(1, _STEPS + 1) / _STEPS:
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -share * inverse @ C]])
        found = np.linalg.eigvals(A)
        pairs = found[linear_sum_assignment(np.abs(pairs[:, None] - found[None, :]))[1]]
    return pairs.reshape(n, 2)
