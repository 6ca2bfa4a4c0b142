"""Parts of a page: numbers as text, and sections of paragraphs, lists, tables and pictures, plain until rendered."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import zip_longest

from pzd.comfort.iso2631_1978 import LONGEST_MIN

# --- Numbers, units and times as people read them ---

THIN = "\u202f"
MINUS = "\u2212"
DASH = "\u2013"
TIMES = "\u00d7"
NO_BREAK = "\u00a0"
"""A space at which no line breaks."""

_UNITS = {"m/s^1.75": "m/s¹·⁷⁵", "degC": "°C", "-": ""}
"""Units that are printed otherwise than with their digits raised."""
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def unit_of(unit: str) -> str:
    """Return a unit as it is printed.

    >>> unit_of("N s2/m2")
    'N s²/m²'
    """
    return _UNITS[unit] if unit in _UNITS else unit.translate(_SUPERSCRIPT)


def number(value: float | None, digits: int = 3) -> str:
    """Write a number to at most so many significant digits, thin spaces between thousands; a dash for none.

    >>> number(0.0123456), number(22.04)
    ('0.0123', '22')
    """
    if value is None or not math.isfinite(value):
        return DASH
    if value == 0.0:
        return "0"
    magnitude = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if magnitude >= 6 or magnitude < -4:
        power = str(magnitude).translate(_SUPERSCRIPT)
        return f"{_decimal(value / 10.0**magnitude, digits - 1)}{NO_BREAK}{TIMES}{NO_BREAK}10{power}"
    return _decimal(round(value, digits - 1 - magnitude), max(digits - 1 - magnitude, 0))


def _decimal(value: float, places: int) -> str:
    text = f"{value:,.{places}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return text.replace(",", THIN).replace("-", MINUS)


def amount(value: float | None, unit: str, digits: int = 3) -> str:
    """Write a number with its unit; a dash alone where there is none."""
    text, shown = number(value, digits), unit_of(unit)
    return text if text == DASH or not shown else f"{text}{NO_BREAK}{shown}"


def percent(share: float | None) -> str:
    """Write a share in percent."""
    return DASH if share is None else f"{number(100.0 * share, 2)}{NO_BREAK}%"


def minutes(value: float | None) -> str:
    """Write a time of exposure [min]."""
    if value is None:
        return DASH
    if value >= LONGEST_MIN:
        return f">{NO_BREAK}24{NO_BREAK}h"
    hours, rest = divmod(round(value), 60)
    if not hours:
        return f"{rest}{NO_BREAK}min"
    return f"{hours}{NO_BREAK}h{NO_BREAK}{rest}{NO_BREAK}min" if rest else f"{hours}{NO_BREAK}h"


def listed(words: list[str], last: str = "and") -> str:
    """Join words to an enumeration: `a, b and c`."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}" if words else ""


def spelled(name: str) -> str:
    """Return the name of an effect or a policy as the page writes it."""
    return name.replace("_", " ")


_LONGEST_LABEL = 32
"""Characters of a label of the vertical axis of a plot: half of the width stays for the axes."""


def shortened(label: str) -> str:
    """Return a label that leaves room for the plot beside it: names of files differ at their ends, so the middle goes.

    Examples
    --------
    >>> shortened("damper_12_after_endurance_run_sine_2Hz_150V")
    'damper_12_after…un_sine_2Hz_150V'
    """
    if len(label) <= _LONGEST_LABEL:
        return label
    half = (_LONGEST_LABEL - 1) // 2
    return f"{label[:half]}…{label[half + 1 - _LONGEST_LABEL :]}"


_TYPEWRITTEN = {raised: chr(plain) for plain, raised in _SUPERSCRIPT.items()}
_TYPEWRITTEN |= str.maketrans({NO_BREAK: " ", THIN: "", MINUS: "-", TIMES: "x", DASH: "-", "\u00b0": "deg"})


def typewritten(text: str) -> str:
    """Return a text of the page with the signs that every terminal has.

    >>> typewritten(f"a_w {amount(-0.65, 'm/s2')}")
    'a_w -0.65 m/s2'
    """
    return text.translate(_TYPEWRITTEN)


