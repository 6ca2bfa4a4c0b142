"""Leave-group-out cross-validation: tests dealt into folds, errors of held-out tests, paired comparison of these.

Which fit is made without a fold is the matter of its user; what becomes of its errors is the same for all.

Source: Stone 1974, J. R. Stat. Soc. B 36, 111-147
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.fit.intervals import student_quantile
from pzd.record import Array

FOLDS = 5
"""Folds over which tests are dealt.

Reason: about a fifth of the tests is held out at a time: enough is left to fit, and the refits stay few."""
FEWEST_TESTS = 3
"""Fewest held-out tests, or halves of one, by which models are chosen: two have a scatter of a single number."""
FEWEST_DIFFERENCES = 2
"""Fewest differences of which a standard error can be computed."""
STANDARD_ERRORS = 2.0
"""Standard errors of the mean paired difference from which it is beyond chance; of few tests as many more as Student's
t takes for the same confidence, where `student_errors` is asked.

Reason: the customary 95 %."""
SMALLEST_SINGULAR = 1e-10
"""Singular value of a fold's normal equations, scaled to a unit diagonal, below which it shows no direction.

Reason: far above rounding, far below what tests determine."""


def folds_in_turn(tests: int, turn: int = 0) -> list[int]:
    """Deal tests into folds in turn: each is held out once, and neighbours in the order never together.

    Parameters
    ----------
    tests : their number, which are as many folds where it is less than `FOLDS`; two halves of one that is alone count
        as two
    turn : fold of the first test

    Returns
    -------
    number of the fold of each test

    Examples
    --------
    >>> folds_in_turn(7)
    [0, 1, 2, 3, 4, 0, 1]
    >>> folds_in_turn(3, turn=1)
    [1, 2, 0]
    """
    return [(turn + place) % min(FOLDS, tests) for place in range(tests)]


# --- Errors of held-out tests


@dataclass(frozen=True, eq=False)
class PredictionError:
    """Prediction error of held-out tests, one entry per test, or per half of one that is alone at its voltage.

    Examples
    --------
    Two tests of energy 100 N^2 each, predicted with squared residuals of 1 and 3 N^2:

    >>> error = PredictionError.of_entries([0, 1], [(1.0, 100.0, 80.0, 0.0), (3.0, 100.0, 80.0, 0.0)])
    >>> error.criterion, error.determination
    (0.02, 0.975)
    """

    records: tuple[int, ...]
    """Index of the record of each entry."""
    error: Array
    """(t,) sum of squared residuals [N^2]."""
    energy: Array
    """(t,) sum of squared forces [N^2]."""
    spread: Array
    """(t,) sum of squared deviations of the force from its mean over the entry [N^2]."""
    negligible: Array
    """(t,) error that does not count [N^2]: a residual of the visible size at every sample, and where the other half
    of the test was fitted also what offset, gain and delay of the test may contribute."""
    beyond_own: Array | None = None
    """(t,) error beyond what each test's own offset, gain and delay explain [N^2]; None where it is not asked for."""

    @classmethod
    def of_entries(cls, records: Sequence[int], entries: Sequence[tuple[float, ...]]) -> PredictionError:
        """Collect entries (error, energy, spread, negligible), or with what is beyond their own, of some records."""
        columns = np.array(entries, dtype=np.float64).T if entries else np.zeros((4, 0))
        return cls(tuple(records), *columns)

    @classmethod
    def concatenated(cls, parts: Sequence[PredictionError]) -> PredictionError:
        """Join the entries of several folds."""
        names = ("error", "energy", "spread", "negligible")
        sums = (np.concatenate([np.zeros(0), *(getattr(p, name) for p in parts)]) for name in names)
        beyond = [p.beyond_own for p in parts if p.records]
        known = [each for each in beyond if each is not None]
        whole = np.concatenate(known) if known and len(known) == len(beyond) else None
        return replace(cls(tuple(i for part in parts for i in part.records), *sums), beyond_own=whole)

    @property
    def shapes(self) -> PredictionError:
        """Errors with each test's own offset, gain and delay projected out, which no damper can know."""
        return self if self.beyond_own is None else replace(self, error=self.beyond_own)

    @property
    def criterion(self) -> float | None:
        """W_s pooled over the entries; None without any.

        Equation: sum (F - F_sim)^2 / sum F^2                       Source: Makowski and Knap 2021, eq. (4)
        """
        return float(self.error.sum() / self.energy.sum()) if self.records else None

    @property
    def determination(self) -> float | None:
        """R2 pooled over the entries, each about its own mean; None without any, or where the force is constant.

        Equation: 1 - sum (F - F_sim)^2 / sum (F - mean F)^2                      Source: coefficient of determination
        """
        return float(1.0 - self.error.sum() / self.spread.sum()) if self.spread.sum() > 0.0 else None

    def visibly_below(self, other: PredictionError) -> bool:
        """Whether the total error is smaller than another one by a visible amount."""
        return float((other.error - self.error).sum()) > float(self.negligible.sum())

    def of_records(self, wanted: Sequence[int]) -> PredictionError:
        """Select the entries of some records."""
        kept = np.isin(self.records, wanted)
        records = tuple(r for r, k in zip(self.records, kept, strict=True) if k)
        beyond = None if self.beyond_own is None else self.beyond_own[kept]
        columns = self.error[kept], self.energy[kept], self.spread[kept], self.negligible[kept]
        return PredictionError(records, *columns, beyond)


def squared_sums(force: Array, residual: Array) -> tuple[float, float, float]:
    """Return the sums of squares of residual, force and force about its mean, from (n,) samples [N]."""
    about_mean = force - force.mean()
    return float(residual @ residual), float(force @ force), float(about_mean @ about_mean)


