"""The records of one setting, and how a damper compares with them; each damper is simulated once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from pzd.artefacts import Gap
from pzd.damper.model import Damper
from pzd.diagnosis.data import UNTOUCHED, Prepared, Split
from pzd.diagnosis.fit.parameters import Work
from pzd.diagnosis.fit.prediction import Predicted, counted, expected
from pzd.diagnosis.thresholds import CYCLE_CHANGE_SIGNIFICANCE, LEAST_HUM
from pzd.record import Array, Mask
from pzd.signals.harmonics import hum
from pzd.signals.jumps import jump_timing_error, jumps_in_cycles, jumps_in_samples
from pzd.signals.lack_of_fit import (
    TREND_CYCLES,
    TREND_HARMONICS,
    fit_smooth_residual,
    p_value_of_trend,
    p_values_by_harmonics,
    pooled_p_value,
)
from pzd.signals.measures import reversals
from pzd.signals.noise import PureError, harmonics_of, pure_error, repeatable_power
from pzd.signals.nuisance import NuisanceConfig, nuisance_forces

# ----------------------------------------------------------------------------------------------------
# One record against one damper: the residual, its noise, and how unlikely it is by noise alone.


@dataclass(frozen=True, eq=False)
class ResidualCheck:
    """What one record says about a damper, over the wanted samples."""

    prepared: Prepared
    wanted: Mask
    """(n,) the samples that were checked."""
    residual: Array
    """(n,) measured less predicted force [N]."""
    nuisances: Array
    """(n,) the part of it that offset, gain, delay and mains of the test explain, and chance beside jumps [N]."""
    variance: float
    """Of one sample by noise [N^2]."""
    power: float
    """Mean square of what repeats or is smooth above the noise [N^2]; about zero without a gap."""
    probability: dict[str, Array]
    """By kind of test (`harmonics`, `trend`, `smooth`), that noise alone looks so."""
    error: PureError | None
    """Harmonics and noise of the average cycle, where cycles repeat."""
    folded: Array | None
    """(cycles, points) residual less nuisances, where cycles repeat [N]."""
    hum: float
    """Amplitude of the mains among the nuisances [N]; 0 where no line stands out."""
    explained: Array | None
    """(n,) square of what the smooth model explains of it, noise's share taken off, where nothing repeats [N^2]."""

    @property
    def cleared(self) -> Array:
        """(n,) residual less nuisances [N]."""
        return self.residual - self.nuisances

    @property
    def predicted(self) -> Array:
        """(n,) force that the damper gives [N]."""
        return self.prepared.record.force - self.residual

    @property
    def peak(self) -> float:
        """Peak force of the record [N]."""
        return float(np.max(np.abs(self.prepared.record.force)))


def check_residual(given: Predicted, prepared: Prepared, wanted: Mask, config: NuisanceConfig) -> ResidualCheck:
    """The record against what a damper makes of it, over the wanted samples past the warm-up."""
    record = prepared.record
    predicted, residual = given.force, record.force - given.force
    mask = wanted & counted(prepared)
    mains = _mains(prepared, residual, mask)
    without = residual - mains
    rough = _rough_variance(prepared, without, mask)
    calm = bend_beside_jumps(prepared, predicted) == 0.0
    slack = np.zeros(residual.size)
    late = np.zeros(residual.size)
    slack[mask], late[mask] = nuisance_forces(
        without[mask], predicted[mask], record.rate, rough, config, given.timing[mask], calm[mask], mask
    )
    slack = mains + np.where(mask & ~calm, _beside_jumps(record.force - mains, predicted, slack, late), slack + late)
    folded = _folded(prepared, residual - slack, mask)
    if folded is not None:
        found = _repeating(prepared, mask, residual, slack, folded, given.displacement_variance)
    else:
        found = _not_repeating(prepared, mask, residual, slack, predicted)
    return replace(found, hum=float(np.max(np.abs(mains))))


def _mains(prepared: Prepared, residual: Array, mask: Mask) -> Array:
    """(n,) the wave that the mains make in the force of a test [N]; it nearly repeats from cycle to cycle, as a gap."""
    record, run = prepared.record, prepared.cycles
    peak = float(np.max(np.abs(record.force)))
    return hum(record.time, residual, mask, run.frequency if run else 0.0, LEAST_HUM * peak)


def bend_beside_jumps(prepared: Prepared, predicted: Array) -> Array:
    """(n,) how far the force bends beside a jump [N]; 0 elsewhere."""
    record, run = prepared.record, prepared.cycles
    if run is None:
        return jumps_in_samples(record.force, predicted, len(reversals(record.displacement)))
    return jumps_in_cycles(run, record.time, record.force)


def _beside_jumps(force: Array, predicted: Array, sized: Array, late: Array) -> Array:
    """(n,) what a test and chance explain beside a jump [N]: the slope of the force counts where it makes less remain.

    Parameters
    ----------
    force, predicted : (n,) [N]
    sized, late : (n,) what the test's offset and gain explain, and what its delay does along the slope [N]
    """
    found = [slack + jump_timing_error(force - slack, predicted) for slack in (sized, sized + late)]
    left = [np.abs(force - predicted - slack) for slack in found]
    return np.where(left[0] <= left[1], *found)


