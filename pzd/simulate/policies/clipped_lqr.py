"""Clipped LQR: the forces of the linear quadratic regulator of the car, cut to what the dampers can give.

    J = integral a_K^2 + load_weight sum_i (L_i / m_i)^2 + deflection_weight sum_i U_i^2 dt

over the forces T, without bounds: L_i = k_i U_i + T_i is the dynamic load of each wheel, m_i the mass that rests on its
axle. The road is white noise of velocity, as a road of ISO 8608 nearly is: with x = (U_1, U_2, dz, dphi)

    dU/dt = H^T (dz, dphi) - dxi/dt, M d(dz, dphi)/dt = -H (k U + T)

and the optimal forces are T = -G x, whatever the height of the road. Wheels with mass are none of its states: it is
designed as if they had none.

Source: Butsuen 1989, The design of semi-active suspensions for automotive vehicles (thesis, MIT), chapter 3: clipped
optimal control; the weights are ours.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from pzd.quantities import GRAVITY
from pzd.record import Array
from pzd.schema.model import Frozen
from pzd.simulate.policies import BODY_RATES, DEFLECTIONS, SENSED, Policy
from pzd.simulate.vehicle.car import HalfCar


class ClippedLqr(Frozen):
    """Parameters of the policy."""

    load_weight: float = Field(default=0.1, gt=0.0)
    """Weight of the wheel loads, as accelerations of the mass on each axle, beside the square of a_K."""
    deflection_weight_per_s4: float = Field(default=1000.0, gt=0.0)
    """Weight of the deflections. w^4 beside no loads lets a body on one axle swing at w rad/s: by default 0.9 Hz."""


def regulator_feedback(car: HalfCar, damping: float, own: Frozen) -> Array:
    """Return the gains of T = -G x, the regulator with the weights of its block.

    Equation: G = R^-1 (B^T P + N^T), P of A^T P + P A - (P B + N) R^-1 (B^T P + N^T) + Q = 0
    Source: Anderson and Moore 1990, Optimal Control: Linear Quadratic Methods, section 3.4
    """
    from scipy.linalg import solve_continuous_are

    A, B, Q, R, N = regulator(car, ClippedLqr.model_validate(own))
    P = solve_continuous_are(A, B, Q, R, s=N)
    gains = np.zeros((2, SENSED))
    gains[:, DEFLECTIONS], gains[:, BODY_RATES] = np.split(-np.linalg.solve(R, B.T @ P + N.T), 2, axis=1)
    return gains


def regulator(car: HalfCar, weights: ClippedLqr) -> tuple[Array, Array, Array, Array, Array]:
    """Return the car and the integrand of J as matrices.

    Equation: dx/dt = A x + B T, dJ/dt = x^T Q x + T^T R T + 2 x^T N T

    Parameters
    ----------
    car : the half-car
    weights : of J

    Returns
    -------
    A (4, 4), B (4, 2), Q (4, 4), R (2, 2), N (4, 2)
    """
    H, D, stiffness = car.force_directions(), car.force_to_comfort(), np.diag(car.stiffnesses)
    A, B = np.zeros((4, 4)), np.zeros((4, 2))
    A[:2, 2:] = H.T
    A[2:, :2], B[2:] = car.acceleration(stiffness), car.acceleration(np.eye(2))
    carried = np.array(car.body_loads()) / GRAVITY
    R = np.outer(D, D) + weights.load_weight * np.diag(carried**-2.0)
    N = np.zeros((4, 2))
    N[:2] = stiffness @ R
    Q = np.zeros((4, 4))
    Q[:2, :2] = stiffness @ R @ stiffness + weights.deflection_weight_per_s4 * np.eye(2)
    return A, B, Q, R, N


POLICIES = (
    Policy(
        "clipped_lqr",
        "the forces of the linear quadratic regulator of the car, as far as the dampers can give them",
        "feedback",
        controlled=True,
        feedback=regulator_feedback,
    ),
)
