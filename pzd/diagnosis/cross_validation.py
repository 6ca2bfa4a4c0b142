"""Cross-validation: prediction of whole tests, and of whole voltages, that were held out of the fit.

The tests are assigned to folds; the damper is refitted without each fold and predicts the tests in it. Nothing is
fitted to a held-out test, its own offset, gain and delay included. A test that is alone at its voltage, or alone shows
T0 and C there, is divided into halves, for without it nothing would be known of these; that is weak evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from pzd.artefacts import HeldOutTest, HeldOutVoltage, Prediction
from pzd.damper.model import Damper
from pzd.damper.parameter_rows import rows_per_voltage, with_rows
from pzd.diagnosis import thresholds
from pzd.diagnosis.campaign import Campaign, evidence_of
from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.diagnosis.fit.least_squares import FitResult, refit
from pzd.diagnosis.fit.likelihood import equally_weighted, residuals_of, weighted_record
from pzd.diagnosis.fit.prediction import comparable_samples, predicted_force
from pzd.diagnosis.fit.problem import Problem
from pzd.diagnosis.roles import TRAINING, Split
from pzd.fit.cross_validation import (
    FOLDS,
    PredictionError,
    folds_in_turn,
    held_out_residuals,
    predicts_better,
    predicts_worse,
    squared_sums,
)
from pzd.record import Array, Mask
from pzd.signals.measures import rms
from pzd.signals.nuisance import NO_NUISANCE, NuisanceConfig, nuisance_columns, nuisance_forces

# --- Folds: each test is held out once


PARTS = 2
"""Halves of a lone test: the first predicts the second, and the second the first."""


@dataclass(frozen=True, eq=False)
class Folds:
    """Which tests belong to which voltage, and which samples each fold holds out."""

    groups: tuple[tuple[int, ...], ...]
    """Indices of the records at each voltage, and of those whose voltage moves."""
    voltages: tuple[float | None, ...]
    """Voltage of each group [V], 0 for a damper without a control signal; None where it moves."""
    folds: tuple[tuple[Mask, ...], ...]
    """Held-out samples of each fold, one mask (n,) per record."""
    lone: frozenset[int]
    """Records that are alone at their voltage, or alone slip there: each half is predicted by the other.

    It has the offset, gain and delay of the other, which T0, C and k of that voltage absorb and an effect shared by all
    voltages does not: what these may contribute within their priors says nothing.
    """

    @cached_property
    def no_samples(self) -> tuple[Mask, ...]:
        """Masks (n,), one per record, that hold out no sample."""
        return tuple(np.zeros_like(mask) for mask in self.folds[0])


def assign_folds(cleaned: Sequence[CleanedRecord], baseline: Damper) -> Folds:
    """Assign the tests of each voltage to folds in turn, so that each fold holds out some tests of each voltage.

    Those that slip in turn, and those that do not: T0 and C are known from tests that slip, and some are left beside
    each fold. In the order of their names: whichever way the files are listed, and the tests of another state alike.

    Parameters
    ----------
    cleaned : records of one setting
    baseline : damper whose base rows give the voltages
    """
    nodes = [voltage for voltage, _ in rows_per_voltage(baseline.base)]
    members: dict[int, list[int]] = {}
    for i, p in enumerate(cleaned):
        own = p.record.median_voltage() or 0.0
        members.setdefault(int(np.argmin([abs(v - own) for v in nodes])) if p.constant else -1, []).append(i)
    groups = tuple(tuple(sorted(found, key=lambda i: cleaned[i].record.name)) for found in members.values())
    voltages = tuple(None if node < 0 else nodes[node] for node in members)
    sizes = [p.record.time.size for p in cleaned]
    folds = tuple(tuple(np.zeros(n, dtype=np.bool_) for n in sizes) for _ in range(FOLDS))
    lone = set[int]()
    for turn, (group, voltage) in enumerate(zip(groups, voltages, strict=True)):
        several = len(group) > 1 and voltage is not None
        slipping = [i for i in group if several and _slips(cleaned[i], baseline)] or [*group]
        dealt = [slipping, [i for i in group if i not in slipping]]
        if len(slipping) == 1:
            lone.update(slipping)
            for part, mask in enumerate(_halves(cleaned[slipping[0]])):
                folds[(turn + part) % FOLDS][slipping[0]][:] = mask
            dealt = dealt[1:]
        for tests in dealt:
            for i, fold in zip(tests, folds_in_turn(len(tests), turn), strict=True):
                folds[fold][i][:] = True
    kept = tuple(fold for fold in folds if any(mask.any() for mask in fold))
    return Folds(groups, voltages, kept, frozenset(lone))


def _slips(cleaned: CleanedRecord, damper: Damper) -> bool:
    """Whether a test shows T0 and C: a larger T0 and C change its force. Where nothing slips, k alone makes the force.

    Equation: rms(F((1 + s) T0, (1 + s) C) - F(T0, C)) >= d max abs(F)
    """
    more = 1.0 + thresholds.MORE_RESISTANCE
    scaled = ({"T0_N": more * row.T0_N, "C_Ns_per_m": more * row.C_Ns_per_m} for row in damper.base)
    base = tuple(row.model_copy(update=values) for row, values in zip(damper.base, scaled, strict=True))
    resisting = damper.model_copy(update={"base": base})
    force, stronger = (predicted_force(each, cleaned) for each in (damper, resisting))
    return rms(stronger - force) >= thresholds.RESISTANCE_SHOWN * float(np.max(np.abs(force)))


def _halves(cleaned: CleanedRecord) -> tuple[Mask, Mask]:
    """Return masks (n,) of the first and second half of a record, by whole cycles where it has two or more."""
    time, run = cleaned.record.time, cleaned.cycles
    if run is None or run.count < PARTS:
        first = np.arange(time.size) < time.size // PARTS
    else:
        first = run.number(time) < run.count // PARTS
    return first, ~first


# --- Comparison at left-out voltages


def predicts_much_worse(one: PredictionError, other: PredictionError) -> bool:
    """Whether one damper predicts some tests, as those of a left-out voltage, visibly worse, and by half or more."""
    much = thresholds.MUCH_WORSE * (other.criterion or 0.0)
    return other.visibly_below(one) and (one.criterion or 0.0) > much


# --- Cross-validation of a damper


REFIT_EVALUATIONS = 6
"""Evaluations of a refit without one fold.

