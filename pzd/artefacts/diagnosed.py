"""The verdict, its evidence, and the damper that everything behind uses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal, Self

from pydantic import Field

from pzd.artefacts.identified import ParameterRow
from pzd.damper.model import PHYSICAL, Damper
from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.errors import DataError
from pzd.schema.jsonfile import read_json, write_json
from pzd.schema.model import Frozen
from pzd.schema.yamlfile import read_yaml, read_yaml_model, write_yaml_model


class Gap(Frozen):
    """The gap between simulation and measurement on what no fit has seen."""

    criterion: Literal["W_s"] = "W_s"
    before: float = Field(ge=0.0)
    after: float = Field(ge=0.0)
    noise_floor: float = Field(ge=0.0)
    standard_error: float = Field(ge=0.0)
    held_out: tuple[str, ...]
    hold_out: Literal["records", "cycles", "segments", "mixed"]


class KeptBack(Frozen):
    """One test that was kept back, predicted by dampers that were fitted without it."""

    record: str
    voltage: float | None
    """None where it moves, or where the damper has none."""
    W_s_plain: float
    W_s: float


class LeftOut(Frozen):
    """One voltage that was left out, predicted by interpolation between its neighbours."""

    voltage: float
    W_s_plain: float
    W_s: float


class Prediction(Frozen):
    """What the damper handed on predicts of kept-back tests, beside the plain one; nothing is fitted to them."""

    hold_out: Literal["tests", "cycles", "segments", "mixed"]
    """Whole tests; halves of one, by cycles or segments, where it is alone at its voltage; or some of either."""
    by: tuple[KeptBack, ...]
    W_s_plain: float
    W_s: float
    left_out_voltages: tuple[LeftOut, ...]
    """Every voltage between two others."""


class Value(Frozen):
    """A parameter of an adopted effect with its 95 % interval; lists beside at_voltage_V."""

    value: float | tuple[float, ...]
    low95: float | tuple[float, ...] | None
    high95: float | tuple[float, ...] | None
    unit: str
    at_voltage_V: tuple[float, ...] | None = None


class Ranked(Frozen):
    """One candidate effect in the ranking."""

    effect: str
    gap_after: float
    delta_bic: float
    parameters: dict[str, float | tuple[float, ...]]
    reason: str
    at_voltage_V: tuple[float, ...] | None = None


class Region(Frozen):
    """Where the gap lies."""

    region: str
    share_of_gap: float


class NextTest(Frozen):
    """The rig test that would separate the rivals best."""

    waveform: str
    frequency_Hz: float | None
    amplitude_m: float | None
    voltage_V: float | tuple[float, ...] | None
    separates: tuple[str, ...]
    distance_percent: float | None = None
    """Predicted r.m.s. between the rivals there, in % of peak, after refitting the wrong one."""
    middle_m: float | None = None
    """Where the motion has its middle, in the displacement as recorded."""
    peak_speed_m_per_s: float | None = None
    """Largest speed of the motion."""
    peak_force_N: float | None = None
    """Largest force that any of the rivals would reach in it."""


class Diagnosis(Frozen):
    """What is missing from the model, how sure that is, and what would settle it."""

    verdict: Literal["named", "ambiguous", "none", "unexplained"]
    reason: str
    effects: tuple[str, ...]
    confidence: float | None = Field(ge=0.0, le=1.0)
    gap: Gap | None
    """None where it could not be measured, which `reason` tells."""
    parameters: dict[str, dict[str, Value]]
    ranking: tuple[Ranked, ...]
    rivals: tuple[str, ...]
    where: tuple[Region, ...]
    next_test: NextTest | None
    prediction: Prediction | None = None
    """What decides over handing on an effect; None where no test could be kept back, which `reason` tells."""
    zero_m: float = 0.0
    """Recorded displacement from which the parameters of an effect count x, such as x_e of `end_stop`."""

    @classmethod
    def without_effects(
        cls,
        verdict: Literal["none", "ambiguous", "unexplained"],
        reason: str,
        gap: Gap | None,
        where: tuple[Region, ...] = (),
        next_test: NextTest | None = None,
    ) -> Self:
        """A verdict under which no effect was weighed: none adopted, none ranked, no rivals."""
        return cls(
            verdict=verdict,
            reason=reason,
            effects=(),
            confidence=None,
            gap=gap,
            parameters={},
            ranking=(),
            rivals=(),
            where=where,
            next_test=next_test,
        )


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """The verdict, and the damper that everything behind uses."""

    folder: ClassVar[str] = "3-diagnose"

    diagnosis: Diagnosis
    damper: Damper
    plain: Damper
    """The damper before diagnose."""
    parameters: tuple[ParameterRow, ...] = ()
    """T0, C and k of the damper with their intervals; empty where nobody fitted them."""

    @classmethod
    def undiagnosed(cls, damper: Damper, plain: Damper | None = None) -> Self:
        """A damper that nobody diagnosed, in the form in which the stages behind diagnose take it."""
        gap = Gap(before=0.0, after=0.0, noise_floor=0.0, standard_error=0.0, held_out=(), hold_out="records")
        return cls(Diagnosis.without_effects("none", "not diagnosed", gap), damper, plain or damper)

    def write(self, folder: Path, control: Control) -> None:
        """Write diagnosis.json, damper.yaml, plain.yaml and parameters.csv."""
        write_json(folder / "diagnosis.json", self.diagnosis, control)
        write_yaml_model(folder / "damper.yaml", self.damper, control)
        write_yaml_model(folder / "plain.yaml", self.plain, control)
        write_rows(folder / "parameters.csv", ParameterRow, self.parameters, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again, each by itself and against one another."""
        found = cls(
            read_json(folder / "diagnosis.json", Diagnosis, control),
            read_yaml_model(folder / "damper.yaml", Damper, control),
            read_yaml_model(folder / "plain.yaml", Damper, control),
            read_rows(folder / "parameters.csv", ParameterRow, control),
        )
        if faults := [*_effects_apart(found, folder), *_base_apart(found, folder, control)]:
            raise DataError(faults)
        return found


