"""The run config: what holds for the whole run, and one block a stage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from pzd.blind.config import BlindConfig
from pzd.diagnosis.config import ChangesConfig, DiagnoseConfig
from pzd.force_table.config import DamperConfig, TableConfig
from pzd.identification.config import IdentifyConfig
from pzd.parallel.config import EngineConfig
from pzd.quantities import Control
from pzd.report.config import ReportConfig
from pzd.rig.config import ControlConfig, RigConfig
from pzd.schema.errors import ConfigError
from pzd.schema.model import Frozen, for_editors, nearest
from pzd.schema.yamlfile import Document, read_extended
from pzd.schema.yamltree import Entry, Node, collection
from pzd.simulate.config import SimulateConfig

_STAGES = ("rig", "identify", "diagnose", "table", "simulate", "report")
"""Stages of a run, of which the former key `stages` listed all, or all but `simulate`."""


def _rig_may_stand_elsewhere(schema: dict[str, Any], model: type[RunConfig]) -> None:
    """Require `rig` or `damper` only where the config extends no other one, in which it may stand."""
    for_editors(schema, model)
    schema["anyOf"] = [{"required": ["rig"]}, {"required": ["damper"]}, {"required": ["extends"]}]


SCHEMA = Path(__file__).with_name("config.schema.json")
"""JSON schema for editors; made by `pzd schema > pzd/config.schema.json`."""
EDITORS = "# yaml-language-server: $schema="
"""Beginning of the first line of a config, which names its schema to an editor."""


class Uniform(Frozen):
    """A number that lies anywhere between two limits."""

    uniform: tuple[float, float]
    """The limits."""

    @field_validator("uniform")
    @classmethod
    def _rising(cls, limits: tuple[float, float]) -> tuple[float, float]:
        if limits[0] >= limits[1]:
            raise ValueError(f"the first limit must be below the second (got {limits[0]:g}, {limits[1]:g})")
        return limits


class Normal(Frozen):
    """A number that scatters about a mean."""

    normal: tuple[float, float]
    """Mean and standard deviation."""

    @field_validator("normal")
    @classmethod
    def _scatters(cls, values: tuple[float, float]) -> tuple[float, float]:
        if values[1] <= 0.0:
            raise ValueError(f"the standard deviation must be above 0 (got {values[1]:g})")
        return values


Scatter = Literal["interval"] | Annotated[float, Field(gt=0.0, lt=1.0)]


class SweepConfig(EngineConfig):
    """The same run many times: every combination of values, and random draws."""

    over: dict[str, tuple[bool | int | float | str, ...]] = Field(default_factory=dict)
    """Values of keys of this config, written as for `--set`; every combination of them is run."""
    drawn: dict[str, Uniform | Normal] = Field(default_factory=dict)
    """Keys of this config whose numbers are drawn: `{uniform: [low, high]}` or `{normal: [mean, sd]}`."""
    damper: dict[str, Scatter] = Field(default_factory=dict)
    """What scatters of the damper handed on by diagnose, at every voltage and temperature alike: `T0`, `C`, `k`, or a
    parameter of an adopted effect as in `orifice_quadratic.q`. Either the standard deviation as a share of the value,
    from one damper of a series to the next, or `interval`: as uncertain as the tests leave it."""
    draws: int = Field(default=64, ge=2)
    """Base number of draws, a power of two. With two drawn quantities or more each combination is run `draws` times
    (their number + 2), which the Sobol indices need."""
    until: Literal["identify", "diagnose", "simulate"] = "simulate"
    """The stage whose results are gathered."""
    chunk: int = Field(default=8, ge=1)
    """Runs that a worker does at a time; what a chunk found is written when it is done."""

    @model_validator(mode="after")
    def _consistent(self) -> SweepConfig:
        if not (self.over or self.drawn or self.damper):
            raise ValueError("nothing differs from run to run; say what under over, drawn or damper")
        empty = [key for key, values in self.over.items() if not values]
        if empty:
            raise ValueError(f"over.{empty[0]} has no values")
        both = sorted({*self.over} & {*self.drawn})
        if both:
            raise ValueError(f"{both[0]} stands under over and under drawn; take one of them away")
        if self.draws & (self.draws - 1):
            raise ValueError(f"draws must be a power of two (got {self.draws})")
        if self.damper and self.until != "simulate":
            raise ValueError(f"damper scatters behind diagnose, and until ends at {self.until}; say until: simulate")
        return self


class RunConfig(Frozen):
    """One run: rig files in, comfort report out."""

    model_config = ConfigDict(json_schema_extra=_rig_may_stand_elsewhere)

    extends: str | None = None
    """A config beside this one that says what this one does not."""
    seed: int = Field(default=1, ge=0)
    """Seed of every random draw."""
    control: ControlConfig = ControlConfig()
    """The control signal of the valve."""
    setting: str | None = None
    """Which of the rig's settings diagnose and everything behind it use; needed where there are several."""
    car: bool = True
    """Whether the damper is ridden in a car; with `false` the run ends with a report on the damper alone."""
    rig: RigConfig | None = None
    """Where the rig records come from. Needed, unless `damper` stands in its place."""
    damper: DamperConfig | None = None
    """In place of a rig: dampers of measured curves or of other runs; the first stage is then `table`."""
    identify: IdentifyConfig = IdentifyConfig()
    """How the Bingham parameters are found."""
    diagnose: DiagnoseConfig = DiagnoseConfig()
    """How the missing effect is looked for."""
    changes: ChangesConfig = ChangesConfig()
    """What `pzd changes --over` lets pass."""
    table: TableConfig = TableConfig()
    """The table of force over voltage and speed."""
    simulate: SimulateConfig = SimulateConfig()
    """The half-car and its rides."""
    report: ReportConfig = ReportConfig()
    """The comfort report."""
    blind: BlindConfig | None = None
    """What `pzd blind` hides in virtual rigs, to see how far the naming can be trusted."""
    sweep: SweepConfig | None = None
    """What `pzd sweep` runs many times."""

    @field_validator("extends")
    @classmethod
    def _of_a_file(cls, extends: str | None) -> str | None:
        if extends is not None:  # what stands in the file is taken in when it is read
            raise ValueError("stands in the config alone, for --set comes after it")
        return extends

    @model_validator(mode="after")
    def _one_origin(self) -> RunConfig:
        if self.rig is None and self.damper is None:
            raise ValueError("say where the damper comes from: rig, or damper where it is known already")
        if self.damper is None:
            return self
        if self.rig is not None:
            raise ValueError("damper: rig and damper stand in each other's place; take one away")
        if self.setting is not None:
            raise ValueError("setting: a damper without a rig has none; take this key away")
        return self

    @property
    def measured_rig(self) -> RigConfig:
        """The block `rig`.

        Raises
        ------
        ConfigError : when the dampers are known without one
        """
        if self.rig is None:
            raise ConfigError("damper: this needs the records of a rig, and the config has none: say rig in its place")
        return self.rig

    @field_validator("simulate")
    @classmethod
    def _ridden(cls, simulate: SimulateConfig, info: ValidationInfo) -> SimulateConfig:
        # The config that a run writes has every block with its defaults, which contradict nothing.
        if not info.data.get("car", True) and simulate != SimulateConfig():
            raise ValueError("car: false leaves the rides out; take this block away, or say car: true")
        return simulate


