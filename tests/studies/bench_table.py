"""A row of the table of `make bench`: what was measured, beside what is wanted."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import ceil
from time import process_time
from typing import Any

PAIRS = 5
LEAST_SECONDS = 0.02
"""A side of a pair is repeated until it takes this long, so that the clock does not count."""


@dataclass(frozen=True)
class Row:
    """One figure."""

    work: str
    figure: float
    unit: str
    """`x` of a ratio to the peer's time."""
    target: float | None = None
    at_least: bool = True
    """Whether the target is the smallest figure that is wanted, or the largest."""
    about: str = ""
    """Sizes, times and errors of both sides."""

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None without one."""
        if self.target is None:
            return None
        return self.figure >= self.target if self.at_least else self.figure <= self.target

    def say(self) -> None:
        """Print."""
        wanted = "" if self.target is None else f"{'>=' if self.at_least else '<='} {self.target:g}"
        told = {None: "shown", True: "met", False: "missed"}[self.met]
        sys.stdout.write(f"{self.work:<58}{self.figure:>10.4g} {self.unit:<4}{wanted:>10}  {told:<7}{self.about}\n")
        sys.stdout.flush()


def pairs(ours: Callable[[], Any], other: Callable[[], Any], count: int = PAIRS) -> Iterator[tuple[float, float]]:
    """Seconds of the processor for one call of each, taken in turn."""
    for f in (ours, other):
        f()  # compiles
    counts = [max(1, ceil(LEAST_SECONDS / once(f))) for f in (ours, other)]
    for _ in range(count):
        yield once(ours, counts[0]), once(other, counts[1])


def once(f: Callable[[], Any], count: int = 1) -> float:
    """Seconds of the processor for one call, as the mean of so many."""
    start = process_time()
    for _ in range(count):
        f()
    return (process_time() - start) / count
