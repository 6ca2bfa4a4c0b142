"""Roads: what the car meets, its derivatives, names, and files."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from pzd.schema.errors import ConfigError, DataError
from pzd.signals.iso8608 import classes
from pzd.simulate.config import SimulateConfig
from pzd.simulate.kinematics import road_at
from pzd.simulate.profile import through
from pzd.simulate.ride_model import road_coefficients
from pzd.simulate.road import Way
from pzd.simulate.roads import roads

WAY = Way(25.0, 400.0, 1, Path())
SAMPLES = {
    "sine": {"frequency_Hz": 2.25},
    "bump": {},
    "step": {},
    "iso8608": {},
}


def read(*blocks: dict[str, object]) -> SimulateConfig:
    return SimulateConfig.model_validate_json(json.dumps({"roads": blocks}))


def test_every_file_in_the_folder_is_a_road() -> None:
    assert set(roads()) == {*SAMPLES, "file"}


@pytest.mark.parametrize("kind", SAMPLES)
def test_slope_and_curvature_are_the_derivatives_of_the_height(kind, rng: np.random.Generator) -> None:
    profile = read({"kind": kind, **SAMPLES[kind]}).roads[0].profile(WAY)
    numbers = road_coefficients(profile, 2.9)
    h = 1e-5
    for s in rng.uniform(0.5, 30.0, 50):
        (low, *_), (height, slope, curvature), (high, *_) = (road_at(numbers, s + d) for d in (-h, 0.0, h))
        scale = max(abs(slope), 1e-3)
        assert slope == pytest.approx((high - low) / (2.0 * h), abs=1e-5 * scale + 1e-9)
        assert curvature == pytest.approx((high - 2.0 * height + low) / h**2, abs=2e-3 * max(abs(curvature), 0.1))
        assert height == pytest.approx(profile.height(np.array([s]))[0], abs=1e-12)


def test_a_sine_has_the_frequency_that_the_car_feels() -> None:
    profile = read({"kind": "sine", "frequency_Hz": 4.5, "amplitude_m": 0.01}).roads[0].profile(WAY)
    time = np.linspace(0.0, 1.0, 1000)
    assert profile.height(25.0 * time) == pytest.approx(0.01 * np.sin(2.0 * np.pi * 4.5 * time), abs=1e-12)


def test_a_bump_and_a_step_reach_their_heights() -> None:
    bump, step = (read({"kind": kind, "height_m": 0.03}).roads[0].profile(WAY) for kind in ("bump", "step"))
    assert bump.height(np.array([0.0, 9.9, 11.0, 12.1, 50.0])) == pytest.approx([0.0, 0.0, 0.03, 0.0, 0.0], abs=1e-6)
    assert step.height(np.array([0.0, 9.9, 10.5, 11.1, 50.0])) == pytest.approx([0.0, 0.0, 0.015, 0.03, 0.03], abs=1e-6)


def test_a_road_of_a_class_has_its_spectrum(seeds: Callable[[int], list[int]]) -> None:
    road = read({"kind": "iso8608", "road_class": "B"}).roads[0]
    place = np.arange(0.0, 4000.0, 0.05)
    powers = []
    for seed in seeds(4):
        height = road.profile(Way(25.0, 4000.0, seed, Path())).height(place)[:-1]
        spectrum = 2.0 * np.abs(np.fft.rfft(height)) ** 2 * 0.05 / len(height)
        n = np.fft.rfftfreq(len(height), 0.05)
        band = (n > 0.05) & (n < 2.0)
        powers.append(np.mean(spectrum[band] * (n[band] / 0.1) ** 2))
    assert np.mean(powers) == pytest.approx(classes()["B"], rel=0.1)


def drawn(duration: float = 16.0, seed: int = 1, **given: object) -> np.ndarray:
    """Heights of a road of class C over the first 390 m."""
    road = read({"kind": "iso8608", **given}).roads[0]
    return road.profile(Way(25.0, 25.0 * duration, seed, Path())).height(np.arange(0.0, 390.0, 0.1))


@pytest.mark.parametrize("duration", [15.6, 17.0, 100.0])
def test_a_longer_ride_meets_the_same_road_and_goes_on(duration: float) -> None:
    assert np.array_equal(drawn(duration), drawn(16.0))


def test_a_road_is_another_one_with_another_seed_or_name_and_the_same_one_with_the_same() -> None:
    first = drawn()
    assert np.array_equal(drawn(), first)
    for other in (drawn(seed=2), drawn(label="second"), drawn(seed=1, label="third")):
        assert abs(np.corrcoef(first, other)[0, 1]) < 0.6
    given = read({"kind": "iso8608", "seed": 7}, {"kind": "iso8608", "seed": 7, "label": "same"}).roads
    one, same = (road.profile(Way(25.0, 400.0, n, Path())).coefficients for n, road in enumerate(given))
    assert np.array_equal(one, same)


@pytest.mark.ci
def test_a_road_does_not_repeat_and_keeps_its_size(seeds: Callable[[int], list[int]]) -> None:
    """Pieces of 1 km fade into each other: the mean square over 50 m is the same wherever they meet."""
    rough = []
    for seed in seeds(4):
        road = read({"kind": "iso8608"}).roads[0].profile(Way(25.0, 20000.0, seed, Path()))
        height = road.height(np.arange(0.0, 20000.0, 0.1)).reshape(-1, 5000)
        assert abs(np.corrcoef(height[1], height[3])[0, 1]) < 0.9
        slope = np.diff(height, axis=1) / 0.1
        rough.append(np.mean(slope.reshape(40, -1)[1:, :4990].reshape(39, 10, 499) ** 2, axis=(0, 2)))
    assert np.mean(rough, axis=0) == pytest.approx(np.mean(rough), rel=0.1)


def test_a_road_is_named_by_kind_and_size_and_no_name_stands_twice() -> None:
    config = read({"kind": "sine", "frequency_Hz": 2.25}, {"kind": "iso8608"}, {"kind": "bump", "label": "kerb"})
    assert [road.name for road in config.roads] == ["sine-2.25Hz", "iso8608-C", "kerb"]
    with pytest.raises(ValidationError, match=r"sine-2\.25Hz; give each a label"):
        read({"kind": "sine", "frequency_Hz": 2.25}, {"kind": "sine", "frequency_Hz": 2.25, "amplitude_m": 0.01})


def test_a_road_from_a_file_goes_through_its_heights(tmp_path) -> None:
    place = np.arange(0.0, 20.0, 0.05)
    height = 0.01 * np.sin(place)
    lines = [f"{s:.6f},{z:.9f}" for s, z in zip(place, height, strict=True)]
    (tmp_path / "road.csv").write_text("\n".join(["distance_m,height_m", *lines]), encoding="utf-8")
    profile = read({"kind": "file", "path": "road.csv"}).roads[0].profile(Way(25.0, 19.95, 1, tmp_path))
    assert profile.height(place) == pytest.approx(height, abs=1e-8)


def test_a_road_file_shorter_than_the_ride_is_refused_with_the_length_that_it_must_have(tmp_path) -> None:
    (tmp_path / "road.csv").write_text("distance_m,height_m\n0,0\n100,0.01\n", encoding="utf-8")
    road = read({"kind": "file", "path": "road.csv"}).roads[0]
    assert road.profile(Way(25.0, 100.0, 1, tmp_path)).height(np.array([50.0])) == pytest.approx([0.005])
    wanted = r"^simulate\.roads\.3\.path: .*road\.csv is shorter than the ride: 400 m are needed .*4 s.*\(got 100 m\)$"
    with pytest.raises(ConfigError, match=wanted):
        road.profile(Way(25.0, 400.0, 1, tmp_path, "simulate.roads.3"))


@pytest.mark.parametrize("kind", ["bump", "step"])
def test_a_ride_that_ends_before_the_event_is_refused(kind: str) -> None:
    road = read({"kind": kind, "start_m": 400.0}).roads[0]
    with pytest.raises(ConfigError, match=rf"simulate\.roads\.start_m: the ride ends after 400 m, before the {kind}"):
        road.profile(WAY)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("s,z\n0,0\n1,0", "1: the header must be"),
        ("distance_m,height_m\n0,0\n1;0\n2,x", "3: two numbers"),
        ("distance_m,height_m\n0,0\n0,1", "the distance must rise"),
        ("distance_m,height_m\n0,0\n1,nan", "finite"),
    ],
)
def test_a_road_file_that_cannot_be_believed_is_refused_with_its_line(tmp_path, text, message) -> None:
    (tmp_path / "road.csv").write_text(text, encoding="utf-8")
    with pytest.raises(DataError, match=message):
        read({"kind": "file", "path": "road.csv"}).roads[0].profile(Way(25.0, 20.0, 1, tmp_path))


def test_a_road_file_that_is_not_there_is_said() -> None:
    with pytest.raises(ConfigError, match=r"^simulate\.roads\.path: there is no such file.*\(got absent\.csv\)$"):
        read({"kind": "file", "path": "absent.csv"}).roads[0].profile(WAY)


def test_a_smooth_road_is_level_before_and_behind() -> None:
    profile = through(np.array([1.0, 1.2, 1.1, 1.4]), 0.5)
    assert profile.height(np.array([-3.0, 0.0, 1.5, 9.0])) == pytest.approx([0.0, 0.0, 0.4, 0.4])
