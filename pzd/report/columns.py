"""Columns and tables: declared once, rendered as lines of a terminal, a block of the page, plain data or a DataFrame.

A column has the name that its values have in files, a head for people, a unit, its digits, and how it takes a value
from a row of an artefact. What a value may be stands under `Cell`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from pzd.artefacts.csv_rows import Estimate
from pzd.report import blocks
from pzd.report.blocks import NO_BREAK, TextTable
from pzd.schema.errors import MOST_DIGITS, rounded_as

if TYPE_CHECKING:
    import pandas as pd


# --- Cells: what a column takes from a row ---


class Span(NamedTuple):
    """From one value to another: `0 to 150 V`."""

    first: float | None
    last: float | None


class Beyond(NamedTuple):
    """A value of the model beyond what the tests reached: `(2480 N)`."""

    value: float | None


class Difference(NamedTuple):
    """A small difference of larger values, given to their last decimal place: the rest of its digits is rounding."""

    value: float
    of: float


class Quantity(NamedTuple):
    """A value with a unit of its own, where those of a column differ."""

    value: float | Estimate | Span | None
    unit: str


Cell = str | float | Estimate | Span | Beyond | Difference | Quantity | None
"""Text, number, or one of the above; None where there is nothing."""


# --- Media: how numbers and units are written ---


@dataclass(frozen=True)
class Medium:
    """How numbers and units are written."""

    dash: str
    number: Callable[[float, int], str]
    """Text of a number to so many significant digits."""
    unit: Callable[[str], str]
    space: str
    """Between a number and its unit."""
    more_digits: int
    """Beside those of a column."""

    def amount(self, value: float | None, unit: str = "", digits: int = 3) -> str:
        """Return a number with its unit; a dash where there is none."""
        if value is None:
            return self.dash
        text, shown = self.number(value, digits + self.more_digits), self.unit(unit)
        return text if text == self.dash or not shown else f"{text}{self.space}{shown}"

    def text(self, cell: Cell, unit: str = "", digits: int = 3, factor: float = 1.0) -> str:
        """Return a cell as text.

        Parameters
        ----------
        cell : the value
        unit : behind each number; empty for none
        digits : significant digits
        factor : from the value to this unit
        """
        match cell:
            case None | Beyond(None) | Span(None) | Quantity(None):
                text = self.dash
            case str() | int():
                text = str(cell)
            case Estimate():
                text = " ".join(filter(None, (self.interval(cell), self.unit(unit))))
            case Span(first, last):
                text = f"{self.text(first, '', digits, factor)} to {self.text(last, unit, digits, factor)}"
            case Beyond(value):
                text = f"({self.text(value, unit, digits, factor)})"
            case Difference(value, of):
                text = self.amount(factor * rounded_as(value, of, digits + self.more_digits), unit, digits)
            case Quantity(value, own_unit):
                text = self.text(value, own_unit, digits, factor)
            case _:
                text = self.amount(factor * cell, unit, digits)
        return text

    def interval(self, estimate: Estimate) -> str:
        """Return a value with its 95 % interval, each to the second digit of the width of the interval."""
        if estimate.value is None:
            return self.dash
        if estimate.interval is None:
            return f"{self.amount(estimate.value)} (no interval)"
        value, low, high = (self.number(float(text), MOST_DIGITS) for text in estimate.digits())
        return f"{value} ({low}{self.space}to{self.space}{high})"


TERMINAL = Medium("-", lambda value, digits: f"{value:.{digits}g}", lambda unit: unit.removeprefix("-"), " ", 1)
PAGE = Medium(blocks.DASH, blocks.number, blocks.unit_of, NO_BREAK, 0)


# --- Columns and tables ---


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str
    """As in files; also the attribute of a row, where `value` is not given."""
    head: str
    """For people."""
    unit: str = ""
    """Of the numbers as they are shown."""
    value: Callable[[Any], Cell] | None = None
    """What a row has in the column."""
    digits: int = 3
    """Significant digits on the page; the terminal has one more. Those of an estimate follow from its interval."""
    factor: float = 1.0
    """From the numbers of the rows to those shown: 1000 where a row has metres and people read millimetres."""
    decimals: int | None = None
    """Decimal places, where all rows shall have the same."""
    optional: bool = False
    """Whether the column is left out where no row has a value."""
    words: Callable[[Any], str] | None = None
    """How a value is written, where neither digits nor unit say it."""

    def of(self, row: Any) -> Cell:
        """Return what a row has in the column."""
        cell: Cell = self.value(row) if self.value else getattr(row, self.name)
        return cell

    def text(self, row: Any, medium: Medium) -> str:
        """Return what a row has in the column as text."""
        cell = self.of(row)
        if self.words and cell is not None:
            return self.words(cell)
        if self.decimals is not None and isinstance(cell, float):
            return f"{cell:.{self.decimals}f}"
        return medium.text(cell, "", self.digits, self.factor)

    def heading(self, medium: Medium) -> str:
        """Return the head with the unit, which stands in no cell."""
        unit = medium.unit(self.unit)
        return f"{self.head} [{unit}]" if unit and not self.words else self.head


@dataclass(frozen=True)
class Table:
    r"""Rows of an artefact under declared columns.

    >>> from types import SimpleNamespace as Row
    >>> table = Table("Tests", (Column("name", "test"), Column("stroke_m", "stroke", "mm", factor=1000.0)),
    ...               (Row(name="r1", stroke_m=0.05), Row(name="r2", stroke_m=None)))
    >>> print(*table.lines(), sep="\n")
    test  stroke [mm]
    r1    50
    r2    -
    >>> table.records()
    [{'name': 'r1', 'stroke_m': 0.05}, {'name': 'r2', 'stroke_m': None}]
    """

    title: str
    columns: tuple[Column, ...]
    rows: Sequence[Any]
    fold: int | None = None
    """With more rows than this the page has the reader open the table first; None: never."""

    def without(self, *names: str) -> Table:
        """Return the table less the named columns."""
        return replace(self, columns=tuple(column for column in self.columns if column.name not in names))

    def cells(self, medium: Medium) -> list[tuple[str, ...]]:
        """Return the heads and the rows as text, less optional columns without a value."""
        shown = [c for c in self.columns if not c.optional or any(c.of(row) not in (None, "") for row in self.rows)]
        heads = tuple(column.heading(medium) for column in shown)
        return [heads, *(tuple(column.text(row, medium) for column in shown) for row in self.rows)]

    def lines(self, indent: str = "") -> list[str]:
        """Return the lines for a terminal; none without rows."""
        return aligned(self.cells(TERMINAL), indent) if self.rows else []

    def block(self) -> TextTable:
        """Return the block for a page."""
        header, *rows = self.cells(PAGE)
        return TextTable(self.title, header, tuple(rows), folded=self.fold is not None and len(rows) > self.fold)

    def across(self) -> TextTable:
        """Return the block for a page with the rows side by side, the first column as head."""
        header, *lines = zip(*self.cells(PAGE), strict=True)
        return TextTable(self.title, header, tuple(lines), folded=self.fold is not None and len(self.rows) > self.fold)

    def records(self) -> list[dict[str, Any]]:
        """Return plain data, a mapping a row: numbers in SI, of an estimate three."""
        return [{n: v for column in self.columns for n, v in _plain(column.name, column.of(row))} for row in self.rows]

    def to_frame(self) -> pd.DataFrame:
        """Return a DataFrame with the columns of `records`."""
        import pandas as pd

        return pd.DataFrame(self.records())


def _plain(name: str, cell: Cell) -> Sequence[tuple[str, Any]]:
    match cell:
        case Estimate():
            return list(cell.columns(name).items())
        case Span(first, last):
            return [(f"{name}_from", first), (f"{name}_to", last)]
        case Quantity(value, unit):
            return [*_plain(name, value), (f"{name}_unit", unit)]
        case Beyond(value) | Difference(value):
            return [(name, value)]
        case _:
            return [(name, cell)]


def aligned(rows: Sequence[Sequence[str]], indent: str = "") -> list[str]:
    """Return rows as lines whose columns stand below each other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        (indent + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))).rstrip()
        for row in rows
    ]
