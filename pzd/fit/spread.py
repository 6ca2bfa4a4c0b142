"""How far the tests of one rig differ by themselves, in units of their prior: estimated within it.

A prior allows for any stand. One that repeats its force ten times as well shows it in several tests, and what an effect
changes from test to test then counts for as much as it is worth on that stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pzd.fit.intervals import inverse_normal
from pzd.record import Array

PRIOR_WORTH = 4.0
"""Weight of the prior of a spread, in tests: so many have to repeat well before a smaller one is believed."""
SAME_SPREAD = 0.01
"""Relative change of a variance at which its estimate ends: far below what some tests can tell."""
MOST_ROUNDS = 100
"""Rounds of that estimate at most; few are needed, for the kinds hardly take each other up."""
_SPREADS = np.geomspace(1e-3, np.sqrt(1.0 + 2.0 / PRIOR_WORTH), 121)
"""Spreads over which the likelihood is integrated, in steps of 6 %: from where none is told to where their mean square
beforehand is that of the prior."""


@dataclass(frozen=True, eq=False)
class NuisanceEquations:
    """Normal equations of the nuisances of n tests, k kinds each, the parameters that the tests share eliminated."""

    normal: Array
    """(n k, n k) normal matrix, in units of the prior standard deviations and of the noise."""
    pull: Array
    """(n k,) right side."""
    kinds: int
    """k, as of offset, gain and delay."""


def nuisance_equations(own: Sequence[Array], shared: Sequence[Array], left: Sequence[Array]) -> NuisanceEquations:
    """Eliminate the shared parameters from the normal equations: they take up the gain of the only test of a level.

    Equation: r_t = J_t b + A_t z_t + noise; N = A'A - A'J (J'J)^-1 J'A, p = A'r - A'J (J'J)^-1 J'r

    Parameters
    ----------
    own : (w_t, k) A_t, change of the residuals of each test by one prior standard deviation, in units of noise
    shared : (w_t, p) J_t, change by what the tests have in common
    left : (w_t,) r_t
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
    return NuisanceEquations(normal, pull, kinds)


def estimated_spread(groups: Sequence[NuisanceEquations]) -> Array:
    """Estimate the standard deviations of what every test has of its own, as shares of their prior, 1 at most.

    A spread is as likely beforehand as few tests of the prior's own would leave it, so that two that happen to agree do
    not make it small, while many do.

    Equation: z_tk ~ N(0, u_k^2), p(u_k) ~ u_k^(n_0 - 1) with E[u_k^2] = 1; u_k^2 = min(1, E[u_k^2 | r]),
    n_0 = `PRIOR_WORTH`, the other spreads held
            Source: Harville 1974, Biometrika 61, 383, for the restricted likelihood; Gelman 2006, Bayesian Analysis 1,
            515, for priors of a spread that leave room near zero

    Parameters
    ----------
    groups : tests of one stand; the tests of a group share parameters, as those of one condition share T0, C and k

    Returns
    -------
    (k,) u

    Examples
    --------
    Forty tests whose offsets are a tenth of what the prior allows for:

    >>> offsets = np.tile([0.1, -0.1], 20)
    >>> ones = np.full((100, 1), 10.0)
    >>> tests = nuisance_equations([ones] * 40, [np.zeros((100, 1))] * 40, [ones[:, 0] * z for z in offsets])
    >>> estimated_spread([tests]).round(2)
    array([0.11])
    """
    kinds = groups[0].kinds
    variance = np.ones(kinds)
    for _ in range(MOST_ROUNDS):
        before = variance.copy()
        for kind in range(kinds):
            variance[kind] = min(_mean_square(groups, variance, kind), 1.0)
        if np.all(np.abs(variance - before) <= SAME_SPREAD * before):
            break
    return np.sqrt(variance)


def _mean_square(groups: Sequence[NuisanceEquations], variance: Array, kind: int) -> float:
    """Compute the mean square of the spread of one kind, where the variances (k,) of the others are known."""
    likelihood = np.sum([_log_likelihood(group, variance, kind) for group in groups], axis=0)
    weight = np.exp(likelihood - likelihood.max()) * _SPREADS**PRIOR_WORTH  # the steps grow with u
    return float(weight @ _SPREADS**2 / weight.sum())


def _log_likelihood(group: NuisanceEquations, variance: Array, kind: int) -> Array:
    """Compute the restricted log-likelihood of each spread of one kind, the variances (k,) of the others held.

    Equation: log L = -1/2 sum log(1 + u^2 l_i) + 1/2 sum u^2 p_i^2 / (1 + u^2 l_i), l_i eigenvalues of the normal
    matrix of this kind, what the others take up taken out
    """
    of_kind = np.arange(group.pull.size) % group.kinds
    mine, theirs = of_kind == kind, of_kind != kind
    taken = group.normal[np.ix_(mine, theirs)] @ np.linalg.inv(
        group.normal[np.ix_(theirs, theirs)] + np.diag(1.0 / variance[of_kind[theirs]])
    )
    values, vectors = np.linalg.eigh(group.normal[np.ix_(mine, mine)] - taken @ group.normal[np.ix_(theirs, mine)])
    squares = (vectors.T @ (group.pull[mine] - taken @ group.pull[theirs])) ** 2
    grown = 1.0 + np.multiply.outer(_SPREADS**2, np.maximum(values, 0.0))
    return np.asarray(0.5 * np.sum(_SPREADS[:, None] ** 2 * squares / grown - np.log(grown), axis=1))
