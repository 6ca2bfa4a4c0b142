"""Listings of the documentation, and whether a command prints them."""

from __future__ import annotations

import math
import re

NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
AGREEMENT = 0.01
"""Relative difference of a number that other versions of numpy and scipy may make."""


def listings(text: str) -> list[tuple[str, str]]:
    """Each command with which a page introduces a listing, `<!-- printed by: COMMAND -->`, and the listing."""
    return re.findall(r"^<!-- printed by: (.*?) -->\n```\w+\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def same(shown: str, printed: str, agreement: float = AGREEMENT) -> bool:
    """Whether two lines say the same: equal but for blanks and the last digits of their numbers."""
    if NUMBER.sub("#", shown).split() != NUMBER.sub("#", printed).split():
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=True)
    return all(math.isclose(float(one), float(other), rel_tol=agreement) for one, other in pairs)


def missing(shown: str, printed: str, agreement: float = AGREEMENT) -> list[str]:
    """The lines of a listing that a command has not printed."""
    said = printed.splitlines()
    return [line for line in shown.splitlines() if not any(same(line, other, agreement) for other in said)]
