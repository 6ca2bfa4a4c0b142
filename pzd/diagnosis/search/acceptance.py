"""Acceptance of a candidate: whether the data support it, or it is spurious, standing in for another cause."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pzd.damper.effect import Effect, Parameter
from pzd.damper.effects import library
from pzd.damper.model import Damper, against_nature
from pzd.diagnosis import thresholds
from pzd.diagnosis.campaign import Evidence
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit import least_squares
from pzd.diagnosis.fit.least_squares import FitResult
from pzd.diagnosis.fit.likelihood import prompt_force, shown_force
from pzd.diagnosis.fit.problem import ZERO, Problem
from pzd.diagnosis.fit.sensitivities import force_jacobian
from pzd.diagnosis.gap import gap_in_force, visible_gap
from pzd.diagnosis.search.candidates import Candidate, late_instead_of_elastic, starts_of, towards_neutral
from pzd.diagnosis.search.determination import (
    ANOTHER_DAMPING,
    AT_LIMIT,
    at_limits,
    contradiction,
    nearly_others,
    opens_below_friction,
)
from pzd.fit.intervals import LEVEL
from pzd.identification.trust import WEAK_WIDTH
from pzd.record import Array
from pzd.signals.measures import rms

WITHIN_TEST_SCATTER = "so small that it counts as an offset or a delay of the tests"
MAY_BE_TEST_SCATTER = "would fit better, and may be no more than an offset or a delay that each test has of its own"
MAY_BE_CHANCE = "would fit better, though not by so much that chance is out of the question"
LATE_OR_ELASTIC = (
    "would fit as well in the place of the oil spring: neither the flank of the yield nor the frequencies of these "
    "tests tell a force that is recorded late from a soft oil spring; tests at frequencies farther apart would"
)


def insufficient_support(evidence: Evidence, config: DiagnoseConfig, candidate: Candidate) -> str | None:
    """Say why a candidate is too little to be adopted; None where it is not.

    Parameters
    ----------
    evidence : of the tests, for the scales of their motion
    config : the block diagnose: what pays, and what is visible
    candidate : optimum with one more effect
    """
    if candidate.delta_bic > config.adopt_bic:
        return "does not pay"
    if candidate.explained < config.visible:
        return f"moves the force by less than {100 * config.visible:g} % of peak"
    return trivial(candidate.fitted, candidate.effect, evidence.whole.scales.low_force) or _misplaced(
        candidate, evidence.whole
    )


def _misplaced(candidate: Candidate, problem: Problem) -> str | None:
    """Say why the values of a candidate are those of no such effect."""
    if candidate.effect == "relief_valve" and opens_below_friction(candidate.fitted.damper):
        return ANOTHER_DAMPING
    if candidate.effect in at_limits(candidate.fitted):
        return AT_LIMIT
    if against := contradiction(candidate.fitted.damper, candidate.effect, problem.scales.force):
        return against
    if candidate.effect != "end_stop":
        return None
    motions = [(o.motion.displacement, o.motion.velocity) for o in problem.observations]
    return misplaced_end_stop(candidate.fitted.damper, problem.scales.stroke, motions)


def misplaced_end_stop(damper: Damper, stroke: float, motions: Sequence[tuple[Array, Array]]) -> str | None:
    """Say why an end stop is none by where it begins; None where that is towards an end of the half stroke [m].

    At one end alone it is one: a bump stop, or a stroke that is off the middle. What one motion alone shows near its
    reversal, any law of a reversal may be: another amplitude or frequency has to reach the stop as well.

    Parameters
    ----------
    damper : with the stop
    stroke : half of the whole one [m]
    motions : (n,) displacement [m] and speed [m/s] of each test
    """
    begins = float(np.min(damper.effects["end_stop"]["x_e"]))
    if begins - abs(damper.zero_m) < thresholds.END_STOP_BEGINS * stroke:
        return "stand-in: begins in the middle of the stroke, where no end stop does"
    sizes = np.array([[np.max(np.abs(x - damper.zero_m)), np.max(np.abs(v))] for x, v in motions])
    there = sizes[sizes[:, 0] > begins]  # (m, 2) reach and largest speed of the motions that come to the stop
    by_two = there.size > 0 and bool(np.any(np.ptp(there, axis=0) > thresholds.OTHER_MOTION * there.max(axis=0)))
    by = thresholds.END_STOP_BEGINS_BY if by_two else thresholds.LONE_END_STOP_BEGINS_BY
    if begins - abs(damper.zero_m) > by * stroke:
        return "stand-in: begins where the tests turn round, as everything at a reversal does"
    return None


def leaves_gap(evidence: Evidence, config: DiagnoseConfig, before: FitResult, candidate: Candidate) -> str | None:
    """Say why a candidate is spurious by the gap that it leaves; None where it closes enough or noise hides it.

    Parameters
    ----------
    evidence : for the gap of a damper
    config : the block diagnose: which gap is significant
    before : optimum without the candidate
    candidate : optimum with one more effect
    """
    if not evidence.gap_is_significant(before, config):
        return None
    checks = [evidence.campaign.checks(fitted.damper) for fitted in (before, candidate.fitted)]
    gaps = [[size(each) for each in checks] for size in (visible_gap, gap_in_force)]
    closed = [left**2 <= (1.0 - thresholds.LEAST_CLOSED) * open_before**2 for open_before, left in gaps]
    if any(closed) and all(left <= open_before for open_before, left in gaps):
        return None
    return f"stand-in: closes less than {thresholds.LEAST_CLOSED:.0%} of the gap, or widens it"


def closes_gap(evidence: Evidence, config: DiagnoseConfig, before: FitResult, candidate: Candidate) -> bool:
    """Whether a candidate leaves so little of the gap that no further effect is looked for.

    Parameters
    ----------
    evidence : for the gap of a damper
    config : the block diagnose: the share of the gap that may be left, and which gap is negligible
    before : optimum without the candidate
    candidate : optimum with one more effect
    """
    return evidence.gap(candidate.fitted) <= max(config.unexplained_share * evidence.gap(before), config.negligible)


def trivial_size(effect: str, parameter: Parameter, force: float) -> float | None:
    """Return the size of a parameter below which the effect counts as nothing missing; None where every size counts.

    Parameters
    ----------
    effect : its name
    parameter : of the effect
    force : the lowest peak of the tests [N]
    """
    limit = thresholds.TRIVIAL_SIZE.get((effect, parameter.name))
    return limit if limit is None or parameter.unit != "N" else limit * force


def trivial(fitted: FitResult, effect: str, force: float) -> str | None:
    """Say why a common offset or delay is no effect: it or its 95 % interval reaches below the size that counts.

    Parameters
    ----------
    fitted : optimum with the effect
    effect : its name; there is no reason where it is none of `thresholds.NUISANCE_EFFECTS`
    force : the lowest peak of the tests [N]
    """
    if effect not in thresholds.NUISANCE_EFFECTS:
        return None
    sizes = []
    for unknown, error in zip(fitted.unknowns, least_squares.standard_errors(fitted), strict=True):
        if unknown.effect == effect and (unit := trivial_size(effect, unknown.parameter, force)) is not None:
            sizes.append((abs(unknown.value_in(fitted.damper)) / unit, LEVEL * error / unit))
    if not sizes or max(size - width for size, width in sizes) >= 1.0:
        return None
    return MAY_BE_TEST_SCATTER if max(size for size, _ in sizes) >= 1.0 else WITHIN_TEST_SCATTER


def late_or_elastic(
    weigh: Callable[[Damper], Evidence], problem: Problem, before: FitResult, config: DiagnoseConfig
) -> bool:
    """Whether a force that is recorded late beside rigid oil springs would do as well as the springs.

    At one frequency a viscous damper behind a spring lags as a late force does. A friction shows the spring in its
    flank, where samples resolve it; where they do not, its jump lies elsewhere by either damper, and the weights of the
    one count that of the other as a gap. So the late force is also asked by its own: whether it leaves less by them
    than the springs do, and as little as these by theirs.

    Parameters
    ----------
    weigh : gives the evidence weighed by what a damper leaves
    problem : observations and starting values, weighed by what the springs leave
    before : optimum without effects
    config : how near a rival comes
    """
    effect, rigid = library()["sensor_delay"], replace(problem, rigid=True)
    start = late_instead_of_elastic(problem, before, effect)
    if start is None or effect.name in config.forbid:
        return False
    if least_squares.fit(rigid, (), before.optimum).misfit - before.misfit < config.rival_bic:
        return False  # the tests do not show the springs
    late = least_squares.fit(rigid, (effect.name,), start)
    natural = not late.unphysical and late.unknowns[-1].value_in(late.damper) > 0.0
    if not natural or trivial(late, effect.name, rigid.scales.low_force) is not None:
        return False

    def pays(late: FitResult, springs: FitResult) -> float:
        fewer = springs.optimum.size - (late.optimum.size - len(problem.base))
        return late.misfit - springs.misfit - fewer * float(np.log(late.size))

    if pays(late, before) < config.rival_bic:
        return True
    own = weigh(late.damper)
    again = least_squares.fit(replace(own.whole, rigid=True), (effect.name,), late.optimum)
    leaves_less = pays(again, least_squares.refit(own.whole, before.damper)) < -config.rival_bic
    return leaves_less and pays(again, before) < config.rival_bic and not own.gap_is_significant(again, config)


def late_beside_springs(candidate: Candidate, problem: Problem, before: FitResult, config: DiagnoseConfig) -> bool:
    """Whether a late force pays and hardly moves the force: it takes a part of the lag that was the springs'.

    Parameters
    ----------
    candidate : optimum with it
    problem : observations, for the scales of their motion
    before : optimum without it
    config : how near a rival comes
    """
    fitted = candidate.fitted
    springs = zip(before.damper.base, fitted.damper.base, strict=True)
    stiffer = any(abs(one.k_N_per_m / other.k_N_per_m - 1.0) > WEAK_WIDTH for one, other in springs)
    pays = candidate.delta_bic <= -config.rival_bic and candidate.explained < config.visible
    natural = not fitted.unphysical and fitted.unknowns[-1].value_in(fitted.damper) > 0.0
    counts = trivial(fitted, candidate.effect, problem.scales.low_force) != WITHIN_TEST_SCATTER
    return pays and natural and stiffer and counts


def spurious(
    evidence: Evidence, weighed: Evidence, config: DiagnoseConfig, before: FitResult, candidate: Candidate
) -> str | None:
    """Say why an effect is spurious: it fails on tests not fitted, or differs between halves of the tests.

    Parameters
    ----------
    evidence : weighed by what the model leaves without the candidate
    weighed : by what the candidate leaves, so that each test's own gain and delay act along its force
    config : how much worse counts as worse
    before : optimum without the candidate
    candidate : optimum with it
    """
    halves = weighed.halves
    if any(not half.observations for half in halves):
        return None
    fits = [least_squares.refit(half, candidate.fitted.damper) for half in halves]
    without = least_squares.fit(evidence.halves[0], before.effects, before.optimum)
    left = [least_squares.profiled_misfit(half, without.damper) for half in evidence.halves_weighed_by(weighed)]
    # In the weights of the halves: where the model lacks something else as well, an effect takes a part of it along.
    explained = sum(without_it - fitted.misfit for without_it, fitted in zip(left, fits, strict=True))
    negligible = thresholds.HALVES_LOSS * explained
    # Where more than noise is left, all misfits are larger in proportion, and their differences by chance as well.
    chance = max(config.rival_bic * max(_spread(fitted) for fitted in fits), negligible)
    if least_squares.profiled_misfit(halves[1], fits[0].damper) > left[1] + chance:
        return "stand-in: widens the gap on tests it was not fitted to"
    fresh = tuple(e for e in candidate.fitted.effects if e not in before.effects) or (candidate.effect,)
    others = zip(halves, (fits[1].damper, fits[0].damper), strict=True)
    if not all(_acts(half, other, fresh, config.visible) for half, other in others):
        return None  # a half in which the effect does not act says nothing of its values
    if not _halves_agree(halves, (fits[0], fits[1]), fresh, negligible):
        return "stand-in: takes other values on either half of the tests"
    return None


def _spread(fitted: FitResult) -> float:
    """Return the mean square residual of a fit in units of noise, at least one."""
    return max(1.0, fitted.misfit / max(fitted.size - fitted.optimum.size, 1))


def _acts(problem: Problem, damper: Damper, effects: Sequence[str], visible: float) -> bool:
    """Whether some effects move the force of a damper visibly in any test; `visible` as a share of the test's peak."""
    without = damper.without_effects(*effects)
    moved = ((o, shown_force(o, damper) - shown_force(o, without)) for o in problem.observations)
    return any(rms(o.at_compared(change)) >= visible * o.peak for o, change in moved)


