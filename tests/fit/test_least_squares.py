"""What counts as an optimum: rank, limits and orthogonality decide, not the solver."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.fit.least_squares import minimise, minimise_from
from pzd.record import Array


def line(rng: np.random.Generator, size: int = 50, noise: float = 0.1) -> tuple[Array, Array]:
    """Columns of a straight line, and noisy values of 2 + 3 x."""
    columns = np.column_stack([np.ones(size), np.linspace(0.0, 1.0, size)])
    return columns, columns @ [2.0, 3.0] + noise * rng.standard_normal(size)


def test_a_linear_problem_has_its_closed_form(rng: np.random.Generator) -> None:
    columns, values = line(rng)
    found = minimise(lambda x: values - columns @ x, np.zeros(2), lambda _: -columns)
    assert found.converged
    assert found.x == pytest.approx(np.linalg.lstsq(columns, values, rcond=None)[0], rel=1e-10)
    assert found.offset < 1e-6


def test_without_derivatives_the_optimum_is_the_same(rng: np.random.Generator) -> None:
    columns, values = line(rng)
    found = minimise(lambda x: values - columns @ np.exp(x), np.zeros(2))
    assert found.converged
    assert np.exp(found.x) == pytest.approx(np.linalg.lstsq(columns, values, rcond=None)[0], rel=1e-6)


@pytest.mark.parametrize("size", [0.0, 1.0, 1e6])
def test_an_exact_fit_converges_whatever_its_unit(size: float) -> None:
    columns = size * np.column_stack([np.ones(9), np.arange(9.0)])
    found = minimise(lambda x: columns @ (x - [1.0, 2.0]), np.zeros(2), lambda _: columns)
    assert found.converged == (size > 0.0)


def test_a_variable_that_does_nothing_is_told(rng: np.random.Generator) -> None:
    columns, values = line(rng)
    columns = np.column_stack([columns, np.zeros(len(values))])
    found = minimise(lambda x: values - columns @ x, np.ones(3), lambda _: -columns)
    assert not found.converged
    assert found.undetermined == (2,)
    assert "2" in found.reason


def test_two_variables_that_cancel_are_told(rng: np.random.Generator) -> None:
    columns, values = line(rng)
    columns = np.column_stack([columns, columns[:, 1]])
    found = minimise(lambda x: values - columns @ x, np.ones(3), lambda _: -columns)
    assert not found.converged
    assert found.undetermined == (1, 2)


def test_a_plateau_is_no_optimum() -> None:
    # exp(-x) far out: the sum of squares stands still, as the solver says, and nothing has been found.
    data = np.exp(-np.arange(5.0))
    found = minimise(lambda x: data - np.exp(-x[0] * np.arange(5.0)) * (np.arange(5.0) > 0), np.array([800.0]))
    assert not found.converged


def test_a_variable_at_its_limit_is_told_and_the_others_are_an_optimum_there(rng: np.random.Generator) -> None:
    columns, values = line(rng)
    low, high = np.array([-10.0, -10.0]), np.array([10.0, 1.0])
    found = minimise(lambda x: values - columns @ x, np.zeros(2), lambda _: -columns, (low, high))
    assert found.converged
    assert found.at_limit.tolist() == [False, True]
    assert found.x[0] == pytest.approx(float(np.mean(values - columns[:, 1])), rel=1e-4)


def test_a_limit_beside_the_optimum_is_not_at_it(rng: np.random.Generator) -> None:
    columns, values = line(rng)
    low, high = np.array([-10.0, -10.0]), np.array([10.0, 10.0])
    found = minimise(lambda x: values - columns @ x, high, lambda _: -columns, (low, high))
    assert found.converged
    assert not found.at_limit.any()


def test_rows_with_the_same_inner_products_are_judged_as_those_they_stand_for(rng: np.random.Generator) -> None:
    columns, values = line(rng)

    def reduced(x: Array) -> Array:
        return np.asarray(np.linalg.qr(np.column_stack([-columns, values - columns @ x]), mode="r"))

    whole = minimise(lambda x: values - columns @ x, np.zeros(2), lambda _: -columns, evaluations=1)
    few = minimise(
        lambda x: reduced(x)[:, 2], np.zeros(2), lambda x: reduced(x)[:, :2], evaluations=1, size=values.size
    )
    assert few.offset == pytest.approx(whole.offset, rel=1e-6)


def test_of_several_starts_the_deepest_optimum_is_taken() -> None:
    # (x^2 - 1)^2 + 0.1 (x - 1): two valleys, the left one higher
    def residuals(x: Array) -> Array:
        return np.array([x[0] ** 2 - 1.0, 0.5 * (x[0] - 1.0)])

    one = minimise(residuals, np.array([-1.2]))
    best = minimise_from([np.array([-1.2]), np.array([0.5])], lambda start: minimise(residuals, start))
    assert one.x[0] < 0.0
    assert best.x[0] == pytest.approx(1.0, abs=1e-6)


def test_residuals_that_are_no_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match="finite"):
        minimise(lambda x: np.full(3, np.nan) * x[0], np.ones(1))


def test_what_a_model_computes_at_random_is_no_distance_from_the_optimum(rng: np.random.Generator) -> None:
    columns, _ = line(rng)
    jitter = 1e-9

    def residuals(x: Array) -> Array:
        return columns @ (x - [2.0, 3.0]) + jitter * np.sin(1e12 * columns[:, 1] * x[0])

    assert not minimise(residuals, np.ones(2), lambda _: columns).converged
    assert minimise(residuals, np.ones(2), lambda _: columns, resolution=jitter).converged


def test_a_sample_without_a_slope_has_no_say_and_stops_no_search() -> None:
    """sqrt|x - 1| at its corner has none: the other samples lead to the optimum all the same."""
    wanted = np.array([2.0, 5.0])

    def residuals(x: Array) -> Array:
        return np.concatenate([x - wanted, [0.0 * np.sqrt(abs(x[0] - 1.0))]])

    def slopes(x: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            vertical = 0.0 * 0.5 / np.sqrt(np.abs(x[:1] - 1.0))
        return np.vstack([np.eye(2), [vertical[0], 0.0]])

    assert not np.all(np.isfinite(slopes(np.ones(2))))
    found = minimise(residuals, np.ones(2), slopes)
    assert found.converged
    np.testing.assert_allclose(found.x, wanted, rtol=1e-9)
