"""Jumps of a recorded force, gaps in a record, and steps of a control signal.

A jump (dry friction at a reversal) falls anywhere between two samples, so that the samples beside it are left to
chance. Where samples are left out, nothing is differenced across the gap.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from pzd.record import MAD_TO_SIGMA, Array, Mask
from pzd.signals.cycles import Cycles
from pzd.signals.measures import noise_beside_motion, reversals

# --- Jumps of the force ---

SUDDEN = 6.0
"""Second difference of the force beside a jump, in its robust standard deviations."""
MOST_SUDDEN = 40
"""Most samples beside jumps in one record or average cycle, those of the largest second difference."""
MOST_IN_SAMPLES = 150
"""Most samples beside jumps in a record compared sample by sample, which has as many jumps as reversals."""
SAMPLES_PER_REVERSAL = 4
"""Samples beside the jump of a dry friction: two, and one at either end that it reaches through a filter."""


def jumps(force: Array, most: int = MOST_SUDDEN, *, closed: bool = False) -> Array:
    """Find the samples beside jumps of the force, as by dry friction at a reversal.

    Equation: |F_(i-1) - 2 F_i + F_(i+1)| where it exceeds 6 of its robust standard deviations
                                                                    Source: Hampel 1974, median deviation

    Parameters
    ----------
    force : (n,) [N]
    most : largest number of samples
    closed : whether the last sample is followed by the first, as in an average cycle

    Returns
    -------
    (n,) magnitude of the second difference at these samples [N]; 0 at all others
    """
    around = np.pad(force, 1, mode="wrap" if closed else "edge")
    bend = np.abs(np.convolve(around, (1.0, -2.0, 1.0), "valid"))
    if not closed:
        bend[[0, -1]] = 0.0
    sudden = np.flatnonzero(bend > SUDDEN * MAD_TO_SIGMA * np.median(bend))
    largest = sudden[np.argsort(-bend[sudden], kind="stable")][:most]
    found = np.zeros(force.size)
    found[largest] = bend[largest]
    return found


def jumps_in_samples(measured: Array, predicted: Array, turns: int = 0) -> Array:
    """Find the samples beside jumps in a record or in its prediction, which shows jumps that noise hides; as `jumps`.

    Parameters
    ----------
    measured, predicted : (n,) force [N]
    turns : number of reversals of the motion, with which the largest number of samples grows
    """
    most = max(MOST_IN_SAMPLES, SAMPLES_PER_REVERSAL * turns)
    return np.maximum(jumps(measured, most), jumps(predicted, most))


def jumps_in_cycles(run: Cycles, time: Array, force: Array) -> Array:
    """Find the samples beside jumps of a periodic record from its average cycle, which has little noise; as `jumps`."""
    cycle = jumps(run.mean(time, force), closed=True)
    place = run.phase(time) * cycle.size
    before = np.floor(place).astype(np.int64) % cycle.size
    return np.asarray(np.maximum(cycle[before], cycle[(before + 1) % cycle.size]))


FLANK_LATE = 0.002
"""How much later or earlier than the rod a force may turn [s]: four standard deviations of a test's own delay."""
FLANK_TO_NOISE = 8.0
"""Least size of a jump, in the noise of one sample."""


def unresolved_flanks(force: Array, turns: Sequence[int], rate: float) -> Mask:
    """Find the samples from a reversal of the rod to a jump of the force that goes most of its way within one interval.

    Its instant is chance there; a flank of several samples is evidence of the oil spring.

    Parameters
    ----------
    force : (n,) [N]
    turns : samples at which the rod turns round
    rate : sampling rate [Hz]

    Returns
    -------
    (n,) mask
    """
    found = np.zeros(force.size, dtype=np.bool_)
    noise = noise_beside_motion(force)
    reach = int(np.ceil(FLANK_LATE * rate)) + 2
    for turn in turns:
        low, high = max(turn - reach, 0), min(turn + reach + 1, force.size)
        steps = np.diff(force[low:high])
        if not steps.size:
            continue
        change, steepest = abs(float(force[high - 1] - force[low])), int(np.argmax(np.abs(steps)))
        if abs(steps[steepest]) > max(0.5 * change, FLANK_TO_NOISE * noise):
            jump = low + steepest
            found[max(min(jump, turn - 1), 0) : max(jump, turn) + 2] = True  # late or early, that is chance too
    return found


