"""The source code that a stage may use, as one hash: edit an equation, and what hangs on it runs again."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pzd

PACKAGE = Path(pzd.__file__).parent
_MENTION = re.compile(rb"\bpzd\.(\w+)")


@cache
def code_hash(part: str, package: Path = PACKAGE) -> str:
    """Hash of one part of the package, of every part that its code mentions, and so on.

    Parameters
    ----------
    part : a module or package directly inside `package`, e.g. ``identify``
    package : folder of the package

    Returns
    -------
    SHA-256 over the names and contents of all their files
    """
    digest = hashlib.sha256()
    for used in sorted(_used(part, package)):
        for path in _files(used, package):
            digest.update(path.relative_to(package).as_posix().encode() + b"\0")
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _used(part: str, package: Path) -> set[str]:
    """A part and all that it reaches through imports; a name in a docstring counts too, which does no harm."""
    found: set[str] = set()
    waiting = {part}
    while waiting:
        found |= waiting
        mentioned = {name for one in waiting for name in _mentioned(one, package)}
        waiting = {name for name in mentioned if any(_files(name, package))} - found
    return found


@cache
def _mentioned(part: str, package: Path) -> frozenset[str]:
    sources = (path.read_bytes() for path in _files(part, package) if path.suffix == ".py")
    return frozenset(name.decode() for source in sources for name in _MENTION.findall(source))


def _files(part: str, package: Path) -> Iterator[Path]:
    if (package / f"{part}.py").is_file():
        yield package / f"{part}.py"
    for path in sorted((package / part).rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            yield path
