"""Covariance of a least-squares estimate, how far tests disagree about it, and quantiles of its intervals.

Two weights of the one least squares need two covariances. Where residuals are in units of noise (diagnose, changes) it
is the inverse of the normal matrix, wider by what the fit leaves and by what tests disagree. By criterion (4), where
samples weigh alike whatever their noise (identify), it is the sandwich of `pzd.identification.intervals`, whose outer
factors are the same inverse.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.record import Array

CONFIDENCE = 0.95
"""Probability that an interval holds the true value, unless another one is asked for."""
LEVEL = 1.96
"""Half width of such an interval in standard errors, where these are known: `CONFIDENCE` of the normal distribution."""
SINGULAR = 1e-13
"""Eigenvalue of a normal matrix scaled to a unit diagonal, relative to the largest, below which it shows no direction.

Reason: rounding in the sums of squares of some thousand samples (1e-16 each) goes so far."""
UNINFORMATIVE = 1e-6
"""Share of chance in a test's pull on a parameter, below which the test says nothing of disagreement."""


def inverse_normal(normal: Array) -> Array:
    """Compute the generalised inverse (p, p) of a normal matrix J' J, whatever the units of the parameters.

    Examples
    --------
    >>> inverse_normal(np.diag([4.0, 0.0, 0.25])).diagonal().tolist()
    [0.25, 0.0, 4.0]
    """
    size = np.sqrt(np.diag(normal))
    size = np.where(size > 0.0, size, 1.0)
    scale = np.outer(size, size)
    return np.asarray(np.linalg.pinv(normal / scale, rcond=SINGULAR, hermitian=True) / scale)


def covariance(jacobian: Array) -> Array:
    """Compute the covariance (p, p) of the variables from (n, p) derivatives of residuals in units of noise.

    Infinite where no residual shows a variable.

    Equation: (J' J)^-1
    """
    normal = jacobian.T @ jacobian
    found, unseen = inverse_normal(normal), np.diag(normal) == 0.0
    found[unseen, unseen] = np.inf
    return found


def disagreement(slopes: Sequence[Array], residuals: Sequence[Array], whole: Array, of: slice = slice(None)) -> Array:
    """Compute how far the tests pull some parameters apart, relative to what noise alone lets them: about one.

    Equation: R = sum_t c_t^2 / sum_t var c_t, c_t = C J_t' r_t, var c_t = C J_t' (I - J_t C J_t') J_t C
                        Source: cluster-robust variance over its expectation; Bell and McCaffrey 2002, Surv. Meth. 28

    Parameters
    ----------
    slopes, residuals : (n, p) and (n,) of each test, in units of noise
    whole : (p, p) their covariance C, which may be infinite
    of : the parameters asked for
    """
    known = np.where(np.isfinite(whole), whole, 0.0)
    pulled, allowed = np.zeros(known[of].shape[0]), np.zeros(known[of].shape[0])
    for own, residual in zip(slopes, residuals, strict=True):
        pull = own @ known[:, of]
        alone, shared = np.sum(pull**2, axis=0), own.T @ pull
        chance = alone - np.sum(shared * (known @ shared), axis=0)
        counts = chance > UNINFORMATIVE * alone
        pulled += np.where(counts, (residual @ pull) ** 2, 0.0)
        allowed += np.where(counts, chance, 0.0)
    return np.where(allowed > 0.0, pulled / np.where(allowed > 0.0, allowed, 1.0), 1.0)