OTHER_UNIT = 100.0
"""From this ratio on two values of one parameter are in different units; the least between two units is 1000."""


def _effects_apart(found: Diagnosed, folder: Path) -> list[str]:
    """Effects that only one of damper.yaml and diagnosis.json has, each with its place."""
    told, acting = found.diagnosis.effects, found.damper.effects
    if set(told) == set(acting):
        return []
    damper = read_yaml(folder / "damper.yaml", DataError)
    diagnosis = read_yaml(folder / "diagnosis.json", DataError)
    return [
        f"{damper.place(('effects', name))}: effects.{name}: diagnosis.json does not have it among its effects; "
        "add it there too, or take it out here"
        for name in acting
        if name not in told
    ] + [
        f"{diagnosis.place(('effects', str(number)))}: effects.{number}: damper.yaml has no {name}; "
        "add it there too, or take it out here"
        for number, name in enumerate(told)
        if name not in acting
    ]


def _base_apart(found: Diagnosed, folder: Path, control: Control) -> list[str]:
    """Values of T0, C and k in damper.yaml that parameters.csv has in another unit, each with its place."""
    rows = {(row.voltage_V, row.temperature_degC): row for row in found.parameters}
    faults: list[str] = []
    for number, base in enumerate(found.damper.base):
        row = rows.get((base.voltage_V, base.temperature_degC))
        for name in PHYSICAL if row else ():
            here, there = float(getattr(base, name)), getattr(row, name)
            if there is None or not 0.0 < min(here, there) * OTHER_UNIT < max(here, there):
                continue
            place = read_yaml(folder / "damper.yaml", DataError).place(("base", str(number), name))
            faults.append(
                f"{place}: base.{number}.{control.renamed(name)}: parameters.csv has {there:g} there; "
                f"is it in another unit? change both if it is meant (got {here:g})"
            )
    return faults
