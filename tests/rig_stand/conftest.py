"""Fresh seeds for the tests of the virtual stand."""

from __future__ import annotations

from collections.abc import Callable

import pytest


@pytest.fixture(params=range(3))
def seed(fresh_seeds: Callable[[int], list[int]]) -> int:
    """Three seeds that nobody has chosen, one after the other."""
    return fresh_seeds(1)[0]
