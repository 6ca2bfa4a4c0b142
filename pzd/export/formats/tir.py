"""Property files for codes of vehicle dynamics, in the syntax of .tir and .dpr (TeimOrbit), one curve a control signal.

Velocity and force are positive in rebound, in the units that each file names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from pzd.export.content import Content, ForceCurve

NAME = "tir"
_ENDING = ".dpr"


def files(content: Content) -> Files:
    """Write a file a curve.

    Raises
    ------
    ConfigError : when the table has empty cells
    """
    from pzd.export.content import curves

    return {f"{one.name}{_ENDING}": _text(one, content.origin).encode() for one in curves(content, NAME)}


def _text(curve: ForceCurve, origin: str) -> str:
    remarks = [origin, f"{curve.condition or 'one curve'}; rebound positive"]
    rows = (f"{v!r} {F!r}\n" for v, F in zip(curve.velocities.tolist(), curve.forces.tolist(), strict=True))
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
            *rows,
        )
    )


FORMATS = (Format(NAME, "property files for vehicle dynamics, one curve a control signal", files, ending=_ENDING),)
