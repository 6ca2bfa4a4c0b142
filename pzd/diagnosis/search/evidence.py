"""The data that the selection of effects works with: all samples seen, and their two halves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.damper.effect import Scales
from pzd.damper.model import BaseRow, Damper
from pzd.damper.parameter_rows import rows_per_voltage
from pzd.diagnosis.campaign import Campaign, in_use, probability_of_noise, visible_gap
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.data import TRAINING, VALIDATION, Prepared
from pzd.diagnosis.fit.least_squares import Fitted
from pzd.diagnosis.fit.likelihood import RecordLikelihood, record_likelihood
from pzd.diagnosis.fit.parameters import Problem
from pzd.diagnosis.thresholds import MOST_TIME_CONSTANTS
from pzd.record import Array, Mask, voltage_scale
from pzd.signals.measures import criterion


@dataclass(frozen=True, eq=False)
class Evidence:
    """The tests of one setting as least-squares problems: all that is seen, and either half of it."""

    campaign: Campaign
    whole: Problem
    """All samples seen."""
    halves: tuple[Problem, Problem]
    """Those for training, and those that choose."""

    def gap(self, fitted: Fitted) -> float:
        """The gap that a fit leaves over all that is seen, as a share of peak."""
        return visible_gap(self.campaign.checks(fitted.damper))

    def something_missing(self, fitted: Fitted, config: DiagnoseConfig) -> bool:
        """Whether the fit misses the tests by more than noise and by more than nothing."""
        likely = probability_of_noise(self.campaign.checks(fitted.damper))
        return likely < config.significance and self.gap(fitted) >= config.negligible

    def criterion(self, fitted: Fitted) -> float:
        """W_s over the compared samples of all that is seen."""
        measured = np.concatenate([o.measured for o in self.whole.observations])
        return criterion(measured - np.concatenate(fitted.simulated), measured)

    def choosing(self, weights: Evidence) -> Problem:
        """The tests that choose, with the base rows of this evidence and the weights of another one."""
        mine = self.halves[1]
        pairs = zip(weights.halves[1].observations, mine.observations, strict=True)
        return replace(mine, observations=tuple(replace(other, place=o.place) for other, o in pairs))


def evidence_of(campaign: Campaign, damper: Damper) -> Evidence:
    """The evidence of the records of one setting.

    Parameters
    ----------
    campaign : the records, and which samples are fitted, which choose, which are untouched
    damper : where the fits start and along which gain and delay of a test act
    """
    prepared = campaign.prepared
    places = [nearest_row(damper.base, p) if p.constant else -1 for p in prepared]
    shown = in_use(campaign.seen)
    given = dict(zip(shown, campaign.expected(damper, shown), strict=True))
    made: dict[tuple[int, bytes], RecordLikelihood | None] = {}

    def observed(kept: Sequence[Mask]) -> tuple[RecordLikelihood, ...]:
        """A record that lies in one half is the same in the whole."""
        keys = [(i, kept[i].tobytes()) for i in in_use(kept)]
        for i, key in keys:
            if (i, key) not in made:
                made[i, key] = record_likelihood(prepared[i], kept[i], places[i], given[i], campaign.nuisance)
        found = [made[key] for key in keys]
        return tuple(each for each in found if each is not None)

    whole = observed(campaign.seen)
    scales = _scales(whole, prepared, damper, voltage_scale([p.record for p in prepared]))
    reference = damper.reference_temperature_degC
    if reference is None:
        recorded = [t for t in (p.record.median_temperature() for p in prepared) if t is not None]
        reference = float(np.median(recorded)) if recorded else None
    fastest = _fastest(prepared, damper)
    varying = frozenset(name for name, values in damper.effects.items() if "at_voltage_V" in values)
    problems = [
        Problem(part, damper.base, scales, fastest, reference, varying, campaign.work)
        for part in (whole, *(observed(campaign.in_role(role)) for role in (TRAINING, VALIDATION)))
    ]
    return Evidence(campaign, problems[0], (problems[1], problems[2]))


def _fastest(prepared: Sequence[Prepared], damper: Damper) -> float:
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
    observed: Sequence[RecordLikelihood], prepared: Sequence[Prepared], damper: Damper, voltage: float
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


def _of(prepared: Prepared, channel: str) -> Array:
    return np.asarray(getattr(prepared.record, channel))


def nearest_row(rows: Sequence[BaseRow], prepared: Prepared) -> int:
    """Index of the base row of a record: of the rows of the nearest voltage, that of the nearest temperature."""
    voltage, temperature = prepared.record.median_voltage() or 0.0, prepared.record.median_temperature() or 0.0
    _, nearest = min(rows_per_voltage(rows), key=lambda group: abs(group[0] - voltage))
    row = min(nearest, key=lambda r: abs((r.temperature_degC or 0.0) - temperature))
    return next(i for i, each in enumerate(rows) if each is row)
