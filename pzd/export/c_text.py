"""C as text: the sources that stand in `sources/`, and arrays of numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from pzd.export.content import Content

_SOURCES = Path(__file__).with_name("sources")
_WIDTH = 8
"""Numbers in a line."""


def source(content: Content, name: str) -> bytes:
    """A file of `sources/`, behind a line that says where the damper is from."""
    return (head(content) + (_SOURCES / name).read_text(encoding="utf-8")).encode()


def head(content: Content) -> str:
    """The comment that begins every file."""
    return f"/* {content.origin.replace('*/', '* /')} */\n"


def single(value: float) -> str:
    """A constant of single precision, nine digits of which tell one from the next."""
    return f"{_pointed(f'{float(np.float32(value)):.9g}')}f"


def double(value: float) -> str:
    """A constant of double precision."""
    return repr(float(value)).replace("inf", "INFINITY")


def array(kind: str, name: str, values: ArrayLike, written: Callable[[float], str]) -> str:
    """A constant array of any number of axes.

    Parameters
    ----------
    kind : type in C
    name : in C
    values : numbers
    written : one number as a constant
    """
    numbers = np.asarray(values, dtype=np.float64)
    sizes = "".join(f"[{size}]" for size in numbers.shape)
    return f"static const {kind} {name}{sizes} = {_braces(numbers, written)};\n"


def _braces(values: np.ndarray, written: Callable[[float], str]) -> str:
    if values.ndim > 1:
        return "{" + ",\n".join(_braces(part, written) for part in values) + "}"
    words = [written(value) for value in values]
    return "{" + ",\n ".join(", ".join(words[i : i + _WIDTH]) for i in range(0, len(words), _WIDTH)) + "}"


def _pointed(text: str) -> str:
    return text if any(mark in text for mark in ".en") else f"{text}.0"
