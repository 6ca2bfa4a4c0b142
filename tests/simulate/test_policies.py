"""The laws that control the dampers: closed forms, limits, mirrored roads, and what no policy may ask for."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.linalg import solve_continuous_lyapunov

from pzd.quantities import GRAVITY
from pzd.schema.model import Frozen
from pzd.simulate.config import SimulateConfig
from pzd.simulate.control.demand import (
    SMALLEST,
    TIE_BREAKS,
    farther_end,
    is_hard,
    least_acceleration_forces,
    least_load_forces,
    switched_force,
)
from pzd.simulate.policies import clipped_lqr, policies, wheel_load
from pzd.simulate.policies.clipped_lqr import ClippedLqr, regulator
from pzd.simulate.ride.model import dynamic_damper_of, grid_of
from pzd.simulate.ride.riding import ride_case
from pzd.simulate.roads import Way
from pzd.simulate.study.plan import Case
from pzd.simulate.vehicle.car import HalfCar

SHORT = {"duration_s": 3.0, "settle_s": 1.0, "output_rate_Hz": 1000.0}
SYMMETRIC = {"a1_m": 1.5, "a2_m": 1.5, "pitch_inertia_kgm2": 2700.0, "x_K_m": 0.0, "mass_kg": 1200.0}
"""J_y = m a1 a2: the ends of this car do not feel each other, so that each is a quarter car of half the mass."""
C_MIN, C_MAX, STIFFNESS, QUARTER = 750.0, 45000.0, 47500.0, 600.0
DEFLECTION, RATE, DAMPER, VOLTAGE = 4, 5, 7, 9
FITTING = {name: policy for name, policy in policies().items() if policy.fits != "wheels with mass"}
"""Those that fit the paper's car."""
CONTROLLED = sorted(name for name, policy in FITTING.items() if policy.controlled)
SWITCHED = sorted(name for name, policy in policies().items() if policy.aim == "switch")
FORCES = [name for name in CONTROLLED if policies()[name].aim != "predict"]
"""Those that ask for a force."""
SENSED_BY_LQR = [0, 1, 6, 7]
"""U_1, U_2, dz, dphi among what a feedback may sense."""


def gains_of(car: HalfCar, weights: ClippedLqr) -> np.ndarray:
    """(2, 4) of T on (U_1, U_2, dz, dphi)."""
    return clipped_lqr.regulator_feedback(car, 0.0, weights)[:, SENSED_BY_LQR]


# ---------------------------------------------------------------- laws that switch


@pytest.mark.parametrize(
    ("rate", "velocity", "acceleration", "crossover", "hard"),
    [
        (0.1, 0.2, -3.0, np.inf, True),  # skyhook: the velocity alone
        (0.1, -0.2, 3.0, np.inf, False),
        (-0.1, -0.2, 3.0, np.inf, True),
        (0.1, 0.2, -3.0, 0.0, False),  # ADD: the acceleration alone
        (-0.1, 0.2, -3.0, 0.0, True),
        (0.1, 0.2, -3.0, 15.1, True),  # SH-ADD: 3.0 < 15.1 * 0.2, so the velocity
        (0.1, 0.2, -3.0, 14.9, False),  # and 3.0 > 14.9 * 0.2, so the acceleration
        (0.1, 0.0, -3.0, np.inf, False),
    ],
)
def test_a_damper_is_hard_where_it_pulls_the_body_against_what_decides(
    rate, velocity, acceleration, crossover, hard
) -> None:
    assert is_hard(rate, velocity, acceleration, crossover) == hard
    assert is_hard(-rate, -velocity, -acceleration, crossover) == hard


def test_hard_is_the_end_of_the_box_farther_from_the_softest_on_either_side() -> None:
    assert switched_force(True, 0.1, 300.0, 1300.0) == 1300.0
    assert switched_force(False, 0.1, 300.0, 1300.0) == 300.0
    assert switched_force(True, -0.1, -1300.0, -300.0) == -1300.0
    assert switched_force(False, -0.0, -1300.0, -300.0) == -300.0


