"""A test campaign: the records of one setting, the comparison of a damper with them, and the evidence for fits.

Each damper is simulated once; predictions and residual checks are cached by its parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from pzd.damper.effect import NODE_VOLTAGES, Scales
from pzd.damper.model import BaseRow, Damper
from pzd.damper.parameter_rows import nearest_condition
from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit.least_squares import FitResult
from pzd.diagnosis.fit.likelihood import WeightedRecord, shown_force, weighed_by_noise, with_nuisances
from pzd.diagnosis.fit.prediction import PredictedForce, predict
from pzd.diagnosis.fit.problem import UNSEEN, Budget, Problem, law_of
from pzd.diagnosis.fit.sensitivities import linearise
from pzd.diagnosis.gap import ResidualCheck, check_residual, probability_of_noise, visible_gap
from pzd.diagnosis.roles import HELD_OUT, TRAINING, VALIDATION, Split
from pzd.fit.spread import estimated_spread, nuisance_equations
from pzd.record import Array, Mask, voltage_scale
from pzd.signals.measures import criterion, criterion_error
from pzd.signals.nuisance import NO_NUISANCE, NuisanceConfig

Item = TypeVar("Item")
Made = TypeVar("Made")


@dataclass(frozen=True, eq=False)
class Campaign:
    """The records of one setting, and the roles of their samples."""

    cleaned: tuple[CleanedRecord, ...]
    split: Split
    nuisance: NuisanceConfig
    jobs: int = 1
    """Records that are simulated at the same time."""
    budget: Budget = field(default_factory=Budget, repr=False)
    """Counts the simulations of fits, and limits them."""
    law: tuple[str, ...] = ()
    """What of a damper belongs to the law of its element beside T0 + C w, see `Problem.law`."""
    _predictions: dict[tuple[str, int], PredictedForce] = field(default_factory=dict, repr=False)
    _checks: dict[str, tuple[ResidualCheck, ...]] = field(default_factory=dict, repr=False)

    @property
    def seen(self) -> tuple[Mask, ...]:
        """(n,) samples of each record that the search may see: all but the held-out ones."""
        return tuple(roles != HELD_OUT for roles in self.split.roles)

    def in_role(self, role: int) -> tuple[Mask, ...]:
        """Return the (n,) samples of each record in one role of the split."""
        return tuple(roles == role for roles in self.split.roles)

    def predictions(self, damper: Damper, numbers: Sequence[int]) -> tuple[PredictedForce, ...]:
        """Predict the force of some of the records."""
        key = damper.model_dump_json()
        new = [i for i in numbers if (key, i) not in self._predictions]
        made = self.parallel_map(lambda i: predict(damper, self.cleaned[i], self.nuisance.delay_s), new)
        self._predictions.update(zip(((key, i) for i in new), made, strict=True))
        return tuple(self._predictions[key, i] for i in numbers)

    def checks(self, damper: Damper) -> tuple[ResidualCheck, ...]:
        """Compare every record with a damper, over the samples seen."""
        key = damper.model_dump_json()
        if key not in self._checks:
            self._checks[key] = self._against(damper, self.seen)
        return self._checks[key]

    def held_out_checks(self, damper: Damper) -> tuple[ResidualCheck, ...]:
        """Compare every record with a damper, over the held-out samples."""
        return self._against(damper, self.in_role(HELD_OUT))

    def with_offset(self, offset: float) -> Campaign:
        """Return the campaign with another standard deviation of the offset of a test, as a share of its peak."""
        return replace(self, nuisance=self.nuisance.model_copy(update={"offset": offset}), _checks={})

    def offset(self, damper: Damper) -> float:
        """Compute the median over the records of the mean residual [N], an offset that no effect has to explain."""
        seen = records_in_use(self.seen)
        predicted = zip(seen, self.predictions(damper, seen), strict=True)
        return float(np.median([np.mean(self.cleaned[i].record.force - each.force) for i, each in predicted]))

    def _against(self, damper: Damper, masks: Sequence[Mask]) -> tuple[ResidualCheck, ...]:
        used = records_in_use(masks)
        predicted = [(e, self.cleaned[i], masks[i]) for i, e in zip(used, self.predictions(damper, used), strict=True)]
        return self.parallel_map(lambda each: check_residual(*each, self.nuisance), predicted)

    def parallel_map(self, function: Callable[[Item], Made], items: Iterable[Item]) -> tuple[Made, ...]:
        """Apply a function to every item, `jobs` of them at the same time."""
        if self.jobs <= 1:
            return tuple(map(function, items))
        with ThreadPoolExecutor(self.jobs) as pool:
            return tuple(pool.map(function, items))


def records_in_use(masks: Sequence[Mask]) -> list[int]:
    """Return the records of which a mask (n,) keeps any sample."""
    return [i for i, mask in enumerate(masks) if mask.any()]


# --- Evidence: the records as least-squares problems


@dataclass(frozen=True, eq=False)
class Evidence:
    """The tests of one setting as least-squares problems: all samples seen, and either half of them."""

    campaign: Campaign
    whole: Problem
    """All samples seen."""
    halves: tuple[Problem, Problem]
    """Training samples, and those that choose."""
    nuisance: NuisanceConfig
    """Standard deviations of what differs from test to test, as these tests show them within their prior."""

    def gap(self, fitted: FitResult) -> float:
        """Compute the gap that a fit leaves over all samples seen, as a share of peak."""
        return visible_gap(self.campaign.checks(fitted.damper))

    def gap_is_significant(self, fitted: FitResult, config: DiagnoseConfig) -> bool:
        """Whether the gap that a fit leaves is beyond noise and not negligible."""
        likely = probability_of_noise(self.campaign.checks(fitted.damper))
        return likely < config.significance and self.gap(fitted) >= config.negligible

    def criterion(self, damper: Damper) -> tuple[float, float | None]:
        """Compute W_s of a damper over the compared samples of all that is seen, whatever it was fitted to.

        Its standard error is that of the scatter between tests; None with fewer than two.
        """
        observed = self.whole.observations
        residuals = self.campaign.parallel_map(lambda o: o.measured - o.at_compared(shown_force(o, damper)), observed)
        left = criterion(np.concatenate(residuals), np.concatenate([o.measured for o in observed]))
        if len(observed) < 2:
            return left, None
        squares = np.array([residual @ residual for residual in residuals])
        return left, criterion_error(squares, np.array([o.measured @ o.measured for o in observed]))

    def halves_weighed_by(self, weights: Evidence) -> tuple[Problem, Problem]:
        """Return the problems of either half, with these base rows and the weights of other evidence."""

        def weighed(mine: Problem, other: Problem) -> Problem:
            pairs = zip(other.observations, mine.observations, strict=True)
            return replace(mine, observations=tuple(replace(o, base_row=own.base_row) for o, own in pairs))

        training, validation = map(weighed, self.halves, weights.halves)
        return training, validation


def evidence_of(campaign: Campaign, damper: Damper) -> Evidence:
    """Weigh the records of one setting by what a damper leaves of them.

    Parameters
    ----------
    campaign : the records, and the roles of their samples
    damper : starting values of the fits; gain and delay of a test act along its force
    """
    cleaned = campaign.cleaned
    base_rows = [nearest_row(damper.base, p) if p.constant else -1 for p in cleaned]
    seen = records_in_use(campaign.seen)
    predicted = dict(zip(seen, campaign.predictions(damper, seen), strict=True))
    weighed = {i: weighed_by_noise(cleaned[i], campaign.seen[i], base_rows[i], predicted[i]) for i in seen}
    by_noise = [found for found in weighed.values() if found is not None]
    reference = damper.reference_temperature_degC
    if reference is None:
        recorded = [t for t in (p.record.median_temperature() for p in cleaned) if t is not None]
        reference = float(np.median(recorded)) if recorded else None
    problem = Problem(
        tuple(by_noise),
        damper.base,
        scales_of([o.peak for o in by_noise], cleaned, damper),
        reference,
        frozenset(name for name, values in damper.effects.items() if NODE_VOLTAGES in values),
        campaign.budget,
        law=law_of(damper, campaign.law),
    )
    nuisance = _shown_by_tests(problem, damper, campaign.nuisance)
    made: dict[tuple[int, bytes], WeightedRecord | None] = {}

    def observed(kept: Sequence[Mask]) -> tuple[WeightedRecord, ...]:
        """Integrate out what is each test's own; a record that lies in one half is the same in the whole."""
        keys = [(i, kept[i].tobytes()) for i in records_in_use(kept)]
        for i, key in keys:
            if (i, key) not in made:
                whole = np.array_equal(kept[i], campaign.seen[i])
                bare = weighed[i] if whole else weighed_by_noise(cleaned[i], kept[i], base_rows[i], predicted[i])
                made[i, key] = None if bare is None else with_nuisances(bare, damper, nuisance)
        return tuple(found for key in keys if (found := made[key]) is not None)

    whole, *halves = (observed(kept) for kept in (campaign.seen, *map(campaign.in_role, (TRAINING, VALIDATION))))
    training, validation = (replace(problem, observations=half) for half in halves)
    return Evidence(campaign, replace(problem, observations=whole), (training, validation), nuisance)


