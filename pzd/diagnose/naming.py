"""From candidates to adopted effects: one after another, as long as the data support the next by themselves."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.damper.effects import library
from pzd.damper.model import Damper
from pzd.diagnose.candidates import (
    Candidate,
    by_voltage,
    candidate,
    candidates,
    delta_bic,
    moved_by,
    settled,
)
from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.evidence import Evidence, evidence_of
from pzd.diagnose.fitting import Fitted, fit, misfit_beside
from pzd.diagnose.gap import visible_gap
from pzd.diagnose.inputs import Prepared
from pzd.diagnose.judge import Judged
from pzd.diagnose.problem import Problem
from pzd.diagnose.split import Split
from pzd.record import Array

log = logging.getLogger(__name__)

AGREES = 0.001
"""Halves of the tests disagree about a parameter when chance would let them so seldom."""
ALIKE = 0.1
"""Values within this ratio of one another agree, whatever their intervals."""
TRIVIAL = {("preload_offset", "F_0"): 0.01, ("sensor_delay", "tau"): 1e-3, ("valve_lag", "tau"): 1e-3}
"""A common offset [share of the lowest peak], delay or lag [s] that counts as nothing missing."""
LEAST_CUT = 0.2
"""An effect closes at least this share of the gap (mean square): what is real is not one of many small corrections."""
LEVEL = 1.96
"""Standard errors in a 95 % interval."""


@dataclass(frozen=True, eq=False)
class Round:
    """One step: the candidates, best first, and which of them was adopted."""

    tried: tuple[Candidate, ...]
    chosen: str | None


@dataclass(frozen=True, eq=False)
class Named:
    """What was adopted, and what was tried."""

    plain: Fitted
    """No effect, on the samples seen."""
    fitted: Fitted
    """With all that was adopted, on the samples seen."""
    rounds: tuple[Round, ...]
    reasons: dict[str, str]
    """Why an effect was adopted or not."""
    rivals: tuple[str, ...]
    """Effects that explain the last step as well."""
    first: Evidence
    """Weighed by what the plain damper leaves."""
    last: Evidence
    """Weighed by what the adopted damper leaves."""

    @property
    def rivalling(self) -> tuple[tuple[str, Damper], ...]:
        """The effect adopted last and its rivals, with the dampers fitted with them; empty without rivals."""
        if not self.rivals:
            return ()
        last = self.deciding(self.adopted[-1])
        wanted = (self.adopted[-1], *self.rivals)
        return tuple((name, c.fitted.damper) for name in wanted for c in last if c.effect == name)

    def deciding(self, effect: str) -> tuple[Candidate, ...]:
        """The round that decided on an effect: the last in which it was tried; empty for a forced one."""
        return next((r.tried for r in reversed(self.rounds) if any(c.effect == effect for c in r.tried)), ())

    @property
    def adopted(self) -> tuple[str, ...]:
        """The effects adopted, best first."""
        return self.fitted.effects


def name_effects(
    prepared: Sequence[Prepared], parts: Split, damper: Damper, config: DiagnoseConfig, jobs: int = 1
) -> Named:
    """Adopt effects one after another while the next one pays, is supported by itself, and something is missing.

    Parameters
    ----------
    prepared : the records of one setting
    parts : which samples are fitted, which choose, which are untouched
    damper : plain, where the fits start
    config : thresholds, forced and forbidden effects
    jobs : candidates fitted at the same time
    """
    known: dict[str, list[Judged]] = {}

    def weighed(model: Damper) -> Evidence:
        return evidence_of(prepared, parts, model, config, known)

    first = evidence = weighed(damper)
    plain = current = fit(first.whole, (), first.whole.start())
    rounds: list[Round] = []
    reasons: dict[str, str] = {}
    for name in config.force:
        current = candidate(first.whole, current, library()[name]).fitted
        reasons[name] = "adopted because the config asks for it"
    rivals: tuple[str, ...] = ()
    while len(rounds) < 2 * config.most_effects and evidence.something_missing(current, config):
        more = len(current.effects) < config.most_effects
        tried = candidates(evidence.whole, current, config.forbid, jobs) if more else ()
        steps = sorted((*tried, *by_voltage(evidence.whole, current)), key=lambda c: c.delta_bic)
        chosen = _first_supported(evidence, weighed, config, current, steps, reasons)
        if chosen is None:
            rounds += [Round(tried, None)] if tried else []
            break
        chosen = settled(evidence.whole, current, chosen)
        reasons[chosen.effect] = "adopted, its parameters by voltage" if chosen.varies else "adopted"
        if not chosen.varies:
            rounds.append(Round(tuple(chosen if c.effect == chosen.effect else c for c in tried), chosen.effect))
            rivals = _rivals(chosen, tried, config)
        log.info("diagnose: %s %s, delta BIC %.0f", chosen.effect, reasons[chosen.effect], chosen.delta_bic)
        evidence = weighed(chosen.fitted.damper)
        current = fit(evidence.whole, chosen.fitted.effects, evidence.whole.start_with(chosen.fitted.damper))
        for name in current.effects[len(config.force) : -1]:
            without = _without(evidence.whole, current, name, config)
            if without is not None:
                current, reasons[name] = without, f"stand-in: not needed beside {chosen.effect}"
    return Named(plain, current, tuple(rounds), reasons, rivals, first, evidence)


def _without(problem: Problem, current: Fitted, effect: str, config: DiagnoseConfig) -> Fitted | None:
    """The fit without an effect that was adopted earlier, where it no longer pays or no longer moves the force."""
    if library()[effect].place == "material":
        return None
    damper = current.damper
    fewer = damper.model_copy(update={"effects": {n: v for n, v in damper.effects.items() if n != effect}})
    without = fit(problem, tuple(fewer.effects), problem.start_with(fewer))
    pays = delta_bic(without, current) <= config.adopt_bic and moved_by(problem, without, current) >= config.visible
    return None if pays else without


def _rivals(chosen: Candidate, tried: Sequence[Candidate], config: DiagnoseConfig) -> tuple[str, ...]:
    """The other effects that explain a step as well as the one chosen, best first."""
    others = [c for c in tried if c.effect != chosen.effect and c.delta_bic >= chosen.delta_bic]
    return tuple(c.effect for c in others if c.delta_bic - chosen.delta_bic < config.rival_bic)


def _first_supported(
    evidence: Evidence,
    weighed: Callable[[Damper], Evidence],
    config: DiagnoseConfig,
    before: Fitted,
    tried: Sequence[Candidate],
    reasons: dict[str, str],
) -> Candidate | None:
    """The best candidate that pays and that the data support by itself; a better one that fails is a stand-in."""
    for each in tried:
        reason = (
            _unsupported(evidence, config, each)
            or _leaves_gap(evidence, config, before, each)
            or _stand_in(evidence, weighed(each.fitted.damper), config, before, each)
        )
        if reason is None:
            return each
        if not each.varies:
            reasons[each.effect] = reason
        if each.delta_bic > config.adopt_bic:
            break
    return None


def _unsupported(evidence: Evidence, config: DiagnoseConfig, candidate: Candidate) -> str | None:
    """Why a candidate is too little to be adopted, None where it is not."""
    if candidate.delta_bic > config.adopt_bic:
        return "does not pay"
    if candidate.explained < config.visible:
        return f"moves the force by less than {100 * config.visible:g} % of peak"
    if trivial(candidate.fitted, candidate.effect, evidence.whole.scales.low_force):
        return "so small that it counts as an offset or a delay of the tests"
    return None


def _leaves_gap(evidence: Evidence, config: DiagnoseConfig, before: Fitted, candidate: Candidate) -> str | None:
    """Why a candidate is a stand-in by the gap that it leaves open, None where it closes its share."""
    sizes = [visible_gap(evidence.judged(f.damper, config)) for f in (before, candidate.fitted)]
    if sizes[1] ** 2 <= (1.0 - LEAST_CUT) * sizes[0] ** 2:
        return None
    return f"stand-in: closes less than {LEAST_CUT:.0%} of the gap"


def trivial(fitted: Fitted, effect: str, force: float) -> bool:
    """Whether the 95 % interval of a common offset or delay reaches below what counts as an effect."""
    errors = standard_errors(fitted)
    sizes = []
    for unknown, error in zip(fitted.unknowns, errors, strict=True):
        limit = TRIVIAL.get((unknown.effect, unknown.parameter.name))
        if unknown.effect == effect and limit is not None:
            unit = limit * (force if unknown.parameter.unit == "N" else 1.0)
            sizes.append((abs(unknown.of(fitted.damper)) - LEVEL * error) / unit)
    return bool(sizes) and max(sizes) < 1.0


def standard_errors(fitted: Fitted) -> Array:
    """(e,) of the effect parameters, widened by what the fit leaves above the noise."""
    freedom = max(fitted.size - fitted.searched.size, 1)
    return np.sqrt(np.diag(fitted.covariance) * max(1.0, fitted.misfit / freedom))


def _stand_in(
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
    with_it, left = misfit_beside(halves[1], fits[0].damper), misfit_beside(evidence.choosing(weighed), without.damper)
    if with_it > left + config.rival_bic:
        return "stand-in: widens the gap on tests it was not fitted to"
    if not _agree(halves, (fits[0], fits[1]), candidate.effect):
        return "stand-in: takes other values on either half of the tests"
    return None


def _agree(halves: tuple[Problem, Problem], fits: tuple[Fitted, Fitted], effect: str) -> bool:
    """Whether one half of the tests does nearly as well with the values that the other half gives to an effect.

    Equation: min_ij (|r_j(p_i)|^2 - |r_j(p_j)|^2) < 2 chi2_e        Source: likelihood ratio, either half for granted
    """
    from scipy.stats import chi2

    values = [[u.of(f.damper) for u in f.unknowns if u.effect == effect] for f in fits]
    if all(abs(a - b) <= ALIKE * max(abs(a), abs(b)) for a, b in zip(*values, strict=True)):
        return True
    limit = 2.0 * float(chi2.isf(AGREES, len(fits[0].unknowns)))
    for half, own, other in ((halves[0], fits[0], fits[1]), (halves[1], fits[1], fits[0])):
        spread = max(1.0, own.misfit / max(own.size - own.searched.size, 1))
        if misfit_beside(half, other.damper) - own.misfit <= limit * spread:
            return True
    return False
