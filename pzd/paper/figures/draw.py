"""All twenty figures drawn and written: PNG and SVG, the index and the manifest."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from pzd.paper.figures.canvas import PAPER_STYLE, encoded
from pzd.paper.figures.entry import FigureEntry, FigureFiles
from pzd.paper.figures.figure import PaperFigure
from pzd.paper.figures.index import page
from pzd.paper.figures.numbered import library
from pzd.paper.figures.sources import FigureData
from pzd.quantities import Control
from pzd.schema.jsonfile import write_json

FOLDER = "figures"
"""Beside the stages in the run's folder."""


@dataclass(frozen=True, eq=False)
class FigureSet:
    """The figures and their files."""

    entries: tuple[FigureEntry, ...]
    files: dict[str, bytes]

    def write(self, folder: Path) -> None:
        """Write the pictures, manifest.json and index.html."""
        for name, content in self.files.items():
            (folder / name).write_bytes(content)
        write_json(folder / "manifest.json", self.entries, Control())
        (folder / "index.html").write_text(page(self.entries), encoding="utf-8", newline="\n")


def drawn(data: FigureData, say: Callable[[str], None] = lambda _: None) -> FigureSet:
    """Every figure of the paper from a run.

    Parameters
    ----------
    data : the run
    say : takes a line about each picture

    Returns
    -------
    the figure_set; a figure whose test the run lacks says so
    """
    import matplotlib as mpl

    entries: list[FigureEntry] = []
    files: dict[str, bytes] = {}
    with mpl.rc_context(PAPER_STYLE):  # type: ignore[arg-type]  # the stubs list every key of rcParams one by one
        for figure in library().values():
            entry, mine = _entry(figure, data)
            entries.append(entry)
            files |= mine
            for line in _described(entry):
                say(line)
    return FigureSet(tuple(entries), files)


def _described(entry: FigureEntry) -> Iterator[str]:
    if entry.missing is not None:
        yield f"figure {entry.figure:2d}: not drawn: {entry.missing}"
    for picture in entry.pictures:
        yield f"figure {entry.figure:2d}: {picture.png}: {picture.caption}"


def _entry(figure: PaperFigure, data: FigureData) -> tuple[FigureEntry, dict[str, bytes]]:
    pictures: list[FigureFiles] = []
    files: dict[str, bytes] = {}
    missing = "a photograph in the paper" if figure.draw is None else None
    try:
        for drawing in figure.draw(data) if figure.draw else ():
            stem = f"fig-{figure.number:02d}-{drawing.part}"
            mine = dict(zip((f"{stem}.png", f"{stem}.svg"), encoded(drawing.figure), strict=True))
            hashes = {name: hashlib.sha256(content).hexdigest() for name, content in mine.items()}
            png, svg = mine
            pictures.append(FigureFiles(png=png, svg=svg, alt=drawing.alt, caption=drawing.caption, sha256=hashes))
            files |= mine
    except LookupError as error:
        missing = str(error.args[0])
    entry = FigureEntry(
        figure=figure.number,
        title=figure.title,
        source=figure.source,
        made_from=figure.made_from,
        pictures=tuple(pictures),
        missing=missing,
    )
    return entry, files
