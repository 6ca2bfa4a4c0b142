"""What a stage depends on, each part as a hash; and what of it has changed.

Its code counts: edit an equation, and what depends on it runs again. Followed are the imports of the stage's module,
wherever they stand in a file, those of what it imports, and so on. Nothing is imported for it, as numba and scipy take
a second that a run in which all is fresh does not have.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel

import pzd
from pzd.artefacts import Diagnosed, RecordEntry, Rig, Table
from pzd.config import RunConfig, check_settings
from pzd.own_effects import own_files
from pzd.pipeline.stages import Stage
from pzd.rig.config import matching
from pzd.runs import Run, file_hash, versions
from pzd.schema.errors import FilesError
from pzd.schema.validate import read_json_list

# --- The source code that a stage may use, as one hash

PACKAGE = Path(pzd.__file__).parent
_TYPES_ONLY = re.compile(r"^if TYPE_CHECKING:.*\n(?:[ \t].*\n|\n)+", re.MULTILINE)
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
    module : full name, e.g. ``pzd.identification.stage``
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
    """Return the modules that one module names, and the packages above it, which are imported before it."""
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
    """Return the file of a module or package; None where there is none of that name."""
    return _modules(package).get(name)


@cache
def _modules(package: Path) -> dict[str, Path]:
    """Return the file of every module and package, by its full name, from one walk through the folders."""
    return {
        ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__"): path
        for path in package.rglob("*.py")
    }


def _data(folder: Path) -> Iterator[Path]:
    """Yield the data files of a package folder: neither modules nor pages for people, folders without modules too."""
    for path in folder.iterdir():
        if path.is_dir():
            if path.name != "__pycache__" and not any(path.glob("*.py")):
                yield from _data(path)
        elif path.suffix not in (".py", ".md"):
            yield path


# --- Everything that a stage depends on

_WORDS = {"code": "the code", "marks": "what is not to be trusted"}
"""How a line calls what has a short name."""
_LIBRARIES = ("numpy", "scipy", "numba")
"""Whose versions may change the last digits of a result."""
_MOST_CHANGES = 3
"""How many changes a line names before it only counts them."""


def setting_of(config: RunConfig, run: Run) -> str | None:
    """Return the setting in use, by the config and by what the rig's records are.

    Raises
    ------
    ConfigError : when it is not clear which one, there is no such setting, or one of the table lies beyond them
    """
    entries = read_json_list(run.folder / Rig.folder / "records.json", RecordEntry, run.control)
    return check_settings(config, [entry.setting for entry in entries])


def block_of(config: BaseModel, annotation: Any) -> tuple[str, BaseModel] | None:
    """Name and value of the config's block of a type; None where the type is no block."""
    for name in type(config).model_fields:
        block = getattr(config, name)
        if isinstance(annotation, type) and issubclass(annotation, BaseModel) and isinstance(block, annotation):
            return name, block
    return None


def is_artefact(annotation: Any) -> bool:
    """Whether a parameter asks for what an earlier stage made."""
    return hasattr(annotation, "folder") and hasattr(annotation, "read")


def dependencies(stage: Stage, config: RunConfig, run: Run, marks: Sequence[str]) -> dict[str, str]:
    """Everything that a stage depends on, by name, each as a hash.

    Parameters
    ----------
    stage : the stage
    config : the run's config
    run : the run's folder, in which the stages before this one are up to date
    marks : why what it is made from is not to be trusted, which its manifest repeats

    Returns
    -------
    hashes of the values of its config blocks, of the files that it reads, of its code and of the libraries' versions
    """
    found: dict[str, str] = {}
    for name, annotation in stage.takes.items():
        if is_artefact(annotation):
            found |= {f"{annotation.folder}/{file}": h for file, h in run.outputs(annotation.folder).items()}
        elif block := block_of(config, annotation):
            values = _dotted(block[0], block[1].model_dump(mode="json"))
            found |= {path: _hash(value) for path, value in values.items()}
            if "folder" in stage.takes:
                found |= _file_hashes(values, run.config.parent)
        elif name == "setting":
            found[name] = _hash(setting_of(config, run))
        elif name == "seed":
            found[name] = _hash(config.seed)
    # Every stage's files name the control signal, so it counts whether the stage asks for it or not.
    found |= {path: _hash(value) for path, value in _dotted("control", config.control.model_dump()).items()}
    found |= {f"{name} version": _hash(versions()[name]) for name in _LIBRARIES}
    return found | {"marks": _hash(list(marks)), "code": code_hash(stage.function.__module__)}


