"""What the controller sees is late, sampled and noisy as configured, and its supply moves no more than it can."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from pydantic import ValidationError

from pzd.simulate.config import CarBlock, SensorNoise, Sensors, SimulateConfig, Supply
from pzd.simulate.control.sensing import Electronics, electronics_of, sense, supplied, with_noise
from pzd.simulate.ride.model import Axle, State, at_rest, vehicle, workspace

SHORT = {"duration_s": 2.0, "settle_s": 1.0, "output_rate_Hz": 1000.0}
PERIOD = 1e-3
RATE_1, ASKED_1, VOLTAGE_1 = 5, 8, 9
PREDICTIVE = pytest.param("comfort_predictive", marks=pytest.mark.ci)
"""With electronics it takes half a minute to compile."""
EXACT = Sensors(period_s=PERIOD)
"""A sample in every control period, exact and at once: as without sensors, but on the way that sensors go."""
AT_ONCE = Supply()
CAR = vehicle(CarBlock().car(), 25.0)
NOISE = {
    "deflection_m": 1e-4,
    "deflection_rate_m_per_s": 5e-3,
    "heave_m": 2e-4,
    "pitch_rad": 1e-4,
    "heave_rate_m_per_s": 4e-3,
    "pitch_rate_rad_per_s": 2e-3,
    "acceleration_m_per_s2": 0.05,
}


def electronics(rng: np.random.Generator, acts: int, sensors: Sensors = EXACT, supply: Supply = AT_ONCE) -> Electronics:
    made = electronics_of(sensors, supply, PERIOD, at_rest(CAR).size, CAR.arms)
    assert made is not None
    return with_noise(made, rng, acts)


def seen_of(known: Electronics, acts: int) -> np.ndarray:
    """Heave, first deflection and age that the controller sees, act by act, of a ride whose heave counts the acts."""
    rows = []
    y, room = at_rest(CAR), workspace()
    for n in range(acts):
        y[State.HEAVE], room[Axle.DEFLECTION, 0] = float(n), -float(n)
        age = sense(y, CAR, room, known)
        rows.append((known.state[State.HEAVE], known.workspace[Axle.DEFLECTION, 0], age / PERIOD))
    return np.array(rows)


@pytest.mark.parametrize(("every", "delay"), [(1, 0), (1, 4), (3, 0), (3, 4), (4, 3), (5, 5)])
def test_the_controller_sees_the_last_sample_that_is_old_enough(rng, every, delay) -> None:
    known = electronics(rng, 40, Sensors(period_s=every * PERIOD, delay_s=delay * PERIOD))
    seen, acts = seen_of(known, 40), np.arange(40)
    expected = np.maximum(acts - delay, 0) // every * every
    assert np.array_equal(seen[:, 0], expected)
    assert np.array_equal(seen[:, 1], -expected)
    assert np.allclose(seen[:, 2], acts - expected)


def test_noise_has_the_deviation_of_each_sensor_and_is_white(rng) -> None:
    acts = 5_000
    known = electronics(rng, acts, Sensors(noise=SensorNoise(**NOISE)))
    y, room, rows = at_rest(CAR), workspace(), []
    for _ in range(acts):
        sense(y, CAR, room, known)
        state, seen = known.state, known.workspace
        rows.append([*seen[Axle.DEFLECTION], *seen[Axle.RATE], *state[:4], seen[Axle.BODY, 0]])
        assert seen[Axle.COMFORT, 0] == seen[Axle.BODY, 0]
        height = state[State.HEAVE] + CAR.arms[1] * state[State.PITCH] - seen[Axle.DEFLECTION, 1]
        rise = state[State.HEAVE_RATE] + CAR.arms[1] * state[State.PITCH_RATE] - seen[Axle.RATE, 1]
        assert known.road_error[:, 1] == pytest.approx([height, rise], abs=1e-15)
    errors = np.array(rows)
    given = [NOISE[name] for name in NOISE]
    expected = np.array([given[0], given[0], given[1], given[1], *given[2:]])
    # chance: the deviation of a deviation is 1 / sqrt(2 n) of it, that of a correlation 1 / sqrt(n); five of each
    assert np.allclose(errors.std(axis=0) / expected, 1.0, atol=5.0 / math.sqrt(2.0 * acts))
    apart = np.corrcoef(np.hstack([errors[1:], errors[:-1]]).T) - np.eye(2 * errors.shape[1])
    assert np.max(np.abs(apart)) < 5.0 / math.sqrt(acts)


def test_the_noise_is_the_same_in_pieces_as_at_once(generator_for) -> None:
    made = electronics_of(Sensors(noise=SensorNoise(heave_m=1.0)), AT_ONCE, PERIOD, 10, CAR.arms)
    assert made is not None
    whole = with_noise(made, generator_for("noise"), 30).noise
    drawing = generator_for("noise")
    pieces = [with_noise(made, drawing, acts).noise for acts in (7, 1, 22)]
    assert np.array_equal(np.vstack(pieces), whole)


@pytest.mark.parametrize("policy", ["comfort", "skyhook", PREDICTIVE])
def test_perfect_sensors_change_nothing(ride, policy) -> None:
    exact = ride(policy, "dynamic", **SHORT)
    perfect = ride(policy, "dynamic", sensors={"period_s": PERIOD}, **SHORT)
    assert np.array_equal(np.asarray(perfect.history), np.asarray(exact.history))


def test_a_late_force_is_asked_as_late_as_the_sensors_are(ride) -> None:
    """At fidelity `table` and before the late force has changed the ride: the force asked is that of 5 ms before."""
    gentle = {"roads": [{"kind": "sine", "frequency_Hz": 2.25, "amplitude_m": 1e-6}], "bounds": "table"}
    exact = np.asarray(ride("skyhook", "table", **gentle, **SHORT).history)
    late = np.asarray(ride("skyhook", "table", sensors={"delay_s": 0.005}, **gentle, **SHORT).history)
    first = slice(6, 10)
    assert np.allclose(late[first, ASKED_1], exact[1:5, ASKED_1], rtol=1e-6)
    assert np.max(np.abs(exact[first, ASKED_1])) > 0.0


@pytest.mark.parametrize("fidelity", ["table", "dynamic"])
def test_a_sample_that_is_held_holds_the_force(ride, fidelity) -> None:
    history = np.asarray(ride("comfort", fidelity, sensors={"period_s": 0.01}, bounds="table", **SHORT).history)
    asked = history[:-1, ASKED_1].reshape(-1, 10)
    assert np.array_equal(asked, np.repeat(asked[:, :1], 10, axis=1))
    assert np.unique(asked[:, 0]).size > 100


@pytest.mark.parametrize("policy", ["comfort", "skyhook", PREDICTIVE])
@pytest.mark.parametrize("wheels", [{}, {"unsprung_mass_kg": [90, 80], "tyre_stiffness_N_per_m": [4e5, 3.6e5]}])
def test_the_energies_balance_with_poor_sensors_and_a_weak_supply(ride, policy, wheels) -> None:
    """Whatever the controller does: what it sees and sets is no force of the ride by itself."""
    poor = {"period_s": 0.002, "delay_s": 0.003, "noise": NOISE}
    weak = {"step": 5.0, "power_W": 17.0, "capacitance_F": 1e-5}
    outcome = ride(policy, "dynamic", sensors=poor, supply=weak, car=wheels, bounds="table", **SHORT)
    assert abs(outcome.energy_error) < 1e-6
    exact = ride(policy, "dynamic", car=wheels, bounds="table", **SHORT)
    assert not np.array_equal(np.asarray(outcome.history)[:, VOLTAGE_1], np.asarray(exact.history)[:, VOLTAGE_1])


def test_a_power_charges_a_capacitance_as_the_root_of_time(rng) -> None:
    """U = sqrt(2 P t / C) from rest, and back as fast; through zero the energy goes down first."""
    power, capacitance = 17.0, 1e-3
    known = electronics(rng, 1, supply=Supply(power_W=power, capacitance_F=capacitance))
    voltage, course = 0.0, []
    for _ in range(100):
        voltage = supplied(150.0, voltage, -200.0, 200.0, known)
        course.append(voltage)
    times = PERIOD * np.arange(1, 101)
    assert np.allclose(course, np.sqrt(2.0 * power * times / capacitance), rtol=1e-12)
    back = [voltage := supplied(-150.0, voltage, -200.0, 200.0, known) for _ in range(100)]
    assert np.allclose(back[:99], course[98::-1], rtol=1e-9)
    assert supplied(-150.0, 0.0, -200.0, 200.0, known) == pytest.approx(-course[0])


def test_slew_steps_and_the_ends_of_the_table_bound_what_is_set(rng) -> None:
    slow = electronics(rng, 1, supply=Supply(slew_per_s=500.0))
    assert supplied(150.0, 10.0, 0.0, 150.0, slow) == pytest.approx(10.5)
    assert supplied(0.0, 10.0, 0.0, 150.0, slow) == pytest.approx(9.5)
    coarse = electronics(rng, 1, supply=Supply(step=0.4))
    assert supplied(10.05, 0.0, 0.0, 150.0, coarse) == pytest.approx(10.0)
    assert supplied(149.9, 0.0, 0.0, 149.8, coarse) == 149.8


def test_a_supply_whose_steps_are_wider_than_it_moves_in_a_period_arrives_all_the_same(rng) -> None:
    both = electronics(rng, 1, supply=Supply(step=5.0, slew_per_s=500.0))
    voltage = 0.0
    course = [voltage := supplied(11.0, voltage, 0.0, 150.0, both) for _ in range(25)]
    assert course[:3] == pytest.approx([0.5, 1.0, 1.5])
    assert course[-1] == pytest.approx(10.0)


def test_the_seed_decides_the_noise_of_a_ride(ride) -> None:
    # the delay, said as it is by default, has the ride ridden anew
    first, again, other = (
        np.asarray(ride("comfort", "table", sensors={"noise": NOISE, **given}, bounds="table", **SHORT).history)
        for given in ({"seed": 1}, {"seed": 1, "delay_s": 0.0}, {"seed": 2})
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first[:, VOLTAGE_1], other[:, VOLTAGE_1])


def test_in_a_ride_the_supply_moves_no_more_energy_than_its_power(ride) -> None:
    power, capacitance = 2.0, 1e-5
    weak = {"power_W": power, "capacitance_F": capacitance}
    history = np.asarray(ride("comfort", "table", supply=weak, bounds="table", **SHORT).history)
    moved = np.abs(np.diff(history[:, VOLTAGE_1] ** 2)) * capacitance / 2.0
    assert moved.max() == pytest.approx(power * PERIOD, rel=1e-9)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"sensors": {"period_s": 0.0015}}, r"sensors.period_s must be a whole number of control_period_s \(got 1.5"),
        ({"sensors": {"delay_s": 0.0004}}, r"sensors.delay_s must be a whole number of control_period_s \(got 0.4"),
        ({"supply": {"power_W": 17}}, "give capacitance_F as well"),
        ({"supply": {"capacitance_F": 1e-6}}, "give power_W as well"),
        ({"supply": {"step": 1}, "fidelities": ["ideal"]}, "supply: ideal forces need neither sensors nor a supply"),
        ({"sensors": {"noise": {"heave_m": -1}}}, "greater than or equal to 0"),
    ],
)
def test_what_cannot_be_is_refused(given, message) -> None:
    with pytest.raises(ValidationError, match=message):
        SimulateConfig.model_validate_json(json.dumps(given))
