"""One state of a damper: its tests, and the damper that was identified and diagnosed from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pzd.artefacts import Identified, Rig
from pzd.artefacts.identified import identified_damper
from pzd.damper.effect import Scales
from pzd.damper.effects import library
from pzd.damper.model import Damper, Effects
from pzd.diagnosis import data
from pzd.diagnosis.campaign import flow_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.data import PreparedRecord
from pzd.identification.config import IdentifyConfig
from pzd.quantities import Control
from pzd.record import CONSTANT_SHARE, Record, mid_stroke, voltage_scale
from pzd.rig.config import RigConfig

SOFTEST = 0.1
"""Least C by which effect parameters are scaled [largest force over largest speed]: a friction damper has none."""


@dataclass(frozen=True, eq=False)
class State:
    """One state of a damper."""

    name: str
    prepared: tuple[PreparedRecord, ...]
    damper: Damper
    """As identified and diagnosed; its T0, C and k where nobody diagnosed."""
    voltage_scale: float
    """Of all its records [V]."""
    undetermined: tuple[str, ...] = ()
    """Conditions whose T0 or C is undetermined, in words."""

    @classmethod
    def of(cls, name: str, rig: Rig, identified: Identified, setting: str | None, control: Control) -> State:
        """Return a state with the damper that identify found."""
        records, _ = data.unsaturated_records(rig, setting)
        rows = [row for row in identified.undetermined if row.setting == setting]
        lacking = [f"{row.words(control, name)}: {row.status}" for row in rows]
        damper = identified_damper(identified, setting)
        return cls(name, data.prepare(records), damper, voltage_scale(records), tuple(lacking))

    @property
    def records(self) -> list[Record]:
        """The cleaned records."""
        return [p.record for p in self.prepared]

    def voltage_slack(self, given: float | None = None) -> float:
        """Return by how much control signals of one level may differ [V].

        Parameters
        ----------
        given : what the config says of it, `identify.group.voltage_V`; None where it says nothing
        """
        return CONSTANT_SHARE * self.voltage_scale if given is None else given

    def scales(self) -> Scales:
        """Return the magnitudes by which effect parameters are scaled."""
        zero = mid_stroke(r.displacement for r in self.records)
        peaks = [float(np.max(np.abs(r.force))) for r in self.records]

        def largest(values: Sequence[float]) -> float:
            return max(*values, float(np.finfo(float).tiny))

        speed = largest([float(np.max(np.abs(r.velocity))) for r in self.records])
        return Scales(
            largest(peaks),
            min(peaks),
            speed,
            largest([float(np.max(np.abs(r.displacement - zero))) for r in self.records]),
            largest([float(np.max(np.abs(r.acceleration))) for r in self.records]),
            max(float(np.median([row.C_Ns_per_m for row in self.damper.base])), SOFTEST * largest(peaks) / speed),
            self.voltage_scale,
            flow_of(self.damper, self.prepared),
        )


def diagnosed_state(
    state: State,
    rig: Rig,
    identified: Identified,
    setting: str | None,
    diagnose: DiagnoseConfig,
    identify: IdentifyConfig,
    stand: RigConfig,
    control: Control,
    jobs: int,
) -> State:
    """Return the state with the effects that a diagnosis in memory adopts, which the first state needs.

    Parameters
    ----------
    state : as it was identified
    rig, identified : its records, and what identify found in them
    setting : of the rig, the one that the state is
    diagnose, identify : blocks of the config
    stand : block of the rig, for what the stand can do
    control : the control signal
    jobs : processes or threads that the diagnosis may use

    Returns
    -------
    the same tests with the adopted damper
    """
    from pzd.diagnosis.stage import diagnose as run_stage

    found = run_stage(diagnose, identify, stand, rig, identified, control, setting, jobs)
    return replace(state, damper=found.damper)


def acts_at_a_place(name: str) -> bool:
    """Whether an effect acts at a place of the stroke, so that no force and stiffness make up for another zero."""
    return name in library() and any(parameter.position for parameter in library()[name].parameters)


def about(damper: Damper, zero: float) -> Damper:
    """Return the same damper with the force and stiffness beside the element about another displacement [m].

    Equation: F_0 + k_g (x - z) = (F_0 + k_g (z' - z)) + k_g (x - z')
    """
    if any(acts_at_a_place(name) for name in damper.effects):
        return damper
    effects: Effects = {name: dict(values) for name, values in damper.effects.items()}
    stiffness = effects.get("gas_spring", {}).get("k_g", 0.0)
    force = effects.get("preload_offset", {}).get("F_0", 0.0)
    if isinstance(stiffness, tuple) or isinstance(force, tuple):
        return damper
    moved = stiffness * (zero - damper.zero_m)
    if moved != 0.0 or "preload_offset" in effects:
        effects["preload_offset"] = {"F_0": force + moved}
    return damper.model_copy(update={"effects": effects, "zero_m": zero})
