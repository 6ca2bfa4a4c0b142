"""`comfort_predictive`: its plant against ours, what it knows of the road, and what it may do.

Its rides stand behind `make ci`: they take a minute to compile.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError
from simulate_dampers import table_of

from pzd.artefacts import Diagnosed
from pzd.comfort.weighting import WK, modes, response, weighted
from pzd.damper.element import element_force
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.schema.errors import ConfigError
from pzd.signals.measures import rms
from pzd.simulate.config import KM_PER_H, SimulateConfig
from pzd.simulate.control.prediction.choice import choose
from pzd.simulate.control.prediction.plant import oil_after, predicted
from pzd.simulate.control.prediction.predictor import Plant, Predictor, States, Step, predictor_of
from pzd.simulate.policies import policies
from pzd.simulate.ride.equations import motion
from pzd.simulate.ride.loop import set_control
from pzd.simulate.ride.model import (
    Axle,
    RideModel,
    RunningRide,
    State,
    at_rest,
    dynamic_damper_of,
    grid_of,
    ride_of,
    road_coefficients,
    vehicle,
)
from pzd.simulate.ride.riding import FixedValues, control_spec_of
from pzd.simulate.ride.stepper import advance, integrator_of
from pzd.simulate.roads import Way
from pzd.simulate.stage import simulate
from pzd.simulate.study.plan import Case

SHORT = {"duration_s": 4.0, "settle_s": 1.0, "output_rate_Hz": 1000.0}
TIME, A_K, VOLTAGE_1, VOLTAGE_2 = 0, 3, 9, 15
STEP = 1e-3
WHEELS_ON_TYRES = {
    "unsprung_mass_kg": [90.0, 80.0],
    "tyre_stiffness_N_per_m": [4.0e5, 3.6e5],
    "tyre_damping_Ns_per_m": [150.0, 120.0],
}
EFFECTS = {
    "plain": {},
    "orifice and lash": {"orifice_quadratic": {"q": 2500.0}, "lash": {"delta": 3e-4}},
    "thinning, by direction": {"shear_thinning": {"n": 0.8}, "asymmetry": {"alpha": 0.1}},
    "beside the element": {"gas_spring": {"k_g": 20e3}, "preload_offset": {"F_0": 200.0}},
    "relief": {"relief_valve": {"F_r": 1000.0, "C_r": 900.0}, "rounded_yield": {"w_s": 0.005}},
}


def settings(**given: object) -> SimulateConfig:
    return SimulateConfig.model_validate_json(json.dumps({"policies": ["comfort_predictive"], **given}))


def model_of(damper: Damper, policy: str, voltage: float, **given: object) -> tuple[RideModel, Predictor]:
    """A ride on the paper's first road, and what predicts it."""
    config = settings(**given)
    speed, car = config.vehicle_speed_km_per_h * KM_PER_H, config.car.car()
    case = Case(config.roads[0], policies()[policy], "dynamic", plain=False)
    dynamic, grid = dynamic_damper_of(damper, 22.0, config.valve_response_s), grid_of(table_of(damper), None)
    model = RideModel(
        vehicle(car, speed),
        road_coefficients(case.road.profile(Way(speed, speed * config.duration_s, 1, Path())), car.wheelbase),
        control_spec_of(config, case, car, dynamic, FixedValues(voltage, 0.0)),
        grid,
        dynamic,
        grid,
        dynamic,
    )
    return model, predictor_of(config.comfort_predictive, config.control_period_s, dynamic, car, speed, grid.voltages)


def ahead(y, ride: RunningRide, start: float, seconds: float) -> np.ndarray:
    """Bring a ride forward by the integrator of the loop, its voltage set once at the start; the largest motion."""
    peak = np.abs(y)
    scratch, integrator = np.zeros_like(y), integrator_of(1e-9, y.size)
    set_control(start, y, ride, None, None, scratch)
    for n in range(round(seconds / STEP)):
        advance(start + n * STEP, STEP, y, ride, integrator, STEP)
        peak = np.maximum(peak, np.abs(y))
    motion(start + seconds, y, ride, scratch)
    return peak


