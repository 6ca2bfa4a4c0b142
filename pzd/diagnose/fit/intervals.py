"""How well a fit knows T0, C, k and the effects: by noise and sensors, and by how far the tests disagree."""

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
    of_effects = slice(fitted.searched.size - len(fitted.unknowns), fitted.searched.size)
    searched = fitted.searched[of_effects]
    slopes = np.array([u.slope(float(x)) for u, x in zip(fitted.unknowns, searched, strict=True)])
    errors: Array = np.abs(slopes) * _searched_errors(fitted, of_effects)
    return errors


def base_half_widths(fitted: Fitted, force: float) -> Array:
    """(b, 3) half widths of the 95 % intervals of T0, C and k of every base row, the effects free beside them.

    Equation: 1.96 s, s as in `standard_errors`; of C and k from that of their logarithm, to first order

    Parameters
    ----------
    fitted : the optimum
    force : unit of T0 in the search [N]
    """
    of_base = slice(0, fitted.searched.size - len(fitted.unknowns))
    units = np.array([(force, row.C_Ns_per_m, row.k_N_per_m) for row in fitted.damper.base])
    widths: Array = LEVEL * _searched_errors(fitted, of_base).reshape(-1, 3) * units
    return widths


def _searched_errors(fitted: Fitted, of: slice) -> Array:
    """Standard errors of some of what was searched, in the units of the search."""
    freedom = max(fitted.size - fitted.searched.size, 1)
    wider = np.maximum(disagreement(fitted, of), max(1.0, fitted.misfit / freedom))
    errors: Array = np.sqrt(np.diag(fitted.covariance)[of] * wider)
    return errors


def disagreement(fitted: Fitted, of: slice) -> Array:
    """How far the tests pull some of the parameters apart, over what noise alone lets them: about one.

    Equation: R = sum_t c_t^2 / sum_t var c_t, c_t = C J_t' r_t, var c_t = C J_t' (I - J_t C J_t') J_t C
                        Source: cluster-robust variance over its expectation; Bell and McCaffrey 2002, Surv. Meth. 28
    """
    covariance = np.where(np.isfinite(fitted.covariance), fitted.covariance, 0.0)
    ends = np.cumsum([r.size for r in fitted.residuals])[:-1]
    pulled, allowed = np.zeros(of.stop - of.start), np.zeros(of.stop - of.start)
    for slopes, residual in zip(np.split(fitted.slopes.dense(), ends), fitted.residuals, strict=True):
        pull = slopes @ covariance[:, of]
        own, shared = np.sum(pull**2, axis=0), slopes.T @ pull
        chance = own - np.sum(shared * (covariance @ shared), axis=0)
        counts = chance > SILENT * own
        pulled += np.where(counts, (residual @ pull) ** 2, 0.0)
        allowed += np.where(counts, chance, 0.0)
    return np.where(allowed > 0.0, pulled / np.where(allowed > 0.0, allowed, 1.0), 1.0)
