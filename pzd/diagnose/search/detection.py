"""How large a gap the tests leave to an effect, and how far that speaks for the effect or against it.

The Bayesian criterion holds against an effect that the tests do not show it, even where they could not. Here the size
of the gap is averaged over, so that tests that could not show an effect say nothing about it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.damper.effect import Effect
from pzd.damper.effects import library
from pzd.damper.model import Damper
from pzd.damper.nature import against_nature
from pzd.diagnose.fit.intervals import LEVEL
from pzd.diagnose.fit.least_squares import Fitted, not_taken_up
from pzd.diagnose.fit.likelihood import response
from pzd.diagnose.fit.parameters import Problem
from pzd.diagnose.fit.slopes import force_slopes
from pzd.diagnose.search.acceptance import trivial_size
from pzd.diagnose.search.candidates import Candidate
from pzd.diagnose.search.starts import fainter, starts_of
from pzd.diagnose.thresholds import FAINT, FAINTEST, SIZES_AVERAGED
from pzd.record import Array


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
    counts_from: float = 0.0
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


def detections(problem: Problem, before: Fitted, tried: Sequence[Candidate]) -> dict[str, tuple[Detection, ...]]:
    """What the tests say of the gap of every candidate: of its optimum where that was searched for, else of a trace.

    Parameters
    ----------
    problem : what is fitted to what
    before : the optimum without them
    tried : each fitted beside `before`, or as faint as it is looked for
    """
    tangent = _Tangent.at(problem, before)
    force = problem.scales.low_force
    searched = {c.effect: told for c in tried if (told := of_fit(c, force, tangent.gap(c.fitted.simulated)))}
    others = [library()[c.effect] for c in tried if c.effect not in searched]
    linear = [e for e in others if e.place != "material" or problem.pooled() is problem]
    traced = {e.name: [tangent.of_trace(e, trace) for trace in _traces(problem, before, e)] for e in linear}
    return searched | {name: tuple(each for each in found if each) for name, found in traced.items()}


def of_fit(candidate: Candidate, force: float, gap: float | None = None) -> tuple[Detection, ...]:
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
    spread = max(1.0, fitted.misfit / max(fitted.size - fitted.searched.size, 1))
    shape = sum(u.effect == candidate.effect for u in fitted.unknowns) - 1
    error = size / float(np.sqrt(candidate.residual_change / spread))
    counts_from = _counts_from(fitted.damper, candidate.effect, force, size)
    return (Detection(size, error, candidate.misfit_drop / spread, shape, counts_from),)


def _counts_from(damper: Damper, effect: str, force: float, gap: float) -> float:
    """The gap of an effect as small as still counts, in proportion to that of the values it has in a damper."""
    trivial = [(p.name, trivial_size(effect, p, force)) for p in library()[effect].parameters]
    sizes = [float(np.max(np.abs(damper.effects[effect][name]))) / size for name, size in trivial if size is not None]
    return gap / max(sizes) if sizes and max(sizes) > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class _Tangent:
    """An optimum with what changes there, to first order, as its variables do."""

    problem: Problem
    before: Fitted
    forces: Array
    """(n, p) orthonormal: what of a change of the force its variables can take up, in `units`."""
    units: Array
    """(n,) of the force [N]: the peak of each record, and the root of the samples."""

    @classmethod
    def at(cls, problem: Problem, before: Fitted) -> _Tangent:
        counts = [o.peak * np.sqrt(o.measured.size * len(problem.observations)) for o in problem.observations]
        units = np.repeat(counts, [o.measured.size for o in problem.observations])
        forces = force_slopes(problem, before.unknowns, before.searched).dense() / units[:, np.newaxis]
        return cls(problem, before, np.asarray(np.linalg.qr(forces).Q), units)

    def gap(self, simulated: Sequence[Array]) -> float:
        """R.m.s. of a change of the force that no other values of what stands before would bring about."""
        changed = (np.concatenate(simulated) - np.concatenate(self.before.simulated)) / self.units
        return float(np.linalg.norm(not_taken_up(self.forces, changed)))

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
        spread = max(1.0, before.misfit / max(before.size - before.searched.size, 1))
        unknowns = problem.unknowns((*before.effects, effect.name))
        damper = problem.point(np.concatenate([before.searched, trace]), unknowns).damper
        if effect.name in against_nature(damper):
            return None
        simulated = [response(o, damper) for o in problem.observations]
        left = [o.in_noise(o.measured - f) for o, f in zip(problem.observations, simulated, strict=True)]
        residual = np.concatenate(before.residuals)
        rest = not_taken_up(self.before.frame, np.concatenate(left) - residual)
        gap, power = self.gap(simulated), float(rest @ rest)
        if gap <= 0.0 or power <= 0.0:
            return None
        part = -float(residual @ rest) / power
        counts_from = _counts_from(damper, effect.name, problem.scales.low_force, gap)
        return Detection(part * gap, gap * float(np.sqrt(spread / power)), part**2 * power / spread, 0, counts_from)


def _traces(problem: Problem, before: Fitted, effect: Effect) -> Iterator[Array]:
    """Faint values of an effect in the units of the search, to either side where it is looked for from none on."""
    for start in starts_of(problem, before, effect):
        faint = fainter(problem, before, effect, start, FAINT)
        yield from (faint,) if np.any(faint) else (faint + FAINTEST, faint - FAINTEST)
