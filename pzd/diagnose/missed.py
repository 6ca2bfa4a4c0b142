"""What a damper misses of kept-back tests, and whether another one misses less beyond chance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pzd.diagnose.thresholds import PREDICTS_WORSE, WORSE_BETWEEN
from pzd.record import Array


@dataclass(frozen=True, eq=False)
class Missed:
    """What a damper misses of kept-back tests, an entry a test, or a part of one that is alone at its voltage."""

    record: tuple[int, ...]
    """Which record an entry is of."""
    error: Array
    """(t,) sum of the squared residual [N^2]."""
    energy: Array
    """(t,) sum of the squared force [N^2]."""
    spread: Array
    """(t,) sum of the squared force about its mean over the entry [N^2]."""
    limit: Array
    """(t,) sum of squares [N^2] that counts as nothing: so many samples of a visible gap, and beside them what offset,
    gain and delay of a test may come to where its other half was fitted."""

    @property
    def criterion(self) -> float | None:
        """W_s pooled over the entries; None without any.

        Equation: sum (F - F_sim)^2 / sum F^2                       Source: Makowski and Knap 2021, eq. (4)
        """
        return float(self.error.sum() / self.energy.sum()) if self.record else None

    @property
    def determination(self) -> float | None:
        """R2 pooled over the entries, each about its own mean; None without any, or where no force moves.

        Equation: 1 - sum (F - F_sim)^2 / sum (F - mean F)^2                      Source: coefficient of determination
        """
        return float(1.0 - self.error.sum() / self.spread.sum()) if self.spread.sum() > 0.0 else None

    def less_than(self, other: Missed) -> bool:
        """Whether less is missed than by another damper, all tests together, by what can be seen."""
        return float((other.error - self.error).sum()) > float(self.limit.sum())

    def of(self, wanted: Sequence[int]) -> Missed:
        """The entries of some records."""
        kept = np.isin(self.record, wanted)
        records = tuple(r for r, k in zip(self.record, kept, strict=True) if k)
        return Missed(records, self.error[kept], self.energy[kept], self.spread[kept], self.limit[kept])


FEWEST = 2
"""Differences of which the scatter is known, at least."""
NOTHING_MISSED = Missed((), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0))
"""Where no test was kept back."""


def joined(parts: Sequence[Missed]) -> Missed:
    """What is missed of several folds, one behind the other."""
    if not parts:
        return NOTHING_MISSED
    sums = (np.concatenate([getattr(p, name) for p in parts]) for name in ("error", "energy", "spread", "limit"))
    return Missed(tuple(i for part in parts for i in part.record), *sums)


def worse(one: Missed, other: Missed) -> bool:
    """Whether one damper predicts worse than another: visibly, and beyond chance however few the tests.

    Equation: mean d > t s_d / sqrt(n), d_i = W_s,i - W_s,i of the other one, P(t_(n-1) < t) = P(z < 2)
                                                                Source: Student 1908, the t-test of paired differences
    """
    from scipy.special import ndtr, stdtrit

    tests = len(one.record)
    return _misses_more(one, other, float(stdtrit(tests - 1, ndtr(PREDICTS_WORSE))) if tests > 1 else 0.0)


def better(one: Missed, other: Missed) -> bool:
    """Whether one damper predicts better than another: visibly, and by two standard errors.

    Of few tests that is less than `worse` asks for: what is added by it is no name, and nothing speaks against it.
    """
    return _misses_more(other, one, PREDICTS_WORSE)


def _misses_more(one: Missed, other: Missed, errors: float) -> bool:
    """Whether one damper misses visibly more than another, and by so many standard errors of the paired differences."""
    if not one.record:
        return False
    difference = (one.error - other.error) / one.energy
    if not np.isfinite(difference).all():  # a path that was lost misses more than any other
        return not np.isfinite(one.error).all() and bool(np.isfinite(other.error).all())
    return other.less_than(one) and float(difference.mean()) > errors * standard_error(difference)


def standard_error(differences: Array) -> float:
    """Of the mean of (n,) differences, however large: their squares may overflow; 0 of a single one."""
    largest = float(np.max(np.abs(differences)))
    if differences.size < FEWEST or largest == 0.0:
        return 0.0
    return largest * float(np.std(differences / largest, ddof=1) / np.sqrt(differences.size))


def much_worse(one: Missed, other: Missed) -> bool:
    """Whether one damper predicts tests of a voltage left out visibly worse than another one, and by half or more."""
    return other.less_than(one) and (one.criterion or 0.0) > WORSE_BETWEEN * (other.criterion or 0.0)
