"""The functions of the exponential integrator, and the rates that it integrates exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from pzd.damper.regimes import bend, end_corrected, phi


@pytest.mark.parametrize("z", [-700.0, -37.0, -1.001, -0.999, -1e-3, 0.0, 0.3, 2.0])
def test_the_functions_are_those_of_the_exponential_of_a_larger_matrix(z: float) -> None:
    """Equation: exp of [[z, 1, 0, ...], [0, 0, 1, ...], ...] has phi_k(z) after e^z in its first row.

    Source: Sidje 1998, ACM Trans. Math. Softw. 24, theorem 1
    """
    chain = np.diag(np.ones(5), 1)
    chain[0, 0] = z
    np.testing.assert_allclose(phi(z), expm(chain)[0, 1:], rtol=1e-12)


def test_the_functions_have_no_step_where_the_series_ends() -> None:
    below, above = phi(-1.0 + 1e-12), phi(-1.0 - 1e-12)
    np.testing.assert_allclose(below, above, rtol=1e-11)


@pytest.mark.parametrize("z", [-50.0, -2.0, 0.0])
def test_a_rate_of_fourth_power_is_integrated_exactly_and_the_error_estimate_is_no_less_than_the_error_of_third_power(
    z: float,
) -> None:
    """The step is phi_k weighted by the rest of the rate: theta^k weighs k! phi_(k + 1)."""
    a, b, fourth = 0.7, -0.4, 0.05

    def rest(theta: float) -> float:
        return a * theta**2 + b * theta**3 + fourth * theta**4

    over = phi(z)
    truth = 2.0 * a * over.three + 6.0 * b * over.four + 24.0 * fourth * over.five
    found = bend(*(rest(theta) for theta in (0.5, 0.9)))
    without = 2.0 * found[0] * over.three + 6.0 * found[1] * over.four
    added, error = end_corrected(*found, rest(1.0), over)
    assert without + added == pytest.approx(truth, rel=1e-12)
    assert abs(without - truth) <= error * (1.0 + 1e-9)
