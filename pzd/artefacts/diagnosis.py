"""Artefact of diagnose: the verdict with its evidence, the adopted damper, hypotheses; and the comparison with peers.

The models down to `Diagnosis` are diagnosis.json, key by key.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from pzd.artefacts.csv_rows import Estimate, Files, read_files, write_files
from pzd.artefacts.identified import ParameterRow
from pzd.damper.confounders import known
from pzd.damper.effect import NODE_VOLTAGES
from pzd.damper.fitted_laws import fitted_laws
from pzd.damper.model import Damper
from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.errors import DataError, at
from pzd.schema.model import Frozen
from pzd.schema.validate import read_json, write_json
from pzd.schema.yamlfile import read_yaml_model, write_yaml_model

Verdict = Literal["named", "ambiguous", "none", "unexplained"]
"""What a diagnosis says is missing: effects by name, one of several, nothing, or something that has no name."""


class Gap(Frozen):
    """The gap between simulation and measurement on held-out data."""

    criterion: Literal["W_s"] = "W_s"
    before: float = Field(ge=0.0)
    after: float = Field(ge=0.0)
    noise_floor: float = Field(ge=0.0)
    tests_own: float = Field(default=0.0, ge=0.0)
    """Part of the floor that a zero, gain and delay of each test take, not noise; 0 where an earlier version wrote the
    file."""
    standard_error: float = Field(ge=0.0)
    held_out: tuple[str, ...]
    hold_out: Literal["records", "cycles", "segments", "mixed"]


class HeldOutTest(Frozen):
    """One held-out test, predicted by the baseline and by the adopted damper, each fitted without it."""

    record: str
    voltage: float | None
    """None where it moves, or where the damper has none."""
    W_s_plain: float
    W_s: float
    R2_plain: float | None = None
    """1 - (sum of squared residuals)/(sum of squares about the mean force of the test); None where an earlier version
    wrote the file."""
    R2: float | None = None
    """The same of the adopted damper."""


class HeldOutVoltage(Frozen):
    """One held-out voltage, predicted by interpolation between its neighbours."""

    voltage: float
    W_s_plain: float
    W_s: float


class Prediction(Frozen):
    """Prediction error of the baseline and of the adopted damper on held-out tests; nothing is fitted to these."""

    hold_out: Literal["tests", "cycles", "segments", "mixed"]
    """Whole tests; halves of one, by cycles or segments, where it is alone at its voltage; or some of either."""
    by: tuple[HeldOutTest, ...]
    W_s_plain: float
    W_s: float
    left_out_voltages: tuple[HeldOutVoltage, ...]
    """Every voltage between two others."""


class Value(Frozen):
    """A parameter of an adopted effect with its 95 % interval; lists beside at_voltage_V."""

    value: float | tuple[float, ...]
    low95: float | tuple[float, ...] | None
    high95: float | tuple[float, ...] | None
    unit: str
    at_voltage_V: tuple[float, ...] | None = None

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """The value with its interval, one for each of `at_voltage_V`."""
        values = self.value if isinstance(self.value, tuple) else (self.value,)
        lows, highs = (end if isinstance(end, tuple) else (end,) * len(values) for end in (self.low95, self.high95))
        return tuple(map(Estimate, values, lows, highs))

    def may_be(self, number: float) -> bool:
        """Whether the interval of every value holds a number.

        Examples
        --------
        >>> Value(value=150.0, low95=-10.0, high95=160.0, unit="N").may_be(0.0)
        True
        """
        return all(
            e.low95 is not None and e.high95 is not None and e.low95 <= number <= e.high95 for e in self.estimates
        )

    @model_validator(mode="after")
    def _inside_its_interval(self) -> Value:
        """Refuse a value that was edited without its interval, and lists of different lengths."""
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
    """W_s on the tests seen: of an adopted effect that of the damper handed on, of another one that at the step of the
    search which decided on it."""
    delta_bic: float
    parameters: dict[str, float | tuple[float, ...]]
    reason: str
    at_voltage_V: tuple[float, ...] | None = None
    gap_standard_error: float | None = None
    """Of `gap_after`, from its scatter between tests; None with a single test, or of an earlier version."""


class Region(Frozen):
    """Where the gap lies."""

    region: str
    share_of_gap: float


CYCLES_OF_TEST = 10
"""Cycles of a test: noise is separated from what repeats, and a quarter of the cycles chooses, another is held out."""
CYCLES_IN_WORDS = "ten"
"""The same in words."""
STEPS_PER_CYCLE = 4.0
"""Changes of the control signal per cycle in a test that steps it."""


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
    """The tested voltages between which the force is known least; None where there are rivals to tell apart."""


class Support(Frozen):
    """How far held-out tests support one adopted effect, whatever the verdict on the whole."""

    share: float = Field(ge=0.0, le=1.0)
    """Of the baseline's sum of squared errors, what comes back without it, the others refitted."""
    folds_better: int = Field(ge=0)
    """Folds whose tests are predicted better with it, each by fits without them."""
    folds: int = Field(ge=0)
    """Folds that hold out whole tests."""
    replaced_by: str | None
    """Another effect that predicts as well in its place, or that it may be a part of; None where there is none."""
    confidence: float | None = Field(ge=0.0, le=1.0)
    """Probability that other tests are predicted better with it, halved where another would do as well; None without
    two tests that are held out as a whole."""
    sure: Literal["certain", "likely", "open"]
    """The same in a word for the effect itself: `open` where the prediction is sure and what it stands for is not."""
    added: bool = False
    """Whether it came in for its prediction alone: what it stands for is open, however sure the prediction is."""


