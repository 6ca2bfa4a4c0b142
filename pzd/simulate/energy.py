"""The energy balance of a ride: every term is integrated by itself, so what is left is the error.

What the valve puts into an oil spring while the voltage moves is the rest of that spring's own balance, stored less
put in by motion; where no voltage moves that rest is an error too.
"""

from __future__ import annotations

from pzd.compiled import compiled
from pzd.damper.kernels import K
from pzd.damper.regimes import spring_energy
from pzd.damper.rows import row_at
from pzd.record import Array
from pzd.simulate.dynamic_damper import effective_voltage
from pzd.simulate.kinematics import road_at, suspension
from pzd.simulate.ride_model import (
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
    TYRE_LOSS,
    WHEEL_1,
    WHEEL_RATE_1,
    RideModel,
)
from pzd.simulate.tyre import tyre_energy

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
