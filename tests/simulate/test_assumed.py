"""What a ride assumes is said as long as the config does not say it, and no longer."""

from __future__ import annotations

import json

from pzd.simulate.config import SimulateConfig
from pzd.simulate.study.plan import assumed


def lines(given: dict[str, object], effects: tuple[str, ...] = (), with_voltage: bool = True) -> str:
    return "\n".join(assumed(SimulateConfig.model_validate_json(json.dumps(given)), effects, with_voltage))


def test_without_a_word_in_the_config_car_valve_and_bounds_are_assumed() -> None:
    said = lines({}).split("\n")
    assert len(said) == 5
    assert said[0] == "the car is makowski2021: 1200 kg on springs of 47.5 and 47.5 kN/m (simulate.car)"
    assert "3.9 ms" in said[1]
    assert "the damper's own table (simulate.bounds)" in said[2]
    assert "see the ride exactly and at once (simulate.sensors)" in said[3]
    assert "set exactly and at once (simulate.supply)" in said[4]


def test_what_the_config_says_is_not_assumed_though_it_is_the_default() -> None:
    said = {"car": {"model": "makowski2021"}, "valve_response_s": 0.0039, "bounds": "table"}
    said |= {"sensors": {}, "supply": {}}
    assert lines(said) == ""
    assert lines({**said, "bounds": None, "c_min_Ns_per_m": 750, "c_max_Ns_per_m": 45000}) == ""


def test_what_is_left_out_of_a_car_is_named() -> None:
    assert "of the car pitch_inertia_kgm2, a1_m, a2_m, spring_stiffness_N_per_m" in lines({"car": {"mass_kg": 900}})
    whole = {"mass_kg": 900, "pitch_inertia_kgm2": 1000, "a1_m": 1.2, "a2_m": 1.3, "x_K_m": -0.5}
    whole |= {"spring_stiffness_N_per_m": [3e4, 3e4], "motion_ratio": [1, 1], "dampers_per_axle": [2, 2]}
    assert "car" not in lines({"car": whole})
    assert "makowski2021: 1200 kg" in lines({"car": {"name": "my car"}})


def test_nothing_is_said_of_what_no_ride_needs() -> None:
    assert "valve" not in lines({}, effects=("valve_lag",))
    assert "valve" not in lines({"fidelities": ["ideal", "table"]})
    assert "bounds" not in lines({"fidelities": ["dynamic"]})
    assert "bounds" not in lines({"policies": ["constant", "passive"]})
    assert lines({}, with_voltage=False).startswith("the car is makowski2021")
    assert "simulate.sensors" not in lines({"fidelities": ["ideal"]})
    assert "simulate.supply" not in lines({"policies": ["constant", "passive"]})
    assert "\n" not in lines({}, with_voltage=False)
