"""Which tests of two states are compared with one another, and the error of the model where it stands in for a test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.damper.model import BaseRow, Damper
from pzd.damper.parameter_rows import rows_per_voltage
from pzd.diagnosis.changes.pairs import (
    MOST_HARMONICS,
    AveragedTest,
    Comparison,
    averaged,
    cycles_compared,
    model_compared,
    motion_away,
    nearest_motion,
    octave_mean,
    paired,
    stacked,
    stacked_variance,
    unstacked,
)
from pzd.diagnosis.changes.regression import Likelihood
from pzd.diagnosis.changes.state import State
from pzd.identification.config import IdentifyConfig
from pzd.record import Array
from pzd.schema.errors import DataError
from pzd.signals.nuisance import NuisanceConfig

BEYOND_TESTED = 2.0
"""Multiple of what a damper misses in its own tests that it may miss in others, to which it was not fitted.

Reason: of three parameters fitted to a test or two, as much again is taken up by the fit."""


def comparisons_of(
    before: State, after: State, identify: IdentifyConfig, nuisance: NuisanceConfig, own: ModelError
) -> tuple[Comparison, ...]:
    """Pair the tests, and compare the others of the second state with the damper of the first.

    What that damper misses of the nearest motion of the first state is taken to be missed here too, where that
    predicts the tests of the first state from one another better than the damper alone predicts its own; the nearer
    that motion, the less is missed.

    Parameters
    ----------
    before, after : the states
    identify : for what counts as one condition
    nuisance : priors on how tests differ by themselves
    own : error of that damper in its own tests

    Raises
    ------
    DataError : when none of the second state repeats
    """
    one, other = averaged(before.cleaned), averaged(after.cleaned)
    if not other:
        raise DataError(
            f"{after.name}: no test repeats its motion at a constant control signal, so there is no cycle to compare; "
            "run a sine or triangle for three cycles or more"
        )
    within = max(state.voltage_slack(identify.group.voltage_V) for state in (before, after))
    pairs = paired(one, other, within, identify.group.temperature_degC)
    matched = {j for _, j in pairs}
    found = [cycles_compared(before.damper, one[i], other[j]) for i, j in pairs]
    mean = float(np.mean([t.displacement[0].real for t in one])) if one else before.damper.zero_m
    rest = [test for j, test in enumerate(other) if j not in matched]
    beside = [test for test in rest if _as_tested(before, test, identify)]
    if not beside and not found:
        beside = [test for test in rest if _in_range(before, test)]
    carried = _carried(before.damper, one, within, nuisance) if beside else None
    for test in beside:
        partner = nearest_motion(test, one, within)
        farther = np.inf if carried is None or partner is None else _farther(motion_away(partner, test), carried)
        if carried is not None and partner is not None and farther * carried.share < BEYOND_TESTED * own.share:
            found.append(carried.beside(replace(cycles_compared(before.damper, partner, test), before=None), farther))
        else:
            through = model_compared(before.damper, test, mean, _temperature(before, test))
            found.append(own.beside(through, BEYOND_TESTED))
    if not found:
        raise DataError(f"{before.name}, {after.name}: no test of either state has a control signal of the other")
    return tuple(found)


def _as_tested(before: State, test: AveragedTest, identify: IdentifyConfig) -> bool:
    """Whether the first state was tested at the control signal and the temperature of a test."""
    within = identify.group.temperature_degC
    slack = before.voltage_slack(identify.group.voltage_V)

    def near(row: BaseRow) -> bool:
        level = None in (row.voltage_V, test.voltage) or abs((row.voltage_V or 0.0) - (test.voltage or 0.0)) <= slack
        if row.temperature_degC is None or test.temperature is None:
            return level
        return level and abs(row.temperature_degC - test.temperature) <= within

    return any(near(row) for row in before.damper.base)


def _in_range(before: State, test: AveragedTest) -> bool:
    """Whether the control signal of a test lies between those of the first state."""
    if test.voltage is None:
        return True
    nodes = [voltage for voltage, _ in rows_per_voltage(before.damper.base)]
    slack = before.voltage_slack()
    return min(nodes) - slack <= test.voltage <= max(nodes) + slack


def _temperature(before: State, test: AveragedTest) -> float | None:
    """Return the temperature of the first state at which a test without a partner is simulated [degC]."""
    known = [r.median_temperature() for r in before.records]
    recorded = [t for t in known if t is not None]
    if not recorded or test.temperature is None:
        return test.temperature
    return float(np.clip(test.temperature, min(recorded), max(recorded)))


@dataclass(frozen=True, eq=False)
class ModelError:
    """Error of the damper of the first state in tests of that state, less their own offset, gain and delay."""

    share: float
    """Of the force (r.m.s.)."""
    power: Array
    """(H + 1,) mean square at every harmonic, as a share of the squared peak force, over the octave about it."""
    away: float = 0.0
    """Mean distance of the motions from which a test is carried over (`motion_away`); 0 of the damper alone."""

    @classmethod
    def of(cls, comparisons: Sequence[Comparison], nuisance: NuisanceConfig, away: float = 0.0) -> ModelError:
        """Return what is left of differences beyond noise and beyond what tests differ by themselves."""
        likelihood = Likelihood(tuple(comparisons), nuisance, 0.0)
        residuals = [c.difference for c in comparisons]
        scatter, _ = likelihood.best_scatter(residuals)
        missed, force, powers = 0.0, 0.0, np.full((len(comparisons), MOST_HARMONICS + 1), np.nan)
        for c, r, own, power in zip(
            comparisons, residuals, likelihood.own_of_tests(residuals, scatter), powers, strict=True
        ):
            missed += (float((r - own) @ (r - own)) - float(np.sum(c.variance))) / c.peak**2
            force += float(np.sum(stacked(c.reference) ** 2)) / c.peak**2
            power[: c.rate.size] = (np.abs(unstacked(r - own)) ** 2 - c.variance[: c.rate.size]) / c.peak**2
        known = np.nan_to_num(np.nanmean(powers[:, : max(c.rate.size for c in comparisons)], axis=0))
        octaves = octave_mean(known)
        octaves[0] = known[0]
        # Of squares less those of noise some are below 0 by chance, as others are above: only their mean is held to 0.
        share = float(np.sqrt(max(missed, 0.0) / force)) if force > 0.0 else 0.0
        return cls(share, np.maximum(octaves, 0.0), away)

    def beside(self, comparison: Comparison, times: float = 1.0) -> Comparison:
        """Return a comparison with this error of the model in it, scaled by a factor."""
        power = np.zeros(comparison.rate.size)
        size = min(power.size, self.power.size)
        power[:size] = self.power[:size] * (times * comparison.peak) ** 2
        return replace(comparison, missed=stacked_variance(power, comparison.counted))


def error_in_own_tests(state: State, nuisance: NuisanceConfig) -> ModelError:
    """Compute the error of the damper of a state in the tests of that state."""
    alone = [
        model_compared(state.damper, test, float(test.displacement[0].real), test.temperature)
        for test in averaged(state.cleaned)
    ]
    return ModelError.of(alone, nuisance) if alone else ModelError(0.0, np.zeros(1))


def _carried(
    damper: Damper, tests: Sequence[AveragedTest], voltage_within: float, nuisance: NuisanceConfig
) -> ModelError | None:
    """Compute the error of the tests of a state where each is carried over from that of the nearest other motion."""
    partners = ((nearest_motion(test, tests, voltage_within), test) for test in tests)
    pairs = [(partner, test) for partner, test in partners if partner is not None]
    away = float(np.mean([motion_away(*pair) for pair in pairs])) if pairs else 0.0
    if away == 0.0:
        return None
    return ModelError.of([cycles_compared(damper, *pair) for pair in pairs], nuisance, away)


def _farther(away: float, carried: ModelError) -> float:
    """Compute the factor by which that error grows with the distance between two motions.

    Equation: sqrt(d / D), D the mean distance at which it was measured
    Source: a linear variogram, Matheron 1963, Econ. Geol. 58, 1246: of laws with kinks what two motions differ by grows
    so in the mean square, of smooth ones with the square of the distance, so that nearby it is not underrated
    """
    return float(np.sqrt(away / carried.away))
