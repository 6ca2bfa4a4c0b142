"""The damper before diagnose (the baseline) and the adopted one (the final): parameters, simulated force, words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pzd.artefacts import Diagnosed, ParameterRow
from pzd.damper.compose import respond, static_force
from pzd.damper.confounders import known, module_of
from pzd.damper.fitted_laws import fitted_laws
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.cleaned_records import CleanedRecord, clean
from pzd.diagnosis.fit.prediction import predicted_force
from pzd.quantities import BINGHAM
from pzd.record import Array, Record
from pzd.report.blocks import amount
from pzd.report.rig_tests import settled


@dataclass(frozen=True, eq=False)
class DamperModels:
    """Both dampers of a run."""

    diagnosed: Diagnosed
    baseline_parameters: tuple[ParameterRow, ...]
    """T0, C and k of each condition as identify found them."""
    _forces: dict[str, tuple[Array, Array]] = field(default_factory=dict, repr=False)
    """Simulated forces by record: several pictures show the same ones."""

    @property
    def final_parameters(self) -> tuple[ParameterRow | BaseRow, ...]:
        """T0, C and k of the final damper; without intervals where somebody edited them since."""
        if not self.extended and not self.fitted_law:
            return self.baseline_parameters
        return tuple(_fitted_row(base, self.diagnosed.parameters) or base for base in self.diagnosed.damper.base)

    @property
    def extended(self) -> bool:
        """Whether diagnose changed the damper."""
        return self.diagnosed.damper != self.diagnosed.baseline

    @property
    def added(self) -> tuple[str, ...]:
        """Effects that the final damper has and the baseline has not: what belongs to a fitted law is none of them."""
        known = {*self.diagnosed.baseline.effects, *fitted_laws()}
        return tuple(name for name in self.diagnosed.damper.effects if name not in known)

    @property
    def fitted_law(self) -> bool:
        """Whether identify adopted another law than Bingham's."""
        return any(name in fitted_laws() for name in self.diagnosed.baseline.effects)

    @property
    def baseline_name(self) -> str:
        """What the page calls the baseline."""
        return "knee law" if self.fitted_law else "simple model"

    def simulated(self, record: Record) -> tuple[Array, Array]:
        """Simulate both dampers in the motion of a record: the force that diagnose judges, drawn where it was judged.

        That is in the motion freed of noise, which a stiff oil spring makes a force of. Outside the whole cycles, which
        diagnose does not judge, the motion is the recorded one.

        Returns
        -------
        (n,) force of the baseline and (n,) of the final damper [N]
        """
        if record.name not in self._forces:
            cleaned = clean((record,))
            baseline = _force(self.diagnosed.baseline, record, cleaned)
            final = _force(self.diagnosed.damper, record, cleaned) if self.extended else baseline
            self._forces[record.name] = (baseline, final)
        return self._forces[record.name]

    def residuals(self, record: Record) -> tuple[Array, Array]:
        """Return measured less simulated force of both dampers, past the start of the record [N]."""
        baseline, final = (record.force - force for force in self.simulated(record))
        return baseline[settled(record)], final[settled(record)]

    # --- The force at rest, such as a gas force: a rig measures it, the table leaves it to the static balance ---

    def static_force(self, voltage: float | None) -> float:
        """Return the force of the final damper at rest, at a value of the control signal [N]."""
        return float(static_force(self.diagnosed.damper, voltage))

    def static_force_in_words(self, voltages: Sequence[float | None]) -> str:
        """Return the range of the static force, `90 N` or `80 N to 90 N`; empty where it is 0 throughout."""
        forces = [self.static_force(voltage) for voltage in voltages]
        return " to ".join(dict.fromkeys(amount(end(forces), "N") for end in (min, max))) if any(forces) else ""


def _force(damper: Damper, record: Record, cleaned: Sequence[CleanedRecord]) -> Array:
    """Compute the (n,) force of a damper in a record, as judged in its cleaned parts [N]."""
    force = respond(damper, Motion.of(record), float(record.force[0]))
    for part in cleaned:  # it may have fewer samples
        time = part.record.time
        inside = (record.time >= time[0] - 0.5 / record.rate) & (record.time <= time[-1] + 0.5 / record.rate)
        force[inside] = np.interp(record.time[inside], time, predicted_force(damper, part))
    return force


def _fitted_row(base: BaseRow, rows: Sequence[ParameterRow]) -> ParameterRow | None:
    """Return the row that was fitted with a base row; None where that has other values now."""
    for row in rows:
        pairs = [(getattr(row, parameter.column), getattr(base, parameter.column)) for parameter in BINGHAM]
        same_condition = (row.voltage_V, row.temperature_degC) == (base.voltage_V, base.temperature_degC)
        if same_condition and all(fitted is None or fitted == value for fitted, value in pairs):
            return row
    return None


def effect_in_words(name: str) -> str:
    """Return the first sentence of an effect's documentation."""
    first = (module_of(known()[name]).__doc__ or name).split("\n")[0].rstrip(".")
    return first[0].lower() + first[1:]


def effects_in_words(names: Sequence[str]) -> list[str]:
    """Return each effect in words, with its name."""
    return [f"{effect_in_words(name)} ({name})" for name in names]
