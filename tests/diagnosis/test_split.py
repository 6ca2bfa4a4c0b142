"""The split: what the rig shows at its largest is always fitted in part."""

from __future__ import annotations

import numpy as np
import pytest
from campaign import damper_of, sines

from pzd.diagnosis.data import HELD_OUT, TRAINING, prepare, split


@pytest.mark.parametrize("channel", ["force", "velocity", "displacement"])
def test_something_of_the_largest_force_speed_and_displacement_is_fitted(
    rng: np.random.Generator, channel: str
) -> None:
    # Two tests: the fast one holds the largest force and speed, the slow one the largest displacement.
    tests = ((0.5, 0.03), (2.5, 0.02))
    prepared = prepare(sines(damper_of((0.0,)), rng, (0.0,), tests=tests, cycles=4))
    roles = split(prepared, None, 2.0).roles
    peaks = [float(np.max(np.abs(getattr(p.record, channel)))) for p in prepared]
    fitted = [peak for peak, role in zip(peaks, roles, strict=True) if np.any(role == TRAINING)]
    assert max(fitted) > 0.95 * max(peaks)
    assert any(np.any(role == HELD_OUT) for role in roles)
