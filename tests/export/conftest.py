"""Each of the dampers that a run may hand on in turn, and points of its table."""

from __future__ import annotations

import numpy as np
import pytest
from exported_dampers import DAMPERS, POINTS, content_of

from pzd.export.content import Content


@pytest.fixture(scope="session", params=list(DAMPERS))
def content(request: pytest.FixtureRequest) -> Content:
    """Each of the dampers in turn."""
    return content_of(DAMPERS[request.param])


@pytest.fixture
def points(content: Content, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Control signals and velocities within the table, of every size, and those of its nodes."""
    grid = content.grid
    U = rng.uniform(grid.voltages[0], grid.voltages[-1], POINTS)
    v = rng.choice([-1.0, 1.0], POINTS) * grid.velocities[-1] * 10.0 ** rng.uniform(-6.0, 0.0, POINTS)
    U, v = np.concatenate([U, np.resize(grid.voltages, grid.velocities.size)]), np.concatenate([v, grid.velocities])
    return U, v
