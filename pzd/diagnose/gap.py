"""The gap between simulation and measurement: its size on what no fit has seen, and whether noise explains it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.artefacts import Gap
from pzd.diagnose.data.split import Split
from pzd.diagnose.residual_check import ResidualCheck
from pzd.record import Array
from pzd.signals.lack_of_fit import pooled

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
    return min(1.0, *(len(kinds) * pooled([c.probability[k] for c in checks if k in c.probability]) for k in kinds))


def visible_gap(checks: Sequence[ResidualCheck]) -> float:
    """R.m.s. of the gap above the noise as a share of each record's peak force, pooled over the samples."""
    return _pooled(checks, [c.power / c.peak**2 for c in checks])


def gap_in_force(checks: Sequence[ResidualCheck]) -> float:
    """R.m.s. of the gap above the noise [N], pooled over the samples: the tests of large force count most."""
    return _pooled(checks, [c.power for c in checks])


def _pooled(checks: Sequence[ResidualCheck], squares: Sequence[float]) -> float:
    samples = np.array([np.count_nonzero(c.wanted) for c in checks], dtype=np.float64)
    return float(np.sqrt(max(float(samples @ np.array(squares) / samples.sum()), 0.0)))
