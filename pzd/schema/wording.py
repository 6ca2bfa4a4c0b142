"""Numbers and faults in the words of a person: digits that are known, counted things, what pydantic says of a value."""

from __future__ import annotations

import math
import re

MOST_DIGITS = 6
"""Significant digits of a number, however narrow its interval."""

_WORDS = {
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be text",
    "tuple_type": "must be a list",
    "list_type": "must be a list",
    "dict_type": "must be a mapping",
    "model_type": "must be a mapping",
    "model_attributes_type": "must be a mapping",
}


def supported(value: float, low: float, high: float) -> str:
    """A number to the second digit of the width of its interval: what is far less than the interval is 0."""
    width = high - low
    if not (math.isfinite(width) and width > 0.0):
        return f"{value:.4g}"
    return f"{round(value, 1 - math.floor(math.log10(width))) + 0.0:.{MOST_DIGITS}g}"


def rounded_as(value: float, other: float, digits: int) -> float:
    """A value to the decimal place of the last of so many digits of another one, from which it was read."""
    if other == 0.0 or not math.isfinite(other):
        return value
    return round(value, digits - 1 - math.floor(math.log10(abs(other)))) + 0.0


def counted(count: int, noun: str) -> str:
    """So many of a thing: 1 record, 2 records."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def worded(kind: str, message: str) -> str:
    """What a value must be, by pydantic's kind of error and its message."""
    plain = re.sub(r"^(Input|String|Tuple|List|Dictionary|Value) should", "must", message.removeprefix("Value error, "))
    return _WORDS.get(kind, plain.replace(" after validation", ""))
