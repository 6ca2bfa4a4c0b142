"""Where a recorded force jumps: what is recorded beside a jump is chance, for it falls anywhere between two samples."""

from __future__ import annotations

import numpy as np

from pzd.record import Array
from pzd.signals.cycles import Cycles

SUDDEN = 6.0
"""A sample at which the force bends by so many times its usual scatter lies beside a jump."""
MOST_SUDDEN = 40
"""Samples beside jumps that are allowed for in one record or average cycle, the largest."""
MOST_IN_SAMPLES = 150
"""The same in a record that is compared sample by sample: no cycle stands for the others there."""
BESIDE_REVERSAL = 4
"""Samples beside the jump of a dry friction: two, and at either end one that it reaches through a filter."""
USUAL = 1.4826
"""Standard deviation of Gaussian scatter over its median magnitude."""


def jumps(force: Array, most: int = MOST_SUDDEN) -> Array:
    """(n,) how far the force bends at the samples beside a jump (dry friction at a reversal) [N]; 0 at all others.

    Equation: |F_(i-1) - 2 F_i + F_(i+1)| where it exceeds 6 of its robust standard deviations
                                                                    Source: Hampel 1974, median deviation

    Parameters
    ----------
    force : (n,) [N]
    most : samples that are allowed for, the largest
    """
    bend = np.abs(np.convolve(force, (1.0, -2.0, 1.0), "same"))
    bend[[0, -1]] = 0.0
    sudden = np.flatnonzero(bend > SUDDEN * USUAL * np.median(bend))
    largest = sudden[np.argsort(-bend[sudden], kind="stable")][:most]
    found = np.zeros(force.size)
    found[largest] = bend[largest]
    return found


def jumps_in_samples(measured: Array, predicted: Array, reversals: int = 0) -> Array:
    """(n,) the same for a record compared sample by sample: noise hides jumps of it that its prediction shows [N].

    Parameters
    ----------
    measured, predicted : (n,) force [N]
    reversals : of the motion; of many, more samples are allowed for
    """
    most = max(MOST_IN_SAMPLES, BESIDE_REVERSAL * reversals)
    return np.maximum(jumps(measured, most), jumps(predicted, most))


def jumps_in_cycles(run: Cycles, time: Array, force: Array) -> Array:
    """(n,) the same for a record that repeats, as its average cycle shows them, free of most of the noise [N]."""
    cycle = jumps(run.mean(time, force))
    place = run.phase(time) * cycle.size
    before = np.floor(place).astype(np.int64) % cycle.size
    found: Array = np.maximum(cycle[before], cycle[(before + 1) % cycle.size])
    return found


def within_a_sample(measured: Array, predicted: Array) -> Array:
    """(n,) what a jump makes of the residual that comes up to one sample earlier or later than predicted [N].

    Only where the record jumps as well, by half of what is predicted from one sample to the next: a flank that it
    resolves is no matter of timing.

    Parameters
    ----------
    measured : (n,) force [N]
    predicted : (n,) force [N]
    """
    around, beside = (_neighbours(force) for force in (predicted, measured))
    low, high = around.min(axis=0), around.max(axis=0)
    step = np.abs(np.diff(beside, axis=0)).max(axis=0)
    found: Array = np.where(step >= 0.5 * (high - low), np.clip(measured, low, high) - predicted, 0.0)
    return found


def _neighbours(force: Array) -> Array:
    """(3, n) force one sample before, at, and after each."""
    padded = np.pad(force, 1, mode="edge")
    return np.stack([padded[:-2], force, padded[2:]])
