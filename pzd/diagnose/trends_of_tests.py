"""What the tests' own gains, offsets and delays have in common: what follows the motion is no chance of single tests.

A fit allows each test a gain, an offset and a delay of its own. By chance they scatter from test to test. Where they
follow the frequency, the speed, the stroke or the temperature of the tests, something of the damper or of the stand is
missing that these allowances hide.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pzd.damper.model import Damper
from pzd.diagnose.campaign import Campaign
from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.residual_check import ResidualCheck
from pzd.diagnose.search.evidence import nearest_row
from pzd.diagnose.thresholds import CONTRADICTS, FEWEST_FOR_A_TREND
from pzd.record import Array
from pzd.signals.nuisance import NuisanceConfig, columns_of
from pzd.signals.root_mean_square import rms

UNIT = NuisanceConfig(offset=0.01, delay_s=0.001, gain=0.01)
"""What they are counted in: a hundredth of the peak force, a millisecond, a hundredth of the force."""
SAME = 1e-6
"""Tests whose frequency, speed or stroke differ by a smaller share do not differ; their temperatures likewise."""
OWN = ("offset", "gain", "delay")
"""What a test may have of its own, in the order of `columns_of`."""


@dataclass(frozen=True)
class Trend:
    """One allowance of the tests that follows one quantity of their motion."""

    own: str
    follows: str
    size: float
    """R.m.s. of the force that it stands for, as a share of peak."""
    probability: float
    """That chance alone makes a trend like it, all pairs that were looked at allowed for."""

    def __str__(self) -> str:
        """The trend in words."""
        return (
            f"the {self.own} that each test is allowed follows its {self.follows} ({100.0 * self.size:.2g} % of peak, "
            f"probability by chance {max(self.probability, 1e-300):.1g}), which no chance of single tests does"
        )


def trend_of_tests(campaign: Campaign, damper: Damper, config: DiagnoseConfig) -> Trend | None:
    """The surest trend of the tests' own gains, offsets and delays over their motion; None where chance explains all.

    Equation: t = b / sqrt(sum e^2 / (n - g - 1) / sum x^2), y = b x + e about the means in each of g conditions
                                                            Source: least squares; Bonferroni over the pairs

    Parameters
    ----------
    campaign : the tests
    damper : what they are compared with
    config : how small a probability is believed, and what is visible
    """
    checks = [c for c in campaign.checks(damper) if c.prepared.constant and c.wanted.any()]
    if not checks:
        return None
    condition = np.array([nearest_row(damper.base, c.prepared) for c in checks])
    own, sizes = _own(checks)
    pairs = [
        (name, follows, _regressed(own[:, i], over, condition), sizes[i])
        for i, name in enumerate(OWN)
        for follows, over in _motions(checks)
    ]
    found = [
        Trend(name, follows, regressed[0] * size, min(1.0, len(pairs) * regressed[1]))
        for name, follows, regressed, size in pairs
        if regressed is not None
    ]
    believed = [t for t in found if t.probability < config.significance and t.size >= CONTRADICTS * config.visible]
    return min(believed, key=lambda t: t.probability, default=None)


def _own(checks: Sequence[ResidualCheck]) -> tuple[Array, Array]:
    """(n, 3) offset, gain and delay of every test in `UNIT`, and (3,) what one of each makes of the force [peak]."""
    found, size = [], []
    for check in checks:
        force = check.predicted[check.wanted]
        columns = columns_of(force, check.prepared.record.rate, UNIT, check.wanted)
        found.append(np.linalg.lstsq(columns, check.residual[check.wanted], rcond=None)[0])
        size.append(np.sqrt(np.mean(columns**2, axis=0)) / check.peak)
    return np.array(found).reshape(-1, 3), np.mean(np.array(size).reshape(-1, 3), axis=0)


def _motions(checks: Sequence[ResidualCheck]) -> Iterator[tuple[str, Array]]:
    """By name, what the tests differ in (n,); NaN where a test has none."""
    records = [c.prepared.record for c in checks]
    cycles = [c.prepared.cycles for c in checks]
    yield "frequency", np.log([np.nan if run is None else run.frequency for run in cycles])
    yield "speed", np.log([rms(r.velocity) for r in records])
    yield "stroke", np.log([float(np.ptp(r.displacement)) for r in records])
    warmth = [r.median_temperature() for r in records]
    yield "temperature", np.array([np.nan if t is None else t for t in warmth])


def _regressed(values: Array, over: Array, condition: NDArray[np.int64]) -> tuple[float, float] | None:
    """R.m.s. of what follows a quantity within conditions, and its probability by chance; None with too few tests."""
    from scipy.special import stdtr

    known = np.isfinite(over)
    y, x, condition = values[known], over[known], condition[known]
    free = y.size - np.unique(condition).size - 1
    if free < FEWEST_FOR_A_TREND:
        return None
    for each in np.unique(condition):
        inside = condition == each
        y[inside] -= y[inside].mean()
        x[inside] -= x[inside].mean()
    if np.ptp(x) <= SAME * max(1.0, float(np.max(np.abs(over[known])))):
        return None
    slope = float(x @ y / (x @ x))
    left = float(np.sum((y - slope * x) ** 2)) / free
    size = abs(slope) * rms(x)
    if left <= 0.0:
        return size, 0.0 if slope else 1.0
    return size, float(2.0 * stdtr(free, -abs(slope) * np.sqrt(float(x @ x) / left)))
