"""A delay that all tests have in common may be chance, where they are few and each may have one of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from campaign import damper_of, sine
from whole_diagnosis import all_but, diagnosed

from pzd.record import Record

TESTS = ((0.5, 0.02), (2.0, 0.02), (2.0, 0.03))


def late(delay: float, rng: np.random.Generator) -> tuple[Record, ...]:
    """Three tests whose force is recorded so late."""
    records = [sine(damper_of((0.0,)), 0.0, f, x, rng, noise=0.003, colour=0.0) for f, x in TESTS]
    return tuple(replace(r, force=np.interp(r.time - delay, r.time, r.force)) for r in records)


@pytest.mark.parametrize(
    ("delay", "verdict", "effects", "rivals"),
    [
        (0.4e-3, "none", (), ()),
        (1.5e-3, "ambiguous", (), ("sensor_delay",)),
        (4e-3, "named", ("sensor_delay",), ()),
    ],
)
def test_what_may_be_of_the_tests_is_neither_named_nor_passed_over(
    delay: float, verdict: str, effects: tuple[str, ...], rivals: tuple[str, ...], rng: np.random.Generator
) -> None:
    """Of three delays with a standard deviation of 0.5 ms the mean is known to 0.57 ms (95 %): 1.5 may be 0.9."""
    told = diagnosed(late(delay, rng), forbid=all_but("sensor_delay", "lash"), most_added=0).diagnosis
    assert (told.verdict, told.effects, told.rivals) == (verdict, effects, rivals), told.reason
    assert (told.next_test is not None) is (verdict == "ambiguous")  # one more test, over which to average


def test_what_chance_could_hardly_but_might_yet_be_is_told_as_open(rng: np.random.Generator) -> None:
    """A spring that stiffens by a fifth from case to case, in the same noise: unseen, then open, then adopted.

    A criterion lower by 10 to 20 is more than rivals differ by, and less than adoption takes: a quarter of stiffness.
    """
    plain = tuple(sine(damper_of((0.0,)), 0.0, f, x, rng, noise=0.05, cycles=4) for f, x in TESTS)
    said = []
    for stiffness in 600.0 * 1.2 ** np.arange(12):
        records = tuple(replace(r, force=r.force + stiffness * r.displacement) for r in plain)
        told = diagnosed(records, forbid=all_but("gas_spring"), most_added=0).diagnosis
        assert (told.verdict == "none") is (not told.effects and not told.rivals), told.reason
        said.append("adopted" if told.effects else "open" if told.rivals else "unseen")
    order = ["unseen", "open", "adopted"]
    assert set(said) == set(order)
    assert said == sorted(said, key=order.index)
