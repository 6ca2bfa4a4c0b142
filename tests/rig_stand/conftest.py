"""Seeds for the tests of the virtual stand."""

from __future__ import annotations

from collections.abc import Callable

import pytest


@pytest.fixture(params=range(3))
def seed(seeds: Callable[[int], list[int]]) -> int:
    """Three seeds, one after the other."""
    return seeds(1)[0]