@pytest.mark.parametrize("policy", SWITCHED)
def test_every_choice_of_a_ride_is_that_of_the_published_law(ride, policy) -> None:
    """On uncoupled axles: hard where p V > 0, with what is sensed under the choice before; p by hand for each law."""
    crossover = 2.0 * np.pi * 1.3
    history = ride(policy, car=SYMMETRIC, skyhook_add={"crossover_Hz": 1.3}, **SHORT).history
    time, compared = history[:, 0], set()
    for axle, late in ((0, 0.0), (6, 3.0 / 25.0)):
        u, v, force = (history[:, column + axle] for column in (DEFLECTION, RATE, DAMPER))
        moving = np.abs(v) > 1e-6
        chosen = np.where(moving, force / np.where(moving, v, 1.0), 0.0)
        body = v + 0.02 * 2.25 * 2.0 * np.pi * np.cos(2.25 * 2.0 * np.pi * (time - late))
        acceleration = -(STIFFNESS * u[1:] + chosen[:-1] * v[1:]) / QUARTER
        fast = np.abs(acceleration) > crossover * np.abs(body[1:])
        decides = {
            "add": acceleration,
            "skyhook_two_state": body[1:],
            "skyhook_add": np.where(fast, acceleration, body[1:]),
            "balance": -u[1:],
        }[policy]
        decided = moving[1:] & moving[:-1] & (np.abs(decides) > 1e-6)
        expected = np.where(decides * v[1:] > 0.0, C_MAX, C_MIN)
        assert chosen[1:][decided] == pytest.approx(expected[decided], rel=1e-9)
        compared |= set(expected[decided])
        assert decided.sum() > 2000
    assert compared == {C_MIN, C_MAX}


@pytest.mark.parametrize(("crossover", "limit"), [(0.0, "add"), (1e12, "skyhook_two_state")])
@pytest.mark.parametrize("fidelity", ["ideal", "dynamic"])
def test_sh_add_is_add_above_its_crossover_and_skyhook_below(ride, crossover, limit, fidelity) -> None:
    mixed = ride("skyhook_add", fidelity, skyhook_add={"crossover_Hz": crossover}, **SHORT)
    assert np.array_equal(mixed.history, ride(limit, fidelity, **SHORT).history)
    between = ride("skyhook_add", fidelity, **SHORT)
    assert not np.allclose(mixed.history, between.history)


def test_add_alternates_where_the_spring_lies_between_a_soft_and_a_hard_damper(ride) -> None:
    """c_min V^2 < -k U V < c_max V^2: hard accelerates the body one way and soft the other, so each calls for the other
    a control period later; no valve and no wheel smooths that here."""
    history = ride("add", car=SYMMETRIC, **SHORT).history
    for axle in (0, 6):
        u, v, force = (history[:, column + axle] for column in (DEFLECTION, RATE, DAMPER))
        pull = -STIFFNESS * u * v
        between = (pull > 1.01 * C_MIN * v * v) & (pull < 0.99 * C_MAX * v * v) & (np.abs(v) > 1e-4)
        both = between[1:] & between[:-1] & (v[1:] * v[:-1] > 0.0)
        hard = force / v > 0.5 * C_MAX
        assert both.sum() > 100
        assert np.all(hard[1:][both] != hard[:-1][both])


# ---------------------------------------------------------------- the regulator


def test_the_regulator_weighs_what_its_page_says(rng: np.random.Generator) -> None:
    """x^T Q x + T^T R T + 2 x^T N T against a_K, loads and deflections by the equations of the car."""
    car, weights = HalfCar("own", 900.0, 1500.0, (1.2, 1.6), (30e3, 41e3), -0.4), ClippedLqr(load_weight=0.3)
    A, B, Q, R, N = regulator(car, weights)
    for _ in range(20):
        x, T = rng.normal(size=4) * [0.02, 0.02, 0.3, 0.2], rng.normal(size=2) * 800.0
        loads = np.array(car.stiffnesses) * x[:2] + T
        body = car.acceleration(loads)
        carried = np.array(car.static_loads()) / GRAVITY
        expected = (
            (body[0] + car.comfort_point * body[1]) ** 2
            + 0.3 * np.sum((loads / carried) ** 2)
            + weights.deflection_weight_per_s4 * np.sum(x[:2] ** 2)
        )
        assert x @ Q @ x + T @ R @ T + 2.0 * x @ N @ T == pytest.approx(expected, rel=1e-12)
        rise = np.array([x[2] - 1.2 * x[3], x[2] + 1.6 * x[3]])
        assert A @ x + B @ T == pytest.approx(np.concatenate([rise, body]), rel=1e-12)


