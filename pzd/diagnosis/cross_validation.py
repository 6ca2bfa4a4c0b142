"""What a damper predicts of whole tests, and of whole voltages, that were kept back from its fit.

Cross-validation: the tests are dealt into folds, the damper is fitted anew without each fold and predicts the tests in
it; nothing is fitted to a kept-back test, its own offset, gain and delay included. A test that is alone at its voltage
is parted, for without it nothing would be known there; that is weak evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from pzd.artefacts import KeptBack, LeftOut, Prediction
from pzd.damper.model import Damper
from pzd.damper.parameter_rows import rows_per_voltage, with_rows
from pzd.diagnosis.campaign import Campaign
from pzd.diagnosis.data import TRAINING, Prepared, Split
from pzd.diagnosis.fit.least_squares import MOST_EVALUATIONS, Fitted, fit
from pzd.diagnosis.fit.likelihood import record_likelihood, unweighted
from pzd.diagnosis.fit.parameters import Problem
from pzd.diagnosis.fit.prediction import counted, predicted_force
from pzd.diagnosis.search.evidence import evidence_of
from pzd.diagnosis.thresholds import PREDICTS_WORSE, WORSE_BETWEEN
from pzd.record import Array, Mask
from pzd.signals.nuisance import NuisanceConfig, columns_of

# ----------------------------------------------------------------------------------------------------
# The tests of one setting dealt into folds, each of which is kept back once.


FOLDS = 5
"""Each fold keeps back about a fifth of the tests: enough is left to fit, and the refits stay few."""
PARTS = 2
"""Halves of a test that is alone at its voltage: the first predicts the second, and the second the first."""


@dataclass(frozen=True, eq=False)
class Folds:
    """Which tests stand at which voltage, and which samples each fold keeps back."""

    groups: tuple[tuple[int, ...], ...]
    """The records of each voltage, and those whose voltage moves."""
    voltages: tuple[float | None, ...]
    """Of the groups [V], 0 for a damper without; None where it moves."""
    folds: tuple[tuple[Mask, ...], ...]
    """For every fold one mask (n,) a record: the samples that are kept back."""


def deal(prepared: Sequence[Prepared], plain: Damper) -> Folds:
    """Every voltage dealt by itself, so that each fold takes a bit of each; a test alone at its voltage in halves.

    Parameters
    ----------
    prepared : the records of one setting
    plain : the damper, whose base rows say which voltages there are
    """
    nodes = [voltage for voltage, _ in rows_per_voltage(plain.base)]
    members: dict[int, list[int]] = {}
    for i, p in enumerate(prepared):
        own = p.record.median_voltage() or 0.0
        members.setdefault(int(np.argmin([abs(v - own) for v in nodes])) if p.constant else -1, []).append(i)
    groups = tuple(tuple(sorted(found, key=lambda i: prepared[i].record.name)) for found in members.values())
    voltages = tuple(None if node < 0 else nodes[node] for node in members)
    folds = tuple(tuple(np.zeros(p.record.time.size, dtype=np.bool_) for p in prepared) for _ in range(FOLDS))
    for turn, group in enumerate(groups):
        for place, i in enumerate(group):
            if len(group) > 1:
                folds[(turn + place) % min(FOLDS, max(len(group), PARTS))][i][:] = True
            else:
                for part, mask in enumerate(_halves(prepared[i])):
                    folds[(turn + part) % FOLDS][i][:] = mask
    return Folds(groups, voltages, tuple(fold for fold in folds if any(mask.any() for mask in fold)))


def _halves(prepared: Prepared) -> tuple[Mask, Mask]:
    """(n,) the first and the second half of a record, by whole cycles where it has two or more."""
    time, run = prepared.record.time, prepared.cycles
    if run is None or run.count < PARTS:
        first = np.arange(time.size) < time.size // PARTS
    else:
        first = run.number(time) < run.count // PARTS
    return first, ~first


# ----------------------------------------------------------------------------------------------------
# What a damper misses of kept-back tests, and whether another one misses less beyond chance.


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


# ----------------------------------------------------------------------------------------------------


EVALUATIONS = 6
"""Of a refit without one fold: it begins at the optimum of all tests, and a fifth of them moves that little."""
HoldOut = Literal["tests", "cycles", "segments", "mixed"]
_Refit = Callable[[Sequence[Mask]], "Damper | None"]
"""The damper fitted to all but what is kept back; None where nothing is left."""


@dataclass(frozen=True, eq=False)
class Trials:
    """The tests of one setting, dealt into folds."""

    campaign: Campaign
    """Every sample of it may be fitted."""
    plain: Damper
    """As identify found it, with all the tests."""
    visible: float
    """A gap (r.m.s.) below this share of a test's peak force counts as nothing."""
    groups: tuple[tuple[int, ...], ...]
    """The records of each voltage, and those whose voltage moves."""
    voltages: tuple[float | None, ...]
    """Of the groups [V], 0 for a damper without; None where it moves."""
    folds: tuple[tuple[Mask, ...], ...]

    @property
    def nothing(self) -> tuple[Mask, ...]:
        """(n,) a record: no sample is kept back."""
        return tuple(np.zeros(p.record.time.size, dtype=np.bool_) for p in self.campaign.prepared)

    def plain_missed(self) -> Missed:
        """What the plain damper misses, fitted without each fold by criterion (4), as identify fits it."""
        return self._missed(self._by_criterion(self.plain))

    def missed(self, damper: Damper) -> Missed:
        """What a damper misses, T0, C, k and its effects fitted without each fold, from where they are."""
        return self._missed(self._by_likelihood(damper))

    def missed_by_criterion(self, damper: Damper) -> Missed:
        """What a damper misses, all of it fitted without each fold by criterion (4), as identify fits the plain one."""
        whole = self.fitted_by_criterion(damper, self.nothing)
        return self._missed(self._by_criterion(whole[1].damper if whole else damper))

    @cached_property
    def plain_missed_between(self) -> Missed:
        """What the plain damper misses of every voltage between two others, fitted by criterion (4) without it."""
        return self.missed_between(self.plain, by_criterion=True)

    def missed_between(self, damper: Damper, *, by_criterion: bool) -> Missed:
        """What a damper misses of every voltage between two others, fitted without that voltage.

        Parameters
        ----------
        damper : the one handed on, or tried
        by_criterion : whether it is fitted by criterion (4), else by the likelihood
        """
        refit = self._by_criterion(damper) if by_criterion else self._by_likelihood(damper)
        return joined([self._without_voltage(i, refit) for i in self.between()])

    def fitted_by_criterion(self, damper: Damper, kept_back: Sequence[Mask]) -> tuple[Problem, Fitted] | None:
        """A damper, its effects too, fitted by criterion (4) to all but what is kept back, and to what it is fitted.

        None where nothing is left.
        """
        problem = self._unweighted(damper)(kept_back)
        return None if problem is None else (problem, _fit(problem, damper))

    def worse(self, one: Missed, other: Missed) -> tuple[float | None, ...]:
        """The voltages [V] at which one damper predicts worse than another; all where only the whole shows it."""
        return self._where(worse, one, other)

    def better(self, one: Missed, other: Missed) -> tuple[float | None, ...]:
        """The voltages [V] at which one damper predicts better than another; all where only the whole shows it."""
        return self._where(better, one, other)

    def _where(self, holds: Callable[[Missed, Missed], bool], one: Missed, other: Missed) -> tuple[float | None, ...]:
        groups = zip(self.voltages, self.groups, strict=True)
        found = tuple(v for v, group in groups if holds(one.of(group), other.of(group)))
        return found or (self.voltages if holds(one, other) else ())

    def worse_between(self, between: Missed) -> tuple[float | None, ...]:
        """The voltages [V] between others at which a damper misses visibly and much more than the plain one does."""
        pairs = {i: (each.of(self.groups[i]) for each in (between, self.plain_missed_between)) for i in self.between()}
        return tuple(self.voltages[i] for i, pair in pairs.items() if much_worse(*pair))

    def between(self) -> tuple[int, ...]:
        """The groups whose voltage lies between two others."""
        constant = sorted((v, i) for i, v in enumerate(self.voltages) if v is not None)
        return tuple(i for _, i in constant[1:-1])

    def prediction(self, plain: Missed, missed: Missed, between: Missed) -> Prediction | None:
        """The figures of diagnosis.json; None where no test could be kept back.

        Parameters
        ----------
        plain, missed : what the plain damper and the one handed on miss of kept-back tests
        between : what the one handed on misses of the voltages between others
        """
        whole = plain.criterion, missed.criterion
        if whole[0] is None or whole[1] is None:
            return None
        by, controlled = [], any(row.voltage_V is not None for row in self.plain.base)
        for voltage, group in zip(self.voltages, self.groups, strict=True):
            for i in group:
                simple, handed = plain.of([i]).criterion, missed.of([i]).criterion
                if simple is not None and handed is not None:
                    name, at = self.campaign.prepared[i].record.name, voltage if controlled else None
                    R2 = {"R2_plain": plain.of([i]).determination, "R2": missed.of([i]).determination}
                    by.append(KeptBack(record=name, voltage=at, W_s_plain=simple, W_s=handed, **R2))
        left_out = [self._left_out(i, between) for i in self.between()]
        return Prediction(
            hold_out=self._hold_out(),
            by=tuple(sorted(by, key=lambda each: each.record)),
            W_s_plain=whole[0],
            W_s=whole[1],
            left_out_voltages=tuple(each for each in left_out if each is not None),
        )

    def _hold_out(self) -> HoldOut:
        kinds = {self._kind(group) for group in self.groups}
        return kinds.pop() if len(kinds) == 1 else "mixed"

    def _kind(self, group: Sequence[int]) -> HoldOut:
        if len(group) > 1:
            return "tests"
        return "segments" if self.campaign.prepared[group[0]].cycles is None else "cycles"

    def _left_out(self, group: int, between: Missed) -> LeftOut | None:
        """One voltage predicted from those around it."""
        voltage = self.voltages[group]
        plain, other = (each.of(self.groups[group]).criterion for each in (self.plain_missed_between, between))
        if voltage is None or plain is None or other is None:
            return None
        return LeftOut(voltage=voltage, W_s_plain=plain, W_s=other)

    def _without_voltage(self, group: int, fitted: _Refit) -> Missed:
        """What is missed of one voltage, with neither it nor any test fitted of which the voltage moves."""
        mine = self.groups[group]
        moving = {i for v, members in zip(self.voltages, self.groups, strict=True) if v is None for i in members}
        sizes = [p.record.time.size for p in self.campaign.prepared]
        found = fitted(tuple(np.full(n, i in mine or i in moving) for i, n in enumerate(sizes)))
        asked = tuple(np.full(n, i in mine) for i, n in enumerate(sizes))
        return NOTHING_MISSED if found is None else self._of_fold(found, asked)

    def _missed(self, fitted: _Refit) -> Missed:
        def of_fold(kept_back: Sequence[Mask]) -> Missed:
            found = fitted(kept_back)
            return NOTHING_MISSED if found is None else self._of_fold(found, self._known(found, kept_back))

        return joined(self.campaign.each(of_fold, self.folds))

    def _known(self, damper: Damper, kept_back: Sequence[Mask]) -> list[Mask]:
        """What is kept back of the voltages for which some test was left to fit."""
        constant = [voltage for voltage in self.voltages if voltage is not None]
        # By the nearest: a voltage is that of one of its rows, and rows of other temperatures have it not quite.
        fitted = {min(constant, key=lambda v: abs(v - u), default=None) for u, _ in rows_per_voltage(damper.base)}
        lost = {
            i for v, group in zip(self.voltages, self.groups, strict=True) if v not in {*fitted, None} for i in group
        }
        return [np.zeros_like(mask) if i in lost else mask for i, mask in enumerate(kept_back)]

    @property
    def _alone(self) -> frozenset[int]:
        """The tests that are alone at their voltage.

        Either half has the offset, gain and delay of the other, which T0, C and k of that voltage take up and an
        effect that all voltages share does not: what these may come to by their priors says nothing.
        """
        return frozenset(group[0] for group in self.groups if len(group) == 1)

    def _of_fold(self, damper: Damper, kept_back: Sequence[Mask]) -> Missed:
        records, rows = [], []
        for i, (p, mask) in enumerate(zip(self.campaign.prepared, kept_back, strict=True)):
            kept = mask & counted(p)
            if not kept.any():
                continue
            force = p.record.force[kept]
            residual = force - predicted_force(damper, p)[kept]
            peak = float(np.max(np.abs(p.record.force)))
            limit = residual.size * (self.visible * peak) ** 2
            if i in self._alone:
                limit += float(np.sum(columns_of(force, p.record.rate, self.campaign.nuisance, kept) ** 2))
            records.append(i)
            about_mean = force - force.mean()
            rows.append((residual @ residual, force @ force, about_mean @ about_mean, limit))
        columns = np.array(rows, dtype=np.float64).reshape(-1, 4).T
        return Missed(tuple(records), *columns)

    def _by_likelihood(self, damper: Damper) -> _Refit:
        problem = evidence_of(self.campaign, damper).whole
        return lambda kept_back: _refitted(self._without(self.campaign, problem, damper, kept_back), damper)

    def _by_criterion(self, damper: Damper) -> _Refit:
        problem = self._unweighted(damper)
        return lambda kept_back: _refitted(problem(kept_back), damper)

    def _unweighted(self, damper: Damper) -> Callable[[Sequence[Mask]], Problem | None]:
        """What is fitted by criterion (4), by what is kept back."""
        campaign = replace(self.campaign, nuisance=NuisanceConfig(offset=0.0, delay_s=0.0, gain=0.0))
        problem = evidence_of(campaign, damper).whole
        peaks = dict.fromkeys((o.place for o in problem.observations), 0.0)
        for o in problem.observations:
            peaks[o.place] = max(peaks[o.place], o.peak)

        def without(kept_back: Sequence[Mask]) -> Problem | None:
            found = self._without(campaign, problem, damper, kept_back)
            if found is None:
                return None
            named = {p.record.name: ~mask & counted(p) for p, mask in zip(campaign.prepared, kept_back, strict=True)}
            counts = (int(np.count_nonzero(named[o.name])) for o in found.observations)
            alike = (unweighted(o, n, peaks[o.place]) for o, n in zip(found.observations, counts, strict=True))
            return replace(found, observations=tuple(alike))

        return without

    def _without(
        self, campaign: Campaign, problem: Problem, damper: Damper, kept_back: Sequence[Mask]
    ) -> Problem | None:
        """The problem without what is kept back; None where nothing is left."""
        known = {o.name: o for o in problem.observations}
        kept = []
        for i, (p, mask) in enumerate(zip(campaign.prepared, kept_back, strict=True)):
            part = known.get(p.record.name)
            if part is None or mask.all():
                continue
            if mask.any():
                (given,) = campaign.expected(damper, [i])
                part = record_likelihood(p, ~mask, part.place, given, campaign.nuisance)
            if part is not None:
                kept.append(part)
        return replace(problem, observations=tuple(kept)) if kept else None


