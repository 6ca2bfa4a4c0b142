"""Which case hides what in which campaign: fairly mixed from the first case on, whatever the number of cases."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations, cycle
from typing import Literal, TypeVar

from pzd.blind.config import BlindConfig, TestPlan
from pzd.blind.outside import FORMS
from pzd.damper.effect import Need
from pzd.damper.effects import nameable

Kind = Literal["single", "pair", "none", "outside"]
KINDS: tuple[Kind, ...] = ("single", "none", "outside", "pair")
"""In the order in which the first cases come."""
Hidden = tuple[str, ...]
"""Names of the effects that a case hides, or of the form outside the library."""

Key = TypeVar("Key", bound=str)


@dataclass(frozen=True)
class PlannedCase:
    """One case before anything is drawn."""

    index: int
    kind: Kind
    campaign: str
    hidden: Hidden

    @property
    def id(self) -> str:
        """Name of its files, which gives nothing of the truth away."""
        return f"{self.index:05d}"

    def needs(self, what: Need) -> bool:
        """Return whether something hidden shows only where this moves inside a test."""
        return any(name in nameable() and nameable()[name].needs == what for name in self.hidden)


def plan(config: BlindConfig) -> tuple[PlannedCase, ...]:
    """Plan every case, in the order in which they are done.

    Parameters
    ----------
    config : the generator, the shares, the campaigns and the number
    """
    if config.generator == "independent":
        from pzd.blind.independent.stand import CAMPAIGNS

        shares = {name: share for name, (share, _) in CAMPAIGNS.items()}
        return _mixed_cases(config, shares, hideable_independently)
    plans = {campaign.name: campaign for campaign in config.campaigns}
    shares = {name: campaign.share for name, campaign in plans.items()}
    return _mixed_cases(config, shares, lambda name, kind: hideable(plans[name], kind))


def _mixed_cases(
    config: BlindConfig, campaigns: Mapping[str, float], hideable_in: Callable[[str, Kind], list[Hidden]]
) -> tuple[PlannedCase, ...]:
    """Plan every case of a benchmark from the shares of its campaigns and what each can hide of a kind."""
    shares: dict[Kind, float] = {kind: getattr(config.kinds, kind) for kind in KINDS}
    kinds = mixed(shares)
    next_campaign = {kind: mixed(campaigns) for kind in KINDS}
    hidden = {(kind, name): cycle(hideable_in(name, kind)) for kind in KINDS for name in campaigns}
    cases = []
    for index in range(config.cases):
        kind = next(kinds)
        campaign = next(next_campaign[kind])
        cases.append(PlannedCase(index, kind, campaign, next(hidden[kind, campaign])))
    return tuple(cases)


def mixed(shares: Mapping[Key, float]) -> Iterator[Key]:
    """Yield names for ever, at each turn the one that is furthest behind its share.

    >>> from itertools import islice
    >>> list(islice(mixed({"a": 2.0, "b": 1.0}), 6))
    ['a', 'b', 'a', 'a', 'b', 'a']
    """
    whole = sum(shares.values())
    given = dict.fromkeys(shares, 0)
    for turn in range(1, 1 << 62):
        behind = {name: share / whole * turn - given[name] for name, share in shares.items() if share > 0.0}
        name = max(behind, key=lambda one: behind[one])
        given[name] += 1
        yield name


# --- What a campaign can hide ---


def hideable(campaign: TestPlan, kind: Kind) -> list[Hidden]:
    """Return what a campaign of the virtual rig can hide; effects of the drive only where the voltage moves.

    Pairs come in such an order that every effect has been in one before any is in many.
    """
    if kind == "none":
        return [()]
    if kind == "outside":
        return [(name,) for name in FORMS]
    hidden = {name: effect for name, effect in nameable().items() if effect.hidden is not None}
    effects = [name for name, effect in hidden.items() if effect.needs != "voltage" or campaign.moves_voltage]
    if kind == "single":
        return [(name,) for name in effects]
    place = {name: i for i, name in enumerate(effects)}
    return sorted(combinations(effects, 2), key=lambda pair: (place[pair[1]] - place[pair[0]]) * 7 % len(effects))


def hideable_independently(campaign: str, kind: Kind) -> list[Hidden]:
    """Return what a campaign of the second generator can hide.

    Each campaign begins at another place of the list, so that few cases hold many laws.
    """
    from pzd.blind.independent.laws import LAWS
    from pzd.blind.independent.outside import OUTSIDE
    from pzd.blind.independent.stand import CAMPAIGNS

    if kind == "none":
        return [()]
    laws = [law for law in LAWS.values() if law.place != "drive" or campaign == "moving_signal"]
    choices: list[Hidden]
    if kind == "outside":
        choices = [(name,) for name in OUTSIDE]
    elif kind == "single":
        choices = [(law.name,) for law in laws]
    else:
        # laws that act before or after the integration are hidden alone
        together = [law.name for law in laws if law.place == "damper"]
        choices = list(combinations(together, 2))
        choices.sort(key=lambda pair: (len(pair[0]) * 5 + len(pair[1]) * 3) % 11)  # mixed, and the same every time
    turn = 4 * list(CAMPAIGNS).index(campaign) % len(choices)
    return choices[turn:] + choices[:turn]