@pytest.mark.parametrize("weights", [{}, {"load_weight": 2.0, "deflection_weight_per_s4": 30.0}])
def test_the_gains_are_those_of_newtons_iteration_on_lyapunov_equations(weights) -> None:
    """Kleinman 1968, IEEE Trans. Automatic Control 13(1), from plain damping on; no Riccati solver in it."""
    car = SimulateConfig().car.car()
    A, B, Q, R, N = regulator(car, ClippedLqr(**weights))
    G = np.hstack([np.zeros((2, 2)), 4500.0 * car.force_directions().T])
    for _ in range(30):
        closed, cost = A + B @ G, Q + N @ G + (N @ G).T + G.T @ R @ G
        P = solve_continuous_lyapunov(closed.T, -cost)
        G = -np.linalg.solve(R, B.T @ P + N.T)
    found = gains_of(car, ClippedLqr(**weights))
    assert np.max(np.abs(found - G) / np.max(np.abs(G), axis=0)) < 1e-8


def test_the_gains_of_a_car_of_two_quarters_are_closed_forms() -> None:
    """Heave and pitch part: w^4 is the ratio of the weights, and the body swings at w, damped by 1 / sqrt(2)."""
    car = HalfCar("two quarters", 1200.0, 2700.0, (1.5, 1.5), (STIFFNESS, STIFFNESS), 0.0)
    load, deflection = 0.25, 700.0
    found = gains_of(car, ClippedLqr(load_weight=load, deflection_weight_per_s4=deflection))
    heave = (2.0 * deflection / (1.0 + 2.0 * load)) ** 0.25
    pitch = (deflection / load) ** 0.25
    for axle, arm in ((0, -1.5), (1, 1.5)):
        own, other = (heave**2 + pitch**2) / 2.0, (heave**2 - pitch**2) / 2.0
        expected = np.empty(4)
        expected[axle], expected[1 - axle] = QUARTER * own - STIFFNESS, QUARTER * other
        expected[2:] = QUARTER * np.sqrt(2.0) * np.array([heave, arm * pitch])
        assert found[axle] == pytest.approx(expected, rel=1e-9)


def test_where_only_the_loads_count_the_regulator_cancels_the_springs() -> None:
    car = SimulateConfig().car.car()
    limit = wheel_load.wheel_load(car, 0.0, Frozen())[:, SENSED_BY_LQR]
    apart = []
    for weight in (1e2, 1e6, 1e10):
        gains = gains_of(car, ClippedLqr(load_weight=weight))
        apart.append(float(np.max(np.abs(gains - limit)) / STIFFNESS))
    assert apart[0] > 3.0 * apart[1] > 9.0 * apart[2]
    assert apart[2] < 2e-3


def test_another_feedback_costs_more_than_the_regulator(rng: np.random.Generator) -> None:
    """Cost from random starts under G + dG, by Lyapunov's equation."""
    car = SimulateConfig().car.car()
    A, B, Q, R, N = regulator(car, ClippedLqr())

    def cost(G: np.ndarray) -> float:
        whole = Q + N @ G + (N @ G).T + G.T @ R @ G
        return float(np.trace(solve_continuous_lyapunov((A + B @ G).T, -whole)))

    G = gains_of(car, ClippedLqr())
    for _ in range(20):
        assert cost(G * (1.0 + 0.05 * rng.normal(size=G.shape))) > cost(G)


# ---------------------------------------------------------------- all of them


@pytest.mark.parametrize("policy", FORCES)
def test_no_policy_asks_for_a_voltage_beyond_the_table(ride, policy) -> None:
    history = ride(policy, "table", roads=[{"kind": "iso8608", "road_class": "C", "seed": 3}], **SHORT).history
    for axle in (0, 6):
        voltage = history[:, VOLTAGE + axle]
        assert np.min(voltage) >= 0.0
        assert np.max(voltage) <= 150.0
        assert np.ptp(voltage) > 50.0


@pytest.mark.parametrize("policy", [name for name in FORCES if policies()[name].aim != "minimise"])
@pytest.mark.parametrize("fidelity", ["ideal", "table"])
def test_on_the_mirrored_road_a_policy_sets_the_same_voltages(damper, table, policy, fidelity) -> None:
    """The table is the same in both directions, so negated states ask for negated forces."""
    config = SimulateConfig.model_validate_json(
        json.dumps({"roads": [{"kind": "iso8608", "road_class": "C", "seed": 3}], "bounds": "table", **SHORT})
    )
    case, speed = Case(config.roads[0], policies()[policy], fidelity, plain=False), 25.0
    profile = case.road.profile(Way(speed, speed * config.duration_s, 1, Path()))
    histories = []
    for sign in (1.0, -1.0):
        mirrored = replace(profile, coefficients=sign * profile.coefficients)
        grid, dynamic = grid_of(table, None), dynamic_damper_of(damper, 22.0, 0.0039)
        histories.append(ride_case(config, case, mirrored, grid, dynamic, ends=False).history)
    up, down = histories
    scale = np.max(np.abs(up), axis=0)
    odd = [1, 2, 3, *(column + axle for axle in (0, 6) for column in (4, 5, 6, 7))]
    assert np.max(np.abs(up[:, odd] + down[:, odd]) / scale[odd]) < 1e-6
    if fidelity == "table":
        assert np.max(np.abs(up[:, [9, 15]] - down[:, [9, 15]])) < 1e-3


