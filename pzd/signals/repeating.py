"""The cycles of a record, found once: fit, measures and characteristics all ask for them."""

from __future__ import annotations

from weakref import WeakKeyDictionary

from pzd.record import Record
from pzd.signals.cycles import Cycles, cycles

_found: WeakKeyDictionary[Record, Cycles | None] = WeakKeyDictionary()
"""By the record itself, whose arrays nobody changes; it goes with the record."""


def cycles_of(record: Record) -> Cycles | None:
    """The longest run of cycles that repeat in a record, None where it holds none; see `pzd.signals.cycles`."""
    if record not in _found:
        _found[record] = cycles(record.time, record.displacement)
    return _found[record]


def remember(record: Record, run: Cycles | None) -> None:
    """Keep the cycles of a record that were found where it was made, perhaps in another process."""
    _found[record] = run
