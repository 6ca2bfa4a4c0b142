"""FMI 2.0 and 3.0 co-simulation: the damper with its dynamics in plain C, with its sources.

Inputs are held over a communication step, and within it the path of the element is a closed form piece by piece, so
that the size of the step adds no error of its own. An effect for which there is none is refused.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pzd.export.content import Content

NAME = "fmu"
_COMMON = ("element.c", "model.c")
_HEADERS = ("element.h", "export.h", "model.h")


def files(content: Content) -> Files:
    """Write an FMU of each version.

    Raises
    ------
    ConfigError : when the damper has an effect that is not carried exactly
    FilesError : when the compiler refuses the sources
    """
    from pzd.export.dynamics import Dynamics, data_of, source
    from pzd.export.fmi import IDENTIFIER, build_description, compiled_library, fmi2, fmi3, folders, suffix

    dynamics = Dynamics.of(content.damper, NAME)
    data, token = data_of(content, dynamics)
    found = {}
    for version, folder in zip((2, 3), folders(), strict=True):
        to_compile = (f"fmi{version}.c", *_COMMON)
        sources = {name: source(content, name) for name in (*to_compile, *_HEADERS)} | {"element_data.h": data.encode()}
        members = {f"sources/{name}": text for name, text in sources.items()}
        if version == 2:
            members["modelDescription.xml"] = fmi2(content, dynamics, token, to_compile).encode()
        else:
            members["modelDescription.xml"] = fmi3(content, dynamics, token).encode()
            members["sources/buildDescription.xml"] = build_description(to_compile).encode()
        if folder is not None:
            members[f"binaries/{folder}/{IDENTIFIER}{suffix()}"] = compiled_library(sources, to_compile)
        found[f"{content.name}-fmi{version}.fmu"] = _archive(members, content.origin)
    return found


def _archive(members: Mapping[str, bytes], comment: str) -> bytes:
    """Pack a ZIP archive without times of writing."""
    from io import BytesIO
    from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

    written = BytesIO()
    with ZipFile(written, "w") as archive:
        archive.comment = comment.encode()
        for name, data in sorted(members.items()):
            member = ZipInfo(name)  # dated 1980-01-01
            member.compress_type = ZIP_DEFLATED
            member.external_attr = 0o644 << 16
            archive.writestr(member, data)
    return written.getvalue()


FORMATS = (Format(NAME, "the damper with its dynamics for co-simulation, FMI 2.0 and 3.0", files),)
