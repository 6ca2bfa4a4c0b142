"""One record against one damper: the residual, its noise, and how unlikely it is by noise alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pzd.diagnose.data.cleaning import Prepared
from pzd.diagnose.fit.input_uncertainty import Predicted
from pzd.diagnose.fit.prediction import counted
from pzd.diagnose.thresholds import CYCLE_CHANGE_SIGNIFICANCE, LEAST_HUM
from pzd.record import Array, Mask
from pzd.signals.between_cycles import PureError, harmonics_of, pure_error, repeatable_power
from pzd.signals.jumps import jumps_in_cycles, jumps_in_samples, within_a_sample
from pzd.signals.lack_of_fit import TREND_CYCLES, TREND_HARMONICS, by_harmonics, by_trend
from pzd.signals.mains import hum
from pzd.signals.nuisance import NuisanceConfig, nuisance
from pzd.signals.reversals import reversals
from pzd.signals.smooth_residual import fit_smooth_residual


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
    slack[mask], late[mask] = nuisance(
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
    found = [slack + within_a_sample(force - slack, predicted) for slack in (sized, sized + late)]
    left = [np.abs(force - predicted - slack) for slack in found]
    return np.where(left[0] <= left[1], *found)


def _repeating(
    prepared: Prepared, mask: Mask, residual: Array, slack: Array, folded: Array, by_displacement: Array | float
) -> ResidualCheck:
    error = replace(pure_error(folded), shared=by_displacement)
    trend = by_trend(folded)
    probability = {"harmonics": by_harmonics(error)}
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
