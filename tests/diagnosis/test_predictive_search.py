"""Steps of the search for prediction: what they gain at kept-back tests against what they lose between voltages."""

from __future__ import annotations

from typing import Any, cast

import pytest

from pzd.diagnosis.predictive_search import Tried, loses_between
from pzd.fit.cross_validation import PredictionError

ENERGY = 1e4
"""Sum of squared forces of a test [N^2]."""


def errors(held_out: float, between: float) -> Tried:
    """What was tried, with W_s of kept-back tests and of left-out voltages; what is below 1e-4 is not visible."""

    def of(criterion: float) -> PredictionError:
        entry = (criterion * ENERGY, ENERGY, ENERGY, 1e-4 * ENERGY)
        return PredictionError.of_entries([0, 1], [entry, entry])

    return Tried(cast("Any", None), of(held_out), of(between))


@pytest.mark.parametrize(
    ("held_out", "between", "loses"),
    [
        (0.006, 0.0080, False),  # nothing lost
        (0.006, 0.0087, False),  # half the error for a few per cent: measured, a branch of an MR damper
        (0.011, 0.0095, True),  # a twelfth gained, a sixth lost
        (0.004, 0.0190, True),  # beyond what the plain damper misses
        (0.0119, 0.00805, False),  # no visible loss
    ],
)
def test_a_step_may_lose_between_voltages_less_than_it_gains_and_never_what_the_plain_damper_has(
    held_out: float, between: float, *, loses: bool
) -> None:
    plain = errors(0.02, 0.0185).interpolation_error
    assert loses_between(errors(0.012, 0.0080), errors(held_out, between), plain) is loses
