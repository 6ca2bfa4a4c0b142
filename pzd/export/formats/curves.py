"""One curve of force over velocity a control signal and temperature: Project Chrono, and property files.

Chrono takes the nonlinear damper of a TSDA element as JSON; `Damping Curve Data` is what Chrono::Vehicle reads: pairs
of velocity [m/s] and force [N], positive in extension. Property files for codes of vehicle dynamics are in the syntax
of .tir and .dpr (TeimOrbit), velocity and force positive in rebound, in the units that each file names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from pzd.export.content import Content, ForceCurve

_CHRONO_ENDING = "-chrono.json"
_PROPERTY_ENDING = ".dpr"


def chrono_files(content: Content) -> Files:
    """Write a file a curve.

    Raises
    ------
    ConfigError : when the table has empty cells
    """
    from pzd.export.content import curves
    from pzd.schema.validate import json_text

    found = {}
    for one in curves(content, "chrono"):
        document = {
            "Name": one.name,
            "Type": "TSDA",
            "Description": "; ".join(filter(None, (content.origin, one.condition))),
            "Damping Curve Data": [list(pair) for pair in _points(one)],
        }
        found[f"{one.name}{_CHRONO_ENDING}"] = f"{json_text(document)}\n".encode()
    return found


def property_files(content: Content) -> Files:
    """Write a file a curve.

    Raises
    ------
    ConfigError : when the table has empty cells
    """
    from pzd.export.content import curves

    found = curves(content, "tir")
    return {f"{one.name}{_PROPERTY_ENDING}": _property_text(one, content.origin).encode() for one in found}


def _property_text(curve: ForceCurve, origin: str) -> str:
    remarks = [origin, f"{curve.condition or 'one curve'}; rebound positive"]
    return "".join(
        (
            f"{'$' + '-' * 69}MDI_HEADER\n[MDI_HEADER]\n",
            "FILE_TYPE = 'dpr'\nFILE_VERSION = 4.0\nFILE_FORMAT = 'ASCII'\n",
            "(COMMENTS)\n{comment_string}\n",
            *(f"'{remark.replace(chr(39), ' ')}'\n" for remark in remarks),
            f"{'$' + '-' * 74}UNITS\n[UNITS]\n",
            "LENGTH = 'meter'\nANGLE = 'radians'\nFORCE = 'newton'\nMASS = 'kg'\nTIME = 'second'\n",
            f"{'$' + '-' * 74}CURVE\n[CURVE]\n",
            "{vel force}\n",
            *(f"{velocity!r} {force!r}\n" for velocity, force in _points(curve)),
        )
    )


def _points(curve: ForceCurve) -> list[tuple[float, float]]:
    """Return velocity [m/s] and force [N] of each point."""
    return list(zip(curve.velocities.tolist(), curve.forces.tolist(), strict=True))


FORMATS = (
    Format(
        "chrono",
        "nonlinear dampers for Project Chrono, one curve a control signal",
        chrono_files,
        ending=_CHRONO_ENDING,
    ),
    Format(
        "tir",
        "property files for vehicle dynamics, one curve a control signal",
        property_files,
        ending=_PROPERTY_ENDING,
    ),
)
