"""The window of a ride: settled motion, or one event from its entry until it has died away; and what is taken in it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from simulate_dampers import damper_after_table_2, table_of

from pzd.artefacts import Diagnosed, Rides
from pzd.comfort.weighting import WK, response
from pzd.simulate.config import SimulateConfig
from pzd.simulate.ride.outcome import Event, of_event
from pzd.simulate.stage import simulate
from pzd.simulate.study.gathering import spectrum_rows

BUMP = {"kind": "bump", "height_m": 0.05, "length_m": 2.0, "start_m": 10.0}
ENTRY = 10.0 / 25.0


def rides(**given: object) -> Rides:
    config = SimulateConfig.model_validate_json(json.dumps(given))
    damper = damper_after_table_2()
    return simulate(config, Diagnosed.undiagnosed(damper), table_of(damper), 1, Path())


@pytest.fixture(scope="module")
def bump() -> Rides:
    return rides(roads=[BUMP], policies=["passive", "comfort"], fidelities=["dynamic"], output_rate_Hz=1000)


def test_the_peak_on_a_bump_is_the_peak_of_the_whole_ride(bump: Rides) -> None:
    """The bump is over long before the 8 s after which a sine is judged."""
    for ride, row in zip(bump.rides, bump.summary, strict=True):
        assert row.peak_abs_aK_m_per_s2 == np.max(np.abs(ride.columns["a_K_m_per_s2"]))
        assert row.peak_abs_aK_m_per_s2 > 5.0
        assert row.peak_deflection_m > 0.02


def test_the_window_of_a_bump_goes_from_its_entry_until_no_ride_falls_any_further(bump: Rides) -> None:
    assert len({(row.from_s, row.to_s) for row in bump.ridden}) == 1
    row = bump.ridden[0]
    assert row.from_s == pytest.approx(ENTRY, abs=1e-3)
    assert row.from_s <= ENTRY
    assert row.to_s < 8.0
    behind = round(row.to_s - (12.0 + 2.955) / 25.0, 3)
    assert behind == round(behind)
    for ride in bump.rides:
        time, size = ride.columns["time_s"], np.abs(ride.columns["a_K_m_per_s2"])
        seconds = [np.max(size[(time >= row.to_s + s) & (time < row.to_s + s + 1.0)]) for s in range(-1, 4)]
        assert seconds[0] < 0.1 * np.max(size)
        assert max(seconds[1:]) < 1.1 * seconds[0]


def test_a_linear_car_dies_away_and_one_on_oil_springs_swings_on() -> None:
    found = rides(roads=[BUMP], policies=["constant", "passive"], fidelities=["ideal", "dynamic"])
    endings = {row.case: row.ending for row in found.ridden}
    assert endings["bump-0.05m-constant-ideal"] == "motion died away"
    assert endings["bump-0.05m-passive-dynamic"] == "motion falls no further"


def test_the_length_of_the_ride_behind_an_event_changes_nothing(bump: Rides) -> None:
    longer = rides(
        roads=[BUMP], policies=["passive", "comfort"], fidelities=["dynamic"], duration_s=24.0, settle_s=20.0
    )
    assert longer.ridden == bump.ridden
    for one, other in zip(longer.summary, bump.summary, strict=True):
        assert one.rms_aK_m_per_s2 == pytest.approx(other.rms_aK_m_per_s2, rel=1e-12)
        assert one.dissipated_J == pytest.approx(other.dissipated_J, rel=1e-12)


def test_a_ride_that_is_over_before_the_motion_says_so() -> None:
    row = rides(roads=[BUMP], policies=["passive"], fidelities=["table"], duration_s=0.6, settle_s=0.1).ridden[0]
    assert (row.to_s, row.ending) == (0.6, "ride over before the motion died away")


def test_a_car_that_never_moves_has_a_window_all_the_same() -> None:
    window, endings = of_event(Event(0.4, 0.6), 0.001, [np.zeros(2001)])
    assert (window.first, window.last, endings) == (400, 600, ("motion died away",))


def test_a_motion_counts_as_dead_a_whole_second_after_the_event() -> None:
    """exp(-3 t) is at 1 % after 1.54 s: the first second that begins below it is the third."""
    time = np.arange(0.0, 10.0, 0.001)
    decaying = np.exp(-3.0 * np.maximum(time - 0.5, 0.0))
    window, endings = of_event(Event(0.25, 0.5), 0.001, [decaying, 0.2 * decaying])
    assert (window.first, window.last, set(endings)) == (250, 2500, {"motion died away"})


@pytest.mark.ci
def test_a_w_is_that_of_every_step_whatever_the_rate_of_the_files() -> None:
    given = {"roads": [{"kind": "iso8608"}], "policies": ["comfort"], "fidelities": ["dynamic"]}
    given |= {"duration_s": 6.0, "settle_s": 3.0}
    fine, coarse = (rides(output_rate_Hz=rate, **given) for rate in (500.0, 40.0))
    assert coarse.weighted[0].a_w_m_per_s2 == pytest.approx(fine.weighted[0].a_w_m_per_s2, rel=1e-4)
    assert coarse.rides[0].columns["time_s"].size < 0.1 * fine.rides[0].columns["time_s"].size


@pytest.mark.parametrize("fidelity", ["ideal", "table", pytest.param("dynamic", marks=pytest.mark.ci)])
def test_a_w_is_that_of_the_ride_whatever_tolerance_and_knots(fidelity, monkeypatch) -> None:
    """To 1e-4, on a random road: a tolerance ten times closer and looser, and knots of the road half as far apart.

    Laws that switch between a hard and a soft damper once a control period are left out: where they chatter, the next
    digit of the state decides which one they take.
    """
    roads, policies = [{"kind": "iso8608", "road_class": "C", "seed": 5}], ["constant", "passive", "comfort", "skyhook"]
    if fidelity == "ideal":
        policies.remove("passive")
    given = {"roads": roads, "policies": policies, "fidelities": [fidelity], "duration_s": 5.0, "settle_s": 2.0}
    found = [[row.a_w_m_per_s2 for row in rides(tolerance=t, **given).weighted] for t in (1e-9, 1e-10, 1e-8)]
    monkeypatch.setattr("pzd.simulate.roads.iso8608._KNOTS_A_WAVE", 32)
    found.append([row.a_w_m_per_s2 for row in rides(**given).weighted])
    for other in found[1:]:
        assert other == pytest.approx(found[0], rel=1e-4)


def test_a_w_on_a_sine_is_its_closed_form() -> None:
    """Constant damping at `ideal` is linear: a tone, weighted by the response at its frequency."""
    found = rides(policies=["constant"], fidelities=["ideal"], roads=[{"kind": "sine", "frequency_Hz": 4.5}])
    gain = abs(response(WK, np.array([4.5]))[0])
    assert found.weighted[0].a_w_m_per_s2 == pytest.approx(gain * found.summary[0].rms_aK_m_per_s2, rel=1e-4)
    assert (found.spectrum[0].frequency_Hz, found.spectrum[0].method) == (4.5, "a tone at its own frequency")
    assert found.spectrum[0].rms_m_per_s2 == pytest.approx(found.summary[0].rms_aK_m_per_s2, rel=1e-4)


@pytest.mark.parametrize(("frequency", "method"), [(0.1, "third-octave bands"), (0.13, "harmonic by harmonic")])
def test_a_slow_sine_is_taken_apart_by_its_harmonics_where_a_whole_period_is_there(frequency, method) -> None:
    time = np.arange(16001) / 1000.0
    ride = np.sin(2.0 * np.pi * frequency * time) + 0.5 * np.sin(4.0 * np.pi * frequency * time)
    found = spectrum_rows("case", ride[8000:], 1000.0, frequency)
    assert {row.method for row in found} == {method}
    assert sum(row.rms_m_per_s2**2 for row in found) < 2.0


def test_the_dissipated_energy_is_that_of_the_settled_part() -> None:
    """Settled on a sine, every period loses as much: 2 s of ten 5 Hz periods lose half of 4 s."""
    given = {"roads": [{"kind": "sine", "frequency_Hz": 5.0}], "policies": ["constant"], "fidelities": ["ideal"]}
    short, long = (
        rides(duration_s=8.0 + seconds, settle_s=8.0, **given).summary[0].dissipated_J for seconds in (2.0, 4.0)
    )
    assert long == pytest.approx(2.0 * short, rel=1e-6)
