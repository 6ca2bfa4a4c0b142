"""Sparse regression of the residual: which shape, fitted beside T0, C, k and the effects, predicts held-out tests best.

Every test is reduced to the inner products of its residual, its tangents and the shapes, with what its own offset, gain
and delay explain within their priors projected out. All fits, also those without a fold, are linear in these.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pzd.damper.confounders import known
from pzd.damper.element import STIFFEST
from pzd.damper.model import Damper
from pzd.diagnosis.campaign import nearest_row
from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.diagnosis.cross_validation import CrossValidation, assign_folds
from pzd.diagnosis.fit.prediction import predicted_force
from pzd.diagnosis.gap import ResidualCheck, jump_bend
from pzd.diagnosis.hypotheses.shapes import Shape, Signals, shapes_of, signals_of
from pzd.fit.cross_validation import FEWEST_TESTS, STANDARD_ERRORS, PredictionError, paired_t, squared_sums
from pzd.record import Array, Mask
from pzd.signals.nuisance import NuisanceConfig, nuisance_columns

MOST_SHAPES = 3
"""Most shapes reported together: more would fit anything."""
SAME_DIRECTION = 1e-9
"""Relative singular value below which two columns are one."""
MOST_SAMPLES = 3000
"""Most samples of one test, evenly spaced: a shape is smooth, and the inner products of more say the same."""
STEP = 0.01
"""Relative step of a difference: large against the tolerance of the path, small against the curvature of the force."""
LEAST_FRICTION = 0.01
"""Share of the largest T0 by which a T0 next to zero is perturbed at least."""

ParameterKey = tuple[str, str, int]
"""Effect (or `base`), parameter, and base row, -1 where one value serves all."""

# --- Regression on inner products


@dataclass(frozen=True, eq=False)
class RecordProducts:
    """One test, or half of one that is alone at its voltage, as inner products."""

    record: int
    fold: int
    products: Array
    """(m, m) inner products of residual (first), tangents and shapes, nuisances projected out [N^2]."""
    energy: float
    """Sum of the squared force [N^2]."""
    spread: float
    """The same about the mean of the force [N^2]."""
    negligible: float
    """Sum of squared residuals that does not count [N^2]."""
    noise: float
    """Sum of squared residuals by noise alone [N^2]."""
    weight: float
    """Of a squared residual [1/N^2]."""


@dataclass(frozen=True)
class Choice:
    """A shape with one value of the parameter that is searched beside its coefficient."""

    value: float | None
    columns: tuple[int, ...]
    """Indices among the products."""


@dataclass(frozen=True)
class CandidateShape:
    """A shape with every value that is tried."""

    shape: Shape
    choices: tuple[Choice, ...]


@dataclass(frozen=True, eq=False)
class PredictingShapes:
    """A set of shapes with its prediction of the held-out tests."""

    candidates: tuple[CandidateShape, ...]
    error: PredictionError
    closes: float
    """Share of the gap above the noise that it closes on held-out tests."""
    standard_errors: float
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
    """The tests as inner products, and the candidate shapes."""

    parts: tuple[RecordProducts, ...]
    tangents: int
    """Number of columns behind the residual that are those of T0, C, k and effects."""
    candidates: tuple[CandidateShape, ...]
    _errors: dict[tuple[str, ...], PredictionError] = field(default_factory=dict, repr=False)

    @cached_property
    def without_fold(self) -> dict[int, Array]:
        """Sum of the products of all tests outside of each fold."""
        return {
            fold: _weighted_sum([p for p in self.parts if p.fold != fold])
            for fold in sorted({p.fold for p in self.parts})
        }

    def held_out_error(self, candidates: Sequence[CandidateShape]) -> PredictionError:
        """Compute the error of every held-out test, tangents and shapes fitted without its fold.

        The value of a searched parameter is chosen without it as well, shape by shape.
        """
        names = tuple(c.shape.name for c in candidates)
        if names not in self._errors:
            fitted = {fold: self.solved(products, candidates)[0] for fold, products in self.without_fold.items()}
            entries = [
                (float(fitted[p.fold] @ p.products @ fitted[p.fold]), p.energy, p.spread, p.negligible)
                for p in self.parts
            ]
            self._errors[names] = PredictionError.of_entries([p.record for p in self.parts], entries)
        return self._errors[names]

    def solved(self, products: Array, candidates: Sequence[CandidateShape]) -> tuple[Array, tuple[Choice, ...]]:
        """Return the (m,) combination of columns that is the fitted residual, 1 in front, and the chosen values."""
        columns = list(range(1, 1 + self.tangents))
        left, chosen = _fitted_residual(products, columns), list[Choice]()
        for candidate in candidates:
            tried = [(choice, _fitted_residual(products, [*columns, *choice.columns])) for choice in candidate.choices]
            choice, left = min(tried, key=lambda one: float(one[1] @ products @ one[1]))
            chosen.append(choice)
            columns += choice.columns
        return left, tuple(chosen)

    def predicting(self, candidates: Sequence[CandidateShape]) -> PredictingShapes | None:
        """Return what a set of shapes predicts; None where the last adds nothing visible beyond two standard errors.

        A shape is a hint and names nothing: as in `predicts_better` two standard errors are enough. The weights set the
        noise of each test apart, which the errors of parts of a test do not.

        Equation: mean d > 2 s_d / sqrt(n), d_i = w_i (e_i before - e_i after)         Source: paired differences
        """
        before, after = self.held_out_error(candidates[:-1]), self.held_out_error(candidates)
        if len(self.parts) < FEWEST_TESTS or not after.visibly_below(before):
            return None
        baseline = self.held_out_error(())
        weight, noise = (np.array([getattr(p, name) for p in self.parts]) for name in ("weight", "noise"))
        errors = paired_t(weight * (before.error - after.error))
        gap = float(weight @ np.maximum(baseline.error - noise, 0.0))
        if errors <= STANDARD_ERRORS or gap <= 0.0:
            return None
        closes = float(weight @ (baseline.error - after.error)) / gap
        return PredictingShapes(tuple(candidates), after, min(closes, 1.0), errors)

    def alone(self) -> list[PredictingShapes]:
        """Return every shape that predicts held-out tests by itself, the one that closes most first."""
        found = (self.predicting((candidate,)) for candidate in self.candidates)
        return sorted((f for f in found if f is not None), key=lambda f: -f.closes)

    def together(self, best: PredictingShapes) -> list[PredictingShapes]:
        """Add a second and a third shape to the best, as far as these improve the prediction of held-out tests."""
        grown, last = list[PredictingShapes](), best
        while len(last.candidates) < MOST_SHAPES:
            names = {c.shape.name for c in last.candidates}
            tried = (self.predicting((*last.candidates, c)) for c in self.candidates if c.shape.name not in names)
            more = max((f for f in tried if f is not None), key=lambda f: f.closes, default=None)
            if more is None:
                break
            grown.append(more)
            last = more
        return grown

    def fitted(self, candidates: Sequence[CandidateShape]) -> FittedShapes:
        """Fit a set of shapes to all tests, with jackknife standard errors.

        Equation: s^2 = (n - 1)/n sum (c_-i - mean c_-i)^2                  Source: Efron and Stein 1981, jackknife
        """
        whole = _weighted_sum(self.parts)
        left, choices = self.solved(whole, candidates)
        fixed = [replace(c, choices=(choice,)) for c, choice in zip(candidates, choices, strict=True)]
        records = sorted({p.record for p in self.parts})
        rest = (whole - _weighted_sum([p for p in self.parts if p.record == r]) for r in records)
        without = np.array([-self.solved(products, fixed)[0] for products in rest])
        n = len(records)
        errors = np.sqrt((n - 1) / n * np.sum((without - without.mean(axis=0)) ** 2, axis=0))
        return FittedShapes(choices, -left, errors)


def _weighted_sum(parts: Sequence[RecordProducts]) -> Array:
    return np.asarray(sum(p.weight * p.products for p in parts))


def _fitted_residual(products: Array, columns: Sequence[int]) -> Array:
    """Return the (m,) residual less the columns fitted to it: 1 in front, minus their coefficients behind."""
    index = np.asarray(columns)
    size = np.sqrt(np.maximum(np.diag(products)[index], 1e-300))
    normal = products[np.ix_(index, index)] / np.outer(size, size)
    found = np.linalg.lstsq(normal, products[index, 0] / size, rcond=SAME_DIRECTION)[0] / size
    left = np.zeros(len(products))
    left[0], left[index] = 1.0, -found
    return left


# --- Residuals of the tests, with tangents and nuisances


@dataclass(frozen=True, eq=False)
class RecordResidual:
    """Residual of one test against the adopted damper, and what could explain it."""

    check: ResidualCheck
    signals: Signals
    tangents: dict[ParameterKey, Array]
    """(n,) each [N]."""
    counts: Mask
    """(n,) samples of the regression."""
    config: NuisanceConfig
    noise: float
    """Variance of a sample that the nuisances are weighed against: by noise, and by the gap itself [N^2]."""

    @cached_property
    def nuisances(self) -> Array:
        """(n, c) force of one standard deviation of the test's own offset, gain and delay [N]."""
        return nuisance_columns(self.signals.F, self.check.cleaned.record.rate, self.config)

    def nuisance_part(self, residual: Array, counts: Mask) -> Array:
        """Compute the (n,) part of a residual (n,) explained by offset, gain and delay fitted to some samples [N]."""
        A = self.nuisances[counts]
        return np.asarray(self.nuisances @ np.linalg.solve(self._normal(A), A.T @ residual[counts]))

    def products(self, columns: Array, counts: Mask) -> Array:
        """Compute (m, m) inner products of columns (n, m) over some samples, nuisances projected out.

        Equation: Z' (I - A (A' A + s^2 I)^-1 A') Z           Source: Woodbury identity; Gaussian prior of the nuisances
        """
        Z, A = columns[counts], self.nuisances[counts]
        across = A.T @ Z
        return np.asarray(Z.T @ Z - across.T @ np.linalg.solve(self._normal(A), across))

    def _normal(self, A: Array) -> Array:
        return np.asarray(A.T @ A + self.noise * np.eye(A.shape[1]))


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of all tests of a setting against the adopted damper."""

    tests: tuple[RecordResidual, ...]
    validation: CrossValidation

    @cached_property
    def keys(self) -> tuple[ParameterKey, ...]:
        """Parameters whose tangents some test has, in the order of the columns."""
        return tuple(dict.fromkeys(key for test in self.tests for key in test.tangents))

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """Shapes that the tests can show."""
        return shapes_of([test.signals for test in self.tests])

    def tangents(self, test: RecordResidual) -> Array:
        """Return the (n, q) tangents of a test, one column per key."""
        nothing = np.zeros(test.counts.size)
        return np.column_stack([test.tangents.get(key, nothing) for key in self.keys])

    @cached_property
    def regression(self) -> Regression:
        """The tests as inner products, in the folds of the cross-validation."""
        folds = assign_folds([test.check.cleaned for test in self.tests], self.validation.baseline).folds
        parts = []
        for i, test in enumerate(self.tests):
            shapes = [found for shape in self.shapes for _, found in shape.columns(test.signals)]
            columns = np.column_stack([test.check.residual, self.tangents(test), *shapes])
            masks = [(number, fold[i] & test.counts) for number, fold in enumerate(folds) if fold[i].any()]
            parts += [self._part(i, fold, test, columns, counts) for fold, counts in masks if counts.any()]
        return Regression(tuple(parts), len(self.keys), self._candidates())

    def _candidates(self) -> tuple[CandidateShape, ...]:
        found, at = [], 1 + len(self.keys)
        for shape in self.shapes:
            choices = []
            for value, columns in shape.columns(self.tests[0].signals):
                choices.append(Choice(value, tuple(range(at, at + columns.shape[1]))))
                at += columns.shape[1]
            found.append(CandidateShape(shape, tuple(choices)))
        return tuple(found)

    def _part(self, record: int, fold: int, test: RecordResidual, columns: Array, counts: Mask) -> RecordProducts:
        force = test.check.cleaned.record.force[counts]
        _, energy, spread = squared_sums(force, test.check.residual[counts])
        return RecordProducts(
            record=record,
            fold=fold,
            products=test.products(columns, counts),
            energy=energy,
            spread=spread,
            negligible=force.size * (self.validation.visible * test.check.peak) ** 2,
            noise=force.size * test.check.variance,
            weight=1.0 / test.noise,
        )

    def by_voltage(self) -> dict[float | None, list[RecordResidual]]:
        """Group the tests by voltage [V], rising; None for those whose voltage moves, or that have none."""
        found: dict[float | None, list[RecordResidual]] = {}
        nodes = [row.voltage_V for row in self.validation.baseline.base if row.voltage_V is not None]
        for test in self.tests:
            cleaned = test.check.cleaned
            own = cleaned.record.median_voltage() if cleaned.constant else None
            at = None if own is None or not nodes else min(nodes, key=lambda node: abs(node - own))
            found.setdefault(at, []).append(test)
        return dict(sorted(found.items(), key=lambda item: (item[0] is None, item[0] or 0.0)))


def residuals_of(validation: CrossValidation, damper: Damper) -> Residuals:
    """Compute the residuals of all tests against a damper.

    Parameters
    ----------
    validation : cross-validation of the tests, every sample of which may be seen
    damper : adopted damper, about the middle of the stroke
    """
    campaign = validation.campaign
    checks = campaign.checks(damper)
    gap = float(np.mean([max(check.power, 0.0) for check in checks]))
    recorded = [t for check in checks if (t := check.cleaned.record.median_temperature()) is not None]
    temperature = float(np.median(recorded)) if recorded else None
    half_stroke = max(float(np.max(np.abs(check.cleaned.record.displacement))) for check in checks)

    def made(check: ResidualCheck) -> RecordResidual:
        return RecordResidual(
            check,
            signals_of(check.cleaned, check.predicted, temperature, half_stroke),
            tangents(damper, check.cleaned, check.predicted),
            _regression_samples(check),
            campaign.nuisance,
            check.variance + gap,
        )

    return Residuals(campaign.parallel_map(made, checks), validation)


def _regression_samples(check: ResidualCheck) -> Mask:
    """Return the (n,) checked samples away from jumps, evenly thinned."""
    counts = check.wanted & (jump_bend(check.cleaned, check.predicted) == 0.0)
    rows = np.flatnonzero(counts)
    thinned: Mask = np.zeros(counts.size, dtype=np.bool_)
    thinned[rows[:: -(-rows.size // MOST_SAMPLES) or 1]] = True
    return thinned


# --- Tangents: what T0, C, k and the parameters of adopted effects could explain of a residual, to first order


def tangents(damper: Damper, cleaned: CleanedRecord, force: Array) -> dict[ParameterKey, Array]:
    """Compute the (n,) change of the force [N] for a relative change by one of each parameter that a test depends on.

    Parameters
    ----------
    damper : adopted damper, about the middle of the stroke
    cleaned : the test
    force : (n,) that the damper gives in it [N]
    """
    rows: Sequence[int] = [nearest_row(damper.base, cleaned)] if cleaned.constant else range(len(damper.base))
    perturbed = (*_perturbed_base(damper, rows), *_perturbed_effects(damper, rows))
    return {key: (predicted_force(moved, cleaned) - force) / STEP for key, moved in perturbed}


def _perturbed_base(damper: Damper, rows: Sequence[int]) -> Iterator[tuple[ParameterKey, Damper]]:
    """Yield the damper with T0, C or k of one base row perturbed."""
    least = LEAST_FRICTION * max(row.T0_N for row in damper.base)
    for i in rows:
        row = damper.base[i]
        moved = {
            "T0_N": row.T0_N + STEP * max(row.T0_N, least, 1.0),
            "C_Ns_per_m": max(row.C_Ns_per_m * (1.0 + STEP), STEP),
            "k_N_per_m": min(row.k_N_per_m, STIFFEST) * (1.0 + STEP),
        }
        for name, value in moved.items():
            base = [*damper.base]
            base[i] = row.model_copy(update={name: value})
            yield ("base", name, i), damper.model_copy(update={"base": tuple(base)})


def _perturbed_effects(damper: Damper, rows: Sequence[int]) -> Iterator[tuple[ParameterKey, Damper]]:
    """Yield the damper with one parameter of an effect perturbed."""
    for effect, values in damper.effects.items():
        for parameter in known()[effect].parameters:
            value = values[parameter.name]
            place = -1 if isinstance(value, float) else rows[0] if len(rows) == 1 else len(damper.base)
            moved = tuple((1.0 + STEP) * each for each in value) if isinstance(value, tuple) else (1.0 + STEP) * value
            changed = {**damper.effects, effect: {**values, parameter.name: moved}}
            yield (effect, parameter.name, place), damper.model_copy(update={"effects": changed})
