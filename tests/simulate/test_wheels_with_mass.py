"""Cars whose wheels have mass: closed forms, a linear solver of others, flight, energies, and what cannot be ridden."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.linalg import expm
from scipy.signal import lsim

from pzd.quantities import GRAVITY
from pzd.simulate.config import SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.roads import Way
from pzd.simulate.vehicle.car import HalfCar
from pzd.simulate.vehicle.suspension import contact_force, tyre_energy, tyre_spring_force

WHEELS = {
    "unsprung_mass_kg": [90.0, 80.0],
    "tyre_stiffness_N_per_m": [4.0e5, 3.6e5],
    "tyre_damping_Ns_per_m": [150.0, 120.0],
}
QUARTERS = {
    "mass_kg": 1200.0,
    "a1_m": 1.5,
    "a2_m": 1.5,
    "pitch_inertia_kgm2": 2700.0,
    "x_K_m": -1.5,
    "unsprung_mass_kg": [80.0, 80.0],
    "tyre_stiffness_N_per_m": [4.0e5, 4.0e5],
    "tyre_damping_Ns_per_m": [200.0, 200.0],
}
"""J_y = m a1 a2: the ends do not feel each other, so that each is a quarter car of 600 kg; K stands above axle 1."""
SPEED, C, K = 25.0, 4500.0, 47500.0
FINE = {"duration_s": 6.0, "settle_s": 1.0, "output_rate_Hz": 1000.0}
ROUGH = [{"kind": "sine", "frequency_Hz": 9.0, "amplitude_m": 0.02}]
"""Wheels on it leave the road in every wave."""
BUMPY = [{"kind": "bump", "height_m": 0.1, "length_m": 1.0}]


def car_of(given: dict[str, object]) -> HalfCar:
    return SimulateConfig.model_validate_json(json.dumps({"car": given})).car.car()


def free_matrices(car) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, K, C of z, phi and the wheels off the road, written out by hand."""
    (a1, a2), (k1, k2) = car.distances, car.stiffnesses
    M = np.diag([car.mass, car.pitch_inertia, *car.unsprung_masses])
    shape = np.array([[1.0, -a1, -1.0, 0.0], [1.0, a2, 0.0, -1.0]])
    stiff = sum(k * np.outer(row, row) for k, row in zip((k1, k2), shape, strict=True))
    damped = sum(C * np.outer(row, row) for row in shape)
    return M, stiff, damped


def heights_of(outcome, car) -> np.ndarray:
    """(n, 4) z, phi and the heights of the wheels of a history."""
    history = outcome.history
    body, u = history[:, 1:3], history[:, [4, 10]]
    return np.hstack([body, body @ car.force_directions() - u])


# ---------------------------------------------------------------- linear cars


@pytest.mark.parametrize("frequency", [1.3, 4.5, 11.0])
def test_a_quarter_car_on_a_sine_is_its_transfer_function(ride, frequency) -> None:
    """Two masses, closed form: z = (k + i w c)(k_t + i w c_t) / det, and the load of the tyre."""
    road = [{"kind": "sine", "frequency_Hz": frequency, "amplitude_m": 1e-3}]
    outcome = ride("constant", car=QUARTERS, roads=road, duration_s=12.0, settle_s=8.0, output_rate_Hz=1000.0)
    w = 2.0 * np.pi * frequency
    suspension, tyre = K + 1j * w * C, 4.0e5 + 1j * w * 200.0
    det = (suspension - w * w * 600.0) * (suspension + tyre - w * w * 80.0) - suspension**2
    body = 1e-3 * suspension * tyre / det
    wheel = body * (suspension - w * w * 600.0) / suspension
    turn = np.exp(1j * w * outcome.history[8000:, 0])
    found = heights_of(outcome, car_of(QUARTERS))[8000:]
    for expected, values in (
        (body, found[:, 0] - 1.5 * found[:, 1]),
        (wheel, found[:, 2]),
        (-w * w * body, outcome.history[8000:, 3]),
        (tyre * (wheel - 1e-3), outcome.loads[8000:, 0]),
    ):
        assert np.max(np.abs((expected * turn).imag - values)) < 1e-6 * abs(expected)


