"""Which layout fits a rig file: the file has its columns, and what is read by it is accepted."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from pzd.rig.config import FilesEntry, Limits, NamedLayout
from pzd.rig.files.layout import NEEDED
from pzd.rig.files.layouts import all_layouts, named_layout
from pzd.rig.files.reading import read
from pzd.schema.errors import UserError

_HERE = Path()
"""The current folder: rig files are named as seen from it, and layouts of the user may lie in it."""


def best_layout(path: Path, header: Sequence[str], asked: str | None = None) -> tuple[str, NamedLayout] | None:
    """Name and content of the layout that fits a file; the one that names most of its columns where several do.

    Parameters
    ----------
    path : the file, as seen from the current folder, in which layouts of the user may lie
    header : its headers, as far as they could be seen
    asked : the layout to read it by; by default any

    Returns
    -------
    the layout, None where none fits

    Raises
    ------
    UserError : when the file cannot be read by the layout that was asked for, with what is wrong
    """
    if asked is not None:
        layout = named_layout(asked, _HERE, "--layout")
        _read(path, asked, layout)
        return asked, layout
    likely = {name: layout for name, layout in all_layouts(_HERE).items() if _likely(layout, path, header)}
    for name in sorted(likely, key=lambda name: len(likely[name].columns), reverse=True):
        try:
            _read(path, name, likely[name])
        except UserError:
            continue
        return name, likely[name]
    return None


def _likely(layout: NamedLayout, path: Path, header: Sequence[str]) -> bool:
    """Whether a layout names the columns of a recording, all of them are there, and the file's name is as it says."""
    columns = layout.columns
    recording = all(quantity.name in columns for quantity in NEEDED)
    named = layout.name is None or re.search(layout.name, path.stem) is not None
    return recording and named and {head for head in columns.values() if head} <= set(header)


def _read(path: Path, name: str, layout: NamedLayout) -> None:
    """Read a file by a layout, for its refusals alone."""
    # A refusal names the file as it was given, as seen from where the command stands.
    read((FilesEntry(path=str(path), layout=name),), Limits(), layout.control.signal(), _HERE)
