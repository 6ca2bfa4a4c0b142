"""Least-squares fit of the knee law: criterion (4) over the tests of a condition, gas force and spring profiled out.

Equation: |F| = T0 + C w + q w^2 up to the speed w_k of the knee, then F(w_k) + B (w - w_k), a corner that is
round where the valve opens over forces of a spread s; C, q, w_k, B and s of each direction. The friction T0 is that of
the flow, behind the oil spring k, or T0 tanh(v/v_s) of a seal on the rod beside it.
                                        Source: bleed and blow-off, Dixon 2007; element of eq. (1)-(3) with k
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from pzd.damper.compiled.kernels import K
from pzd.damper.compose import integrated_force, integrated_sensitivities, parallel_force_along, sampling_steps
from pzd.damper.fitted_laws.knee import mean_bleed, parameters_of
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import constant_rows
from pzd.damper.path import Variables
from pzd.fit.cross_validation import PredictionError, folds_in_turn, log_ratios, squared_sums
from pzd.fit.least_squares import minimise
from pzd.identification.prepared_record import in_motion
from pzd.record import Array, Mask, Record, mid_stroke, sliced
from pzd.signals.cycles import cycles_of
from pzd.signals.kinematics import clean_displacement_of
from pzd.signals.measures import VISIBLE, criterion, rms

# --- Knee curve and search coordinates ---

REBOUND, COMPRESSION = 0, 1
"""Directions: indices of every pair."""
GAS_FORCE, GAS_SPRING = 0, 1
"""Terms of the gas: F_0 and k_g."""


class KneeCurve(NamedTuple):
    """Parameters of the knee law; pairs are of rebound and compression."""

    friction: float
    """T0 [N]."""
    bleed: tuple[float, float]
    """C [N s/m]."""
    stiffness: float
    """k [N/m]."""
    knee_speed: tuple[float, float]
    """w_k [m/s]; infinite without a knee."""
    blow_off: tuple[float, float]
    """B [N s/m]; equal to the bleed without a knee."""
    square: tuple[float, float] = (0.0, 0.0)
    """q [N s2/m2]; 0 where the bleed is straight."""
    spread: tuple[float, float] = (0.0, 0.0)
    """s [N]; 0 where the knee is sharp."""
    seal_speed: float | None = None
    """v_s [m/s] of a friction on the rod; None for one of the flow."""

    def knee_force(self, direction: int) -> float:
        """Return the force of one direction where bleed and blow-off meet [N]; infinite without a knee."""
        speed = self.knee_speed[direction]
        bent = self.square[direction] * speed**2 if self.square[direction] else 0.0
        return self.friction_of_flow + self.bleed[direction] * speed + bent

    @property
    def friction_of_flow(self) -> float:
        """T0 of the element [N]: none where the friction is on the rod."""
        return self.friction if self.seal_speed is None else 0.0

    @property
    def damping(self) -> float:
        """Mean of both bleeds [N s/m], the C of the base row of the damper."""
        return mean_bleed(*self.bleed)

    @property
    def row(self) -> Array:
        """(1, r) parameter row of the path."""
        return constant_rows(self.friction_of_flow, self.damping, self.stiffness, {"knee": self.effect()})[0]

    def seal_force(self, motion: Motion) -> Array | None:
        """Compute the (n,) friction on the rod along a motion [N]; None where it is of the flow."""
        if self.seal_speed is None:
            return None
        effects = {"seal": {"F_s": self.friction, "v_s": self.seal_speed}}
        _, parallel = constant_rows(0.0, self.damping, self.stiffness, effects)
        return None if parallel is None else parallel_force_along(motion, parallel)

    def effect(self) -> dict[str, float]:
        """Return the parameters of the law `knee` beside T0, `damping` and k."""
        forces = self.knee_force(REBOUND), self.knee_force(COMPRESSION)
        return parameters_of(self.bleed, self.square, forces, self.blow_off, self.spread)


@dataclass(frozen=True)
class KneeForm:
    """Selection of the free parameters."""

    symmetric: bool = False
    """Whether both directions share one bleed and have no knee: the Bingham element."""
    has_knee: tuple[bool, bool] = (True, True)
    """Whether rebound and compression have a knee."""
    has_square: tuple[bool, bool] = (False, False)
    """Whether their bleeds have a square part."""
    has_round_knee: tuple[bool, bool] = (False, False)
    """Whether their knees are round."""
    has_seal: bool = False
    """Whether the friction is on the rod."""
    has_gas: tuple[bool, bool] = (True, True)
    """Whether there is a gas force F_0, and a gas spring k_g."""

    @property
    def gas_terms(self) -> list[int]:
        """Columns of the forces of the gas that are free."""
        return [term for term, each in enumerate(self.has_gas) if each]

    @property
    def directions_with_knee(self) -> tuple[int, ...]:
        """Directions with a knee."""
        return _directions(self.has_knee)

    @property
    def directions_with_square(self) -> tuple[int, ...]:
        """Directions whose bleed has a square part."""
        return _directions(self.has_square)

    @property
    def directions_with_round_knee(self) -> tuple[int, ...]:
        """Directions whose knee is round."""
        return _directions(self.has_round_knee)

    def without_round_knee(self, direction: int) -> KneeForm:
        """Return the selection with a sharp knee in one direction."""
        return replace(self, has_round_knee=_without(self.has_round_knee, direction))

    def without_knee(self, direction: int) -> KneeForm:
        """Return the selection without the knee of one direction."""
        knee, round_knee = (_without(each, direction) for each in (self.has_knee, self.has_round_knee))
        return replace(self, has_knee=knee, has_round_knee=round_knee)

    def without_square(self, direction: int) -> KneeForm:
        """Return the selection without the square part of the bleed of one direction."""
        return replace(self, has_square=_without(self.has_square, direction))

    def natural(self, curve: KneeCurve) -> Array:
        """Return the free parameters (p,) in SI units.

        T0, bleeds, k, w_k and B of each knee, q of each square part, s of each round knee, v_s of a seal.
        """
        bleeds = curve.bleed[:1] if self.symmetric else curve.bleed
        knees = [
            value
            for direction in self.directions_with_knee
            for value in (curve.knee_speed[direction], curve.blow_off[direction])
        ]
        squares = [curve.square[direction] for direction in self.directions_with_square]
        spreads = [curve.spread[direction] for direction in self.directions_with_round_knee]
        seal = [curve.seal_speed] if self.has_seal and curve.seal_speed is not None else []
        return np.array([curve.friction, *bleeds, curve.stiffness, *knees, *squares, *spreads, *seal])

    def curve(self, natural: Array) -> KneeCurve:
        """Return the curve of the free parameters (p,)."""
        values = iter(natural.tolist())
        friction, rebound = next(values), next(values)
        bleed = (rebound, rebound if self.symmetric else next(values))
        stiffness = next(values)
        speed, slope, square, spread = [np.inf, np.inf], [*bleed], [0.0, 0.0], [0.0, 0.0]
        for direction in self.directions_with_knee:
            speed[direction], slope[direction] = next(values), next(values)
        for direction in self.directions_with_square:
            square[direction] = next(values)
        for direction in self.directions_with_round_knee:
            spread[direction] = next(values)
        seal = next(values) if self.has_seal else None
        return KneeCurve(friction, bleed, stiffness, _pair(speed), _pair(slope), _pair(square), _pair(spread), seal)

    def searched(self, curve: KneeCurve, force: float) -> Array:
        """Return the search coordinates (p,): T0 as a share of a force [N], the logarithms of all others."""
        natural = self.natural(curve)
        return np.concatenate([natural[:1] / force, np.log(natural[1:])])

    def found(self, searched: Array, force: float) -> KneeCurve:
        """Return the curve at search coordinates (p,)."""
        return self.curve(np.concatenate([searched[:1] * force, np.exp(searched[1:])]))


def _without(pair: tuple[bool, bool], direction: int) -> tuple[bool, bool]:
    """Return a choice of directions without one."""
    return pair[0] and direction != 0, pair[1] and direction != 1


def _directions(pair: tuple[bool, bool]) -> tuple[int, ...]:
    """Return the directions of a choice."""
    return tuple(direction for direction in (REBOUND, COMPRESSION) if pair[direction])


def _pair(values: Sequence[float]) -> tuple[float, float]:
    """Return the values of rebound and compression."""
    return values[REBOUND], values[COMPRESSION]


BINGHAM_FORM = KneeForm(symmetric=True, has_knee=(False, False))
"""The Bingham element: one T0 and C."""


# --- Data ---

FORCE_TOLERANCE = 1e-6
"""Largest error of a step of the integration, as a share of the force; between corners the law is in closed form."""


@dataclass(frozen=True, eq=False)
class KneeRecord:
    """One test, its displacement counted from mid-stroke of all tests of the fit."""

    record: Record
    motion: Motion
    steps: Array
    """Time steps of the integration, see `pzd.damper.compose.sampling_steps` [s]."""
    counted: Mask
    """(n,) mask of the samples that enter the criterion."""

    def simulated(self, curve: KneeCurve, gas: Array) -> Array:
        """Compute the force (m,) of element and seal [N], starting from the measured one less that of the gas (2,)."""
        force = integrated_force(curve.row, self.motion, self.steps, self._first(gas), FORCE_TOLERANCE)[self.counted]
        seal = curve.seal_force(self.motion)
        return force if seal is None else force + seal[self.counted]

    def sensitivities(self, curve: KneeCurve, gas: Array, variables: Variables) -> Array:
        """Compute the (m, v) derivatives of the force of the element by variables."""
        given = curve.row, variables, self.motion, self.steps, self._first(gas), FORCE_TOLERANCE
        return integrated_sensitivities(*given)[1][self.counted]

    def _first(self, gas: Array) -> float:
        return float(self.record.force[0] - gas[0] - gas[1] * self.motion.displacement[0])


@dataclass(frozen=True, eq=False)
class KneeData:
    """Tests of one condition, or a subset of them."""

    tests: tuple[KneeRecord, ...]
    middle: float
    """Mid-stroke: displacement, as recorded, from which x is counted [m]."""

    @classmethod
    def of(cls, records: Sequence[Record]) -> KneeData:
        """Collect tests, their displacement counted from mid-stroke."""
        return cls._about(mid_stroke(r.displacement for r in records), records)

    def of_few_cycles(self) -> KneeData:
        """Return the tests up to their first `FEW_CYCLES` cycles, where they have more: these show every part alike."""
        cut = [_few_cycles(test.record) for test in self.tests]
        shorter = any(one.time.size < test.record.time.size for one, test in zip(cut, self.tests, strict=True))
        return self._about(self.middle, cut) if shorter else self

    @classmethod
    def _about(cls, middle: float, records: Sequence[Record]) -> KneeData:
        # Without its noise, which a stiff oil spring would turn into force.
        clean = (replace(r, displacement=clean_displacement_of(r)) for r in records)
        motions = (Motion.of(r).centred_on(middle) for r in clean)
        found = (KneeRecord(r, m, sampling_steps(r.time), in_motion(r)) for r, m in zip(records, motions, strict=True))
        return cls(tuple(found), middle)

    def subset(self, kept: Sequence[int]) -> KneeData:
        """Return a subset of the tests, with the same mid-stroke."""
        return KneeData(tuple(self.tests[i] for i in kept), self.middle)

    @cached_property
    def measured(self) -> Array:
        """Force (N,) at the counted samples, test by test [N]."""
        return np.concatenate([t.record.force[t.counted] for t in self.tests])

    @cached_property
    def gas_columns(self) -> Array:
        """Forces (N, 2) of F_0 = 1 N and k_g = 1 N/m at the counted samples."""
        x = np.concatenate([t.motion.displacement[t.counted] for t in self.tests])
        return np.column_stack([np.ones(x.size), x])

    @cached_property
    def speed(self) -> Array:
        """Extension speed (N,) [m/s]."""
        return np.concatenate([t.record.velocity[t.counted] for t in self.tests])

    @property
    def fastest(self) -> float:
        """Largest speed [m/s]."""
        return float(np.max(np.abs(self.speed)))

    @property
    def peak(self) -> float:
        """Largest force [N]."""
        return float(np.max(np.abs(self.measured)))

    @property
    def invisible(self) -> float:
        """Sum of squares [N^2] of an error that is not visible."""
        return float(self.measured.size * (VISIBLE * self.peak) ** 2)

    def simulated(self, curve: KneeCurve, gas: Array) -> Array:
        """Compute the force (N,) of element and seal [N]."""
        return np.concatenate([t.simulated(curve, gas) for t in self.tests])

    def sensitivities(self, curve_at: Callable[[Array], KneeCurve], x: Array, sizes: Array, gas: Array) -> Array:
        """Compute the (N, p) derivatives of the force by p variables of a curve.

        How the parameter row depends on them is differenced; the path integrates the derivatives exactly.

        Parameters
        ----------
        curve_at : curve by the variables
        x : (p,) variables
        sizes : (p,) by which each is differenced, in steps of `DIFFERENCE`
        gas : (2,) F_0 [N] and k_g [N/m]
        """

        def row(x: Array) -> Array:
            found = curve_at(x).row[0]
            found[K] = 1.0 / found[K]  # the compliance, see `Variables`
            return np.asarray(np.nan_to_num(found))  # without an effect its columns may be infinite

        steps = DIFFERENCE * np.diag(sizes)
        along = np.stack([(row(x + step) - row(x - step)) / (2.0 * step.sum()) for step in steps])
        columns = np.flatnonzero(np.any(along != 0.0, axis=0))
        variables = Variables(columns, along[np.newaxis][:, :, columns], np.zeros(x.size))
        found = np.concatenate([t.sensitivities(curve_at(x), gas, variables) for t in self.tests])
        if curve_at(x).seal_speed is None:
            return found
        for place in (0, x.size - 1):  # T0 and v_s
            one, other = (self._seal_force(curve_at(x + way * steps[place])) for way in (1.0, -1.0))
            found[:, place] += (one - other) / (2.0 * steps[place, place])
        return found

    def _seal_force(self, curve: KneeCurve) -> Array:
        """Compute the (N,) friction on the rod [N]."""
        forces = (curve.seal_force(t.motion) for t in self.tests)
        return np.concatenate([f[t.counted] for f, t in zip(forces, self.tests, strict=True) if f is not None])


FEW_CYCLES = 3
"""Cycles of a test in which the parts of the law are looked for.

