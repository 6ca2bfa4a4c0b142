"""A shared library from sources in C, the same bytes each time."""

from __future__ import annotations

import logging
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from pzd.schema.errors import FilesError

log = logging.getLogger(__name__)

_FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off")
_PLATFORMS = {
    ("linux", "x86_64"): ("linux64", "x86_64-linux"),
    ("linux", "aarch64"): (None, "aarch64-linux"),
    ("darwin", "x86_64"): ("darwin64", "x86_64-darwin"),
    ("darwin", "arm64"): ("darwin64", "aarch64-darwin"),
}
"""Folder of the library in an FMU of FMI 2.0, where there is one, and of FMI 3.0."""


def folders() -> tuple[str | None, str | None]:
    """Folder of the library in an FMU of FMI 2.0 and of FMI 3.0; None, with a warning, where it will hold none."""
    machine = (sys.platform, platform.machine())
    found = _PLATFORMS.get(machine, (None, None))
    without = [version for version, folder in zip(("2.0", "3.0"), found, strict=True) if folder is None]
    if _compiler() is None:
        found, without = (None, None), []
        log.warning("there is no C compiler (gcc or cc): the FMUs hold their sources and no library")
    for version in without:
        log.warning("pzd builds no library for FMI %s on %s %s: that FMU holds its sources alone", version, *machine)
    return found


def suffix() -> str:
    """Ending of a shared library on this machine."""
    return ".dylib" if sys.platform == "darwin" else ".so"


def compiled_library(sources: Mapping[str, bytes], to_compile: Sequence[str]) -> bytes:
    """The library.

    Parameters
    ----------
    sources : every file by name
    to_compile : those of them that are compiled

    Raises
    ------
    FilesError : when there is no compiler, or it refuses them
    """
    compiler = _compiler()
    if compiler is None:
        raise FilesError("there is no C compiler (gcc or cc)")
    linked = ["-Wl,--build-id=none"] if sys.platform == "linux" else []
    with tempfile.TemporaryDirectory() as place:
        for name, data in sources.items():
            (Path(place) / name).write_bytes(data)
        command = [compiler, *_FLAGS, *linked, *to_compile, "-o", "library", "-lm"]
        done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)  # noqa: S603  # our own sources
        if done.returncode:
            said = " ".join(done.stderr.split()) or f"exit code {done.returncode}"
            raise FilesError(f"{compiler}: it does not compile the sources of the FMU; mend or remove it ({said})")
        return (Path(place) / "library").read_bytes()


def _compiler() -> str | None:
    return shutil.which("gcc") or shutil.which("cc")
