"""What a page is made of: sections of paragraphs, lists, tables and pictures, all plain text until rendered."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from pzd.report.wording import DASH


@dataclass(frozen=True)
class Paragraph:
    """Plain sentences."""

    text: str
    kind: str = field(default="paragraph", init=False)


@dataclass(frozen=True)
class Notes:
    """A list of short sentences; `tone` is `good`, `care` or `plain`."""

    items: tuple[str, ...]
    tone: str = "plain"
    kind: str = field(default="notes", init=False)


@dataclass(frozen=True)
class TextTable:
    """A table; cells are text, and columns of numbers stand flush right."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    folded: bool = False
    """Whether the reader opens it first."""
    kind: str = field(default="table", init=False)

    def without_empty(self, *columns: str) -> TextTable:
        """The table less those of the named columns that hold nothing but dashes."""
        kept = [
            i for i, name in enumerate(self.header) if name not in columns or any(row[i] != DASH for row in self.rows)
        ]
        header, *rows = (tuple(row[i] for i in kept) for row in (self.header, *self.rows))
        return replace(self, header=header, rows=tuple(rows))

    @property
    def numeric(self) -> tuple[bool, ...]:
        """Which columns hold numbers."""
        return tuple(
            column > 0 and all(row[column][:1] in "(>0123456789\u2212\u2013" for row in self.rows)
            for column in range(len(self.header))
        )


@dataclass(frozen=True)
class Picture:
    """A picture as a data URI, with what it shows for those who do not see it."""

    title: str
    source: str
    alt: str
    caption: str


@dataclass(frozen=True)
class Gallery:
    """Pictures side by side where there is room."""

    pictures: tuple[Picture, ...]
    kind: str = field(default="gallery", init=False)


Block = Paragraph | Notes | TextTable | Gallery


@dataclass(frozen=True)
class Section:
    """One section of the page: a title and its blocks."""

    anchor: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Card:
    """One line of the headline: a question and its answer."""

    question: str
    answer: str
    detail: str
