"""The energy balance of a ride: every term is integrated by itself, so what is left is the error.

What the valve puts into an oil spring while the voltage moves is the rest of that spring's own balance, stored less
put in by motion; where no voltage moves that rest is an error too.
"""

from __future__ import annotations

import numpy as np

from pzd.compiled import compiled
from pzd.damper.compiled.kernels import K
from pzd.damper.parameter_rows import row_at
from pzd.damper.regimes import spring_energy
from pzd.record import Array, Complex
from pzd.simulate.ride.model import (
    BEHIND,
    DEFLECTION,
    DISSIPATED,
    DYNAMIC,
    HEAVE_RATE,
    OIL_1,
    PARALLEL_WORK,
    PITCH_RATE,
    ROAD_WORK,
    SET,
    SINCE,
    STATES,
    TYRE_LOSS,
    WHEEL_1,
    WHEEL_RATE_1,
    RideModel,
    effective_voltage,
)
from pzd.simulate.ride.outcome import Outcome
from pzd.simulate.vehicle.car import HalfCar
from pzd.simulate.vehicle.suspension import road_at, suspension, tyre_energy

# ----------------------------------------------------------------------------------------------------


NOTHING = 1e-12
"""Work that counts as nothing [J]: a ride on a level road."""


@compiled
def stored_energy(time: float, y: Array, model: RideModel, workspace: Array) -> float:
    """Energy of body and springs, and of wheels and tyres where wheels have mass.

    Equation: E = m (dz/dt)^2 / 2 + J (dphi/dt)^2 / 2 + sum k_i U_i^2 / 2 + sum m_i (dzeta_i/dt)^2 / 2 + sum E_tyre

    Parameters
    ----------
    time : [s]
    y : (n,) state
    model, workspace : see `ride_model`

    Returns
    -------
    energy [J]
    """
    car = model.car
    suspension(time, y, car, model.road_coefficients, workspace)
    energy = 0.5 * car.mass * y[HEAVE_RATE] ** 2 + 0.5 * car.inertia * y[PITCH_RATE] ** 2
    for i in range(2):
        energy += 0.5 * car.stiffness[i] * workspace[DEFLECTION, i] ** 2
        if car.wheels:
            road = model.road_coefficients
            height, _, _ = road_at(road, car.speed * time - road.behind[i])
            energy += 0.5 * car.unsprung[i] * y[WHEEL_RATE_1 + i] ** 2
            energy += tyre_energy(car.static_load[i], car.tyre_stiffness[i], height - y[WHEEL_1 + i])
    return float(energy)


@compiled
def oil_energy(time: float, y: Array, model: RideModel, control: Array, workspace: Array) -> float:
    """Energy of the oil springs of all dampers [J].

    Equation: E = sum n_i k integral s de, e = r_i U_i - y_i

    Parameters
    ----------
    time : [s]
    y : (n,) state
    model, control, workspace : see `ride_model`
    """
    car, damper, energy = model.car, model.damper, 0.0
    if model.control_spec.fidelity != DYNAMIC:
        return energy
    suspension(time, y, car, model.road_coefficients, workspace)
    for i in range(2):
        voltage = effective_voltage(damper, control[SET, i], control[BEHIND:, i], time - control[SINCE, 0])
        row = row_at(damper.voltages, damper.rows, voltage)
        energy += car.dampers[i] * spring_energy(car.ratio[i] * workspace[DEFLECTION, i] - y[OIL_1 + i], row, row[K])
    return energy


def balance_error(change: float, oil_change: float, y: Array) -> float:
    """What the energy balance leaves open, as a share of the dissipated energy.

    Equation: (change of stored energy + put into the oil + dissipated - road work) / dissipated, in dampers and tyres

    Parameters
    ----------
    change : of the stored energy over the ride [J], see `stored_energy`
    oil_change : of what the oil springs store [J], where no voltage moved; else what was put into them
    y : (n,) state at its end; the work on what stands beside the elements counts as stored

    Returns
    -------
    share; zero for a ride in which nothing moves
    """
    lost = y[DISSIPATED] + (y[TYRE_LOSS] if y.size > TYRE_LOSS else 0.0)
    left = change + oil_change + y[PARALLEL_WORK] + lost - y[ROAD_WORK]
    return float(left / max(lost, NOTHING)) if abs(left) > NOTHING else 0.0


# ----------------------------------------------------------------------------------------------------
# The car with constant damping on a sine: linear, so everything about it is exact.
#
# The state is x = (z, phi, dz, dphi, sin wt, cos wt): the road is part of it, evaluated exactly at any
# step. One matrix exponential carries it over a step, another gives the energies of a step as
# quadratic forms of its start.


