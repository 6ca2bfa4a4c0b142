"""What the manifest of the figures says of each."""

from __future__ import annotations

from pzd.schema.model import Frozen


class FigureFiles(Frozen):
    """One picture of a figure."""

    png: str
    svg: str
    """Names of its files."""
    alt: str
    caption: str
    """What it shows, with its numbers beside the paper's."""
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
