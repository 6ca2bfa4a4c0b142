"""Whether the data support an effect by itself, or it is spurious: an effect that stands in for another cause."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pzd.damper.effect import Effect, Parameter
from pzd.damper.effects import library
from pzd.damper.model import Damper, against_nature
from pzd.diagnosis.campaign import Evidence
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit.least_squares import LEVEL, FitResult, fit, profiled_misfit, projected_out, standard_errors
from pzd.diagnosis.fit.likelihood import simulated_force
from pzd.diagnosis.fit.problem import ZERO, Problem
from pzd.diagnosis.fit.sensitivities import force_jacobian
from pzd.diagnosis.gap import gap_in_force, visible_gap
from pzd.diagnosis.search.candidates import Candidate, starts_of, towards_neutral
from pzd.diagnosis.thresholds import (
    FAINT,
    FAINTEST,
    HALVES_ALIKE,
    HALVES_LOSE,
    HALVES_SIGNIFICANCE,
    LEAST_CLOSED,
    OF_EACH_TEST,
    SIZES_AVERAGED,
    STOP_BEGINS,
    STOP_OTHER_SIDE,
    TRIVIAL_SIZE,
)
from pzd.record import Array

# ----------------------------------------------------------------------------------------------------


WITHIN_TEST_SCATTER = "so small that it counts as an offset or a delay of the tests"
MAY_BE_TEST_SCATTER = "would fit better, and may be no more than an offset or a delay that each test has of its own"
MAY_BE_CHANCE = "would fit better, though not by so much that chance is out of the question"


def insufficient_support(evidence: Evidence, config: DiagnoseConfig, candidate: Candidate) -> str | None:
    """Why a candidate is too little to be adopted, None where it is not."""
    if candidate.delta_bic > config.adopt_bic:
        return "does not pay"
    if candidate.explained < config.visible:
        return f"moves the force by less than {100 * config.visible:g} % of peak"
    if small := trivial(candidate.fitted, candidate.effect, evidence.whole.scales.low_force):
        return small
    return (
        misplaced_end_stop(candidate.fitted.damper, evidence.whole.scales.stroke)
        if candidate.effect == "end_stop"
        else None
    )


def misplaced_end_stop(damper: Damper, stroke: float) -> str | None:
    """Why an end stop is none by where it begins, None where that is near both ends of the stroke (half of it [m])."""
    begins = np.atleast_1d(damper.effects["end_stop"]["x_e"])
    further, nearer = (stroke - float(np.max(begins)) + side * abs(damper.zero_m) for side in (1.0, -1.0))
    if nearer <= 0.0 or nearer**2 < STOP_OTHER_SIDE * further**2:
        return "stand-in: acts at one end of the stroke alone"
    if float(np.min(begins)) - abs(damper.zero_m) < STOP_BEGINS * stroke:
        return "stand-in: begins in the middle of the stroke, where no end stop does"
    return None


def leaves_gap(evidence: Evidence, config: DiagnoseConfig, before: FitResult, candidate: Candidate) -> str | None:
    """Why a candidate is a stand-in by the gap that it leaves open, None where it closes enough or noise hides it."""
    if not evidence.gap_is_significant(before, config):
        return None
    checks = [evidence.campaign.checks(fitted.damper) for fitted in (before, candidate.fitted)]
    gaps = [[size(each) for each in checks] for size in (visible_gap, gap_in_force)]
    closed = [left**2 <= (1.0 - LEAST_CLOSED) * open_before**2 for open_before, left in gaps]
    if any(closed) and all(left <= open_before for open_before, left in gaps):
        return None
    return f"stand-in: closes less than {LEAST_CLOSED:.0%} of the gap, or widens it"


def closes_gap(evidence: Evidence, config: DiagnoseConfig, before: FitResult, candidate: Candidate) -> bool:
    """Whether a candidate leaves so little of the gap that nothing more is looked for under a name."""
    return evidence.gap(candidate.fitted) <= max(config.unexplained_share * evidence.gap(before), config.negligible)


def trivial_size(effect: str, parameter: Parameter, force: float) -> float | None:
    """Below which value of a parameter an effect counts as nothing missing, None where every value counts.

    Parameters
    ----------
    effect : its name
    parameter : of the effect
    force : the lowest peak of the tests [N]
    """
    limit = TRIVIAL_SIZE.get((effect, parameter.name))
    return limit if limit is None or parameter.unit != "N" else limit * force


def trivial(fitted: FitResult, effect: str, force: float) -> str | None:
    """Why a common offset or delay is no effect: below what counts as one, or its 95 % interval reaches below that.

    Parameters
    ----------
    fitted : with the effect
    effect : its name; there is no reason where it is none of `OF_EACH_TEST`
    force : the lowest peak of the tests [N]
    """
    if effect not in OF_EACH_TEST:
        return None
    sizes = []
    for unknown, error in zip(fitted.unknowns, standard_errors(fitted), strict=True):
        if unknown.effect == effect and (unit := trivial_size(effect, unknown.parameter, force)) is not None:
            sizes.append((abs(unknown.value_in(fitted.damper)) / unit, LEVEL * error / unit))
    if not sizes or max(size - reach for size, reach in sizes) >= 1.0:
        return None
    return MAY_BE_TEST_SCATTER if max(size for size, _ in sizes) >= 1.0 else WITHIN_TEST_SCATTER


def spurious(
    evidence: Evidence, weighed: Evidence, config: DiagnoseConfig, before: FitResult, candidate: Candidate
) -> str | None:
    """Why an effect is a stand-in: it fails on tests that it was not fitted to, or takes other values on either half.

    Parameters
    ----------
    evidence : weighed by what is left without the candidate
    weighed : by what it leaves, so that each test's own gain and delay act along its force
    config : how much worse counts as worse
    before : the optimum without the candidate
    candidate : the optimum with it
    """
    halves = weighed.halves
    if any(not half.observations for half in halves):
        return None
    fits = [fit(half, candidate.fitted.effects, half.start_with(candidate.fitted.damper)) for half in halves]
    without = fit(evidence.halves[0], before.effects, before.optimum)
    with_it, left = (
        profiled_misfit(halves[1], fits[0].damper),
        profiled_misfit(evidence.validation_problem(weighed), without.damper),
    )
    if with_it > left + config.rival_bic:
        return "stand-in: widens the gap on tests it was not fitted to"
    fresh = tuple(e for e in candidate.fitted.effects if e not in before.effects) or (candidate.effect,)
    if not _halves_agree(halves, (fits[0], fits[1]), fresh, HALVES_LOSE * -candidate.delta_bic):
        return "stand-in: takes other values on either half of the tests"
    return None


def _halves_agree(
    halves: tuple[Problem, Problem], fits: tuple[FitResult, FitResult], effects: Sequence[str], negligible: float
) -> bool:
    """Whether one half of the tests does nearly as well with the values that the other half gives to some effects.

    Equation: min_ij (|r_j(p_i)|^2 - |r_j(p_j)|^2) < max(2 chi2_e, L)   Source: likelihood ratio, a half for granted

    Parameters
    ----------
    halves : of the tests
    fits : of each
    effects : whose values are compared
    negligible : misfit L that is little beside what the effects explain
    """
    from scipy.special import chdtri

    values = [
        [u.value_in(f.damper) for u in f.unknowns if u.effect in effects and u.parameter is not ZERO] for f in fits
    ]
    if all(abs(a - b) <= HALVES_ALIKE * max(abs(a), abs(b)) for a, b in zip(*values, strict=True)):
        return True
    limit = 2.0 * float(chdtri(len(fits[0].unknowns), HALVES_SIGNIFICANCE))
    for half, own, other in ((halves[0], fits[0], fits[1]), (halves[1], fits[1], fits[0])):
        spread = max(1.0, own.misfit / max(own.size - own.optimum.size, 1))
        if profiled_misfit(half, other.damper) - own.misfit <= max(limit * spread, negligible):
            return True
    return False


# ----------------------------------------------------------------------------------------------------
# How large a gap the tests leave to an effect, and how far that speaks for the effect or against it.
#
# The Bayesian criterion holds against an effect that the tests do not show it, even where they could not. Here the size
# of the gap is averaged over, so that tests that could not show an effect say nothing about it.


@dataclass(frozen=True)
class Detection:
    """What the tests say of the size of the gap that an effect would leave."""

    size: float
    """The likeliest, as a share of peak (r.m.s.); below zero where the effect would have to act the other way."""
    error: float
    """Its standard error."""
    gain: float
    """Misfit less at that size than without the effect."""
    shape_parameters: int
    """Parameters of the effect beside its size."""
    relevant_from: float = 0.0
    """Gap from which it counts; a smaller offset or delay may be one of the tests."""

    @property
    def interval(self) -> str:
        """The size with its 95 % interval, in words."""
        low, high = (max(self.size + side * LEVEL * self.error, 0.0) for side in (-1.0, 1.0))
        return f"a gap of {100 * self.size:.2g} ({100 * low:.2g} to {100 * high:.2g}) % of peak"

    def log_odds(self, low: float, high: float) -> float:
        """Ln of the likelihood of a gap between two sizes over that of none.

        Equation: G / 2 - n/2 ln(1 + (max(g, low) / s)^2) + ln mean exp(-(x - g)^2 / 2 s^2), x even in ln x, g the
        size, s its error, G the gain, n the other parameters
                                                        Source: Kass and Raftery 1995, J. Am. Stat. Assoc. 90, eq. (2)
        """
        from scipy.special import logsumexp

        share = (np.arange(SIZES_AVERAGED) + 0.5) / SIZES_AVERAGED
        away = (low * (high / low) ** share - self.size) / self.error
        known = max(self.size, low) / self.error
        mean = logsumexp(-0.5 * away**2) - np.log(SIZES_AVERAGED)
        return float(0.5 * self.gain - 0.5 * self.shape_parameters * np.log1p(known**2) + mean)


def detections(problem: Problem, before: FitResult, tried: Sequence[Candidate]) -> dict[str, tuple[Detection, ...]]:
    """What the tests say of the gap of every candidate: of its optimum where that was searched for, else of a trace.

    Parameters
    ----------
    problem : what is fitted to what
    before : the optimum without them
    tried : each fitted beside `before`, or as faint as it is looked for
    """
    tangent = _TangentSpace.at(problem, before)
    force = problem.scales.low_force
    searched = {
        c.effect: told for c in tried if (told := detection_from_fit(c, force, tangent.gap(c.fitted.simulated)))
    }
    others = [library()[c.effect] for c in tried if c.effect not in searched]
    linear = [e for e in others if e.place != "material" or problem.pooled_temperatures() is problem]
    traced = {e.name: [tangent.of_trace(e, trace) for trace in _traces(problem, before, e)] for e in linear}
    return searched | {name: tuple(each for each in found if each) for name, found in traced.items()}


def detection_from_fit(candidate: Candidate, force: float, gap: float | None = None) -> tuple[Detection, ...]:
    """What the optimum of a candidate says of its gap; nothing where it fits no better than without.

    Equation: g = m, s = m / sqrt(A), G = D; A and D over max(1, |r|^2 / (n - p)); A and D: how far the candidate moves
    the residuals, and lowers the misfit

    Parameters
    ----------
    candidate : fitted
    force : the lowest peak of the tests [N]
    gap : m that it closes; how far it moves the force where none is given
    """
    size = candidate.explained if gap is None else gap
    if not candidate.searched or min(candidate.misfit_drop, candidate.residual_change, size) <= 0.0:
        return ()
    fitted = candidate.fitted
    spread = max(1.0, fitted.misfit / max(fitted.size - fitted.optimum.size, 1))
    shape = sum(u.effect == candidate.effect for u in fitted.unknowns) - 1
    error = size / float(np.sqrt(candidate.residual_change / spread))
    relevant_from = _smallest_relevant_gap(fitted.damper, candidate.effect, force, size)
    return (Detection(size, error, candidate.misfit_drop / spread, shape, relevant_from),)


def _smallest_relevant_gap(damper: Damper, effect: str, force: float, gap: float) -> float:
    """The gap of an effect as small as still counts, in proportion to that of the values it has in a damper."""
    trivial = [(p.name, trivial_size(effect, p, force)) for p in library()[effect].parameters]
    sizes = [float(np.max(np.abs(damper.effects[effect][name]))) / size for name, size in trivial if size is not None]
    return gap / max(sizes) if sizes and max(sizes) > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class _TangentSpace:
    """An optimum with what changes there, to first order, as its variables do."""

    problem: Problem
    before: FitResult
    forces: Array
    """(n, p) orthonormal: what of a change of the force its variables can take up, in `units`."""
    units: Array
    """(n,) of the force [N]: the peak of each record, and the root of the samples."""

    @classmethod
    def at(cls, problem: Problem, before: FitResult) -> _TangentSpace:
        counts = [o.peak * np.sqrt(o.measured.size * len(problem.observations)) for o in problem.observations]
        units = np.repeat(counts, [o.measured.size for o in problem.observations])
        forces = force_jacobian(problem, before.unknowns, before.optimum).dense() / units[:, np.newaxis]
        return cls(problem, before, np.asarray(np.linalg.qr(forces).Q), units)

    def gap(self, simulated: Sequence[Array]) -> float:
        """R.m.s. of a change of the force that no other values of what stands before would bring about."""
        changed = (np.concatenate(simulated) - np.concatenate(self.before.simulated)) / self.units
        return float(np.linalg.norm(projected_out(self.forces, changed)))

    def of_trace(self, effect: Effect, trace: Array) -> Detection | None:
        """What the tests say of the gap of an effect that was not searched for; None where it can be none.

        It can be none where its trace shows nowhere, or has a value that is nowhere in nature. What stands before is
        fitted again to first order, and the misfit taken for a parabola in the size.

        Equation: u = d - J b, b = argmin |d - J b|; f = -r u / u u, g = f m, s = m / |u|, G = f^2 u u; r, d: the
        residuals and what the trace changes in them, J their slopes; u u over max(1, |r|^2 / (n - p))

        Parameters
        ----------
        effect : none of those before
        trace : its values in the units of the search, so faint that the force is linear in them
        """
        problem, before = self.problem, self.before
        spread = max(1.0, before.misfit / max(before.size - before.optimum.size, 1))
        unknowns = problem.unknowns((*before.effects, effect.name))
        damper = problem.point(np.concatenate([before.optimum, trace]), unknowns).damper
        if effect.name in against_nature(damper):
            return None
        simulated = [simulated_force(o, damper) for o in problem.observations]
        left = [o.standardised(o.measured - f) for o, f in zip(problem.observations, simulated, strict=True)]
        residual = np.concatenate(before.residuals)
        rest = projected_out(self.before.column_basis, np.concatenate(left) - residual)
        gap, power = self.gap(simulated), float(rest @ rest)
        if gap <= 0.0 or power <= 0.0:
            return None
        part = -float(residual @ rest) / power
        relevant_from = _smallest_relevant_gap(damper, effect.name, problem.scales.low_force, gap)
        return Detection(part * gap, gap * float(np.sqrt(spread / power)), part**2 * power / spread, 0, relevant_from)


def _traces(problem: Problem, before: FitResult, effect: Effect) -> Iterator[Array]:
    """Faint values of an effect in the units of the search, to either side where it is looked for from none on."""
    for start in starts_of(problem, before, effect):
        faint = towards_neutral(problem, before, effect, start, FAINT)
        yield from (faint,) if np.any(faint) else (faint + FAINTEST, faint - FAINTEST)


# ----------------------------------------------------------------------------------------------------
# The outcome of the search: the effects adopted, what was tried for each, and what would have done as well.


@dataclass(frozen=True, eq=False)
class SelectionStep:
    """One step: the candidates, best first, which of them was adopted, and which would have done as well."""

    tried: tuple[Candidate, ...]
    chosen: str | None
    rivals: tuple[str, ...] = ()
    rejected: frozenset[str] = frozenset()
    """Which candidates were stand-ins or too little, whatever they pay."""

    @property
    def contenders(self) -> tuple[Candidate, ...]:
        """What was tried and not refused."""
        return tuple(c for c in self.tried if c.effect not in self.rejected)


def rivals_of(chosen: Candidate, tried: Sequence[Candidate], config: DiagnoseConfig) -> tuple[str, ...]:
    """The other effects that explain a step as well as the one chosen, best first."""
    others = [c for c in tried if c.effect != chosen.effect]
    return tuple(c.effect for c in others if c.delta_bic - chosen.delta_bic < config.rival_bic)


@dataclass(frozen=True, eq=False)
class ConfounderMatch:
    """An effect adopted, and a force that is not in the library and would do as well in its place."""

    effect: str
    damper: Damper
    """With the effect."""
    confounder: str
    confounder_damper: Damper
    bic_difference: float
    """Bayesian criterion with that form less that with the effect; negative where the form does better."""

    @property
    def dampers(self) -> tuple[tuple[str, Damper], ...]:
        """Either with its name."""
        return (self.effect, self.damper), (self.confounder, self.confounder_damper)


@dataclass(frozen=True, eq=False)
class Selection:
    """What was adopted, and what was tried."""

    baseline: FitResult
    """No effect, on the samples seen."""
    fitted: FitResult
    """With all that was adopted, on the samples seen."""
    steps: tuple[SelectionStep, ...]
    reasons: dict[str, str]
    """Why an effect was adopted or not."""
    initial_evidence: Evidence
    """Weighed by what the plain damper leaves."""
    final_evidence: Evidence
    """Weighed by what the adopted damper leaves."""
    competing_confounders: tuple[ConfounderMatch, ...] = ()
    """What is not in the library and would do as well in the place of an effect adopted, or better."""
    undecided: tuple[str, ...] = ()
    """Effects that would fit better where nothing was adopted, and of which the tests do not say enough."""
    open_detections: Mapping[str, tuple[Detection, ...]] = field(default_factory=dict)
    """What the tests say of the gap of every effect that was tried beside all that was adopted."""

    @property
    def rival_dampers(self) -> tuple[tuple[str, Damper], ...]:
        """An effect adopted and its rivals, with the dampers fitted with them; empty without rivals."""
        if not self._contested:
            return tuple(pair for competition in self.competing_confounders[:1] for pair in competition.dampers)
        step = self._contested[-1]
        wanted = [name for name in (step.chosen, *step.rivals) if name == step.chosen or name in self.rivals]
        return tuple((c.effect, c.fitted.damper) for name in wanted for c in step.tried if c.effect == name)

    @property
    def rivals(self) -> tuple[str, ...]:
        """Effects that explain some step as well as the one adopted there, and were not adopted later."""
        found = dict.fromkeys(name for step in self._contested for name in step.rivals)
        return tuple(name for name in found if name not in self.adopted)

    @property
    def _contested(self) -> list[SelectionStep]:
        """The steps that stand and in which another effect would have done as well."""
        return [r for r in self.steps if r.chosen in self.adopted and not set(r.rivals) <= set(self.adopted)]

    def deciding(self, effect: str) -> tuple[Candidate, ...]:
        """The round that decided on an effect: the last in which it was tried; empty for a forced one."""
        return next((r.tried for r in reversed(self.steps) if any(c.effect == effect for c in r.tried)), ())

    @property
    def adopted(self) -> tuple[str, ...]:
        """The effects adopted, best first."""
        return self.fitted.effects
