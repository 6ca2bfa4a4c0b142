"""FMI 2.0 and 3.0, co-simulation and model exchange: the damper with its dynamics in plain C, with its sources.

In co-simulation inputs are held over a communication step, or go linearly by the derivatives that FMI 2.0 takes; within
it the path is that of our own march. In model exchange the tool that imports it integrates the same laws.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pzd.export.content import Content
    from pzd.record import Record

log = logging.getLogger(__name__)

NAME = "fmu"
_MEANING = "the damper with its dynamics for co-simulation and model exchange, FMI 2.0 and 3.0"
_COMMON = ("model.c",)
_HEADERS = ("export.h", "model.h")


def files(content: Content) -> Files:
    """Write an FMU of each version.

    Raises
    ------
    ConfigError : when an effect of the user's own has a law that C cannot hold
    FilesError : when the compiler refuses the sources
    """
    return {_name(content, version): _archive(members, content.origin) for version, members in _built(content).items()}


def certified(content: Content, records: Sequence[Record], versions: Mapping[str, str]) -> Files:
    """Write an FMU of each version with the certificate of its library on the records of the run.

    Raises
    ------
    ConfigError : when an effect of the user's own has a law that C cannot hold
    FilesError : when the compiler refuses the sources, or there is no library to run
    """
    from pzd.export.certificate import NAME as CERTIFICATE
    from pzd.export.certificate import by_library, certificate
    from pzd.export.dynamics import Dynamics, data_of
    from pzd.schema.errors import FilesError

    token, found = data_of(content, Dynamics.of(content.damper))[1], {}
    for version, members in _built(content).items():
        library = next((data for name, data in members.items() if name.startswith("binaries/")), None)
        if library is None:
            raise FilesError(f"--certify: {_name(content, version)} holds no library of this machine to run")
        run, name = by_library(library, version, token), _name(content, version)
        written = certificate(content, name, records, run, version == 3, versions)
        found[name] = _archive({**members, f"documentation/{CERTIFICATE}": written}, content.origin)
    return found


def _name(content: Content, version: int) -> str:
    return f"{content.name}-fmi{version}.fmu"


def _built(content: Content) -> dict[int, dict[str, bytes]]:
    """Return the members of the archives by the version of FMI."""
    from pzd.export.dynamics import ELEMENT_SOURCES, Dynamics, element_files, no_exchange, source
    from pzd.export.fmi import IDENTIFIER, build_description, compiled_library, fmi2, fmi3, folders, suffix

    dynamics = Dynamics.of(content.damper)
    if reason := no_exchange(content.damper):
        log.warning("the FMUs are for co-simulation alone, without model exchange: %s", reason)
    element, token = element_files(content, dynamics)
    found = {}
    for version, folder in zip((2, 3), folders(), strict=True):
        own = (f"fmi{version}.c", *_COMMON)
        to_compile = (*own, *ELEMENT_SOURCES)
        sources = {name: source(content, name) for name in (*own, *_HEADERS)} | element
        members = {f"sources/{name}": text for name, text in sources.items()}
        if version == 2:
            members["modelDescription.xml"] = fmi2(content, dynamics, token, to_compile).encode()
        else:
            members["modelDescription.xml"] = fmi3(content, dynamics, token).encode()
            members["sources/buildDescription.xml"] = build_description(to_compile).encode()
        if folder is not None:
            members[f"binaries/{folder}/{IDENTIFIER}{suffix()}"] = compiled_library(sources, to_compile)
        found[version] = members
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


FORMATS = (Format(NAME, _MEANING, files, certified, dynamics=True),)