@pytest.mark.parametrize("effects", list(EFFECTS))
@pytest.mark.parametrize("candidate", [0, pytest.param(2, marks=pytest.mark.ci)])
@pytest.mark.parametrize("car", [{}, WHEELS_ON_TYRES], ids=["wheels follow the road", "wheels with mass"])
@pytest.mark.parametrize(
    ("step", "motion_off", "a_K_off"), [(1e-3, 2e-3, 0.02), pytest.param(1.25e-4, 3e-4, 4e-3, marks=pytest.mark.ci)]
)
def test_the_plant_goes_where_the_ride_goes_for_20_ms(
    damper, effects, candidate, car, step, motion_off, a_K_off, monkeypatch
) -> None:
    """From a moment of a ride, a voltage set anew: body [share of its largest motion] and a_K [m/s2] at the end.

    In the steps of the policy, where the oil may stick or slip up to a step late, and in an eighth of them, where about
    a sixth of the error is left: it comes of the step, and of no equation.
    """
    monkeypatch.setattr("pzd.simulate.control.prediction.predictor.HOLD_STEP", step)
    for name, values in EFFECTS[effects].items():
        damper = damper.with_effect(name, values)
    road = [{"kind": "iso8608", "road_class": "C", "seed": 1}]
    given = {"roads": road, "car": car, "comfort_predictive": {"road": "known", "hold_s": 0.02, "horizon_s": 0.04}}
    before = ride_of(model_of(damper, "passive", 75.0, **given)[0])
    y, room = at_rest(before.model.car), before.workspace
    peak = ahead(y, before, 0.0, 1.5)
    predicting, plan = model_of(damper, "comfort_predictive", 75.0, **given)
    choose(1.5, 0.0, y, before._replace(model=predicting), plan)
    state, levels = np.array(plan.workspace.states[States.NOW]), plan.workspace.hold_levels
    predicted(
        predicting.car,
        plan,
        state,
        levels[0, candidate],
        levels[1, candidate],
        plan.workspace.hold_heights[0],
        Step.HELD,
        1e9,
    )
    after, _ = model_of(damper, "passive", float(plan.candidates[candidate]), **given)
    ahead(y, before._replace(model=after), 1.5, 0.02)
    assert np.max(np.abs(state[: State.OIL_1] - y[: State.OIL_1]) / peak[: State.OIL_1]) < motion_off
    if car:
        wheels = slice(State.WHEEL_1, State.WHEEL_RATE_2 + 1)
        assert np.max(np.abs(state[Plant.WHEELS : Plant.WHEELS + 4] - y[wheels]) / peak[wheels]) < 5.0 * motion_off
        assert state[Plant.LOAD_1 : Plant.LOAD_2 + 1] == pytest.approx(
            -room[Axle.CONTACT], abs=0.01 * max(predicting.car.static_load)
        )
        return
    a_K = predicting.car.comfort[0] * state[Plant.LOAD_1] + predicting.car.comfort[1] * state[Plant.LOAD_2]
    assert a_K == pytest.approx(room[Axle.COMFORT, 0], abs=a_K_off)


def test_an_oil_far_faster_than_the_step_is_quasi_static_with_an_error_in_proportion_to_its_time(
    damper, monkeypatch
) -> None:
    """The rod speeds up at a = 10 m/s2: a resolved oil lags the force T0 + C v of the limit by C a (C / k), to first
    order; the plant, whose force in steps of 1 ms is that of the middle of its step, is off by twice that at most."""
    monkeypatch.setattr("pzd.simulate.ride.model.LEAST_RELAXATION", 1e-9)
    T0, C, a, lags = damper.base[0].T0_N, damper.base[0].C_Ns_per_m, 10.0, []
    for relaxation in (1e-5, 1e-6, 1e-7):
        rows = tuple(r.model_copy(update={"k_N_per_m": r.C_Ns_per_m / relaxation}) for r in damper.base)
        _, plan = model_of(damper.model_copy(update={"base": rows}), "comfort_predictive", 0.0)
        h, k = float(plan.steps[Step.HELD]), C / relaxation
        e, flow = (T0 + C * 0.2) / k, 0.2
        for n in range(20):
            middle = 0.2 + a * h * (n + 0.5)
            e, flow = oil_after(plan.damper, Step.HELD, 0, e, middle, flow, h)
        time = np.arange(2001) * 1e-5
        resolved = element_force(0.2 * time + 0.5 * a * time**2, 1e-5, T0, C, k, T0 + C * 0.2, 0.2 + a * time)
        lags.append((T0 + C * middle - k * e, T0 + C * (0.2 + a * 0.02) - resolved[-1], C * a * relaxation))
    for plant, oil, expected in lags:
        assert oil == pytest.approx(expected, rel=1e-3)
        assert abs(plant) < 2.0 * expected
    assert lags[1][0] == pytest.approx(0.1 * lags[0][0], rel=0.1)
    assert lags[2][0] == pytest.approx(0.1 * lags[1][0], rel=0.1)