def harmonic_response(
    car: HalfCar, damping: float, frequency: float, amplitude: float, vehicle_speed: float
) -> tuple[Complex, complex]:
    """Steady vibration of body and point K with constant damping on a sine.

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
    """
    w = 2.0 * np.pi * frequency
    H = car.force_directions()
    road = amplitude * np.exp(-1j * w * np.array([0.0, car.wheelbase / vehicle_speed]))
    impedance = np.diag(np.array(car.stiffnesses) + 1j * w * damping)
    body = np.linalg.solve(H @ impedance @ H.T - w * w * car.mass_matrix(), H @ impedance @ road)
    return body.astype(np.complex128), complex(-w * w * (body[0] + car.comfort_point * body[1]))


def ride_exactly(
    car: HalfCar,
    damping: float,
    frequency: float,
    amplitude: float,
    vehicle_speed: float,
    step: float,
    steps: int,
    per_output: int,
    reach: float,
) -> Outcome:
    """Ride a sine from rest with constant damping, exactly.

    Parameters
    ----------
    car : the half-car
    damping : c of each axle [N s/m]
    frequency, amplitude : of the sine [Hz], [m]
    vehicle_speed : [m/s]
    step, steps : length [s] and number of the steps at which the exact solution is taken
    per_output : steps between two rows of the history
    reach : largest damper speed of the rig [m/s]

    Returns
    -------
    the ride
    """
    w = 2.0 * np.pi * frequency
    u, v, rise = _suspension_rows(car, w, amplitude, vehicle_speed)
    load = np.array(car.stiffnesses)[:, None] * u + damping * v
    A = _system(car, w, load)
    x = _states(A, step, steps)
    deflection, rate, forces = x @ u.T, x @ v.T, x @ load.T
    comfort = forces @ car.force_to_comfort()
    energy = np.zeros(STATES)
    lost = _integral(A, damping * v.T @ v, step, x)
    energy[DISSIPATED] = lost[-1]
    energy[ROAD_WORK] = _integral(A, -0.5 * (load.T @ rise + rise.T @ load), step, x)[-1]
    stored = _stored(car, u)
    change = float(x[-1] @ stored @ x[-1] - x[0] @ stored @ x[0])
    too_fast = np.abs(rate) * np.array(car.motion_ratios) > reach * (1.0 + 1e-9)
    springs = deflection * np.array(car.stiffnesses)
    voltage = np.full(steps + 1, np.nan)
    columns = [np.arange(steps + 1) * step, x[:, 0], x[:, 1], comfort]
    for i in range(2):
        damper = damping * rate[:, i]
        columns += [deflection[:, i], rate[:, i], springs[:, i], damper, damper, voltage]
    return Outcome(
        history=np.stack(columns, axis=1)[::per_output],
        course=np.column_stack([comfort, forces, np.max(np.abs(deflection), axis=1), lost]),
        step=step,
        outside=float(np.mean(np.any(too_fast, axis=1))),
        energy_error=balance_error(change, 0.0, energy),
    )


def _suspension_rows(car: HalfCar, w: float, amplitude: float, speed: float) -> tuple[Array, Array, Array]:
    """Rows (2, 6) that give deflection, its rate and the road's speed from the state x."""
    H = car.force_directions()
    late = w * np.array([0.0, car.wheelbase / speed])
    sine, cosine = amplitude * np.cos(late), -amplitude * np.sin(late)
    height = np.stack([sine, cosine], axis=1)
    moving = w * np.stack([-cosine, sine], axis=1)
    none = np.zeros((2, 2))
    return np.hstack([H.T, none, -height]), np.hstack([none, H.T, -moving]), np.hstack([none, none, moving])


def _system(car: HalfCar, w: float, load: Array) -> Array:
    A = np.zeros((6, 6))
    A[0, 2] = A[1, 3] = 1.0
    A[2:4] = car.acceleration(load)
    A[4, 5], A[5, 4] = w, -w
    return A


def _states(A: Array, step: float, steps: int) -> Array:
    """(steps + 1, 6) states from rest, doubled block by block."""
    from scipy.linalg import expm

    x = np.zeros((1, 6))
    x[0, 5] = 1.0
    power = expm(A * step)
    while len(x) <= steps:
        x = np.vstack([x, x @ power.T])
        power = power @ power
    return x[: steps + 1]


def _integral(A: Array, Q: Array, step: float, x: Array) -> Array:
    """(n + 1,) integral of x^T Q x from the first to every one of the states (n + 1, 6), exactly.

    Source: Van Loan 1978, IEEE Trans. Automatic Control 23(3)
    """
    from scipy.linalg import expm

    n = len(A)
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:], block[n:, n:] = -A.T, Q, A
    whole = expm(block * step)
    gramian = whole[n:, n:].T @ whole[:n, n:]
    return np.concatenate([[0.0], np.cumsum(np.sum((x[:-1] @ gramian) * x[:-1], axis=1))])


def _stored(car: HalfCar, u: Array) -> Array:
    E: Array = 0.5 * u.T @ np.diag(car.stiffnesses) @ u
    E[2, 2] += 0.5 * car.mass
    E[3, 3] += 0.5 * car.pitch_inertia
    return E
