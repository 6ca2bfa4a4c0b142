"""The sparse regression: which shape, beside T0, C, k and the effects, predicts the residual of tests kept back best.

Every test is reduced to the inner products of its residual, its tangents and the shapes, with what its own offset, gain
and delay explain within their priors integrated out. All fits, also those without a fold, are linear in these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pzd.diagnose.hypotheses.shapes import Shape
from pzd.diagnose.missed import Missed, standard_error
from pzd.diagnose.thresholds import PREDICTS_WORSE
from pzd.record import Array

MOST_SHAPES = 3
"""Shapes told together, at most: more would fit anything."""
FEWEST_PARTS = 3
"""Kept-back tests, or halves, from which their scatter says anything."""
SAME_DIRECTION = 1e-9
"""Relative singular value below which two columns are one."""


@dataclass(frozen=True, eq=False)
class ProductsOfTest:
    """One test, or the half of one that is alone at its voltage."""

    record: int
    fold: int
    products: Array
    """(m, m) inner products of residual (first), tangents and shapes, nuisances integrated out [N^2]."""
    samples: int
    energy: float
    """Sum of the squared force [N^2]."""
    spread: float
    """The same about the mean of the force [N^2]."""
    limit: float
    """Sum of squares that counts as nothing [N^2]."""
    noise: float
    """Sum of squares by noise alone [N^2]."""
    weight: float
    """Of a square of its residual [1/N^2]."""


@dataclass(frozen=True)
class Choice:
    """A shape with one value of the parameter that is searched beside its coefficient."""

    value: float | None
    columns: tuple[int, ...]
    """Where they stand among the products."""


@dataclass(frozen=True)
class CandidateShape:
    """A shape with every value that is tried."""

    shape: Shape
    choices: tuple[Choice, ...]


@dataclass(frozen=True, eq=False)
class PredictingShapes:
    """What a set of shapes predicts of the tests kept back."""

    candidates: tuple[CandidateShape, ...]
    missed: Missed
    closes: float
    """Share of the gap above the noise that it closes on the tests kept back."""
    surer: float
    """Mean of the paired differences test by test, in standard errors."""


@dataclass(frozen=True, eq=False)
class FittedShapes:
    """A set of shapes fitted to all tests."""

    choices: tuple[Choice, ...]
    solution: Array
    """(m,) coefficient of every column, 0 where it takes no part."""
    errors: Array
    """(m,) their standard errors, by leaving one test out."""


@dataclass(frozen=True, eq=False)
class Regression:
    """The tests as inner products, and what is tried on them."""

    parts: tuple[ProductsOfTest, ...]
    tangents: int
    """How many columns behind the residual are those of T0, C, k and effects."""
    candidates: tuple[CandidateShape, ...]
    _missed: dict[tuple[str, ...], Missed] = field(default_factory=dict, repr=False)

    @cached_property
    def without_fold(self) -> dict[int, Array]:
        """By fold, the sum of the products of all tests outside of it."""
        return {
            fold: self._products([p for p in self.parts if p.fold != fold])
            for fold in sorted({p.fold for p in self.parts})
        }

    @staticmethod
    def _products(parts: Sequence[ProductsOfTest]) -> Array:
        """(m, m) the weighted sum of the products of some parts."""
        return np.asarray(sum(p.weight * p.products for p in parts))

    def missed(self, candidates: Sequence[CandidateShape]) -> Missed:
        """What is missed of every kept-back test, tangents and shapes fitted without its fold.

        The value of a searched parameter is chosen without it as well, shape by shape.
        """
        names = tuple(c.shape.name for c in candidates)
        if names not in self._missed:
            fitted = {fold: self.solved(products, candidates)[0] for fold, products in self.without_fold.items()}
            errors = [float(fitted[p.fold] @ p.products @ fitted[p.fold]) for p in self.parts]
            self._missed[names] = Missed(
                tuple(p.record for p in self.parts),
                np.array(errors),
                np.array([p.energy for p in self.parts]),
                np.array([p.spread for p in self.parts]),
                np.array([p.limit for p in self.parts]),
            )
        return self._missed[names]

    def solved(self, products: Array, candidates: Sequence[CandidateShape]) -> tuple[Array, tuple[Choice, ...]]:
        """(m,) the combination of columns that is left of the residual, 1 in front; and the values chosen."""
        columns = list(range(1, 1 + self.tangents))
        left, chosen = _left(products, columns), list[Choice]()
        for candidate in candidates:
            tried = [(choice, _left(products, [*columns, *choice.columns])) for choice in candidate.choices]
            choice, left = min(tried, key=lambda one: float(one[1] @ products @ one[1]))
            chosen.append(choice)
            columns += choice.columns
        return left, tuple(chosen)

    def found(self, candidates: Sequence[CandidateShape]) -> PredictingShapes | None:
        """What a set of shapes predicts; None where the last of them adds nothing visible beyond two standard errors.

        Equation: mean d > 2 s_d / sqrt(n), d_i = w_i (e_i before - e_i after)         Source: paired differences
        """
        before, after = self.missed(candidates[:-1]), self.missed(candidates)
        if len(self.parts) < FEWEST_PARTS or not after.less_than(before):
            return None
        plain = self.missed(())
        weight, noise = (np.array([getattr(p, name) for p in self.parts]) for name in ("weight", "noise"))
        better = weight * (before.error - after.error)
        scatter = standard_error(better)
        surer = float(better.mean()) / scatter if scatter > 0.0 else np.inf
        gap = float(weight @ np.maximum(plain.error - noise, 0.0))
        if surer <= PREDICTS_WORSE or gap <= 0.0:
            return None
        closes = float(weight @ (plain.error - after.error)) / gap
        return PredictingShapes(tuple(candidates), after, min(closes, 1.0), surer)

    def alone(self) -> list[PredictingShapes]:
        """Every shape that predicts kept-back tests by itself, the one that closes most first."""
        found = (self.found((candidate,)) for candidate in self.candidates)
        return sorted((f for f in found if f is not None), key=lambda f: -f.closes)

    def together(self, best: PredictingShapes) -> list[PredictingShapes]:
        """The best shape with a second and a third beside it, as far as these predict kept-back tests better yet."""
        grown, last = list[PredictingShapes](), best
        while len(last.candidates) < MOST_SHAPES:
            names = {c.shape.name for c in last.candidates}
            tried = (self.found((*last.candidates, c)) for c in self.candidates if c.shape.name not in names)
            more = max((f for f in tried if f is not None), key=lambda f: f.closes, default=None)
            if more is None:
                break
            grown.append(more)
            last = more
        return grown

    def fitted(self, candidates: Sequence[CandidateShape]) -> FittedShapes:
        """A set of shapes fitted to all tests, with the scatter that leaving one out shows.

        Equation: s^2 = (n - 1)/n sum (c_-i - mean c_-i)^2                  Source: Efron and Stein 1981, jackknife
        """
        whole = self._products(self.parts)
        left, choices = self.solved(whole, candidates)
        fixed = [replace(c, choices=(choice,)) for c, choice in zip(candidates, choices, strict=True)]
        records = sorted({p.record for p in self.parts})
        rest = (whole - self._products([p for p in self.parts if p.record == r]) for r in records)
        without = np.array([-self.solved(products, fixed)[0] for products in rest])
        n = len(records)
        errors = np.sqrt((n - 1) / n * np.sum((without - without.mean(axis=0)) ** 2, axis=0))
        return FittedShapes(choices, -left, errors)


def _left(products: Array, columns: Sequence[int]) -> Array:
    """(m,) the residual less the columns fitted to it: 1 in front, minus their coefficients behind."""
    index = np.asarray(columns)
    size = np.sqrt(np.maximum(np.diag(products)[index], 1e-300))
    normal = products[np.ix_(index, index)] / np.outer(size, size)
    found = np.linalg.lstsq(normal, products[index, 0] / size, rcond=SAME_DIRECTION)[0] / size
    left = np.zeros(len(products))
    left[0], left[index] = 1.0, -found
    return left
