"""Which effects of a fit are none: off as well, at a limit, cancelled by another, no constant, or T0 and C anew.

Such an effect may lower the misfit all the same. Outside the tests it does anything: a stop that begins just beyond the
stroke, two forces of kilonewtons that cancel within it. So it is neither adopted nor handed on, and the rest is fitted
again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from pzd.damper.compose import static_force
from pzd.damper.confounders import known
from pzd.damper.effect import NODE_VOLTAGES, Beside
from pzd.damper.effects import library
from pzd.damper.model import Damper
from pzd.diagnosis import thresholds
from pzd.diagnosis.fit.least_squares import FitResult, search_errors, standard_errors
from pzd.diagnosis.fit.likelihood import shown_force
from pzd.diagnosis.fit.problem import ZERO, Problem
from pzd.fit.intervals import LEVEL, between_tests
from pzd.record import Array
from pzd.signals.measures import rms

MAY_BE_OFF = "stand-in: its strength may as well be zero"
AT_LIMIT = "stand-in: ends at a limit, beyond which it would fit better still"
CANCELLED = "stand-in: cancels another effect, and neither is known by itself"
ANOTHER_DAMPING = "stand-in: opens below T0, where it is another C"


def undetermined(problem: Problem, fitted: FitResult, level: float = LEVEL) -> dict[str, str]:
    """Return the effects of a fit that are none, each with the reason.

    Parameters
    ----------
    problem : observations and limits of the fit
    fitted : its optimum
    level : standard errors by which a strength has to differ from none
    """
    shown = showing(fitted, level)
    found = {name: MAY_BE_OFF for name in fitted.effects if name not in shown}
    found |= {name: AT_LIMIT for name in at_limits(fitted) if name not in found}
    if opens_below_friction(fitted.damper):
        found["relief_valve"] = ANOTHER_DAMPING
    return found | {name: CANCELLED for pair in cancelling(problem, fitted) for name in pair if name not in found}


def showing(fitted: FitResult, level: float = LEVEL) -> set[str]:
    """Return the effects that are not off: the interval of the strength, the first parameter, excludes that value.

    By default that of 95 %, else so many standard errors to either side; it is wider where the tests disagree.

    One whose parameters differ by voltage shows where that of any voltage does.
    """
    strengths = {name: library()[name].parameters[0] for name in fitted.effects if name in library()}
    unknowns = zip(fitted.unknowns, level * standard_errors(fitted), strict=True)
    return {
        u.effect
        for u, error in unknowns
        if u.parameter == strengths.get(u.effect) and not abs(u.value_in(fitted.damper) - u.parameter.neutral) <= error
    }


def at_limits(fitted: FitResult) -> Iterator[str]:
    """Yield the effects of which some parameter ends at a limit of the search, at every voltage that it has."""
    split = fitted.optimum.size - len(fitted.unknowns)
    errors = search_errors(fitted, slice(split, fitted.optimum.size))
    ends: dict[tuple[str, str], list[bool]] = {}
    for u, x, error in zip(fitted.unknowns, fitted.optimum[split:], errors, strict=True):
        if u.parameter is not ZERO:
            near = max(thresholds.NEAR_LIMIT * float(error), thresholds.NEAREST_LIMIT)
            beside = min(float(x) - u.bounds[0], u.bounds[1] - float(x)) <= near
            ends.setdefault((u.effect, u.parameter.name), []).append(beside)
    yield from dict.fromkeys(effect for (effect, _), each in ends.items() if all(each) and effect in fitted.effects)


@dataclass(frozen=True)
class Varying:
    """Strength of an effect that is no constant."""

    parameter: str
    share: float
    """Standard deviation from test to test, as a share of the strength."""
    probability: float
    """Of as much by noise alone."""


def varying_strengths(problem: Problem, fitted: FitResult, significance: float) -> dict[str, Varying]:
    """Return the effects of a fit whose strength, the first parameter, differs from test to test: it is no constant.

    A force that follows another law takes the place of one that it resembles in each test by itself, as rubber does
    that of a spring: at another frequency or amplitude the likeness has another size. Of an offset or a delay each
    test has its own.

    Parameters
    ----------
    problem : observations of the fit
    fitted : its optimum
    significance : probability by noise alone below which the strengths differ
    """
    names = [o.name for o in problem.observations]
    places = {name: [i for i, each in enumerate(names) if each == name] for name in dict.fromkeys(names)}
    each = np.split(fitted.jacobian.dense(), np.cumsum([r.size for r in fitted.residuals])[:-1])
    slopes = [np.concatenate([each[i] for i in own]) for own in places.values()]
    residuals = [np.concatenate([fitted.residuals[i] for i in own]) for own in places.values()]
    first, found = fitted.optimum.size - len(fitted.unknowns), dict[str, Varying]()
    for column, u in enumerate(fitted.unknowns, start=first):
        effect = library().get(u.effect)
        if effect is None or u.parameter != effect.parameters[0]:
            continue
        if u.effect not in fitted.effects or u.effect in thresholds.NUISANCE_EFFECTS:
            continue
        spread, probability = between_tests(slopes, residuals, column, fitted.prior)
        size = abs(u.value_in(fitted.damper) - u.parameter.neutral) if np.isfinite(u.parameter.neutral) else np.inf
        share = spread if u.parameter.search.logarithmic else spread * abs(u.derivative(0.0)) / size
        if probability < significance and share > thresholds.CONSTANT_WITHIN:
            found[u.effect] = Varying(u.parameter.name, share, probability)
    return found


def opens_below_friction(damper: Damper) -> bool:
    """Whether a relief valve opens below T0 at every row: C then never acts, and C_r is another C."""
    if "relief_valve" not in damper.effects:
        return False
    values = damper.effects["relief_valve"]
    nodes, opens = np.atleast_1d(values.get(NODE_VOLTAGES, 0.0)), np.atleast_1d(values["F_r"])
    return all(float(np.interp(row.voltage_V or 0.0, nodes, opens)) <= row.T0_N for row in damper.base)


def nearly_others(damper: Damper, force: float) -> dict[str, str]:
    """Return by effect of a damper which other one it nearly is by its values.

    Parameters
    ----------
    damper : with the effects
    force : largest force of the tests [N]
    """
    beside = _beside_effects(damper, force)
    others = {name: known()[name].nearly(values, beside) for name, values in damper.effects.items()}
    return {name: other for name, other in others.items() if other is not None}


def contradiction(damper: Damper, effect: str, force: float) -> str | None:
    """Say why the values of an effect of a damper are those of no such effect; None where they may be.

    Parameters
    ----------
    damper : with the effect
    effect : its name
    force : largest force of the tests [N]
    """
    return known()[effect].contradicted(damper.effects[effect], _beside_effects(damper, force))


def _beside_effects(damper: Damper, force: float) -> Beside:
    stiffest = max(row.k_N_per_m or np.inf for row in damper.base)
    return Beside(damper.effects, tuple(row.T0_N for row in damper.base), stiffest, force, force_at_rest(damper))


def force_at_rest(damper: Damper) -> float:
    """Compute the force of a damper at rest in the middle of its stroke [N], as of a gas."""
    return float(static_force(damper, damper.base[0].voltage_V))


def cancelling(problem: Problem, fitted: FitResult) -> Iterator[tuple[str, str]]:
    """Yield the pairs of effects whose forces cancel over the tests but for a small part of either.

    Equation: rms(d_i + d_j) < s min(rms d_i, rms d_j), d_i = F - F without effect i
    """
    if len(fitted.effects) < 2:
        return
    whole = _forces(problem, fitted.damper)
    moved = {name: whole - _forces(problem, fitted.damper.without_effects(name)) for name in fitted.effects}
    for one, other in combinations(fitted.effects, 2):
        least = min(rms(moved[one]), rms(moved[other]))
        if rms(moved[one] + moved[other]) < thresholds.CANCELLED_SHARE * least:
            yield one, other


def _forces(problem: Problem, damper: Damper) -> Array:
    """Simulate the compared samples (n,) of every record, each in units of its peak."""
    return np.concatenate([o.at_compared(shown_force(o, damper)) / o.peak for o in problem.observations])


def first_undetermined(
    problem: Problem, fitted: FitResult, kept: Sequence[str], level: float = LEVEL
) -> tuple[str, str] | None:
    """Return the last adopted of the effects that are none, and why; None where the fit determines all.

    Parameters
    ----------
    problem : observations and limits of the fit
    fitted : its optimum
    kept : effects that stay whatever they do
    level : standard errors by which a strength has to differ from none
    """
    found = undetermined(problem, fitted, level)
    return next(((name, found[name]) for name in reversed(fitted.effects) if name in found and name not in kept), None)
