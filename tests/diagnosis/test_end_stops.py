"""An end stop is found beside a law that no effect has, though only the longest strokes reach it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator
from synthetic import all_but, diagnosed, sine

from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.verdict import one_stop_note
from pzd.record import Record

TESTS = ((1.0, 1.0), (1.0, 0.8), (1.4, 1.0), (1.4, 0.8), (0.4, 1.0), (0.4, 0.8))
"""Frequency and amplitude, as shares of those drawn: every second test ends before the stop."""


def stopped(rng: Generator) -> tuple[Damper, list[Record]]:
    """A damper with a shelf and damping by place that runs against a stop of a tenth of the peak force.

    The stop begins in the last sixth of the longest strokes.
    """
    friction, amplitude = 100.0 * 10.0 ** rng.random(), 0.01 * 2.5 ** rng.random()
    frequency, begins = 0.6 + 0.9 * rng.random(), (0.84 + 0.1 * rng.random()) * amplitude
    speed = 2.0 * np.pi * frequency * amplitude
    peak = friction * (1.3 + 1.7 * rng.random())
    row = BaseRow(T0_N=friction, C_Ns_per_m=(peak - friction) / speed, k_N_per_m=30.0 * friction / amplitude)
    shelf = {"T0_2": 0.08 * peak, "k_2": 0.8 * peak / amplitude}
    stop = {"k_e": 0.1 * peak / (amplitude - begins) ** 2, "x_e": begins}
    damper = Damper(base=(row,), effects={"second_branch": shelf, "end_stop": stop})
    records = []
    for f, x in TESTS:
        made = sine(damper, 0.0, f * frequency, x * amplitude, rng, noise=1e-3, colour=0.0, cycles=5, rate=250.0)
        by_place = 0.05 * peak * (made.displacement / amplitude) ** 2 * made.velocity / speed
        records.append(replace(made, name=f"{f}-{x}", force=made.force + by_place, voltage=None))
    return damper, records


@pytest.mark.parametrize("_", range(4))
def test_tests_that_do_not_reach_a_stop_do_not_contradict_it(_: int, rng: Generator) -> None:
    """Half of the tests took something else for a stop, by a little of what the true one explains: it was refused."""
    damper, records = stopped(rng)
    found = diagnosed(records, forbid=all_but("end_stop"))
    assert found.diagnosis.effects == ("end_stop",), [(r.effect, r.reason) for r in found.diagnosis.ranking]
    # What is missing beside it is largest at the ends of the stroke as well, and draws its beginning inwards.
    begins = found.damper.effects["end_stop"]["x_e"]
    assert begins == pytest.approx(damper.effects["end_stop"]["x_e"], rel=0.2)


@pytest.mark.parametrize(
    ("zero", "told"),
    [(0.0, ""), (0.004, "x = 0.03 m"), (-0.004, "x = -0.03 m"), (0.0035, "x = 0.0295 m"), (0.002, "")],
)
def test_a_stop_that_no_test_reached_is_told(zero: float, told: str) -> None:
    """Of stops 26 mm to either side of a zero, by tests from -30 to 30 mm."""
    row = BaseRow(T0_N=100.0, C_Ns_per_m=1000.0, k_N_per_m=1e6)
    damper = Damper(base=(row,), effects={"end_stop": {"k_e": 1e7, "x_e": 0.026}}, zero_m=zero)
    note = one_stop_note(damper, [np.linspace(-0.03, 0.03, 7), np.linspace(-0.01, 0.01, 7)])
    assert bool(note) == bool(told)
    assert told in note
