"""When an effect that takes other values on either half of the tests is still one effect."""

from __future__ import annotations

import numpy as np
import pytest
from campaign import damper_of, sine
from whole_diagnosis import all_but, diagnosed

ONLY_SPRING = all_but("gas_spring")
TESTS = ((0.5, 0.02), (0.5, 0.03), (2.0, 0.02), (2.0, 0.03))


def told(other: float, rng: np.random.Generator) -> tuple[str, tuple[str, ...]]:
    """The verdict and its effects where every second test has another spring, so many times as stiff."""
    springs = (4000.0, other * 4000.0)
    records = tuple(
        sine(damper_of((U,), gas_spring={"k_g": k}), U, f, x, rng, noise=0.003)
        for U in (0.0, 150.0)
        for (f, x), k in zip(TESTS, 2 * springs, strict=True)
    )
    found = diagnosed(records, forbid=ONLY_SPRING, most_added=0).diagnosis
    return found.verdict, found.effects


@pytest.mark.parametrize(("other", "one"), [(1.15, True), (3.0, False)])
def test_a_spring_that_two_halves_tell_a_little_apart_is_one(other: float, one: bool, rng: np.random.Generator) -> None:
    """What gains and clocks of a stand make of it, though quiet tests tell it apart by many standard errors."""
    verdict, effects = told(other, rng)
    assert (verdict, effects) == (("named", ("gas_spring",)) if one else ("unexplained", ()))
