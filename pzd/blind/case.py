"""Records of a case: its truth, noise-free records, the cost of its diagnosis, and its score; and where they lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from pzd.blind.plan import Kind
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.record import Array
from pzd.schema.model import Frozen
from pzd.signals.jumps import jump_timing_error, unresolved_flanks
from pzd.signals.measures import reversals


class Truth(Frozen):
    """The hidden effects, and how well they can be seen."""

    id: str
    seed: int
    """Of the benchmark; with the number of the case it fixes every draw."""
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
    """As a share of the record's peak."""
    noise_rho: float
    """Correlation of the noise of the force from sample to sample."""
    displacement_noise_m: float
    warming: bool
    one_frequency: bool
    lowest_peak_N: float
    """Largest force of the softest record."""
    visible_gap: float
    """R.m.s. left by the best Bingham refit, as a share of the record's peak."""
    gap_given_other: dict[str, float]
    """Of a pair, by the name of each effect: visible gap that it leaves where the other one is known."""


COST = "cost.json"
"""Beside the diagnosis of a case."""


class Cost(Frozen):
    """Time and memory that ingest, identify and diagnose took."""

    seconds: float
    diagnose_seconds: float
    peak_memory_MB: float
    """Largest memory of the process so far."""
    failure: str | None = None
    """The error where no diagnosis came."""


class Scored(Frozen):
    """A case whose diagnosis is compared with its truth."""

    id: str
    made_from: str
    """Hash of the config and the code it was made with."""
    kind: Kind
    campaign: str
    one_frequency: bool
    hidden: str
    """Names of the hidden effects, joined by `+`; `none`."""
    described_by: tuple[str, ...] = ()
    """Effects with which a verdict is right about a form outside the library."""
    truth: tuple[str, ...]
    """Hidden effects that should be named; those too small to count are left out."""
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
    """Of the residual, as the diagnosis reports them, the best first."""
    inside: dict[str, bool]
    """Of each parameter of a rightly named effect: whether it lies in its 95 % interval."""
    gap_cut: float | None
    """1 - W_s after / W_s before against the noise-free force of the held-out records; None where no effect was
    adopted."""
    gap_cut_gains_out: float | None
    """The same with the best gain of each record taken out, before and after alike: gains scatter from test to test."""
    gap_cut_of_truth: float | None
    """The same of the truth itself, with the mean gain of the tests that were fitted."""
    next_test: bool
    """Whether a next test was proposed."""
    told_apart: bool = True
    """False where nothing was hidden, and the true likelihood does not tell nothing from the rivals that are named."""
    seconds: float
    diagnose_seconds: float
    peak_memory_MB: float
    failure: str | None


@dataclass(frozen=True)
class CaseFiles:
    """Where the files of every case lie below the folder of a benchmark; the truth is apart from the rig files."""

    folder: Path

    @property
    def absolute(self) -> CaseFiles:
        """The same for a process that works in another folder."""
        return CaseFiles(self.folder.absolute())

    def case(self, name: str) -> Path:
        """Return the folder of all that the diagnosis of a case reads and writes."""
        return self.folder / "cases" / name

    def rig(self, name: str) -> Path:
        """Return the folder of the rig files of a case."""
        return self.case(name) / "rig"

    def truth(self, name: str) -> Path:
        """Return the file of its truth."""
        return self.folder / "truth" / f"{name}.json"

    def noise_free(self, name: str) -> Path:
        """Return the file of its noise-free records."""
        return self.folder / "truth" / f"{name}.npz"

    def scored(self, name: str) -> Path:
        """Return the file of its score."""
        return self.folder / "scored" / f"{name}.json"


# --- Noise-free records, written next to the truth ---


_CHANNELS = ("time", "displacement", "velocity", "acceleration", "voltage", "temperature")


@dataclass(frozen=True, eq=False)
class NoiseFreeRecord:
    """A record without noise, gain, offset or delay."""

    motion: Motion
    force: Array
    """(n,) [N]"""
    recorded: Array
    """(n,) reading of the force channel [N]."""

    @property
    def gain(self) -> float:
        """Gain of the force channel: slope of its reading over the force."""
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

    @cached_property
    def _turns(self) -> list[int]:
        return reversals(self.motion.displacement)

    def missed_by(self, simulated: Array) -> Array:
        """Compute what a simulated force (n,) misses of the force (n,) [N]; of a jump within one sample, not when.

        A friction behind a stiff spring turns within a micrometre: whether a sample at the reversal has the force from
        before it or from after is chance, and would outweigh all else.
        """
        rate = 1.0 / float(np.median(np.diff(self.motion.time)))
        jumps = unresolved_flanks(self.force, self._turns, rate) | unresolved_flanks(simulated, self._turns, rate)
        timing = np.where(jumps, jump_timing_error(self.force, simulated), 0.0)
        return np.asarray(self.force - simulated - timing)


def write_noise_free(path: Path, records: Sequence[NoiseFreeRecord]) -> None:
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


def read_noise_free(path: Path) -> dict[str, NoiseFreeRecord]:
    """Read the noise-free records of a case, by the names of its rig files."""
    with np.load(path) as file:
        arrays = dict(file)
    numbers = sorted({key.split(".")[0] for key in arrays})
    return {
        f"r{number}": NoiseFreeRecord(
            Motion(*(arrays.get(f"{number}.{key}") for key in _CHANNELS)),  # type: ignore[arg-type]  # the first four are always there
            arrays[f"{number}.force"],
            arrays[f"{number}.recorded"],
        )
        for number in numbers
    }