def load(path: Path, overrides: Sequence[str] = ()) -> RunConfig:
    """Read a config, override values of it, and validate the whole.

    Parameters
    ----------
    path : the YAML file
    overrides : any number of ``a.b=VALUE``, VALUE one YAML scalar

    Returns
    -------
    the config with every default filled in

    Raises
    ------
    ConfigError : when anything is wrong with it, with every place
    """
    return validated(read_config(path, overrides))


def read_config(path: Path, overrides: Sequence[str] = ()) -> Document:
    """Read a config with all that it extends, override values of it, and put former keys in their present spelling.

    Parameters
    ----------
    path : the YAML file
    overrides : any number of ``a.b=VALUE``, VALUE one YAML scalar

    Raises
    ------
    ConfigError : when it cannot be read, an override has no place in it, or a former key is used wrongly
    """
    document = read_extended(path).overridden(overrides)
    entries = document.root.value
    if not isinstance(entries, Mapping) or "stages" not in entries:
        return document
    former = entries["stages"]
    stages = former.node.data()
    if "car" in entries:
        raise ConfigError(f"{former.place}: stages: is the former spelling of car; take this key away (got both)")
    if stages not in (list(_STAGES), [stage for stage in _STAGES if stage != "simulate"]):
        raise ConfigError(
            f"{former.node.place}: stages: is the former spelling of car, and must be {', '.join(_STAGES)} in this "
            "order, of which only simulate may be left out; say car: true, or car: false to leave the car out "
            "(to run fewer stages, give the command of the last, say pzd identify)"
        )
    car = Entry(former.place, Node("simulate" in stages, former.node.place))
    present = {"car": car} | {key: entry for key, entry in entries.items() if key != "stages"}
    return replace(document, root=collection(present, document.root.place))


def validated(document: Document) -> RunConfig:
    """Validate the config that a document describes.

    Raises
    ------
    ConfigError : when anything is wrong with it, with every place
    """
    return document.validated(RunConfig, control_of(document.data))


def control_of(data: Any) -> Control:
    """Return the control signal of a document; the default one where that block is itself at fault."""
    block = data.get("control", {}) if isinstance(data, dict) else {}
    try:
        return TypeAdapter(ControlConfig).validate_python(block).signal()
    except ValidationError:
        return Control()


def check_settings(config: RunConfig, found: Sequence[str | None]) -> str | None:
    """Return the setting in use, and check the settings that the table is to interpolate.

    Parameters
    ----------
    config : the config
    found : the settings of the rig's records

    Raises
    ------
    ConfigError : as `setting_in_use` does, and when a setting of the table does not lie between tested ones
    """
    chosen = setting_in_use(config.setting, found)
    config.table.between(found)
    return chosen


def setting_in_use(chosen: str | None, found: Sequence[str | None]) -> str | None:
    """Return the setting that diagnose and everything behind it use.

    Parameters
    ----------
    chosen : the config's `setting`
    found : the settings of the rig's records

    Returns
    -------
    the chosen one, or the only one there is

    Raises
    ------
    ConfigError : when several stand to choose from, or none is the one chosen
    """
    names = sorted({name for name in found if name is not None})
    listed = ", ".join(names) or "none that has a name"
    if chosen is None and len(set(found)) > 1:
        raise ConfigError(f"setting: the rig has several, say which one diagnose and the rest are about: {listed}")
    if chosen is None:
        return found[0] if found else None
    if chosen not in names:
        near = nearest(chosen, names)
        hint = f"; did you mean {near}?" if near else ""
        hint = hint or ("" if names else f"; write `setting: {chosen}` into the entries of `rig` that are it")
        raise ConfigError(f"setting: no record of the rig has this setting; there is {listed}{hint} (got {chosen})")
    return chosen
