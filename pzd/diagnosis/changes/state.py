"""One state of a damper: its tests, and the damper that was identified and diagnosed from them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pzd.artefacts import Diagnosed, Identified, Rig
from pzd.artefacts.identified import identified_damper
from pzd.damper.effect import Scales
from pzd.damper.fitted_laws import fitted_laws
from pzd.damper.model import Damper
from pzd.diagnosis.campaign import scales_of
from pzd.diagnosis.cleaned_records import CleanedRecord, clean, unsaturated_records
from pzd.diagnosis.config import DiagnoseConfig
from pzd.identification.config import IdentifyConfig
from pzd.quantities import Control
from pzd.record import CONSTANT_SHARE, Record, mid_stroke, voltage_scale
from pzd.rig.config import RigConfig


@dataclass(frozen=True, eq=False)
class State:
    """One state of a damper."""

    name: str
    cleaned: tuple[CleanedRecord, ...]
    damper: Damper
    """As identified and diagnosed; its T0, C and k where nobody diagnosed."""
    voltage_scale: float
    """Of all its records [V]."""
    undetermined: tuple[str, ...] = ()
    """Conditions whose T0 or C is undetermined, in words."""

    @classmethod
    def of(cls, name: str, rig: Rig, identified: Identified, setting: str | None, control: Control) -> State:
        """Return a state with the damper that identify found."""
        records, _ = unsaturated_records(rig, setting)
        rows = [row for row in identified.undetermined if row.setting == setting]
        lacking = [f"{row.words(control, name)}: {row.status}" for row in rows]
        damper = identified_damper(identified, setting)
        return cls(name, clean(records, every_sample=True), damper, voltage_scale(records), tuple(lacking))

    @property
    def records(self) -> list[Record]:
        """The cleaned records."""
        return [p.record for p in self.cleaned]

    def voltage_slack(self, given: float | None = None) -> float:
        """Return by how much control signals of one level may differ [V].

        Parameters
        ----------
        given : what the config says of it, `identify.group.voltage_V`; None where it says nothing
        """
        return CONSTANT_SHARE * self.voltage_scale if given is None else given

    def scales(self) -> Scales:
        """Return the magnitudes by which effect parameters are scaled."""
        peaks = [float(np.max(np.abs(r.force))) for r in self.records]
        return scales_of(peaks, self.cleaned, self.damper, mid_stroke(r.displacement for r in self.records))


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

    return with_adopted(state, run_stage(diagnose, identify, stand, rig, identified, control, setting, jobs))


def with_adopted(state: State, found: Diagnosed) -> State:
    """Return a state with the damper of its diagnosis.

    Beside a fitted law those effects with a name alone: what only predicts follows an error of the law, which is the
    same in both states, and would take a part of what changed in the place of a number of the law.
    """
    by_law = any(name in fitted_laws() for name in found.baseline.effects)
    return replace(state, damper=found.baseline if by_law and found.diagnosis.verdict != "named" else found.damper)
