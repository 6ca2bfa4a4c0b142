"""The records of one setting, and how a damper compares with them; each damper is simulated once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from pzd.damper.effect import Scales
from pzd.damper.material import by_voltage
from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.data import HELD_OUT, TRAINING, VALIDATION, PreparedRecord, Split
from pzd.diagnosis.fit.least_squares import FitResult
from pzd.diagnosis.fit.likelihood import WeightedRecord, weighted_record
from pzd.diagnosis.fit.prediction import PredictedForce, predict
from pzd.diagnosis.fit.problem import Budget, Problem
from pzd.diagnosis.gap import ResidualCheck, check_residual, probability_of_noise, visible_gap
from pzd.diagnosis.thresholds import MOST_TIME_CONSTANTS
from pzd.record import Array, Mask, voltage_scale
from pzd.signals.criterion import criterion
from pzd.signals.nuisance import NuisanceConfig

Item = TypeVar("Item")
Made = TypeVar("Made")


@dataclass(frozen=True, eq=False)
class Campaign:
    """The records of one setting, and which of their samples the search for missing effects may see."""

    prepared: tuple[PreparedRecord, ...]
    split: Split
    nuisance: NuisanceConfig
    jobs: int = 1
    """Records that are simulated at the same time."""
    budget: Budget = field(default_factory=Budget, repr=False)
    """What has been simulated in fits, and may be."""
    _predictions: dict[tuple[str, int], PredictedForce] = field(default_factory=dict, repr=False)
    _checks: dict[str, tuple[ResidualCheck, ...]] = field(default_factory=dict, repr=False)

    @property
    def seen(self) -> tuple[Mask, ...]:
        """(n,) the samples of each record that the search for missing effects may see."""
        return tuple(roles != HELD_OUT for roles in self.split.roles)

    def in_role(self, role: int) -> tuple[Mask, ...]:
        """(n,) the samples of each record in one role of the split."""
        return tuple(roles == role for roles in self.split.roles)

    def predictions(self, damper: Damper, numbers: Sequence[int]) -> tuple[PredictedForce, ...]:
        """What the damper makes of some of the records."""
        key = damper.model_dump_json()
        new = [i for i in numbers if (key, i) not in self._predictions]
        made = self.parallel_map(lambda i: predict(damper, self.prepared[i], self.nuisance.delay_s), new)
        self._predictions.update(zip(((key, i) for i in new), made, strict=True))
        return tuple(self._predictions[key, i] for i in numbers)

    def checks(self, damper: Damper) -> tuple[ResidualCheck, ...]:
        """Every record against a damper, over the samples seen."""
        key = damper.model_dump_json()
        if key not in self._checks:
            self._checks[key] = self._against(damper, self.seen)
        return self._checks[key]

    def held_out_checks(self, damper: Damper) -> tuple[ResidualCheck, ...]:
        """Every record against a damper, over the samples that the search may not see."""
        return self._against(damper, self.in_role(HELD_OUT))

    def offset(self, damper: Damper) -> float:
        """By how much the median record lies above what the damper makes of it [N]; no effect has to explain it."""
        asked = records_in_use(self.seen)
        given = zip(asked, self.predictions(damper, asked), strict=True)
        return float(np.median([np.mean(self.prepared[i].record.force - each.force) for i, each in given]))

    def _against(self, damper: Damper, masks: Sequence[Mask]) -> tuple[ResidualCheck, ...]:
        asked = records_in_use(masks)
        given = [(e, self.prepared[i], masks[i]) for i, e in zip(asked, self.predictions(damper, asked), strict=True)]
        return self.parallel_map(lambda each: check_residual(*each, self.nuisance), given)

    def parallel_map(self, function: Callable[[Item], Made], items: Iterable[Item]) -> tuple[Made, ...]:
        """What a function makes of every item, `jobs` of them at the same time."""
        with ThreadPoolExecutor(max(self.jobs, 1)) as pool:
            return tuple(pool.map(function, items))


def records_in_use(masks: Sequence[Mask]) -> list[int]:
    """The records of which a mask (n,) keeps any sample."""
    return [i for i, mask in enumerate(masks) if mask.any()]


# The data that the selection of effects works with: all samples seen, and their two halves.


@dataclass(frozen=True, eq=False)
class Evidence:
    """The tests of one setting as least-squares problems: all that is seen, and either half of it."""

    campaign: Campaign
    whole: Problem
    """All samples seen."""
    halves: tuple[Problem, Problem]
    """Those for training, and those that choose."""

    def gap(self, fitted: FitResult) -> float:
        """The gap that a fit leaves over all that is seen, as a share of peak."""
        return visible_gap(self.campaign.checks(fitted.damper))

    def something_missing(self, fitted: FitResult, config: DiagnoseConfig) -> bool:
        """Whether the fit misses the tests by more than noise and by more than nothing."""
        likely = probability_of_noise(self.campaign.checks(fitted.damper))
        return likely < config.significance and self.gap(fitted) >= config.negligible

    def criterion(self, fitted: FitResult) -> float:
        """W_s over the compared samples of all that is seen."""
        measured = np.concatenate([o.measured for o in self.whole.observations])
        return criterion(measured - np.concatenate(fitted.simulated), measured)

    def choosing(self, weights: Evidence) -> Problem:
        """The tests that choose, with the base rows of this evidence and the weights of another one."""
        mine = self.halves[1]
        pairs = zip(weights.halves[1].observations, mine.observations, strict=True)
        return replace(mine, observations=tuple(replace(other, base_row=o.base_row) for other, o in pairs))


def evidence_of(campaign: Campaign, damper: Damper) -> Evidence:
    """The evidence of the records of one setting.

    Parameters
    ----------
    campaign : the records, and which samples are fitted, which choose, which are untouched
    damper : where the fits start and along which gain and delay of a test act
    """
    prepared = campaign.prepared
    places = [nearest_row(damper.base, p) if p.constant else -1 for p in prepared]
    shown = records_in_use(campaign.seen)
    given = dict(zip(shown, campaign.predictions(damper, shown), strict=True))
    made: dict[tuple[int, bytes], WeightedRecord | None] = {}

    def observed(kept: Sequence[Mask]) -> tuple[WeightedRecord, ...]:
        """A record that lies in one half is the same in the whole."""
        keys = [(i, kept[i].tobytes()) for i in records_in_use(kept)]
        for i, key in keys:
            if (i, key) not in made:
                made[i, key] = weighted_record(prepared[i], kept[i], places[i], given[i], campaign.nuisance)
        found = [made[key] for key in keys]
        return tuple(each for each in found if each is not None)

    whole = observed(campaign.seen)
    scales = _scales(whole, prepared, damper, voltage_scale([p.record for p in prepared]))
    reference = damper.reference_temperature_degC
    if reference is None:
        recorded = [t for t in (p.record.median_temperature() for p in prepared) if t is not None]
        reference = float(np.median(recorded)) if recorded else None
    fastest = _largest_rate(prepared, damper)
    varying = frozenset(name for name, values in damper.effects.items() if "at_voltage_V" in values)
    problems = [
        Problem(part, damper.base, scales, fastest, reference, varying, campaign.budget)
        for part in (whole, *(observed(campaign.in_role(role)) for role in (TRAINING, VALIDATION)))
    ]
    return Evidence(campaign, problems[0], (problems[1], problems[2]))


def _largest_rate(prepared: Sequence[PreparedRecord], damper: Damper) -> float:
    """Largest k / C [1/s] that the samples tell from a larger one.

    In slip the force settles with C / k. After a reversal it turns over a stroke of 2 T0 / k, which the piston goes
    within one sample where k is larger than the second term says.

    Equation: max(3 f, 4 T0 f^2 / (C a)), from a t^2 / 2 = 2 T0 / k at t = 1 / f, a the peak acceleration of the
    gentlest test
    """
    rate = max(p.record.rate for p in prepared)
    gentlest = min(float(np.max(np.abs(p.record.acceleration))) for p in prepared)
    turning = max(4.0 * row.T0_N * rate**2 / (row.C_Ns_per_m * gentlest) for row in damper.base)
    return max(MOST_TIME_CONSTANTS * rate, turning)


def _scales(
    observed: Sequence[WeightedRecord], prepared: Sequence[PreparedRecord], damper: Damper, voltage: float
) -> Scales:
    def largest(channel: str) -> float:
        return max(float(np.max(np.abs(_of(p, channel)))) for p in prepared)

    peaks = [o.peak for o in observed]
    return Scales(
        max(peaks),
        min(peaks),
        largest("velocity"),
        largest("displacement"),
        largest("acceleration"),
        float(np.median([row.C_Ns_per_m for row in damper.base])),
        voltage,
    )


def _of(prepared: PreparedRecord, channel: str) -> Array:
    return np.asarray(getattr(prepared.record, channel))


def nearest_row(rows: Sequence[BaseRow], prepared: PreparedRecord) -> int:
    """Index of the base row of a record: of the rows of the nearest voltage, that of the nearest temperature."""
    voltage, temperature = prepared.record.median_voltage() or 0.0, prepared.record.median_temperature() or 0.0
    _, nearest = min(by_voltage(rows), key=lambda group: abs(group[0] - voltage))
    row = min(nearest, key=lambda r: abs((r.temperature_degC or 0.0) - temperature))
    return next(i for i, each in enumerate(rows) if each is row)
