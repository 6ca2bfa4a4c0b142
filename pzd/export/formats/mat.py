"""MATLAB 5: breakpoints and tables as the lookup blocks of Simulink take them.

`table` over `bp1` (control signal) and `bp2` (velocity), with more than one temperature over `bp3` too; over the
velocity alone, as `bp1`, where the table has one control signal or none. `inverse` gives the control signal over
`inverse_bp1` (velocity) and `inverse_bp2`, the share of the way from the lowest force that the damper gives at that
velocity, `inverse_low`, to the highest, `inverse_high`: every share has its control signal, and no breakpoint lies out
of reach.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pzd.export.content import Content
    from pzd.record import Array

_TEXT = 116
"""Bytes of text at the start of a MAT-file of level 5; MATLAB 2023, MAT-file format."""


def files(content: Content) -> Files:
    """Write one file of level 5."""
    return {f"{content.name}.mat": matlab(_variables(content), content)}


def matlab(variables: Mapping[str, Any], content: Content) -> bytes:
    """Write variables as a file of level 5, which says where the damper comes from.

    Parameters
    ----------
    variables : by name; a mapping becomes a structure
    content : the damper
    """
    from io import BytesIO

    from scipy.io import savemat

    written = BytesIO()
    savemat(written, dict(variables), oned_as="row", long_field_names=True)  # type: ignore[arg-type]  # a file will do
    text = f"MATLAB 5.0 MAT-file, {content.origin}".encode()[:_TEXT].ljust(_TEXT)  # in place of the time of writing
    return text + written.getvalue()[_TEXT:]


def _variables(content: Content) -> dict[str, Any]:
    """Return the variables of the file by name."""
    import numpy as np

    from pzd.quantities import FORCE, TEMPERATURE, VELOCITY

    grid, control = content.grid, content.control
    forces = np.moveaxis(grid.forces, 0, 2)
    found: dict[str, Any] = {"origin": content.origin, "damper": _parameters(content)}
    found["bp2" if content.adjustable else "bp1"] = grid.velocities
    found["units"] = {q.name: q.unit for q in (VELOCITY, FORCE)}
    if content.adjustable:
        found |= {"bp1": grid.voltages} | _inverse(content)
        found["units"][control.name] = control.unit
    if len(grid.temperatures) > 1:
        found["bp3" if content.adjustable else "bp2"] = np.array(grid.temperatures, dtype=np.float64)
        found["units"][TEMPERATURE.name] = TEMPERATURE.unit
    else:
        forces = forces[:, :, 0]
    found["table"] = forces if content.adjustable else forces[0]
    return found


def _inverse(content: Content) -> dict[str, Any]:
    """Return the inverse, its last axis the temperature where there are several."""
    import numpy as np

    from pzd.export.content import inverses

    found = inverses(content)

    def over_temperatures(parts: list[Array]) -> Array:
        return np.stack(parts, axis=-1) if len(parts) > 1 else parts[0]

    return {
        "inverse_bp1": content.grid.velocities,
        "inverse_bp2": found[0].shares,
        "inverse": over_temperatures([one.signals for one in found]),
        "inverse_low": over_temperatures([one.low for one in found]),
        "inverse_high": over_temperatures([one.high for one in found]),
    }


def _parameters(content: Content) -> dict[str, Any]:
    """Return T0, C and k by column, the parameters of the effects, and their references, as structures."""
    import numpy as np

    from pzd.export.content import tables

    numbers = {
        name: {
            key: np.array([np.nan if cell is None else cell for cell in column]) for key, column in table.cells.items()
        }
        for name, table in tables(content).items()
        if name in ("base", "reference")
    }
    effects = {
        name: {content.control.renamed(key): np.atleast_1d(value) for key, value in given.items()}
        for name, given in content.damper.effects.items()
    }
    base = numbers.get("base", np.zeros((0, 0)))  # of a measured curve there is none
    return {"base": base, "effects": effects or np.zeros((0, 0)), **numbers.get("reference", {})}


FORMATS = (Format("mat", "breakpoints and tables for Simulink and Octave", files),)