Reason: it begins at the optimum of all tests, which a fifth of them moves little."""
FITS_TO_ALL = thresholds.CROSS_VALIDATED_CANDIDATES + 1
"""Fits to every sample that are kept: those of the candidates of a step, which the best is asked for once more, and of
the damper that they are compared with."""
HoldOut = Literal["tests", "cycles", "segments", "mixed"]
_Refit = Callable[[Sequence[Mask]], "Damper | None"]
"""Gives the damper refitted to all but the held-out samples; None where nothing is left."""


@dataclass(frozen=True, eq=False)
class CrossValidation(Folds):
    """The tests of one setting in folds, and the prediction error of any damper on them."""

    campaign: Campaign
    """All of its samples may be fitted."""
    baseline: Damper
    """As identify found it from all tests."""
    visible: float
    """A gap (r.m.s.) below this share of a test's peak force does not count."""
    _problems: dict[tuple[tuple[float | None, float | None], ...], Problem] = field(default_factory=dict, repr=False)
    """Problems of criterion (4) by voltages and temperatures of the base rows: of nothing else in a damper."""
    _fits_to_all: dict[str, tuple[Problem, FitResult]] = field(default_factory=dict, repr=False)
    """The last fits by criterion (4) to every sample, by the damper at which they begin."""

    def baseline_error(self) -> PredictionError:
        """Compute the held-out prediction error of the baseline, refitted by criterion (4) as identify fits it."""
        return self._fold_errors(self._refit_by_criterion(self.baseline))

    def held_out_error(self, damper: Damper) -> PredictionError:
        """Compute the held-out prediction error of a damper, refitted by the likelihood without each fold."""
        return self._fold_errors(self._refit_by_likelihood(damper))

    def error_by_criterion(self, damper: Damper) -> PredictionError:
        """Compute the held-out prediction error of a damper, refitted by criterion (4) without each fold."""
        whole = self.fit_by_criterion(damper, self.no_samples)
        return self._fold_errors(self._refit_by_criterion(whole[1].damper if whole else damper))

    @cached_property
    def baseline_interpolation_error(self) -> PredictionError:
        """Interpolation error of the baseline, refitted by criterion (4)."""
        return self.interpolation_error(self.baseline, by_criterion=True)

    def interpolation_error(self, damper: Damper, *, by_criterion: bool) -> PredictionError:
        """Compute the prediction error at every voltage between two others, refitted without that voltage.

        Parameters
        ----------
        damper : with the effects to be tried
        by_criterion : whether to refit by criterion (4) instead of the likelihood
        """
        refit = self._refit_by_criterion(damper) if by_criterion else self._refit_by_likelihood(damper)
        return PredictionError.concatenated([self._error_without_voltage(i, refit) for i in self.interior_groups()])

    def fit_by_criterion(self, damper: Damper, held_out: Sequence[Mask]) -> tuple[Problem, FitResult] | None:
        """Fit a damper with its effects by criterion (4) to all but the held-out samples.

        Returns
        -------
        the least-squares problem and its solution; None where nothing is left to fit
        """
        if held_out is not self.no_samples:
            return self._fitted_by_criterion(damper, held_out)
        begun, kept = repr(damper), self._fits_to_all
        found = kept.get(begun)
        if found is None:
            found = self._fitted_by_criterion(damper, held_out)
            for old in [*kept][: 1 - FITS_TO_ALL]:
                kept.pop(old, None)  # a thread beside may have dropped it
            if found is not None:
                kept[begun] = found
        return found

    def _fitted_by_criterion(self, damper: Damper, held_out: Sequence[Mask]) -> tuple[Problem, FitResult] | None:
        problem = self._criterion_problem(damper)(held_out)
        return None if problem is None else (problem, refit(problem, damper))

    def error_to_first_order(self, problem: Problem, fitted: FitResult) -> PredictionError:
        """Estimate the held-out prediction error of an optimum by criterion (4) without refits, to compare dampers by.

        The noise of single samples is left out: tests that repeat count as their average cycles. A test that is alone
        at its voltage counts as it was fitted: its halves share its harmonics.

        Equation: see `pzd.fit.cross_validation.held_out_residuals`

        Parameters
        ----------
        problem : of all tests
        fitted : its optimum
        """
        ends = np.cumsum([r.size for r in fitted.residuals])[:-1]
        slopes = np.split(fitted.jacobian.dense(), ends)
        number = {p.record.name: i for i, p in enumerate(self.campaign.cleaned)}
        records = [number[o.name] for o in problem.observations]
        members = ([i for i, record in enumerate(records) if record in tests] for tests in self.held_out_tests())
        left = held_out_residuals(slopes, fitted.residuals, [fold for fold in members if fold], fitted.prior)
        squares = [float(r @ r) for r in left]
        entries = []
        for record, o, force, seen, square in zip(
            records, problem.observations, fitted.simulated, fitted.residuals, squares, strict=True
        ):
            grown = square / max(float(seen @ seen), np.finfo(np.float64).tiny)
            error, energy, spread = squared_sums(o.measured, o.measured - force)
            negligible = o.measured.size * (self.visible * o.peak) ** 2
            count = self.campaign.cleaned[record].record.time.size / o.measured.size
            entries.append(tuple(count * each for each in (grown * error, energy, spread, negligible)))
        return PredictionError.of_entries(records, entries)

    def held_out_tests(self) -> list[frozenset[int]]:
        """Return the records that each fold holds out as a whole."""
        found = [frozenset(i for i, mask in enumerate(fold) if mask.all()) for fold in self.folds]
        return [tests for tests in found if tests]

    def worse_at(self, one: PredictionError, other: PredictionError) -> tuple[float | None, ...]:
        """Return the voltages [V] at which one damper predicts worse; all where only the whole shows it.

        Beyond chance at one of them; over all tests a visible loss is enough, chance or not: what is handed on never
        predicts worse.
        """
        found = self._voltages_where(predicts_worse, one, other)
        return found or (self.voltages if other.visibly_below(one) else ())

    def worse_in_shape_at(self, one: PredictionError, other: PredictionError) -> tuple[float | None, ...]:
        """Return the voltages [V] at which one damper predicts worse, and the shape of the force as well.

        The gain of a test that no fit has seen is nobody's to know: at one per cent it outweighs what a small effect
        closes, and the true damper predicts worse by the chance of it.
        """
        return self.worse_at(one, other) if self.worse_at(one.shapes, other.shapes) else ()

    def better_at(self, one: PredictionError, other: PredictionError) -> tuple[float | None, ...]:
        """Return the voltages [V] at which one damper predicts better; all where only the whole shows it."""
        return self._voltages_where(predicts_better, one, other)

    def much_worse_in(self, one: PredictionError, other: PredictionError) -> bool:
        """Whether one damper predicts any single held-out test visibly worse than another, and by half or more."""
        return any(predicts_much_worse(one.of_records([i]), other.of_records([i])) for i in {*one.records})

    def _voltages_where(
        self, holds: Callable[[PredictionError, PredictionError], bool], one: PredictionError, other: PredictionError
    ) -> tuple[float | None, ...]:
        groups = zip(self.voltages, self.groups, strict=True)
        found = tuple(v for v, group in groups if holds(one.of_records(group), other.of_records(group)))
        return found or (self.voltages if holds(one, other) else ())

    def interpolates_worse_at(self, error: PredictionError) -> tuple[float | None, ...]:
        """Return the voltages [V] between others where the interpolation error is much larger than the baseline's."""
        both = error, self.baseline_interpolation_error
        pairs = {i: [each.of_records(self.groups[i]) for each in both] for i in self.interior_groups()}
        return tuple(self.voltages[i] for i, pair in pairs.items() if predicts_much_worse(*pair))

    def interior_groups(self) -> tuple[int, ...]:
        """Return the groups whose voltage lies between two others."""
        constant = sorted((v, i) for i, v in enumerate(self.voltages) if v is not None)
        return tuple(i for _, i in constant[1:-1])

    def prediction(
        self, baseline: PredictionError, final: PredictionError, interpolation: PredictionError
    ) -> Prediction | None:
        """Return the figures of diagnosis.json; None where no test could be held out.

        Parameters
        ----------
        baseline, final : held-out errors of the baseline and of the adopted damper
        interpolation : interpolation error of the adopted damper
        """
        if baseline.criterion is None or final.criterion is None:
            return None
        tests, controlled = [], any(row.voltage_V is not None for row in self.baseline.base)
        for voltage, i in ((v, i) for v, group in zip(self.voltages, self.groups, strict=True) for i in group):
            before, after = baseline.of_records([i]), final.of_records([i])
            if before.criterion is not None and after.criterion is not None:
                tests.append(
                    HeldOutTest(
                        record=self.campaign.cleaned[i].record.name,
                        voltage=voltage if controlled else None,
                        W_s_plain=before.criterion,
                        W_s=after.criterion,
                        R2_plain=before.determination,
                        R2=after.determination,
                    )
                )
        left_out = [self._left_out(i, interpolation) for i in self.interior_groups()]
        return Prediction(
            hold_out=self._hold_out(),
            by=tuple(sorted(tests, key=lambda each: each.record)),
            W_s_plain=baseline.criterion,
            W_s=final.criterion,
            left_out_voltages=tuple(each for each in left_out if each is not None),
        )

    def _hold_out(self) -> HoldOut:
        """Return what the folds hold out: whole tests, or parts of tests that are alone at their voltage."""
        kinds: set[HoldOut] = {"tests"} if any(i not in self.lone for group in self.groups for i in group) else set()
        for i in self.lone:
            kinds.add("segments" if self.campaign.cleaned[i].cycles is None else "cycles")
        return kinds.pop() if len(kinds) == 1 else "mixed"

    def _left_out(self, group: int, interpolation: PredictionError) -> HeldOutVoltage | None:
        voltage, both = self.voltages[group], (self.baseline_interpolation_error, interpolation)
        before, after = (each.of_records(self.groups[group]).criterion for each in both)
        if voltage is None or before is None or after is None:
            return None
        return HeldOutVoltage(voltage=voltage, W_s_plain=before, W_s=after)

    def _error_without_voltage(self, group: int, refit: _Refit) -> PredictionError:
        """Compute the error at one voltage, refitted without it and without the tests whose voltage moves."""
        mine = self.groups[group]
        moving = {i for v, members in zip(self.voltages, self.groups, strict=True) if v is None for i in members}
        sizes = [p.record.time.size for p in self.campaign.cleaned]
        damper = refit(tuple(np.full(n, i in mine or i in moving) for i, n in enumerate(sizes)))
        return self._error_of_fold(damper, tuple(np.full(n, i in mine) for i, n in enumerate(sizes)))

    def _fold_errors(self, refit: _Refit) -> PredictionError:
        def of_fold(held_out: Sequence[Mask]) -> PredictionError:
            damper = refit(held_out)
            return self._error_of_fold(damper, () if damper is None else self._predictable(damper, held_out))

        return PredictionError.concatenated(self.campaign.parallel_map(of_fold, self.folds))

    def _predictable(self, damper: Damper, held_out: Sequence[Mask]) -> list[Mask]:
        """Return the held-out samples at those voltages for which some test was left to fit."""
        constant = [voltage for voltage in self.voltages if voltage is not None]
        # By the nearest: rows of several temperatures have nearly, not exactly, the voltage of their group.
        fitted = {min(constant, key=lambda v: abs(v - u), default=None) for u, _ in rows_per_voltage(damper.base)}
        lost = {
            i for v, group in zip(self.voltages, self.groups, strict=True) if v not in {*fitted, None} for i in group
        }
        return [np.zeros_like(mask) if i in lost else mask for i, mask in enumerate(held_out)]

    def _error_of_fold(self, damper: Damper | None, held_out: Sequence[Mask]) -> PredictionError:
        """Compute the error of a refitted damper on the held-out samples; empty where there is no damper."""
        records, entries = list[int](), list[tuple[float, ...]]()
        if damper is None:
            return PredictionError.of_entries(records, entries)
        for i, (p, mask) in enumerate(zip(self.campaign.cleaned, held_out, strict=True)):
            kept = mask & comparable_samples(p)
            if not kept.any():
                continue
            force = p.record.force[kept]
            residual = force - predicted_force(damper, p)[kept]
            negligible = residual.size * (self.visible * float(np.max(np.abs(p.record.force)))) ** 2
            if i in self.lone:
                negligible += float(np.sum(nuisance_columns(force, p.record.rate, self.campaign.nuisance, kept) ** 2))
            records.append(i)
            entries.append((*squared_sums(force, residual), negligible, self._beyond_own(p, residual, kept)))
        return PredictionError.of_entries(records, entries)

    def _beyond_own(self, p: CleanedRecord, residual: Array, kept: Mask) -> float:
        """Compute the squares of a residual beyond what offset, gain and delay of its test explain [N^2]."""
        rest = float(residual @ residual)
        if not np.isfinite(rest) or rest == 0.0:
            return rest
        everywhere, no_timing = np.ones(residual.size, dtype=np.bool_), np.zeros((residual.size, 0))
        variance, predicted = rest / residual.size, p.record.force[kept] - residual
        size, timing = nuisance_forces(
            residual, predicted, p.record.rate, variance, self.campaign.nuisance, no_timing, everywhere, kept
        )
        beyond = residual - size - timing
        return float(beyond @ beyond)

    def _refit_by_likelihood(self, damper: Damper) -> _Refit:
        evidence, plain = evidence_of(self.campaign, damper), self._refit_by_criterion(self.baseline)

        def without(held_out: Sequence[Mask]) -> Damper | None:
            reduced = _reduced_problem(self.campaign, evidence.whole, damper, held_out, evidence.nuisance)
            found = _refitted(reduced, damper)
            if reduced is None or found is None:
                return found
            fewer = damper.without_effects(*_not_shown(reduced, found))
            if len(fewer.effects) < len(damper.effects) and not {*fewer.effects} - {*reduced.law}:
                return plain(held_out)  # what identify would hand on: no other weights may make it better or worse
            return found if len(fewer.effects) == len(damper.effects) else _refitted(reduced, fewer)

        return without

    def _refit_by_criterion(self, damper: Damper) -> _Refit:
        problem = self._criterion_problem(damper)
        return lambda held_out: _refitted(problem(held_out), damper)

    def _criterion_problem(self, damper: Damper) -> Callable[[Sequence[Mask]], Problem | None]:
        """Return the problem of criterion (4) as a function of the held-out samples."""
        campaign = replace(self.campaign, nuisance=NO_NUISANCE)
        labels = tuple((row.voltage_V, row.temperature_degC) for row in damper.base)
        if labels not in self._problems:
            self._problems[labels] = evidence_of(campaign, damper).whole
        problem = self._problems[labels].started_at(damper)
        peaks = dict.fromkeys((o.base_row for o in problem.observations), 0.0)
        for o in problem.observations:
            peaks[o.base_row] = max(peaks[o.base_row], o.peak)

        def without(held_out: Sequence[Mask]) -> Problem | None:
            found = _reduced_problem(campaign, problem, damper, held_out, NO_NUISANCE)
            if found is None:
                return None
            pairs = zip(campaign.cleaned, held_out, strict=True)
            fitted = {p.record.name: int(np.count_nonzero(~mask & comparable_samples(p))) for p, mask in pairs}
            weighted = (equally_weighted(o, fitted[o.name], peaks[o.base_row]) for o in found.observations)
            return replace(found, observations=tuple(weighted))

        return without


