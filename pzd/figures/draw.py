"""All twenty figures drawn and written: PNG and SVG, the index and the manifest."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from pzd.figures.canvas import PAPER_STYLE, encoded
from pzd.figures.evidence import Evidence
from pzd.figures.figure import PaperFigure
from pzd.figures.numbered import library
from pzd.quantities import Control
from pzd.schema.jsonfile import write_json
from pzd.schema.model import Frozen

FOLDER = "figures"
"""Beside the stages in the run's folder."""


class Picture(Frozen):
    """One picture of a figure."""

    png: str
    svg: str
    """Names of its files."""
    alt: str
    caption: str
    """What it shows, with its numbers beside the paper's."""
    sha256: dict[str, str]
    """Hash of each file."""


class Entry(Frozen):
    """One figure of the paper as the manifest lists it."""

    figure: int
    title: str
    source: str
    """`stand`, `model`, `rides`, `scheme`, `computed` in its place, or `photograph`."""
    made_from: str
    pictures: tuple[Picture, ...]
    missing: str | None
    """Why nothing is drawn; None where something is."""


@dataclass(frozen=True, eq=False)
class Gallery:
    """The figures and their files."""

    entries: tuple[Entry, ...]
    files: dict[str, bytes]

    def write(self, folder: Path) -> None:
        """Write the pictures, manifest.json and index.html."""
        from pzd.figures.index import page

        for name, content in self.files.items():
            (folder / name).write_bytes(content)
        write_json(folder / "manifest.json", self.entries, Control())
        (folder / "index.html").write_text(page(self.entries), encoding="utf-8", newline="\n")


def drawn(evidence: Evidence, say: Callable[[str], None] = lambda _: None) -> Gallery:
    """Every figure of the paper from a run.

    Parameters
    ----------
    evidence : the run
    say : takes a line about each picture

    Returns
    -------
    the gallery; a figure whose test the run lacks says so
    """
    import matplotlib as mpl

    entries: list[Entry] = []
    files: dict[str, bytes] = {}
    with mpl.rc_context(PAPER_STYLE):  # type: ignore[arg-type]  # the stubs list every key of rcParams one by one
        for figure in library().values():
            entry, mine = _entry(figure, evidence)
            entries.append(entry)
            files |= mine
            for line in _described(entry):
                say(line)
    return Gallery(tuple(entries), files)


def _described(entry: Entry) -> Iterator[str]:
    if entry.missing is not None:
        yield f"figure {entry.figure:2d}: not drawn: {entry.missing}"
    for picture in entry.pictures:
        yield f"figure {entry.figure:2d}: {picture.png}: {picture.caption}"


def _entry(figure: PaperFigure, evidence: Evidence) -> tuple[Entry, dict[str, bytes]]:
    pictures: list[Picture] = []
    files: dict[str, bytes] = {}
    missing = "a photograph in the paper" if figure.draw is None else None
    try:
        for drawing in figure.draw(evidence) if figure.draw else ():
            stem = f"fig-{figure.number:02d}-{drawing.part}"
            mine = dict(zip((f"{stem}.png", f"{stem}.svg"), encoded(drawing.figure), strict=True))
            hashes = {name: hashlib.sha256(content).hexdigest() for name, content in mine.items()}
            png, svg = mine
            pictures.append(Picture(png=png, svg=svg, alt=drawing.alt, caption=drawing.caption, sha256=hashes))
            files |= mine
    except LookupError as error:
        missing = str(error.args[0])
    entry = Entry(
        figure=figure.number,
        title=figure.title,
        source=figure.source,
        made_from=figure.made_from,
        pictures=tuple(pictures),
        missing=missing,
    )
    return entry, files