@pytest.mark.parametrize("tie_break", TIE_BREAKS)
def test_mirrored_springs_and_boxes_ask_for_mirrored_forces_of_least_acceleration(rng, tie_break) -> None:
    """Of the law alone: at a_K = 0 a ride may follow either of two courses, which rounding parts."""
    for _ in range(200):
        D, v, a0 = tuple(rng.normal(size=2) / 600.0), rng.normal(size=2), float(rng.normal())
        ends = np.stack([C_MIN * v, C_MAX * v]) * 0.2
        low, high, found = ends.min(axis=0), ends.max(axis=0), []
        for sign, box in ((1.0, (low, high)), (-1.0, (-high, -low))):
            forces = np.empty(2)
            branch = farther_end(sign * a0, D, *box)
            least_acceleration_forces(sign * a0, D, *box, TIE_BREAKS[tie_break], branch, forces)
            found.append(forces)
        assert found[0] == pytest.approx(-found[1], rel=1e-9, abs=1e-9)


@pytest.mark.ci
@pytest.mark.parametrize("policy", [*CONTROLLED, "constant"])
@pytest.mark.parametrize("road", [{"kind": "iso8608", "road_class": "B"}, {"kind": "bump"}])
def test_the_energies_balance_where_little_is_dissipated(ride, policy, road) -> None:
    """A smooth road and a single bump, with the damper's own dynamics and its voltage set anew every millisecond."""
    outcome = ride(policy, "dynamic", roads=[road], duration_s=6.0, settle_s=1.0)
    assert abs(outcome.energy_error) < 2e-7


@pytest.mark.parametrize("tie_break", ["smallest", "largest"])
def test_a_tie_break_by_name_of_the_policy_goes_before_that_of_the_config(ride, tie_break) -> None:
    named = ride(f"comfort_{tie_break}", tie_break="equal_share", **SHORT)
    assert np.array_equal(named.history, ride("comfort", tie_break=tie_break, **SHORT).history)
    assert not np.allclose(named.history, ride("comfort", tie_break="equal_share", **SHORT).history)


def test_least_load_is_so_among_all_that_reach_the_least_acceleration(rng) -> None:
    """Against a fine scan of the line a_K = 0 through the box; where a_K = 0 is out of reach, the law has no choice."""
    compared = 0
    for _ in range(300):
        D, v, springs = tuple(rng.normal(size=2) / 600.0), rng.normal(size=2), tuple(rng.normal(size=2) * 1500.0)
        ends = np.stack([C_MIN * v, C_MAX * v]) * 0.2
        low, high, found, smallest = ends.min(axis=0), ends.max(axis=0), np.empty(2), np.empty(2)
        least_load_forces(springs, D, low, high, found)
        a0 = float(np.dot(D, springs))
        least_acceleration_forces(a0, D, low, high, SMALLEST, 0, smallest)
        assert abs(a0 + np.dot(D, found)) == pytest.approx(abs(a0 + np.dot(D, smallest)), abs=1e-9)
        assert np.all((low <= found) & (found <= high))
        first = np.linspace(low[0], high[0], 4001)
        second = (-a0 - D[0] * first) / D[1]
        within = (second >= low[1]) & (second <= high[1])
        loads = np.hypot(first + springs[0], second + springs[1])[within]
        if loads.size:
            assert np.hypot(*(found + springs)) <= loads.min() + 1e-6
            compared += np.hypot(*(found + springs)) < np.hypot(*(smallest + springs)) - 1.0
    assert compared > 30


def test_a_policy_that_is_not_known_is_refused_with_those_that_are() -> None:
    with pytest.raises(ValidationError, match=r"no policy is called skyhok; there are add, balance"):
        SimulateConfig(policies=("skyhok",))