def test_the_modes_of_the_weighting_are_the_weighting() -> None:
    """Against the response of the standard from 0.05 to 400 Hz."""
    poles, residues = modes(WK)
    frequency = np.geomspace(0.05, 400.0, 300)
    s = 2j * np.pi * frequency[:, np.newaxis]
    summed = np.sum(residues / (s - poles) + residues.conj() / (s - poles.conj()), axis=1)
    assert np.max(np.abs(summed - response(WK, frequency))) < 1e-12


@pytest.mark.ci
@pytest.mark.parametrize("road", ["known", "unknown"])
@pytest.mark.parametrize("kind", [0, 1])
def test_predictive_control_sets_voltages_of_the_table_once_a_hold_and_the_energies_balance(ride, road, kind) -> None:
    roads = [{"kind": "sine", "frequency_Hz": 4.5}, {"kind": "iso8608", "road_class": "C", "seed": 1}]
    given = {"roads": roads, "road": kind, "comfort_predictive": {"road": road}}
    outcome = ride("comfort_predictive", "dynamic", **SHORT, **given)
    assert abs(outcome.energy_error) < 1e-6
    # Whoever foresees the road changes at least as often as the rod turns round on the sine; else nearly all is chance.
    least = 2 * 4.5 * SHORT["duration_s"] if road == "known" or kind == 0 else 2
    for column in (VOLTAGE_1, VOLTAGE_2):
        voltage = outcome.history[:, column]
        assert set(np.unique(voltage)) <= {0.0, 75.0, 150.0}
        changed = np.flatnonzero(np.diff(voltage)) + 1
        assert changed.size >= least
        assert np.all(changed % 10 == 0)


@pytest.mark.ci
def test_on_a_known_sine_predictive_control_beats_both_ends_of_the_voltage_without_more_load(ride) -> None:
    """4.5 Hz, where the softest voltage is the best of those held."""
    given = {**SHORT, "roads": [{"kind": "sine", "frequency_Hz": 4.5}], "comfort_predictive": {"road": "known"}}
    found = {}
    for policy, voltage in (("passive", 0.0), ("passive", 150.0), ("comfort_predictive", 0.0)):
        outcome = ride(policy, "dynamic", passive_voltage_V=voltage, **given)
        a_w = rms(weighted(outcome.comfort, 1.0 / outcome.step)[1000:])
        found[policy, voltage] = a_w, max(rms(load[1000:]) for load in outcome.loads.T)
    best = min(a_w for (policy, _), (a_w, _) in found.items() if policy == "passive")
    assert found["comfort_predictive", 0.0][0] < 0.95 * best
    assert found["comfort_predictive", 0.0][1] < 1.1 * found["passive", 0.0][1]


@pytest.mark.ci
def test_on_wheels_with_mass_predictive_control_beats_every_held_voltage_on_a_sine_and_a_random_road(ride) -> None:
    """The road unknown: a_w below that of the best of five held voltages, the larger load at most a tenth above."""
    for road in ({"kind": "sine", "frequency_Hz": 2.25}, {"kind": "iso8608", "road_class": "C", "seed": 1}):
        given = {"roads": [road], "car": WHEELS_ON_TYRES, "duration_s": 8.0, "settle_s": 4.0}
        found = []
        for policy, voltage in (*(("passive", 37.5 * n) for n in range(5)), ("comfort_predictive", 0.0)):
            outcome = ride(policy, "dynamic", passive_voltage_V=voltage, **given)
            assert abs(outcome.energy_error) < 1e-6
            a_w = rms(weighted(outcome.comfort, 1.0 / outcome.step)[4000:])
            found.append((a_w, max(rms(load[4000:]) for load in outcome.loads.T)))
        best = min(found[:5])
        assert found[5][0] < best[0]
        assert found[5][1] < 1.1 * best[1]


