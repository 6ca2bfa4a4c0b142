"""The verdict, and the damper that everything behind uses."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Self

from pzd.artefacts.contradictions import contradictions
from pzd.artefacts.diagnosis import Diagnosis, Gap, Value
from pzd.artefacts.hypotheses import Hypotheses
from pzd.artefacts.identified import ParameterRow
from pzd.damper.competing_forms import known
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.errors import DataError
from pzd.schema.jsonfile import read_json, write_json
from pzd.schema.yamlfile import read_yaml_model, write_yaml_model


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
    hypotheses: Hypotheses = field(default_factory=Hypotheses)
    """Which shape what is left has, where the verdict is `unexplained`; nothing behind diagnose depends on it."""

    @classmethod
    def undiagnosed(cls, damper: Damper, plain: Damper | None = None) -> Self:
        """A damper that nobody diagnosed, in the form in which the stages behind diagnose take it."""
        gap = Gap(before=0.0, after=0.0, noise_floor=0.0, standard_error=0.0, held_out=(), hold_out="records")
        return cls(Diagnosis.without_effects("none", "not diagnosed", gap), damper, plain or damper)

    def write(self, folder: Path, control: Control) -> None:
        """Write diagnosis.json, damper.yaml, plain.yaml, parameters.csv, and hypotheses where any was looked for."""
        write_json(folder / "diagnosis.json", self.diagnosis, control)
        write_yaml_model(folder / "damper.yaml", self.damper, control)
        write_yaml_model(folder / "plain.yaml", self.plain, control)
        write_rows(folder / "parameters.csv", ParameterRow, self.parameters, control)
        self.hypotheses.write(folder, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again, each by itself and against one another; told are the values that act."""
        diagnosis = read_json(folder / "diagnosis.json", Diagnosis, control)
        damper = read_yaml_model(folder / "damper.yaml", Damper, control)
        rows = read_rows(folder / "parameters.csv", ParameterRow, control)
        plain = read_yaml_model(folder / "plain.yaml", Damper, control)
        if faults := contradictions(diagnosis, (damper, plain), rows, folder, control):
            raise DataError(faults)
        told = diagnosis.model_copy(
            update={"parameters": _as_acting(diagnosis, damper, control), "zero_m": damper.zero_m}
        )
        return cls(told, damper, plain, rows, Hypotheses.read(folder, control))


def _as_acting(diagnosis: Diagnosis, damper: Damper, control: Control) -> dict[str, dict[str, Value]]:
    """The parameters of the adopted effects as the damper has them, without intervals where somebody edited them."""
    found: dict[str, dict[str, Value]] = {}
    for name, values in ((name, values) for name, values in damper.effects.items() if name in diagnosis.effects):
        nodes = values.get("at_voltage_V")
        for parameter in known()[name].parameters:
            diagnosed, acting = diagnosis.parameters.get(name, {}).get(parameter.name), values[parameter.name]
            at = nodes if isinstance(nodes, tuple) and isinstance(acting, tuple) else None
            if diagnosed is None or (diagnosed.value, diagnosed.at_voltage_V) != (acting, at):
                unit = control.own_unit(parameter.unit)
                diagnosed = Value(value=acting, low95=None, high95=None, unit=unit, at_voltage_V=at)
            found.setdefault(name, {})[parameter.name] = diagnosed
    return found
