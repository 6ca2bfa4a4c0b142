"""What a test must satisfy to be believed at all; a test that does not is refused.

Everything milder is a finding of the preflight.
"""

from __future__ import annotations

import numpy as np

from pzd.quantities import DISPLACEMENT, FORCE, TIME, VELOCITY
from pzd.record import Array
from pzd.rig.files.reading import Test, standstills

LONGEST_STROKE = 1.0
"""Largest stroke, end to end [m]; more is most often millimetres read as metres."""
HIGHEST_SPEED = 10.0
"""Largest speed [m/s]."""
LEAST_REVERSALS = 2
REVERSAL_SHARE = 0.1
"""A reversal counts where the motion then goes back by more than this share of the range."""


def faults(test: Test) -> list[str]:
    """Why the motion and the channels of a test cannot be believed, each with file and line.

    Parameters
    ----------
    test : one test in SI, as recorded

    Returns
    -------
    one line a fault, empty where there is none
    """
    time, x, force = test.channels[TIME], test.channels[DISPLACEMENT], test.channels[FORCE]
    if time.size < 2:
        return [f"{test.place(0)}: only one data row"]
    backwards = standstills(time, test.place)
    still = [
        f"{test.place(0)}: {quantity.name} is constant over the whole test (got {values[0]:.6g} {quantity.unit})"
        for quantity, values in ((DISPLACEMENT, x), (FORCE, force))
        if np.ptp(values) <= 1e-12 * np.abs(values).max()
    ]
    if backwards or still:
        return backwards + still
    return _too_large(test) + _too_few(test, x)


def _too_large(test: Test) -> list[str]:
    time, x = test.channels[TIME], test.channels[DISPLACEMENT]
    found: list[str] = []
    if np.ptp(x) > LONGEST_STROKE:
        row = int(np.argmax(np.abs(x - x[0])))
        found.append(
            f"{test.place(row)}: a stroke of {np.ptp(x):.4g} m, above {LONGEST_STROKE:g} m; are these millimetres?"
        )
    slope = _slope(time, x)
    speeds = [(slope, "displacement over time gives")]
    if VELOCITY in test.channels:
        speeds.append((_despiked(test.channels[VELOCITY]), "velocity reads"))
    for speed, what in speeds:
        row = int(np.argmax(np.abs(speed)))
        if abs(speed[row]) > HIGHEST_SPEED:
            found.append(
                f"{test.place(row)}: {what} {abs(speed[row]):.4g} m/s, above {HIGHEST_SPEED:g} m/s; check the units"
            )
    return found


def _slope(time: Array, x: Array) -> Array:
    """Speed over four samples, blind to spikes of one or two."""
    if time.size < 6:
        return np.gradient(x, time)
    clean = _despiked(x)
    step = float(np.median(np.diff(time)))
    span = np.maximum(time[4:] - time[:-4], 4.0 * step)
    return np.pad((clean[4:] - clean[:-4]) / span, 2, mode="edge")


def _despiked(x: Array) -> Array:
    """Running median of five samples."""
    if x.size < 5:
        return x
    middle = np.median(np.lib.stride_tricks.sliding_window_view(x, 5), axis=1)
    return np.concatenate((middle[:1], middle[:1], middle, middle[-1:], middle[-1:]))


def _too_few(test: Test, x: Array) -> list[str]:
    count = reversals(x)
    if count >= LEAST_REVERSALS:
        return []
    wanted = f"{LEAST_REVERSALS} reversals larger than {REVERSAL_SHARE:.0%} of its range"
    return [f"{test.place(0)}: the displacement needs {wanted} (got {count})"]


def reversals(x: Array) -> int:
    """Number of turning points after which the motion goes back by more than 10 % of its range."""
    threshold = REVERSAL_SHARE * float(np.ptp(x))
    count, direction, extreme, low, high = 0, 0, float(x[0]), float(x[0]), float(x[0])
    for value in _extremes(x):
        if direction == 0:
            low, high = min(low, value), max(high, value)
            if high - low > threshold:
                direction, extreme = (1, high) if value == high else (-1, low)
        elif (value - extreme) * direction > 0.0:
            extreme = value
        elif (extreme - value) * direction > threshold:
            count, direction, extreme = count + 1, -direction, value
    return count


def _extremes(x: Array) -> list[float]:
    """Turning points of the samples, thinned to the extremes of short blocks in long records."""
    block = max(x.size // 20_000, 1)
    if block > 1:
        whole = x[: x.size // block * block].reshape(-1, block)
        order = np.sort(np.stack((whole.argmin(axis=1), whole.argmax(axis=1)), axis=1), axis=1)
        x = np.concatenate((np.take_along_axis(whole, order, axis=1).ravel(), x[whole.size :]))
    turns: list[float] = x.tolist()
    return turns


def sign_faults(test: Test, x: Array, force: Array) -> list[str]:
    """Negative work of the whole test, unless only a steady force over a net displacement makes it negative.

    Parameters
    ----------
    test : the test, for its place
    x : (n,) displacement of the damper [m]
    force : (n,) force of the damper, tare and inertia of a known fixture taken out [N]
    """
    work, without_mean = work_done(x, force), work_done(x, force - force.mean())
    if work >= 0.0 or without_mean >= 0.0:
        return []
    what = f"the damper does work on the rig over the whole test, {work:.4g} J"
    return [f"{test.place(0)}: {what}: force or displacement has the wrong sign; say sign: {{force: -1}}"]


def work_done(x: Array, force: Array) -> float:
    """Work that the rig does on the damper over a record [J].

    Equation: W = integral of F dx                    Source: definition, by the trapezoidal rule
    """
    return float(0.5 * np.sum((force[1:] + force[:-1]) * np.diff(x)))