Reason: the first may begin from rest; of the others one is what the rest repeats. Not tuned."""


def _few_cycles(record: Record) -> Record:
    """Return a record up to the end of its first cycles; the record itself where it has no more, or does not repeat."""
    run = cycles_of(record)
    if run is None or run.count <= FEW_CYCLES:
        return record
    return sliced(record, record.time < run.start + FEW_CYCLES * run.period)


# --- Start: linear least squares with the knees on a grid ---

KNEE_GRID = (0.06, 0.12, 0.2, 0.3, 0.45, 0.65)
"""Knee speeds of the grid, as shares of the largest speed."""
GRID_SAMPLES = 6000
"""Most samples on which the grid is evaluated."""
SLOWEST = 0.02
"""Least speed of a sample of the grid, as a share of the largest: below it the oil spring loads, off the curve."""
LEAST_SLOPE = 0.02
"""Least slope of a start, as a share of peak force over peak speed."""
MOST_SLOPE = 50.0
"""Largest slope of a start, as a share of peak force over peak speed."""


def grid_start(tests: KneeData, stiffness: float, *, square: bool = False) -> tuple[KneeCurve, Array]:
    """Return the best curve of the grid, and its gas force and gas spring (2,).

    Equation: F = F_0 + k_g x + T0 sign(v) + sum over the directions of C u + B max(|v| - w_k, 0) + q u^2,
              u = min(|v|, w_k)

    Parameters
    ----------
    tests : that are fitted
    stiffness : of the oil spring, which the grid does not search [N/m]
    square : whether the bleeds have a square part q; then no slope, friction or q is below zero
    """
    from scipy.optimize import lsq_linear

    v, fastest = tests.speed, tests.fastest
    kept = np.flatnonzero(np.abs(v) > SLOWEST * fastest)
    kept = kept[:: max(1, kept.size // GRID_SAMPLES)]
    v, measured, of_gas = v[kept], tests.measured[kept], tests.gas_columns[kept]
    found: list[tuple[float, KneeCurve, Array]] = []
    for knees in product((share * fastest for share in KNEE_GRID), repeat=2):
        terms = np.column_stack(
            [of_gas, np.sign(v), *(t for direction in (0, 1) for t in _slope_columns(v, direction, knees[direction]))]
        )
        if square:
            terms = np.column_stack([terms, *(_square_column(v, direction, knees[direction]) for direction in (0, 1))])
        size = np.linalg.norm(terms, axis=0)
        size[size == 0.0] = 1.0
        if square:
            low = np.where(np.arange(size.size) < 2, -np.inf, 0.0)  # of the gas alone either sign is natural
            values = lsq_linear(terms / size, measured, (low, np.inf), method="bvls").x / size
        else:
            values = np.linalg.lstsq(terms / size, measured, rcond=1e-9)[0] / size
        left = measured - terms @ values
        found.append((float(left @ left), _clipped_curve(values[2:], knees, stiffness, tests), values[:2]))
    _, curve, gas = min(found, key=lambda each: each[0])
    return curve, gas


def _slope_columns(v: Array, direction: int, knee: float) -> tuple[Array, Array]:
    """Return the forces (N,) of a unit slope up to the knee of one direction, and of one beyond it."""
    sign = (1.0, -1.0)[direction]
    w = np.maximum(sign * v, 0.0)
    return sign * np.minimum(w, knee), sign * np.maximum(w - knee, 0.0)


def _square_column(v: Array, direction: int, knee: float) -> Array:
    """Return the force (N,) of a unit square part up to the knee of one direction."""
    sign = (1.0, -1.0)[direction]
    return np.asarray(sign * np.clip(sign * v, 0.0, knee) ** 2)


def _clipped_curve(values: Array, knees: tuple[float, ...], stiffness: float, tests: KneeData) -> KneeCurve:
    """Return the curve of a linear fit, its values clipped to those of a damper."""
    unit = tests.peak / tests.fastest
    slopes = np.clip(values[1:5], LEAST_SLOPE * unit, MOST_SLOPE * unit).tolist()
    least = LEAST_SLOPE * unit / tests.fastest
    squares = np.clip(values[5:7], least, MOST_SLOPE * least / LEAST_SLOPE).tolist() or [0.0, 0.0]
    return KneeCurve(
        float(np.clip(values[0], 1e-3 * tests.peak, 0.5 * tests.peak)),
        (slopes[0], slopes[2]),
        stiffness,
        (knees[REBOUND], knees[COMPRESSION]),
        (slopes[1], slopes[3]),
        (squares[REBOUND], squares[COMPRESSION]),
    )


# --- Least squares ---

DIFFERENCE = 1e-5
"""Step of the difference quotients in search coordinates."""
LEAST_FRICTION = 1e-3
"""Least friction by which its step is measured, as a share of the peak force: a smaller one moves no digit of it."""
EVALUATIONS = 60
"""Most evaluations with slopes in one descent."""
REFIT_EVALUATIONS = 12
"""Most evaluations of a refit without a fold: it starts at the optimum of all tests, which one fold hardly moves."""
TOLERANCE = 1e-8
"""Relative tolerance of the least squares on parameters and criterion: beyond it the differences show their own error.
"""
OFFSET = 1e-2
"""Largest distance to the optimum [standard errors]: of an interval less than its second digit."""
PROBE_EVALUATIONS = 6
"""Evaluations after which a law without one of its parts, where that does nothing, is near its optimum."""
DESCRIBES = 0.25
"""Most of the squared error of another law that one leaves which describes the tests far better: half the error. Not
tuned; a law with more numbers than a damper needs takes a few percent of what is left."""
NEAREST_KNEE = 0.01
"""Least knee speed of the search, as a share of the largest speed: below it the oil spring governs the force."""
SPREAD_START = 0.1
"""Spread of a knee force at the start, as a share of it."""
SPREAD_RANGE = (1e-3, 1.0)
"""Smallest and largest spread of the search, as a share of the peak force."""
ROUND_KNEE_RANGE = (0.5, 2.0)
"""Smallest and largest speed of a round knee in the search, as a factor on that at the start, the same knee sharp: the
law would bend about the friction at rest next."""
SHOWN_OF_LEFT = 0.1
"""Share of the squared error without it that a part of the law takes where it shows, however small that is.

