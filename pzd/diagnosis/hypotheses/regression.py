"""The sparse regression: which shape, beside T0, C, k and the effects, predicts the residual of tests kept back best.

Every test is reduced to the inner products of its residual, its tangents and the shapes, with what its own offset, gain
and delay explain within their priors integrated out. All fits, also those without a fold, are linear in these.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pzd.damper.confounders import known
from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.campaign import ResidualCheck, bend_beside_jumps
from pzd.diagnosis.cross_validation import Missed, Trials, deal, standard_error
from pzd.diagnosis.data import Prepared
from pzd.diagnosis.fit.prediction import predicted_force
from pzd.diagnosis.hypotheses.shapes import Shape, Signals, shapes_of, signals_of
from pzd.diagnosis.search.evidence import nearest_row
from pzd.diagnosis.thresholds import PREDICTS_WORSE
from pzd.record import Array, Mask
from pzd.signals.nuisance import NuisanceConfig, nuisance_columns

# ----------------------------------------------------------------------------------------------------
# What T0, C, k and the parameters of adopted effects could take up of a residual, to first order.


STEP = 0.01
"""Relative step of a difference: large against the tolerance of the path, small against what bends the force."""
LEAST_FRICTION = 0.01
"""T0 moves by this share of the largest T0 at least, where it is next to nothing."""

Key = tuple[str, str, int]
"""Effect (or `base`), parameter, and base row, -1 where one value serves all."""


@dataclass(frozen=True)
class _Moved:
    """A damper with one parameter moved."""

    key: Key
    damper: Damper
    step: float
    """By how much, as a share of the parameter's own size."""


def tangents(damper: Damper, prepared: Prepared, force: Array) -> dict[Key, Array]:
    """(n,) change of the force [N] for a relative change by one of each parameter that a test depends on.

    Parameters
    ----------
    damper : that is handed on, about the middle of the stroke
    prepared : the test
    force : (n,) that the damper gives in it [N]
    """
    rows: Sequence[int] = [nearest_row(damper.base, prepared)] if prepared.constant else range(len(damper.base))
    found = {}
    for moved in (*_base_moved(damper, rows), *_effects_moved(damper, rows)):
        found[moved.key] = (predicted_force(moved.damper, prepared) - force) / moved.step
    return found


def _base_moved(damper: Damper, rows: Sequence[int]) -> Iterator[_Moved]:
    least = LEAST_FRICTION * max(row.T0_N for row in damper.base)
    for i in rows:
        row = damper.base[i]
        moved = {
            "T0_N": row.T0_N + STEP * max(row.T0_N, least, 1.0),
            "C_Ns_per_m": row.C_Ns_per_m * (1.0 + STEP),
            "k_N_per_m": row.k_N_per_m * (1.0 + STEP),
        }
        for name, value in moved.items():
            base: list[BaseRow] = list(damper.base)
            base[i] = row.model_copy(update={name: value})
            yield _Moved(("base", name, i), damper.model_copy(update={"base": tuple(base)}), STEP)


def _effects_moved(damper: Damper, rows: Sequence[int]) -> Iterator[_Moved]:
    for effect, values in damper.effects.items():
        for parameter in known()[effect].parameters:
            value = values[parameter.name]
            place = -1 if isinstance(value, float) else rows[0] if len(rows) == 1 else len(damper.base)
            moved = tuple((1.0 + STEP) * each for each in value) if isinstance(value, tuple) else (1.0 + STEP) * value
            changed = {**damper.effects, effect: {**values, parameter.name: moved}}
            yield _Moved((effect, parameter.name, place), damper.model_copy(update={"effects": changed}), STEP)


# ----------------------------------------------------------------------------------------------------


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


# ----------------------------------------------------------------------------------------------------
# The residual of every test, with what T0, C, k, effects and the test's own nuisances could take up of it.


MOST_SAMPLES = 3000
"""Of one test, evenly taken: a shape is smooth, and the inner products of more say the same."""


@dataclass(frozen=True, eq=False)
class ResidualOfTest:
    """One test against the damper handed on, at the samples that count."""

    check: ResidualCheck
    signals: Signals
    tangents: dict[Key, Array]
    """(n,) each [N]."""
    counts: Mask
    """(n,) the samples that the regression takes."""
    config: NuisanceConfig
    noise: float
    """Variance of a sample that the nuisances are weighed against: by noise, and by the gap itself [N^2]."""

    @cached_property
    def nuisances(self) -> Array:
        """(n, c) force of one standard deviation of the test's own offset, gain and delay [N]."""
        return nuisance_columns(self.signals.F, self.check.prepared.record.rate, self.config)

    def taken_up(self, residual: Array, counts: Mask) -> Array:
        """(n,) what offset, gain and delay within their priors explain of a residual (n,) over some samples [N]."""
        A = self.nuisances[counts]
        return np.asarray(self.nuisances @ np.linalg.solve(self._normal(A), A.T @ residual[counts]))

    def products(self, columns: Array, counts: Mask) -> Array:
        """(m, m) inner products of columns (n, m) over some samples, nuisances integrated out.

        Equation: Z' (I - A (A' A + s^2 I)^-1 A') Z           Source: Woodbury identity; Gaussian prior of the nuisances
        """
        Z, A = columns[counts], self.nuisances[counts]
        across = A.T @ Z
        return np.asarray(Z.T @ Z - across.T @ np.linalg.solve(self._normal(A), across))

    def _normal(self, A: Array) -> Array:
        return np.asarray(A.T @ A + self.noise * np.eye(A.shape[1]))


