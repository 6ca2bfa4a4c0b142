"""A record with what the rig stage knows about it: its cycles, its clean motion, its fixture."""

from __future__ import annotations

from dataclasses import dataclass

from pzd.record import Record
from pzd.rig.config import Limits
from pzd.signals.cycles import Cycles
from pzd.signals.kinematics import Kinematics


@dataclass(frozen=True, eq=False)
class Measured:
    """One record, its cycles and clean motion, and what a known fixture took out of it."""

    record: Record
    run: Cycles | None
    clean: Kinematics
    limits: Limits
    removed: str | None = None
