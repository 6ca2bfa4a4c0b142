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

    Equation: W_s = sum r^2 / sum F^2;  floor = sum (s^2 + nuisances^2) / sum F^2;  standard error of
    the ratio over cycles or blocks        Source: Makowski and Knap 2021, eq. (4); Cochran 1977, eq. (6.9)
    """
    errors = np.concatenate([_by_block(j, j.residual**2) for j in held_out])
    forces = np.concatenate([_by_block(j, j.prepared.record.force**2) for j in held_out])
    floors = np.concatenate([_by_block(j, j.variance + j.nuisances**2) for j in held_out])
    total = float(forces.sum())
    criterion = float(errors.sum()) / total
    count = errors.size
    scatter = float(np.sum((errors - criterion * forces) ** 2)) * count / max(count - 1, 1)
    return Gap(
        before=criterion,
        after=criterion,
        noise_floor=float(floors.sum()) / total,
        standard_error=float(np.sqrt(scatter)) / total,
        held_out=split.held_out,
        hold_out=split.hold_out,
    )


def _by_block(judged: ResidualCheck, values: Array) -> Array:
    """Sums of (n,) values over the judged samples of each cycle, or of each of a few blocks."""
    kept = values[judged.wanted]
    run = judged.prepared.cycles
    if run is None:
        return np.array([part.sum() for part in np.array_split(kept, min(BLOCKS, max(kept.size, 1)))])
    number = run.number(judged.prepared.record.time)[judged.wanted]
    return np.array([kept[number == j].sum() for j in np.unique(number)])


def probability_of_noise(judged: Sequence[ResidualCheck]) -> float:
    """Probability that noise alone looks so in any kind of test (Bonferroni over the kinds)."""
    kinds = {kind for j in judged for kind in j.probability}
    return min(1.0, *(len(kinds) * pooled([j.probability[k] for j in judged if k in j.probability]) for k in kinds))


def visible_gap(judged: Sequence[ResidualCheck]) -> float:
    """R.m.s. of the gap above the noise as a share of each record's peak force, pooled over the samples."""
    return _pooled(judged, [j.power / j.peak**2 for j in judged])


def gap_in_force(judged: Sequence[ResidualCheck]) -> float:
    """R.m.s. of the gap above the noise [N], pooled over the samples: the tests of large force count most."""
    return _pooled(judged, [j.power for j in judged])


def _pooled(judged: Sequence[ResidualCheck], squares: Sequence[float]) -> float:
    samples = np.array([np.count_nonzero(j.wanted) for j in judged], dtype=np.float64)
    return float(np.sqrt(max(float(samples @ np.array(squares) / samples.sum()), 0.0)))
