"""Every ride of the half-car, and its summary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Literal, Self

from pzd.quantities import Control
from pzd.record import Array
from pzd.schema.csvfile import read_columns, read_rows, write_columns, write_rows
from pzd.schema.model import Frozen
from pzd.schema.processes import parallel_map

RIDE_COLUMNS = ("time_s", "z_m", "phi_rad", "a_K_m_per_s2")
AXLE_COLUMNS = (
    "deflection_{}_m",
    "deflection_rate_{}_m_per_s",
    "spring_force_{}_N",
    "damper_force_{}_N",
    "demanded_force_{}_N",
    "voltage_{}_V",
)
AXLES = (1, 2)
_RIDE_HEADER = RIDE_COLUMNS + tuple(name.format(axle) for axle in AXLES for name in AXLE_COLUMNS)
_RIDE_OPTIONAL = tuple(name.format(axle) for axle in AXLES for name in AXLE_COLUMNS[-2:])


class SummaryRow(Frozen):
    """One ride in one line; peaks and r.m.s. are taken after `settle`."""

    case: str
    road: str
    policy: str
    fidelity: str
    point: str
    peak_abs_aK_m_per_s2: float
    rms_aK_m_per_s2: float
    rms_jerk_m_per_s3: float
    """R.m.s. of the jerk at K behind an 80 Hz low-pass."""
    peak_deflection_m: float
    rms_wheel_load_N: float
    """R.m.s. of the dynamic wheel load, the larger of the two axles."""
    dissipated_J: float
    energy_error: float
    outside_table: float
    """Share of the ride spent beyond what the rig reached."""


@dataclass(frozen=True, eq=False)
class Ride:
    """The history of one case; every column is (n,) under its name in `RIDE_COLUMNS` and `AXLE_COLUMNS`."""

    case: str
    columns: Mapping[str, Array]


class Response(Frozen):
    """Times to 63 and 90 % of a step at constant speed [s], of one signal."""

    signal: Literal["voltage", "force"]
    from_voltage_V: float
    to_voltage_V: float
    velocity_m_per_s: float
    to_63_percent_s: float | None
    to_90_percent_s: float | None


@dataclass(frozen=True, eq=False)
class Rides:
    """Every ride, its summary, and how quickly the damper answers a step of voltage."""

    folder: ClassVar[str] = "5-simulate"

    rides: tuple[Ride, ...]
    summary: tuple[SummaryRow, ...]
    responses: tuple[Response, ...] = field(default=())

    def write(self, folder: Path, control: Control, jobs: int = 1) -> None:
        """Write one CSV a case, so many at the same time, summary.csv and response.csv."""

        def written(ride: Ride) -> None:
            columns = {name: ride.columns.get(name) for name in _RIDE_HEADER}
            write_columns(folder / f"{ride.case}.csv", columns, control)

        parallel_map(written, self.rides, jobs)
        write_rows(folder / "summary.csv", SummaryRow, self.summary, control)
        write_rows(folder / "response.csv", Response, self.responses, control)

    @classmethod
    def read(cls, folder: Path, control: Control, jobs: int = 1) -> Self:
        """Read and check them again, so many at the same time."""

        def ride(row: SummaryRow) -> Ride:
            return Ride(row.case, read_columns(folder / f"{row.case}.csv", _RIDE_HEADER, control, _RIDE_OPTIONAL))

        summary = read_rows(folder / "summary.csv", SummaryRow, control)
        rides = tuple(parallel_map(ride, summary, jobs))
        return cls(rides, summary, read_rows(folder / "response.csv", Response, control))

    def untrusted(self, _: Control) -> tuple[str, ...]:
        """Why the result is not to be trusted (exit 4): rides whose energy balance does not close."""
        return tuple(
            f"{row.case}: energy error {row.energy_error:.1e}, above {ENERGY_LIMIT:g}"
            for row in self.summary
            if not abs(row.energy_error) <= ENERGY_LIMIT
        )


ENERGY_LIMIT = 1e-6
"""Largest error of the energy balance, as a share of the dissipated energy."""
