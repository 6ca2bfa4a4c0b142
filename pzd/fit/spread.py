"""How far the tests of one rig differ by themselves, in units of their prior: estimated within it.

A prior allows for any stand. One that repeats its force ten times as well shows it in several tests, and what an effect
changes from test to test then counts for as much as it is worth on that stand.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.fit.intervals import inverse_normal
from pzd.record import Array

PRIOR_WORTH = 4.0
"""Weight of the prior variances against what the tests show of them, in degrees of freedom."""
SAME_SPREAD = 0.01
"""Relative change of a variance at which its estimate ends: far below what some tests can tell."""
MOST_ROUNDS = 100
"""Rounds of that estimate at most; it comes nearer by a third or more in each."""


def estimated_spread(own: Sequence[Array], shared: Sequence[Array], left: Sequence[Array]) -> Array:
    """Estimate the standard deviations of what every test has of its own, as shares of their prior, 1 at most.

    What the tests have in common is free and takes up its part: a gain of the only test of a level says nothing.

    Equation: r_t = J_t b + A_t z_t + noise, z_tk ~ N(0, u_k^2); u_k^2 = min(1, (n_0 + sum_t E[z_tk^2]) / (n_0 + T)),
    n_0 = `PRIOR_WORTH`
                        Source: Henderson 1953, Biometrics 9, 226; Dempster, Laird and Rubin 1977, by restricted
                        likelihood and a prior scaled inverse chi-squared

    Parameters
    ----------
    own : (w_t, k) A_t, change of the residuals of each test by one prior standard deviation, in units of noise
    shared : (w_t, p) J_t, change by what the tests have in common
    left : (w_t,) r_t

    Returns
    -------
    (k,) u

    Examples
    --------
    Forty tests whose offsets are a tenth of what the prior allows for:

    >>> offsets = np.tile([0.1, -0.1], 20)
    >>> ones = np.full((100, 1), 10.0)
    >>> estimated_spread([ones] * 40, [np.zeros((100, 1))] * 40, [ones[:, 0] * z for z in offsets]).round(2)
    array([0.32])
    """
    count, kinds = len(own), own[0].shape[1]
    blocks = np.zeros((count, kinds, count, kinds))
    for t, A in enumerate(own):
        blocks[t, :, t, :] = A.T @ A
    across = np.concatenate([A.T @ J for A, J in zip(own, shared, strict=True)])
    common = inverse_normal(np.sum([J.T @ J for J in shared], axis=0))
    pulled = np.sum([J.T @ r for J, r in zip(shared, left, strict=True)], axis=0)
    normal = blocks.reshape(count * kinds, -1) - across @ common @ across.T
    pull = np.concatenate([A.T @ r for A, r in zip(own, left, strict=True)]) - across @ (common @ pulled)
    variance = np.ones(kinds)
    for _ in range(MOST_ROUNDS):
        scatter = np.linalg.inv(normal + np.diag(np.tile(1.0 / variance, count)))
        squares = ((scatter @ pull) ** 2 + np.diag(scatter)).reshape(count, kinds)
        before, variance = variance, np.minimum((PRIOR_WORTH + squares.sum(axis=0)) / (PRIOR_WORTH + count), 1.0)
        if np.all(np.abs(variance - before) <= SAME_SPREAD * before):
            break
    return np.sqrt(variance)
