"""Numbers and rows as aligned text."""

from __future__ import annotations

from collections.abc import Sequence

from pzd.schema.wording import rounded_as, supported

DIGITS = 4
"""Significant digits of a number without an interval."""


def number(value: float | str | None) -> str:
    """A number with the digits that matter; a dash where there is none."""
    if value is None or value == "":
        return "-"
    return value if isinstance(value, str) else f"{value:.{DIGITS}g}"


def number_as(value: float, other: float) -> str:
    """A number to the decimal place to which another one is told, from which it was read."""
    return number(rounded_as(value, other, DIGITS))


def interval(value: float | None, low: float | None, high: float | None) -> str:
    """A value with its 95 % interval."""
    if value is None or low is None or high is None:
        return number(value)
    return "{} ({} to {})".format(*(supported(each, low, high) for each in (value, low, high)))


def filled(head: Sequence[str], rows: Sequence[Sequence[str]], first: int) -> list[list[str]]:
    """A header and its rows, of whose first columns those are left out that hold nothing but dashes.

    Parameters
    ----------
    head : the header
    rows : the rows, as `number` writes them
    first : so many columns are conditions, which a rig need not have
    """
    kept = [c for c in range(len(head)) if c >= first or any(row[c] != "-" for row in rows)]
    return [[row[c] for c in kept] for row in (head, *rows)] if rows else []


def aligned(rows: Sequence[Sequence[str]], indent: str = "") -> list[str]:
    """Rows as lines whose columns stand below each other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        (indent + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))).rstrip()
        for row in rows
    ]
