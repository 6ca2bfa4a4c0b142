"""Draws all twenty figures and writes them: PNG and SVG, the manifest and the index."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from pzd.paper.figures.canvas import PAPER_STYLE, encoded
from pzd.paper.figures.numbered import PaperFigure, library
from pzd.paper.figures.sources import FigureData
from pzd.quantities import Control
from pzd.report.page import filled
from pzd.schema.model import Frozen
from pzd.schema.validate import write_json

# --- The manifest ---


class FigureFiles(Frozen):
    """The files of one picture."""

    png: str
    svg: str
    """Names of its files."""
    alt: str
    caption: str
    """Its numbers, beside the paper's."""
    sha256: dict[str, str]
    """Hash of each file."""


class FigureEntry(Frozen):
    """One figure of the paper as the manifest lists it."""

    figure: int
    title: str
    source: str
    """`stand`, `model`, `rides`, `scheme`, `computed` in its place, or `photograph`."""
    made_from: str
    pictures: tuple[FigureFiles, ...]
    missing: str | None
    """Why nothing is drawn; None where something is."""


# --- Drawing and writing ---


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
        page = filled("pzd.paper.figures", "index.html", {"entries": self.entries})
        (folder / "index.html").write_text(page, encoding="utf-8", newline="\n")


def drawn(data: FigureData, say: Callable[[str], None] = lambda _: None) -> FigureSet:
    """Draw every figure of the paper from a run; a figure whose test the run lacks says so.

    Parameters
    ----------
    data : the run
    say : is called with a line about each picture
    """
    import matplotlib as mpl

    entries: list[FigureEntry] = []
    files: dict[str, bytes] = {}
    with mpl.rc_context(PAPER_STYLE):  # type: ignore[arg-type]  # the stubs list every key of rcParams one by one
        for figure in library().values():
            entry, mine = _entry(figure, data)
            entries.append(entry)
            files |= mine
            for line in _lines(entry):
                say(line)
    return FigureSet(tuple(entries), files)


def _lines(entry: FigureEntry) -> Iterator[str]:
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
