"""The numbers that the paper prints, each with its id: measured, identified, simulated, stated, claimed, and inputs."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import as_file, files

from pzd.damper.model import BaseRow
from pzd.quantities import Control
from pzd.schema.csvfile import read_rows
from pzd.schema.model import Frozen

SMALL_GAP, LARGE_GAP = "gap 0.15 mm", "gap 0.25 mm"
"""The two settings of the valve that the paper tested."""
PEAK, AT_ZERO = "peak_force", "force_at_zero_velocity"
"""Quantities that a test of the damper gives."""
TABLES = {"Table 1": (SMALL_GAP, 22.0), "Table 2": (LARGE_GAP, 22.0), "Table 3": (LARGE_GAP, 43.0)}
"""Setting and temperature of each table of identified parameters."""


class Published(Frozen):
    """One number of the paper."""

    id: str
    """Figure or table and condition, e.g. `F4-100`, `T2-150-C`."""
    kind: str
    """`measured`, `identified`, `simulated`, `stated`, `input` or `claim`."""
    figure_or_table: str
    setting: str | None
    voltage_V: float | None
    temperature_C: float | None
    frequency_Hz: float | None
    amplitude_m: float | None
    quantity: str
    value: float | str
    """As printed; a range is text."""
    unit: str
    note: str

    @property
    def number(self) -> float:
        """The value of a row that holds one number.

        Raises
        ------
        ValueError : when it is a range
        """
        if isinstance(self.value, str):
            raise ValueError(f"{self.id} is no single number (got {self.value})")  # noqa: TRY004  # a wrong id
        return self.value

    @property
    def same_test(self) -> tuple[object, ...]:
        """What two rows share that tell of one test; 22 and 23 degC count as one."""
        warm = self.temperature_C is not None and self.temperature_C > WARM_DEGC
        return self.quantity, self.setting, self.voltage_V, warm, self.frequency_Hz, self.amplitude_m


WARM_DEGC = 30.0
"""Above this a test counts as the warm one of 43 degC [degC]."""


@cache
def published() -> Mapping[str, Published]:
    """Every published number by its id, in the order of the file."""
    with as_file(files("pzd.paper").joinpath("published.csv")) as path:
        return {row.id: row for row in read_rows(path, Published, Control())}


def rig_tests() -> tuple[Published, ...]:
    """The measured forces of Figures 4, 5, 6, 8 and 9."""
    return tuple(row for row in published().values() if row.quantity in (PEAK, AT_ZERO))


def table_damper(table: str) -> tuple[BaseRow, ...]:
    """The parameters of one of the paper's tables, by voltage.

    Parameters
    ----------
    table : `Table 1`, `Table 2` or `Table 3`
    """
    rows = [row for row in published().values() if row.figure_or_table == table]
    voltages = sorted({row.voltage_V or 0.0 for row in rows})
    by = {(row.voltage_V or 0.0, row.quantity): row.number for row in rows}
    return tuple(BaseRow(voltage_V=u, T0_N=by[u, "T0"], C_Ns_per_m=by[u, "C"], k_N_per_m=by[u, "k"]) for u in voltages)


def span(row: Published) -> tuple[float, float]:
    """Smallest and largest number that the paper prints for the test of this row."""
    values = [other.number for other in rig_tests() if other.same_test == row.same_test]
    return min(values), max(values)
