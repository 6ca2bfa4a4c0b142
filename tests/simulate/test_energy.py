"""What the valve puts into the oil springs while the voltage moves, which the balance of a ride takes as a rest."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper.compiled.kernels import K
from pzd.damper.parameter_rows import row_at
from pzd.simulate.ride import riding
from pzd.simulate.ride.energy import oil_energy
from pzd.simulate.ride.equations import motion
from pzd.simulate.ride.loop import set_control
from pzd.simulate.ride.model import (
    BEHIND,
    OIL_DEFLECTION,
    OIL_WORK,
    SET,
    SINCE,
    RideModel,
    at_rest,
    control,
    effective_voltage,
    workspace,
)
from pzd.simulate.ride.stepper import STAGES, advance

STEP = 2e-5
BEFORE, AFTER = 20_000, 1_000
"""Steps at 0 V, and with the valve on its way to 150 V."""


def model_of(ride, monkeypatch) -> RideModel:
    """What a ride at 150 V on a random road knows."""
    known = []
    original = riding.ride_of_model

    monkeypatch.setattr(riding, "ride_of_model", lambda model, *rest: known.append(model) or original(model, *rest))
    road = {"kind": "iso8608", "road_class": "C", "seed": 1}
    ride("passive", "dynamic", roads=[road], passive_voltage_V=150.0, duration_s=0.5, settle_s=0.1)
    return known[0]


def stiffness(model: RideModel, acts, axle: int, time: float) -> float:
    """k of the oil spring [N/m] at the effective voltage of an axle."""
    voltage = effective_voltage(model.damper, acts[SET, axle], acts[BEHIND:, axle], time - acts[SINCE, 0])
    return row_at(model.damper.voltages, model.damper.rows, voltage)[K]


def test_the_work_of_the_valve_is_half_the_square_of_the_deflection_over_the_stiffness_it_adds(
    ride, monkeypatch
) -> None:
    """W = integral e^2 / 2 dk in small steps is what the oil springs gain beyond what motion puts into them."""
    model = model_of(ride, monkeypatch)
    y, acts, room = at_rest(model.car), control(0.0), workspace()
    stages, end = np.zeros((STAGES + 1, y.size)), np.zeros(y.size)
    work = gained = 0.0
    for n in range(BEFORE + AFTER):
        time = n * STEP
        if n == BEFORE:
            set_control(time, y, model, None, None, acts, room, stages[STAGES])
            gained = oil_energy(time, y, model, acts, room) - y[OIL_WORK]
        motion(time, y, model, acts, room, stages[0])
        before = [(0.5 * room[OIL_DEFLECTION, i] ** 2, stiffness(model, acts, i, time)) for i in range(2)]
        advance(time, STEP, y, model, acts, room, 1e-11, STEP, stages, end)
        motion(time + STEP, y, model, acts, room, stages[0])
        for i, (was, k) in enumerate(before):
            now = 0.5 * room[OIL_DEFLECTION, i] ** 2
            work += model.car.dampers[i] * 0.5 * (was + now) * (stiffness(model, acts, i, time + STEP) - k)
    last = oil_energy((BEFORE + AFTER) * STEP, y, model, acts, room) - y[OIL_WORK]
    assert acts[SET, 0] == 150.0
    assert abs(work) > 0.05
    assert last - gained == pytest.approx(work, rel=1e-4)
