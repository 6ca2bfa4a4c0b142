"""How a car swings: bounce, pitch and the hop of its wheels, with frequencies and damping ratios."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.record import Array, Complex
from pzd.simulate.car import HalfCar

_STEPS = 100
"""In so many steps the damping is raised from none, so that each pair of eigenvalues is followed to its mode."""


@dataclass(frozen=True)
class Mode:
    """One way in which a car swings, its wheels on the road."""

    name: str
    frequency_Hz: float
    """Undamped."""
    damping_ratio: float
    """1 is critical."""


def modes(car: HalfCar, damping: float) -> tuple[Mode, ...]:
    """Frequencies and damping ratios of a car on constant dampers.

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
    """Mass, stiffness and damping matrix of (z, phi), and of the heights of the wheels where they have mass.

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
    """Names of the modes by the kinetic energy (n, n) of each coordinate in each, a column a mode."""
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
    """(n, 2) eigenvalues of each mode, followed from its undamped frequency [rad/s] on."""
    from scipy.optimize import linear_sum_assignment

    n = len(M)
    inverse = np.linalg.inv(M)
    pairs = np.stack([1j * undamped, -1j * undamped], axis=1).ravel()
    for share in np.arange(1, _STEPS + 1) / _STEPS:
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -share * inverse @ C]])
        found = np.linalg.eigvals(A)
        pairs = found[linear_sum_assignment(np.abs(pairs[:, None] - found[None, :]))[1]]
    return pairs.reshape(n, 2)
