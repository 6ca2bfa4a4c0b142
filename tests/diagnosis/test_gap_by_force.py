"""An effect of the hard conditions may close the gap although the soft ones keep a gap of another kind."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.gap import gap_in_force, visible_gap
from pzd.diagnosis.search.acceptance import leaves_gap

SOFT, HARD = 100.0, 1000.0
"""Peak forces of two tests [N]."""
BEFORE = (30.0, 100.0)
"""Gap of either, r.m.s. [N]: 30 % of the soft one's peak, 10 % of the hard one's."""


def checks(gaps: tuple[float, float]) -> list[Any]:
    """The two tests with such gaps."""
    wanted = np.ones(1000, dtype=np.bool_)
    return [SimpleNamespace(power=g**2, peak=p, wanted=wanted) for g, p in zip(gaps, (SOFT, HARD), strict=True)]


def refused(left: tuple[float, float]) -> str | None:
    """What is said of a candidate that leaves such gaps."""
    evidence = SimpleNamespace(gap_is_significant=lambda *_: True, campaign=SimpleNamespace(checks=checks))
    before, candidate = SimpleNamespace(damper=BEFORE), SimpleNamespace(fitted=SimpleNamespace(damper=left))
    return leaves_gap(cast("Any", evidence), DiagnoseConfig(), cast("Any", before), cast("Any", candidate))


def test_the_gap_counts_by_each_peak_or_by_force() -> None:
    assert visible_gap(checks(BEFORE)) == pytest.approx(np.sqrt((0.3**2 + 0.1**2) / 2.0))
    assert gap_in_force(checks(BEFORE)) == pytest.approx(np.sqrt((30.0**2 + 100.0**2) / 2.0))


@pytest.mark.parametrize("left", [(30.0, 30.0), (20.0, 100.0), (1.0, 1.0)])
def test_closing_a_fifth_by_either_count_is_enough(left: tuple[float, float]) -> None:
    assert refused(left) is None


@pytest.mark.parametrize("left", [(29.0, 98.0), (32.0, 30.0), (10.0, 110.0)])
def test_little_corrections_and_what_widens_the_gap_by_either_count_are_refused(left: tuple[float, float]) -> None:
    assert refused(left) is not None
