"""Equation (12): the minimiser over the box, and which of its many points a tie-break takes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from pzd.record import Array
from pzd.simulate.control.demand import LARGEST, TIE_BREAKS, TieBreak, farther_end, least_acceleration_forces


def least_acceleration(a0: float, D: Array, low: Array, high: Array, tie_break: TieBreak) -> Array:
    """The minimiser, `largest` at its farther end as at every act of the controller."""
    forces, tie, pair = np.empty(2), TIE_BREAKS[tie_break], (float(D[0]), float(D[1]))
    branch = farther_end(a0, pair, low, high) if tie == LARGEST else 0
    least_acceleration_forces(a0, pair, low, high, tie, branch, forces)
    return forces


def draws(random: np.random.Generator, n: int) -> Iterator[tuple[float, Array, Array, Array]]:
    """Boxes as suspensions give them (both forces of one sign per axle) and boxes of any kind."""
    for i in range(n):
        D = random.normal(size=2) / 600.0
        v = random.normal(size=2) * 0.3
        ends = np.stack([750.0 * v, 45000.0 * v]) if i % 2 else random.normal(size=(2, 2)) * 3000.0
        yield random.normal() * 3.0, D, ends.min(axis=0), ends.max(axis=0)


@pytest.mark.parametrize("tie_break", TIE_BREAKS)
def test_no_force_in_the_box_makes_less_acceleration(rng: np.random.Generator, tie_break) -> None:
    for a0, D, low, high in draws(rng, 600):
        forces = least_acceleration(a0, D, low, high, tie_break)
        assert np.all(forces >= low - 1e-9)
        assert np.all(forces <= high + 1e-9)
        grid = np.meshgrid(*[np.linspace(a, b, 61) for a, b in zip(low, high, strict=True)], indexing="ij")
        brute = np.min(np.abs(a0 + D[0] * grid[0] + D[1] * grid[1]))
        assert abs(a0 + D @ forces) <= brute + 1e-12


def test_tie_breaks_differ_in_the_forces_and_not_in_the_acceleration(rng: np.random.Generator) -> None:
    apart = 0
    for a0, D, low, high in draws(rng, 600):
        found = {name: least_acceleration(a0, D, low, high, name) for name in TIE_BREAKS}
        accelerations = [abs(a0 + D @ forces) for forces in found.values()]
        assert np.ptp(accelerations) < 1e-12
        norms = {name: np.linalg.norm(forces) for name, forces in found.items()}
        assert norms["smallest"] <= norms["equal_share"] + 1e-9
        assert norms["equal_share"] <= norms["largest"] + 1e-9
        apart += norms["largest"] > norms["smallest"] + 1.0
    assert apart > 20


def test_smallest_and_largest_are_so_among_all_that_reach_the_minimum(rng: np.random.Generator) -> None:
    compared = 0
    for a0, D, low, high in draws(rng, 300):
        smallest, largest = (least_acceleration(a0, D, low, high, name) for name in ("smallest", "largest"))
        if abs(a0 + D @ smallest) > 1e-12:
            continue
        first = np.linspace(low[0], high[0], 2001)
        second = (-a0 - D[0] * first) / D[1]
        within = (second >= low[1]) & (second <= high[1])
        norms = np.hypot(first, second)[within]
        if norms.size:
            assert np.linalg.norm(smallest) <= norms.min() + 1e-6
            assert np.linalg.norm(largest) >= norms.max() - 1e-6
            compared += 1
    assert compared > 30


def test_equal_share_is_the_same_share_of_both_ranges(rng: np.random.Generator) -> None:
    for a0, D, low, high in draws(rng, 300):
        forces = least_acceleration(a0, D, low, high, "equal_share")
        start, end = np.where(D >= 0.0, low, high), np.where(D >= 0.0, high, low)
        shares = (forces - start) / (end - start)
        assert shares[0] == pytest.approx(shares[1], abs=1e-9)


@pytest.mark.parametrize("tie_break", ["smallest", "equal_share"])
def test_the_law_is_continuous_in_speed_and_spring_force(rng: np.random.Generator, tie_break) -> None:
    for _ in range(300):
        D = rng.normal(size=2) / 600.0

        def control_spec(v: Array, a0: float, D: Array = D) -> Array:
            ends = np.stack([750.0 * v, 45000.0 * v])
            return least_acceleration(a0, D, ends.min(axis=0), ends.max(axis=0), tie_break)

        v, a0 = rng.normal(size=2) * 0.2, rng.normal()
        step = 1e-7 * rng.normal(size=3)
        jump = control_spec(v + step[:2], a0 + step[2]) - control_spec(v, a0)
        assert np.max(np.abs(jump)) < 1.0


def test_a_damper_without_leverage_on_the_point_is_left_to_the_tie_break() -> None:
    low, high = np.array([-100.0, 50.0]), np.array([400.0, 300.0])
    for name in TIE_BREAKS:
        forces = least_acceleration(-0.1, np.array([0.0, 1e-3]), low, high, name)
        assert forces[1] == pytest.approx(100.0)
        assert low[0] <= forces[0] <= high[0]
    assert least_acceleration(-0.1, np.array([0.0, 1e-3]), low, high, "smallest")[0] == 0.0
    assert least_acceleration(-0.1, np.array([0.0, 1e-3]), low, high, "largest")[0] == 400.0