Reason: of white noise a number takes a share of one over the samples; and what is left out bends the numbers that stay,
as a straight bleed in the place of a square one does the friction. Not tuned."""
SEAL_START = 0.003
"""Speed v_s of a seal at the start, as a share of the largest."""
SEAL_RANGE = (1e-4, 2e-2)
"""Smallest and largest v_s of the search, as a share of the largest speed: beyond it is a bleed."""
SLOPE_RANGE = (1e-3, 1e3)
"""Smallest and largest slope of the search, in peak force over peak speed; of a square part over the square of that."""
STIFFNESS_RANGE = (1e-1, 1e5)
"""Smallest and largest k of the search, in peak force over the range of displacement."""


@dataclass(frozen=True, eq=False)
class KneeFit:
    """An optimum of criterion (4) for the knee law."""

    form: KneeForm
    curve: KneeCurve
    gas: Array
    """(2,) F_0 at mid-stroke [N] and k_g [N/m]."""
    residuals: Array
    """(N,) measured less simulated force [N]."""
    slopes: Array
    """(N, p + g) derivatives of the force by the natural parameters of the form, and by its terms of the gas."""
    criterion: float
    converged: bool
    """Whether the residuals are orthogonal to the slopes as far as their own size can tell."""

    def predicted(self, tests: KneeData) -> Array:
        """Predict the force (N,) of other tests of the damper [N]."""
        return tests.simulated(self.curve, self.gas) + tests.gas_columns @ self.gas


def fit_knees(conditions: Sequence[tuple[KneeData, float]]) -> list[KneeFit]:
    """Fit the knee law to the conditions of one damper, with the parts that each shows.

    All parts at once, with the friction of the flow or on the rod of every condition, whichever leaves less; then less
    what does not show. Few parts first would hide the rest: a straight bleed bends the knee, a sharp knee the bleed.

    Parameters
    ----------
    conditions : tests, and the stiffness of the oil spring at the start [N/m]
    """
    short = [(tests.of_few_cycles(), stiffness) for tests, stiffness in conditions]
    simple = [descend(tests, KneeForm(), *grid_start(tests, stiffness)) for tests, stiffness in short]
    of_flow = [_with_every_part(tests, stiffness) for tests, stiffness in short]
    on_rod = [_on_the_rod(tests, fit) for (tests, _), fit in zip(short, of_flow, strict=True)]
    left = [sum(fit.criterion for fit in fits) for fits in (of_flow, on_rod)]
    whole = of_flow
    if left[1] < (1.0 - SHOWN_OF_LEFT) * left[0]:
        whole, simple = on_rod, [_on_the_rod(tests, fit) for (tests, _), fit in zip(short, simple, strict=True)]
    every = zip(short, simple, whole, strict=True)
    chosen = [_that_predicts(tests, *(_with_what_shows(tests, fit) for fit in pair)) for (tests, _), *pair in every]
    return [descend(tests, fit.form, fit.curve, fit.gas) for (tests, _), fit in zip(conditions, chosen, strict=True)]


def _that_predicts(tests: KneeData, simple: KneeFit, whole: KneeFit) -> KneeFit:
    """Return the law with more parts where they show, and describe the tests far better or predict those kept back."""
    if not _shows(tests, whole, simple):
        return simple
    far_better = whole.criterion < DESCRIBES * simple.criterion
    return whole if far_better or _predicts(tests, whole, simple) else simple


def _with_every_part(tests: KneeData, stiffness: float) -> KneeFit:
    """Fit the law with square bleeds and knees that are round, from the best with sharp ones."""
    sharp = descend(tests, KneeForm(has_square=(True, True)), *grid_start(tests, stiffness, square=True))
    spread = _pair([SPREAD_START * sharp.curve.knee_force(way) for way in (REBOUND, COMPRESSION)])
    form = replace(sharp.form, has_round_knee=(True, True))
    return descend(tests, form, sharp.curve._replace(spread=spread), sharp.gas)


def _on_the_rod(tests: KneeData, of_flow: KneeFit) -> KneeFit:
    """Fit the law again with its friction on the rod."""
    form = replace(of_flow.form, has_seal=True)
    return descend(tests, form, of_flow.curve._replace(seal_speed=SEAL_START * tests.fastest), of_flow.gas)


_LEFT_OUT = (KneeForm.without_square, KneeForm.without_round_knee, KneeForm.without_knee)
"""What a form may go without in one direction."""


def _with_what_shows(tests: KneeData, best: KneeFit) -> KneeFit:
    """Leave out square parts, spreads and knees that do not show, one after the other, all else fitted again."""
    for left_out, direction in product(_LEFT_OUT, (REBOUND, COMPRESSION)):
        form = left_out(best.form, direction)
        if form == best.form:
            continue
        without = descend(tests, form, best.curve, best.gas, PROBE_EVALUATIONS)
        if best.criterion < DESCRIBES * without.criterion:
            continue
        without = without if without.converged else descend(tests, form, without.curve, without.gas)
        if not _shows(tests, best, without):
            best = without
    return best


def fit_bingham(tests: KneeData, start: KneeFit) -> KneeFit:
    """Fit one T0 and C with gas force, gas spring and oil spring: the alternative law to the knee."""
    slope = 0.25 * sum((*start.curve.bleed, *start.curve.blow_off))
    begin = start.curve._replace(bleed=(slope, slope))
    return descend(tests, replace(BINGHAM_FORM, has_gas=start.form.has_gas), begin, start.gas)


def without_gas(tests: KneeData, fit: KneeFit, term: int) -> KneeFit:
    """Fit the law again with `GAS_FORCE` or `GAS_SPRING` left out, which moves all else."""
    force, spring = (each and term != other for other, each in enumerate(fit.form.has_gas))
    gas = np.where((force, spring), fit.gas, 0.0)
    return descend(tests, replace(fit.form, has_gas=(force, spring)), fit.curve, gas)


def held_out(tests: KneeData, *fits: KneeFit) -> list[list[Array]]:
    """Return what each fit leaves (n,) of every test that it is fitted without, test by test; [] of one test alone.

    The tests are dealt into folds in the order of their speeds: the laws are functions of the speed, and every fold
    leaves slow and fast ones to fit.

    Parameters
    ----------
    tests : of the condition
    fits : the optima over all tests, at which the refits start
    """
    count = len(tests.tests)
    if count < 2:
        return []
    order = np.argsort([float(np.max(np.abs(test.record.velocity))) for test in tests.tests], kind="stable")
    found = dict[int, list[Array]]()
    dealt = np.array(folds_in_turn(count))
    for fold in sorted(set(dealt.tolist())):
        out = order[dealt == fold].tolist()
        rest = tests.subset([i for i in range(count) if i not in out])
        refitted = [descend(rest, fit.form, fit.curve, fit.gas, REFIT_EVALUATIONS) for fit in fits]
        for i in out:
            one = tests.subset([i])
            found[i] = [one.measured - fit.predicted(one) for fit in refitted]
    return [found[i] for i in range(count)]


def held_out_errors(tests: KneeData, *fits: KneeFit) -> list[list[tuple[float, ...]]]:
    """Return the entries of a `PredictionError` of each fit, test by test, each fitted without it."""
    each = (tests.subset([i]) for i in range(len(tests.tests)))
    return [
        [(*squared_sums(one.measured, residuals), one.invisible) for residuals in left]
        for one, left in zip(each, held_out(tests, *fits), strict=False)  # a test that is alone is not held out
    ]


def _predicts(tests: KneeData, fit: KneeFit, without: KneeFit) -> bool:
    """Tell whether held-out tests are predicted better by a fit, in the geometric mean of their errors."""
    entries = held_out_errors(tests, fit, without)
    if not entries:
        return True
    one, other = (PredictionError.of_entries(range(len(entries)), own) for own in zip(*entries, strict=True))
    return float(np.sum(log_ratios(one, other))) >= 0.0


def _shows(tests: KneeData, fit: KneeFit, without: KneeFit) -> bool:
    """Tell whether a part of the law takes a visible force off what a fit leaves without it, or much of that."""
    left, gained = rms(without.residuals) ** 2, rms(without.residuals) ** 2 - rms(fit.residuals) ** 2
    return gained > min((VISIBLE * tests.peak) ** 2, SHOWN_OF_LEFT * left)


def descend(tests: KneeData, form: KneeForm, start: KneeCurve, gas: Array, evaluations: int = EVALUATIONS) -> KneeFit:
    """Find the optimum from a curve by trust-region least squares within bounds.

    Equation: min over the curve of |P (F - F_sim)|^2, P projects F_0 and k_g out
                                                        Source: Golub and Pereyra 1973, variable projection

    Parameters
    ----------
    tests : that are fitted
    form : selection of the free parameters
    start : of the search; parameters that are not free are ignored
    gas : (2,) F_0 and k_g in the first force of a test; its effect is over before the counted samples
    evaluations : largest number
    """
    basis, _ = np.linalg.qr(tests.gas_columns[:, form.gas_terms])
    norm, peak = float(np.linalg.norm(tests.measured)), tests.peak

    def projected(values: Array) -> Array:
        return np.asarray(values - basis @ (basis.T @ values))

    def simulated(x: Array) -> Array:
        return tests.simulated(form.found(x, peak), gas)

    def residuals(x: Array) -> Array:
        return projected(tests.measured - simulated(x)) / norm

    def slopes(x: Array) -> Array:
        by = tests.sensitivities(lambda x: form.found(x, peak), x, np.ones(x.size), gas)
        return projected(-by) / norm

    low, high = _search_bounds(tests, form, start)
    begin = np.clip(form.searched(start, peak), low + 1e-6, high - 1e-6)
    found = minimise(
        residuals,
        begin,
        slopes,
        (low, high),
        precision=TOLERANCE,
        evaluations=evaluations,
        largest_offset=OFFSET,
        resolution=FORCE_TOLERANCE / np.sqrt(tests.measured.size),
    )
    curve = form.found(found.x, peak)
    left = tests.measured - tests.simulated(curve, gas)
    of_gas = np.zeros(2)
    of_gas[form.gas_terms] = np.linalg.lstsq(tests.gas_columns[:, form.gas_terms], left, rcond=None)[0]
    left = left - tests.gas_columns @ of_gas
    slopes_at_optimum = _natural_slopes(tests, form, curve, of_gas)
    return KneeFit(form, curve, of_gas, left, slopes_at_optimum, criterion(left, tests.measured), found.converged)


def _search_bounds(tests: KneeData, form: KneeForm, start: KneeCurve) -> tuple[Array, Array]:
    """Return the bounds (p,) of the search coordinates, those of a round knee about its speed at the start."""
    unit, fastest = tests.peak / tests.fastest, tests.fastest
    stroke = 2.0 * max(float(np.max(np.abs(t.motion.displacement))) for t in tests.tests)
    slope = [share * unit for share in SLOPE_RANGE]
    pairs = [slope] * (1 if form.symmetric else 2)
    pairs.append([share * tests.peak / stroke for share in STIFFNESS_RANGE])
    for direction in form.directions_with_knee:
        knee = [NEAREST_KNEE * fastest, fastest]
        if form.has_round_knee[direction]:
            begins = min(max(start.knee_speed[direction], knee[0]), knee[1])  # it may lie beyond these tests
            knee = [max(ROUND_KNEE_RANGE[0] * begins, knee[0]), min(ROUND_KNEE_RANGE[1] * begins, knee[1])]
        pairs += [knee, slope]
    pairs += [[each / fastest for each in slope]] * len(form.directions_with_square)
    pairs += [[share * tests.peak for share in SPREAD_RANGE]] * len(form.directions_with_round_knee)
    if form.has_seal:
        pairs.append([share * fastest for share in SEAL_RANGE])
    low, high = np.log(np.array(pairs)).T
    return np.concatenate([[0.0], low]), np.concatenate([[1.0], high])


def _natural_slopes(tests: KneeData, form: KneeForm, curve: KneeCurve, gas: Array) -> Array:
    """Return the derivatives (N, p + g) of the force by the natural parameters and the g free terms of the gas."""
    natural = form.natural(curve)
    size = np.where(natural > 0.0, natural, tests.peak)
    size[0] = max(size[0], LEAST_FRICTION * tests.peak)  # at its limit of 0 the search leaves a friction of 1e-14 N
    by = tests.sensitivities(form.curve, natural, size, gas)
    return np.column_stack([by, tests.gas_columns[:, form.gas_terms]])
