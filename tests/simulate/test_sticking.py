"""What holds a sticking axle, and how the dampers' own mass joins the body's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pzd.simulate.cars import cars
from pzd.simulate.ride_model import ACCELERATION, FORCE, INERTANCE, LIFT, SIDE, SPRINGS, control, vehicle, workspace
from pzd.simulate.sticking import accelerate


@pytest.mark.parametrize("unsprung", [(0.0, 0.0), (90.0, 70.0)])
@pytest.mark.parametrize("sides", [(1.0, -1.0), (0.0, 1.0), (-1.0, 0.0), (0.0, 0.0)])
def test_the_suspensions_accelerate_as_body_and_road_do(rng: np.random.Generator, sides, unsprung) -> None:
    """dV/dt = H^T d2X/dt2 - d2xi/dt2 with all forces, zero where an axle sticks; wheels with mass take their part."""
    car = replace(cars()["makowski2021"], unsprung_masses=unsprung)
    for _ in range(20):
        acts, scratch = control(0.0), workspace()
        acts[SIDE] = sides
        scratch[SPRINGS], scratch[FORCE] = rng.normal(size=(2, 2)) * 1000.0
        scratch[LIFT] = rng.normal(size=2) * 5.0
        scratch[INERTANCE] = rng.uniform(0.0, 50.0, 2)
        before = scratch[FORCE].copy()
        accelerate(vehicle(car, 25.0), acts, scratch)
        body = car.acceleration(scratch[SPRINGS] + scratch[FORCE])
        wheels = (scratch[SPRINGS] + scratch[FORCE]) / np.where(np.array(unsprung) > 0.0, unsprung, np.inf)
        expected = car.force_directions().T @ body - scratch[LIFT] - wheels
        assert scratch[ACCELERATION] == pytest.approx(expected, abs=1e-10)
        for i, side in enumerate(sides):
            if side == 0.0:
                assert scratch[ACCELERATION, i] == 0.0
            else:
                inertia = scratch[INERTANCE, i] * scratch[ACCELERATION, i]
                assert scratch[FORCE, i] == pytest.approx(before[i] + inertia, abs=1e-9)
