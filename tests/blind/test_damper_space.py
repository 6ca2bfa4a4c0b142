"""The space that the dampers of a benchmark are drawn from."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.blind.independent.damper_space import SOFTEST, elastic_levels
from tests.studies.plain_damper import bingham_levels

SPEED, STROKE = 0.3, 0.02


def test_dampers_come_from_friction_alone_to_viscous_alone_and_from_stiff_to_soft(rng: np.random.Generator) -> None:
    rows = np.array([elastic_levels(rng, 1, SPEED, STROKE, 1e-5)[0] for _ in range(1000)])
    T0, C, k = rows.T
    friction = T0 / (T0 + C * SPEED)
    for low, high in ((0.0, 0.01), (0.01, 0.5), (0.5, 0.95), (0.95, 1.0)):
        assert np.mean((friction >= low) & (friction < high)) > 0.05
    before_slip = T0 / k / STROKE
    assert np.mean(before_slip < 1e-3) > 0.2
    assert np.mean(before_slip > 0.05) > 0.05
    assert np.ptp(np.log10(T0 + C * SPEED)) > 2.0


@pytest.mark.parametrize("quickest", [1e-6, 2.5e-4])
def test_every_drawn_damper_slips_and_its_spring_is_followed(quickest: float, rng: np.random.Generator) -> None:
    for _ in range(300):
        T0, C, k = elastic_levels(rng, 3, SPEED, STROKE, quickest).T
        assert np.all(np.array([T0, C, k]) > 0.0)
        assert np.all(C / k >= 0.999 * quickest)
        assert np.all(T0 / k <= 1.3 * SOFTEST * STROKE)  # k falls by a fifth at most up to the highest level


def test_the_limits_of_the_element_are_among_them() -> None:
    growth = (0.0, 0.0)
    T0, C, k = bingham_levels((0.5, 0.0, 0.5, 0.5, 0.0, 0.0), growth, 1, SPEED, STROKE)[0]
    assert (T0 == 0.0, C > 0.0, np.isfinite(k)) == (True, True, True)
    T0, C, k = bingham_levels((0.5, 1.0, 0.0, 0.5, 0.0, 0.0), growth, 1, SPEED, STROKE)[0]
    assert (T0 > 0.0, C == 0.0, np.isinf(k)) == (True, True, True)
