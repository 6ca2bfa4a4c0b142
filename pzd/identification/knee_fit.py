"""The knee law by least squares: criterion (4) over the tests of a condition, gas force and spring solved inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from pzd.damper.compose import integrated_force, sampling_steps
from pzd.damper.fitted_laws.knee import NO_KNEE
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import constant_rows
from pzd.identification.prepared_record import in_motion
from pzd.identification.trust import VISIBLE
from pzd.record import Array, Mask, Record, mid_stroke
from pzd.signals.criterion import criterion, rms

# ----------------------------------------------------------------------------------------------------
# The knee law as numbers: bleed, knee and blow-off of each direction, and the coordinates in which they are searched.
#
# Equation: |F| = T0 + C w up to the speed w_k of the knee, then T0 + C w_k + B (w - w_k); C, w_k and B of each direction
#                                         Source: bleed and blow-off, Dixon 2007; element of eq. (1)-(3) with k


REBOUND, COMPRESSION = 0, 1
"""The directions, in this order wherever there are two of something."""


class KneeCurve(NamedTuple):
    """The parameters of the element; pairs are of rebound and compression."""

    friction: float
    """T0 [N]."""
    bleed: tuple[float, float]
    """C [N s/m]."""
    stiffness: float
    """k [N/m]."""
    knee_speed: tuple[float, float]
    """w_k [m/s]; infinite without a knee."""
    blow_off: tuple[float, float]
    """B [N s/m]; without a knee the bleed."""

    def knee_force(self, way: int) -> float:
        """Force at the knee of one direction [N]."""
        return self.friction + self.bleed[way] * self.knee_speed[way]

    @property
    def damping(self) -> float:
        """Mean of both bleeds [N s/m], the C of the damper's base row."""
        return 0.5 * (self.bleed[REBOUND] + self.bleed[COMPRESSION])

    def effect(self) -> dict[str, float]:
        """Parameters of the law `knee` beside T0, `damping` and k."""
        forces = [min(self.knee_force(way), NO_KNEE) for way in (REBOUND, COMPRESSION)]
        return {
            "beta": (self.bleed[REBOUND] - self.bleed[COMPRESSION]) / (2.0 * self.damping),
            "F_reb": forces[REBOUND],
            "C_reb": self.blow_off[REBOUND],
            "F_comp": forces[COMPRESSION],
            "C_comp": self.blow_off[COMPRESSION],
        }


@dataclass(frozen=True)
class KneeForm:
    """Which of the parameters are free."""

    alike: bool = False
    """Whether both directions have one bleed and no knee: the Bingham element."""
    bent: tuple[bool, bool] = (True, True)
    """Whether rebound and compression have a knee."""

    @property
    def ways(self) -> tuple[int, ...]:
        """The directions with a knee."""
        return tuple(way for way in (REBOUND, COMPRESSION) if self.bent[way])

    def natural(self, curve: KneeCurve) -> Array:
        """(p,) the free parameters in their own units: T0, the bleeds, k, then w_k and B of each knee."""
        bleeds = curve.bleed[:1] if self.alike else curve.bleed
        knees = [value for way in self.ways for value in (curve.knee_speed[way], curve.blow_off[way])]
        return np.array([curve.friction, *bleeds, curve.stiffness, *knees])

    def curve(self, natural: Array) -> KneeCurve:
        """The curve that they stand for."""
        friction, *rest = natural.tolist()
        bleed = (rest[0], rest[0]) if self.alike else (rest[0], rest[1])
        stiffness, *knees = rest[1:] if self.alike else rest[2:]
        speed, slope = [np.inf, np.inf], [*bleed]
        for place, way in enumerate(self.ways):
            speed[way], slope[way] = knees[2 * place : 2 * place + 2]
        return KneeCurve(friction, bleed, stiffness, (speed[0], speed[1]), (slope[0], slope[1]))

    def searched(self, curve: KneeCurve, force: float) -> Array:
        """(p,) what least squares searches: T0 as a share of a force [N], the logarithms of all others."""
        natural = self.natural(curve)
        return np.concatenate([natural[:1] / force, np.log(natural[1:])])

    def found(self, searched: Array, force: float) -> KneeCurve:
        """The curve at a point of the search."""
        return self.curve(np.concatenate([searched[:1] * force, np.exp(searched[1:])]))


BINGHAM = KneeForm(alike=True, bent=(False, False))
"""One T0 and C."""


# ----------------------------------------------------------------------------------------------------
# Tests as the fit of the knee law sees them: motion, force to be met, and the force that a curve gives.


FORCE_TOLERANCE = 1e-6
"""Admissible error of a piece of the path, as a share of the force; between its corners the law is in closed form."""


@dataclass(frozen=True, eq=False)
class Test:
    """One test, the displacement counted from the middle of all tests concerned."""

    __test__ = False

    record: Record
    motion: Motion
    steps: Array
    counted: Mask
    """(n,) which samples enter the criterion."""

    @property
    def measured(self) -> Array:
        """(m,) force at the counted samples [N]."""
        return self.record.force[self.counted]

    @property
    def of_gas(self) -> Array:
        """(m, 2) force of F_0 = 1 N and k_g = 1 N/m at the counted samples."""
        x = self.motion.displacement[self.counted]
        return np.column_stack([np.ones(x.size), x])

    def simulated(self, curve: KneeCurve, gas: Array) -> Array:
        """(m,) force of the element [N], begun at the measured force less that of the gas, (2,) F_0 and k_g."""
        rows, _ = constant_rows(curve.friction, curve.damping, curve.stiffness, {"knee": curve.effect()})
        first = float(self.record.force[0] - gas[0] - gas[1] * self.motion.displacement[0])
        return integrated_force(rows, self.motion, self.steps, first, FORCE_TOLERANCE)[self.counted]


