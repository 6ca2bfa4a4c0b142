"""Roads: what the car meets, its derivatives, names, and files."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from pzd.schema.errors import ConfigError
from pzd.signals.iso8608 import classes
from pzd.simulate.config import SimulateConfig
from pzd.simulate.ride.model import road_coefficients
from pzd.simulate.roads import Way, roads, through
from pzd.simulate.vehicle.suspension import road_at

WAY = Way(25.0, 400.0, 1, Path())
SAMPLES = {
    "sine": {"frequency_Hz": 2.25},
    "bump": {},
    "step": {},
    "hump": {},
    "pothole": {},
    "swept_sine": {},
    "iso8608": {},
}


def read(*blocks: dict[str, object]) -> SimulateConfig:
    return SimulateConfig.model_validate_json(json.dumps({"roads": blocks}))


def test_every_file_in_the_folder_is_a_road() -> None:
    assert set(roads()) == {*SAMPLES, "file", "opencrg"}


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


def test_a_hump_and_a_pothole_are_flanks_beside_a_level() -> None:
    hump = read({"kind": "hump", "height_m": 0.08, "length_m": 5.0, "ramp_m": 1.5}).roads[0].profile(WAY)
    hole = read({"kind": "pothole", "height_m": -0.06, "length_m": 1.0, "edge_m": 0.25}).roads[0].profile(WAY)
    assert hump.height(np.array([0.0, 9.9, 10.75, 11.5, 12.5, 13.5, 14.25, 15.1, 60.0])) == pytest.approx(
        [0.0, 0.0, 0.04, 0.08, 0.08, 0.08, 0.04, 0.0, 0.0], abs=2e-5
    )
    assert hole.height(np.array([9.9, 10.125, 10.25, 10.5, 10.75, 10.875, 11.1])) == pytest.approx(
        [0.0, -0.03, -0.06, -0.06, -0.06, -0.03, 0.0], abs=2e-5
    )


def test_a_hump_without_a_level_top_is_a_bump() -> None:
    place = np.linspace(9.0, 13.0, 2001)
    hump, bump = (
        read({"kind": kind, "height_m": 0.05, "length_m": 2.0, **more}).roads[0].profile(WAY).height(place)
        for kind, more in (("hump", {"ramp_m": 1.0}), ("bump", {}))
    )
    assert hump == pytest.approx(bump, abs=1e-12)


def test_a_swept_sine_passes_every_frequency_at_its_time_and_rises_at_the_same_speed() -> None:
    """Zeros by the law of the sweep, f = f_1 (f_2 / f_1)^(t / T): between two of them half a turn, up and down."""
    given = {"kind": "swept_sine", "low_Hz": 1.0, "high_Hz": 16.0, "amplitude_m": 0.01, "sweep_s": 5.0}
    profile = read(given).roads[0].profile(Way(20.0, 200.0, 1, Path()))
    time = np.arange(0.0, 10.0, 1e-5)
    height = profile.height(20.0 * time)
    zeros = time[1:][np.diff(np.sign(height[1:]), prepend=np.sign(height[1])) != 0.0]
    for n in (5, 20, 40, 60, 80, 100):
        middle = 0.5 * (zeros[n] + zeros[n + 1])
        expected = 16.0 ** (middle / 5.0 if middle < 5.0 else 2.0 - middle / 5.0)
        assert 0.5 / (zeros[n + 1] - zeros[n]) == pytest.approx(expected, rel=3e-3)
    speed = np.abs(np.gradient(height, 1e-5))
    peaks = [speed[(time > at) & (time < at + 0.5)].max() for at in (1.5, 3.0, 4.5, 6.0)]
    assert peaks == pytest.approx([2.0 * np.pi * 0.01] * 4, rel=0.02)
    even = read({**given, "amplitude_at_high_m": 0.01}).roads[0].profile(Way(20.0, 200.0, 1, Path()))
    assert np.max(np.abs(even.height(20.0 * time[450000:500000]))) == pytest.approx(0.01, rel=1e-4)


def test_a_swept_sine_is_a_function_of_place_alone() -> None:
    place = np.arange(0.0, 390.0, 0.07)
    short, long = (
        read({"kind": "swept_sine", "sweep_s": 7.0}).roads[0].profile(Way(25.0, d, 1, Path())) for d in (400, 2000)
    )
    assert short.height(place) == pytest.approx(long.height(place), abs=1e-15)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"kind": "hump", "ramp_m": 3.0}, r"ramp_m: two ramps are longer than length_m \(got 3 of 4 m\)"),
        ({"kind": "hump", "height_m": -0.1}, "height_m"),
        ({"kind": "pothole", "edge_m": 0.5}, r"edge_m: two edges are longer than length_m \(got 0.5 of 0.8 m\)"),
        ({"kind": "pothole", "height_m": 0.05}, "height_m"),
        ({"kind": "swept_sine", "low_Hz": 5.0, "high_Hz": 5.0}, r"high_Hz must be above low_Hz \(got 5 and 5 Hz\)"),
    ],
)
def test_a_road_that_makes_no_sense_is_refused(given, message) -> None:
    with pytest.raises(ValidationError, match=message):
        read(given)


CRG_HEAD = """$CT
a road, of a test
$
$ROAD_CRG                                     ! parameters
REFERENCE_LINE_START_U   = 0.0
REFERENCE_LINE_INCREMENT = 0.5
LONG_SECTION_V_RIGHT     = -1.0               ! of the first
LONG_SECTION_V_INCREMENT = 0.25
$!*******************************
$KD_Definition
#:LRFI
U:reference line u,m,0,0.5
"""


def crg(channels: list[str], rows: np.ndarray) -> str:
    """A file of the text form: eight numbers of ten characters a line."""
    lines = [f"D:{name}" for name in channels] + ["$", "$" * 72]
    for row in rows:
        cells = [f"{value:10.6f}" for value in row]
        lines += ["".join(cells[n : n + 8]) for n in range(0, len(cells), 8)]
    return CRG_HEAD + "\n".join(lines) + "\n"


def test_a_line_of_an_opencrg_road_is_interpolated_on_its_grid(tmp_path, rng: np.random.Generator) -> None:
    """Nine sections 0.25 m apart, so that a cross section takes two lines; a line 0.1 m left of the middle."""
    heights = np.round(0.02 * rng.standard_normal((81, 9)), 6)
    (tmp_path / "road.crg").write_text(crg([f"long section {n},m" for n in range(1, 10)], heights), encoding="utf-8")
    block = {"kind": "opencrg", "path": "road.crg", "offset_m": 0.1, "spacing_m": 0.5}
    road = read(block).roads[0]
    line = 0.6 * heights[:, 4] + 0.4 * heights[:, 5]
    found = road.profile(Way(25.0, 40.0, 1, tmp_path)).height(0.5 * np.arange(81))
    assert found == pytest.approx(line - line[0], abs=1e-9)
    assert road.name == "road"
    with pytest.raises(ConfigError, match=r"^simulate\.roads\.path: .*shorter than the ride: 60 m.*\(got 40 m\)$"):
        road.profile(Way(25.0, 60.0, 1, tmp_path))
    with pytest.raises(ConfigError, match=r"^simulate\.roads\.offset_m: .*from -1 to 1 m across.*\(got 1.2\)$"):
        read({**block, "offset_m": 1.2}).roads[0].profile(Way(25.0, 40.0, 1, tmp_path))


def test_sections_may_say_their_place_and_the_reference_line_has_slope_and_banking(tmp_path) -> None:
    names = [
        "reference line slope,m/m",
        "reference line banking,m/m",
        "long section at v = 1.5,m",
        "long section at v = -0.5,m",
    ]
    rows = np.tile([0.02, 0.05, 0.3, 0.1], (11, 1))
    rows[:, 1] = 0.01 * np.arange(11)
    (tmp_path / "road.crg").write_text(crg(names, rows), encoding="utf-8")
    road = read({"kind": "opencrg", "path": "road.crg", "offset_m": 0.5, "spacing_m": 0.5}).roads[0]
    found = road.profile(Way(25.0, 5.0, 1, tmp_path)).height(0.5 * np.arange(11))
    assert found == pytest.approx(0.02 * 0.5 * np.arange(11) + 0.5 * 0.01 * np.arange(11), abs=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("#:LRFI", "#:KRBI", r"forms LRFI and LDFI are read; .*\(got KRBI\)"),
        ("REFERENCE_LINE_INCREMENT = 0.5", "", r"REFERENCE_LINE_INCREMENT above 0 is needed \(got 0\)"),
        ("LONG_SECTION_V_RIGHT ", "V_RIGHT ", "a long section says `at v = ...`, or its number where"),
        ("  0.000000", "*********", r"road\.crg:17: a finite number is needed \(got \*+\)"),
        ("  0.000000", "", r"road\.crg:17: a cross section has 2 numbers"),
        ("$$$$", "$", "is it an OpenCRG file"),
        ("$KD", "$ROAD_CRG_MODS\nscale_z_grid = 2\n$\n$KD", r"road\.crg:10: the file modifies what it holds"),
        ("long section 2", "long section 1", "long sections at places of their own are needed"),
    ],
)
def test_an_opencrg_file_that_cannot_be_believed_is_refused(tmp_path, old, new, message) -> None:
    text = crg(["long section 1,m", "long section 2,m"], np.zeros((4, 2)))
    assert old in text
    text = text.replace("$" * 72, "$") if old == "$$$$" else text.replace(old, new, 1)
    (tmp_path / "road.crg").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=message):
        read({"kind": "opencrg", "path": "road.crg"}).roads[0].profile(Way(25.0, 1.0, 1, tmp_path))


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


@pytest.mark.parametrize("kind", ["bump", "step", "hump", "pothole"])
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
    with pytest.raises(ConfigError, match=message):
        read({"kind": "file", "path": "road.csv"}).roads[0].profile(Way(25.0, 20.0, 1, tmp_path))


def test_a_road_file_that_is_not_there_is_said() -> None:
    with pytest.raises(ConfigError, match=r"^simulate\.roads\.path: there is no such file.*\(got absent\.csv\)$"):
        read({"kind": "file", "path": "absent.csv"}).roads[0].profile(WAY)


def test_a_smooth_road_is_level_before_and_behind() -> None:
    profile = through(np.array([1.0, 1.2, 1.1, 1.4]), 0.5)
    assert profile.height(np.array([-3.0, 0.0, 1.5, 9.0])) == pytest.approx([0.0, 0.0, 0.4, 0.4])
