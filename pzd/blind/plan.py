"""Which case hides what in which campaign: fairly mixed from the first case on, whatever the number of cases."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Literal, TypeVar

from pzd.blind.config import BlindConfig, TestPlan
from pzd.blind.outside import FORMS
from pzd.damper.effect import Need
from pzd.damper.effects import nameable

Kind = Literal["single", "pair", "none", "outside"]
KINDS: tuple[Kind, ...] = ("single", "none", "outside", "pair")

Key = TypeVar("Key", bound=str)


@dataclass(frozen=True)
class PlannedCase:
    """One case before anything is drawn."""

    index: int
    kind: Kind
    campaign: str
    hidden: tuple[str, ...]
    """Names of the effects, or of the form outside the library."""

    @property
    def id(self) -> str:
        """What its files are called; it tells nothing of the truth."""
        return f"{self.index:05d}"

    def needs(self, what: Need) -> bool:
        """Whether something hidden shows only where this moves inside a test."""
        return any(name in nameable() and nameable()[name].needs == what for name in self.hidden)


def plan(config: BlindConfig) -> tuple[PlannedCase, ...]:
    """Every case, in the order in which they are done.

    Parameters
    ----------
    config : the shares, the campaigns and the number
    """
    plans = {campaign.name: campaign for campaign in config.campaigns}
    shares = {name: campaign.share for name, campaign in plans.items()}
    return dealt(config, shares, lambda name, kind: hideable(plans[name], kind))


def dealt(
    config: BlindConfig, campaigns: Mapping[str, float], hideable_in: Callable[[str, Kind], list[tuple[str, ...]]]
) -> tuple[PlannedCase, ...]:
    """Every case of a benchmark, fairly mixed from the first on.

    Parameters
    ----------
    config : the shares of what is hidden, and the number
    campaigns : shares of the campaigns, by name
    hideable_in : what a campaign can hide of a kind
    """
    shares: dict[Kind, float] = {kind: getattr(config.kinds, kind) for kind in KINDS}
    kinds = mixed(shares)
    next_campaign = {kind: mixed(campaigns) for kind in KINDS}
    what = {(kind, name): in_turn(hideable_in(name, kind)) for kind in KINDS for name in campaigns}
    found = []
    for index in range(config.cases):
        kind = next(kinds)
        campaign = next(next_campaign[kind])
        found.append(PlannedCase(index, kind, campaign, next(what[kind, campaign])))
    return tuple(found)


def hideable(campaign: TestPlan, kind: Kind) -> list[tuple[str, ...]]:
    """What a campaign can hide; effects of the drive only where the voltage moves.

    Pairs come in such an order that every effect has been in one before any is in many.
    """
    if kind == "none":
        return [()]
    if kind == "outside":
        return [(name,) for name in FORMS]
    effects = [name for name, e in nameable().items() if e.needs != "voltage" or campaign.moves_voltage]
    if kind == "single":
        return [(name,) for name in effects]
    place = {name: i for i, name in enumerate(effects)}
    return sorted(combinations(effects, 2), key=lambda pair: (place[pair[1]] - place[pair[0]]) * 7 % len(effects))


def mixed(shares: Mapping[Key, float]) -> Iterator[Key]:
    """Names for ever, at each turn the one that is furthest behind its share."""
    whole = sum(shares.values())
    given = dict.fromkeys(shares, 0)
    for turn in range(1, 1 << 62):
        behind = {name: share / whole * turn - given[name] for name, share in shares.items() if share > 0.0}
        name = max(behind, key=lambda one: behind[one])
        given[name] += 1
        yield name


def in_turn(choices: list[tuple[str, ...]]) -> Iterator[tuple[str, ...]]:
    """One choice after the other, for ever."""
    turn = 0
    while True:
        yield choices[turn % len(choices)]
        turn += 1
