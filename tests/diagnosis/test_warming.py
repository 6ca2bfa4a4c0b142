"""A test over which the oil warms by less than a kelvin: the force follows it, and the noise of the sensor does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from campaign import damper_of, sine
from numpy.random import Generator

from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.data import prepare
from pzd.diagnosis.fit.prediction import predicted_force
from pzd.record import Array, Record

WARMS_BY = 0.45
"""Over the test [K]."""
NOISE = 0.05
"""Of the sensor [K], a sample."""


def warming(rng: Generator) -> tuple[Record, Array]:
    """A sine at 0 V in which the damper of Table 2 warms, without noise of the force; and its true temperature."""
    still = sine(damper_of((0.0,)), 0.0, 1.0, 0.02, rng, noise=0.0, cycles=8)
    truth = 22.0 + WARMS_BY * still.time / still.time[-1]
    motion = Motion(still.time, still.displacement, still.velocity, still.acceleration, still.voltage, truth)
    record = replace(
        still,
        force=respond(drifting(), motion, float(still.force[0])),
        temperature=truth + NOISE * rng.standard_normal(truth.size),
    )
    return record, truth


def drifting() -> Damper:
    """The damper of Table 2 at 0 V, whose oil loses 6 % a kelvin."""
    betas = {"temperature_drift": {"beta_T0": 0.06, "beta_C": 0.06}}
    return Damper(base=damper_of((0.0,)).base, effects=betas, reference_temperature_degC=22.0)


def test_the_temperature_is_that_of_the_oil_at_the_ends_too(rng: Generator) -> None:
    """Each end is one noisy sample; a smoothing that goes through it is wrong there for a second."""
    for _ in range(8):
        record, truth = warming(rng)
        (prepared,) = prepare((record,))
        cleaned = prepared.record.temperature
        assert cleaned is not None
        away = np.abs(cleaned - np.interp(prepared.record.time, record.time, truth))
        assert float(np.max(away)) < 0.4 * NOISE


def test_the_predicted_force_falls_as_the_oil_warms(rng: Generator) -> None:
    record, _ = warming(rng)
    (prepared,) = prepare((record,))
    assert prepared.cycles is not None
    forces = prepared.record.force, predicted_force(drifting(), prepared)
    measured, predicted = (
        np.abs(np.fft.rfft(prepared.cycles.fold(prepared.record.time, force), axis=1)[:, 1]) for force in forces
    )
    assert measured[-1] / measured[0] == pytest.approx(1.0 - 0.06 * WARMS_BY * 7 / 8, abs=0.004)
    np.testing.assert_allclose(predicted, measured, rtol=2e-3)
