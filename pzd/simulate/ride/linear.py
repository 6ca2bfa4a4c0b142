"""The car with constant damping on a sine: linear, so that its steady vibration and its ride are exact.

The state is x = (z, phi, dz, dphi, sin wt, cos wt): the road is part of it, evaluated exactly at any step. One matrix
exponential carries it over a step, another gives the energies of a step as quadratic forms of its start.
"""

from __future__ import annotations

import numpy as np

from pzd.record import Array, Complex
from pzd.simulate.ride.equations import balance_error
from pzd.simulate.ride.loop import Clock
from pzd.simulate.ride.model import STATES, State
from pzd.simulate.ride.outcome import Outcome
from pzd.simulate.roads import Profile
from pzd.simulate.vehicle.car import HalfCar


def harmonic_response(
    car: HalfCar, damping: float, frequency: float, amplitude: float, vehicle_speed: float
) -> tuple[Complex, complex]:
    """Return the steady vibration of body and point K with constant damping on a sine.

    Equation: (K - w^2 M + i w C) X = H (k + i w c) xi, xi_2 = xi_1 exp(-i w (a1 + a2) / V)
                                                                      Source: eq. (6) with T_i = c V_i

    Parameters
    ----------
    car : the half-car
    damping : c of each axle [N s/m]
    frequency : that the car feels [Hz]
    amplitude : of the road [m]
    vehicle_speed : [m/s]

    Returns
    -------
    (2,) complex amplitudes of z [m] and phi [rad], and that of a_K [m/s2]; the road under axle 1 is
    the imaginary part of A exp(i w t)

    >>> from pzd.simulate.cars import cars
    >>> car = cars()["makowski2021"]
    >>> _, a_K = harmonic_response(car, damping=4500.0, frequency=2.25, amplitude=0.02, vehicle_speed=25.0)
    >>> round(abs(a_K), 2)
    2.27
    """
    w = 2.0 * np.pi * frequency
    H = car.force_directions()
    road = amplitude * np.exp(-1j * w * np.array([0.0, car.wheelbase / vehicle_speed]))
    impedance = np.diag(np.array(car.stiffnesses) + 1j * w * damping)
    body = np.linalg.solve(H @ impedance @ H.T - w * w * car.mass_matrix(), H @ impedance @ road)
    return body.astype(np.complex128), complex(-w * w * (body[0] + car.comfort_point * body[1]))


def ride_exactly(
    car: HalfCar, damping: float, road: Profile, vehicle_speed: float, clock: Clock, reach: float
) -> Outcome:
    """Ride a sine from rest with constant damping, exactly.

    Parameters
    ----------
    car : the half-car
    damping : c of each axle [N s/m]
    road : a sine
    vehicle_speed : [m/s]
    clock : steps at which the exact solution is taken
    reach : largest damper speed of the rig [m/s]

    Returns
    -------
    the ride
    """
    step, steps = clock.step, clock.steps
    # the angular frequency by way of that in Hz: the bytes of the history depend on how it is rounded
    w = 2.0 * np.pi * (road.wavenumber * vehicle_speed / (2.0 * np.pi))
    u, v, rise = _suspension_rows(car, w, road.amplitude, vehicle_speed)
    load = np.array(car.stiffnesses)[:, None] * u + damping * v
    A = np.zeros((6, 6))
    A[0, 2] = A[1, 3] = 1.0
    A[2:4] = car.acceleration(load)
    A[4, 5], A[5, 4] = w, -w
    x = _states(A, step, steps)
    deflection, rate, forces = x @ u.T, x @ v.T, x @ load.T
    comfort = forces @ car.force_to_comfort()
    energy = np.zeros(STATES)
    lost = _integral(A, damping * v.T @ v, step, x)
    energy[State.DISSIPATED] = lost[-1]
    energy[State.ROAD_WORK] = _integral(A, -0.5 * (load.T @ rise + rise.T @ load), step, x)[-1]
    stored = 0.5 * u.T @ np.diag(car.stiffnesses) @ u  # energy of springs and body as a quadratic form of x
    stored[2, 2] += 0.5 * car.mass
    stored[3, 3] += 0.5 * car.pitch_inertia
    change = float(x[-1] @ stored @ x[-1] - x[0] @ stored @ x[0])
    too_fast = np.abs(rate) * np.array(car.motion_ratios) > reach * (1.0 + 1e-9)
    springs = deflection * np.array(car.stiffnesses)
    voltage = np.full(steps + 1, np.nan)
    columns = [np.arange(steps + 1) * step, x[:, 0], x[:, 1], comfort]
    for i in range(2):
        damper = damping * rate[:, i]
        columns += [deflection[:, i], rate[:, i], springs[:, i], damper, damper, voltage]
    return Outcome(
        history=np.stack(columns, axis=1)[:: clock.per_output],
        course=np.column_stack([comfort, forces, np.max(np.abs(deflection), axis=1), lost]),
        step=step,
        outside=float(np.mean(np.any(too_fast, axis=1))),
        energy_error=balance_error(change, 0.0, energy),
    )


def _suspension_rows(car: HalfCar, w: float, amplitude: float, speed: float) -> tuple[Array, Array, Array]:
    """Return rows (2, 6) that give deflection, its rate and the road's speed from the state x."""
    H = car.force_directions()
    late = w * np.array([0.0, car.wheelbase / speed])
    sine, cosine = amplitude * np.cos(late), -amplitude * np.sin(late)
    height = np.stack([sine, cosine], axis=1)
    moving = w * np.stack([-cosine, sine], axis=1)
    none = np.zeros((2, 2))
    return np.hstack([H.T, none, -height]), np.hstack([none, H.T, -moving]), np.hstack([none, none, moving])


def _states(A: Array, step: float, steps: int) -> Array:
    """Return the (steps + 1, 6) states from rest, doubled block by block."""
    from scipy.linalg import expm

    x = np.zeros((1, 6))
    x[0, 5] = 1.0
    power = expm(A * step)
    while len(x) <= steps:
        x = np.vstack([x, x @ power.T])
        power = power @ power
    return x[: steps + 1]


def _integral(A: Array, Q: Array, step: float, x: Array) -> Array:
    """Integrate x^T Q x from the first to every one of the states (n + 1, 6), exactly.

    Source: Van Loan 1978, IEEE Trans. Automatic Control 23(3)
    """
    from scipy.linalg import expm

    n = len(A)
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:], block[n:, n:] = -A.T, Q, A
    whole = expm(block * step)
    gramian = whole[n:, n:].T @ whole[:n, n:]
    return np.concatenate([[0.0], np.cumsum(np.sum((x[:-1] @ gramian) * x[:-1], axis=1))])
