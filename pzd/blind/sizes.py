"""How large what is hidden is, and the effects and forms scaled to a size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from pzd.blind.clean import Clean
from pzd.blind.outside import FORMS, Reached
from pzd.blind.strengths import Values, of_size
from pzd.damper.compose import respond
from pzd.damper.effect import Scales
from pzd.damper.effects import library
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.record import Array
from pzd.rig.stand.frame import force_in_frame


def with_effects(
    plain: Damper, wanted: Mapping[str, float], records: Sequence[Clean], draw: np.random.Generator
) -> Damper:
    """The damper with effects, each of its size where it acts alone.

    Parameters
    ----------
    plain : the damper without
    wanted : the size of each effect by its name
    records : motions, and the force of the plain damper
    draw : where what else there is to an effect comes from
    """
    scales = _scales(records, plain)
    start = _start_temperature(records)
    drifts = any(library()[name].place == "material" for name in wanted)
    base = plain.model_copy(update={"reference_temperature_degC": start if drifts else None})
    effects: dict[str, Values] = {}
    for name, size in wanted.items():
        hiding = library()[name].hidden
        if hiding is None:
            raise ValueError(f"{name} says not how it is hidden")
        effects[name] = of_size(hiding(draw, scales), partial(_size, records, base, name), size)
    return Damper(
        base=plain.base, effects=_as_dicts(effects), reference_temperature_degC=base.reference_temperature_degC
    )


def _as_dicts(effects: Mapping[str, Values]) -> dict[str, dict[str, float | tuple[float, ...]]]:
    return {name: dict(values) for name, values in effects.items()}


def _start_temperature(records: Sequence[Clean]) -> float | None:
    temperature = records[0].motion.temperature
    return None if temperature is None else float(temperature[0])


def _size(records: Sequence[Clean], plain: Damper, name: str, values: Values) -> float:
    """How much an effect changes the force of the record that it changes most, as a share of its peak."""
    damper = plain.with_effect(name, values)
    return max(_change(record, plain, damper) for record in records)


def sizes(records: Sequence[Clean], plain: Damper, damper: Damper) -> dict[str, float]:
    """How much each effect of a damper, alone, changes the force of the record that it changes most.

    Parameters
    ----------
    records : motions, and the force of the plain damper
    plain : without the effects
    damper : with them

    Returns
    -------
    by the effect's name: amplitude of a sine of the same r.m.s., as a share of the record's peak
    """
    base = plain.model_copy(update={"reference_temperature_degC": damper.reference_temperature_degC})
    return {
        name: _size(records, base, name, {key: float(value) for key, value in values.items()})  # type: ignore[arg-type]  # one number each, as drawn
        for name, values in damper.effects.items()
    }


def _change(record: Clean, plain: Damper, damper: Damper) -> float:
    start = float(record.force[0])
    with_it, without = (respond(one, record.motion, start, 1e-6) for one in (damper, plain))
    return amplitude(with_it - without) / record.peak


def amplitude(force: Array) -> float:
    """Amplitude of the sine that has the r.m.s. of a force [N]: a short spike does not count as a large effect."""
    return float(np.sqrt(2.0 * np.mean(force**2)))


def _scales(records: Sequence[Clean], damper: Damper) -> Scales:
    motions = [record.motion for record in records]
    voltages = np.concatenate([[0.0] if m.voltage is None else m.voltage[[0, -1]] for m in motions])
    moving = [float(np.ptp(m.voltage)) for m in motions if m.voltage is not None]
    return Scales(
        force=max(record.peak for record in records),
        low_force=min(record.peak for record in records),
        speed=max(float(np.max(np.abs(m.velocity))) for m in motions),
        stroke=max(float(np.max(np.abs(m.displacement))) for m in motions),
        acceleration=max(float(np.max(np.abs(m.acceleration))) for m in motions),
        damping=float(np.median([row.C_Ns_per_m for row in damper.base])),
        voltage=max([float(np.ptp(voltages)), *moving]),
    )


@dataclass(frozen=True, eq=False)
class Outside:
    """A form outside the library at its size."""

    name: str
    values: Mapping[str, float]
    reached: Reached

    @classmethod
    def drawn(cls, name: str, size: float, records: Sequence[Clean], draw: np.random.Generator) -> Outside:
        """The form with parameters drawn, adding `size` of its peak to the record that it changes most."""
        form = FORMS[name]
        scale = Reached(
            stroke=max(float(np.max(np.abs(record.motion.displacement))) for record in records),
            speed=max(float(np.max(np.abs(record.motion.velocity))) for record in records),
        )
        values = {key: float(draw.uniform(*limits)) for key, limits in form.ranges.items()}
        largest = max(amplitude(form.shape(r.motion, scale, values)) / r.peak for r in records)
        return cls(name, {**values, "force_N": size / largest}, scale)

    def law(self, damper: Damper, motion: Motion, frame_stiffness: float | None) -> Array:
        """(n,) force of the damper and of the form beside it [N]."""
        shape = FORMS[self.name].shape(motion, self.reached, self.values)
        return force_in_frame(damper, motion, frame_stiffness) + self.values["force_N"] * shape
