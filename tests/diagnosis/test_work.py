"""A search that may not go on ends with what it knows, says so, and ends at the same place every time."""

from __future__ import annotations

import numpy as np
import pytest
from campaign import damper_of, sines
from test_kept_back import TWO
from whole_diagnosis import diagnosed

from pzd.record import Record

TRUTH = damper_of(TWO, preload_offset={"F_0": 150.0}, gas_spring={"k_g": 8000.0})


@pytest.fixture
def records(rng: np.random.Generator) -> tuple[Record, ...]:
    return sines(TRUTH, rng, TWO, tests=((0.5, 0.03), (2.0, 0.03)), cycles=3, noise=2e-3)


def test_a_search_that_may_compute_nothing_adopts_nothing_and_says_so(records: tuple[Record, ...]) -> None:
    found = diagnosed(records, most_evaluations=1).diagnosis
    assert found.verdict == "unexplained"
    assert found.effects == ()
    assert "ended by diagnose.most_evaluations (1 forces)" in found.reason


@pytest.mark.ci
def test_what_was_adopted_before_the_end_is_kept_whatever_the_number_of_threads(records: tuple[Record, ...]) -> None:
    """One round fits in: of the two effects that are missing one is adopted."""
    samples = sum(record.time.size for record in records)
    one, two = (diagnosed(records, jobs, most_evaluations=100 * samples).diagnosis for jobs in (1, 2))
    assert one == two
    assert len(one.effects) == 1
    assert "most_evaluations" in one.reason


@pytest.mark.ci
def test_a_search_that_comes_to_its_end_says_nothing_of_it(records: tuple[Record, ...]) -> None:
    found = diagnosed(records).diagnosis
    assert {*found.effects} == {"preload_offset", "gas_spring"}
    assert "most_evaluations" not in found.reason
