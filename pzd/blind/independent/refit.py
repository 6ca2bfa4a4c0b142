"""What of a hidden law can be seen: what the best Bingham element misses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.blind.independent.bingham import Base
from pzd.blind.independent.kernel import Parameters, integrated
from pzd.blind.independent.stand import Driven
from pzd.record import SAME_TEMPERATURE, Array

PLAIN = Parameters()
"""Nothing but T0, C and k."""
OTHER_DAMPING = 0.7
"""Where force over speed asks for another damping by so much [logarithm], the search starts there too.

Reason: a factor of two. Behind a relief valve that is always open it is C_r, far from C, and the search stays at C."""

_ASTRAY = 10.0  # shares of the peak, beyond which a search has gone astray


def gap_after_refit(
    motions: Sequence[Driven],
    forces: Sequence[Array],
    base: Base,
    known: Parameters = PLAIN,
    temperatures: Sequence[float] | None = None,
) -> float:
    """What T0, C and k cannot follow of noise-free tests, refitted at every constant value of the control signal.

    Equation: min sqrt(mean ((F - F_sim)/F_peak)^2), F_peak of each test; where the signal moves, the refitted ones are
    interpolated

    Parameters
    ----------
    motions : every test
    forces : of each, at every second instant of its grid [N]
    base : where the search starts
    known : laws that the search takes as they are
    temperatures : of each test [degC]; tests of other temperatures have T0, C and k of their own. None: all alike

    Returns
    -------
    share of the peak force
    """
    values, start = base.values, (base.T0, base.C, base.k)
    found = [np.array(row, dtype=float) for row in start]
    squares = count = 0.0
    tests = list(zip(motions, forces, strict=True))
    for i, value in enumerate(values):
        for band in _bands([None] * len(tests) if temperatures is None else temperatures):
            own = [tests[j] for j in band if _stands_at(tests[j][0], value)]
            if not own:
                continue
            z, left = _refitted(own, start, i, known)
            squares, count = squares + float(left @ left), count + left.size
            for row, first, change in zip(found, start, z, strict=True):
                row[i] = first[i] * np.exp(change)
    for m, f in tests:
        if m.test.signal != "constant":
            T0, C, k = (np.asarray(np.interp(m.signal, values, row)) for row in found)
            missed = _missed(m, f, (T0, C, k), known)
            squares, count = squares + float(missed @ missed), count + missed.size
    return float(np.sqrt(squares / count))


def _stands_at(motion: Driven, value: float) -> bool:
    return motion.test.signal == "constant" and motion.test.value == value


def _bands(temperatures: Sequence[float | None]) -> list[list[int]]:
    """Places of the tests that count as of one temperature."""
    bands: list[list[int]] = []
    for j in sorted(range(len(temperatures)), key=lambda j: temperatures[j] or 0.0):
        if bands and (temperatures[j] or 0.0) - (temperatures[bands[-1][0]] or 0.0) <= SAME_TEMPERATURE:
            bands[-1].append(j)
        else:
            bands.append([j])
    return bands


def _refitted(
    own: Sequence[tuple[Driven, Array]], start: tuple[Sequence[float], ...], i: int, known: Parameters
) -> tuple[Array, Array]:
    """(3,) logarithms of how much T0, C and k change, and (n,) what is missed then: the better of two searches."""
    from scipy.optimize import least_squares

    def missed_by(z: Array) -> Array:
        missed = np.concatenate([_missed(m, f, _constant(m, start, i, z), known) for m, f in own])
        return np.asarray(np.nan_to_num(np.clip(missed, -_ASTRAY, _ASTRAY), nan=_ASTRAY))

    low, high = np.array([-6.0, -3.0, -3.0]), np.array([3.0, 3.0, 3.0])
    friction, damping = _line_through(own)
    step = float(own[0][0].time[2] - own[0][0].time[0])
    stiffness = min(start[2][i], damping / step)  # the integration follows C/k of a step and more
    line = np.clip(np.log([friction / start[0][i], damping / start[1][i], stiffness / start[2][i]]), low, high)
    starts = [np.zeros(3)] if abs(line[1]) < OTHER_DAMPING else [np.zeros(3), line]
    fits = [
        least_squares(missed_by, at, bounds=(low, high), max_nfev=12, diff_step=np.full(3, 1e-3), xtol=1e-3, ftol=1e-3)
        for at in starts
    ]
    best = min(fits, key=lambda fit: fit.cost)
    return np.asarray(best.x), np.asarray(best.fun)


def _line_through(own: Sequence[tuple[Driven, Array]]) -> tuple[float, float]:
    """T0 [N] and C [N s/m] of a straight line through force over speed, where it is fast."""
    speed, force = np.concatenate([m.velocity[::2] for m, _ in own]), np.concatenate([f for _, f in own])
    fast = (np.abs(speed) > 0.3 * np.max(np.abs(speed))) & (speed * force > 0.0)
    C, T0 = np.polyfit(np.abs(speed[fast]), np.abs(force[fast]), 1)
    return max(float(T0), 1e-3), max(float(C), 1e-3)


def _constant(motion: Driven, start: tuple[Sequence[float], ...], i: int, z: Array) -> tuple[Array, Array, Array]:
    T0, C, k = (np.full_like(motion.time, row[i] * np.exp(one)) for row, one in zip(start, z, strict=True))
    return T0, C, k


def _missed(motion: Driven, force: Array, base: tuple[Array, Array, Array], known: Parameters) -> Array:
    """(n,) what is missed while the test is recorded, as a share of its peak; at most some 2000 samples of it."""
    kinematics = (motion.displacement, motion.velocity, motion.acceleration)
    simulated = integrated(motion.time, kinematics, base, known)
    kept = motion.time[::2] >= 0.0
    every = max(1, int(np.count_nonzero(kept)) // 2000)
    return np.asarray(((force - simulated) / np.max(np.abs(force)))[kept][::every])
