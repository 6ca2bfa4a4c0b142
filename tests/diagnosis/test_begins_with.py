"""Every part of a test is simulated from the force that was recorded where its motion begins."""

from __future__ import annotations

import numpy as np
from campaign import damper_of
from test_evidence import evidence

from pzd.damper.compose import respond
from pzd.damper.motion import Motion
from pzd.diagnosis.fit.likelihood import simulated_force
from pzd.record import Record


def within_the_stick(offset: float, rng: np.random.Generator) -> Record:
    """A motion of 1 mm without a period, which 301 N of friction at 0 V never let slip, beside a preload."""
    time = np.arange(8000) / 500.0
    tones = ((1.13, 0.5e-3), (2.71, 0.3e-3), (6.97, 0.1e-3))
    x, v, a = (
        sum(X * (2 * np.pi * f) ** n * wave(2 * np.pi * f * time) for f, X in tones)
        for n, wave in ((0, np.sin), (1, np.cos), (2, lambda at: -np.sin(at)))
    )
    damper = damper_of((0.0,), preload_offset={"F_0": offset})
    force = respond(damper, Motion(time, x, v, a, np.zeros(time.size)), offset + 30.0)
    noise = rng.standard_normal(time.size)
    return Record("stuck", None, time, x, v, a, force + 0.1 * noise, np.zeros(time.size))


def test_a_part_that_begins_later_is_simulated_from_the_force_at_its_motions_first_sample(
    rng: np.random.Generator,
) -> None:
    found = evidence((within_the_stick(150.0, rng),), damper_of((0.0,)))
    truth = damper_of((0.0,), preload_offset={"F_0": 150.0})
    parts = [o for half in found.halves for o in half.observations]
    assert any(o.sample_indices[0] > 0 for o in parts)
    for o in parts:
        assert np.max(np.abs(o.measured - simulated_force(o, truth))) < 2.0, o.sample_indices[0]
