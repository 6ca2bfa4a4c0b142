"""Whether the data support an effect by itself, or it is spurious: an effect that stands in for another cause."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.damper.effect import Parameter
from pzd.damper.model import Damper
from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.fit.intervals import LEVEL, standard_errors
from pzd.diagnose.fit.least_squares import Fitted, fit, misfit_of
from pzd.diagnose.fit.parameters import ZERO, Problem
from pzd.diagnose.gap import gap_in_force, visible_gap
from pzd.diagnose.search.candidates import Candidate
from pzd.diagnose.search.evidence import Evidence
from pzd.diagnose.thresholds import (
    HALVES_ALIKE,
    HALVES_LOSE,
    HALVES_SIGNIFICANCE,
    LEAST_CLOSED,
    OF_EACH_TEST,
    STOP_BEGINS,
    STOP_OTHER_SIDE,
    TRIVIAL_SIZE,
)

OF_THE_TESTS = "so small that it counts as an offset or a delay of the tests"
MAY_BE_OF_THE_TESTS = "would fit better, and may be no more than an offset or a delay that each test has of its own"
MAY_BE_CHANCE = "would fit better, though not by so much that chance is out of the question"


def unsupported(evidence: Evidence, config: DiagnoseConfig, candidate: Candidate) -> str | None:
    """Why a candidate is too little to be adopted, None where it is not."""
    if candidate.delta_bic > config.adopt_bic:
        return "does not pay"
    if candidate.explained < config.visible:
        return f"moves the force by less than {100 * config.visible:g} % of peak"
    if small := trivial(candidate.fitted, candidate.effect, evidence.whole.scales.low_force):
        return small
    return no_stop(candidate.fitted.damper, evidence.whole.scales.stroke) if candidate.effect == "end_stop" else None


def no_stop(damper: Damper, stroke: float) -> str | None:
    """Why an end stop is none by where it begins, None where that is near both ends of the stroke (half of it [m])."""
    begins = np.atleast_1d(damper.effects["end_stop"]["x_e"])
    further, nearer = (stroke - float(np.max(begins)) + side * abs(damper.zero_m) for side in (1.0, -1.0))
    if nearer <= 0.0 or nearer**2 < STOP_OTHER_SIDE * further**2:
        return "stand-in: acts at one end of the stroke alone"
    if float(np.min(begins)) - abs(damper.zero_m) < STOP_BEGINS * stroke:
        return "stand-in: begins in the middle of the stroke, where no end stop does"
    return None


def leaves_gap(evidence: Evidence, config: DiagnoseConfig, before: Fitted, candidate: Candidate) -> str | None:
    """Why a candidate is a stand-in by the gap that it leaves open, None where it closes enough or noise hides it."""
    if not evidence.something_missing(before, config):
        return None
    checks = [evidence.campaign.checks(fitted.damper) for fitted in (before, candidate.fitted)]
    gaps = [[size(each) for each in checks] for size in (visible_gap, gap_in_force)]
    closed = [left**2 <= (1.0 - LEAST_CLOSED) * open_before**2 for open_before, left in gaps]
    if any(closed) and all(left <= open_before for open_before, left in gaps):
        return None
    return f"stand-in: closes less than {LEAST_CLOSED:.0%} of the gap, or widens it"


def closes(evidence: Evidence, config: DiagnoseConfig, before: Fitted, candidate: Candidate) -> bool:
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


def trivial(fitted: Fitted, effect: str, force: float) -> str | None:
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
            sizes.append((abs(unknown.of(fitted.damper)) / unit, LEVEL * error / unit))
    if not sizes or max(size - reach for size, reach in sizes) >= 1.0:
        return None
    return MAY_BE_OF_THE_TESTS if max(size for size, _ in sizes) >= 1.0 else OF_THE_TESTS


def spurious(
    evidence: Evidence, weighed: Evidence, config: DiagnoseConfig, before: Fitted, candidate: Candidate
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
    without = fit(evidence.halves[0], before.effects, before.searched)
    with_it, left = misfit_of(halves[1], fits[0].damper), misfit_of(evidence.choosing(weighed), without.damper)
    if with_it > left + config.rival_bic:
        return "stand-in: widens the gap on tests it was not fitted to"
    fresh = tuple(e for e in candidate.fitted.effects if e not in before.effects) or (candidate.effect,)
    if not _agree(halves, (fits[0], fits[1]), fresh, HALVES_LOSE * -candidate.delta_bic):
        return "stand-in: takes other values on either half of the tests"
    return None


def _agree(
    halves: tuple[Problem, Problem], fits: tuple[Fitted, Fitted], effects: Sequence[str], negligible: float
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

    values = [[u.of(f.damper) for u in f.unknowns if u.effect in effects and u.parameter is not ZERO] for f in fits]
    if all(abs(a - b) <= HALVES_ALIKE * max(abs(a), abs(b)) for a, b in zip(*values, strict=True)):
        return True
    limit = 2.0 * float(chdtri(len(fits[0].unknowns), HALVES_SIGNIFICANCE))
    for half, own, other in ((halves[0], fits[0], fits[1]), (halves[1], fits[1], fits[0])):
        spread = max(1.0, own.misfit / max(own.size - own.searched.size, 1))
        if misfit_of(half, other.damper) - own.misfit <= max(limit * spread, negligible):
            return True
    return False
