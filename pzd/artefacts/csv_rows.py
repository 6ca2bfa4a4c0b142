"""Rows of CSV artefacts: their condition, estimates with 95 % intervals, and the files that hold them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Self

from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.errors import supported
from pzd.schema.model import Frozen

Condition = tuple[str | None, float | None, float | None]
"""Setting, control signal [V] and temperature [degC]; None where the rig has none."""


class Estimate(NamedTuple):
    """A value with its 95 % interval; in files three columns, `NAME`, `NAME_low95` and `NAME_high95`.

    >>> Estimate(1234.5678, 1200.0, 1260.0).columns("C_Ns_per_m")
    {'C_Ns_per_m': 1234.5678, 'C_Ns_per_m_low95': 1200.0, 'C_Ns_per_m_high95': 1260.0}
    """

    value: float | None
    """None where the data do not determine it."""
    low95: float | None = None
    """None where nobody fitted the value, as after an edit, or where there is no end."""
    high95: float | None = None

    @classmethod
    def of(cls, row: object, name: str) -> Self:
        """Return the estimate in the columns of a row; without an interval where the row has no such columns."""
        return cls(getattr(row, name), getattr(row, f"{name}_low95", None), getattr(row, f"{name}_high95", None))

    @classmethod
    def around(cls, value: float, half_width: float) -> Self:
        """Return an estimate whose interval reaches equally far to both sides."""
        return cls(value, value - half_width, value + half_width)

    def columns(self, name: str) -> dict[str, Any]:
        """Return the three columns of a file under which the estimate is written."""
        return {name: self.value, f"{name}_low95": self.low95, f"{name}_high95": self.high95}

    @property
    def interval(self) -> tuple[float, float] | None:
        """Both ends of the interval; None where one is missing."""
        return None if self.low95 is None or self.high95 is None else (self.low95, self.high95)

    def digits(self) -> tuple[str, ...]:
        """Return value and interval as text, to the second digit of the width of the interval.

        >>> Estimate(301.23456, 300.71, 301.77).digits()
        ('301.2', '300.7', '301.8')
        """
        if self.value is None:
            return ()
        if self.interval is None:
            return (f"{self.value:.4g}",)
        low, high = self.interval
        return tuple(supported(each, low, high) for each in (self.value, low, high))


class ConditionRow(Frozen):
    """A row about one condition of the rig."""

    setting: str | None
    voltage_V: float | None
    """Of the condition, as in `parameters.csv`; None where the control signal moves or there is none."""
    temperature_degC: float | None

    @property
    def condition(self) -> Condition:
        """Setting, control signal and temperature."""
        return self.setting, self.voltage_V, self.temperature_degC

    def words(self, control: Control, rig: str = "") -> str:
        """Return the condition in words, with another word for the setting where the rig has none."""
        parts = [self.setting or rig]
        parts += [f"{self.voltage_V:.4g} {control.unit}"] if self.voltage_V is not None else []
        parts += [f"{self.temperature_degC:.4g} degC"] if self.temperature_degC is not None else []
        return ", ".join(filter(None, parts))


class RecordRow(Frozen):
    """A row about one test of a record, at the condition of that test.

    Not a `ConditionRow`, whose fields would stand before `record`: columns of files have the order of the fields.
    """

    record: str
    setting: str | None
    voltage_V: float | None
    """Of the condition, as in `parameters.csv`; None where the control signal moves or there is none."""
    temperature_degC: float | None

    @property
    def condition(self) -> Condition:
        """Setting, control signal and temperature."""
        return self.setting, self.voltage_V, self.temperature_degC


Files = Mapping[str, tuple[str, type[Frozen]]]
"""The name of a CSV file and the model of its rows, by the field of the artefact that holds them."""


def write_files(artefact: object, files: Files, folder: Path, control: Control) -> None:
    """Write the rows of an artefact, one file for each of its fields."""
    for field, (name, model) in files.items():
        write_rows(folder / name, model, getattr(artefact, field), control)


def read_files(files: Files, folder: Path, control: Control, optional: Collection[str] = ()) -> dict[str, Any]:
    """Read and check the rows that `write_files` wrote.

    Parameters
    ----------
    files : of the artefact
    folder : of its stage
    control : the control signal, which names columns
    optional : fields whose file may be missing, for instance because an earlier version wrote none

    Returns
    -------
    the rows by field, in the order of the file
    """
    return {
        field: () if field in optional and not (folder / name).is_file() else read_rows(folder / name, model, control)
        for field, (name, model) in files.items()
    }
