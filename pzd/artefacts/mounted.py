"""Artefact of table where the dampers are known without a rig: what is mounted at each axle."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Self

from pzd.artefacts.table import Table
from pzd.damper.model import PHYSICAL, BaseRow, Damper
from pzd.quantities import Control
from pzd.schema.model import Frozen
from pzd.schema.validate import read_json, write_json
from pzd.schema.yamlfile import read_yaml_model, write_yaml_model

NOTES = "mounted.json"
"""File of the notes, which the table of a rig's damper has not."""
_DAMPER, _REAR = "damper.yaml", "rear"


class MountedNotes(Frozen):
    """Where a damper comes from."""

    source: str
    """The file of its curve, or the folder of its run."""
    read: tuple[str, ...]
    """How it was read, in words."""
    marks: tuple[str, ...] = ()
    """Why the run that it comes from is not to be trusted."""


@dataclass(frozen=True, eq=False)
class MountedDamper:
    """A damper as it is ridden."""

    table: Table
    notes: MountedNotes
    damper: Damper | None
    """None where it is known by its curve alone."""


@dataclass(frozen=True, eq=False)
class MountedDampers:
    """The dampers of the car."""

    folder: ClassVar[str] = Table.folder
    """In the place of the table of a rig's damper; that of axle 1 has the same files."""

    axles: tuple[MountedDamper, ...]
    """Of axle 1, and of axle 2 where it is another one."""

    @property
    def controlled(self) -> bool:
        """Whether they have a control signal."""
        return all(row.voltage_V is not None for row in self.axles[0].table.force)

    @property
    def by_curve(self) -> bool:
        """Whether one of them is known by its curve alone, so that all are ridden by their tables."""
        return any(axle.damper is None for axle in self.axles)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that every damper has."""
        each = [set(axle.damper.effects) if axle.damper else set() for axle in self.axles]
        return tuple(sorted(set.intersection(*each)))

    @property
    def named_axles(self) -> tuple[tuple[str, MountedDamper], ...]:
        """The dampers with the name of their axle, which is empty where both axles have the same."""
        return tuple(zip(("front", "rear") if len(self.axles) > 1 else ("",), self.axles, strict=True))

    def write(self, folder: Path, control: Control) -> None:
        """Write the table of axle 1, mounted.json, and damper.yaml where it has a law; the same of axle 2 in rear/."""
        for place, axle in zip((folder, folder / _REAR), self.axles, strict=False):
            place.mkdir(exist_ok=True)
            axle.table.write(place, control)
            write_json(place / NOTES, axle.notes, control)
            if axle.damper is not None:
                write_yaml_model(place / _DAMPER, axle.damper, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        places = [place for place in (folder, folder / _REAR) if place.is_dir()]
        return cls(tuple(_read(place, control) for place in places))

    def untrusted(self, _: Control) -> tuple[str, ...]:
        """Return why the dampers are not to be trusted: what speaks against the runs that they come from."""
        return tuple(dict.fromkeys(f"{axle.notes.source}: {m}" for axle in self.axles for m in axle.notes.marks))


def damper_without_force(table: Table) -> Damper:
    """Return what stands for the law of a damper that is known by its table alone, at the values of its control."""
    row = BaseRow(T0_N=0.0, C_Ns_per_m=1.0, k_N_per_m=PHYSICAL["k_N_per_m"][1])
    voltages = dict.fromkeys(row.voltage_V for row in table.force)
    return Damper(base=tuple(row.model_copy(update={"voltage_V": voltage}) for voltage in voltages))


def _read(folder: Path, control: Control) -> MountedDamper:
    law = folder / _DAMPER
    damper = read_yaml_model(law, Damper, control) if law.is_file() else None
    return MountedDamper(Table.read(folder, control), read_json(folder / NOTES, MountedNotes, control), damper)