def _repeating(
    prepared: Prepared, mask: Mask, residual: Array, slack: Array, folded: Array, by_displacement: Array | float
) -> ResidualCheck:
    error = replace(pure_error(folded), shared=by_displacement)
    trend = p_value_of_trend(folded)
    probability = {"harmonics": p_values_by_harmonics(error)}
    if trend is not None:
        probability["trend"] = np.array([trend])
    power = float(repeatable_power(error).sum())
    if trend is not None and trend < CYCLE_CHANGE_SIGNIFICANCE:
        power += _trend_power(folded, error)
    return ResidualCheck(
        prepared, mask, residual, slack, error.sample_variance, power, probability, error, folded, 0.0, None
    )


def _not_repeating(prepared: Prepared, mask: Mask, residual: Array, slack: Array, predicted: Array) -> ResidualCheck:
    fit = fit_smooth_residual((residual - slack)[mask], prepared.record, predicted[mask], mask)
    left = (residual - slack)[mask] - fit.explained
    variance = min(fit.noise.variance, float(np.mean(left**2)) + float(np.mean(fit.spread)))
    explained = np.zeros(residual.size)
    explained[mask] = fit.explained**2 - fit.spread
    power = float(np.mean(explained[mask]))
    probability = {"smooth": np.array([fit.probability])}
    return ResidualCheck(prepared, mask, residual, slack, variance, power, probability, None, None, 0.0, explained)


def _folded(prepared: Prepared, residual: Array, mask: Mask) -> Array | None:
    """The residual's wanted whole cycles, one row each; None with fewer than two."""
    run = prepared.cycles
    if run is None:
        return None
    time = prepared.record.time
    whole = run.whole(time, mask)
    return run.fold(time, residual)[whole] if len(whole) >= 2 else None


def _rough_variance(prepared: Prepared, residual: Array, mask: Mask) -> float:
    """Variance by noise, enough to weigh the priors of the nuisances."""
    folded = _folded(prepared, residual, mask)
    if folded is not None:
        return float(np.mean(np.diff(folded, axis=0) ** 2) / 2.0)
    return float(np.mean(np.diff(residual[mask]) ** 2) / 2.0)


def _trend_power(folded: Array, error: PureError) -> float:
    """Mean square of a steady change from cycle to cycle, noise's share taken off [N^2]."""
    count, points = folded.shape
    if count < TREND_CYCLES:
        return 0.0
    last = min(TREND_HARMONICS, harmonics_of(points))
    order = np.arange(count) - (count - 1) / 2.0
    coefficients = np.fft.rfft(folded, axis=1)[:, : last + 1] / points
    slopes = np.abs(order @ coefficients / (order @ order)) ** 2 - error.single[: last + 1] / (order @ order)
    return float((slopes[0] + 2.0 * slopes[1:].sum()) * np.mean(order**2))


# ----------------------------------------------------------------------------------------------------


Item = TypeVar("Item")
Made = TypeVar("Made")


@dataclass(frozen=True, eq=False)
class Campaign:
    """The records of one setting, and which of their samples the search for missing effects may see."""

    prepared: tuple[Prepared, ...]
    parts: Split
    nuisance: NuisanceConfig
    jobs: int = 1
    """Records that are simulated at the same time."""
    work: Work = field(default_factory=Work, repr=False)
    """What has been simulated in fits, and may be."""
    _expected: dict[tuple[str, int], Predicted] = field(default_factory=dict, repr=False)
    _checks: dict[str, tuple[ResidualCheck, ...]] = field(default_factory=dict, repr=False)

    @property
    def seen(self) -> tuple[Mask, ...]:
        """(n,) the samples of each record that the search for missing effects may see."""
        return tuple(roles != UNTOUCHED for roles in self.parts.roles)

    def in_role(self, role: int) -> tuple[Mask, ...]:
        """(n,) the samples of each record in one role of the split."""
        return tuple(roles == role for roles in self.parts.roles)

    def expected(self, damper: Damper, numbers: Sequence[int]) -> tuple[Predicted, ...]:
        """What the damper makes of some of the records."""
        key = damper.model_dump_json()
        new = [i for i in numbers if (key, i) not in self._expected]
        made = self.each(lambda i: expected(damper, self.prepared[i], self.nuisance.delay_s), new)
        self._expected.update(zip(((key, i) for i in new), made, strict=True))
        return tuple(self._expected[key, i] for i in numbers)

    def checks(self, damper: Damper) -> tuple[ResidualCheck, ...]:
        """Every record against a damper, over the samples seen."""
        key = damper.model_dump_json()
        if key not in self._checks:
            self._checks[key] = self._against(damper, self.seen)
        return self._checks[key]

    def untouched(self, damper: Damper) -> tuple[ResidualCheck, ...]:
        """Every record against a damper, over the samples that the search may not see."""
        return self._against(damper, self.in_role(UNTOUCHED))

    def offset(self, damper: Damper) -> float:
        """By how much the median record lies above what the damper makes of it [N]; no effect has to explain it."""
        asked = in_use(self.seen)
        given = zip(asked, self.expected(damper, asked), strict=True)
        return float(np.median([np.mean(self.prepared[i].record.force - each.force) for i, each in given]))

    def _against(self, damper: Damper, masks: Sequence[Mask]) -> tuple[ResidualCheck, ...]:
        asked = in_use(masks)
        given = [(e, self.prepared[i], masks[i]) for i, e in zip(asked, self.expected(damper, asked), strict=True)]
        return self.each(lambda each: check_residual(*each, self.nuisance), given)

    def each(self, function: Callable[[Item], Made], items: Iterable[Item]) -> tuple[Made, ...]:
        """What a function makes of every item, `jobs` of them at the same time."""
        with ThreadPoolExecutor(max(self.jobs, 1)) as pool:
            return tuple(pool.map(function, items))


