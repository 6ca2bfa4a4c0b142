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
from pzd.damper.material import by_voltage, with_rows
from pzd.damper.model import Damper
from pzd.diagnose.campaign import Campaign
from pzd.diagnose.data.split import TRAINING, Split
from pzd.diagnose.fit.least_squares import MOST_EVALUATIONS, Fitted, fit
from pzd.diagnose.fit.parameters import Problem
from pzd.diagnose.fit.prediction import counted, predicted_force
from pzd.diagnose.fit.weights import record_likelihood, unweighted
from pzd.diagnose.folds import deal
from pzd.diagnose.missed import NOTHING_MISSED, Missed, better, joined, much_worse, worse
from pzd.diagnose.search.evidence import evidence_of
from pzd.record import Mask
from pzd.signals.nuisance import NuisanceConfig, columns_of

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
        fitted = {min(constant, key=lambda v: abs(v - u), default=None) for u, _ in by_voltage(damper.base)}
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