def test_a_car_over_a_step_is_that_of_a_linear_solver(ride) -> None:
    """scipy.signal.lsim on the state space written out by hand; both axles, different wheels, the wheels stay down."""
    config = SimulateConfig.model_validate_json(json.dumps({"car": WHEELS, **FINE}))
    road = [{"kind": "step", "height_m": 0.01, "length_m": 2.0, "start_m": 10.0}]
    outcome, car = ride("constant", car=WHEELS, roads=road, **FINE), config.car.car()
    profile = (
        SimulateConfig.model_validate_json(json.dumps({"roads": road}))
        .roads[0]
        .profile(Way(SPEED, SPEED * 6.0, 1, Path()))
    )
    M, stiff, damped = free_matrices(car)
    tyres, losses = np.diag([0.0, 0.0, 4.0e5, 3.6e5]), np.diag([0.0, 0.0, 150.0, 120.0])
    inverse = np.linalg.inv(M)
    A = np.block([[np.zeros((4, 4)), np.eye(4)], [-inverse @ (stiff + tyres), -inverse @ (damped + losses)]])
    B = np.zeros((8, 4))
    B[6:, :2], B[6:, 2:] = np.diag([4.0e5 / 90.0, 3.6e5 / 80.0]), np.diag([150.0 / 90.0, 120.0 / 80.0])
    time = np.arange(0.0, 6.0 + 5e-5, 1e-4)
    under = np.stack([profile.height(SPEED * time), profile.height(SPEED * time - car.wheelbase)], axis=1)
    rates = np.gradient(under, time, axis=0, edge_order=2)
    _, _, states = lsim((A, B, np.eye(8), np.zeros((8, 4))), np.hstack([under, rates]), time)
    found, expected = heights_of(outcome, car), states[::10, :4]
    assert np.min(np.array(car.static_loads()) - outcome.loads) > 0.0
    assert np.max(np.abs(found - expected), axis=0) == pytest.approx(0.0, abs=2e-6 * 0.01)


def test_on_hard_tyres_light_wheels_follow_the_road(ride) -> None:
    """The paper's car is the limit: what is left falls as m_i and 1 / k_t."""
    road = {"kind": "sine", "frequency_Hz": 2.25, "amplitude_m": 0.002}
    given = {"roads": [road], "duration_s": 3.0, "settle_s": 1.0}
    paper, apart = ride("constant", **given).history[1000:, 3], []
    for mass in (1.0, 0.25):
        car = {
            "unsprung_mass_kg": [mass, mass],
            "tyre_stiffness_N_per_m": [1e7 / mass] * 2,
            "tyre_damping_Ns_per_m": [3e3] * 2,
        }
        wheels = ride("constant", car=car, **given).history[1000:, 3]
        apart.append(np.max(np.abs(wheels - paper)) / np.max(np.abs(paper)))
    assert apart[0] < 0.01
    assert apart[1] == pytest.approx(apart[0] / 4.0, rel=0.1)


# ---------------------------------------------------------------- off the road


def test_the_contact_force_never_pulls_and_the_tyre_never_gives_more_than_it_stored(rng: np.random.Generator) -> None:
    for squeeze, rate in rng.normal(size=(2000, 2)) * [0.02, 1.0]:
        contact = contact_force(4000.0, 4e5, 150.0, squeeze, rate)
        assert contact >= -4000.0
        assert (contact - tyre_spring_force(4000.0, 4e5, squeeze)) * rate >= 0.0
    squeeze = np.linspace(-0.03, 0.03, 60001)
    force = [tyre_spring_force(4000.0, 4e5, s) for s in squeeze]
    work = np.concatenate([[0.0], np.cumsum(np.diff(squeeze) * 0.5 * (np.array(force[:-1]) + force[1:]))])
    energy = np.array([tyre_energy(4000.0, 4e5, s) for s in squeeze])
    assert energy - energy[0] == pytest.approx(work, abs=1e-5)


