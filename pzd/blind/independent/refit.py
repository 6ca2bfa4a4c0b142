"""What of a hidden law can be seen: what the best Bingham element misses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.blind.independent.bingham import Base
from pzd.blind.independent.kernel import Parameters, integrated
from pzd.blind.independent.stand import Driven
from pzd.record import Array

PLAIN = Parameters()
"""Nothing but T0, C and k."""


def gap_after_refit(motions: Sequence[Driven], forces: Sequence[Array], base: Base, known: Parameters = PLAIN) -> float:
    """What T0, C and k cannot follow of noise-free tests, refitted at every constant value of the control signal.

    Equation: min sqrt(mean ((F - F_sim)/F_peak)^2), F_peak of each test; where the signal moves, the refitted ones are
    interpolated

    Parameters
    ----------
    motions : every test
    forces : of each, at every second instant of its grid [N]
    base : where the search starts
    known : laws that the search takes as they are

    Returns
    -------
    share of the peak force
    """
    from scipy.optimize import least_squares

    values, start = base.values, (base.T0, base.C, base.k)
    found = [np.array(row, dtype=float) for row in start]
    squares = count = 0.0
    for i, value in enumerate(values):
        own = [
            (m, f)
            for m, f in zip(motions, forces, strict=True)
            if m.test.signal == "constant" and m.test.value == value
        ]
        if not own:
            continue

        def missed_by(z: Array, own: Sequence[tuple[Driven, Array]] = own, i: int = i) -> Array:
            return np.concatenate([_missed(m, f, _constant(m, start, i, z), known) for m, f in own])

        fit = least_squares(
            missed_by,
            [0.0, 0.0, 0.0],
            bounds=([-6.0, -3.0, -3.0], [3.0, 3.0, 3.0]),
            max_nfev=12,
            diff_step=np.full(3, 1e-3),
            xtol=1e-3,
            ftol=1e-3,
        )
        squares, count = squares + 2.0 * float(fit.cost), count + fit.fun.size
        for row, first, z in zip(found, start, fit.x, strict=True):
            row[i] = first[i] * np.exp(z)
    for m, f in zip(motions, forces, strict=True):
        if m.test.signal != "constant":
            T0, C, k = (np.asarray(np.interp(m.signal, values, row)) for row in found)
            missed = _missed(m, f, (T0, C, k), known)
            squares, count = squares + float(missed @ missed), count + missed.size
    return float(np.sqrt(squares / count))


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
