"""Scalars of YAML 1.2: what a plain word means under the core schema, and how a value is written.

No yes, no, on or off, no times, no base 60: what looks like a word is text.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

Scalar = None | bool | int | float | str

_WORDS: dict[str, Scalar] = {"": None, "~": None}
for _word, _value in (("null", None), ("true", True), ("false", False)):
    _WORDS |= {_word: _value, _word.capitalize(): _value, _word.upper(): _value}
_READERS: tuple[tuple[re.Pattern[str], Callable[[str], int | float]], ...] = (
    (re.compile(r"[-+]?[0-9]+"), int),
    (re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+"), lambda text: int(text, 0)),
    (re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"), float),
    (re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)"), lambda text: float(text.replace(".", ""))),
)

_PLAIN = re.compile(r"[A-Za-z0-9_./+-]([A-Za-z0-9_./+*%() -]*[A-Za-z0-9_./+*%()-])?")
_OLD_WORDS = frozenset(("y", "n", "yes", "no", "on", "off"))  # text to us, truth values to readers of YAML 1.1
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}


def scalar_of(text: str) -> Scalar:
    """The value of a plain scalar.

    Raises
    ------
    ValueError : when an integer is longer than can be read
    """
    if text in _WORDS:
        return _WORDS[text]
    for pattern, read in _READERS:
        if pattern.fullmatch(text):
            return read(text)
    return text


def written(value: Scalar) -> str:
    """The scalar as YAML that reads back as the same value."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return _written_float(value)
    return str(value) if isinstance(value, int) else _written_text(value)


def _written_float(value: float) -> str:
    if math.isfinite(value):
        return repr(value)
    return ".nan" if math.isnan(value) else f"{'-' if value < 0 else ''}.inf"


def _written_text(text: str) -> str:
    return text if _reads_as_text(text) else '"' + "".join(_escaped(c) for c in text) + '"'


def _reads_as_text(text: str) -> bool:
    if not _PLAIN.fullmatch(text) or text.lower() in _OLD_WORDS or text in ("-", "---", "..."):
        return False
    if text.startswith(("- ", "--- ", "... ")):
        return False
    starts_like_a_number = text[0] in "0123456789+-." and " " not in text
    return isinstance(scalar_of(text), str) and not starts_like_a_number


def _escaped(character: str) -> str:
    if character in _ESCAPES:
        return _ESCAPES[character]
    code = ord(character)
    if character.isprintable():
        return character
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