def sentence(text: str) -> str:
    """Return text with a capital at its start and a full stop at its end."""
    text = text.strip()
    if not text:
        return ""
    return text[0].upper() + text[1:] + ("" if text[-1] in ".!?" else ".")


# --- Sections and their blocks ---

WIDE = 36
"""Characters from which on the lines of a cell are broken."""
MOST_BESIDE = 7
"""Columns of a table that stands beside words; one with more takes the whole width."""


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

    @property
    def numeric(self) -> tuple[bool, ...]:
        """Which columns hold numbers: cells that begin as such and are no longer than an interval with its unit."""
        return tuple(
            column > 0
            and all(row[column][:1] in "(>0123456789\u2212\u2013" and len(row[column]) <= WIDE for row in self.rows)
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
    """Pictures side by side, where there is room."""

    pictures: tuple[Picture, ...]
    kind: str = field(default="gallery", init=False)


Block = Paragraph | Notes | TextTable | Gallery


@dataclass(frozen=True)
class SectionRow:
    """Words, and the tables and pictures that they speak of beside them."""

    words: tuple[Paragraph | Notes, ...]
    shown: tuple[TextTable | Gallery, ...]

    @property
    def broad(self) -> bool:
        """Whether a table needs the whole width, so that the words stand above."""
        return any(isinstance(block, TextTable) and len(block.header) > MOST_BESIDE for block in self.shown)


@dataclass(frozen=True)
class Section:
    """One section of the page: a title and its blocks."""

    anchor: str
    title: str
    blocks: tuple[Block, ...]

    @property
    def rows(self) -> tuple[SectionRow, ...]:
        """The blocks in their order, each run of words with what comes behind it."""
        rows: list[SectionRow] = []
        for block in self.blocks:
            last = rows[-1] if rows else SectionRow((), ())
            if isinstance(block, Paragraph | Notes):
                joins = bool(rows) and not last.shown
                row = SectionRow((*last.words, block), ()) if joins else SectionRow((block,), ())
            else:
                joins, row = bool(rows), SectionRow(last.words, _beside(last.shown, block))
            rows[-1:] = [row] if joins else [*rows[-1:], row]
        return tuple(rows)


def _beside(shown: tuple[TextTable | Gallery, ...], block: TextTable | Gallery) -> tuple[TextTable | Gallery, ...]:
    """Put a block behind others; pictures in a row go on in the same gallery, so that no row has a hole."""
    if shown and isinstance(block, Gallery) and isinstance(shown[-1], Gallery):
        return (*shown[:-1], Gallery(shown[-1].pictures + block.pictures))
    return (*shown, block)


@dataclass(frozen=True)
class Card:
    """One line of the headline: a question and its answer."""

    question: str
    answer: str
    detail: str


@dataclass(frozen=True)
class Opening:
    """What a page begins with: the answer in a sentence, and the pictures that show it."""

    answer: str
    pictures: tuple[Picture, ...] = ()
    about: tuple[tuple[str, str], ...] = ()
    """What the user says of the damper and its tests, by name."""


# --- Rows of pictures ---

Pictures = Mapping[str, tuple[tuple[Picture, ...], ...]]
"""By place on the page, then by kind."""

_ROW = 3
"""Pictures side by side on a wide screen."""


def by_turns(kinds: tuple[tuple[Picture, ...], ...]) -> tuple[Gallery, ...]:
    """Arrange pictures in rows of one of each kind: the first of all, then the second of all."""
    rows = (tuple(picture for picture in row if picture is not None) for row in zip_longest(*kinds))
    return tuple(Gallery(row) for row in rows if row)


def galleries(kinds: tuple[tuple[Picture, ...], ...]) -> tuple[Gallery, ...]:
    """Arrange pictures in rows of up to three: a kind stays together, and joins the row before where it fits whole."""
    rows: list[tuple[Picture, ...]] = []
    for pictures in kinds:
        if rows and len(rows[-1]) + len(pictures) <= _ROW:
            rows[-1] += pictures
        elif pictures:
            rows.append(pictures)
    return tuple(Gallery(row) for row in rows)
