"""What the valve puts into the oil stiffnesses while the voltage moves, which the balance of a ride takes as a rest."""

from __future__ import annotations

import pytest

from pzd.damper.compiled.kernels import K
from pzd.damper.parameter_rows import row_at
from pzd.simulate.ride import riding
from pzd.simulate.ride.equations import motion, oil_energy
from pzd.simulate.ride.loop import set_control
from pzd.simulate.ride.model import Axle, Command, RideModel, State, at_rest, effective_voltage, ride_of
from pzd.simulate.ride.stepper import STAGES, advance, integrator_of

STEP, AFTER = 2e-5, 1_000
"""Fine steps while the valve is on its way from 0 to 150 V."""
COARSE, BEFORE = 1e-3, 400
"""Steps at 0 V before, in which no stiffness changes."""


def model_of(ride, monkeypatch) -> RideModel:
    """What a ride at 150 V on a random road knows."""
    known = []
    original = riding.ride_steps
    monkeypatch.setattr(riding, "ride_steps", lambda y, of, *rest: known.append(of.model) or original(y, of, *rest))
    road = {"kind": "iso8608", "road_class": "C", "seed": 1}
    ride("passive", "dynamic", roads=[road], passive_voltage_V=150.0, duration_s=0.5, settle_s=0.1)
    return known[0]


def stiffness(model: RideModel, acts, axle: int, time: float) -> float:
    """k of the oil stiffness [N/m] at the effective voltage of an axle."""
    voltage = effective_voltage(
        model.damper, acts[Command.SET, axle], acts[Command.BEHIND :, axle], time - acts[Command.SINCE, 0]
    )
    return row_at(model.damper.voltages, model.damper.rows, voltage)[K]


def test_the_work_of_the_valve_is_half_the_square_of_the_deflection_over_the_stiffness_it_adds(
    ride, monkeypatch
) -> None:
    """W = integral e^2 / 2 dk in small steps is what the oil stiffnesses gain beyond what motion puts into them."""
    model = model_of(ride, monkeypatch)
    y, going = at_rest(model.car), ride_of(model)
    acts, room = going.control, going.workspace
    acts[Command.SET] = acts[Command.BEHIND :] = 0.0
    integrator = integrator_of(1e-11, y.size)
    stages = integrator.stages
    for n in range(BEFORE):
        motion(n * COARSE, y, going, stages[0])
        advance(n * COARSE, COARSE, y, going, integrator, COARSE)
    start, work = BEFORE * COARSE, 0.0
    set_control(start, y, going, None, None, stages[STAGES])
    gained = oil_energy(start, y, going) - y[State.OIL_WORK]
    for n in range(AFTER):
        time = start + n * STEP
        motion(time, y, going, stages[0])
        before = [(0.5 * room[Axle.OIL_DEFLECTION, i] ** 2, stiffness(model, acts, i, time)) for i in range(2)]
        advance(time, STEP, y, going, integrator, STEP)
        motion(time + STEP, y, going, stages[0])
        for i, (was, k) in enumerate(before):
            now = 0.5 * room[Axle.OIL_DEFLECTION, i] ** 2
            work += model.car.dampers[i] * 0.5 * (was + now) * (stiffness(model, acts, i, time + STEP) - k)
    last = oil_energy(start + AFTER * STEP, y, going) - y[State.OIL_WORK]
    assert acts[Command.SET, 0] == 150.0
    assert abs(work) > 0.05
    assert last - gained == pytest.approx(work, rel=1e-4)