def test_a_wheel_off_the_road_moves_as_its_closed_form(ride) -> None:
    """From one step in the air to the last: body and that wheel are linear, and carry the static load as a weight."""
    car = car_of(WHEELS)
    outcome = ride("constant", car=WHEELS, roads=BUMPY, duration_s=3.0, settle_s=1.0, output_rate_Hz=1000.0)
    static = np.array(car.static_loads())
    contact = static - outcome.loads
    one = np.flatnonzero(contact[:518, 0] == 0.0)  # axle 2 meets the bump after 0.518 s
    assert contact.min() == 0.0
    first = one[0]
    last = first + int(np.argmax(np.diff(one, append=one[-1] + 2) > 1))
    M, stiff, damped = free_matrices(car)
    stiff[3, 3], damped[3, 3] = stiff[3, 3] + 3.6e5, damped[3, 3] + 120.0
    inverse = np.linalg.inv(M)
    # axle 2 is still ahead of the bump, on a level road; the last entry is 1, for the static load of axle 1
    A = np.zeros((9, 9))
    A[:4, 4:8], A[4:8, :4], A[4:8, 4:8] = np.eye(4), -inverse @ stiff, -inverse @ damped
    A[6, 8] = -static[0] / car.unsprung_masses[0]
    heights = heights_of(outcome, car)[first : last + 1]
    assert last - first > 10
    flown = [expm(A * 1e-3 * n) for n in range(last - first + 1)]
    known = np.concatenate([heights[0], np.zeros(4), [1.0]])
    others = np.concatenate([height - (A_n @ known)[:4] for A_n, height in zip(flown, heights, strict=True)])
    rates, *_ = np.linalg.lstsq(np.vstack([A_n[:4, 4:8] for A_n in flown]), others)  # the one unknown
    known[4:8] = rates
    for A_n, height in zip(flown, heights, strict=True):
        assert (A_n @ known)[:4] == pytest.approx(height, abs=1e-9)
    assert rates == pytest.approx(_rates(outcome, car)[first], abs=1e-3)