def held_out_residuals(
    slopes: Sequence[Array],
    residuals: Sequence[Array],
    folds: Sequence[Sequence[int]],
    prior: Array | None = None,
) -> list[Array]:
    """Compute the residuals of each test about the linear fit without its fold; without refits.

    Equation: r_f + J_f (A - J_f' J_f)^-1 J_f' r_f, A = J' J + P' P, f the tests of a fold, P the prior
                                                        Source: Allen 1974, Technometrics 16, 125-127, by groups

    Parameters
    ----------
    slopes : (n, p) of each test, derivatives of the model or of its residuals: the sign does not matter
    residuals : (n,) of each test at the optimum of all
    folds : the tests that each holds out; a test of none of them stays as it is
    prior : (q, p) derivatives of the residuals of a prior

    Returns
    -------
    (n,) of each test

    Examples
    --------
    The mean of 1, 2 and 6 is 3; of the other two it is 4, 3.5 and 1.5:

    >>> one = [np.ones((1, 1))] * 3
    >>> [float(r[0]) for r in held_out_residuals(one, [np.array([x - 3.0]) for x in (1.0, 2.0, 6.0)], [[0], [1], [2]])]
    [-3.0, -1.5, 4.5]
    """
    normal = sum((each.T @ each for each in slopes), np.zeros((slopes[0].shape[1],) * 2))
    if prior is not None:
        normal = normal + prior.T @ prior
    size = np.sqrt(np.maximum(np.diag(normal), np.finfo(np.float64).tiny))
    found = list(residuals)
    for members in folds:
        held, left = (np.concatenate([of[i] for i in members]) for of in (slopes, residuals))
        rest = (normal - held.T @ held) / np.outer(size, size)
        step = np.linalg.lstsq(rest, held.T @ left / size, rcond=SMALLEST_SINGULAR)[0] / size
        for i in members:
            found[i] = residuals[i] + slopes[i] @ step
    return found


# --- Paired comparison: the t-test of the differences, test by test


def standard_error(differences: Array) -> float:
    """Compute the standard error of the mean of (n,) differences; 0 of a single one.

    Examples
    --------
    >>> round(standard_error(np.array([1.0, 2.0, 3.0])), 4)
    0.5774
    """
    largest = float(np.max(np.abs(differences)))  # scaled by it, for the squares of a diverged simulation may overflow
    if differences.size < FEWEST_DIFFERENCES or largest == 0.0:
        return 0.0
    return largest * float(np.std(differences / largest, ddof=1) / np.sqrt(differences.size))


def paired_t(differences: Array) -> float:
    """Compute the mean of (n,) paired differences in standard errors; 0 of a single one, or of one that is not finite.

    Equation: t = mean d / (s_d / sqrt(n))                      Source: Student 1908, the t-test of paired differences

    Examples
    --------
    >>> round(paired_t(np.array([1.0, 2.0, 3.0])), 4)
    3.4641
    """
    if differences.size < FEWEST_DIFFERENCES or not np.isfinite(differences).all():
        return 0.0
    error, mean = standard_error(differences), float(differences.mean())
    return mean / error if error > 0.0 else float(np.sign(mean)) * np.inf if mean else 0.0


def student_errors(differences: int) -> float:
    """Return the standard errors beyond which a mean is no chance, however few the differences; 0 of a single one.

    Equation: P(t_(n-1) < t) = P(z < 2)                                         Source: Student 1908

    Examples
    --------
    >>> round(student_errors(3), 2), round(student_errors(1000), 2)
    (4.53, 2.0)
    """
    from scipy.special import ndtr

    if differences < FEWEST_DIFFERENCES:
        return 0.0
    return float(student_quantile(differences - 1.0, float(ndtr(STANDARD_ERRORS))))


def log_ratios(one: PredictionError, other: PredictionError) -> Array:
    """Compute the logarithms (t,) of the ratios of the errors of another model to those of one.

    Of ratios each test counts alike, and no slow or hard one rules; an error that does not show is none.

    Equation: d_i = ln((e'_i + e_0,i) / (e_i + e_0,i)), e_0 the negligible error
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.log((other.error + one.negligible) / (one.error + one.negligible)))


def predicts_worse(one: PredictionError, other: PredictionError) -> bool:
    """Whether one model predicts worse than another: visibly, and beyond chance however few the tests.

    Equation: mean d > t s_d / sqrt(n), d_i = W_s,i - W_s,i of the other one, t as in `student_errors`
                                                                Source: Student 1908, the t-test of paired differences
    """
    return _error_is_larger(one, other, student_errors(len(one.records)))


def predicts_better(one: PredictionError, other: PredictionError) -> bool:
    """Whether one model predicts better than another: visibly, and beyond chance however few the tests.

    The differences may be those of the logarithms too: an effect that shows much in one test and little in another, and
    takes the same share of either error, is no chance.
    """
    errors = student_errors(len(one.records))
    if _error_is_larger(other, one, errors):
        return True
    return one.visibly_below(other) and paired_t(log_ratios(one, other)) > errors


def _error_is_larger(one: PredictionError, other: PredictionError, errors: float) -> bool:
    """Whether one error is visibly larger, and by so many standard errors of the paired differences."""
    if not one.records:
        return False
    difference = (one.error - other.error) / one.energy
    if not np.isfinite(difference).all():  # a diverged simulation is worse than any other
        return not np.isfinite(one.error).all() and bool(np.isfinite(other.error).all())
    return other.visibly_below(one) and float(difference.mean()) > errors * standard_error(difference)
