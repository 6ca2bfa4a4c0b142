"""Artefact of `pzd changes`: what changed between two states of a damper, or over more than two.

The models are the JSON of the command, key by key.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from pydantic import ConfigDict, Field

from pzd.artefacts.diagnosis import NextTest
from pzd.damper.effects import library
from pzd.schema.model import Frozen

Verdict = Literal["changed", "unchanged", "ambiguous", "unexplained"]
"""Whether a damper changed, as far as its tests show; `unexplained` where the change has no name."""


class _Keyed(Frozen):
    """Model of which some keys are words of Python, written with an underscore behind them in code."""

    model_config = ConfigDict(populate_by_name=True, serialize_by_alias=True)


Numbers = float | tuple[float | None, ...] | None
"""A value, or one for each of `at_voltage_V`; None where it is undetermined."""


class Difference(Frozen):
    """Size of the difference between the forces of the two states, r.m.s. over the compared tests."""

    rms_N: float = Field(ge=0.0)
    share_of_peak: float = Field(ge=0.0)
    """In the largest force of the first state."""
    noise_N: float = Field(ge=0.0)
    """What noise leaves in it, and what the model misses of tests that are compared with it."""
    left_N: float = Field(ge=0.0)
    """What is left when all changes, and each test's own offset, gain and delay, are allowed for."""
    explained: float = Field(ge=0.0, le=1.0)
    """Share of its mean square above noise that the changes explain."""


class Change(_Keyed):
    """One quantity that changed."""

    name: str
    """T0, C, k, an effect, `knee`, `temperature`, or what the stand did."""
    parameter: str
    of: Literal["damper", "stand"]
    unit: str
    from_: Numbers = Field(alias="from")
    to: Numbers
    low95: Numbers
    """Of `to`, with `from` held."""
    high95: Numbers
    at_voltage_V: tuple[float, ...] | None = None
    share: float
    """Of the mean square of the difference that is left without this change, the others fitted again."""
    reason: str


class Unchanged(_Keyed):
    """One quantity whose visible change the tests would have shown."""

    name: str
    parameter: str
    unit: str
    from_: Numbers = Field(alias="from")
    to: Numbers
    low95: Numbers
    high95: Numbers
    at_voltage_V: tuple[float, ...] | None = None


def values_at(row: Change | Unchanged, index: int) -> tuple[float | None, ...]:
    """Return a quantity before and after, and the ends of its interval, at one of its control signals."""
    return tuple(value_at(values, index) for values in (row.from_, row.to, row.low95, row.high95))


def value_at(values: Numbers, index: int) -> float | None:
    """Return a value at one of the control signals of a quantity."""
    return values[index] if isinstance(values, tuple) else values


def had_no_value(row: Change | Unchanged, rows: Sequence[Change | Unchanged]) -> bool:
    """Whether a quantity is that of an effect newly there, beside its strength: its first value is none of the damper.

    The strength is the first parameter of an effect, and neutral where that is absent.

    Parameters
    ----------
    row : the quantity
    rows : all quantities told
    """
    effect = library().get(row.name)
    if effect is None or row.parameter == (strength := effect.parameters[0]).name:
        return False
    firsts = (each.from_ for each in rows if (each.name, each.parameter) == (row.name, strength.name))
    return any(first is None or first == strength.neutral for first in firsts)


def growth(before: float, after: float) -> float | None:
    """Return by what share the magnitude of a quantity grew; None where its sign turned, or it was 0.

    Examples
    --------
    >>> growth(-200.0, -150.0), growth(0.0, 1.0)
    (-0.25, None)
    """
    return abs(after) / abs(before) - 1.0 if before and before * after >= 0.0 else None


def holds_what_was(row: Change | Unchanged, index: int) -> bool | None:
    """Tell whether the interval of a quantity holds its first value, at one of its control signals; None without."""
    start, _, low, high = values_at(row, index)
    return None if start is None or low is None or high is None else low <= start <= high


class Changes(_Keyed):
    """What changed between two states of a damper, how sure that is, and what cannot be told apart."""

    verdict: Verdict
    from_: str = Field(alias="from")
    to: str
    compared: Literal["cycles", "model", "both"]
    difference: Difference
    changes: tuple[Change, ...]
    unchanged: tuple[Unchanged, ...]
    rivals: tuple[str, ...]
    reason: str
    next_test: NextTest | None = None


class CourseRow(_Keyed):
    """One quantity over the states."""

    name: str
    parameter: str
    unit: str
    values: tuple[Numbers, ...]
    low95: tuple[Numbers, ...]
    high95: tuple[Numbers, ...]
    at_voltage_V: tuple[float, ...] | None = None
    limits: tuple[float, float] | None = None
    """Smallest and largest value of the tolerance; None without one."""
    pass_: bool | None = Field(default=None, alias="pass")
    """Whether every state lies within the limits; None where there are none, or where an interval crosses one."""

    def within(self, state: int) -> bool | None:
        """Return whether the interval of a state lies within the limits; None where it crosses one or none is known."""
        if self.limits is None:
            return None
        low, high = (_listed(column[state]) for column in (self.low95, self.high95))
        if not low or not high:
            return None
        if all(self.limits[0] <= least for least in low) and all(most <= self.limits[1] for most in high):
            return True
        outside = [most < self.limits[0] or least > self.limits[1] for least, most in zip(low, high, strict=True)]
        return False if any(outside) else None


def _listed(values: Numbers) -> list[float]:
    """Return the numbers of a value; none where one is undetermined."""
    given = values if isinstance(values, tuple) else (values,)
    known = [value for value in given if value is not None]
    return known if len(known) == len(given) else []


class Course(_Keyed):
    """What changed over more than two states, each against the first."""

    verdict: Verdict
    from_: str = Field(alias="from")
    to: str
    states: tuple[str, ...]
    compared: Literal["cycles", "model", "both"]
    difference: Difference
    """Between the first state and the last."""
    over: tuple[CourseRow, ...]
    unchanged: tuple[Unchanged, ...]
    rivals: tuple[str, ...]
    reason: str
    next_test: NextTest | None = None
    pass_: bool | None = Field(default=None, alias="pass")
