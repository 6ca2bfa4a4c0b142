"""A force that is recorded late is told from a soft oil spring, or it is said that these tests do not tell them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator
from test_plain_dampers import Sine, diagnosed, record_of

from pzd.record import Array, Record

RATE = 500.0


def late(
    T0: float, C: float, k: float, tests: Sequence[Sine], by: float, rng: Generator, noise: float = 2e-3
) -> list[Record]:
    """Tests of six cycles whose force is late by so much [s], with noise of a share of its peak."""

    def delayed(sine: Sine) -> Record:
        clean = record_of(T0, C, k, sine, np.zeros(round(7.0 * RATE / sine[0])), RATE)
        shown: Array = np.interp(clean.time - by, clean.time, clean.force)
        kept = clean.time > clean.time[0] + 0.5 / sine[0]
        noisy = shown + noise * np.max(np.abs(shown)) * rng.standard_normal(shown.size)
        channels = {name: getattr(clean, name)[kept] for name in ("time", "displacement", "velocity", "acceleration")}
        return replace(clean, force=noisy[kept], **channels)

    return [delayed(sine) for sine in tests]


@pytest.mark.parametrize("place", range(3))
def test_the_flank_of_a_friction_tells_a_late_force_from_a_spring(place: int, rng: Generator) -> None:
    """Elasto-plastic dampers at one frequency, 5 to 50 ms late.

    T0 is empty by identify, for half of the motion is no slip: weighed by what is left without it, no test counted.
    """
    u = rng.uniform(size=(3, 4))[place]
    T0, amplitude, frequency, by = 100.0 * 30.0 ** u[0], 0.008 * 4.0 ** u[1], 0.5 + u[2], 0.005 * 10.0 ** u[3]
    k = T0 / (0.02 * amplitude)
    records = late(T0, 0.0, k, ((frequency, amplitude), (frequency, 0.5 * amplitude)), by, rng)
    _, found = diagnosed(records)
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("named", ("sensor_delay",)), found.diagnosis.reason
    assert found.diagnosis.parameters["sensor_delay"]["tau"].value == pytest.approx(by, rel=0.02, abs=2e-4)


ONE_FREQUENCY: tuple[Sine, ...] = ((1.0, 0.02), (1.0, 0.01))
FAR_APART: tuple[Sine, ...] = ((1.0, 0.02), (8.0, 0.004))


@pytest.mark.parametrize(("k", "by"), [(np.inf, 0.02), (1e5, 0.0)], ids=["late", "elastic"])
def test_a_viscous_damper_at_one_frequency_does_not_tell_a_late_force_from_a_spring(
    k: float, by: float, rng: Generator
) -> None:
    """Either truth lags alike; the spring is kept, and the other one said."""
    _, found = diagnosed(late(0.0, 2000.0, k, ONE_FREQUENCY, by, rng))
    diagnosis = found.diagnosis
    assert (diagnosis.verdict, diagnosis.effects) == ("ambiguous", ()), diagnosis.reason
    assert diagnosis.rivals == ("sensor_delay",)
    assert "late" in diagnosis.reason
    assert found.damper.base[0].k_N_per_m == pytest.approx(1e5, rel=0.05)


@pytest.mark.parametrize("by", [0.015, 0.035])
def test_a_late_force_beside_a_spring_of_which_it_hides_a_part_is_said(by: float, rng: Generator) -> None:
    """At 1 and 2 Hz the springs take up what is late: k falls from 1e5 to 5e4 N/m, and hardly any force is missing."""
    _, found = diagnosed(late(1.0, 2000.0, 1e5, (*ONE_FREQUENCY, (2.0, 0.01)), by, rng, 5e-3))
    diagnosis = found.diagnosis
    assert diagnosis.verdict in ("ambiguous", "named"), diagnosis.reason
    assert "sensor_delay" in (*diagnosis.rivals, *diagnosis.effects)


@pytest.mark.parametrize(("k", "by"), [(np.inf, 0.02), (1e5, 0.0)], ids=["late", "elastic"])
def test_frequencies_far_apart_tell_a_late_force_from_a_spring(k: float, by: float, rng: Generator) -> None:
    """At 8 Hz the spring takes 30 % of the force, and a late force keeps all."""
    _, found = diagnosed(late(0.0, 2000.0, k, FAR_APART, by, rng))
    wanted = ("named", ("sensor_delay",)) if by else ("none", ())
    assert (found.diagnosis.verdict, found.diagnosis.effects) == wanted, found.diagnosis.reason
