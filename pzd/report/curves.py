"""Which characteristics the page shows, and which share a colour: those of one control value, or of one setting."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from pzd.artefacts import Characteristics, ContinuousVelocityRow, PeakVelocityRow
from pzd.report.context import ReportContext

Row = TypeVar("Row", PeakVelocityRow, ContinuousVelocityRow)


def characteristics_of(context: ReportContext) -> Characteristics:
    """What the tests of the chosen setting show without any model; of every setting where nothing else is set."""
    found = context.identified.characteristics
    voltages = {row.voltage_V for row in found.peak_velocity} | {row.voltage_V for row in found.warm_up}
    if voltages <= {None} and not found.steps:
        return found
    return Characteristics(
        tuple(row for row in found.peak_velocity if row.setting == context.chosen),
        tuple(row for row in found.continuous_velocity if row.setting == context.chosen),
        tuple(row for row in found.gas_and_friction if row.setting == context.chosen),
        tuple(row for row in found.steps if row.setting == context.chosen),
        tuple(row for row in found.warm_up if row.setting == context.chosen),
        tuple(row for row in found.as_it_stands if row.setting == context.chosen),
    )


def coloured(context: ReportContext, rows: Sequence[Row]) -> Mapping[str, list[Row]]:
    """Rows by the label of their colour, lowest control value first; one label without text where nothing differs.

    Parameters
    ----------
    context : the run, which says whether there is a control signal
    rows : of the chosen setting, or of all where there is no control signal
    """
    controlled = any(row.voltage_V is not None for row in rows)
    found: dict[str, list[Row]] = {}
    for row in sorted(rows, key=lambda row: (row.voltage_V or 0.0, row.setting or "")):
        label = context.voltage(context.nearest_level(row.voltage_V)) if controlled else row.setting or ""
        found.setdefault(label, []).append(row)
    return found


def place_of(row: PeakVelocityRow | ContinuousVelocityRow) -> tuple[str | None, float | None, float | None]:
    """The condition of a row."""
    return row.setting, row.voltage_V, row.temperature_degC