def in_use(masks: Sequence[Mask]) -> list[int]:
    """The records of which a mask (n,) keeps any sample."""
    return [i for i, mask in enumerate(masks) if mask.any()]


# ----------------------------------------------------------------------------------------------------
# The gap between simulation and measurement: its size on what no fit has seen, and whether noise explains it.


BLOCKS = 8
"""Parts in which the scatter of the gap is read off a record that does not repeat."""


def gap_of(held_out: Sequence[ResidualCheck], split: Split) -> Gap:
    """Criterion (4) pooled over the held-out samples; nothing is adopted, so after is before.

    Equation: W_s = sum r^2 / sum F^2;  floor = sum_records (s^2 + nuisances) / sum F^2 as in `floor_of`;
    standard error of the ratio over cycles or blocks
                                           Source: Makowski and Knap 2021, eq. (4); Cochran 1977, eq. (6.9)
    """
    errors = np.concatenate([_by_block(j, j.residual**2) for j in held_out])
    forces = np.concatenate([_by_block(j, j.prepared.record.force**2) for j in held_out])
    total = float(forces.sum())
    criterion = float(errors.sum()) / total
    count = errors.size
    scatter = float(np.sum((errors - criterion * forces) ** 2)) * count / max(count - 1, 1)
    return Gap(
        before=criterion,
        after=criterion,
        noise_floor=min(sum(floor_of(j) for j in held_out) / total, criterion),  # summed in another order,
        standard_error=float(np.sqrt(scatter)) / total,
        held_out=split.held_out,
        hold_out=split.hold_out,
    )


def floor_of(check: ResidualCheck) -> float:
    """What noise and the test's own nuisances leave of one record, summed over the checked samples [N^2].

    The nuisances count with what they take away, at most: beside a jump they move the residual without
    making it smaller. Noise is the scatter between cycles or about a smooth residual, at most what the
    nuisances leave. So noise never exceeds the gap that it is part of.

    Equation: sum min(s^2, mean c^2) + min(sum n^2, sum r^2 - sum c^2), c = r - n, n the nuisances
    """
    residual, cleared = check.residual[check.wanted], check.cleared[check.wanted]
    nuisances = check.nuisances[check.wanted]
    before, after = float(residual @ residual), float(cleared @ cleared)
    taken = min(max(before - after, 0.0), float(nuisances @ nuisances))
    return min(check.variance * residual.size, after, before) + taken


def _by_block(check: ResidualCheck, values: Array) -> Array:
    """Sums of (n,) values over the checked samples of each cycle, or of each of a few blocks."""
    kept = values[check.wanted]
    run = check.prepared.cycles
    if run is None:
        return np.array([part.sum() for part in np.array_split(kept, min(BLOCKS, max(kept.size, 1)))])
    number = run.number(check.prepared.record.time)[check.wanted]
    return np.array([kept[number == j].sum() for j in np.unique(number)])


def probability_of_noise(checks: Sequence[ResidualCheck]) -> float:
    """Probability that noise alone looks so in any kind of test (Bonferroni over the kinds)."""
    kinds = {kind for c in checks for kind in c.probability}
    return min(
        1.0, *(len(kinds) * pooled_p_value([c.probability[k] for c in checks if k in c.probability]) for k in kinds)
    )


def visible_gap(checks: Sequence[ResidualCheck]) -> float:
    """R.m.s. of the gap above the noise as a share of each record's peak force, pooled over the samples."""
    return _pooled(checks, [c.power / c.peak**2 for c in checks])


def gap_in_force(checks: Sequence[ResidualCheck]) -> float:
    """R.m.s. of the gap above the noise [N], pooled over the samples: the tests of large force count most."""
    return _pooled(checks, [c.power for c in checks])


def _pooled(checks: Sequence[ResidualCheck], squares: Sequence[float]) -> float:
    samples = np.array([np.count_nonzero(c.wanted) for c in checks], dtype=np.float64)
    return float(np.sqrt(max(float(samples @ np.array(squares) / samples.sum()), 0.0)))
