"""Whether a damper's force half-way between two tested voltages lies between its forces at either.

No test is there to show it, and no voltage left out either: that is predicted from voltages twice as far apart. T0, C
and k lie on lines between voltages, and the force nearly does. An effect whose parameters differ by voltage may leave
that line where the tests of one voltage hardly know them: each pair predicts its own tests, and what lies between two
pairs is no damper.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnose.fit.prediction import counted, motion_of
from pzd.diagnose.kept_back import Trials
from pzd.diagnose.thresholds import FARTHEST_HALF_WAY
from pzd.record import Array
from pzd.signals.root_mean_square import rms

TOLERANCE = 1e-5
"""Of the damper's path, as a share of the force: far below the shares that are compared."""


def between_neighbours(damper: Damper, trials: Trials) -> bool:
    """Whether the force half-way between any two voltages lies near the mean of those at either, in their tests.

    Equation: rms(F((u + w)/2) - (F(u) + F(w))/2) <= s rms(F(w) - F(u)), s = 1/4

    Parameters
    ----------
    damper : the one tried
    trials : the tests, of which those at a voltage that stands still are driven at both and half-way

    Returns
    -------
    False where in any of them it lies visibly farther off
    """
    groups = {v: group for v, group in zip(trials.voltages, trials.groups, strict=True) if v is not None}
    return all(
        _lies_between(damper, trials, record, low, high)
        for low, high in pairwise(sorted(groups))
        for record in (*groups[low], *groups[high])
    )


def _lies_between(damper: Damper, trials: Trials, record: int, low: float, high: float) -> bool:
    below, half_way, above = _forces(damper, trials, record, (low, 0.5 * (low + high), high))
    off = rms(half_way - 0.5 * (below + above))
    seen = trials.visible * float(max(np.max(np.abs(below)), np.max(np.abs(above))))
    return off <= max(FARTHEST_HALF_WAY * rms(above - below), seen)


def _forces(damper: Damper, trials: Trials, record: int, voltages: tuple[float, ...]) -> Iterator[Array]:
    """The force under the motion of a test at other voltages, as far as it does not depend on how the test began."""
    prepared = trials.campaign.prepared[record]
    motion, places = motion_of(prepared.record)
    for voltage in voltages:
        held: Motion = replace(motion, voltage=np.full(motion.time.size, voltage))
        yield respond(damper, held, float(prepared.record.force[0]), TOLERANCE)[places][counted(prepared)]
