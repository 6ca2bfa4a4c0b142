"""How well a fit knows the parameters of effects: by the noise, and by how far the tests disagree."""

from __future__ import annotations

import numpy as np

from pzd.diagnose.fit.least_squares import Fitted
from pzd.record import Array

LEVEL = 1.96
"""Standard errors in a 95 % interval."""
SILENT = 1e-6
"""A test that leaves less than this share of its own pull on a parameter to chance says nothing of disagreement."""


def standard_errors(fitted: Fitted) -> Array:
    """(e,) of the effect parameters in their own units, wider where the fit leaves more than noise or tests disagree.

    Equation: s_j^2 = C_jj max(1, |r|^2 / (n - p), R_j)             Source: Birge 1932, Phys. Rev. 40, 207
    """
    freedom = max(fitted.size - fitted.searched.size, 1)
    count = len(fitted.unknowns)
    variance = np.diag(fitted.covariance)[-count:] if count else np.zeros(0)
    wider = np.maximum(disagreement(fitted), max(1.0, fitted.misfit / freedom))
    searched = fitted.searched[fitted.searched.size - count :]
    slopes = np.array([u.slope(float(x)) for u, x in zip(fitted.unknowns, searched, strict=True)])
    errors: Array = np.abs(slopes) * np.sqrt(variance * wider)
    return errors


def disagreement(fitted: Fitted) -> Array:
    """(e,) how far the tests pull the effect parameters apart, over what noise alone lets them: about one.

    Equation: R = sum_t c_t^2 / sum_t var c_t, c_t = C J_t' r_t, var c_t = C J_t' (I - J_t C J_t') J_t C
                        Source: cluster-robust variance over its expectation; Bell and McCaffrey 2002, Surv. Meth. 28
    """
    first = fitted.searched.size - len(fitted.unknowns)
    covariance = np.where(np.isfinite(fitted.covariance), fitted.covariance, 0.0)
    ends = np.cumsum([r.size for r in fitted.residuals])[:-1]
    pulled, allowed = np.zeros(len(fitted.unknowns)), np.zeros(len(fitted.unknowns))
    for slopes, residual in zip(np.split(fitted.slopes, ends), fitted.residuals, strict=True):
        pull = slopes @ covariance[:, first:]
        own, shared = np.sum(pull**2, axis=0), slopes.T @ pull
        chance = own - np.sum(shared * (covariance @ shared), axis=0)
        counts = chance > SILENT * own
        pulled += np.where(counts, (residual @ pull) ** 2, 0.0)
        allowed += np.where(counts, chance, 0.0)
    return np.where(allowed > 0.0, pulled / np.where(allowed > 0.0, allowed, 1.0), 1.0)
