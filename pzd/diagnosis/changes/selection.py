"""Which changes explain the difference: forward selection with exchange, support of each, and rivals.

A step adopts the change that lowers the Bayesian criterion most; then each adopted one is left out, or put in the place
of another, until nothing improves. A linearised step tells beforehand which candidates are worth a fit.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from pzd.damper.confounders import known
from pzd.damper.fitted_laws import fitted_laws
from pzd.damper.model import Damper
from pzd.diagnosis.changes.candidates import ELEMENT_COLUMNS, Candidate, Coordinate, excludes, without_laws
from pzd.diagnosis.changes.regression import USUAL_SHARE, Fitted, Regression, Scatter
from pzd.diagnosis.fit.least_squares import projected_out
from pzd.diagnosis.search.acceptance import misplaced_end_stop
from pzd.diagnosis.search.determination import contradiction, nearly_others
from pzd.fit.cross_validation import SMALLEST_SINGULAR, folds_in_turn, held_out_residuals
from pzd.fit.intervals import LEVEL
from pzd.record import Array

MOST_CHANGES = 4
"""Changes at once."""
FITTED = 5
"""Candidates that are fitted in a step, of those that promise most."""
GAIN = "load_cell_gain"
SLACK = 30.0
"""A candidate whose promised criterion is worse than the best by more is not fitted: the promise is linearised."""
BEAM = 2
"""Beginnings that are followed to their end where one change leaves something: the best first step may mislead."""
EXCHANGES = 6
"""Rounds of the exchange at most; each lowers the criterion."""
BETTER = 1e-3
"""Least improvement of the criterion: of two candidates that do the same the first in the list stays."""
AT_MOST = 0.999
"""Share of the most that a stand does from which a fit has ended there: it comes near a limit, and not to it."""
AS_GOOD = 2.0
"""Multiple of what the best fit leaves up to which another one is as good: by the triangle inequality, what has no name
may make either leave so much."""
OTHER_STARTS = 2
"""Further starts from which a fit is begun that ended where a number of the change does nothing."""
SCALED = (0.05, 3.0)
"""Limits of the factor on a start by its linearised step."""


@dataclass(frozen=True, eq=False)
class Promise:
    """What one linearised step towards a candidate would leave."""

    criterion: float
    """Sum of squares in units of the scatter, with the penalty on its coordinates."""
    candidate: Candidate
    start: Array
    """From which it was taken."""
    others: tuple[Array, ...] = ()
    """The next best starts."""


def _scaled(candidate: Candidate, start: Array, step: Array) -> Array:
    """Return a start with its linear coordinates as large as the linearised step makes the difference from 0 to it.

    Those of the unit of the first, which is its size: another one is where it acts. A force beside the element keeps
    its shape where all that is force in its parameters grows alike: of a branch the stiffness with the force at which
    it slips.
    """
    if step.size == start.size:  # no difference at the start itself
        return start
    factor = float(np.clip(step[0], *SCALED))
    beside, size = _is_beside(candidate.name), candidate.coordinates[0]

    def grown(c: Coordinate, x: float) -> float:
        if c.logarithmic:
            return x + float(np.log(factor)) * (beside and c.unit.startswith("N"))
        return x * factor if c.unit == size.unit and c.name == size.name else x

    return np.array([grown(c, x) for c, x in zip(candidate.coordinates, start.tolist(), strict=True)])


def _is_beside(name: str) -> bool:
    """Whether a change acts beside the element: an offset of the stand, or a force whatever the element does."""
    if name in ELEMENT_COLUMNS or name not in known():
        return name == "load_cell_zero"
    return known()[name].place in ("parallel", "branch")


def _best_step(candidate: Candidate, columns: Array, r: Array) -> tuple[Array, Array]:
    """Return what the best linearised step leaves of (w,) a residual, and the step, one number for each column.

    The first of one column more than coordinates is the difference from 0 to the start. Its size is free where a
    coordinate is linear; where all are logarithmic the start is what it is, and no step is longer than one.
    """
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    if columns.shape[1] == len(candidate.coordinates) or not all(c.logarithmic for c in candidate.coordinates):
        step = np.linalg.lstsq(columns / size, r, rcond=1e-6)[0] / size
        return r - columns @ step, step
    rest = r - columns[:, 0]
    step = np.linalg.lstsq(columns[:, 1:] / size[1:], rest, rcond=1e-6)[0] / size[1:]
    step /= max(1.0, float(np.max(np.abs(step))))
    return rest - columns[:, 1:] @ step, np.concatenate([[1.0], step])


def _each_shows(columns: Sequence[Array], count: int) -> bool:
    """Whether each of the last columns (n, p) of all tests, as many as are counted, shows in some of them."""
    return bool(np.all(np.any([np.any(own[:, -count:] != 0.0, axis=0) for own in columns], axis=0)))


def _held_out_error(slopes: Sequence[Array], residuals: Sequence[Array]) -> float:
    """Return the sum of squares of what held-out tests leave about the linear fits without their folds.

    Parameters
    ----------
    slopes, residuals : (n, p) and (n,) of each test, anywhere near the optimum
    """
    if not slopes[0].shape[1]:
        return float(sum(r @ r for r in residuals))
    step = np.linalg.lstsq(np.concatenate(slopes), np.concatenate(residuals), rcond=SMALLEST_SINGULAR)[0]
    folds = folds_in_turn(len(slopes))
    members = [[i for i, fold in enumerate(folds) if fold == each] for each in sorted(set(folds))]
    left = held_out_residuals(slopes, [r - J @ step for J, r in zip(slopes, residuals, strict=True)], members)
    return float(sum(r @ r for r in left))


@dataclass(eq=False)
class Search:
    """Search for the changes that explain the difference of force."""

    regression: Regression
    candidates: Sequence[Candidate]
    adopt_bic: float
    rival_bic: float
    visible: float
    """Least r.m.s. force of a change, as a share of each test's peak."""
    _starts: dict[Candidate, list[tuple[Array, list[Array]]]] = field(default_factory=dict, repr=False)
    _fits: dict[frozenset[Candidate], Fitted] = field(default_factory=dict, repr=False)
    _begun_anew: set[frozenset[Candidate]] = field(default_factory=set, repr=False)
    """Which fits were begun again from other starts."""
    _begun_beside: set[tuple[frozenset[Candidate], frozenset[Candidate]]] = field(default_factory=set, repr=False)
    """Which fits were begun again where they stood beside another change."""
    _flexible: bool = False

    def nothing(self) -> Fitted:
        """Return the fit without any change."""
        return self._fit((), np.zeros(0), Scatter(USUAL_SHARE, 1.0))

    def _fit(self, candidates: Sequence[Candidate], start: Array, scatter: Scatter) -> Fitted:
        key = frozenset(candidates)
        if key not in self._fits:
            self._fits[key] = self.regression.fit(candidates, start, scatter)
        return self._fits[key].in_order(candidates)

    # --- What a candidate promises

    def _promising(self, before: Fitted, tried: Iterable[Candidate], scatter: Scatter) -> list[Promise]:
        """Return what one linearised step from each candidate's best start would leave, the best first."""
        whiteners = self.regression.likelihood.whiteners(scatter)
        r = np.concatenate([W @ each for W, each in zip(whiteners, before.residuals, strict=True)])
        frame = np.zeros((r.size, 0))
        if before.coordinates:
            frame = np.linalg.qr(self.regression.jacobian(before.coordinates, before.values, whiteners)).Q
        r = projected_out(frame, r)
        found = []
        for candidate in tried:
            steps: list[tuple[float, Array]] = []
            for start, columns in self._linearised(candidate):
                if len(start) > 1 and not _each_shows(columns, len(start)):
                    continue  # from where a number does nothing no search finds the place at which it does
                own = projected_out(frame, np.concatenate([W @ c for W, c in zip(whiteners, columns, strict=True)]))
                if not np.all(np.isfinite(own)):
                    continue
                left, step = _best_step(candidate, own, r)
                if left @ left < r @ r:
                    steps.append((float(left @ left), _scaled(candidate, start, step)))
            steps.sort(key=lambda each: each[0])
            steps = steps or [(float(r @ r), np.array(candidate.starts[0]))]
            penalty = len(candidate.coordinates) * float(np.log(self.regression.likelihood.size))
            others = tuple(at for _, at in steps[1 : 1 + OTHER_STARTS])
            found.append(Promise(steps[0][0] + penalty, candidate, steps[0][1], others))
        return sorted(found, key=lambda promise: promise.criterion)

    def _linearised(self, candidate: Candidate) -> list[tuple[Array, list[Array]]]:
        """Return the starts of a candidate with the columns of its differences there, from the first state."""
        if candidate not in self._starts:
            made = []
            coordinates = candidate.coordinates
            for start in candidate.starts:
                x = np.array(start)
                columns = self.regression.columns(coordinates, x)
                secant = self.regression.response.of(coordinates, x.tolist())
                if any(np.any(s != 0.0) for s in secant):
                    columns = [np.column_stack([s, c]) for s, c in zip(secant, columns, strict=True)]
                made.append((x, columns))
            self._starts[candidate] = made
        return self._starts[candidate]

    def _with(self, before: Fitted, promise: Promise) -> Fitted:
        together = (*before.candidates, promise.candidate)
        found = self._fit(together, np.concatenate([before.values, promise.start]), before.scatter)
        if self._each_number_shows(found) or frozenset(together) in self._begun_anew:
            return found
        # The search went to where a number does nothing, and none leads back from there.
        self._begun_anew.add(frozenset(together))
        starts = (np.concatenate([before.values, other]) for other in promise.others)
        fits = [found, *(self.regression.fit(together, start, before.scatter) for start in starts)]
        self._fits[frozenset(together)] = min(fits, key=lambda f: f.bic)
        return self._fits[frozenset(together)]

    def _tried(self, before: Fitted, *, in_place: bool = False) -> list[Candidate]:
        """Return the candidates that are asked beside some; in the place of one, two kinds of flexible laws too.

        Those that the first state has, and a new force beside the element: without memory it imitates nothing that the
        element does, and it has to pay for its numbers.
        """
        asked = [
            c
            for c in self.candidates
            if self._flexible or not c.flexible or (in_place and (not c.absent or known()[c.name].place == "parallel"))
        ]
        # Beside one such force that is newly there another one imitates what its law is off by.
        if any(c.flexible and c.absent for c in before.candidates):
            asked = [c for c in asked if not (c.flexible and c.absent)]
        return [c for c in asked if not any(excludes(c, adopted) for adopted in before.candidates)]

    def _additions(self, before: Fitted, *, possible: bool = False, opposed: bool = False) -> list[Fitted]:
        """Return the fits with one more change that is physical and large enough to adopt, the best first.

        Where it need only be `possible` it may be smaller; one that another one will oppose may leave more than its
        absence.
        """
        least = self._possible if possible else self.adoptable
        promising = self._promising(before, self._tried(before), before.scatter)
        worth = [
            p
            for i, p in enumerate(promising)
            if i < FITTED or p.candidate.name in ELEMENT_COLUMNS or p.candidate.of == "stand"
        ]
        # What visibly leaves more than its absence, the tests taken to differ alike, does not explain it.
        tried = (self._with(before, p) for p in worth)
        fits = [f for f in tried if self._admissible(f, least(f)) and (opposed or self._leaves_less(f, before))]
        # Of the parts of a law one with a number that no test determines would win, be dropped, and leave none of them.
        fits = [f for f in fits if f.candidates[-1].name not in fitted_laws() or self._predicts(f, f.candidates[-1])]
        # Of two that do the same, what the stand may have done is not laid to the damper.
        return sorted(fits, key=lambda f: f.bic - BETTER * (f.candidates[-1].of == "stand"))

    def _leaves_less(self, fitted: Fitted, before: Fitted) -> bool:
        """Whether a fit leaves less than its absence, or nothing visible, where the criterion alone decides."""
        return self.left(fitted) < max(self.left(before, fitted.scatter), self.visible)

    # --- The steps

    def run(self) -> Fitted:
        """Return the changes that explain the difference.

        Flexible laws are asked where the others leave something visible, and believed where they leave little, and less
        than half as much: a force beside the element leaves hardly more than a law within would.
        """
        best = self._in_the_element(self._best_end())
        if self.leaves_nothing(best) or not any(c.flexible for c in self.candidates):
            return best
        self._flexible = True
        further = self._best_end()
        little = AS_GOOD * max(self._least(further), self._least(best))
        self._flexible = self.left(further) < min(little, self.left(best) / AS_GOOD)
        return further if self._flexible else best

    def _in_the_element(self, best: Fitted) -> Fitted:
        """Put a change of T0, C or k in the place of changes with one that is newly there, where it explains as much.

        A law that the model lacks in both states goes with T0 or C: a tenth less of them leaves the tenth of what the
        model misses, and a new effect would take that up. Only where the model misses visibly of the difference.
        """
        if self.hidden(best) < self.visible or not any(c.absent and c.of == "damper" for c in best.candidates):
            return best
        nothing = self.nothing()
        own = [c for c in self.candidates if c.name in ELEMENT_COLUMNS]
        alone = [self._with(nothing, p) for p in self._promising(nothing, own, nothing.scatter)]
        enough = [
            f
            for f in alone
            if self._admissible(f, self.adoptable(f))
            and self.left(f) < self.adoptable(f)
            and self._predicts(f, f.candidates[0])
        ]
        return min(enough, key=lambda f: (f.values.size, self.left(f)), default=best)

    def _best_end(self) -> Fitted:
        """Adopt changes one by one from each of the best beginnings, with exchange, and return the best end.

        Of ends that leave nothing visible that with the fewest changes is the best: more of them may stand in for one.
        Where none does, two changes that oppose each other may, or T0, C and k that changed together.
        """
        nothing = self.nothing()
        ends, enough = list[Fitted](), list[Fitted]()
        for beginnings in (self._beginnings, self._opposed, self._together):
            ends += [self._without_superfluous(self._continued(self._exchanged(f))) for f in beginnings(nothing)]
            enough = [f for f in ends if f.candidates and self.leaves_nothing(f)]
            if enough or self.leaves_nothing(nothing):
                break
        return min(enough or [nothing, *ends], key=lambda f: (len(f.candidates) if enough else 0, f.bic))

    def _beginnings(self, nothing: Fitted) -> list[Fitted]:
        """Return the best first changes; one alone where it leaves nothing visible."""
        found = [f for f in self._additions(nothing) if f.bic - nothing.bic <= self.adopt_bic]
        enough = [f for f in found if self.leaves_nothing(f)]
        return enough[:1] or found[:BEAM]

    def _opposed(self, nothing: Fitted) -> list[Fitted]:
        """Return the best two changes that leave nothing visible, though either alone leaves more than neither.

        More friction and less damping nearly cancel: by its course over the cycle the difference has both, and without
        the other each makes it larger.
        """
        alone = [f for f in self._additions(nothing, opposed=True) if f.bic - nothing.bic <= self.adopt_bic]
        both = [f for one in alone[:BEAM] for f in self._additions(one) if self.leaves_nothing(f)]
        return sorted((f for f in both if f.bic - nothing.bic <= self.adopt_bic), key=lambda f: f.bic)[:BEAM]

    def _together(self, nothing: Fitted) -> list[Fitted]:
        """Return the fits of T0, C and k together that leave nothing visible: by more than a gain may be."""
        fits = [self._fit(group, np.zeros(len(group)), nothing.scatter) for group in self._groups()]
        return [f for f in fits if f.bic - nothing.bic <= self.adopt_bic and self.leaves_nothing(f)][:BEAM]

    def leaves_nothing(self, fitted: Fitted) -> bool:
        """Whether a fit leaves nothing visible beyond noise and what tests differ by themselves."""
        return self.left(fitted) < self._least(fitted)

    def _leaves_little(self, fitted: Fitted) -> bool:
        """Whether a fit has a flexible law that is newly there, and leaves no more than that is off by."""
        return any(c.flexible and c.absent for c in fitted.candidates) and (
            self.left(fitted) < AS_GOOD * self._least(fitted)
        )

    def _as_good(self, fitted: Fitted, best: Fitted) -> bool:
        """Whether a fit leaves no more than the best one may leave in its direction."""
        return self.left(fitted) <= max(AS_GOOD * self.left(best), self.hidden(best))

    def left(self, fitted: Fitted, scatter: Scatter | None = None) -> float:
        """Return what a fit leaves beyond noise and what tests differ by themselves (r.m.s., in units of the peaks).

        The scatter is that of the fit, where no other one is given.
        """
        own = self.regression.likelihood.own_of_tests(fitted.residuals, scatter or fitted.scatter)
        squares = [
            float((r - o) @ (r - o) - np.sum(c.variance)) / c.peak**2
            for r, o, c in zip(fitted.residuals, own, self.regression.comparisons, strict=True)
        ]
        return self._over_tests(squares)

    def _continued(self, best: Fitted) -> Fitted:
        """Adopt changes as long as something visible is left and the criterion falls by enough.

        Beside a flexible law that is newly there what is left is little sooner: another change would mend its law.
        """
        while len(best.candidates) < MOST_CHANGES and not self.leaves_nothing(best):
            if self._leaves_little(best):
                break
            more = next(iter(self._additions(best)), None)
            if more is None or more.bic - best.bic > self.adopt_bic:
                break
            best = self._exchanged(more)
        return best

    def _exchanged(self, best: Fitted) -> Fitted:
        """Put other candidates in the place of each adopted one until nothing improves."""
        for _ in range(EXCHANGES):
            tried = [fitted for c in best.candidates for fitted in self._additions(self.without(best, c))[:1]]
            better = min(tried, key=lambda f: f.bic, default=best)
            if better.bic > best.bic - BETTER - 1e-6 * abs(best.bic):
                return best
            best = better
        return best

    def _without_superfluous(self, best: Fitted) -> Fitted:
        """Leave out what does not pay, is not visible, or predicts held-out tests worse than its absence.

        Of several changes that leave something visible, also one without which the others are as good; and what is
        newly there beside a flexible law that leaves little without it.
        """
        while best.candidates:
            fewer = [(self.without(best, c), c) for c in best.candidates]
            doubtful = [
                less
                for less, c in fewer
                if best.bic - less.bic > self.adopt_bic
                or self.size_of(best, c) < self.adoptable(best)
                or not self._predicts(best, c)
                or (less.candidates and not self.leaves_nothing(best) and self._as_good(less, best))
                or (c.absent and self._leaves_little(less))
            ]
            if not doubtful:
                return best
            best = min(doubtful, key=lambda f: f.bic)
        return best

    def without(self, fitted: Fitted, candidate: Candidate) -> Fitted:
        """Return the fit without one of its changes, the others fitted again."""
        kept = tuple(c for c in fitted.candidates if c is not candidate)
        start = np.concatenate([fitted.values_of(c) for c in kept]) if kept else np.zeros(0)
        known, asked = self._fit(kept, start, fitted.scatter), (frozenset(kept), frozenset(fitted.candidates))
        if not kept or known.bic <= fitted.bic or asked in self._begun_beside:
            return known
        # An earlier fit of the others may have begun elsewhere and ended short of where they stand beside it.
        self._begun_beside.add(asked)
        anew = self.regression.fit(kept, start, fitted.scatter)
        self._fits[frozenset(kept)] = min(known, anew, key=lambda f: f.bic)
        return self._fits[frozenset(kept)]

    def _admissible(self, fitted: Fitted, least: float, *, at_limit: bool = False) -> bool:
        """Whether the last change of a fit is physical, makes at least so much force, and each number of it shows.

        A law of which a number does nothing is another law: a valve that is open from the yield on is a smaller C.
        `at_limit` allows it. A gain or a delay that ends at the most a stand does would be more, and is the damper's.
        """
        first, new = self.regression.response.first, fitted.candidates[-1]
        if any(
            c.of == "stand" and abs(x) > AT_MOST * c.high
            for c, x in zip(fitted.coordinates, fitted.values, strict=True)
        ):
            return False
        if not first.is_natural(fitted.coordinates, fitted.values.tolist()) or self.size_of(fitted, new) < least:
            return False
        if new.absent and (self._contradicted(fitted, new) or (new.name == "end_stop" and self._misplaced(fitted))):
            return False
        return at_limit or self._each_number_shows(fitted)

    def _contradicted(self, fitted: Fitted, new: Candidate) -> bool:
        """Whether the values of an effect that is newly there are those of no such effect."""
        if new.name not in known():
            return False
        return contradiction(self._changed(fitted), new.name, max(self._peaks)) is not None

    def _changed(self, fitted: Fitted) -> Damper:
        """Return the damper of the second state."""
        return self.regression.response.first.changed(fitted.coordinates, fitted.values.tolist(), None)

    def _misplaced(self, fitted: Fitted) -> bool:
        """Whether an end stop that is newly there begins where none does."""
        damper = self._changed(fitted)
        motions = [(c.motion.displacement, c.motion.velocity) for c in self.regression.comparisons]
        stroke = max(float(np.ptp(x)) for x, _ in motions) / 2.0
        return misplaced_end_stop(damper, stroke, motions) is not None

    def _each_number_shows(self, fitted: Fitted) -> bool:
        """Whether each number of the last change of a fit moves the force."""
        new = fitted.candidates[-1]
        if len(new.coordinates) == 1:
            return True
        columns = self.regression.columns(fitted.coordinates, fitted.values)
        its = [i for i, c in enumerate(fitted.coordinates) if c in new.coordinates]
        return _each_shows([own[:, its] for own in columns], len(its))

    def _over_tests(self, squares: Sequence[float]) -> float:
        """Return the root of the mean of one square a test: of those compared cycle by cycle, where there are any.

        What the damper of the first state misses of a test that it stands for would drown what the others show. Of
        squares less those of noise some are below 0 by chance, as others are above, so that only their mean counts.
        """
        by_cycles = [s for s, c in zip(squares, self.regression.comparisons, strict=True) if c.before is not None]
        return float(np.sqrt(max(float(np.mean(by_cycles or squares)), 0.0)))

    def _least(self, fitted: Fitted) -> float:
        """Return the r.m.s. force from which something counts, each test in units of its peak."""
        return max(self.visible, self.hidden(fitted))

    def adoptable(self, fitted: Fitted) -> float:
        """Return the r.m.s. force from which a change is adopted, each test in units of its peak.

        What the model misses of others is seldom as much, nor what it misses of the tests that it stands for.
        """
        return max(self.visible, LEVEL * self._missed_of_difference(fitted), self.hidden(fitted))

    def _possible(self, fitted: Fitted) -> float:
        """Return the r.m.s. force from which a change is possible: what the model misses of others is usually less."""
        return max(self.visible, self._missed_of_difference(fitted))

    def _missed_of_difference(self, fitted: Fitted) -> float:
        """Return the r.m.s. force that the model misses of the difference, each test in units of its peak.

        A damper that misses a share of the force misses that share of what a change in it makes; a force beside it is
        the same whatever it misses.
        """
        changed = [(c, float(x)) for c, x in zip(fitted.coordinates, fitted.values, strict=True) if _is_beside(c.name)]
        beside = self.regression.response.of([c for c, _ in changed], [x for _, x in changed])
        within = [c.difference - made for c, made in zip(self.regression.comparisons, beside, strict=True)]
        squares = [float(d @ d) / peak**2 for d, peak in zip(within, self._peaks, strict=True)]
        return self.regression.likelihood.known_discrepancy * self._over_tests(squares)

    def hidden(self, fitted: Fitted) -> float:
        """Return the r.m.s. force that the model misses of the difference, and of the tests that it stands for."""
        missed = [float(np.sum(self.regression.likelihood.missed_by_model(i))) for i, _ in enumerate(self._peaks)]
        through = self._over_tests([m / peak**2 for m, peak in zip(missed, self._peaks, strict=True)])
        return float(np.hypot(self._missed_of_difference(fitted), through))

    @property
    def _peaks(self) -> list[float]:
        return [c.peak for c in self.regression.comparisons]

    def size_of(self, fitted: Fitted, candidate: Candidate) -> float:
        """Return the r.m.s. force that a change makes beside the others, each test in units of its peak."""
        made = zip(self.regression.comparisons, self._made_by(fitted, candidate), strict=True)
        return self._over_tests([float(d @ d) / c.peak**2 for c, d in made])

    def _made_by(self, fitted: Fitted, candidate: Candidate) -> list[Array]:
        """Return the (2 H + 1,) difference that a change makes beside the others in every comparison [N]."""
        coordinates = fitted.coordinates
        kept = [
            (c, float(x)) for c, x in zip(coordinates, fitted.values, strict=True) if c not in candidate.coordinates
        ]
        others = self.regression.response.of([c for c, _ in kept], [x for _, x in kept])
        return [d - o for d, o in zip(fitted.differences, others, strict=True)]

    def _predicts(self, fitted: Fitted, candidate: Candidate) -> bool:
        """Whether held-out tests are predicted better with a change than without, the rest fitted alike.

        To first order about the optimum; a coordinate that the other tests do not show is left out of the count.
        """
        tests = len(self.regression.comparisons)
        if tests < 2 or candidate.per_voltage:
            return True
        whiteners = self.regression.likelihood.whiteners(fitted.scatter)
        columns = self.regression.columns(fitted.coordinates, fitted.values)
        J = [W @ c for W, c in zip(whiteners, columns, strict=True)]
        r = [W @ each for W, each in zip(whiteners, fitted.residuals, strict=True)]
        # Absent it makes no force, wherever its coordinates stand: that of a logarithm is no 0.
        absent = [W @ d for W, d in zip(whiteners, self._made_by(fitted, candidate), strict=True)]
        kept = np.array([c not in candidate.coordinates for c in fitted.coordinates])
        less = _held_out_error([own[:, kept] for own in J], [a + b for a, b in zip(r, absent, strict=True)])
        return less > _held_out_error(J, r)

    def rivals(self, best: Fitted, candidate: Candidate) -> list[Fitted]:
        """Return the fits with another candidate in the place of one, where the criterion is nearly as low."""
        less = self.without(best, candidate)
        tried = [c for c in self._tried(less, in_place=True) if c.name != candidate.name]
        own = self._promising(less, [candidate], best.scatter)[0]
        limit = own.criterion + self.rival_bic + SLACK
        promising = self._promising(less, tried, best.scatter)
        worth = [p for i, p in enumerate(promising) if i < FITTED or (p.criterion < limit and i < 2 * FITTED)]
        fits = [self._with(less, p) for p in worth]
        fits += self._grouped(best, candidate)
        alike = self._nearly(best, candidate)
        near = [f for f in fits if f.candidates[-1].name == alike or self._is_rival(f, best, less)]
        near = [f for f in near if self._leaves_less(f, less)]
        # A C that is smaller at one value of the control signal alone may be a valve that opens just above the yield.
        limit = candidate.per_voltage
        found = [fitted for fitted in near if self._admissible(fitted, self._possible(fitted), at_limit=limit)]
        return found or [f for f in fits if self._is_gain(f, best, candidate)]

    def _nearly(self, best: Fitted, candidate: Candidate) -> str | None:
        """Return the effect that many would call one that is newly there with such values; None for no other."""
        if not candidate.absent:
            return None
        return nearly_others(without_laws(self._changed(best)), max(self._peaks)).get(candidate.name)

    def _is_rival(self, fitted: Fitted, best: Fitted, less: Fitted) -> bool:
        """Whether a fit does what the best one does: nearly as likely, or it leaves no more than the model misses.

        Where much has no name one that is as good is enough, if it explains most of what the change does.

        One with more numbers has to pay for them: else it is the same change told at greater length.
        """
        new = fitted.candidates[-1]
        if fitted.values.size > best.values.size or (new.flexible and new.absent):
            return fitted.bic <= best.bic
        if fitted.bic <= best.bic + self.rival_bic:
            return True
        if self.left(fitted) <= self.hidden(best):
            return True
        if self.left(best) < AS_GOOD * self._least(best):
            return False
        return self._as_good(fitted, best) and AS_GOOD * self.left(fitted) <= self.left(less)

    def _is_gain(self, fitted: Fitted, best: Fitted, candidate: Candidate) -> bool:
        """Whether T0, C and k changed as a gain of the load cell changes them, which is one number however many do.

        At one control signal alone: what makes all three larger by a share makes them so hardly at every one.
        """
        added = [c for c in fitted.candidates if c.name in ELEMENT_COLUMNS and c not in best.candidates]
        if candidate.name != GAIN or not added or any(c.per_voltage for c in self.candidates):
            return False
        more = (fitted.values.size - best.values.size) * float(np.log(self.regression.likelihood.size))
        return fitted.bic - more <= best.bic + self.rival_bic

    def perhaps(self, best: Fitted) -> list[Fitted]:
        """Return the fits with one change more that is nearly adopted, or a rival of such a one.

        Where the best one leaves something also those that leave nothing, T0, C and k together among them: too few
        tests make them sure, and what they explain is not without a name.
        """
        if len(best.candidates) >= MOST_CHANGES:
            return []
        added = self._additions(best, possible=True)
        more = [f for f in added if f.bic < best.bic and self._predicts(f, f.candidates[-1])]
        enough = best.bic + self.adopt_bic + self.rival_bic
        if more and more[0].bic <= enough:
            return [f for f in more if f.bic <= max(enough, more[0].bic + self.rival_bic)]
        if self.leaves_nothing(best):
            return []
        if not best.candidates:
            more += [self._fit(group, np.zeros(len(group)), best.scatter) for group in self._groups()]
        return sorted((f for f in more if f.bic < best.bic and self.leaves_nothing(f)), key=lambda f: f.bic)

    def _grouped(self, best: Fitted, candidate: Candidate) -> list[Fitted]:
        """Return the fits with several of T0, C and k in the place of a gain, and a gain in the place of several."""
        single = self._single()
        others = tuple(c for c in best.candidates if c.name not in single)
        if candidate.name == GAIN:
            groups = self._groups()
        elif candidate.name in ELEMENT_COLUMNS and sum(c.name in ELEMENT_COLUMNS for c in best.candidates) > 1:
            groups = [(single[GAIN],), *((single[GAIN], single[n]) for n in ELEMENT_COLUMNS if n in single)]
        else:
            return []
        found = []
        for group in groups:
            together = (*others, *group)
            if len(together) > MOST_CHANGES or frozenset(together) == frozenset(best.candidates):
                continue
            start = [best.values_of(c) for c in others] + [np.zeros(len(c.coordinates)) for c in group]
            found.append(self._fit(together, np.concatenate(start), best.scatter))
        return found

    def _single(self) -> dict[str, Candidate]:
        """Return the candidates of T0, C, k and the gain that are the same at every control signal, by name."""
        return {
            c.name: c for c in reversed(self.candidates) if not c.per_voltage and c.name in (*ELEMENT_COLUMNS, GAIN)
        }

    def _groups(self) -> list[tuple[Candidate, ...]]:
        """Return two or all of T0, C and k."""
        single = self._single()
        names = [name for name in ELEMENT_COLUMNS if name in single]
        return [tuple(single[n] for n in group) for size in (2, 3) for group in combinations(names, size)]
