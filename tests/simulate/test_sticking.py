"""What holds a sticking axle, and how the dampers' own mass joins the body's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pzd.simulate.cars import cars
from pzd.simulate.config import SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.ride.equations import accelerate, motion
from pzd.simulate.ride.model import (
    Axle,
    Command,
    RideModel,
    State,
    at_rest,
    dynamic_damper_of,
    grid_of,
    ride_of,
    road_coefficients,
    vehicle,
    workspace,
)
from pzd.simulate.ride.riding import FixedValues, control_spec_of
from pzd.simulate.ride.stepper import choose_side
from pzd.simulate.roads import Profile
from pzd.simulate.study.plan import Case


@pytest.mark.parametrize("unsprung", [(0.0, 0.0), (90.0, 70.0)])
@pytest.mark.parametrize("sides", [(1.0, -1.0), (0.0, 1.0), (-1.0, 0.0), (0.0, 0.0)])
def test_the_suspensions_accelerate_as_body_and_road_do(rng: np.random.Generator, sides, unsprung) -> None:
    """dV/dt = H^T d2X/dt2 - d2xi/dt2 with all forces, zero where an axle sticks; wheels with mass take their part."""
    car = replace(cars()["makowski2021"], unsprung_masses=unsprung)
    for _ in range(20):
        acts, scratch = np.zeros((Command.BEHIND, 2)), workspace()
        acts[Command.SIDE] = sides
        scratch[Axle.SPRINGS], scratch[Axle.FORCE] = rng.normal(size=(2, 2)) * 1000.0
        scratch[Axle.LIFT] = rng.normal(size=2) * 5.0
        scratch[Axle.INERTANCE] = rng.uniform(0.0, 50.0, 2)
        before = scratch[Axle.FORCE].copy()
        accelerate(vehicle(car, 25.0), acts, scratch)
        body = car.acceleration(scratch[Axle.SPRINGS] + scratch[Axle.FORCE])
        wheels = (scratch[Axle.SPRINGS] + scratch[Axle.FORCE]) / np.where(np.array(unsprung) > 0.0, unsprung, np.inf)
        expected = car.force_directions().T @ body - scratch[Axle.LIFT] - wheels
        assert scratch[Axle.ACCELERATION] == pytest.approx(expected, abs=1e-10)
        for i, side in enumerate(sides):
            if side == 0.0:
                assert scratch[Axle.ACCELERATION, i] == 0.0
            else:
                inertia = scratch[Axle.INERTANCE, i] * scratch[Axle.ACCELERATION, i]
                assert scratch[Axle.FORCE, i] == pytest.approx(before[i] + inertia, abs=1e-9)


@pytest.mark.parametrize("unsprung", [(0.0, 0.0), (90.0, 70.0)])
def test_an_axle_is_stopped_by_an_impulse_between_body_and_wheel(damper, table, unsprung) -> None:
    """The suspension of axle 2 stands still; momentum and its moment about the centre of gravity are what they were."""
    car = replace(cars()["makowski2021"], unsprung_masses=unsprung, tyre_stiffnesses=(4e5, 4e5))
    config, dynamic, grid = SimulateConfig(), dynamic_damper_of(damper, 22.0, 0.0039), grid_of(table, None)
    case = Case(config.roads[0], policies()["passive"], "table", plain=False)
    model = RideModel(
        vehicle(car, 25.0),
        road_coefficients(Profile(), car.wheelbase),
        control_spec_of(config, case, car, dynamic, FixedValues(0.0, 0.0)),
        grid,
        dynamic,
        grid,
        dynamic,
    )
    y, ride = at_rest(model.car), ride_of(model)
    room = ride.workspace
    y[State.HEAVE_RATE], y[State.PITCH_RATE] = 0.3, -0.1
    wheels = car.wheels_have_mass
    if wheels:
        y[State.WHEEL_RATE_1 : State.WHEEL_RATE_1 + 2] = 0.2, -0.4
    motion(0.0, y, ride, np.zeros_like(y))
    before, other = y.copy(), room[Axle.RATE, 0]
    choose_side(1, 0.0, y, ride, np.zeros_like(y))
    assert room[Axle.RATE, 1] == pytest.approx(0.0, abs=1e-15)
    assert (room[Axle.RATE, 0] != other) or wheels
    if wheels:
        given = unsprung[1] * (y - before)[State.WHEEL_RATE_1 + 1]
        assert car.mass * (y - before)[State.HEAVE_RATE] == pytest.approx(-given)
        assert car.pitch_inertia * (y - before)[State.PITCH_RATE] == pytest.approx(-given * car.distances[1])
        assert y[State.WHEEL_RATE_1] == before[State.WHEEL_RATE_1]