def _halves_agree(
    halves: tuple[Problem, Problem], fits: tuple[FitResult, FitResult], effects: Sequence[str], negligible: float
) -> bool:
    """Whether either half of the tests does nearly as well with the values that the other gives to some effects.

    Equation: min_ij (|r_j(p_i)|^2 - |r_j(p_j)|^2) < max(2 chi2_e, L)   Source: likelihood ratio, a half for granted

    Parameters
    ----------
    halves : problems of either half of the tests
    fits : optimum of each
    effects : whose values are compared
    negligible : misfit L that is small beside what the effects explain
    """
    from scipy.special import chdtri

    values = [
        [u.value_in(f.damper) for u in f.unknowns if u.effect in effects and u.parameter is not ZERO] for f in fits
    ]
    if all(abs(a - b) <= thresholds.HALVES_ALIKE * max(abs(a), abs(b)) for a, b in zip(*values, strict=True)):
        return True
    limit = 2.0 * float(chdtri(len(fits[0].unknowns), thresholds.HALVES_SIGNIFICANCE))
    for half, own, other in ((halves[0], fits[0], fits[1]), (halves[1], fits[1], fits[0])):
        if least_squares.profiled_misfit(half, other.damper) - own.misfit <= max(limit * _spread(own), negligible):
            return True
    return False


