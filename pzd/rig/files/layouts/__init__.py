"""Layouts of rig files by name, one YAML file each: here, or beside the config."""

from __future__ import annotations

import re
from pathlib import Path

from pzd.quantities import Control
from pzd.rig.config import FilesEntry, NamedLayout
from pzd.schema.errors import ConfigError
from pzd.schema.model import nearest
from pzd.schema.yamlfile import read_yaml

_OWN = ("path", "layout", "source")
"""Keys of an entry that no layout gives."""

_ABOUT = re.compile(rb"^about:", re.MULTILINE)
"""By this a layout is told from the other YAML files beside it."""


def all_layouts(folder: Path) -> dict[str, NamedLayout]:
    """Every layout by its name: those that come with pzd, and over them the YAML files of a folder that are layouts.

    Parameters
    ----------
    folder : where files of the user may lie

    Raises
    ------
    ConfigError : when one of them is wrong
    """
    files = [path for place in (Path(__file__).parent, folder) for path in sorted(place.glob("*.yaml"))]
    return {path.stem: read_layout(path) for path in files if _ABOUT.search(path.read_bytes())}


def named_layout(name: str, folder: Path, place: str) -> NamedLayout:
    """The layout of a name.

    Parameters
    ----------
    name : what the layout is called
    folder : the config's folder
    place : where the config names it

    Raises
    ------
    ConfigError : when there is none, or its file is wrong
    """
    path = layout_file(name, folder)
    if path is None:
        shipped = [file.stem for file in sorted(Path(__file__).parent.glob("*.yaml"))]
        near = nearest(name, shipped)
        hint = f"did you mean {near}?" if near else f"there are {', '.join(shipped)}"
        raise ConfigError(f"{place}: no such layout, here or as {name}.yaml beside the config; {hint} (got {name!r})")
    return read_layout(path)


def layout_file(name: str, folder: Path) -> Path | None:
    """The file of a layout: beside the config, else the one that comes with pzd; None where there is none."""
    places = (folder / f"{name}.yaml", Path(__file__).parent / f"{name}.yaml")
    return next((path for path in places if path.is_file()), None)


def read_layout(path: Path) -> NamedLayout:
    """The layout that a file describes.

    Raises
    ------
    ConfigError : when it is wrong, with every place
    """
    return read_yaml(path).validated(NamedLayout, Control())


def with_layout(entry: FilesEntry, layout: NamedLayout) -> FilesEntry:
    """An entry with everything that its layout says; what the entry itself says goes before it, key by key."""
    said: dict[str, object] = {}
    for name, field in FilesEntry.model_fields.items():
        ours, theirs = getattr(entry, name), getattr(layout, name)
        if name in _OWN:
            continue
        if isinstance(theirs, dict):
            said[name] = {**theirs, **ours}
        elif ours == field.default:
            said[name] = theirs
    return entry.model_copy(update=said)
