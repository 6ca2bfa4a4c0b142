"""Slopes carried along a search: they agree with what its steps have shown, and lead to the same optimum."""

from __future__ import annotations

import numpy as np
import pytest
from campaign import damper_of, sines

from pzd.diagnose.campaign import Campaign
from pzd.diagnose.data.cleaning import prepare
from pzd.diagnose.data.split import split
from pzd.diagnose.fit import carried_slopes
from pzd.diagnose.fit.carried_slopes import CarriedSlopes
from pzd.diagnose.fit.least_squares import fit
from pzd.diagnose.fit.parameters import Problem
from pzd.diagnose.search.evidence import evidence_of
from pzd.record import Array
from pzd.signals.nuisance import NuisanceConfig

TWO = (0.0, 150.0)
BLOCKS = [(slice(0, 3), [0, 2]), (slice(3, 7), [1, 2])]
"""Seven residuals of two records: each has a variable of its own and one that it shares."""


def bent(rng: np.random.Generator, by: float) -> tuple[Array, CarriedSlopes, list[Array]]:
    """Slopes of residuals that are linear but for `by` times a square, and where differences were taken."""
    linear, square = np.zeros((7, 3)), rng.standard_normal(7)
    for rows, columns in BLOCKS:
        linear[rows, columns] = rng.standard_normal((rows.stop - rows.start, len(columns)))

    def residuals(x: Array) -> Array:
        return linear @ x + by * square * (x @ x)

    taken: list[Array] = []

    def differences(x: Array) -> Array:
        taken.append(x)
        return linear + 2.0 * by * np.outer(square, x)

    return linear, CarriedSlopes(residuals, differences, BLOCKS), taken


def test_slopes_of_what_is_linear_are_taken_once(rng: np.random.Generator) -> None:
    linear, slopes, taken = bent(rng, 0.0)
    for _ in range(5):
        np.testing.assert_allclose(slopes(rng.standard_normal(3)), linear, atol=1e-12)
    assert len(taken) == 1


def test_carried_slopes_explain_the_step_and_leave_what_moves_nothing(rng: np.random.Generator) -> None:
    _, slopes, taken = bent(rng, 0.01)
    first = rng.standard_normal(3)
    before = slopes(first).copy()
    step = np.array([0.7, -0.4, 0.5])
    carried = slopes(first + step)
    assert len(taken) == 1
    assert not slopes.exact
    square = slopes._residuals(first + step) - slopes._residuals(first)
    np.testing.assert_allclose(carried @ step, square, atol=1e-12)
    for rows, columns in BLOCKS:
        others = [j for j in range(3) if j not in columns]
        np.testing.assert_array_equal(carried[rows][:, others], before[rows][:, others])


def test_where_a_step_shows_them_wrong_they_are_taken_anew(rng: np.random.Generator) -> None:
    _, slopes, taken = bent(rng, 2.0)
    slopes(np.zeros(3))
    slopes(np.ones(3))
    assert len(taken) == 2
    assert slopes.exact


@pytest.fixture
def problem(rng: np.random.Generator) -> Problem:
    rounded = damper_of(TWO, rounded_yield={"w_s": 0.01})
    prepared = prepare(sines(rounded, rng, TWO))
    return evidence_of(Campaign(prepared, split(prepared, None, 2.0), NuisanceConfig()), damper_of(TWO)).whole


@pytest.mark.parametrize(
    "effect",
    ["relief_valve", *(pytest.param(name, marks=pytest.mark.ci) for name in ("rounded_yield", "shear_thinning"))],
)
def test_a_search_ends_where_one_with_differences_at_every_point_does(
    problem: Problem, effect: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = fit(problem, (), problem.start())
    more = problem.unknowns((effect,))
    start = np.concatenate([plain.searched, [u.searched(s) for u, s in zip(more, STARTS[effect], strict=True)]])
    _ = plain.slopes
    before = problem.work.spent
    carried = fit(problem, (effect,), start, beside=plain)
    between = problem.work.spent
    monkeypatch.setattr(carried_slopes, "TRUSTED", 0.0)
    monkeypatch.setattr(carried_slopes, "SAME_PLACE", 0.0)
    anew = fit(problem, (effect,), start)
    # A look whether slopes can be carried costs one simulation a record, differences there about ten: where the effect
    # is not the hidden one, it may be no at every point.
    most = 1.0 if effect == "rounded_yield" else 1.1
    assert between - before < most * (problem.work.spent - between)
    assert carried.misfit == pytest.approx(anew.misfit, rel=1e-4)
    moved = carried.searched - anew.searched
    assert moved @ np.linalg.solve(anew.covariance, moved) < 0.25 * moved.size


STARTS = {"rounded_yield": (0.005,), "shear_thinning": (0.9,), "relief_valve": (600.0, 1200.0)}
"""Values of the parameters, in their own units, from which the effects are searched."""
