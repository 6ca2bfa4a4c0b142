"""Which seeds were scored with which code: a seed is fresh once, so no rule is chosen on what it is scored on."""

from __future__ import annotations

from pathlib import Path

from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.errors import ConfigError
from pzd.schema.model import Frozen


class ScoredSeed(Frozen):
    """One scored run."""

    seed: int
    generator: str
    made_from: str
    """Hash of the config and the code; empty where it was not written down."""
    cases: int
    date: str
    """The day on which it began, in UTC (ISO 8601)."""


def read(path: Path) -> tuple[ScoredSeed, ...]:
    """Every scored run of a ledger; none where there is no such file."""
    return read_rows(path, ScoredSeed, Control()) if path.is_file() else ()


def enter(path: Path, run: ScoredSeed) -> None:
    """Write a scored run down before its first case is drawn, so that one that is stopped uses its seed up as well.

    Parameters
    ----------
    path : the ledger
    run : what begins

    Raises
    ------
    ConfigError : when the ledger holds the seed for another config or other code
    """
    known = read(path)
    same = [one for one in known if (one.seed, one.generator) == (run.seed, run.generator)]
    if other := next((one for one in same if one.made_from != run.made_from), None):
        raise ConfigError(
            f"blind.seed: seed {run.seed} was scored with another config or other code on {other.date} ({path}); "
            "take one that is not in this ledger, or one of tuned_on with tuning: true"
        )
    if all(one.cases < run.cases for one in same):
        write_rows(path, ScoredSeed, [*known, run], Control())