SMALL_STROKE = 0.01
"""Least stroke between two reversals at which a friction turns, as a share of the range.

Reason: of noise that is left in the motion at rest there would be more than samples; not tuned."""


def beside_unresolved_reversals(displacement: Array, travel: float, *, closed: bool = False) -> Mask:
    """Find the samples within one interval of a reversal after which the force turns within one interval.

    Where in that interval the rod reverses, its samples do not tell: a force there may have turned already, or not yet.
    The second differences of `jumps` show it only where the smooth part of the force bends less than it jumps.

    Parameters
    ----------
    displacement : (n,) cleaned [m]
    travel : of the rod from a reversal until the force has turned, 2 T0/k [m]
    closed : whether the last sample is followed by the first, as in an average cycle

    Examples
    --------
    >>> x = np.array([0.0, 1.0, 2.0, 3.0, 2.2, 1.2, 0.2])
    >>> np.flatnonzero(beside_unresolved_reversals(x, 0.5)).tolist()
    [3, 4]
    >>> np.flatnonzero(beside_unresolved_reversals(x, 2.5)).tolist()
    []
    """
    size = displacement.size
    found, x = np.zeros(size, dtype=np.bool_), displacement
    if closed:
        x = np.concatenate([x, x, x])
    for vertex, top in _vertices(x, SMALL_STROKE):
        ahead = int(np.floor(vertex)) + 1
        share = vertex + 1.0 - ahead
        gone = abs((1.0 - share) * float(x[ahead]) + share * float(x[ahead + 1]) - top)
        if gone > travel:
            beside = np.arange(int(np.ceil(vertex - 1.0)), int(np.floor(vertex + 1.0)) + 1)
            found[beside % size if closed else beside] = True
    return found


def _vertices(x: Array, share: float) -> Iterator[tuple[float, float]]:
    """Yield where a motion (n,) reverses, between strokes of a share of its range: by the parabola through samples."""
    for turn in reversals(x, share):
        if 2 <= turn < x.size - 2:
            before, at, after = (float(x[turn + i]) for i in (-1, 0, 1))
            bend = before - 2.0 * at + after
            vertex = turn + float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend else float(turn)
            yield vertex, at - 0.125 * (before - after) ** 2 / bend if bend else at


NOISE_TO_TURN = 4.0
"""Way from a reversal, in the noise that is left in the motion, within which the samples do not tell its direction.

Reason: that noise is told up to two times too small (`displacement_error_of`); two of its standard deviations."""


def hidden_direction(displacement: Array, noise: float) -> Mask:
    """Find the samples at which noise of the displacement hides which way the rod goes.

    These are near a reversal, and wherever the rod seems to go back by less than noise can do. A friction there pushes
    either way. Behind an oil spring that gives by more it hardly matters: the force of so short a way is small.

    Parameters
    ----------
    displacement : (n,) cleaned [m]
    noise : r.m.s. that is left in it [m]

    Examples
    --------
    >>> x = np.array([0.0, 1.0, 0.9, 2.0, 2.8, 3.0, 2.8, 2.0, 1.0, 0.0])
    >>> np.flatnonzero(hidden_direction(x, 0.1)).tolist()
    [2, 4, 5, 6]
    """
    hidden, within = np.zeros(displacement.size, dtype=np.bool_), NOISE_TO_TURN * noise
    travel = float(np.ptp(displacement))
    if not 0.0 < within < travel:
        return hidden
    share = max(SMALL_STROKE, within / travel)
    for vertex, top in _vertices(displacement, share):
        turn = round(vertex)
        far = np.abs(displacement - top) >= within
        low = turn - int(np.argmax(np.append(far[turn::-1], True)))
        high = turn + int(np.argmax(np.append(far[turn:], True)))
        if high - low > 2:  # a sample at the vertex alone is hidden by no noise
            hidden[low + 1 : high] = True
    for stroke in np.split(np.arange(displacement.size), reversals(displacement, share)):
        forward = np.sign(displacement[stroke[-1]] - displacement[stroke[0]]) * displacement[stroke]
        hidden[stroke] |= forward < np.maximum.accumulate(forward)
    return hidden


