"""Which samples are fitted, which choose, and which nothing has seen before the final figures.

Records are held out where a condition has three or more; of two, one is held out whole and the
other is parted; a lone record is parted by cycles, or where nothing repeats by segments. The same
rig always splits the same way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pzd.diagnose.data.cleaning import Prepared
from pzd.record import Array, Record, conditions, sliced

TRAINING, VALIDATION, UNTOUCHED = 0, 1, 2
"""Fitted to; looked at to choose; seen by nothing but the final figures."""
Roles = NDArray[np.int64]
HoldOut = Literal["records", "cycles", "segments", "mixed"]

ALONE = (TRAINING, VALIDATION, TRAINING, UNTOUCHED, TRAINING, VALIDATION, TRAINING, UNTOUCHED)
"""Segments of a record that is alone in its condition and does not repeat."""
WITH_UNTOUCHED = (TRAINING, VALIDATION, TRAINING, TRAINING, VALIDATION, TRAINING, TRAINING, VALIDATION)
"""Segments of such a record when another of its condition is untouched."""
MANY = 4
"""Fewer records with a moving voltage are each parted: a step and a ramp do not stand for one another."""
SAME_EXTREME = 0.05
"""Records within this share of the rig's largest force, speed or displacement show the same as the one with it."""
FEWEST = 50
"""A stretch of fewer samples is not fitted."""


@dataclass(frozen=True, eq=False)
class Split:
    """The role of every sample of every record, in the order of the records."""

    roles: tuple[Roles, ...]
    """(n,) role of each sample."""
    held_out: tuple[str, ...]
    """Names of the records that are untouched, wholly or in part."""
    hold_out: HoldOut
    """What was held out."""


def split(prepared: Sequence[Prepared], voltage_within: float | None, temperature_within: float) -> Split:
    """The split of the records of one setting.

    Parameters
    ----------
    prepared : the records
    voltage_within : largest spread of voltage inside one condition [V]; None for 2 % of the scale
    temperature_within : largest spread of temperature inside one condition [degC]
    """
    place = {id(p.record): i for i, p in enumerate(prepared)}
    found, moving = conditions([p.record for p in prepared], voltage_within, temperature_within)
    groups = [condition.records for condition in found] + (
        [moving] if len(moving) >= MANY else [(record,) for record in moving]
    )
    extreme = {int(np.argmax(peaks)) for peaks in _peaks(prepared)}
    roles: dict[int, Roles] = {}
    kinds: set[HoldOut] = set()
    for turn, group in enumerate(groups):
        members = sorted((place[id(record)] for record in group), key=lambda i: _order(prepared[i]))
        members = _rotated(members, turn, extreme)
        shared, kind = _group(members, prepared)
        roles |= shared
        kinds.add(kind)
    for i in _unfitted(prepared, roles):
        roles[i] = _parted(prepared[i], alone=True)
        kinds.add(_parts(prepared[i]))
    ordered = tuple(roles[i] for i in range(len(prepared)))
    names = tuple(p.record.name for p, role in zip(prepared, ordered, strict=True) if np.any(role == UNTOUCHED))
    return Split(ordered, names, kinds.pop() if len(kinds) == 1 else "mixed")


def stretches(record: Record, wanted: NDArray[np.bool_]) -> list[Record]:
    """The unbroken stretches of a record in which the mask (n,) is set, those long enough to be fitted."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], wanted, [False]]).astype(np.int8)))
    found = []
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start >= FEWEST:
            mask = np.zeros(wanted.size, dtype=np.bool_)
            mask[start:end] = True
            found.append(sliced(record, mask))
    return found


def _order(prepared: Prepared) -> tuple[float, float, str]:
    frequency = np.inf if prepared.cycles is None else round(prepared.cycles.frequency, 3)
    return frequency, float(np.max(np.abs(prepared.record.velocity))), prepared.record.name


def _peaks(prepared: Sequence[Prepared]) -> list[Array]:
    """(r,) largest force, speed and displacement of every record: some effects show at the rig's largest alone."""
    channels = ("force", "velocity", "displacement")
    return [np.array([np.max(np.abs(getattr(p.record, channel))) for p in prepared]) for channel in channels]


def _unfitted(prepared: Sequence[Prepared], roles: Mapping[int, Roles]) -> set[int]:
    """Places of the records with the rig's largest force, speed or displacement, where nothing near it is fitted."""
    found = set()
    for peaks in _peaks(prepared):
        near = np.flatnonzero(peaks >= (1.0 - SAME_EXTREME) * peaks.max())
        if not any(np.any(roles[int(i)] == TRAINING) for i in near):
            found.add(int(np.argmax(peaks)))
    return found


def _parts(prepared: Prepared) -> HoldOut:
    return "segments" if prepared.cycles is None else "cycles"


def _rotated(members: list[int], turn: int, extreme: set[int]) -> list[int]:
    """Members rotated by `turn`, or by the least more that lets those with an extreme be fitted.

    So over the conditions every kind of test is in every role.
    """
    count = len(members)
    shifts = [[members[(turn + more + i) % count] for i in range(count)] for more in range(count)]
    roles = _roles(count)
    return max(shifts, key=lambda order: sum(i in extreme for i, r in zip(order, roles, strict=True) if r == TRAINING))


def _roles(count: int) -> list[int]:
    """Roles of so many records of one condition, in their order."""
    role = [TRAINING] * count
    role[1::4] = [UNTOUCHED] * len(role[1::4])
    chooses = slice(3, None, 4) if count > 3 else slice(2, 3)
    role[chooses] = [VALIDATION] * len(role[chooses])
    return role


def _group(rotated: list[int], prepared: Sequence[Prepared]) -> tuple[dict[int, Roles], HoldOut]:
    """Roles in one condition, by the order of its members."""
    if len(rotated) == 1:
        only = prepared[rotated[0]]
        return {rotated[0]: _parted(only, alone=True)}, _parts(only)
    if len(rotated) == 2:
        first, second = rotated
        return {first: _parted(prepared[first], alone=False), second: _whole(prepared[second], UNTOUCHED)}, "records"
    return {i: _whole(prepared[i], r) for i, r in zip(rotated, _roles(len(rotated)), strict=True)}, "records"


def _whole(prepared: Prepared, role: int) -> Roles:
    return np.full(prepared.record.time.size, role, dtype=np.int64)


def _parted(prepared: Prepared, *, alone: bool) -> Roles:
    time = prepared.record.time
    if prepared.cycles is None:
        pattern = np.array(ALONE if alone else WITH_UNTOUCHED)
        return pattern[np.arange(time.size) * pattern.size // time.size]
    return _by_cycle(prepared.cycles.count, alone=alone)[np.clip(prepared.cycles.number(time), 0, None)]


def _by_cycle(count: int, *, alone: bool) -> Roles:
    """Roles of `count` cycles: the last quarter is untouched, the one before chooses, the rest is fitted."""
    roles = np.full(count, TRAINING, dtype=np.int64)
    untouched = max(1, count // 4) if alone else 0
    chooses = max(1, count // 4) if count - untouched >= 2 else 0
    roles[count - untouched :] = UNTOUCHED
    roles[count - untouched - chooses : count - untouched] = VALIDATION
    return roles
