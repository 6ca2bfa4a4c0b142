"""The verdict and its evidence, as diagnosis.json has them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from pzd.artefacts.identified import ParameterRow
from pzd.damper.confounders import known
from pzd.damper.model import PHYSICAL, Damper, against_nature
from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.errors import DataError
from pzd.schema.model import Frozen
from pzd.schema.validate import read_json, write_json
from pzd.schema.yamlfile import Document, read_yaml, read_yaml_model, write_yaml_model

# ----------------------------------------------------------------------------------------------------


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
    R2_plain: float | None = None
    """1 - (sum of squared residuals)/(sum of squares about the mean force of the test); None where an earlier version
    wrote the file."""
    R2: float | None = None
    """The same of the damper handed on."""


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

    @model_validator(mode="after")
    def _inside_its_interval(self) -> Value:
        """A value written by hand outside of its interval is told, as are lists that do not belong together."""
        given = [each for each in (self.value, self.low95, self.high95, self.at_voltage_V) if each is not None]
        if len({len(each) if isinstance(each, tuple) else None for each in given}) > 1:
            raise ValueError("value, low95, high95 and at_voltage_V must be lists of one length, or no lists")
        low, high = (-np.inf if self.low95 is None else self.low95), (np.inf if self.high95 is None else self.high95)
        if np.any(np.less(self.value, low)) or np.any(np.greater(self.value, high)):
            raise ValueError("value must lie between low95 and high95; change them too, or make them null")
        return self


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
    """The rig test that would separate the rivals best; without rivals, one where the force is known least."""

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
    between_voltage_V: tuple[float, float] | None = None
    """The tested voltages between which the force is known least, which the test is to show; None with rivals."""


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


# ----------------------------------------------------------------------------------------------------
# What damper.yaml says otherwise than the files beside it, after an edit that cannot be meant so.
#
# An edit to another value that a damper may have is taken: it is told without an interval.


OTHER_UNIT = 100.0
"""From this ratio on two values of one parameter are in different units; the least between two units is 1000."""

Acting = float | tuple[float, ...]


def contradictions(
    diagnosis: Diagnosis, dampers: tuple[Damper, Damper], rows: Sequence[ParameterRow], folder: Path, control: Control
) -> list[str]:
    """Every fault of a damper beside its diagnosis and its T0, C and k, each with its place.

    Parameters
    ----------
    diagnosis : of diagnosis.json
    dampers : of damper.yaml and of plain.yaml; the law that identify fits may bring effects of its own
    rows : of parameters.csv
    folder : where the three stand
    control : the control signal, which names the voltage in messages
    """
    damper, plain = dampers
    if {*diagnosis.effects, *plain.effects} != set(damper.effects):
        return _effects_apart(diagnosis, damper, plain, folder)
    document = read_yaml(folder / "damper.yaml", DataError)
    return [*_base_apart(damper, rows, document, control), *_values_apart(diagnosis, damper, plain, document)]


def _effects_apart(diagnosis: Diagnosis, damper: Damper, plain: Damper, folder: Path) -> list[str]:
    """Effects that damper.yaml has and neither diagnosis.json nor plain.yaml, or the other way round."""
    told, acting = diagnosis.effects, damper.effects
    names = ("damper.yaml", "diagnosis.json", "plain.yaml")
    of_damper, of_diagnosis, of_plain = (read_yaml(folder / name, DataError) for name in names)
    return (
        [
            f"{of_damper.place(('effects', name))}: effects.{name}: diagnosis.json does not have it among its effects; "
            "add it there too, or take it out here"
            for name in acting
            if name not in {*told, *plain.effects}
        ]
        + [
            f"{of_diagnosis.place(('effects', str(number)))}: effects.{number}: damper.yaml has no {name}; "
            "add it there too, or take it out here"
            for number, name in enumerate(told)
            if name not in acting
        ]
        + [
            f"{of_plain.place(('effects', name))}: effects.{name}: damper.yaml has no {name}; "
            "add it there too, or take it out here"
            for name in plain.effects
            if name not in acting
        ]
    )


def _base_apart(damper: Damper, rows: Sequence[ParameterRow], document: Document, control: Control) -> Iterator[str]:
    """Values of T0, C and k that parameters.csv has in another unit."""
    by_condition = {(row.voltage_V, row.temperature_degC): row for row in rows}
    for number, base in enumerate(damper.base):
        row = by_condition.get((base.voltage_V, base.temperature_degC))
        for name in PHYSICAL if row else ():
            here, there = float(getattr(base, name)), getattr(row, name)
            if there is not None and _other_unit(here, there):
                yield (
                    f"{document.place(('base', str(number), name))}: base.{number}.{control.renamed(name)}: "
                    f"parameters.csv has {there:g} there; is it in another unit? change both if it is meant "
                    f"(got {here:g})"
                )


def _values_apart(diagnosis: Diagnosis, damper: Damper, plain: Damper, document: Document) -> Iterator[str]:
    """Values of effects that diagnosis.json has in another unit or with another sign, or that none has in nature."""
    impossible = against_nature(damper)
    for name, values in damper.effects.items():
        diagnosed = diagnosis.parameters.get(name, {})
        acting = {key: value for key, value in values.items() if key != "at_voltage_V"}
        if values == plain.effects.get(name):
            continue
        edited = {key: value for key, value in acting.items() if key not in diagnosed or diagnosed[key].value != value}
        if name in impossible and edited:
            got = ", ".join(f"{key} = {_shown(value)}" for key, value in acting.items())
            yield (
                f"{document.place(('effects', name))}: effects.{name}: no {name} has such values in nature; "
                f"take the edit back (got {got})"
            )
            continue
        for key, value in edited.items():
            if key in diagnosed and (fault := _apart(value, diagnosed[key])):
                yield (
                    f"{document.place(('effects', name, key))}: effects.{name}.{key}: diagnosis.json has "
                    f"{_shown(diagnosed[key].value)} {diagnosed[key].unit} there; {fault}; change both if it is meant "
                    f"(got {_shown(value)})"
                )


def _apart(acting: Acting, diagnosed: Value) -> str | None:
    """What is wrong with a value beside the one that was diagnosed, place by place of a list; None where nothing is."""
    here, there = _listed(acting), _listed(diagnosed.value)
    if len(here) != len(there):
        return None
    pairs = list(zip(here, there, strict=True))
    if any(_other_unit(abs(a), abs(b)) for a, b in pairs):
        return "is it in another unit?"
    lows, highs = _listed(diagnosed.low95), _listed(diagnosed.high95)
    if any(a * b < 0.0 and low * high > 0.0 for (a, b), low, high in zip(pairs, lows, highs, strict=False)):
        return "its interval holds no value of this sign"
    return None


def _other_unit(here: float, there: float) -> bool:
    """Whether two values are so far apart; zero is the same in every unit."""
    return 0.0 < min(here, there) * OTHER_UNIT < max(here, there)


def _listed(value: Acting | None) -> tuple[float, ...]:
    return () if value is None else value if isinstance(value, tuple) else (value,)


def _shown(value: Acting) -> str:
    return ", ".join(f"{each:g}" for each in _listed(value))


# ----------------------------------------------------------------------------------------------------
# What is left of the force where the verdict is `unexplained`, as shapes that predict it: told, never adopted.


class HypothesisRow(Frozen):
    """One shape of what is left, with what it would close on tests kept back."""

    place: int = Field(ge=1)
    """By what it closes: alone where `beside` is empty, else as the second or third together with those named there."""
    shape: str
    """The expression that the coefficient multiplies."""
    beside: str | None
    """Shapes that are fitted with it, joined by ` + `; None for a shape alone."""
    coefficient: float
    coefficient_low95: float
    coefficient_high95: float
    unit: str
    """Of the coefficient."""
    second_coefficient: float | None
    """Of the cosine of a wave."""
    parameter: str | None
    """What was searched beside the coefficient, by its symbol."""
    parameter_value: float | None
    parameter_unit: str | None
    width_m: float | None
    """Half-width of the place that the shape is about."""
    closes: float = Field(le=1.0)
    """Share of the gap above the noise that it closes on tests kept back, together with those it stands beside."""
    standard_errors: float = Field(gt=0.0)
    """By how many of them it predicts kept-back tests better, the squares weighed by noise and gap."""
    W_s_before: float = Field(ge=0.0)
    """Of tests kept back, their own offset, gain and delay allowed for."""
    W_s_after: float = Field(ge=0.0)
    physics: str
    """What has this shape."""
    library: str | None
    """Effects of the library that have it, joined by ` or `; None where none has."""
    source: str


class HypothesisPoint(Frozen):
    """What is left over the argument of the best shape: the mean of the samples of one class."""

    shape: str
    argument: str
    """What is counted along the abscissa."""
    unit: str
    """Of the argument."""
    voltage_V: float | None
    value: float
    """Of the argument, the mean of the class."""
    left_N: float
    """What is left, less what T0, C, k, the adopted effects and the test's own offset, gain and delay can take up."""
    scatter_N: float = Field(ge=0.0)
    """Standard deviation of the samples."""
    samples: int = Field(ge=1)
    fitted_N: float
    """The shape with its coefficient."""


