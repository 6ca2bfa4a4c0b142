"""From two states of a damper to what changed between them, with the compared cycles."""

from __future__ import annotations

from dataclasses import dataclass

from pzd.artefacts.changes import Changes
from pzd.diagnosis.changes.findings import Findings, findings_between
from pzd.diagnosis.changes.pairs import course, unstacked
from pzd.diagnosis.changes.state import State
from pzd.diagnosis.changes.verdict import changes_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.identification.config import IdentifyConfig
from pzd.quantities import Control
from pzd.record import Array
from pzd.schema.errors import DataError


@dataclass(frozen=True, eq=False)
class ComparedCycle:
    """One compared motion over the cycle, for the picture; every array is (points,)."""

    before: str | None
    after: str
    voltage: float | None
    displacement: Array
    velocity: Array
    force_before: Array
    force_after: Array
    explained: Array
    """Difference that the changes make [N]."""


@dataclass(frozen=True, eq=False)
class Compared:
    """What changed, and the curves behind it."""

    changes: Changes
    cycles: tuple[ComparedCycle, ...]
    undetermined: tuple[str, ...] = ()
    """Why the result is not to be trusted: T0 or C of a state is undetermined."""


def changes_between(
    before: State, after: State, diagnose: DiagnoseConfig, identify: IdentifyConfig, control: Control
) -> Compared:
    """Find what changed between two states of a damper.

    Parameters
    ----------
    before : the first state, whose damper carries small differences of motion and stands in for motions not run in it
    after : the second state
    diagnose : thresholds and the priors on how tests differ
    identify : for what counts as one condition
    control : the control signal, for units

    Raises
    ------
    DataError : when no test of the second state can be compared, or one state alone has a control signal
    """
    without = [s for s in (before, after) if all(record.voltage is None for record in s.records)]
    if len(without) == 1:
        raise DataError(
            f"{without[0].name}: its tests have no {control.name}, those of the other state do; give it in both, or in "
            "neither"
        )
    findings = findings_between(before, after, diagnose, identify, control)
    return Compared(changes_of(findings), _cycles(findings), (*before.undetermined, *after.undetermined))


def _cycles(found: Findings) -> tuple[ComparedCycle, ...]:
    """Return the compared cycles over their phase, with the difference that the changes make."""
    cycles = []
    for c, made in zip(found.comparisons, found.best.differences, strict=True):
        points = c.motion.time.size - c.begin
        cycles.append(
            ComparedCycle(
                c.before,
                c.after,
                c.voltage,
                c.motion.displacement[c.begin :],
                c.motion.velocity[c.begin :],
                course(c.reference, points),
                course(c.measured, points),
                course(unstacked(made), points),
            )
        )
    return tuple(cycles)
