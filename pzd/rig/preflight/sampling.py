"""Whether the clock is regular, without lost samples, and fast enough for the motion."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.rig.preflight import Measured
from pzd.schema.errors import counted

LOST = 1.5
"""A step longer than this many median steps has lost samples."""
JITTER = 0.02
"""R.m.s. deviation of the steps, as a share of the median step, that is said."""
FEW_SAMPLES = 40
"""Samples a cycle below which linear interpolation of the displacement biases the stiffness."""


def check(test: Measured) -> list[Finding]:
    """Lost samples, an unsteady clock, and too few samples in a cycle."""
    time = test.record.time
    steps = np.diff(time)
    step = float(np.median(steps))
    gaps = np.flatnonzero(steps > LOST * step)
    found: list[Finding] = []
    if gaps.size:
        lost = int(np.sum(np.rint(steps[gaps] / step) - 1))
        found.append(
            Finding(
                check="dropped samples",
                where=f"{counted(gaps.size, 'gap')}, the first after {time[gaps[0]]:.6g} s, "
                f"the longest {steps.max():.4g} s",
                size=float(lost),
                unit="samples",
                follows="displacement is taken as linear across each gap; a fit over a long gap is wrong there",
            )
        )
    jitter = float(np.std(np.delete(steps, gaps)) / step)
    if jitter > JITTER:
        found.append(
            Finding(
                check="sampling",
                where="the whole record",
                size=jitter,
                unit="-",
                follows="the steps of the clock scatter by this share; the speed is read wrongly by as much",
            )
        )
    if test.run is not None and test.run.period / step < FEW_SAMPLES:
        found.append(
            Finding(
                check="sampling",
                where=f"the cycles at {test.run.frequency:.4g} Hz",
                size=test.run.period / step,
                unit="samples a cycle",
                follows="the motion between samples is guessed: stiffness is biased by about 1 % and more",
            )
        )
    return found