class Diagnosis(Frozen):
    """What is missing from the model, how sure that is, and what would settle it."""

    verdict: Verdict
    reason: str
    effects: tuple[str, ...]
    confidence: float | None = Field(ge=0.0, le=1.0)
    gap: Gap | None
    """None where it could not be measured; `reason` says why."""
    parameters: dict[str, dict[str, Value]]
    ranking: tuple[Ranked, ...]
    rivals: tuple[str, ...]
    where: tuple[Region, ...]
    next_test: NextTest | None
    prediction: Prediction | None = None
    """What decides whether an effect is adopted; None where no test could be held out; `reason` says why."""
    support: dict[str, Support] = Field(default_factory=dict)
    """By adopted effect."""
    left_of_peak: float | None = None
    """R.m.s. of what the adopted damper leaves above the noise, as a share of peak; None where nothing was tried."""
    zero_m: float = 0.0
    """Recorded displacement from which the parameters of an effect count x, such as x_e of `end_stop`."""

    @property
    def by_knee_law(self) -> bool:
        """Whether the knee law misses nothing visible, so that none was tried; others without a gap are `ambiguous`."""
        return self.gap is None and not self.ranking and self.verdict != "ambiguous"

    @classmethod
    def without_effects(
        cls,
        verdict: Literal["none", "ambiguous", "unexplained"],
        reason: str,
        gap: Gap | None,
        where: tuple[Region, ...] = (),
        next_test: NextTest | None = None,
    ) -> Self:
        """Return a verdict under which no effect was tried: none adopted, none ranked, no rivals."""
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


# --- Hypotheses: shapes of the residual force where the verdict is `unexplained`, never adopted ---


class HypothesisRow(Frozen):
    """One shape of the residual force, with the share of the gap that it would close on held-out tests."""

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
    """Share of the gap above the noise that it closes on held-out tests, together with those it stands beside."""
    standard_errors: float = Field(gt=0.0)
    """By how many of them it predicts held-out tests better, the squares weighed by noise and gap."""
    W_s_before: float = Field(ge=0.0)
    """Of held-out tests, their own offset, gain and delay allowed for."""
    W_s_after: float = Field(ge=0.0)
    physics: str
    """What has this shape."""
    library: str | None
    """Effects of the library that have it, joined by ` or `; None where none has."""
    source: str