@dataclass(frozen=True, eq=False)
class Tests:
    """The tests of one condition, or some of them."""

    __test__ = False

    tests: tuple[Test, ...]
    middle: float
    """Displacement, as recorded, from which x is counted [m]."""

    @classmethod
    def of(cls, records: Sequence[Record]) -> Tests:
        """The tests, the displacement counted from the middle of their motion."""
        middle = mid_stroke(r.displacement for r in records)
        found = (Test(r, Motion.of(r).centred_on(middle), sampling_steps(r.time), in_motion(r)) for r in records)
        return cls(tuple(found), middle)

    def some(self, kept: Sequence[int]) -> Tests:
        """Some of the tests, about the same zero."""
        return Tests(tuple(self.tests[i] for i in kept), self.middle)

    @cached_property
    def measured(self) -> Array:
        """(N,) force at the counted samples, test by test [N]."""
        return np.concatenate([t.measured for t in self.tests])

    @cached_property
    def of_gas(self) -> Array:
        """(N, 2) force of F_0 = 1 N and k_g = 1 N/m."""
        return np.vstack([t.of_gas for t in self.tests])

    @cached_property
    def speed(self) -> Array:
        """(N,) extension speed [m/s]."""
        return np.concatenate([t.record.velocity[t.counted] for t in self.tests])

    @property
    def fastest(self) -> float:
        """Largest speed [m/s]."""
        return float(np.max(np.abs(self.speed)))

    @property
    def peak(self) -> float:
        """Largest force [N]."""
        return float(np.max(np.abs(self.measured)))

    def simulated(self, curve: KneeCurve, gas: Array) -> Array:
        """(N,) force of the element [N]."""
        return np.concatenate([t.simulated(curve, gas) for t in self.tests])


# ----------------------------------------------------------------------------------------------------
# Where the fit of the knee law begins: the curve by linear least squares, the knees on a grid, no oil spring.


KNEES = (0.06, 0.12, 0.2, 0.3, 0.45, 0.65)
"""Knee speeds of the grid, as shares of the fastest speed."""
SAMPLES = 6000
"""The grid is evaluated on at most so many samples."""
TURNING = 0.02
"""Below this share of the fastest speed the oil spring winds up, and the force is not that of the curve."""
LEAST_SLOPE = 0.02
"""Least slope of a start, as a share of peak force over peak speed."""
MOST_SLOPE = 50.0
"""Largest slope of a start, likewise."""


def start_of(tests: Tests, stiffness: float) -> tuple[KneeCurve, Array]:
    """The best curve of the grid, and (2,) the gas force and gas spring beside it.

    Equation: F = F_0 + k_g x + T0 sign(v) + sum over the directions of C min(|v|, w_k) + B max(|v| - w_k, 0)

    Parameters
    ----------
    tests : that are fitted
    stiffness : of the oil spring, which this does not look for [N/m]
    """
    v, fastest = tests.speed, tests.fastest
    kept = np.flatnonzero(np.abs(v) > TURNING * fastest)
    kept = kept[:: max(1, kept.size // SAMPLES)]
    v, measured, beside = v[kept], tests.measured[kept], tests.of_gas[kept]
    found: list[tuple[float, KneeCurve, Array]] = []
    for knees in product((share * fastest for share in KNEES), repeat=2):
        terms = np.column_stack([beside, np.sign(v), *(t for way in (0, 1) for t in _terms(v, way, knees[way]))])
        size = np.linalg.norm(terms, axis=0)
        size[size == 0.0] = 1.0
        values = np.linalg.lstsq(terms / size, measured, rcond=1e-9)[0] / size
        left = measured - terms @ values
        found.append((float(left @ left), _curve(values[2:], knees, stiffness, tests), values[:2]))
    _, curve, gas = min(found, key=lambda each: each[0])
    return curve, gas


def _terms(v: Array, way: int, knee: float) -> tuple[Array, Array]:
    """(N,) force of a slope of one up to the knee of one direction, and of one beyond it."""
    sign = (1.0, -1.0)[way]
    w = np.maximum(sign * v, 0.0)
    return sign * np.minimum(w, knee), sign * np.maximum(w - knee, 0.0)


def _curve(values: Array, knees: tuple[float, ...], stiffness: float, tests: Tests) -> KneeCurve:
    """The curve of a linear fit, its values brought to what a damper may have."""
    unit = tests.peak / tests.fastest
    slopes = np.clip(values[1:], LEAST_SLOPE * unit, MOST_SLOPE * unit).tolist()
    return KneeCurve(
        float(np.clip(values[0], 1e-3 * tests.peak, 0.5 * tests.peak)),
        (slopes[0], slopes[2]),
        stiffness,
        (knees[REBOUND], knees[COMPRESSION]),
        (slopes[1], slopes[3]),
    )


# ----------------------------------------------------------------------------------------------------


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
