"""How far a stage that takes long has come, as an event for whoever shows it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """So many parts of the work are done."""

    done: int
    whole: int
    what: str
    """What is counted, in the plural, and what there is to say about the part that was done last."""

    def __str__(self) -> str:
        """How far, in words."""
        return f"{self.done} of {self.whole} {self.what}"


Listener = Callable[[Progress], None]
"""Is called with every event, in the thread that does the work."""


def no_listener(_: Progress) -> None:
    """Does nothing: for a stage whose progress nobody follows."""