def _fit(problem: Problem, damper: Damper, evaluations: int = MOST_EVALUATIONS) -> Fitted:
    """A damper fitted anew from where it is."""
    return fit(problem, tuple(damper.effects), problem.start_with(damper), evaluations)


def _refitted(problem: Problem | None, damper: Damper) -> Damper | None:
    """A damper fitted anew, without the base rows that no test is left for."""
    if problem is None:
        return None
    found, places = _fit(problem, damper, EVALUATIONS).damper, {o.place for o in problem.observations}
    return found if -1 in places else with_rows(found, [found.base[i] for i in sorted(places)])


def trials_of(campaign: Campaign, plain: Damper, visible: float) -> Trials:
    """The tests of a campaign dealt into folds: every voltage by itself, so that each fold takes a bit of each.

    Parameters
    ----------
    campaign : the records of one setting
    plain : as identify found it
    visible : a gap (r.m.s.) below this share of a test's peak force counts as nothing
    """
    prepared = campaign.prepared
    everything = Split(tuple(np.full(p.record.time.size, TRAINING) for p in prepared), (), "records")
    whole = Campaign(prepared, everything, campaign.nuisance, campaign.jobs, campaign.work)
    dealt = deal(prepared, plain)
    return Trials(whole, plain, visible, dealt.groups, dealt.voltages, dealt.folds)
