"""Guesses, from rig files, a config that reads them; what only a person knows stays empty."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pzd.quantities import VOLTAGE, Control
from pzd.rig.config import NamedLayout
from pzd.rig.files.file_names import value_in_names
from pzd.rig.files.fitting import best_layout
from pzd.rig.files.formats import TEXT
from pzd.rig.files.guessed_entry import Sniffed, by_headers, by_layout, stems
from pzd.rig.files.headers import assigned, control_of
from pzd.rig.files.sniffing import Dialect, described
from pzd.schema.errors import DataError, at
from pzd.schema.scalars import written

_SHOWN = 6
"""Headers that a refusal shows."""
_WITHOUT_CAR = (
    "# No control signal was found. A report on the damper alone, without a car that rides on it, needs this line too:",
    "# stages: [rig, identify, diagnose, table, report]",
)


def guessed(files: Sequence[Path], layout: str | None = None) -> list[str]:
    """A config for rig files, as lines of YAML, with empty places where only a person knows the answer.

    Parameters
    ----------
    files : the rig files
    layout : the layout to read them by; by default one that fits, else none

    Returns
    -------
    the lines; each empty place says in a comment what to fill in

    Raises
    ------
    DataError : when a file is no table of a rig's channels, a line a file
    UserError : when a file cannot be read, or not by the layout that was asked for
    """
    fitting, found = _sorted_out(files, layout)
    control = next((one.control.signal() for one, _ in fitting.values()), None) or _control(found)
    entries = [entry for name, (fits, paths) in fitting.items() for entry in by_layout(name, fits, paths)]
    entries += by_headers(found, control)
    lines = [] if not found else ["# Guessed from the headers: check every line. Paths are relative to this file."]
    if fitting:
        lines.append("# By the layout that fits: check its values for your rig. Paths are relative to this file.")
    if not any(entry.controlled for entry in entries):
        lines += _WITHOUT_CAR
    if control != Control():
        lines.append(f"control: {{name: {control.name}, unit: {control.unit}}}")
    settings = {setting for entry in entries for setting in entry.settings}
    names = sorted(setting for setting in settings if setting is not None)
    if len(settings) > 1:
        lines.append(
            f"setting: {written(names[0])}    # diagnose and all behind it are about one of {', '.join(names)}"
        )
    return [*lines, "rig:", "  files:", *(line for entry in entries for line in entry.lines)]


def _sorted_out(
    files: Sequence[Path], layout: str | None
) -> tuple[dict[str, tuple[NamedLayout, list[Path]]], list[Sniffed]]:
    """The layouts that fit, each with its files, and the files that none fits."""
    fitting: dict[str, tuple[NamedLayout, list[Path]]] = {}
    found: list[Sniffed] = []
    faults: list[str] = []
    for path in files:
        try:
            dialect, form = described(path)
            fits = best_layout(path, dialect.header, layout)
            if fits is None:
                found.append(_file(path, dialect, form))
            else:
                fitting.setdefault(fits[0], (fits[1], []))[1].append(path)
        except DataError as error:
            faults += error.messages if layout else [f"{error.messages[0]}; init reads tables of named columns"]
    if faults:
        raise DataError(faults)
    return fitting, found


def _control(files: Sequence[Sniffed]) -> Control:
    control = control_of([header for file in files for header in file.dialect.header])
    if control == Control() and not any(VOLTAGE in dict(file.columns) for file in files):
        control = Control("current", "A") if value_in_names(stems(files), "current") else control
    return control


def _file(path: Path, dialect: Dialect, form: str) -> Sniffed:
    columns = assigned(dialect.header, dialect.units, control_of(dialect.header))
    if not columns:
        shown = ", ".join(dialect.header[:_SHOWN]) + (", ..." if len(dialect.header) > _SHOWN else "")
        line = dialect.header_line if form == TEXT else None
        raise DataError(f"{at(path, line)}: no header names time, displacement or force (got {shown})")
    return Sniffed(path, dialect, tuple(columns.items()), form)