# --- Detection: size of the gap that an effect would leave
#
# The Bayesian criterion holds against an effect that the tests do not show it, even where they could not. Here the size
# of the gap is averaged over, so that tests that could not show an effect say nothing about it.


@dataclass(frozen=True)
class Detection:
    """Estimated size of the gap that an effect would leave.

    Examples
    --------
    >>> found = Detection(size=0.01, error=0.002, gain=25.0, shape_parameters=0)
    >>> found.interval
    'a gap of 1 (0.61 to 1.4) % of peak'
    >>> round(found.log_odds(0.0025, 0.25), 1)
    10.3
    """

    size: float
    """Most likely, as a share of peak (r.m.s.); negative where the effect would have to act the other way."""
    error: float
    """Its standard error."""
    gain: float
    """Drop of the misfit at that size."""
    shape_parameters: int
    """Parameters of the effect beside its size."""
    relevant_from: float = 0.0
    """Gap from which it counts; a smaller offset or delay may be one of the tests."""

    @property
    def interval(self) -> str:
        """Size with its 95 % interval, in words."""
        low, high = (max(self.size + side * LEVEL * self.error, 0.0) for side in (-1.0, 1.0))
        return f"a gap of {100 * self.size:.2g} ({100 * low:.2g} to {100 * high:.2g}) % of peak"

    def log_odds(self, low: float, high: float) -> float:
        """Compute ln of the likelihood of a gap between two sizes over that of none.

        Equation: G / 2 - n/2 ln(1 + (max(g, low) / s)^2) + ln mean exp(-(x - g)^2 / 2 s^2), x even in ln x, g the
        size, s its error, G the gain, n the other parameters
                                                        Source: Kass and Raftery 1995, J. Am. Stat. Assoc. 90, eq. (2)
        """
        from scipy.special import logsumexp

        share = (np.arange(thresholds.SIZES_AVERAGED) + 0.5) / thresholds.SIZES_AVERAGED
        away = (low * (high / low) ** share - self.size) / self.error
        known = max(self.size, low) / self.error
        mean = logsumexp(-0.5 * away**2) - np.log(thresholds.SIZES_AVERAGED)
        return float(0.5 * self.gain - 0.5 * self.shape_parameters * np.log1p(known**2) + mean)


