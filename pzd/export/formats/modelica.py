"""Modelica: a text file for CombiTable2Ds and CombiTable1Ds of the standard library.

`force` is a CombiTable2Ds with the control signal as u1 and the velocity as u2, and a CombiTable1Ds over the velocity
where the table has one control signal or none. `inverse` has the velocity as u1, and as u2 the share of the way from
the lowest force that the damper gives at that velocity to the highest, the columns of the CombiTable1Ds
`inverse_range`. With several temperatures each has tables of its own, `force_1` and so on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from pzd.export.content import Content
    from pzd.record import Array

NAME = "modelica"


def files(content: Content) -> Files:
    """Write one text file with every table.

    Raises
    ------
    ConfigError : when the table has empty cells
    """
    import numpy as np

    from pzd.export.content import comment, inverses
    from pzd.quantities import FORCE, TEMPERATURE, VELOCITY

    grid, control = content.full_grid(NAME), content.control
    text = [
        "#1\n",
        comment([content.origin, f"velocity [{VELOCITY.unit}], rebound positive; force [{FORCE.unit}]"], "#"),
    ]
    inverse_tables = inverses(content)
    for n, (temperature, forces) in enumerate(zip(grid.temperatures, grid.forces, strict=True)):
        number = f"_{n + 1}" if len(grid.temperatures) > 1 else ""
        if temperature is not None:
            text.append(comment([f"at {temperature:.12g} {TEMPERATURE.unit}:"], "#"))
        if not content.adjustable:
            text.append(_table(f"force{number}", np.column_stack([grid.velocities, forces[0]])))
            continue
        text.append(comment([f"force: u1 {control.name} [{control.unit}], hold beyond its ends; u2 velocity"], "#"))
        text.append(_table(f"force{number}", _bordered(grid.voltages, grid.velocities, forces)))
        inverse = inverse_tables[n]
        text.append(comment([f"inverse: u1 velocity, u2 share of inverse_range; {control.name} [{control.unit}]"], "#"))
        text.append(_table(f"inverse{number}", _bordered(grid.velocities, inverse.shares, inverse.signals)))
        columns = np.column_stack([grid.velocities, inverse.low, inverse.high])
        text.append(_table(f"inverse_range{number}", columns))
    return {f"{content.name}.txt": "".join(text).encode()}


def _bordered(rows: Array, columns: Array, values: Array) -> Array:
    """Return a table with its arguments as first column and first row."""
    import numpy as np

    return np.vstack([np.append(0.0, columns), np.column_stack([rows, values])])


def _table(name: str, cells: Array) -> str:
    lines = (" ".join(repr(float(cell)) for cell in row) for row in cells)
    return f"double {name}({cells.shape[0]},{cells.shape[1]})\n" + "".join(f"{line}\n" for line in lines)


FORMATS = (Format(NAME, "text of tables for CombiTable2Ds", files),)
