"""The source code that a stage may use, as one hash: edit an equation, and what depends on it runs again.

Followed are the imports of the stage's module, wherever they stand in a file, and those of what it
imports, and so on. Nothing is imported for it, as numba and scipy take a second that a run in which
all is fresh does not have.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pzd
from pzd.own_effects import own_files

PACKAGE = Path(pzd.__file__).parent
_TYPES_ONLY = re.compile(r"^if TYPE_CHECKING:\n(?:[ \t].*\n|\n)+", re.MULTILINE)
"""Imports for annotations alone, which are not executed."""
_FROM = re.compile(r"^[ \t]*from (pzd[\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)
"""An import of names, each of which may be a module; in brackets over several lines."""
_MENTION = re.compile(r"\bpzd(?:\.\w+)+(\.(?=\{))?")
"""A dotted name, in an import or in a text that is imported later; a brace behind its last dot stands for any name."""
_EFFECTS = "pzd.damper.effects"
"""What takes in effect files of one's own."""
_WHOLE_FOLDER = "iter_modules(__path__)"
"""By this a package finds its members, so that all of its folder counts."""


@cache
def code_hash(module: str, package: Path = PACKAGE) -> str:
    """Hash of a module, of everything that it imports, and so on, with the data that lies beside them.

    Parameters
    ----------
    module : full name, e.g. ``pzd.identify.stage``
    package : folder of the package

    Returns
    -------
    SHA-256 over the names and contents of all the files, and of effect files of one's own where effects count
    """
    digest = hashlib.sha256()
    for path in files_used(module, package):
        digest.update(path.relative_to(package).as_posix().encode() + b"\0")
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    for path in own_files() if _EFFECTS in modules_used(module, package) else ():
        digest.update(path.name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def files_used(module: str, package: Path = PACKAGE) -> list[Path]:
    """Every file that a module may execute or read: modules, and data in the folders of their packages.

    Parameters
    ----------
    module : full name
    package : folder of the package
    """
    modules = {path for name in modules_used(module, package) if (path := _file(name, package))}
    return sorted(modules | {data for folder in {path.parent for path in modules} for data in _data(folder)})


def modules_used(module: str, package: Path = PACKAGE) -> set[str]:
    """Full names of a module and of all that it reaches through imports.

    A name that only a docstring mentions counts too, which does no harm.

    Parameters
    ----------
    module : full name
    package : folder of the package
    """
    found: set[str] = set()
    waiting = {module}
    while waiting:
        found |= waiting
        waiting = {imported for name in waiting for imported in _imports_of(name, package)} - found
    return found


@cache
def _imports_of(name: str, package: Path) -> frozenset[str]:
    """The modules that one module names, and the packages above it, which are imported before it."""
    path = _file(name, package)
    if path is None:
        return frozenset()
    source = _TYPES_ONLY.sub("", path.read_text(encoding="utf-8"))
    mentioned = {f"{found[1]}.{one}" for found in _FROM.finditer(source) for one in re.findall(r"\w+", found[2])}
    for mention in _MENTION.finditer(source):
        mentioned |= _below(mention[0][:-1], package) if mention[1] else {mention[0]}
    if _WHOLE_FOLDER in source:
        mentioned |= _below(name, package)
    imported = {
        ".".join(one.split(".")[: length + 1]) for one in {*mentioned, name} for length in range(one.count(".") + 1)
    }
    return frozenset(one for one in imported if one != name and _file(one, package))


def _below(name: str, package: Path) -> set[str]:
    """Every module of a package and of the packages in it."""
    return {one for one in _modules(package) if one == name or one.startswith(f"{name}.")}


def _file(name: str, package: Path) -> Path | None:
    """The file of a module or package; None where there is none of that name."""
    return _modules(package).get(name)


@cache
def _modules(package: Path) -> dict[str, Path]:
    """The file of every module and package, by its full name, from one walk through the folders."""
    return {
        ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__"): path
        for path in package.rglob("*.py")
    }


def _data(folder: Path) -> Iterator[Path]:
    """The files of a package that are no modules and no pages for people, also in folders that hold no modules."""
    for path in folder.iterdir():
        if path.is_dir():
            if path.name != "__pycache__" and not any(path.glob("*.py")):
                yield from _data(path)
        elif path.suffix not in (".py", ".md"):
            yield path