def detections(problem: Problem, before: FitResult, tried: Sequence[Candidate]) -> dict[str, tuple[Detection, ...]]:
    """Estimate the gap of every candidate: from its optimum where that was searched for, else from its faintest values.

    Parameters
    ----------
    problem : observations and starting values
    before : optimum without them
    tried : candidates beside `before`
    """
    tangent = _TangentSpace.at(problem, before)
    force = problem.scales.low_force
    searched = {
        c.effect: found for c in tried if (found := detection_from_fit(c, force, tangent.gap(c.fitted.simulated)))
    }
    others = [library()[c.effect] for c in tried if c.effect not in searched]
    linear = [e for e in others if e.place != "material" or problem.pooled_temperatures() is problem]
    traced = {e.name: [tangent.of_trace(e, *pair) for pair in _traces(problem, before, e)] for e in linear}
    return searched | {name: tuple(each for each in found if each) for name, found in traced.items()}


def detection_from_fit(candidate: Candidate, force: float, gap: float | None = None) -> tuple[Detection, ...]:
    """Estimate the gap of a candidate from its optimum; nothing where it fits no better than without.

    Equation: g = m, s = m / sqrt(A), G = D; A and D over max(1, |r|^2 / (n - p)); A and D: how far the candidate moves
    the residuals, and lowers the misfit

    Parameters
    ----------
    candidate : fitted
    force : the lowest peak of the tests [N]
    gap : gap m that it closes; its change of the force where none is given
    """
    size = candidate.explained if gap is None else gap
    if not candidate.searched or min(candidate.misfit_drop, candidate.residual_change, size) <= 0.0:
        return ()
    fitted = candidate.fitted
    spread = _spread(fitted)
    shape = sum(u.effect == candidate.effect for u in fitted.unknowns) - 1
    error = size / float(np.sqrt(candidate.residual_change / spread))
    relevant_from = _smallest_relevant_gap(fitted.damper, candidate.effect, force, size)
    return (Detection(size, error, candidate.misfit_drop / spread, shape, relevant_from),)


