"""The force between wheels and road: static load, and what the suspension takes off it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from simulate_dampers import damper_after_table_2, table_of

from pzd.artefacts import Diagnosed, Rides
from pzd.quantities import GRAVITY
from pzd.simulate.cars import cars
from pzd.simulate.config import SimulateConfig
from pzd.simulate.ride.linear import harmonic_response
from pzd.simulate.stage import simulate

CAR = cars()["makowski2021"]


def rides(frequency: float, **given: object) -> Rides:
    road = {"kind": "sine", "frequency_Hz": frequency, "label": "road"}
    config = SimulateConfig.model_validate_json(json.dumps({"roads": [road], **given}))
    damper = damper_after_table_2()
    return simulate(config, Diagnosed.undiagnosed(damper), table_of(damper), 1, Path())


def test_the_static_loads_carry_the_car_and_do_not_turn_it() -> None:
    one, two = CAR.static_loads()
    assert one + two == pytest.approx(CAR.mass * GRAVITY)
    assert one * CAR.distances[0] == pytest.approx(two * CAR.distances[1])


@pytest.mark.parametrize("frequency", [2.25, 4.5])
def test_at_constant_damping_the_contact_force_is_its_closed_form(frequency: float) -> None:
    """Linear: static load less the real part of (k + i w c) U exp(i w t)."""
    found = rides(frequency, policies=["constant"], fidelities=["ideal"], integration_step_s=0.0005)
    w = 2.0 * np.pi * frequency
    body, _ = harmonic_response(CAR, 4500.0, frequency, 0.02, 25.0)
    road = 0.02 * np.exp(-1j * w * np.array([0.0, CAR.wheelbase / 25.0]))
    force = (np.array(CAR.stiffnesses) + 1j * w * 4500.0) * (CAR.force_directions().T @ body - road)
    for row, size, static in zip(found.wheels, np.abs(force), CAR.static_loads(), strict=True):
        assert row.static_load_N == static
        assert row.rms_dynamic_load_N == pytest.approx(size / np.sqrt(2.0), rel=1e-3)
        assert row.min_contact_force_N == pytest.approx(static - size, abs=2e-4 * size)
        share = np.arccos(min(static / size, 1.0)) / np.pi
        assert row.pulling == pytest.approx(share, abs=2e-3)


def test_wheels_that_pull_on_the_road_are_reported() -> None:
    """The paper's bounds at 4.5 Hz: a suspension that is hard for a moment presses and pulls by more than the car."""
    found = rides(4.5, policies=["comfort"], fidelities=["ideal"], c_min_Ns_per_m=750, c_max_Ns_per_m=45000)
    worst = min(found.wheels, key=lambda row: row.min_contact_force_N)
    assert worst.min_contact_force_N < -1000.0
    assert worst.pulling > 0.1
    assert max(row.rms_dynamic_load_N for row in found.wheels) == found.summary[0].rms_wheel_load_N
