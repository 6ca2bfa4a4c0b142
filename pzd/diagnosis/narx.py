"""A black box to compare with: the additive NARX model (nonlinear, autoregressive, with exogenous inputs).

Law: F(t) = sum_j a_j F(t - j tau) + f0 + sum_j g_j(v(t - j tau)) + k x(t), j = 1 to n of F and 0 to n of v; the g_j
are piecewise linear, with the same knots. Without knots it is the linear ARX model. It knows nothing of a damper. Each
value of the control signal has coefficients of its own. In between, the forces of the two neighbours are interpolated:
coefficients of a recursion between those of two others mean nothing, and may be unstable where both are stable.

It is fitted one step ahead by ordinary least squares, with measured past forces. It predicts in free run, with past
forces of its own: one step ahead, F(t) = F(t - tau) would do well, and says nothing of a damper. As past forces enter
linearly, a free run is a recursive filter, whose poles say whether it diverges. Products of past forces and powers of
the speed, the terms of a polynomial NARX, are left out: they grow without end beyond the tests that were fitted.

Where a logger is fast, so few of its samples tell nothing of the motion: tau is a share of the cycle of the fastest
test, in whole samples of the slowest logger. No test is thinned out for it: every sample is fitted and predicted, from
those one tau, two tau ... before.

Sources: additive, with straight pieces: Chen and Tsay 1993, J. Am. Stat. Assoc. 88(423), 955-967; NARX in general:
Leontaritis and Billings 1985, Int. J. Control 41(2), 303-328.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import lstsq, qr
from scipy.signal import lfilter, lfiltic

from pzd.diagnosis.peers import Coefficient, StrokeMotion
from pzd.record import Array, Mask
from pzd.signals.measures import reversals

NAME = "narx"
"""In tables, as the name of a peer."""
LAGS = (1, 2)
"""Past forces n that are tried.

Reason: an element with an oil spring has one state, and a hysteresis beside it is one more."""
KNOTS = (0, 3, 7, 15, 31)
"""Knots of each function that are tried: each halves the intervals between those before.

Reason for no more: a test at a fast logger has some hundreds of samples, and the next would be 200 numbers."""
STEPS_PER_CYCLE = (40, 20, 10)
"""tau that are tried, as a share of the cycle of the fastest test.

