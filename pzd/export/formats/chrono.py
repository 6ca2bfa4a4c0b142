"""Project Chrono: the nonlinear damper of a TSDA element as JSON, one curve a control signal.

`Damping Curve Data` is what Chrono::Vehicle reads: pairs of velocity [m/s] and force [N], positive in extension.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from pzd.export.content import Content

NAME = "chrono"
_ENDING = "-chrono.json"


def files(content: Content) -> Files:
    """Write a file a curve.

    Raises
    ------
    ConfigError : when the table has empty cells
    """
    from pzd.export.content import curves
    from pzd.schema.validate import json_text

    found = {}
    for one in curves(content, NAME):
        pairs = [list(pair) for pair in zip(one.velocities.tolist(), one.forces.tolist(), strict=True)]
        document = {
            "Name": one.name,
            "Type": "TSDA",
            "Description": "; ".join(filter(None, (content.origin, one.condition))),
            "Damping Curve Data": pairs,
        }
        found[f"{one.name}{_ENDING}"] = f"{json_text(document)}\n".encode()
    return found


FORMATS = (Format(NAME, "nonlinear dampers for Project Chrono, one curve a control signal", files, ending=_ENDING),)