def _reduced_problem(
    campaign: Campaign, problem: Problem, damper: Damper, held_out: Sequence[Mask], nuisance: NuisanceConfig
) -> Problem | None:
    """Return the problem without the held-out samples; None where nothing is left."""
    known = {o.name: o for o in problem.observations}
    kept = []
    for i, (p, mask) in enumerate(zip(campaign.cleaned, held_out, strict=True)):
        part = known.get(p.record.name)
        if part is None or mask.all():
            continue
        if mask.any():
            (given,) = campaign.predictions(damper, [i])
            part = weighted_record(p, ~mask, part.base_row, given, nuisance)
        if part is not None:
            kept.append(part)
    return replace(problem, observations=tuple(kept)) if kept else None


def _refitted(problem: Problem | None, damper: Damper) -> Damper | None:
    """Refit a damper, without the base rows for which no test is left."""
    if problem is None:
        return None
    found, rows = refit(problem, damper, REFIT_EVALUATIONS).damper, {o.base_row for o in problem.observations}
    return found if -1 in rows else with_rows(found, [found.base[i] for i in sorted(rows)])


def _not_shown(problem: Problem, damper: Damper) -> list[str]:
    """List the effects of a damper whose removal raises its misfit by less than the BIC penalty: no test shows them.

    The stop at the end of the longest test is one, where that is held out: refitted, it stands just beyond the others,
    and is as hard as the last of their noise likes.

    Equation: |r|^2 without it - |r|^2 < p ln n, p its parameters       Source: Schwarz 1978, Ann. Stat. 6, 461-464
    """
    whole = np.concatenate(residuals_of(problem.observations, damper))

    def shown(name: str) -> bool:
        without = np.concatenate(residuals_of(problem.observations, damper.without_effects(name)))
        penalty = np.log(whole.size)
        more = len(problem.unknowns((name,))) - len(problem.unknowns(()))
        return bool(without @ without - whole @ whole >= more * penalty)

    return [name for name in damper.effects if name not in problem.law and not shown(name)]


def cross_validation_of(campaign: Campaign, baseline: Damper, visible: float) -> CrossValidation:
    """Set up the cross-validation of a campaign, in which every sample may be fitted.

    Parameters
    ----------
    campaign : records of one setting
    baseline : damper as identify found it
    visible : a gap (r.m.s.) below this share of a test's peak force does not count
    """
    cleaned = campaign.cleaned
    everything = Split(tuple(np.full(p.record.time.size, TRAINING) for p in cleaned), (), "records")
    whole = Campaign(cleaned, everything, campaign.nuisance, campaign.jobs, campaign.budget, campaign.law)
    folds = assign_folds(cleaned, baseline)
    return CrossValidation(folds.groups, folds.voltages, folds.folds, folds.lone, whole, baseline, visible)
