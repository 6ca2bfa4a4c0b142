"""What is left of the force where the verdict is `unexplained`, as shapes that predict it: told, never adopted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Self

from pydantic import Field

from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.model import Frozen


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