Reason: ten samples a cycle of the highest frequency of interest (Ljung 1999, System Identification, 13.7); the force
has harmonics, hence finer ones too."""
BOUND = 10.0
"""Force at which a free run is held, in the largest measured one: it has diverged there, whatever comes after."""


class Order(NamedTuple):
    """What is chosen before the fit."""

    lags: int
    """n."""
    step: float
    """tau [s]."""
    knots: tuple[float, ...]
    """Speeds at which the g_j bend, rising [m/s]."""

    @property
    def label(self) -> str:
        """What distinguishes it from the others."""
        return f"n = {self.lags}, tau = {1e3 * self.step:.3g} ms, {len(self.knots)} knots"

    @property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """What is fitted, in the order of the columns: `v1 > 0.02` is the change of slope of g_1 at 0.02 m/s."""
        bends = ("", *(f" > {knot:.3g}" for knot in self.knots))
        return (
            *(Coefficient(f"a{j}", "-") for j in range(1, self.lags + 1)),
            Coefficient("f0", "N"),
            Coefficient("k", "N/m"),
            *(Coefficient(f"v{j}{bend}", "N s/m") for j in range(self.lags + 1) for bend in bends),
        )


def orders(motions: Sequence[StrokeMotion]) -> list[Order]:
    """Return the orders to choose from, the simplest first, for tests that move like this.

    The knots are quantiles of the speeds of all tests together, where each test weighs the same.

    Equation: tau = m h, m = max(1, round(T/(N h))), h the longest sampling interval, T the shortest mean cycle
    """
    slowest = max(motion.step for motion in motions)
    shortest = min(_mean_cycle(motion) for motion in motions)
    steps = sorted({slowest * max(1, round(shortest / (count * slowest))) for count in STEPS_PER_CYCLE})
    knots = [_quantiles([motion.velocity for motion in motions], count) for count in KNOTS]
    return [Order(lags, step, speeds) for speeds, lags, step in product(knots, LAGS, steps)]


def _mean_cycle(motion: StrokeMotion) -> float:
    """Return the mean time between every other reversal [s]; twice the test where it hardly turns round."""
    turns = reversals(motion.displacement)
    between = np.diff(turns).mean() if len(turns) > 1 else motion.displacement.size
    return 2.0 * float(between) * motion.step


def _quantiles(channels: Sequence[Array], count: int) -> tuple[float, ...]:
    """Return so many values that divide the samples of some tests in equal parts, tests weighing alike."""
    shares = np.arange(1, count + 1) / (count + 1)
    values, weights = np.concatenate(channels), np.concatenate([np.full(c.size, 1.0 / c.size) for c in channels])
    rising = np.argsort(values)
    below = np.cumsum(weights[rising]) / weights.sum()
    return tuple(float(value) for value in np.interp(shares, below, values[rising]))


def _lag(order: Order, motion: StrokeMotion) -> int:
    """Return tau in samples of a test."""
    return max(1, round(order.step / motion.step))


def _inputs(order: Order, motion: StrokeMotion) -> Array:
    """Return the (m, q) columns of f0, k and the g_j, the settling first; before it the first speed."""
    at, lag = np.arange(motion.velocity.size), _lag(order, motion)
    columns = [np.ones(at.size), motion.displacement]
    for j in range(order.lags + 1):
        speed = motion.velocity[np.maximum(at - j * lag, 0)]
        columns += [speed, *(np.maximum(speed - knot, 0.0) for knot in order.knots)]
    return np.column_stack(columns)


def triangle(order: Order, motion: StrokeMotion, force: Array, fitted: Mask) -> Array:
    """Return the triangular factor of the columns of some samples of a test, the measured force as the last column.

    Factors of several tests, one below the other, have the least squares of these tests: each test is gone through
    once, and any choice of tests is fitted at the cost of its factors.

    Equation: [Phi F] = Q R, |Phi theta - F| = |R [theta; -1]|             Source: Golub and Van Loan 2013, 5.3

    Parameters
    ----------
    order : of the model
    motion : of the test
    force : (n,) measured, without the settling [N]
    fitted : (n,) samples that may be seen, as what is fitted and as past forces alike

    Returns
    -------
    (r, p + 1) factor, r at most p + 1; no row where no sample has its past among those fitted
    """
    lag = _lag(order, motion)
    at = np.arange(min(order.lags * lag, force.size), force.size)
    at = at[np.all([fitted[at - j * lag] for j in range(order.lags + 1)], axis=0)]
    past = [force[at - j * lag] for j in range(1, order.lags + 1)]
    return joined([np.column_stack([*past, _inputs(order, motion)[motion.settling + at], force[at]])])


def joined(factors: Iterable[Array]) -> Array:
    """Return the triangular factor of several, one below the other."""
    stacked = np.concatenate(list(factors))
    if stacked.shape[0] <= stacked.shape[1]:
        return stacked
    return np.asarray(qr(stacked, mode="r", check_finite=False)[0][: stacked.shape[1]])


def fit(factor: Array) -> tuple[Array, float]:
    """Fit the coefficients by ordinary least squares, the smallest ones where several do equally well.

    Parameters
    ----------
    factor : of the tests, see `triangle`

    Returns
    -------
    (p,) coefficients in the order of `Order.coefficients`, and the sum of the squared residual one step ahead [N^2]
    """
    columns, force = factor[:, :-1], factor[:, -1]
    size = np.linalg.norm(columns, axis=0)
    size[size == 0.0] = 1.0
    theta = lstsq(columns / size, force, check_finite=False)[0] / size if force.size else np.zeros(size.size)
    residual = columns @ theta - force
    return theta, float(residual @ residual)


def free_run(order: Order, coefficients: Array, motion: StrokeMotion, first: float, bound: float) -> Array:
    """Return the (n,) force that a model gives by itself [N].

    Parameters
    ----------
    order : of the model
    coefficients : (p,) fitted
    motion : of the test, the settling first
    first : force before the first sample [N]
    bound : largest force to which a run may grow that diverges [N]
    """
    lag = _lag(order, motion)
    recursion = np.zeros(order.lags * lag + 1)
    recursion[0], recursion[lag::lag] = 1.0, -coefficients[: order.lags]
    driven = _inputs(order, motion) @ coefficients[order.lags :]
    before = lfiltic([1.0], recursion, np.full(recursion.size - 1, first))
    force = lfilter([1.0], recursion, driven, zi=before)[0][motion.settling :]
    return np.clip(np.nan_to_num(force, nan=bound, posinf=bound, neginf=-bound), -bound, bound)


def is_stable(order: Order, coefficients: Array) -> bool:
    """Whether a free run forgets how it began: all poles lie inside the unit circle.

    Equation: z^n = sum_j a_j z^(n-j), |z| < 1                                 Source: Ljung 1999, System Identification
    """
    return bool(np.all(np.abs(np.roots([1.0, *-coefficients[: order.lags]])) < 1.0))
