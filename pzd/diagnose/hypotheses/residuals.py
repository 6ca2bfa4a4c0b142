"""The residual of every test, with what T0, C, k, effects and the test's own nuisances could take up of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pzd.damper.model import Damper
from pzd.diagnose.folds import deal
from pzd.diagnose.hypotheses.regression import CandidateShape, Choice, ProductsOfTest, Regression
from pzd.diagnose.hypotheses.shapes import Shape, shapes_of
from pzd.diagnose.hypotheses.signals import Signals, signals_of
from pzd.diagnose.hypotheses.tangents import Key, tangents
from pzd.diagnose.kept_back import Trials
from pzd.diagnose.residual_check import ResidualCheck, bend_beside_jumps
from pzd.record import Array, Mask
from pzd.signals.nuisance import NuisanceConfig, columns_of

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
        return columns_of(self.signals.F, self.check.prepared.record.rate, self.config)

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
