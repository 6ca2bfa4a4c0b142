"""The car with constant damping: closed form, exact ride, generic integrator, and its order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pzd.simulate.cars import cars
from pzd.simulate.config import SimulateConfig
from pzd.simulate.ride.linear import harmonic_response

SPEED = 25.0


@pytest.mark.parametrize(("road", "frequency"), [(0, 2.25), (1, 4.5)])
def test_the_settled_ride_is_the_closed_form(ride, road, frequency) -> None:
    outcome = ride("constant", road=road, duration_s=40.0, settle_s=36.0, output_rate_Hz=1000.0)
    body, comfort = harmonic_response(cars()["makowski2021"], 4500.0, frequency, 0.02, SPEED)
    time = outcome.history[36000:, 0]
    turn = np.exp(2j * np.pi * frequency * time)
    for column, amplitude in ((1, body[0]), (2, body[1]), (3, comfort)):
        expected = (amplitude * turn).imag
        assert np.max(np.abs(outcome.history[36000:, column] - expected)) < 1e-6 * abs(amplitude)


def test_the_closed_form_satisfies_the_equation_of_motion() -> None:
    car = cars()["makowski2021"]
    w = 2.0 * np.pi * 3.1
    body, comfort = harmonic_response(car, 4500.0, 3.1, 0.02, SPEED)
    road = 0.02 * np.exp(-1j * w * np.array([0.0, car.wheelbase / SPEED]))
    deflection = car.force_directions().T @ body - road
    forces = np.array(car.stiffnesses) * deflection + 4500.0 * 1j * w * deflection
    acceleration = car.acceleration(forces.real) + 1j * car.acceleration(forces.imag)
    assert acceleration == pytest.approx(-w * w * body)
    assert comfort == pytest.approx(car.force_to_comfort() @ forces)


@pytest.mark.ci
@pytest.mark.parametrize("road", [0, 1])
def test_the_generic_integrator_agrees_with_the_exact_ride(ride, road) -> None:
    exact = ride("constant", road=road, duration_s=4.0, settle_s=1.0)
    generic = ride("constant", road=road, duration_s=4.0, settle_s=1.0, generic=True)
    for column in range(1, 9):
        scale = np.max(np.abs(exact.history[:, column]))
        assert np.max(np.abs(exact.history[:, column] - generic.history[:, column])) < 1e-9 * scale
    assert generic.course[1000:] == pytest.approx(exact.course[1000:], rel=1e-7, abs=1e-6)
    assert abs(exact.energy_error) < 1e-12
    assert abs(generic.energy_error) < 1e-10


def test_the_generic_integrator_is_of_fifth_order(ride) -> None:
    steps = (0.02, 0.01, 0.005)
    common = {"duration_s": 2.0, "settle_s": 1.0, "control_period_s": 0.02, "output_rate_Hz": 50.0}
    exact = ride("constant", road=1, integration_step_s=0.01, **common)
    errors = []
    for h in steps:
        outcome = ride("constant", road=1, generic=True, integration_step_s=h, tolerance=1e6, **common)
        errors.append(np.max(np.abs(outcome.history[:, 3] - exact.history[:, 3])))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 4.7)
    assert np.all(orders < 6.5)


def test_the_constant_peaks_of_figure_19_are_met_within_5_percent(ride, printed) -> None:
    for road, name in enumerate(("F19a-c", "F19b-c")):
        peak = np.max(np.abs(ride("constant", road=road).history[4000:, 3]))
        assert peak == pytest.approx(printed[name], rel=0.05)


def test_the_default_ride_is_that_of_the_paper(printed) -> None:
    config, car = SimulateConfig(), SimulateConfig().car.car()
    assert car.mass == printed["IN-m"]
    assert car.stiffnesses == (printed["IN-k1"], printed["IN-k2"])
    assert config.constant_damping_Ns_per_m == printed["IN-c"]
    assert config.vehicle_speed_km_per_h == printed["IN-V"]
    assert {road.amplitude_m for road in config.roads} == {printed["IN-A"]}


def test_a_car_that_is_the_same_fore_and_aft_pitches_and_heaves_apart() -> None:
    car = replace(cars()["makowski2021"], distances=(1.4, 1.4))
    slow_wave = 1.4 * 2.0  # axles in step: the wavelength is the wheelbase
    in_step, _ = harmonic_response(car, 4500.0, SPEED / slow_wave, 0.02, SPEED)
    against, _ = harmonic_response(car, 4500.0, SPEED / (2.0 * slow_wave), 0.02, SPEED)
    assert abs(in_step[1]) < 1e-15
    assert abs(in_step[0]) > 1e-4
    assert abs(against[0]) < 1e-15
    assert abs(against[1]) > 1e-4
