"""Jumps of a recorded force, gaps in a record, and steps of a control signal.
A jump (dry friction at a reversal) falls anywhere between two samples, so that the samples beside it are left to
chance. Where samples are left out, nothing is differenced across the gap.
"""

from __future__ import annotations

import numpy as np

from pzd.record import Array, Mask
from pzd.signals.cycles import Cycles

# --- Jumps of the force ---

SUDDEN = 6.0
"""A sample at which the force bends by so many times its usual scatter lies beside a jump."""
MOST_SUDDEN = 40
"""Samples beside jumps that are allowed for in one record or average cycle, the largest."""
MOST_IN_SAMPLES = 150
"""The same in a record that is compared sample by sample: no cycle stands for the others there."""
SAMPLES_PER_REVERSAL = 4
"""Samples beside the jump of a dry friction: two, and at either end one that it reaches through a filter."""
MAD_TO_SIGMA = 1.4826
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
    sudden = np.flatnonzero(bend > SUDDEN * MAD_TO_SIGMA * np.median(bend))
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
    most = max(MOST_IN_SAMPLES, SAMPLES_PER_REVERSAL * reversals)
    return np.maximum(jumps(measured, most), jumps(predicted, most))


def jumps_in_cycles(run: Cycles, time: Array, force: Array) -> Array:
    """(n,) the same for a record that repeats, as its average cycle shows them, free of most of the noise [N]."""
    cycle = jumps(run.mean(time, force))
    place = run.phase(time) * cycle.size
    before = np.floor(place).astype(np.int64) % cycle.size
    found: Array = np.maximum(cycle[before], cycle[(before + 1) % cycle.size])
    return found


def jump_timing_error(measured: Array, predicted: Array) -> Array:
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


# --- Gaps ---


def split_at_gaps(values: Array, counted: Mask) -> list[Array]:
    """Values (m,) or (m, p) at the counted samples of a record, parted where samples between them are left out.

    Parameters
    ----------
    values : at the m samples that count
    counted : (n,) which samples of the record these are
    """
    ends = np.flatnonzero(np.diff(np.flatnonzero(counted)) > 1) + 1
    return np.split(values, ends)


def gradient_within_stretches(values: Array, counted: Mask) -> Array:
    """(m,) change from sample to sample, by central differences within each stretch; 0 for a sample that stands alone.

    Parameters
    ----------
    values : (m,) at the samples that count
    counted : (n,) which samples of the record these are
    """
    parts = split_at_gaps(values, counted)
    return np.concatenate([np.gradient(part) if part.size > 1 else np.zeros(part.size) for part in parts])


def has_predecessors(counted: Mask, memory: int) -> Mask:
    """Which of the counted samples (m,), but for the first few, have as many predecessors in the same stretch.

    Parameters
    ----------
    counted : (n,) which samples of a record count
    memory : how many predecessors; the first so many of the m samples are left out of what is returned

    Returns
    -------
    (m - memory,)
    """
    run = np.convolve(counted, np.ones(memory + 1, dtype=np.int64))[: counted.size]
    whole: Mask = run[counted][memory:] == memory + 1
    return whole


# --- Steps of a control signal ---# Noise of the recorded signal is not the valve's, and a law that follows it steps in the force wherever the noise# turns. A constant level and a ramp are lines; what is curved stays as recorded.

FEWEST_FOR_LINE = 10
"""Samples from which a stretch is held against a line."""
LINE_TO_NOISE = 1.5
"""A stretch whose r.m.s. about its line is at most so many times the noise of a sample is that line."""


def denoised_control(values: Array) -> Array:
    """A signal whose levels and ramps are free of noise.

    Parameters
    ----------
    values : (n,) of a signal that steps, is held, rises and falls

    Returns
    -------
    (n,) by least squares on each stretch between two steps that is a line but for noise; the rest as it is
    """
    changes = np.diff(values)
    usual = np.median(changes) if changes.size else 0.0
    scatter = MAD_TO_SIGMA * float(np.median(np.abs(changes - usual))) if changes.size else 0.0
    if scatter == 0.0:
        return values
    ends = np.flatnonzero(np.abs(changes - usual) > SUDDEN * scatter) + 1
    found = values.copy()
    for part in np.split(np.arange(values.size), ends):
        if part.size >= FEWEST_FOR_LINE:
            line = np.polyval(np.polyfit(part - part.mean(), values[part], 1), part - part.mean())
            if np.sqrt(np.mean((values[part] - line) ** 2)) <= LINE_TO_NOISE * scatter / np.sqrt(2.0):
                found[part] = line
    return found