def _shown_by_tests(problem: Problem, damper: Damper, prior: NuisanceConfig) -> NuisanceConfig:
    """Estimate within their prior the standard deviations of what differs from test to test.

    Parameters
    ----------
    problem : the tests, weighed by noise alone
    damper : what it leaves of them shows how they differ, T0, C, k and its effects free
    prior : the standard deviations beforehand, which are the largest
    """
    if not problem.observations or prior == NO_NUISANCE:
        return prior
    tests = tuple(with_nuisances(o, damper, NO_NUISANCE) for o in problem.observations)
    unknowns, start = problem.unknowns(tuple(damper.effects)), problem.start_with(damper)
    anywhere = np.full(start.size, -np.inf), np.full(start.size, np.inf)
    found = linearise(replace(problem, observations=tests), unknowns, start, anywhere)
    own = [o.own_of_test(force, prior) for o, force in zip(tests, found.simulated, strict=True)]
    slopes = np.split(found.jacobian.dense(), np.cumsum([r.size for r in found.residuals])[:-1])
    # A power law whose flow stands still at a sample has no slope there.
    finite = np.all([np.all(np.isfinite(each), axis=0) for each in slopes], axis=0)
    shared = [each[:, finite] for each in slopes]
    offset, gain, delay = estimated_spread([nuisance_equations(own, shared, found.residuals)]).tolist()
    return NuisanceConfig(offset=offset * prior.offset, gain=gain * prior.gain, delay_s=delay * prior.delay_s)