def jump_timing_error(measured: Array, predicted: Array, *, closed: bool = False) -> Array:
    """Compute the part (n,) of the residual that a jump up to one sample earlier or later than predicted explains [N].

    Only where the record jumps as well, by half of the predicted change from one sample to the next: a flank that it
    resolves is not a matter of timing.

    Parameters
    ----------
    measured : (n,) force [N]
    predicted : (n,) force [N]
    closed : whether the last sample is followed by the first, as in whole cycles
    """
    around, beside = (_neighbours(force, "wrap" if closed else "edge") for force in (predicted, measured))
    low, high = around.min(axis=0), around.max(axis=0)
    step = np.abs(np.diff(beside, axis=0)).max(axis=0)
    return np.asarray(np.where(step >= 0.5 * (high - low), np.clip(measured, low, high) - predicted, 0.0))


def _neighbours(force: Array, beyond: Literal["edge", "wrap"]) -> Array:
    """Return the force one sample before, at, and after each sample (3, n), with the ends continued."""
    padded = np.pad(force, 1, mode=beyond)
    return np.stack([padded[:-2], force, padded[2:]])


# --- Gaps ---


def split_at_gaps(values: Array, counted: Mask) -> list[Array]:
    """Split values (m,) or (m, p) of a record where samples are left out.

    Parameters
    ----------
    values : at the m samples that count
    counted : (n,) which samples of the record these are
    """
    ends = np.flatnonzero(np.diff(np.flatnonzero(counted)) > 1) + 1
    return np.split(values, ends)


def gradient_within_stretches(values: Array, counted: Mask) -> Array:
    """Compute central differences (m,) within each stretch without gap; 0 for an isolated sample.

    Parameters
    ----------
    values : (m,) at the samples that count
    counted : (n,) which samples of the record these are
    """
    parts = split_at_gaps(values, counted)
    return np.concatenate([np.gradient(part) if part.size > 1 else np.zeros(part.size) for part in parts])


def has_predecessors(counted: Mask, memory: int) -> Mask:
    """Find the counted samples, but for the first few, that have so many predecessors without a gap.

    Parameters
    ----------
    counted : (n,) which samples of a record count
    memory : number of predecessors

    Returns
    -------
    (m - memory,) mask over the counted samples from number `memory` on
    """
    run = np.convolve(counted, np.ones(memory + 1, dtype=np.int64))[: counted.size]
    return np.asarray(run[counted][memory:] == memory + 1)


# --- Steps of a control signal ---
#
# Noise of the recorded signal is not the valve's, and a law that follows it steps in the force wherever the noise
# turns. A constant level and a ramp are lines; what is curved stays as recorded.

FEWEST_FOR_LINE = 10
"""Fewest samples of a stretch that is compared with a line."""
LINE_TO_NOISE = 1.5
"""Largest r.m.s. of a stretch about its line, in the noise of one sample, at which it is that line."""


def denoised_control(values: Array) -> Array:
    """Remove the noise from the levels and ramps of a control signal.

    Parameters
    ----------
    values : (n,) of a signal of steps, levels and ramps [any unit]

    Returns
    -------
    (n,) a least-squares line for each stretch between two steps that is a line but for noise; the rest unchanged
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
            centred = part - part.mean()
            line = np.polyval(np.polyfit(centred, values[part], 1), centred)
            if np.sqrt(np.mean((values[part] - line) ** 2)) <= LINE_TO_NOISE * scatter / np.sqrt(2.0):
                found[part] = line
    return found
