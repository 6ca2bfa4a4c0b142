"""The comfort numbers and the page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Self

from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.model import Frozen


class ComfortRow(Frozen):
    """One comfort measure of one ride."""

    case: str
    point: str
    edition: str
    """The standard and its year, e.g. `ISO 2631-1:1997`."""
    measure: str
    value: float | None
    unit: str
    status: str
    """How far the number can be trusted, e.g. `verified` or `unverified transcription`."""


class PublishedRow(Frozen):
    """One published number beside ours."""

    id: str
    kind: str
    published: float | str
    computed: float | None
    unit: str
    ratio: float | None
    note: str


@dataclass(frozen=True, eq=False)
class Report:
    """The comfort numbers and the page."""

    folder: ClassVar[str] = "6-report"

    comfort: tuple[ComfortRow, ...]
    page: str
    """report.html, whole."""
    published: tuple[PublishedRow, ...] | None = None

    def write(self, folder: Path, control: Control) -> None:
        """Write comfort.csv, report.html and, where the config asks, published.csv."""
        write_rows(folder / "comfort.csv", ComfortRow, self.comfort, control)
        (folder / "report.html").write_text(self.page, encoding="utf-8")
        if self.published is not None:
            write_rows(folder / "published.csv", PublishedRow, self.published, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        published = folder / "published.csv"
        return cls(
            read_rows(folder / "comfort.csv", ComfortRow, control),
            (folder / "report.html").read_text(encoding="utf-8"),
            read_rows(published, PublishedRow, control) if published.exists() else None,
        )