@dataclass(frozen=True, eq=False)
class Residuals:
    """All tests of a setting against the damper handed on."""

    tests: tuple[ResidualOfTest, ...]
    trials: Trials
    damper: Damper

    @cached_property
    def keys(self) -> tuple[Key, ...]:
        """The parameters whose tangents some test has, in the order of the columns."""
        return tuple(dict.fromkeys(key for test in self.tests for key in test.tangents))

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """The shapes that the tests can show."""
        return shapes_of([test.signals for test in self.tests])

    def tangents(self, test: ResidualOfTest) -> Array:
        """(n, q) the tangents of a test, one column a key."""
        nothing = np.zeros(test.counts.size)
        return np.column_stack([test.tangents.get(key, nothing) for key in self.keys])

    @cached_property
    def regression(self) -> Regression:
        """The tests as inner products, dealt into folds as those that decide what is handed on are."""
        folds = deal([test.check.prepared for test in self.tests], self.trials.plain).folds
        parts = []
        for i, test in enumerate(self.tests):
            columns = np.column_stack([test.check.residual, self.tangents(test), self._shapes(test.signals)])
            masks = [(number, fold[i] & test.counts) for number, fold in enumerate(folds) if fold[i].any()]
            parts += [self._part(i, fold, test, columns, counts) for fold, counts in masks if counts.any()]
        return Regression(tuple(parts), len(self.keys), self._candidates())

    def _shapes(self, signals: Signals) -> Array:
        """(n, p) every shape with every value that is tried."""
        return np.column_stack([found for shape in self.shapes for _, found in shape.columns(signals)])

    def _candidates(self) -> tuple[CandidateShape, ...]:
        found, at = [], 1 + len(self.keys)
        for shape in self.shapes:
            choices = []
            for value, columns in shape.columns(self.tests[0].signals):
                choices.append(Choice(value, tuple(range(at, at + columns.shape[1]))))
                at += columns.shape[1]
            found.append(CandidateShape(shape, tuple(choices)))
        return tuple(found)

    def _part(self, record: int, fold: int, test: ResidualOfTest, columns: Array, counts: Mask) -> ProductsOfTest:
        force = test.check.prepared.record.force[counts]
        return ProductsOfTest(
            record=record,
            fold=fold,
            products=test.products(columns, counts),
            samples=force.size,
            energy=float(force @ force),
            spread=float(np.sum((force - force.mean()) ** 2)),
            limit=force.size * (self.trials.visible * test.check.peak) ** 2,
            noise=force.size * test.check.variance,
            weight=1.0 / test.noise,
        )


def residuals_of(trials: Trials, damper: Damper) -> Residuals:
    """What every test leaves of a damper.

    Parameters
    ----------
    trials : the tests, dealt into folds, every sample of which may be seen
    damper : that is handed on, about the middle of the stroke
    """
    campaign = trials.campaign
    checks = campaign.checks(damper)
    gap = float(np.mean([max(check.power, 0.0) for check in checks]))
    known = [t for check in checks if (t := check.prepared.record.median_temperature()) is not None]
    warmth = float(np.median(known)) if known else None
    reach = max(float(np.max(np.abs(check.prepared.record.displacement))) for check in checks)

    def made(check: ResidualCheck) -> ResidualOfTest:
        return ResidualOfTest(
            check,
            signals_of(check.prepared, check.predicted, warmth, reach),
            tangents(damper, check.prepared, check.predicted),
            _counted(check),
            campaign.nuisance,
            check.variance + gap,
        )

    return Residuals(campaign.each(made, checks), trials, damper)


def _counted(check: ResidualCheck) -> Mask:
    """(n,) the checked samples beside no jump, evenly thinned."""
    counts = check.wanted & (bend_beside_jumps(check.prepared, check.predicted) == 0.0)
    rows = np.flatnonzero(counts)
    thinned: Mask = np.zeros(counts.size, dtype=np.bool_)
    thinned[rows[:: -(-rows.size // MOST_SAMPLES) or 1]] = True
    return thinned


def voltage_of(test: ResidualOfTest) -> float | None:
    """The constant control signal of a test [V]; None where it moves or there is none."""
    prepared = test.check.prepared
    return prepared.record.median_voltage() if prepared.constant else None


def groups_of(tests: Sequence[ResidualOfTest], trials: Trials) -> dict[float | None, list[ResidualOfTest]]:
    """The tests by voltage [V], rising; None for those whose voltage moves, or that have none."""
    found: dict[float | None, list[ResidualOfTest]] = {}
    nodes = [row.voltage_V for row in trials.plain.base if row.voltage_V is not None]
    for test in tests:
        own = voltage_of(test)
        at = None if own is None or not nodes else min(nodes, key=lambda node: abs(node - own))
        found.setdefault(at, []).append(test)
    return dict(sorted(found.items(), key=lambda item: (item[0] is None, item[0] or 0.0)))