def _smallest_relevant_gap(damper: Damper, effect: str, force: float, gap: float) -> float:
    """Return the gap of an effect at the smallest size that counts, in proportion to that of its present values."""
    trivial = [(p.name, trivial_size(effect, p, force)) for p in library()[effect].parameters]
    sizes = [float(np.max(np.abs(damper.effects[effect][name]))) / size for name, size in trivial if size is not None]
    return gap / max(sizes) if sizes and max(sizes) > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class _TangentSpace:
    """An optimum, with the changes to first order by its variables."""

    problem: Problem
    before: FitResult
    forces: Array
    """(n, p) orthonormal basis of the changes of the force by its variables, in `units`."""
    units: Array
    """(n,) of the force [N]: the peak of each record, and the root of the samples."""

    @classmethod
    def at(cls, problem: Problem, before: FitResult) -> _TangentSpace:
        counts = [o.peak * np.sqrt(o.measured.size * len(problem.observations)) for o in problem.observations]
        units = np.repeat(counts, [o.measured.size for o in problem.observations])
        forces = force_jacobian(problem, before.unknowns, before.optimum).dense() / units[:, np.newaxis]
        return cls(problem, before, np.asarray(np.linalg.qr(forces).Q), units)

    def gap(self, simulated: Sequence[Array], reference: Sequence[Array] | None = None) -> float:
        """Compute the r.m.s. change of the force that no other values of the present variables would bring about."""
        reference = self.before.simulated if reference is None else reference
        changed = (np.concatenate(simulated) - np.concatenate(reference)) / self.units
        return float(np.linalg.norm(least_squares.projected_out(self.forces, changed)))

    def of_trace(self, effect: Effect, trace: Array, fainter: Array) -> Detection | None:
        """Estimate the gap of an effect that was not searched for; None where it shows nowhere or is impossible.

        The present variables are refitted to first order, and the misfit is taken as a parabola in the size. Its slope
        is that between two small sizes: a rigid damper takes its closed form without effects alone, and beside an
        effect of no size its path differs from that already.

        Equation: u = d - J b, b = argmin |d - J b|; f = -r u / u u, g = f m, s = m / |u|, G = f^2 u u; r, d: the
        residuals and what the trace changes in them, J their slopes; u u over max(1, |r|^2 / (n - p))

        Parameters
        ----------
        effect : not among those before
        trace : its values in the units of the search, so small that the force is linear in them
        fainter : values half as far from those that switch it off
        """
        problem, before = self.problem, self.before
        spread = _spread(before)
        unknowns = problem.unknowns((*before.effects, effect.name))
        damper, half = (problem.point(np.concatenate([before.optimum, x]), unknowns).damper for x in (trace, fainter))
        if effect.name in against_nature(damper):
            return None
        (simulated, left), (simulated_half, left_half) = self._compared(damper), self._compared(half)
        residual = np.concatenate(before.residuals)
        rest = least_squares.projected_out(self.before.column_basis, 2.0 * (left - left_half))
        gap, power = 2.0 * self.gap(simulated, simulated_half), float(rest @ rest)
        if gap <= 0.0 or power <= 0.0:
            return None
        part = -float(residual @ rest) / power
        relevant_from = _smallest_relevant_gap(damper, effect.name, problem.scales.low_force, gap)
        return Detection(part * gap, gap * float(np.sqrt(spread / power)), part**2 * power / spread, 0, relevant_from)

    def _compared(self, damper: Damper) -> tuple[list[Array], Array]:
        """Return the force of a damper at the compared samples of each observation [N], and all residuals (w,)."""
        observed = self.problem.observations
        simulated = [(o, *prompt_force(o, damper)) for o in observed]
        left = [o.residual_and_slopes(force, np.zeros((force.size, 0)), s)[:, 0] for o, force, s in simulated]
        return [o.at_compared(o.through_sensors(force, s)) for o, force, s in simulated], np.concatenate(left)