class HypothesisPoint(Frozen):
    """Residual force over the argument of the best shape: the mean of the samples of one class."""

    shape: str
    argument: str
    """What is counted along the abscissa."""
    unit: str
    """Of the argument."""
    voltage_V: float | None
    value: float
    """Of the argument, the mean of the class."""
    left_N: float
    """Residual force, with T0, C, k, the adopted effects and the test's own offset, gain and delay projected out."""
    scatter_N: float = Field(ge=0.0)
    """Standard deviation of the samples."""
    samples: int = Field(ge=1)
    fitted_N: float
    """The shape with its coefficient."""


@dataclass(frozen=True)
class Hypotheses:
    """The shapes that were found, and the points of the best one's picture; empty where none was looked for."""

    rows: tuple[HypothesisRow, ...] = ()
    points: tuple[HypothesisPoint, ...] = ()
    sought: bool = False
    """Whether any was looked for: the verdict is `unexplained`, beside one T0 and C."""

    def write(self, folder: Path, control: Control) -> None:
        """Write hypotheses.csv and hypothesis.csv where any was looked for."""
        if self.sought:
            write_files(self, HYPOTHESES, folder, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        if not (folder / "hypotheses.csv").is_file():
            return cls()
        return cls(**read_files(HYPOTHESES, folder, control), sought=True)

    @property
    def alone(self) -> tuple[HypothesisRow, ...]:
        """Those by themselves, the best first."""
        return tuple(row for row in self.rows if row.beside is None)

    @property
    def together(self) -> tuple[HypothesisRow, ...]:
        """The second and third beside the best."""
        return tuple(row for row in self.rows if row.beside is not None)


HYPOTHESES: Files = {"rows": ("hypotheses.csv", HypothesisRow), "points": ("hypothesis.csv", HypothesisPoint)}


# --- `pzd peers`: the adopted damper beside published models, on held-out tests ---

BASELINE, ADOPTED = "plain", "handed_on"
"""Names of the baseline and of the adopted damper in the column `model`."""


class PeerRow(Frozen):
    """Prediction error of one model on one test, or on several together."""

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


class PeerSummaryRow(Frozen):
    """One model on one damper: how many numbers it takes, and how well they predict."""

    setting: str | None
    model: str
    parameters: int = Field(ge=0)
    """Numbers that were fitted, over all voltages."""
    tests: int = Field(ge=0)
    """Held-out tests."""
    W_s: float | None = Field(ge=0.0)
    """Criterion (4) of all held-out tests together."""
    R2: float | None = Field(le=1.0)
    left_out: int = Field(ge=0)
    """Voltages that were left out, each between two others."""
    W_s_left_out: float | None = Field(ge=0.0)
    """Criterion (4) of the tests at all of these together, each predicted from the other voltages."""
    R2_left_out: float | None = Field(le=1.0)


class PeerParameterRow(Frozen):
    """One parameter of one model that diagnose does not fit, at one voltage or over all, fitted to all tests of it."""

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
    """Prediction errors of the baseline, the adopted damper and published models."""

    folder: ClassVar[str] = "peers"

    models: tuple[str, ...]
    """In the order of the tables."""
    rows: tuple[PeerRow, ...]
    summary: tuple[PeerSummaryRow, ...]
    """One row per model."""
    parameters: tuple[PeerParameterRow, ...]
    moving: tuple[str, ...]
    """Records whose control signal moves: peers are fitted and compared where it stands still."""
    unstable: tuple[str, ...] = ()
    """Held-out tests that an unstable black box predicted; where it diverged, it was held at a bound."""

    def write(self, folder: Path, control: Control) -> None:
        """Write peers.csv, summary.csv and parameters.csv."""
        files: Files = {
            "rows": ("peers.csv", PeerRow),
            "summary": ("summary.csv", PeerSummaryRow),
            "parameters": ("parameters.csv", PeerParameterRow),
        }
        write_files(self, files, folder, control)


# --- The artefact of the stage ---


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """The verdict, and the damper that everything behind uses."""

    folder: ClassVar[str] = "3-diagnose"

    diagnosis: Diagnosis
    damper: Damper
    """The adopted damper."""
    baseline: Damper
    """The damper before diagnose."""
    parameters: tuple[ParameterRow, ...] = ()
    """T0, C and k of the damper with their intervals; empty where nobody fitted them."""
    hypotheses: Hypotheses = field(default_factory=Hypotheses)
    """Shapes of the residual force where the verdict is `unexplained`; no later stage depends on them."""

    @classmethod
    def undiagnosed(cls, damper: Damper, baseline: Damper | None = None) -> Self:
        """Return a damper that nobody diagnosed, in the form in which the stages behind diagnose take it."""
        gap = Gap(before=0.0, after=0.0, noise_floor=0.0, standard_error=0.0, held_out=(), hold_out="records")
        return cls(Diagnosis.without_effects("none", "not diagnosed", gap), damper, baseline or damper)

    def write(self, folder: Path, control: Control) -> None:
        """Write diagnosis.json, damper.yaml, plain.yaml, parameters.csv, and hypotheses where any was looked for."""
        write_json(folder / "diagnosis.json", self.diagnosis, control)
        write_yaml_model(folder / "damper.yaml", self.damper, control)
        write_yaml_model(folder / "plain.yaml", self.baseline, control)
        write_rows(folder / "parameters.csv", ParameterRow, self.parameters, control)
        self.hypotheses.write(folder, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again; an edited damper.yaml is used, with its values in those of diagnosis.json.

        Raises
        ------
        DataError : when a file is at fault, or damper.yaml has other effects than diagnosis.json and plain.yaml
        """
        diagnosis = read_json(folder / "diagnosis.json", Diagnosis, control)
        damper = read_yaml_model(folder / "damper.yaml", Damper, control)
        rows = read_rows(folder / "parameters.csv", ParameterRow, control)
        baseline = read_yaml_model(folder / "plain.yaml", Damper, control)
        expected = {*diagnosis.effects, *baseline.effects}
        # Beside what is missing the law of the element may have a part that it hid from the fit without.
        if expected != {name for name in damper.effects if name in expected or name not in fitted_laws()}:
            raise DataError(
                f"{at(folder / 'damper.yaml')}: effects: must be those of diagnosis.json and plain.yaml, "
                f"{', '.join(sorted(expected)) or 'none'} (got {', '.join(damper.effects) or 'none'})"
            )
        values = {
            name: _values(name, diagnosis, damper, control) for name in damper.effects if name in diagnosis.effects
        }
        diagnosis = diagnosis.model_copy(update={"parameters": values, "zero_m": damper.zero_m})
        return cls(diagnosis, damper, baseline, rows, Hypotheses.read(folder, control))


def _values(effect: str, diagnosis: Diagnosis, damper: Damper, control: Control) -> dict[str, Value]:
    """Return the parameters of an adopted effect as the damper has them, without intervals where they were edited."""
    found: dict[str, Value] = {}
    given = damper.effects[effect]
    voltages = given.get(NODE_VOLTAGES)
    for parameter in known()[effect].parameters:
        value = given[parameter.name]
        at_voltage = voltages if isinstance(voltages, tuple) and isinstance(value, tuple) else None
        fitted = diagnosis.parameters.get(effect, {}).get(parameter.name)
        if fitted is None or (fitted.value, fitted.at_voltage_V) != (value, at_voltage):
            unit = control.own_unit(parameter.unit)
            fitted = Value(value=value, low95=None, high95=None, unit=unit, at_voltage_V=at_voltage)
        found[parameter.name] = fitted
    return found
