"""What holds a sticking axle, and how the dampers' own mass joins the body's."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.simulate.cars import cars
from pzd.simulate.scene import ACCELERATION, FORCE, INERTANCE, LIFT, SIDE, SPRINGS, control, desk, vehicle
from pzd.simulate.sticking import accelerate


@pytest.mark.parametrize("sides", [(1.0, -1.0), (0.0, 1.0), (-1.0, 0.0), (0.0, 0.0)])
def test_the_suspensions_accelerate_as_body_and_road_do(fresh_seeds, sides) -> None:
    """dV/dt = H^T d2X/dt2 - d2xi/dt2 with all forces, and nought where an axle sticks."""
    car = cars()["makowski2021"]
    random = np.random.default_rng(fresh_seeds(1)[0])
    for _ in range(20):
        acts, room = control(0.0), desk()
        acts[SIDE] = sides
        room[SPRINGS], room[FORCE] = random.normal(size=(2, 2)) * 1000.0
        room[LIFT] = random.normal(size=2) * 5.0
        room[INERTANCE] = random.uniform(0.0, 50.0, 2)
        before = room[FORCE].copy()
        accelerate(vehicle(car, 25.0), acts, room)
        body = car.acceleration(room[SPRINGS] + room[FORCE])
        assert room[ACCELERATION] == pytest.approx(car.force_directions().T @ body - room[LIFT], abs=1e-10)
        for i, side in enumerate(sides):
            if side == 0.0:
                assert room[ACCELERATION, i] == 0.0
            else:
                inertia = room[INERTANCE, i] * room[ACCELERATION, i]
                assert room[FORCE, i] == pytest.approx(before[i] + inertia, abs=1e-9)
