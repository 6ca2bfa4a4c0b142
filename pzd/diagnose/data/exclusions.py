"""Which records the diagnosis uses: a load cell that was cut off hides what it should show."""

from __future__ import annotations

from collections.abc import Sequence

from pzd.artefacts import Rig
from pzd.record import Record


def whole_records(rig: Rig, setting: str | None) -> tuple[list[Record], tuple[str, ...]]:
    """The records of a setting whose force is not cut off, and the names of the others; all where none is whole."""
    mine = [record for record in rig.records if record.setting == setting]
    cut_off = {entry.name for entry in rig.entries if any(_cuts_the_force(f.check, f.where) for f in entry.findings)}
    whole = [record for record in mine if record.name not in cut_off]
    return (whole, tuple(r.name for r in mine if r.name in cut_off)) if whole else (mine, ())


def _cuts_the_force(check: str, where: str) -> bool:
    return check == "saturation" and where.startswith("force")


def without(cut_off: Sequence[str]) -> str:
    """What to add to the reason where records were left out."""
    return f"; left out, for their force is cut off at the end of its range: {', '.join(cut_off)}" if cut_off else ""
