"""The noise-free records of a case, which are kept beside its truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pzd.damper.motion import Motion
from pzd.record import Array

_CHANNELS = ("time", "displacement", "velocity", "acceleration", "voltage", "temperature")


@dataclass(frozen=True, eq=False)
class Clean:
    """One record without noise, gain, offset or delay."""

    motion: Motion
    force: Array
    """(n,) [N]"""
    recorded: Array
    """(n,) what the force channel has of it [N]."""

    @property
    def gain(self) -> float:
        """Slope of what was recorded over the force."""
        force = self.force - np.mean(self.force)
        return float(force @ self.recorded / (force @ force))

    @property
    def voltage(self) -> float:
        """Median voltage [V]; 0 without one."""
        return 0.0 if self.motion.voltage is None else round(float(np.median(self.motion.voltage)), 1)

    @property
    def peak(self) -> float:
        """Largest force [N]."""
        return float(np.max(np.abs(self.force)))


def write_clean(path: Path, records: Sequence[Clean]) -> None:
    """Write the noise-free records of a case, in the order of its rig files."""
    arrays = {
        f"{number:02d}.{key}": channel
        for number, record in enumerate(records, start=1)
        for key, channel in [
            ("force", record.force),
            ("recorded", record.recorded),
            *((key, getattr(record.motion, key)) for key in _CHANNELS),
        ]
        if channel is not None
    }
    np.savez(path, allow_pickle=False, **arrays)


def read_clean(path: Path) -> dict[str, Clean]:
    """The noise-free records of a case, by the names that the rig files gave them."""
    with np.load(path) as file:
        arrays = dict(file)
    numbers = sorted({key.split(".")[0] for key in arrays})
    return {
        f"r{number}": Clean(
            Motion(*(arrays.get(f"{number}.{key}") for key in _CHANNELS)),  # type: ignore[arg-type]  # the first four always stand there
            arrays[f"{number}.force"],
            arrays[f"{number}.recorded"],
        )
        for number in numbers
    }
