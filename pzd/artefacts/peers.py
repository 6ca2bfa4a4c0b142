"""What `pzd peers` finds: the damper handed on beside published models, on tests that no fit has seen."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field

from pzd.quantities import Control
from pzd.schema.csvfile import write_rows
from pzd.schema.model import Frozen

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
