"""Published models that a damper is compared with, one file each; every module here is found by itself.

A peer gives the force of one test at one value of the control signal as F = sum_j a_j phi_j: the coefficients a_j enter
linearly and are solved for, the columns phi_j depend on the motion and on a few shape parameters, which are searched.
The file of a peer declares `PEER`.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.record import Array


@dataclass(frozen=True, eq=False)
class StrokeMotion:
    """Motion of one test about the middle of its own stroke, as peers are stated; (m,) samples, the settling first."""

    displacement: Array
    """From the middle of the stroke [m]."""
    velocity: Array
    """[m/s]"""
    step: float
    """Sampling interval [s]."""
    settling: int = 0
    """Samples in front, for a state to settle."""

    @classmethod
    def of(cls, cleaned: CleanedRecord) -> StrokeMotion:
        """Return the cleaned motion of a record, with its lead."""
        record = cleaned.lead or cleaned.record
        x = record.displacement
        middle = 0.5 * float(np.min(x) + np.max(x))
        return cls(x - middle, record.velocity, 1.0 / record.rate, cleaned.lead_samples)


@dataclass(frozen=True)
class Coefficient:
    """A parameter that enters the force linearly."""

    name: str
    unit: str


@dataclass(frozen=True)
class ShapeParameter:
    """A parameter that is searched, with its limits."""

    name: str
    unit: str
    low: float
    high: float
    logarithmic: bool = False
    """Whether it is searched by its logarithm; its lower limit is then above 0."""


@dataclass(frozen=True, eq=False)
class PeerForm:
    """One form of a peer; of several the one is taken that fits all voltages best."""

    label: str
    """What distinguishes it from the others, such as `n = 2`; empty where there is one."""
    columns: Callable[[StrokeMotion, Array], Array]
    """Function of motion and (s,) shape parameters, to the (n, coefficients) columns without the settling."""


@dataclass(frozen=True, eq=False)
class Peer:
    """A published model of a controlled damper at one value of its control signal."""

    name: str
    """Name in tables, and of its file."""
    law: str
    source: str
    coefficients: tuple[Coefficient, ...]
    shape: tuple[ShapeParameter, ...]
    forms: tuple[PeerForm, ...]
    grid: Callable[[Sequence[StrokeMotion]], Array]
    """(g, s) shape parameters from which the search begins."""

    @property
    def parameters(self) -> tuple[Coefficient | ShapeParameter, ...]:
        """Coefficients, then shape parameters."""
        return (*self.coefficients, *self.shape)

    def force(self, form: PeerForm, motion: StrokeMotion, parameters: Array) -> Array:
        """Compute the (n,) force of one form along a motion [N], with (p,) values in the order of `parameters`."""
        count = len(self.coefficients)
        return np.asarray(form.columns(motion, parameters[count:]) @ parameters[:count])


@cache
def peers() -> dict[str, Peer]:
    """Return every peer by name."""
    found = [importlib.import_module(f"{__name__}.{info.name}").PEER for info in pkgutil.iter_modules(__path__)]
    return {peer.name: peer for peer in sorted(found, key=lambda peer: peer.name)}
