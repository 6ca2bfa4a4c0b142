"""Which values an effect has in nature: a fit may go beyond them, and has then found something that looks alike."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pzd.damper.competing_forms import known
from pzd.damper.effect import Effect
from pzd.damper.model import Damper, EffectValues


def against_nature(damper: Damper) -> tuple[str, ...]:
    """The effects of a damper that have values which they have nowhere in nature, such as a negative mass."""
    damping = max(row.C_Ns_per_m for row in damper.base)
    return tuple(
        name
        for name, values in damper.effects.items()
        if not all(_natural(known()[name], at, damping) for at in _by_voltage(values))
    )


def _natural(effect: Effect, values: Mapping[str, float], damping: float) -> bool:
    within = all(p.natural_from <= values.get(p.name, p.neutral) <= p.natural_to for p in effect.parameters)
    return within and effect.natural(values, damping)


def _by_voltage(values: EffectValues) -> list[dict[str, float]]:
    """The parameters of an effect, a set at each of its voltages."""
    given = {name: np.atleast_1d(value).tolist() for name, value in values.items() if name != "at_voltage_V"}
    count = max(len(each) for each in given.values())
    return [{name: each[min(i, len(each) - 1)] for name, each in given.items()} for i in range(count)]