@dataclass(frozen=True)
class Hypotheses:
    """The shapes that were found, and the picture of the best; empty where none was looked for."""

    rows: tuple[HypothesisRow, ...] = ()
    points: tuple[HypothesisPoint, ...] = ()
    sought: bool = False
    """Whether any was looked for: the verdict is `unexplained`, beside one T0 and C."""

    def write(self, folder: Path, control: Control) -> None:
        """Write hypotheses.csv and hypothesis.csv where any was looked for."""
        if self.sought:
            write_rows(folder / "hypotheses.csv", HypothesisRow, self.rows, control)
            write_rows(folder / "hypothesis.csv", HypothesisPoint, self.points, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        if not (folder / "hypotheses.csv").is_file():
            return cls()
        rows = read_rows(folder / "hypotheses.csv", HypothesisRow, control)
        return cls(rows, read_rows(folder / "hypothesis.csv", HypothesisPoint, control), sought=True)

    @property
    def alone(self) -> tuple[HypothesisRow, ...]:
        """Those by themselves, the best first."""
        return tuple(row for row in self.rows if row.beside is None)

    @property
    def together(self) -> tuple[HypothesisRow, ...]:
        """The second and third beside the best."""
        return tuple(row for row in self.rows if row.beside is not None)


# ----------------------------------------------------------------------------------------------------
# What `pzd peers` finds: the damper handed on beside published models, on tests that no fit has seen.


PLAIN, HANDED_ON = "plain", "handed_on"
"""How tables call the Bingham element alone, and the damper that diagnose hands on."""


class PeerRow(Frozen):
    """What one model misses of one test, or of several together."""

    setting: str | None
    voltage_V: float | None
    """None of all voltages together, or where the damper has none."""
    kept_back: Literal["test", "voltage"]
    """Whether the tests of other records at this voltage were fitted, or none at this voltage."""
    record: str | None
    """None of all those tests together."""
    model: str
    W_s: float = Field(ge=0.0)
    """Criterion (4)."""
    R2: float | None = Field(le=1.0)
    """1 - (sum of squared residuals)/(sum of squares about the mean force of each test); None where no force moves."""


class PeerParameterRow(Frozen):
    """One parameter of one published model at one voltage, fitted to all tests of it."""

    setting: str | None
    voltage_V: float | None
    model: str
    form: str
    """What of several forms was taken; empty where there is one."""
    parameter: str
    value: float
    unit: str
    status: str
    """Of the fit: `converged`, `not converged` or `at its limit: ...`."""


@dataclass(frozen=True)
class PeerComparison:
    """The damper handed on beside the plain one and published models."""

    folder: ClassVar[str] = "peers"

    models: tuple[str, ...]
    """In the order of the tables."""
    rows: tuple[PeerRow, ...]
    parameters: tuple[PeerParameterRow, ...]
    moving: tuple[str, ...]
    """Records whose control signal moves: peers are fitted and compared where it stands still."""

    def write(self, folder: Path, control: Control) -> None:
        """Write peers.csv and parameters.csv."""
        write_rows(folder / "peers.csv", PeerRow, self.rows, control)
        write_rows(folder / "parameters.csv", PeerParameterRow, self.parameters, control)


# ----------------------------------------------------------------------------------------------------
# The verdict, and the damper that everything behind uses.


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