def _traces(problem: Problem, before: FitResult, effect: Effect) -> Iterator[tuple[Array, Array]]:
    """Yield small values of an effect in the units of the search, to either side where it starts from zero.

    Beside them those half as far from its being off.
    """
    for start in starts_of(problem, before, effect):
        faint, fainter = (
            towards_neutral(problem, before, effect, start, share * thresholds.LINEARISED_SHARE) for share in (1.0, 0.5)
        )
        if np.any(faint):
            yield faint, fainter
        else:
            for away in (thresholds.LINEARISED_FROM_ZERO, -thresholds.LINEARISED_FROM_ZERO):
                yield faint + away, faint + 0.5 * away


# --- Outcome of the search


@dataclass(frozen=True, eq=False)
class SelectionStep:
    """One step: candidates, best first, the one adopted, and its rivals."""

    tried: tuple[Candidate, ...]
    chosen: str | None
    rivals: tuple[str, ...] = ()
    rejected: frozenset[str] = frozenset()
    """Candidates that were spurious or too little, whatever their criterion."""

    @property
    def contenders(self) -> tuple[Candidate, ...]:
        """Candidates that were not rejected."""
        return tuple(c for c in self.tried if c.effect not in self.rejected)


def rivals_of(chosen: Candidate, tried: Sequence[Candidate], config: DiagnoseConfig) -> tuple[str, ...]:
    """Return the other effects that explain a step as well as the chosen one, best first.

    A law that gives the force of the chosen one by more numbers is none: a branch that never slips is a spring, a mount
    that gives way at once is a play, a gas that does not harden is an offset.

    Parameters
    ----------
    chosen : candidate that is adopted in this step
    tried : candidates of the step, best first, the chosen one among them
    config : the block diagnose: by how much of BIC a rival may be worse
    """
    others = [c for c in tried if c.effect != chosen.effect and not _is_chosen_by_more(c, chosen)]
    return tuple(
        c.effect for c in others if c.delta_bic - chosen.delta_bic < config.rival_bic or _is_limit_of(c, chosen)
    )


def distinct(step: SelectionStep) -> list[Candidate]:
    """Return the contenders of a step without those that are the chosen one by more numbers, which say nothing else."""
    chosen = next((c for c in step.contenders if c.effect == step.chosen), None)
    if chosen is None:
        return list(step.contenders)
    return [c for c in step.contenders if c is chosen or not _is_chosen_by_more(c, chosen)]


def _is_chosen_by_more(other: Candidate, chosen: Candidate) -> bool:
    """Whether a law gives the force of the chosen one by more numbers, or has come to the limit where it is that."""
    return says_the_same(other, chosen) or has_come_down_to(other, chosen)


def says_the_same(other: Candidate, chosen: Candidate) -> bool:
    """Whether a law with more parameters gives the same force as the chosen one."""
    more = other.fitted.optimum.size > chosen.fitted.optimum.size
    return more and _share_apart(other, chosen) < thresholds.SAME_FORCE


def has_come_down_to(law: Candidate, other: Candidate) -> bool:
    """Whether a law ends at a limit where it gives nearly the force of another one with fewer parameters.

    Where a play meets its stops a smoothed displacement has no corner, and a mount of next to no force follows it best.
    """
    return _is_limit_of(other, law) and law.effect in at_limits(law.fitted)


