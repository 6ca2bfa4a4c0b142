"""The energy balance of a ride: every term is integrated by itself, so what is left is the error."""

from __future__ import annotations

from pzd.compiled import compiled
from pzd.damper.rows import row_at
from pzd.record import Array
from pzd.simulate.dynamic_damper import effective_voltage, stored
from pzd.simulate.kinematics import suspension
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
    VALVE_WORK,
    RideModel,
)

NOTHING = 1e-12
"""Work that counts as nothing [J]: a ride on a level road."""


@compiled
def stored_energy(time: float, y: Array, model: RideModel, control: Array, workspace: Array) -> float:
    """Energy of body, springs and oil springs.

    Equation: E = m (dz/dt)^2 / 2 + J (dphi/dt)^2 / 2 + sum k_i U_i^2 / 2 + sum n_i k s_i^2 / 2

    Parameters
    ----------
    time : [s]
    y : (STATES,) state
    model, control, workspace : see `ride_model`

    Returns
    -------
    energy [J]
    """
    car, damper = model.car, model.damper
    suspension(time, y, car, model.road_coefficients, workspace)
    energy = 0.5 * car.mass * y[HEAVE_RATE] ** 2 + 0.5 * car.inertia * y[PITCH_RATE] ** 2
    for i in range(2):
        energy += 0.5 * car.stiffness[i] * workspace[DEFLECTION, i] ** 2
        if model.control_spec.fidelity == DYNAMIC:
            elapsed = time - control[SINCE, 0]
            voltage, _ = effective_voltage(damper, control[SET, i], control[BEHIND:, i], elapsed)
            energy += car.dampers[i] * stored(y[OIL_1 + i], row_at(damper.voltages, damper.rows, voltage))
    return float(energy)


def balance_error(change: float, y: Array) -> float:
    """What the energy balance leaves open, as a share of the dissipated energy.

    Equation: (change of stored energy + dissipated - road work - valve work) / dissipated

    Parameters
    ----------
    change : of the stored energy over the ride [J]
    y : (STATES,) state at its end; the work on what stands beside the elements counts as stored

    Returns
    -------
    share; zero for a ride in which nothing moves
    """
    left = change + y[PARALLEL_WORK] + y[DISSIPATED] - y[ROAD_WORK] - y[VALVE_WORK]
    return float(left / max(y[DISSIPATED], NOTHING)) if abs(left) > NOTHING else 0.0
