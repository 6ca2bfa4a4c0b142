"""The verdict and its evidence, as diagnosis.json has them."""

from __future__ import annotations

from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from pzd.schema.model import Frozen


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
