"""What an engine is given, and what it lends."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

from pzd.parallel.config import EngineConfig


@dataclass(frozen=True)
class Where:
    """Where work is done, as the config says."""

    how: EngineConfig
    block: str
    """Of the config, for messages."""
    folder: Path
    """Of the config, to which its paths are relative."""
    logs: Path
    """Folder for what jobs of SLURM print."""


@dataclass(frozen=True)
class Pools:
    """Processes that are lent."""

    executors: Sequence[Executor]
    """One for each step."""
    workers: int
    """How many chunks are worked on at a time."""
