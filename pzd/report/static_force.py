"""The force at rest, such as a gas force: a rig measures it, and the table leaves it to the static balance."""

from __future__ import annotations

from collections.abc import Sequence

from pzd.damper.compose import static_force
from pzd.report.context import ReportContext
from pzd.report.wording import amount


def static_force_at(context: ReportContext, voltage: float | None) -> float:
    """What the damper handed on pushes with at rest, at a value of the control signal [N]."""
    return float(static_force(context.diagnosed.damper, voltage))


def static_force_in_words(context: ReportContext, voltages: Sequence[float | None]) -> str:
    """The same over several values, `90 N` or `80 N to 90 N`; empty where it is 0 at all."""
    forces = [static_force_at(context, voltage) for voltage in voltages]
    return " to ".join(dict.fromkeys(amount(end(forces), "N") for end in (min, max))) if any(forces) else ""
