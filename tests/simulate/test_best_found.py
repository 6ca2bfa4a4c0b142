"""Best found: the search itself, the schedule under the wheels, and that no policy within the bound does better."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from simulate_dampers import damper_after_table_2, table_of

from pzd.artefacts import Diagnosed, Rides
from pzd.quantities import Control
from pzd.schema.errors import ConfigError
from pzd.simulate.config import SimulateConfig
from pzd.simulate.stage import simulate
from pzd.simulate.study.tuning import ScheduleSearch, best_schedule, sampled, square_waves

SINE = {"kind": "sine", "frequency_Hz": 2.25, "label": "road"}
OTHERS = ("passive", "comfort", "skyhook", "balance")
GIVEN = {
    "roads": [SINE],
    "fidelities": ["dynamic"],
    "policies": [*OTHERS, "best_fixed_voltage", "best_found"],
    "controlled": "comfort",
    "duration_s": 7.0,
    "settle_s": 4.0,
    "best_found": {"evaluations": 60, "intervals": 8, "starts": 1},
}


def rides(**given: object) -> Rides:
    config = SimulateConfig.model_validate_json(json.dumps({**GIVEN, **given}))
    damper = damper_after_table_2()
    return simulate(config, Diagnosed.undiagnosed(damper), table_of(damper), 1, Path())


@pytest.fixture(scope="module")
def ridden() -> Rides:
    return rides()


# ---------------------------------------------------------------- the search


def test_the_search_finds_the_least_within_the_bound_and_within_its_budget() -> None:
    """Discomfort |u - target|^2 + 1 and load mean(u): without the bound at the target, with it where the mean is."""
    target = np.linspace(20.0, 130.0, 8).reshape(2, 4)
    for most_load, expected in ((150.0, target), (60.0, target - 15.0)):
        search = ScheduleSearch(lambda u: (np.sum((u - target) ** 2) / 1e4 + 1.0, np.mean(u)), 0.0, 150.0, most_load)
        best_schedule(search, square_waves(2, 3, 0.2), 900)
        assert search.best is not None
        assert search.tried <= 900
        assert np.mean(search.best[1]) <= most_load
        assert search.best[1] == pytest.approx(expected, abs=6.0)


def test_nothing_beyond_the_bound_is_ever_the_best() -> None:
    search = ScheduleSearch(lambda u: (float(np.mean(u)), 2.0), 0.0, 150.0, 1.0)
    best_schedule(search, square_waves(4, 2, 0.0), 60)
    assert search.best is None
    assert 0 < search.tried <= 60


def test_square_waves_are_hard_for_half_of_the_time_and_axle_2_follows() -> None:
    for wave in square_waves(8, 4, 0.25):
        assert wave.sum(axis=1) == pytest.approx(4.0)
        assert wave[1] == pytest.approx(np.roll(wave[0], 4))
    first, second = square_waves(8, 2, 0.0)
    assert first == pytest.approx(1.0 - second)


def test_the_voltages_of_a_ride_are_averaged_by_their_place_in_half_a_period() -> None:
    time = np.arange(0.0, 4.0, 1e-3)
    voltages = np.column_stack([np.floor(2.0 * time / 0.4 % 1.0 * 4.0), np.full(time.size, 7.0)])
    found = sampled(time + 1e-9, voltages, 0.4, 4)
    assert found[0] == pytest.approx([0.0, 1.0, 2.0, 3.0], abs=0.05)
    assert found[1] == pytest.approx(7.0)


# ---------------------------------------------------------------- the ride


@pytest.mark.ci
def test_no_policy_within_the_bound_is_more_comfortable(ridden) -> None:
    a_w = {row.case.split("-")[1]: row.a_w_m_per_s2 for row in ridden.weighted}
    load = {row.policy: row.rms_wheel_load_N for row in ridden.summary}
    bound = 1.1 * load["best_fixed_voltage"]
    assert load["best_found"] <= bound
    assert ridden.found[0].most_load_N == pytest.approx(bound, rel=1e-6)
    assert all(a_w["best_found"] <= a_w[name] for name in (*OTHERS, "best_fixed_voltage") if load[name] <= bound)
    assert a_w["best_found"] < 0.95 * a_w["best_fixed_voltage"]
    assert ridden.found[0].evaluations <= 60
    assert max(abs(row.energy_error) for row in ridden.summary) < 1e-6


@pytest.mark.ci
def test_the_ride_sets_the_voltages_of_its_schedule(ridden) -> None:
    assert {row.found_by for row in ridden.found} == {"search"}
    assert [row.from_share_of_period for row in ridden.found] == [n / 8 for n in range(8)]
    ride = next(ride for ride in ridden.rides if "best_found" in ride.case)
    place = np.floor(2.25 * ride.columns["time_s"] % 1.0 * 8.0 + 1e-9).astype(int) % 8
    for axle in (1, 2):
        schedule = np.array([getattr(row, f"voltage_{axle}_V") for row in ridden.found])
        assert ride.columns[f"voltage_{axle}_V"] == pytest.approx(schedule[place])


@pytest.mark.ci
def test_what_was_found_is_read_back(ridden, tmp_path) -> None:
    ridden.write(tmp_path, Control())
    assert Rides.read(tmp_path, Control()).found == ridden.found


@pytest.mark.ci
def test_without_room_for_a_search_the_best_policy_is_ridden() -> None:
    """Ten rides are fewer than a search in eight voltages begins with."""
    found = rides(best_found={"evaluations": 10, "intervals": 8, "starts": 1})
    (row,) = found.found
    assert row.found_by in (*OTHERS, "best_fixed_voltage")
    assert (row.from_share_of_period, row.voltage_1_V) == (None, None)
    one, other = (next(s for s in found.summary if s.policy == name) for name in ("best_found", row.found_by))
    assert one.rms_aK_m_per_s2 == other.rms_aK_m_per_s2


@pytest.mark.parametrize(
    "given", [{"roads": [{"kind": "bump"}]}, {"fidelities": ["ideal", "table"]}], ids=["no sine", "not dynamic"]
)
def test_best_found_is_refused_where_nothing_repeats_with_the_road(given) -> None:
    with pytest.raises(ConfigError, match="best_found repeats its voltages with the road"):
        rides(**given)