def _is_limit_of(other: Candidate, chosen: Candidate) -> bool:
    """Whether a law with fewer parameters gives nearly the force of the chosen one, which is near its limit then."""
    fewer = other.fitted.optimum.size < chosen.fitted.optimum.size
    return fewer and _share_apart(other, chosen) < thresholds.LIMIT_CASE


def _share_apart(other: Candidate, chosen: Candidate) -> float:
    """Compute how far two candidates are apart, as a share of what the chosen one does to the residuals.

    Equation: |r_other - r_chosen|^2 / |r_chosen - r_without|^2
    """
    if other.fitted.size != chosen.fitted.size or chosen.residual_change == 0.0:
        return np.inf
    apart = np.concatenate(other.fitted.residuals) - np.concatenate(chosen.fitted.residuals)
    return float(apart @ apart) / chosen.residual_change


@dataclass(frozen=True, eq=False)
class ConfounderMatch:
    """An adopted effect, and a confounder outside the library that would do as well in its place."""

    effect: str
    damper: Damper
    """With the effect."""
    confounder: str
    confounder_damper: Damper
    bic_difference: float
    """Bayesian criterion with the confounder less that with the effect; negative where the confounder does better."""

    @property
    def dampers(self) -> tuple[tuple[str, Damper], ...]:
        """Either damper with its name."""
        return (self.effect, self.damper), (self.confounder, self.confounder_damper)


@dataclass(frozen=True, eq=False)
class Selection:
    """Outcome of the search: effects adopted, and what was tried."""

    baseline: FitResult
    """Without effects, on the samples seen."""
    fitted: FitResult
    """With all adopted effects, on the samples seen."""
    steps: tuple[SelectionStep, ...]
    reasons: dict[str, str]
    """Why an effect was adopted or not."""
    initial_evidence: Evidence
    """Weighed by what the baseline leaves."""
    final_evidence: Evidence
    """Weighed by what the adopted damper leaves."""
    competing_confounders: tuple[ConfounderMatch, ...] = ()
    """Confounders that would do as well in the place of an adopted effect, or better."""
    undecided: tuple[str, ...] = ()
    """Effects that would fit better where nothing was adopted, and about which the tests say too little."""
    open_detections: Mapping[str, tuple[Detection, ...]] = field(default_factory=dict)
    """Estimated gap of every effect that was tried beside all adopted ones."""

    @property
    def rival_dampers(self) -> tuple[tuple[str, Damper], ...]:
        """An adopted effect and its rivals, with the dampers fitted with them; empty without rivals."""
        if not self._undecided_steps:
            return tuple(pair for match in self.competing_confounders[:1] for pair in match.dampers)
        step = self._undecided_steps[-1]
        wanted = [name for name in (step.chosen, *step.rivals) if name == step.chosen or name in self.rivals]
        return tuple((c.effect, c.fitted.damper) for name in wanted for c in step.tried if c.effect == name)

    @property
    def rivals(self) -> tuple[str, ...]:
        """Effects not adopted that explain some step as well as the one adopted there, or that it nearly is."""
        found = [*(name for step in self._undecided_steps for name in step.rivals), *self.nearly.values()]
        return tuple(name for name in dict.fromkeys(found) if name not in self.adopted)

    @property
    def nearly(self) -> dict[str, str]:
        """By adopted effect, which other one it nearly is by its values."""
        others = nearly_others(self.fitted.damper, self.final_evidence.whole.scales.force)
        return {name: other for name, other in others.items() if name in self.adopted}

    @property
    def _undecided_steps(self) -> list[SelectionStep]:
        """Steps that stand and in which another effect would have done as well."""
        return [r for r in self.steps if r.chosen in self.adopted and not set(r.rivals) <= set(self.adopted)]

    def deciding(self, effect: str) -> tuple[Candidate, ...]:
        """Return the candidates of the last step in which an effect was tried; empty for a forced one."""
        return next((r.tried for r in reversed(self.steps) if any(c.effect == effect for c in r.tried)), ())

    @property
    def adopted(self) -> tuple[str, ...]:
        """Effects adopted, best first."""
        return self.fitted.effects
