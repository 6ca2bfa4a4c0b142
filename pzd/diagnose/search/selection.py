"""The outcome of the search: the effects adopted, what was tried for each, and what would have done as well."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from pzd.damper.model import Damper
from pzd.diagnose.config import DiagnoseConfig
from pzd.diagnose.fit.least_squares import Fitted
from pzd.diagnose.search.candidates import Candidate
from pzd.diagnose.search.detection import Detection
from pzd.diagnose.search.evidence import Evidence


@dataclass(frozen=True, eq=False)
class Round:
    """One step: the candidates, best first, which of them was adopted, and which would have done as well."""

    tried: tuple[Candidate, ...]
    chosen: str | None
    rivals: tuple[str, ...] = ()
    refused: frozenset[str] = frozenset()
    """Which candidates were stand-ins or too little, whatever they pay."""

    @property
    def contenders(self) -> tuple[Candidate, ...]:
        """What was tried and not refused."""
        return tuple(c for c in self.tried if c.effect not in self.refused)


def rivals_of(chosen: Candidate, tried: Sequence[Candidate], config: DiagnoseConfig) -> tuple[str, ...]:
    """The other effects that explain a step as well as the one chosen, best first."""
    others = [c for c in tried if c.effect != chosen.effect]
    return tuple(c.effect for c in others if c.delta_bic - chosen.delta_bic < config.rival_bic)


@dataclass(frozen=True, eq=False)
class Competition:
    """An effect adopted, and a force that is not in the library and would do as well in its place."""

    effect: str
    damper: Damper
    """With the effect."""
    form: str
    with_form: Damper
    behind: float
    """Bayesian criterion with that form less that with the effect; negative where the form does better."""

    @property
    def dampers(self) -> tuple[tuple[str, Damper], ...]:
        """Either with its name."""
        return (self.effect, self.damper), (self.form, self.with_form)


@dataclass(frozen=True, eq=False)
class Selection:
    """What was adopted, and what was tried."""

    plain: Fitted
    """No effect, on the samples seen."""
    fitted: Fitted
    """With all that was adopted, on the samples seen."""
    rounds: tuple[Round, ...]
    reasons: dict[str, str]
    """Why an effect was adopted or not."""
    first: Evidence
    """Weighed by what the plain damper leaves."""
    last: Evidence
    """Weighed by what the adopted damper leaves."""
    competitions: tuple[Competition, ...] = ()
    """What is not in the library and would do as well in the place of an effect adopted, or better."""
    undecided: tuple[str, ...] = ()
    """Effects that would fit better where nothing was adopted, and of which the tests do not say enough."""
    left_open: Mapping[str, tuple[Detection, ...]] = field(default_factory=dict)
    """What the tests say of the gap of every effect that was tried beside all that was adopted."""

    @property
    def rivalling(self) -> tuple[tuple[str, Damper], ...]:
        """An effect adopted and its rivals, with the dampers fitted with them; empty without rivals."""
        if not self._contested:
            return tuple(pair for competition in self.competitions[:1] for pair in competition.dampers)
        step = self._contested[-1]
        wanted = [name for name in (step.chosen, *step.rivals) if name == step.chosen or name in self.rivals]
        return tuple((c.effect, c.fitted.damper) for name in wanted for c in step.tried if c.effect == name)

    @property
    def rivals(self) -> tuple[str, ...]:
        """Effects that explain some step as well as the one adopted there, and were not adopted later."""
        found = dict.fromkeys(name for step in self._contested for name in step.rivals)
        return tuple(name for name in found if name not in self.adopted)

    @property
    def _contested(self) -> list[Round]:
        """The steps that stand and in which another effect would have done as well."""
        return [r for r in self.rounds if r.chosen in self.adopted and not set(r.rivals) <= set(self.adopted)]

    def deciding(self, effect: str) -> tuple[Candidate, ...]:
        """The round that decided on an effect: the last in which it was tried; empty for a forced one."""
        return next((r.tried for r in reversed(self.rounds) if any(c.effect == effect for c in r.tried)), ())

    @property
    def adopted(self) -> tuple[str, ...]:
        """The effects adopted, best first."""
        return self.fitted.effects
