"""A long ride in pieces: the numbers of the whole one, in a memory that does not grow with its length."""

from __future__ import annotations

import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from simulate_dampers import table_of

from pzd.artefacts import Diagnosed, Rides
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.simulate import roads
from pzd.simulate.config import SimulateConfig
from pzd.simulate.ride import outcome
from pzd.simulate.roads import through
from pzd.simulate.stage import simulate

ROADS = [{"kind": "iso8608", "road_class": "C", "seed": 3}, {"kind": "sine", "frequency_Hz": 2.25}]


def ridden(damper: Damper, **given: object) -> Rides:
    block = {"roads": ROADS, "policies": ["passive", "comfort", "best_fixed_voltage"], "fidelities": ["table"], **given}
    config = SimulateConfig.model_validate_json(json.dumps(block))
    return simulate(config, Diagnosed.undiagnosed(damper), table_of(damper), 1, Path())


def test_the_numbers_of_a_ride_in_pieces_are_those_of_the_whole(damper, monkeypatch) -> None:
    """Pieces of 2 s, the settling time in the second one; two voltages of the search must be told apart alike."""
    given = {"duration_s": 6.0, "settle_s": 3.0, "output_rate_Hz": 100.0}
    whole = ridden(damper, **given)
    monkeypatch.setattr(outcome, "PIECE_S", 2.0)
    monkeypatch.setattr("pzd.simulate.study.tuning.PIECE_S", 2.0)
    parts = ridden(damper, **given)
    for table in ("summary", "wheels", "weighted", "ridden"):
        for one, other in zip(getattr(whole, table), getattr(parts, table), strict=True):
            # the jerk of the last step of a piece is a one-sided difference
            numbers = [{k: v for k, v in row.model_dump().items() if isinstance(v, float)} for row in (one, other)]
            jerks = [row.pop("rms_jerk_m_per_s3", 0.0) for row in numbers]
            assert jerks[1] == pytest.approx(jerks[0], rel=1e-4)
            assert numbers[1] == pytest.approx(numbers[0], rel=1e-6, abs=1e-9), table
    for one, other in zip(whole.rides, parts.rides, strict=True):
        assert other.columns["a_K_m_per_s2"] == pytest.approx(one.columns["a_K_m_per_s2"], abs=1e-6)
    for case in [row.case for row in whole.summary]:
        sizes = [sum(r.rms_m_per_s2**2 for r in rides.spectrum if r.case == case) for rides in (whole, parts)]
        assert sizes[1] == pytest.approx(sizes[0], rel=0.02)


def test_a_transient_across_two_pieces_counts_as_one(damper, monkeypatch) -> None:
    """Pieces shorter than the second over which the running r.m.s. is taken."""
    given = {"duration_s": 15.0, "settle_s": 5.0, "policies": ["passive"], "roads": ROADS[:1]}
    found = []
    for length in (120.0, 0.75):
        monkeypatch.setattr(outcome, "PIECE_S", length)
        found.append(ridden(damper, **given).weighted[0])
    assert found[1].MTVV_m_per_s2 == pytest.approx(found[0].MTVV_m_per_s2, rel=1e-6)
    assert found[1].a_w_m_per_s2 == pytest.approx(found[0].a_w_m_per_s2, rel=1e-6)


@pytest.mark.ci
def test_a_ride_five_times_as_long_takes_no_more_memory(damper, tmp_path, monkeypatch) -> None:
    """Its history neither: a row a step goes to a file piece by piece."""
    monkeypatch.setattr(outcome, "PIECE_S", 10.0)
    monkeypatch.setattr("pzd.simulate.study.tuning.PIECE_S", 10.0)
    peaks = []
    for seconds in (60.0, 60.0, 300.0):
        tracemalloc.start()
        rides = ridden(
            damper, duration_s=seconds, output_rate_Hz=1000.0, roads=ROADS[1:], policies=["passive", "constant"]
        )
        rides.write(tmp_path, Control())
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 1.1 * peaks[1]


def test_a_long_road_is_the_same_block_by_block(rng: np.random.Generator, monkeypatch) -> None:
    heights = rng.standard_normal(2500)
    whole = through(heights, 0.5).coefficients
    monkeypatch.setattr(roads, "_BLOCK", 700)
    assert through(heights, 0.5).coefficients == pytest.approx(whole, abs=1e-13)
    assert through(heights, 0.5).height(0.5 * np.arange(2500)) == pytest.approx(heights - heights[0], abs=1e-13)
