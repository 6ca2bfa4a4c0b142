"""What the names of rig files tell that no column holds: control signal, temperature, and how the clickers stood."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

_NUMBER = r"(?<![A-Za-z0-9])([0-9]+(?:[.x,][0-9]+)?)"
_VALUES = {
    "voltage": re.compile(rf"{_NUMBER}(mV|kV|V)(?![A-Za-z])"),
    "current": re.compile(rf"{_NUMBER}(mA|A)(?![A-Za-z])"),
    "temperature": re.compile(rf"{_NUMBER}(degC|C)(?![A-Za-z])"),
}
"""150V, 0x5A, 22degC."""
_CLICKERS = ("C[0-9]+_?R[0-9]+", "(?i:[ck]lick(?:er|s)?[ _-]?[0-9]+)", "(?i:[0-9]+[ _-]?[ck]lick(?:er|s)?)")
"""C08_R12 (clicks from closed in compression and rebound), click5, 5 clicks, Klick-5."""


def value_in_names(stems: Sequence[str], name: str) -> tuple[str, str] | None:
    """The pattern that finds a quantity in every name, and its unit; None where a name lacks it or units differ.

    Parameters
    ----------
    stems : names of files, without their ending
    name : `voltage`, `current` or `temperature`
    """
    matches = [_VALUES[name].search(stem) if name in _VALUES else None for stem in stems]
    units = {match[2] for match in matches if match}
    if not all(matches) or len(units) != 1:
        return None
    (unit,) = units
    return f"(?P<{name}>[0-9.x]+){unit}(?![A-Za-z])", {"C": "degC"}.get(unit, unit)


def setting_in_names(stems: Sequence[str]) -> str | None:
    """The pattern that finds in every name how the clickers stood; None where a name does not say it."""
    patterns = (f"(?<![A-Za-z0-9])(?P<setting>{clickers})(?![A-Za-z0-9])" for clickers in _CLICKERS)
    return next((one for one in patterns if all(re.search(one, stem) for stem in stems)), None)


def one_pattern(patterns: Sequence[str], stems: Sequence[str]) -> str | None:
    """One pattern for all that several find, in the order of the names; None where names have no common order."""
    found = sorted(patterns, key=lambda one: _begin(one, stems[0]))
    whole = ".*?".join(found)  # as little as can be between them: else a first digit is lost
    return whole if found and all(re.search(whole, stem) for stem in stems) else None


def setting_of(pattern: str | None, path: Path) -> str | None:
    """The setting that a pattern finds in the name of a file; None where it finds none."""
    found = (re.search(pattern, path.stem) or re.search(pattern, path.name)) if pattern else None
    return found.groupdict().get("setting") if found else None


def _begin(pattern: str, stem: str) -> int:
    found = re.search(pattern, stem)
    return found.start() if found else 0