def key_of(inputs: Mapping[str, str]) -> str:
    """Return the hash of everything that a stage depends on."""
    return _hash(dict(sorted(inputs.items())))


def changes(before: Mapping[str, str], now: Mapping[str, str]) -> str:
    """In words, what a stage depends on that is not as it was."""
    by_place: dict[str, list[str]] = {}
    for name in dict.fromkeys((*before, *now)):
        if before.get(name) != now.get(name):
            change = "is new" if name not in before else "is gone" if name not in now else "has changed"
            by_place.setdefault(name.rpartition("/")[0] or name, []).append(f"{_WORDS.get(name, name)} {change}")
    lines = [
        one[0] if len(one) == 1 else f"{len(one)} files of {place} have changed" for place, one in by_place.items()
    ]
    more = len(lines) - _MOST_CHANGES
    return ", ".join(lines[:_MOST_CHANGES]) + (f" and {more} more" if more > 0 else "")


def _hash(value: Any) -> str:
    return hashlib.sha256(json.dumps(value).encode()).hexdigest()


def leaves(value: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield every scalar, empty list and empty mapping of a config's data, each with its path of keys and indices."""
    below = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    if not below:
        yield path, value
    for key, inner in below:
        yield from leaves(inner, (*path, str(key)))


def _dotted(name: str, value: Any) -> dict[str, Any]:
    """Return the leaves of a block by their dotted path."""
    return {".".join(path): leaf for path, leaf in leaves(value, (name,))}


def _file_hashes(values: Mapping[str, Any], folder: Path) -> dict[str, str]:
    """Hashes of the files beside the config that its values name; absent ones are the stage's to refuse."""
    try:
        files = _files_named(values, folder)
        return {Path(os.path.relpath(file, folder)).as_posix(): file_hash(file) for file in files}
    except OSError as error:
        raise FilesError(f"{error.filename}: {error.strerror}") from error


def files_named(config: RunConfig, folder: Path) -> list[Path]:
    """Every file beside a config that its values name and that is there: records, layouts, motions, expected numbers.

    Parameters
    ----------
    config : the config
    folder : its folder
    """
    return _files_named({".".join(path): leaf for path, leaf in leaves(config.model_dump(mode="json"))}, folder)


def _files_named(values: Mapping[str, Any], folder: Path) -> list[Path]:
    paths = [value for path, value in values.items() if path.endswith(".path") and isinstance(value, str)]
    files = [file for value in paths for file in matching(folder, value)]
    files += _files_of_dampers(values, folder)
    layouts = [value for path, value in values.items() if path.endswith(".layout") and isinstance(value, str)]
    files += [file for name in layouts if (file := folder / f"{name}.yaml").is_file()]
    if expected := values.get("report.reference"):
        from pzd.report.reference import path_of

        files += [path for path in (path_of(expected, folder),) if path.is_file()]
    return files


def _files_of_dampers(values: Mapping[str, Any], folder: Path) -> Iterator[Path]:
    """Yield the files of `damper`: of curves, and those of other runs that its stage reads."""
    for path, value in values.items():
        if not path.startswith("damper.") or not isinstance(value, str):
            continue
        if path.endswith(".curve"):
            yield from matching(folder, value)
        elif path.endswith(".run"):
            found = (p for kind in (Diagnosed, Table) for p in (folder / value / kind.folder).rglob("*") if p.is_file())
            yield from sorted(found)
