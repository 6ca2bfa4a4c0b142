"""What a test must satisfy to be believed at all; a test that does not is refused.

Everything milder is a finding of the preflight.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.quantities import DISPLACEMENT, FORCE, TIME, VELOCITY
from pzd.record import Array
from pzd.rig.files.splitting import Test
from pzd.schema.errors import DataError
from pzd.signals.turning_points import REVERSAL_SHARE, reversal_count

LONGEST_STROKE = 1.0
"""Largest stroke, end to end [m]; more is most often millimetres read as metres."""
HIGHEST_SPEED = 10.0
"""Largest speed [m/s]."""
LEAST_REVERSALS = 2
"""Fewer turns of the motion are no test of a damper."""


def refuse(tests: Sequence[Test]) -> None:
    """Refuse a file one of whose tests cannot be believed, whatever its fixture.

    Parameters
    ----------
    tests : the tests of the file in SI, as recorded

    Raises
    ------
    DataError : with what is wrong with the first such test, each with file and line
    """
    for test in tests:
        found = _faults(test)
        if found:
            raise DataError(found)


def _faults(test: Test) -> list[str]:
    if test.faults:
        readable = test.whole and TIME in test.channels
        return [*test.faults, *(_standstills(test) if readable else [])]
    time, x, force = test.channels[TIME], test.channels[DISPLACEMENT], test.channels[FORCE]
    if time.size < 2:
        return [f"{test.place(0)}: only one data row"]
    backwards = _standstills(test)
    still = [
        f"{test.place(0)}: {quantity.name} is constant over the whole test (got {values[0]:.6g} {quantity.unit})"
        for quantity, values in ((DISPLACEMENT, x), (FORCE, force))
        if np.ptp(values) <= 1e-12 * np.abs(values).max()
    ]
    if backwards or still:
        return backwards + still
    return _too_large(test) + _too_few(test, x)


def _standstills(test: Test) -> list[str]:
    """Where the clock stands still or goes back, in a line; empty where it goes on. NaN is another's fault."""
    time = test.channels[TIME]
    backwards = np.flatnonzero(np.diff(time) <= 0.0)
    if not backwards.size:
        return []
    row = int(backwards[0]) + 1
    more = f", and {backwards.size - 1} more such rows" if backwards.size > 1 else ""
    return [f"{test.place(row)}: time does not increase: {time[row]:.9g} s after {time[row - 1]:.9g} s{more}"]


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
    count = reversal_count(x)
    if count >= LEAST_REVERSALS:
        return []
    wanted = f"{LEAST_REVERSALS} reversals larger than {REVERSAL_SHARE:.0%} of its range"
    return [f"{test.place(0)}: the displacement needs {wanted} (got {count})"]
