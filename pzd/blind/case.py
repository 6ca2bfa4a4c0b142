"""What is kept of a case: the truth, what the diagnosis cost, and the score."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pzd.blind.plan import Kind
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.record import Array
from pzd.schema.model import Frozen

# ----------------------------------------------------------------------------------------------------


class Truth(Frozen):
    """What was hidden, and how well it can be seen."""

    id: str
    seed: int
    """Seed of the benchmark; with the number of the case it fixes every draw."""
    kind: Kind
    campaign: str
    effects: tuple[str, ...]
    """Effects of the library that were hidden."""
    form: str | None
    """Form outside the library that was hidden."""
    form_values: dict[str, float]
    described_by: tuple[str, ...] = ()
    """Effects of the library with which a verdict is right about the form."""
    damper: Damper
    sizes: dict[str, float]
    """How much each changes the force, as `blind.sizes` counts it."""
    force_noise: float
    noise_rho: float
    displacement_noise_m: float
    warming: bool
    one_frequency: bool
    lowest_peak_N: float
    """Largest force of the softest record."""
    visible_gap: float
    """R.m.s. left by the best Bingham refit, as a share of the record's peak."""
    gap_given_other: dict[str, float]
    """Of a pair: what is left when the other effect is known and T0, C and k are refitted."""


class Cost(Frozen):
    """What ingest, identify and diagnose took."""

    seconds: float
    diagnose_seconds: float
    peak_memory_MB: float
    """Largest memory of the process so far."""
    failure: str | None = None
    """What went wrong where no diagnosis came."""


class Scored(Frozen):
    """One finished case."""

    id: str
    made_from: str
    """What config and code it was made with."""
    kind: Kind
    campaign: str
    one_frequency: bool
    hidden: str
    """Names of all that was hidden, joined by `+`; `none`."""
    described_by: tuple[str, ...] = ()
    """Effects with which a verdict is right about a form outside the library."""
    truth: tuple[str, ...]
    """Effects that were there to be named: what counts as nothing is left out."""
    force_noise: float
    noise_rho: float
    displacement_noise_m: float
    visible_gap: float
    gap_given_other: dict[str, float]
    verdict: str | None
    """None where the diagnosis failed."""
    effects: tuple[str, ...]
    rivals: tuple[str, ...]
    confidence: float | None
    shapes: tuple[str, ...]
    """Of what is left, as the diagnosis tells them, the best first."""
    inside: dict[str, bool]
    """Of each parameter of a rightly named effect: whether it lies in its 95 % interval."""
    gap_cut: float | None
    """1 - W_s after / W_s before against the noise-free force of the held-out records; None where nothing was
    adopted."""
    gap_cut_gains_out: float | None
    """The same with the best gain of each record taken out, before and after alike: what tests whose gains jitter can
    show of the shape."""
    gap_cut_of_truth: float | None
    """What the truth itself would cut, with the mean gain of the tests that were fitted."""
    next_test: bool
    """Whether a next test was proposed."""
    seconds: float
    diagnose_seconds: float
    peak_memory_MB: float
    failure: str | None


@dataclass(frozen=True)
class Places:
    """Where the files of a benchmark lie below its folder; the truth lies apart from what the diagnosis is given."""

    folder: Path

    @property
    def absolute(self) -> Places:
        """The same for a process that works in another folder."""
        return Places(self.folder.absolute())

    def case(self, name: str) -> Path:
        """All that the diagnosis of a case sees and writes."""
        return self.folder / "cases" / name

    def rig(self, name: str) -> Path:
        """The rig files of a case."""
        return self.case(name) / "rig"

    def truth(self, name: str) -> Path:
        """The truth of a case."""
        return self.folder / "truth" / f"{name}.json"

    def clean(self, name: str) -> Path:
        """Its noise-free records."""
        return self.folder / "truth" / f"{name}.npz"

    def scored(self, name: str) -> Path:
        """Its score."""
        return self.folder / "scored" / f"{name}.json"


# ----------------------------------------------------------------------------------------------------
# The noise-free records of a case, which are kept beside its truth.


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
