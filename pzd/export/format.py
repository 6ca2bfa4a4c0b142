"""What a file of `formats/` declares: what it is called, what it needs, and how it writes a damper."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pzd.export.content import Content

Files = Mapping[str, bytes]
"""What is to be written, by the name of the file."""


@dataclass(frozen=True)
class Format:
    """One form in which another tool takes a damper."""

    name: str
    """As behind `--to`."""
    meaning: str
    """What it is for, in a few words."""
    files: Callable[[Content], Files]
    """The files; the same bytes for the same damper, and `Content.origin` in each, uncompressed.

    Raises ConfigError where the format cannot hold the damper.
    """
    needs: str | None = None
    """The library that writes it, an extra; None where pzd itself needs it anyway."""
    ending: str | None = None
    """Of the files' names, where how many there are depends on the damper; None where there are always the same."""