@pytest.mark.ci
@pytest.mark.parametrize("car", [{}, WHEELS_ON_TYRES], ids=["wheels follow the road", "wheels with mass"])
def test_a_road_is_never_seen_before_it_is_met_where_it_is_unknown(ride, tmp_path, car) -> None:
    """A bump or a hole behind another bump: the voltages are the same until axle 1 meets it; not where it is known."""
    spacing, place = 0.05, 50.0
    along = np.arange(0.0, 101.0, spacing)

    def rises(at: float, height: float) -> np.ndarray:
        share = np.clip((along - at) / 2.0, 0.0, 1.0)
        return 0.5 * height * (1.0 - np.cos(2.0 * np.pi * share))

    for known, alike in (("unknown", True), ("known", False)):
        voltages = []
        for height in (0.05, -0.05):
            heights = rises(40.0, 0.03) + rises(place, height)
            rows = "".join(f"{d},{h}\n" for d, h in zip(along, heights, strict=True))
            path = tmp_path / f"{height}.csv"
            path.write_text(f"distance_m,height_m\n{rows}", encoding="utf-8")
            given = {
                "roads": [{"kind": "file", "path": str(path)}],
                "comfort_predictive": {"road": known},
                "car": car,
                **SHORT,
            }
            history = ride("comfort_predictive", "dynamic", **given).history
            voltages.append(history[history[:, TIME] < (place - 1.0) / 25.0, VOLTAGE_1])
        assert np.array_equal(*voltages) == alike


@pytest.mark.ci
def test_a_sine_is_forecast_from_what_has_passed(ride) -> None:
    """Unknown or known, a road that repeats is ridden alike: a_w within 3 %."""
    road = [{"kind": "sine", "frequency_Hz": 4.5}]
    found = []
    for known in ("known", "unknown"):
        outcome = ride("comfort_predictive", "dynamic", roads=road, **SHORT, comfort_predictive={"road": known})
        found.append(rms(weighted(outcome.comfort, 1.0 / outcome.step)[2000:]))
    assert found[1] == pytest.approx(found[0], rel=0.03)


@pytest.mark.ci
def test_the_same_bytes_for_any_number_of_jobs(damper, tmp_path) -> None:
    roads = [{"kind": "sine", "frequency_Hz": f} for f in (2.25, 4.5)]
    given = settings(roads=roads, duration_s=1.0, settle_s=0.2)
    texts = []
    for jobs in (1, 2):
        rides = simulate(given, Diagnosed.undiagnosed(damper), table_of(damper), 1, Path(), jobs)
        folder = tmp_path / str(jobs)
        folder.mkdir()
        rides.write(folder, Control())
        texts.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert texts[0] == texts[1]
    assert any(b"comfort_predictive-dynamic" in text for text in texts[0].values())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"road": "guessed"}, "comfort_predictive.road"),
        ({"hold_s": 0.0105}, r"hold_s must be a whole number of control_period_s \(got 10.5 periods\)"),
        ({"hold_s": 0.0}, "comfort_predictive.hold_s"),
        ({"horizon_s": 0.015}, r"horizon_s must be twice hold_s or more \(got 0.015 and 0.01 s\)"),
        ({"load_weight": -1.0}, "comfort_predictive.load_weight"),
        ({"voltages": 1}, "comfort_predictive.voltages"),
        ({"tails": 9}, "comfort_predictive.tails"),
        ({"weight": 1.0}, "comfort_predictive.weight"),
    ],
)
def test_parameters_that_make_no_sense_are_refused_with_what_would(given, message) -> None:
    with pytest.raises(ValidationError, match=message):
        settings(comfort_predictive=given)


def test_predictive_control_needs_the_dynamic_damper_and_a_voltage(damper) -> None:
    with pytest.raises(ConfigError, match="add table or dynamic"):
        simulate(settings(fidelities=["ideal", "table"]), Diagnosed.undiagnosed(damper), table_of(damper), 1, Path())
    row = damper.base[0].model_copy(update={"voltage_V": None})
    without = damper.model_copy(update={"base": (row,)})
    with pytest.raises(ConfigError, match="comfort_predictive sets the voltage"):
        simulate(settings(), Diagnosed.undiagnosed(without), table_of(without), 1, Path())
