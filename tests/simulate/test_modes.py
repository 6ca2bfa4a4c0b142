"""Bounce, pitch and wheel hop: closed forms, and damping that is small, large and beyond critical."""

from __future__ import annotations

import json

import numpy as np
import pytest

from pzd.simulate.cars import cars
from pzd.simulate.config import SimulateConfig
from pzd.simulate.vehicle.car import HalfCar, matrices, modes

TWO_QUARTERS = {
    "mass_kg": 1200.0,
    "a1_m": 1.5,
    "a2_m": 1.5,
    "pitch_inertia_kgm2": 2700.0,
    "x_K_m": 0.0,
    "spring_stiffness_N_per_m": [40000.0, 40000.0],
    "unsprung_mass_kg": [80.0, 60.0],
    "tyre_stiffness_N_per_m": [4.0e5, 5.0e5],
}


def car_of(**given: object) -> HalfCar:
    return SimulateConfig.model_validate_json(json.dumps({"car": {**TWO_QUARTERS, **given}})).car.car()


def test_a_car_that_is_the_same_fore_and_aft_has_the_modes_of_one_mass() -> None:
    """w^2 = 2 k / m and 2 k a^2 / J; D = c w / (2 k) for damping in proportion to the springs, beyond critical too."""
    car = HalfCar("same fore and aft", 1000.0, 1200.0, (1.4, 1.4), (30000.0, 30000.0), 0.0)
    for damping in (0.0, 2000.0, 12000.0):
        bounce, pitch = modes(car, damping)
        assert (bounce.name, pitch.name) == ("bounce", "pitch")
        for mode, square in ((bounce, 60.0), (pitch, 2.0 * 30000.0 * 1.4**2 / 1200.0)):
            w = np.sqrt(square)
            assert mode.frequency_Hz == pytest.approx(w / (2.0 * np.pi))
            assert mode.damping_ratio == pytest.approx(damping * w / (2.0 * 30000.0), abs=1e-7)


@pytest.mark.parametrize(("axle", "wheel", "tyre"), [(1, 80.0, 4.0e5), (2, 60.0, 5.0e5)])
def test_the_wheels_of_two_quarters_hop_as_their_closed_form(axle, wheel, tyre) -> None:
    """Roots of the biquadratic equation of a quarter car of the same wheels at both ends."""
    car = car_of(unsprung_mass_kg=[wheel, wheel], tyre_stiffness_N_per_m=[tyre, tyre])
    k, body = 40000.0, 600.0
    middle = (k + tyre) / wheel + k / body
    root = np.sqrt(middle**2 - 4.0 * k * tyre / (body * wheel))
    expected = np.sqrt([0.5 * (middle - root), 0.5 * (middle + root)]) / (2.0 * np.pi)
    found = modes(car, 0.0)
    assert [mode.frequency_Hz for mode in found] == pytest.approx([*[expected[0]] * 2, *[expected[1]] * 2])
    assert [mode.damping_ratio for mode in found] == pytest.approx([0.0] * 4, abs=1e-9)


def test_each_hop_is_at_its_own_axle() -> None:
    """At the heavier wheel on the softer tyre slowly, at the other quickly: near sqrt((k + k_t) / m_i)."""
    found = {mode.name: mode for mode in modes(car_of(), 500.0)}
    assert list(found) == ["bounce", "pitch", "wheel hop, axle 1", "wheel hop, axle 2"]
    for axle, wheel, tyre in ((1, 80.0, 4.0e5), (2, 60.0, 5.0e5)):
        hop = found[f"wheel hop, axle {axle}"]
        assert hop.frequency_Hz == pytest.approx(np.sqrt((40000.0 + tyre) / wheel) / (2.0 * np.pi), rel=0.01)
        alone = 500.0 / (2.0 * np.sqrt((40000.0 + tyre) * wheel))
        assert hop.damping_ratio == pytest.approx(alone, rel=0.03)


@pytest.mark.parametrize("damping", [300.0, 4500.0])
@pytest.mark.parametrize("wheels", [True, False])
def test_the_modes_are_those_of_the_characteristic_polynomial(damping, wheels) -> None:
    """Its roots are found from the state space by another way: ratios -Re l / |l|, product of |l|."""
    car = car_of() if wheels else cars()["makowski2021"]
    M, K, C = matrices(car, damping)
    n = len(M)
    inverse = np.linalg.inv(M)
    roots = np.roots(np.poly(np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ C]])))
    upper = roots[roots.imag > 0.0]
    found = modes(car, damping)
    assert len(found) == len(upper) == n
    assert sorted(mode.damping_ratio for mode in found) == pytest.approx(sorted(-upper.real / np.abs(upper)), rel=1e-6)
    product = np.prod([2.0 * np.pi * mode.frequency_Hz for mode in found])
    assert product == pytest.approx(np.prod(np.abs(upper)), rel=1e-6)
