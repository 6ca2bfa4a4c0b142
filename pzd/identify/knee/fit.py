"""The knee law by least squares: criterion (4) over the tests of a condition, gas force and spring solved inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pzd.identify.knee.curve import BINGHAM, KneeCurve, KneeForm
from pzd.identify.knee.data import Tests
from pzd.identify.knee.starts import start_of
from pzd.identify.misfit import VISIBLE
from pzd.record import Array
from pzd.signals.criterion import criterion
from pzd.signals.root_mean_square import rms

DIFFERENCE = 1e-5
"""Step of the search coordinates for a slope."""
EVALUATIONS = 60
"""Most simulations with slopes of one descent."""
REFIT = 12
"""The same without a test: it begins at the optimum of all tests, and one of them moves that little."""
TOLERANCE = 1e-5
"""Tolerance of the least squares, relative, on parameters and criterion: far below any interval."""
GLANCE = 4
"""Evaluations after which a straight line that would do as well as a knee is near it."""
NEAREST_KNEE = 0.01
"""Least knee speed of the search, as a share of the fastest: below, the oil spring decides on the force."""
SLOPES = (1e-3, 1e3)
"""Smallest and largest slope of the search, in peak force over peak speed."""
SPRINGS = (1e-1, 1e5)
"""Smallest and largest k of the search, in peak force over the range of displacement."""


@dataclass(frozen=True, eq=False)
class KneeFit:
    """An optimum of criterion (4)."""

    form: KneeForm
    curve: KneeCurve
    gas: Array
    """(2,) F_0 at mid-stroke [N] and k_g [N/m]."""
    residuals: Array
    """(N,) measured less simulated force [N]."""
    slopes: Array
    """(N, p + 2) derivatives of the force by the natural parameters of the form, by F_0 and by k_g."""
    criterion: float

    def predicted(self, tests: Tests) -> Array:
        """(N,) force of other tests of the damper [N]."""
        return tests.simulated(self.curve, self.gas) + tests.of_gas @ self.gas


def fit_knee(tests: Tests, stiffness: float) -> KneeFit:
    """The knee law of a condition; a direction has a knee where a straight line would visibly do worse.

    Parameters
    ----------
    tests : of the condition
    stiffness : of the oil spring where the search begins [N/m]
    """
    best = descend(tests, KneeForm(), *start_of(tests, stiffness))
    for way in best.form.ways:
        bent = tuple(each and other != way for other, each in enumerate(best.form.bent))
        form = KneeForm(bent=(bent[0], bent[1]))
        straight = descend(tests, form, best.curve, best.gas, GLANCE)
        if not _bends(tests, best, straight):
            best = descend(tests, form, straight.curve, straight.gas)
    return best


def fit_bingham(tests: Tests, start: KneeFit) -> KneeFit:
    """One T0 and C beside the same gas force, gas spring and oil spring: what the knee law is held against."""
    slope = 0.25 * sum((*start.curve.bleed, *start.curve.blow_off))
    begin = start.curve._replace(bleed=(slope, slope))
    return descend(tests, BINGHAM, begin, start.gas)


def _bends(tests: Tests, bent: KneeFit, straight: KneeFit) -> bool:
    """Whether the knee takes visibly more off the residual than a straight line."""
    gained = rms(straight.residuals) ** 2 - rms(bent.residuals) ** 2
    return gained > (VISIBLE * tests.peak) ** 2


def descend(tests: Tests, form: KneeForm, start: KneeCurve, gas: Array, evaluations: int = EVALUATIONS) -> KneeFit:
    """The optimum reached from a curve, by trust-region least squares within bounds.

    Equation: min over the curve of |P (F - F_sim)|^2, P what F_0 and k_g cannot make up
                                                        Source: Golub and Pereyra 1973, variable projection

    Parameters
    ----------
    tests : to be met
    form : which parameters are free
    start : where the search begins; what the form does not free is not looked at
    gas : (2,) F_0 and k_g with which the warm-up of a test begins; it is not counted
    evaluations : at most
    """
    from scipy.optimize import least_squares

    basis, _ = np.linalg.qr(tests.of_gas)
    norm, peak = float(np.linalg.norm(tests.measured)), tests.peak

    def without_gas(values: Array) -> Array:
        return np.asarray(values - basis @ (basis.T @ values))

    def simulated(x: Array) -> Array:
        return tests.simulated(form.found(x, peak), gas)

    def residuals(x: Array) -> Array:
        return without_gas(tests.measured - simulated(x)) / norm

    def slopes(x: Array) -> Array:
        at = simulated(x)
        steps = DIFFERENCE * np.eye(x.size)
        return without_gas(-np.column_stack([(simulated(x + step) - at) / DIFFERENCE for step in steps])) / norm

    low, high = _bounds(tests, form)
    begin = np.clip(form.searched(start, peak), low + 1e-6, high - 1e-6)
    found = least_squares(
        residuals,
        begin,
        jac=slopes,
        bounds=(low, high),
        x_scale="jac",
        xtol=TOLERANCE,
        ftol=TOLERANCE,
        gtol=TOLERANCE,
        max_nfev=evaluations,
    )
    curve = form.found(found.x, peak)
    left = tests.measured - tests.simulated(curve, gas)
    beside = np.asarray(np.linalg.lstsq(tests.of_gas, left, rcond=None)[0])
    left = left - tests.of_gas @ beside
    return KneeFit(form, curve, beside, left, _slopes(tests, form, curve, beside), criterion(left, tests.measured))


def _bounds(tests: Tests, form: KneeForm) -> tuple[Array, Array]:
    """(p,) bounds of the search coordinates."""
    unit = tests.peak / tests.fastest
    stroke = 2.0 * max(float(np.max(np.abs(t.motion.displacement))) for t in tests.tests)
    slope = [np.log(share * unit) for share in SLOPES]
    spring = [np.log(share * tests.peak / stroke) for share in SPRINGS]
    knee = [np.log(NEAREST_KNEE * tests.fastest), np.log(tests.fastest)]
    bleeds = 1 if form.alike else 2
    pairs = [[0.0, 1.0], *[slope] * bleeds, spring, *[knee, slope] * len(form.ways)]
    return np.array([low for low, _ in pairs]), np.array([high for _, high in pairs])


def _slopes(tests: Tests, form: KneeForm, curve: KneeCurve, gas: Array) -> Array:
    """(N, p + 2) derivatives of the force by the natural parameters, F_0 and k_g."""
    natural = form.natural(curve)
    steps = DIFFERENCE * np.where(natural > 0.0, natural, tests.peak)
    at = tests.simulated(curve, gas)
    moved = [
        (tests.simulated(form.curve(natural + step * unit), gas) - at) / step
        for step, unit in zip(steps, np.eye(natural.size), strict=True)
    ]
    return np.column_stack([*moved, tests.of_gas])