def between_tests(
    slopes: Sequence[Array], residuals: Sequence[Array], of: int, beforehand: Array
) -> tuple[float, float]:
    """Compute by how much a parameter differs from test to test, and how likely it is that chance alone makes it so.

    Each test has a value of its own, all else is common to them.

    Equation: Q = (x - m)' W (x - m), m = 1' W x / 1' W 1, W the weight matrix of the n values x, all else free;
    s^2 = (Q - (n - 1)) / (tr W - 1' W W 1 / 1' W 1)
            Source: Cochran 1954, Biometrics 10, 101; DerSimonian and Laird 1986, Controlled Clinical Trials 7, 177

    Parameters
    ----------
    slopes, residuals : (n, p) and (n,) of each test at the optimum, in units of noise
    of : the parameter
    beforehand : (q, p) slopes of what is known of the parameters beforehand

    Returns
    -------
    standard deviation of the parameter between tests, and the probability of as much by noise; 0 and 1 where fewer
    than two tests show it

    Examples
    --------
    Three tests with ten times as much noise-free slope, of which one stands apart:

    >>> slopes, residuals = [np.array([[10.0]])] * 3, [np.array([x]) for x in (-10.0, 0.0, 10.0)]
    >>> spread, chance = between_tests(slopes, residuals, 0, np.zeros((0, 1)))
    >>> round(spread, 2), chance < 1e-40
    (0.99, True)
    """
    from scipy.special import chdtrc

    whole, left = np.concatenate([*slopes, beforehand]), np.concatenate([*residuals, np.zeros(len(beforehand))])
    tests = [i for i, own in enumerate(slopes) if np.any(own[:, of])]
    own = np.zeros((len(left), len(tests)))
    ends = np.cumsum([0, *(len(each) for each in slopes)])
    for column, i in enumerate(tests):
        own[ends[i] : ends[i + 1], column] = slopes[i][:, of]
    common = np.delete(whole, of, axis=1)
    values = np.column_stack([own, left])
    free = values - common @ np.linalg.lstsq(common, values, rcond=SINGULAR)[0]
    own, left = free[:, :-1], free[:, -1]
    weights = own.T @ own
    inverse = inverse_normal(weights)
    freedom = int(np.linalg.matrix_rank(inverse @ weights, tol=0.5)) - 1
    if freedom < 1:
        return 0.0, 1.0
    estimates = -inverse @ (own.T @ left)
    mean = np.sum(weights @ estimates) / np.sum(weights)
    apart = estimates - mean
    remaining = left + own @ estimates
    noise = max(1.0, float(remaining @ remaining) / max(len(left) - whole.shape[1] - freedom, 1))
    squares = float(apart @ weights @ apart) / noise
    shown = float(np.trace(weights) - np.sum(weights @ weights) / np.sum(weights)) / noise
    spread = float(np.sqrt(max(squares - freedom, 0.0) / shown))
    return spread, float(chdtrc(freedom, squares))


def widening(disagree: Array, squares: float, freedom: int) -> Array:
    """Return the factor (p,) on variances by noise alone: by what the fit leaves, or by what tests disagree.

    Equation: max(1, |r|^2 / (n - p), R_j)                                  Source: Birge 1932, Phys. Rev. 40, 207

    Parameters
    ----------
    disagree : (p,) by `disagreement`
    squares : sum of squared residuals in units of noise
    freedom : residuals less parameters
    """
    return np.maximum(disagree, max(1.0, squares / max(freedom, 1)))


def by_what_was_left_out(slopes: Array, residual: Array, others: Array, sizes: Array) -> Array:
    """Return the variance (p,) of estimates by one parameter more that was taken to be 0, of those the worst for each.

    What was left out for being small is not nothing: the estimates take up what of it looks like theirs. That it is so
    large and no larger is its prior, and the residual tells the rest.

    Equation: max_o (b_o b_o) E[o^2], b_o = (J' J)^-1 J' j_o, E[o^2] = v + (v j' r)^2, v = 1 / (1/s_o^2 + j' j),
    j what of j_o no estimate takes up                      Source: omitted variables; posterior of a normal prior

    Parameters
    ----------
    slopes : (n, p) J of the estimates, in units of noise
    residual : (n,) r
    others : (n, o) of the parameters that were left out
    sizes : (o,) their standard deviations s_o beforehand

    Examples
    --------
    >>> one, other = np.array([[1.0], [0.0]]), np.array([[1.0], [1.0]])
    >>> by_what_was_left_out(one, np.zeros(2), other, np.array([1.0]))
    array([0.5])
    """
    taken = np.linalg.lstsq(slopes, others, rcond=SINGULAR)[0]
    own = others - slopes @ taken
    # At what two columns agree to by rounding, nothing of the other one is its own.
    own = np.where(np.sum(own**2, axis=0) > SINGULAR * np.sum(others**2, axis=0), own, 0.0)
    shown = np.sum(own**2, axis=0)
    variance = np.asarray(sizes) ** 2 / (1.0 + np.asarray(sizes) ** 2 * shown)
    second = variance + (variance * (residual @ own)) ** 2
    return np.asarray(np.max(taken**2 * second, axis=1, initial=0.0))


def student_quantile(freedom: Array | float, probability: float) -> Array:
    """Return below what Student's t lies with a probability; of less than one degree of freedom that of one.

    Source: Student 1908

    Examples
    --------
    >>> student_quantile(np.inf, 0.975).round(2) == LEVEL
    np.True_
    """
    from scipy.special import stdtrit

    return np.asarray(stdtrit(np.maximum(freedom, 1.0), probability))