def _rates(outcome, car) -> np.ndarray:
    """(n, 4) rates of z, phi and the wheels, by a spline through them."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(outcome.history[:, 0], heights_of(outcome, car))(outcome.history[:, 0], 1)


def test_a_car_that_stands_keeps_standing(ride) -> None:
    """On the level road before a bump nothing moves, and the road carries body and wheels."""
    road = [{"kind": "bump", "start_m": 50.0}]
    outcome = ride("passive", "dynamic", car=WHEELS, roads=road, duration_s=3.0, settle_s=1.0)
    assert np.max(np.abs(outcome.history[:900, 1:])) < 1e-12
    assert np.any(outcome.history[1100:, 1] != 0.0)
    car = car_of(WHEELS)
    assert sum(car.static_loads()) == pytest.approx((1200.0 + 170.0) * GRAVITY)
    moment = car.static_loads()[0] * car.distances[0] - car.static_loads()[1] * car.distances[1]
    assert moment == pytest.approx((90.0 * car.distances[0] - 80.0 * car.distances[1]) * GRAVITY)


# ---------------------------------------------------------------- policies


RIDDEN = sorted(policies())


@pytest.mark.parametrize("fidelity", ["ideal", "table", "dynamic"])
@pytest.mark.parametrize("policy", ["comfort", "groundhook", "skyhook_add", "clipped_lqr", "constant"])
def test_the_energies_balance_on_the_road_and_off_it(ride, policy, fidelity) -> None:
    for roads in (ROUGH, BUMPY):
        outcome = ride(policy, fidelity, car=WHEELS, roads=roads, duration_s=2.0, settle_s=0.5)
        assert np.min(np.array(car_of(WHEELS).static_loads()) - outcome.loads) == 0.0
        assert abs(outcome.energy_error) < 1e-6


@pytest.mark.ci
@pytest.mark.parametrize("fidelity", ["ideal", "table", "dynamic"])
@pytest.mark.parametrize("policy", RIDDEN)
def test_every_policy_that_fits_rides_on_every_kind_of_road(ride, policy, fidelity) -> None:
    if fidelity == "ideal" and policies()[policy].aim in ("voltage", "predict"):
        pytest.skip("a voltage is no demanded force")
    if fidelity == "table" and policies()[policy].aim == "predict":
        pytest.skip("what it predicts is the damper with its dynamics")
    for road in ({"kind": "iso8608", "road_class": "C"}, {"kind": "sine", "frequency_Hz": 2.25}, BUMPY[0]):
        outcome = ride(policy, fidelity, car=WHEELS, roads=[road], bounds="table", duration_s=3.0, settle_s=1.0)
        assert abs(outcome.energy_error) < 1e-6


def test_the_wheel_sticks_to_the_body_where_dry_friction_holds_it(ride) -> None:
    """A slow sine of 1 mm: 301 N of friction are never overcome, so body and wheels swing as one on the tyres."""
    road = [{"kind": "sine", "frequency_Hz": 0.5, "amplitude_m": 0.001}]
    outcome = ride("passive", "table", car=WHEELS, roads=road, duration_s=4.0, settle_s=1.0)
    for axle in (0, 6):
        assert np.max(np.abs(outcome.history[100:, 5 + axle])) < 2e-9
    assert np.ptp(outcome.history[500:, 1]) > 1e-3
    assert abs(outcome.energy_error) < 1e-6


def test_a_groundhook_asks_for_a_damper_between_wheel_and_ground(ride) -> None:
    """Where its force is within reach, T = -c dzeta/dt; it calms the wheels of a skyhook car at their own frequency."""
    road = [{"kind": "sine", "frequency_Hz": 11.0, "amplitude_m": 0.003}]
    given = {"car": WHEELS, "roads": road, "duration_s": 3.0, "settle_s": 1.0, "output_rate_Hz": 1000.0}
    outcome = ride("groundhook", c_min_Ns_per_m=0.0, c_max_Ns_per_m=45000.0, **given)
    wheels = _rates(outcome, car_of(WHEELS))[1000:-10, 2:]
    for i, axle in enumerate((0, 6)):
        force, v = outcome.history[1000:-10, 7 + axle], outcome.history[1000:-10, 5 + axle]
        within = (-C * wheels[:, i] * v > 0.0) & (np.abs(C * wheels[:, i]) < 4.4e4 * np.abs(v))
        assert within.sum() > 500
        assert force[within] == pytest.approx(-C * wheels[within, i], abs=2.0)
    loads = [np.std(ride(name, **given).loads[1000:, 0]) for name in ("groundhook", "skyhook")]
    assert loads[0] < 0.8 * loads[1]


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"policies": ["groundhook"]}, r"policies\.0: groundhook damps the motion of wheels with mass.*unsprung_mass"),
        ({"car": {"unsprung_mass_kg": [90, 80]}}, "give tyre_stiffness_N_per_m as well"),
        ({"car": {"tyre_stiffness_N_per_m": [4e5, 4e5]}}, "give unsprung_mass_kg as well"),
        ({"car": {"tyre_damping_Ns_per_m": [100, 100]}}, "wheels without mass have no tyres"),
        ({"car": {**WHEELS, "tyre_damping_Ns_per_m": [-1, 100]}}, "greater than or equal to 0"),
        ({"car": {**WHEELS, "unsprung_mass_kg": [0, 80]}}, "greater than 0"),
    ],
)
def test_what_does_not_fit_is_refused(given, says) -> None:
    with pytest.raises(ValidationError, match=says):
        SimulateConfig.model_validate_json(json.dumps(given))
