"""What a predictive controller makes of a road that its sensors give with noise, and what it forecasts of it."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from simulate_dampers import table_of

from pzd.comfort.weighting import weighted
from pzd.signals.measures import rms
from pzd.simulate.config import KM_PER_H, SensorNoise, SimulateConfig
from pzd.simulate.control.prediction.forecast import filtered_height, learn
from pzd.simulate.control.prediction.predictor import Memory, Predictor, predictor_of
from pzd.simulate.control.sensing import road_gain
from pzd.simulate.ride.model import dynamic_damper_of, grid_of

STEP, ARM = 2e-3, 1.2
NOISE = SensorNoise(
    deflection_m=1e-4,
    heave_m=1e-4,
    pitch_rad=1e-4,
    deflection_rate_m_per_s=5e-3,
    heave_rate_m_per_s=5e-3,
    pitch_rate_rad_per_s=2e-3,
)


def height_error(noise: SensorNoise, gain: float, rng: np.random.Generator) -> float:
    """r.m.s. error [m] of the height of a wavy road over 20,000 samples, the first tenth left out."""
    time = STEP * np.arange(20_000)
    w = 2.0 * math.pi * 2.0
    height, rise = 0.02 * np.sin(w * time), 0.02 * w * np.cos(w * time)
    off = math.hypot(noise.heave_m, ARM * noise.pitch_rad, noise.deflection_m)
    rise_off = math.hypot(noise.heave_rate_m_per_s, ARM * noise.pitch_rate_rad_per_s, noise.deflection_rate_m_per_s)
    seen, rising = height + off * rng.standard_normal(time.size), rise + rise_off * rng.standard_normal(time.size)
    tracked = np.zeros(4)
    found = [filtered_height(t, seen[n], rising[n], gain, STEP, n == 0, tracked) for n, t in enumerate(time)]
    return rms((np.array(found) - height)[2000:])


def test_no_other_gain_knows_the_height_better(generator_for) -> None:
    """On the same noise; the height alone is off by more than three times as much."""
    gain = road_gain(NOISE, ARM, STEP)
    best = height_error(NOISE, gain, generator_for("road observed"))
    for other in (0.5, 2.0):
        assert best < height_error(NOISE, other * gain, generator_for("road observed"))
    assert height_error(NOISE, 1.0, generator_for("road observed")) > 3.0 * best


def test_heights_without_noise_are_believed() -> None:
    assert road_gain(SensorNoise(deflection_rate_m_per_s=0.1), ARM, STEP) == 1.0
    assert filtered_height(STEP, 0.03, 5.0, 1.0, STEP, False, np.zeros(4)) == 0.03


def test_between_two_samples_the_road_goes_on_with_its_rise() -> None:
    tracked = np.zeros(4)
    found = [filtered_height(0.0, 0.01, 0.5, 0.1, 1e-3, n == 0, tracked) for n in range(3)]
    assert found == pytest.approx([0.01, 0.0105, 0.011])


def predictor(damper) -> Predictor:
    config = SimulateConfig.model_validate_json(json.dumps({"policies": ["comfort_predictive"]}))
    dynamic = dynamic_damper_of(damper, 22.0, config.valve_response_s)
    speed, voltages = config.vehicle_speed_km_per_h * KM_PER_H, grid_of(table_of(damper), None).voltages
    return predictor_of(config.comfort_predictive, config.control_period_s, dynamic, config.car.car(), speed, voltages)


@pytest.mark.parametrize("faint", [0.0, 1e-7, 1e-5, 1e-4])
def test_a_forecast_is_never_faster_than_the_road_was(damper, rng, faint) -> None:
    """A sine behind a level stretch, heights with so much noise: what fits noise alone may not run away from it."""
    plan = predictor(damper)
    period = plan.settings.observation_s * plan.settings.every
    fastest, furthest = 0.0, 0.0
    time = period * np.arange(400)
    heights = np.where(time > 0.2, 0.02 * np.sin(2.0 * math.pi * 2.25 * (time - 0.2)), 0.0)
    heights += faint * rng.standard_normal(time.size)
    for n, height in enumerate(heights):
        plan.observed.measured[Memory.OBSERVATIONS] = n * plan.settings.every
        learn(plan, float(height))
        fastest = max(fastest, abs(height - heights[max(n - 1, 0)]) / period)
        assert np.max(np.abs(plan.forecast.forecasts[n % plan.forecast.skill.shape[1]])) <= fastest * (1.0 + 1e-12)
        furthest = max(furthest, float(np.max(np.abs(np.diff(plan.forecast.heights)))) / period)
    assert furthest > 0.1
    assert np.all(plan.forecast.skill[0] / plan.forecast.skill[1] > 0.8)  # and it is believed once the sine has come


@pytest.mark.ci
def test_a_sine_is_ridden_better_than_at_any_held_voltage_with_ordinary_sensors(ride) -> None:
    given = {
        "roads": [{"kind": "sine", "frequency_Hz": 2.25}],
        "sensors": {"period_s": STEP, "delay_s": STEP, "noise": NOISE.model_dump()},
        "duration_s": 8.0,
        "settle_s": 4.0,
    }

    def a_w(policy: str, **more: object) -> float:
        outcome = ride(policy, "dynamic", **given, **more)
        return rms(weighted(outcome.comfort, 1.0 / outcome.step)[len(outcome.comfort) // 2 :])

    held = min(a_w("passive", passive_voltage_V=voltage) for voltage in (0.0, 75.0, 150.0))
    assert a_w("comfort_predictive") < 0.95 * held