def scales_of(peaks: Sequence[float], cleaned: Sequence[CleanedRecord], damper: Damper, zero: float = 0.0) -> Scales:
    """Return the magnitudes by which parameters of effects are scaled.

    Parameters
    ----------
    peaks : largest force of each test [N]
    cleaned : the tests
    damper : T0, C and k at their conditions
    zero : displacement at the middle of the stroke [m]
    """
    records = [p.record for p in cleaned]

    def largest(channels: Iterable[Array]) -> float:
        return max(*(float(np.max(np.abs(channel))) for channel in channels), float(np.finfo(float).tiny))

    force, speed = largest(np.array(peaks)[:, None]), largest(r.velocity for r in records)
    return Scales(
        force,
        min(peaks),
        speed,
        largest(r.displacement - zero for r in records),
        largest(r.acceleration for r in records),
        max(float(np.median([row.C_Ns_per_m for row in damper.base])), UNSEEN[0] * force / speed),
        voltage_scale(records),
        flow_of(damper, cleaned),
    )


def flow_of(damper: Damper, cleaned: Sequence[CleanedRecord]) -> tuple[tuple[float, float], ...]:
    """Return T0 and the largest force [N] of each condition by the damper itself: noise adds to what is measured.

    Equation: T0 + C max abs(v)
    """
    speeds: dict[int, float] = {}
    for p in cleaned:
        if p.constant:
            place = nearest_row(damper.base, p)
            speeds[place] = max(speeds.get(place, 0.0), float(np.max(np.abs(p.record.velocity))))
    rows = ((damper.base[place], speed) for place, speed in sorted(speeds.items()))
    return tuple((row.T0_N, row.T0_N + row.C_Ns_per_m * speed) for row, speed in rows)


def nearest_row(rows: Sequence[BaseRow], cleaned: CleanedRecord) -> int:
    """Return the index of the base row of a record."""
    return nearest_condition(rows, cleaned.record.median_voltage(), cleaned.record.median_temperature())
