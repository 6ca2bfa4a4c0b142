"""The least squares reach the certified optima of NIST StRD, and where they do not, they say so."""

from __future__ import annotations

import numpy as np
import pytest
from strd import EQUAL_DIGITS, MODELS, regression

FEWEST_RIGHT = 48
"""Of 54: a start may lie where no descent finds home."""


@pytest.mark.parametrize("start", [0, 1])
@pytest.mark.parametrize("name", MODELS)
def test_no_optimum_is_wrong_with_confidence(name: str, start: int) -> None:
    data = regression(name)
    found = data.fitted(start)
    assert not found.converged or data.digits(found.x) >= EQUAL_DIGITS


def test_nearly_every_certified_optimum_is_found_to_six_digits() -> None:
    found = [(regression(name), start) for name in MODELS for start in (0, 1)]
    fits = [(data, data.fitted(start)) for data, start in found]
    assert len(fits) == 54
    assert sum(fit.converged and data.digits(fit.x) >= EQUAL_DIGITS for data, fit in fits) >= FEWEST_RIGHT


@pytest.mark.parametrize("name", MODELS)
def test_standard_deviations_are_the_certified_ones(name: str) -> None:
    # s^2 (J' J)^-1; Lanczos1 leaves rounding alone, of which no deviation can be told.
    data = regression(name)
    found = data.fitted(1)
    upper = np.linalg.inv(np.linalg.qr(found.jacobian, mode="r"))
    spread = found.sum_of_squares / (found.residuals.size - found.x.size)
    deviations = np.sqrt(spread) * np.linalg.norm(upper, axis=1)
    if name != "Lanczos1":
        assert deviations == pytest.approx(data.deviations, rel=1e-4)


@pytest.mark.parametrize("name", MODELS)
def test_a_search_that_is_cut_short_is_no_optimum(name: str) -> None:
    data = regression(name)
    with np.errstate(all="ignore"):
        found = data.fitted(0, evaluations=3)
    assert not found.converged
    assert "evaluations" in found.reason or "variables" in found.reason
