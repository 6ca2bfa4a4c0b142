"""The next test is one that the stand can run, and one that tells the rivals apart."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper.model import BaseRow, Damper
from pzd.diagnose.next_test import Reach, next_test

SOFT = Damper(base=(BaseRow(T0_N=1.0, C_Ns_per_m=10.0, k_N_per_m=1e5),))
"""Nearly nothing beside what its effects give."""
MASS = 100.0
ALIKE_AT_1_HZ = MASS * (2.0 * np.pi) ** 2
RIVALS = (
    ("gas_spring", SOFT.with_effect("gas_spring", {"k_g": ALIKE_AT_1_HZ})),
    ("fluid_inertia", SOFT.with_effect("fluid_inertia", {"m": -MASS})),
)


def peak_acceleration(waveform: str, frequency: float, amplitude: float) -> float:
    """Closed form [m/s2]: a triangle of odd harmonics h up to the ninth, each 8/(pi h)^2, has five of equal share."""
    share = 1.0 if waveform == "sine" else 5.0 * 8.0 / np.pi**2
    return share * amplitude * (2.0 * np.pi * frequency) ** 2


def test_the_test_is_within_stroke_speed_frequency_and_force(rng: np.random.Generator) -> None:
    for draw in rng.spawn(12):
        reach = Reach(
            draw.uniform(0.01, 0.06), draw.uniform(0.1, 1.0), draw.uniform(2.5, 30.0), 10.0 ** draw.uniform(2, 5), ()
        )
        told = next_test(RIVALS, reach, None)
        if told is None:
            continue  # nothing that the stand can do stays below its force
        f, amplitude = told.frequency_Hz, told.amplitude_m
        assert f is not None
        assert amplitude is not None
        assert amplitude <= 1.005 * reach.amplitude
        assert 2.0 * np.pi * f * amplitude <= 1.005 * reach.speed
        assert f <= reach.frequency
        friction = 1.0 + 10.0 * reach.speed
        assert MASS * peak_acceleration(told.waveform, f, amplitude) <= 1.02 * reach.force + friction
        assert ALIKE_AT_1_HZ * amplitude <= 1.02 * reach.force + friction


def test_a_spring_and_a_mass_that_are_alike_on_one_frequency_are_told_apart_at_another_frequency() -> None:
    told = next_test(RIVALS, Reach(0.05, 0.6, 20.0, np.inf, ()), None)
    assert told is not None
    assert told.frequency_Hz != pytest.approx(1.0)
    assert told.separates == ("gas_spring", "fluid_inertia")
    assert told.distance_percent is not None
    assert told.distance_percent > 20.0


def test_nothing_is_proposed_where_every_test_exceeds_the_force() -> None:
    assert next_test(RIVALS, Reach(0.05, 0.6, 20.0, 0.5, ()), None) is None
