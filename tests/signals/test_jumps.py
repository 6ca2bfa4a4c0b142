"""Where a rod reverses between two samples, the force beside it may have turned already, or not yet."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.record import Array
from pzd.signals.jumps import beside_unresolved_reversals, jumps

AMPLITUDE, FREQUENCY, RATE = 0.02, 2.3, 100.0


def sine(phase: float) -> tuple[Array, Array]:
    """Two seconds at 43 samples a cycle; and the instants of its reversals, in samples."""
    angle = 2.0 * np.pi * FREQUENCY / RATE
    turns = (np.pi * (np.arange(12) + 0.5) - phase) / angle
    return AMPLITUDE * np.sin(angle * np.arange(200) + phase), turns[(turns > 3.0) & (turns < 196.0)]


@pytest.mark.parametrize("phase", np.linspace(0.0, 0.146, 5))
def test_the_samples_within_one_interval_of_a_reversal_are_found(phase: float) -> None:
    x, turns = sine(phase)
    found = np.flatnonzero(beside_unresolved_reversals(x, 0.0))
    apart = np.min(np.abs(found[:, None] - turns), axis=1)
    assert np.all(apart < 1.01)
    near = [i for i in range(3, 196) if np.min(np.abs(i - turns)) < 0.99]
    assert set(near) <= set(found.tolist())


def test_a_flank_that_lasts_longer_than_an_interval_is_resolved() -> None:
    """In the first interval the rod goes A (w dt)^2 / 2 = 0.21 mm, by a chord between samples up to a quarter more."""
    x, _ = sine(0.03)
    first = 0.5 * AMPLITUDE * (2.0 * np.pi * FREQUENCY / RATE) ** 2
    assert np.any(beside_unresolved_reversals(x, 0.9 * first))
    assert not np.any(beside_unresolved_reversals(x, 1.3 * first))


def test_a_cycle_reverses_over_its_ends_too() -> None:
    cycle = AMPLITUDE * np.cos(2.0 * np.pi * (np.arange(43) + 0.3) / 43.0)
    assert beside_unresolved_reversals(cycle, 0.0, closed=True)[[0, -1]].all()
    assert not beside_unresolved_reversals(cycle, 0.0)[[0, -1]].any()


@pytest.mark.parametrize("shift", range(0, 100, 7))
def test_a_jump_is_found_wherever_a_cycle_is_cut_open(shift: int) -> None:
    """A cycle that begins at a reversal jumps between its last sample and its first."""
    phase = 2.0 * np.pi * np.arange(100) / 100.0
    force = np.roll(np.sign(np.cos(phase + 0.01)) + 0.1 * np.cos(phase), shift)
    found = np.flatnonzero(jumps(force, closed=True))
    assert set((found - shift) % 100) == {24, 25, 74, 75}
