"""The tests of one setting dealt into folds, each of which is kept back once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pzd.damper.material import by_voltage
from pzd.damper.model import Damper
from pzd.diagnose.data.cleaning import Prepared
from pzd.record import Mask

FOLDS = 5
"""Each fold keeps back about a fifth of the tests: enough is left to fit, and the refits stay few."""
PARTS = 2
"""Halves of a test that is alone at its voltage: the first predicts the second, and the second the first."""


@dataclass(frozen=True, eq=False)
class Folds:
    """Which tests stand at which voltage, and which samples each fold keeps back."""

    groups: tuple[tuple[int, ...], ...]
    """The records of each voltage, and those whose voltage moves."""
    voltages: tuple[float | None, ...]
    """Of the groups [V], 0 for a damper without; None where it moves."""
    folds: tuple[tuple[Mask, ...], ...]
    """For every fold one mask (n,) a record: the samples that are kept back."""


def deal(prepared: Sequence[Prepared], plain: Damper) -> Folds:
    """Every voltage dealt by itself, so that each fold takes a bit of each; a test alone at its voltage in halves.

    Parameters
    ----------
    prepared : the records of one setting
    plain : the damper, whose base rows say which voltages there are
    """
    nodes = [voltage for voltage, _ in by_voltage(plain.base)]
    members: dict[int, list[int]] = {}
    for i, p in enumerate(prepared):
        own = p.record.median_voltage() or 0.0
        members.setdefault(int(np.argmin([abs(v - own) for v in nodes])) if p.constant else -1, []).append(i)
    groups = tuple(tuple(sorted(found, key=lambda i: prepared[i].record.name)) for found in members.values())
    voltages = tuple(None if node < 0 else nodes[node] for node in members)
    folds = tuple(tuple(np.zeros(p.record.time.size, dtype=np.bool_) for p in prepared) for _ in range(FOLDS))
    for turn, group in enumerate(groups):
        for place, i in enumerate(group):
            if len(group) > 1:
                folds[(turn + place) % min(FOLDS, max(len(group), PARTS))][i][:] = True
            else:
                for part, mask in enumerate(_halves(prepared[i])):
                    folds[(turn + part) % FOLDS][i][:] = mask
    return Folds(groups, voltages, tuple(fold for fold in folds if any(mask.any() for mask in fold)))


def _halves(prepared: Prepared) -> tuple[Mask, Mask]:
    """(n,) the first and the second half of a record, by whole cycles where it has two or more."""
    time, run = prepared.record.time, prepared.cycles
    if run is None or run.count < PARTS:
        first = np.arange(time.size) < time.size // PARTS
    else:
        first = run.number(time) < run.count // PARTS
    return first, ~first
