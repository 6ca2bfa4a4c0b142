"""Role of every sample of a rig: fitted, used to choose, or held out until the final figures.

Records are held out where a condition has three or more; of two, one is held out whole and the other is divided; a
lone record is divided by cycles, or where nothing repeats by segments. The same rig always splits the same way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.record import Array, conditions

TRAINING, VALIDATION, HELD_OUT = 0, 1, 2
"""Roles of a sample: fitted; used to choose; seen by nothing but the final figures."""
Roles = NDArray[np.int64]
HoldOut = Literal["records", "cycles", "segments", "mixed"]

ROLES_OF_LONE_RECORD = (TRAINING, VALIDATION, TRAINING, HELD_OUT, TRAINING, VALIDATION, TRAINING, HELD_OUT)
"""Roles of the segments of a record that is alone in its condition and does not repeat."""
ROLES_BESIDE_HELD_OUT = (TRAINING, VALIDATION, TRAINING, TRAINING, VALIDATION, TRAINING, TRAINING, VALIDATION)
"""Roles of the segments of such a record when another of its condition is held out."""
MOVING_RECORDS_IN_GROUP = 4
"""Fewest records with a moving voltage of which whole ones are held out.

Reason: a step and a ramp do not stand for one another; fewer are each divided."""
SAME_EXTREME = 0.05
"""Records within this share of the rig's largest force, speed or displacement show the same as the one with it."""


@dataclass(frozen=True, eq=False)
class Split:
    """Role of every sample of every record, in the order of the records."""

    roles: tuple[Roles, ...]
    """(n,) role of each sample."""
    held_out: tuple[str, ...]
    """Names of the records that are held out, wholly or in part."""
    hold_out: HoldOut
    """What was held out."""


def split(cleaned: Sequence[CleanedRecord], voltage_within: float | None, temperature_within: float) -> Split:
    """Split the records of one setting into roles.

    Parameters
    ----------
    cleaned : the records
    voltage_within : largest spread of voltage inside one condition [V]; None for 2 % of the scale
    temperature_within : largest spread of temperature inside one condition [degC]
    """
    number = {id(p.record): i for i, p in enumerate(cleaned)}
    found, moving = conditions([p.record for p in cleaned], voltage_within, temperature_within)
    groups = [condition.records for condition in found] + (
        [moving] if len(moving) >= MOVING_RECORDS_IN_GROUP else [(record,) for record in moving]
    )
    extreme = {int(np.argmax(peaks)) for peaks in _peaks(cleaned)}
    roles: dict[int, Roles] = {}
    kinds: set[HoldOut] = set()
    for turn, group in enumerate(groups):
        members = sorted((number[id(record)] for record in group), key=lambda i: _order(cleaned[i]))
        roles |= _roles_in_condition(_rotated(members, turn, extreme), cleaned)
        kinds.add("records" if len(group) > 1 else _hold_out_kind(cleaned[members[0]]))
    for i in _extremes_not_fitted(cleaned, roles):
        roles[i] = _divided_record(cleaned[i], alone=True)
        kinds.add(_hold_out_kind(cleaned[i]))
    ordered = tuple(roles[i] for i in range(len(cleaned)))
    names = (p.record.name for p, role in zip(cleaned, ordered, strict=True) if np.any(role == HELD_OUT))
    return Split(ordered, tuple(dict.fromkeys(names)), kinds.pop() if len(kinds) == 1 else "mixed")


def _order(cleaned: CleanedRecord) -> tuple[float, float, str]:
    frequency = np.inf if cleaned.cycles is None else round(cleaned.cycles.frequency, 3)
    return frequency, float(np.max(np.abs(cleaned.record.velocity))), cleaned.record.name


def _peaks(cleaned: Sequence[CleanedRecord]) -> list[Array]:
    """Return the (r,) largest force, speed and displacement of every record: some effects show only there."""
    channels = ("force", "velocity", "displacement")
    return [np.array([np.max(np.abs(getattr(p.record, channel))) for p in cleaned]) for channel in channels]


def _extremes_not_fitted(cleaned: Sequence[CleanedRecord], roles: Mapping[int, Roles]) -> set[int]:
    """Return the records with the rig's largest force, speed or displacement where nothing near it is fitted."""
    found = set()
    for peaks in _peaks(cleaned):
        near = np.flatnonzero(peaks >= (1.0 - SAME_EXTREME) * peaks.max())
        if not any(np.any(roles[int(i)] == TRAINING) for i in near):
            found.add(int(np.argmax(peaks)))
    return found


def _hold_out_kind(cleaned: CleanedRecord) -> HoldOut:
    return "segments" if cleaned.cycles is None else "cycles"


def _rotated(members: list[int], turn: int, extreme: set[int]) -> list[int]:
    """Rotate the members by `turn`, or by the least more that lets those with an extreme be fitted.

    So over the conditions every kind of test is in every role.
    """
    count = len(members)
    shifts = [[members[(turn + more + i) % count] for i in range(count)] for more in range(count)]
    roles = _roles(count)
    return max(shifts, key=lambda order: sum(i in extreme for i, r in zip(order, roles, strict=True) if r == TRAINING))


def _roles(count: int) -> list[int]:
    """Return the roles of so many records of one condition, in their order."""
    role = [TRAINING] * count
    role[1::4] = [HELD_OUT] * len(role[1::4])
    chooses = slice(3, None, 4) if count > 3 else slice(2, 3)
    role[chooses] = [VALIDATION] * len(role[chooses])
    return role


def _roles_in_condition(members: Sequence[int], cleaned: Sequence[CleanedRecord]) -> dict[int, Roles]:
    """Assign roles to the samples of the records of one condition, by the order of its members."""
    if len(members) == 1:
        return {members[0]: _divided_record(cleaned[members[0]], alone=True)}
    sizes = [cleaned[i].record.time.size for i in members]
    whole = {i: np.full(n, role) for i, n, role in zip(members, sizes, _roles(len(members)), strict=True)}
    if len(members) == 2:
        whole[members[0]] = _divided_record(cleaned[members[0]], alone=False)
    return whole


def _divided_record(cleaned: CleanedRecord, *, alone: bool) -> Roles:
    time = cleaned.record.time
    if cleaned.cycles is None:
        pattern = np.array(ROLES_OF_LONE_RECORD if alone else ROLES_BESIDE_HELD_OUT)
        return pattern[np.arange(time.size) * pattern.size // time.size]
    return _roles_of_cycles(cleaned.cycles.count, alone=alone)[np.clip(cleaned.cycles.number(time), 0, None)]


def _roles_of_cycles(count: int, *, alone: bool) -> Roles:
    """Return the roles of `count` cycles: the last quarter is held out, the one before chooses, the rest is fitted."""
    roles = np.full(count, TRAINING, dtype=np.int64)
    held_out = max(1, count // 4) if alone else 0
    chooses = max(1, count // 4) if count - held_out >= 2 else 0
    roles[count - held_out :] = HELD_OUT
    roles[count - held_out - chooses : count - held_out] = VALIDATION
    return roles
