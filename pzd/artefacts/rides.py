"""Artefact of simulate: the rides of the half-car, their summaries, and the response of the damper to a step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal, Self

from pzd.artefacts.csv_rows import Files, read_files, write_files
from pzd.parallel.processes import parallel_map
from pzd.quantities import Control
from pzd.record import Array
from pzd.schema.csvfile import read_columns, read_parquet, write_columns, write_parquet
from pzd.schema.model import Frozen

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


Ending = Literal[
    "end of the ride", "motion died away", "motion falls no further", "ride over before the motion died away"
]


History = Literal["csv", "parquet", "none"]
"""How the history of a ride is written, if it is."""


class SummaryRow(Frozen):
    """One ride in one line; all but the last two columns are taken over its window, see `RideRow`."""

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
    """Of the whole ride, as a share of the energy that flows."""
    outside_table: float
    """Share of the whole ride in which a damper moves faster, or farther from the middle, than the rig did."""


class RideRow(Frozen):
    """The window in which the numbers of a ride are taken, and what its policy held constant."""

    case: str
    from_s: float
    """The settling time; on a single event, when axle 1 meets it."""
    to_s: float
    """The end of the ride; on a single event, when the motion of every ride over it has died away, or falls no
    further."""
    ending: Ending
    """How the motion of this ride ends."""
    voltage_V: float | None
    """Of a policy that holds one voltage."""
    damping_Ns_per_m: float | None
    """Of a policy that asks for one damping coefficient, per axle."""
    history: History
    """The file of its history, beside this one."""


class WheelRow(Frozen):
    """Contact force between the wheels of one axle and the road, in the window of the ride."""

    case: str
    axle: int
    static_load_N: float
    rms_dynamic_load_N: float
    """R.m.s. of the force about the static load."""
    min_contact_force_N: float
    """Smallest force; below 0 the wheel would leave the road, and one without mass pulls on it instead."""
    pulling: float
    """Share of the time in which the force is 0 or below; a wheel with mass is then off the road."""


class WeightedRow(Frozen):
    """The frequency-weighted acceleration of a ride, from every step in its window."""

    case: str
    point: str
    weighting: str
    duration_s: float
    a_w_m_per_s2: float
    peak_m_per_s2: float
    MTVV_m_per_s2: float
    VDV_m_per_s1_75: float


class SpectrumRow(Frozen):
    """One component of the unweighted acceleration of a ride, from every step in its window."""

    case: str
    point: str
    method: str
    """How the components were found."""
    frequency_Hz: float
    rms_m_per_s2: float


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
    note: str
    """Why the force may be there before the voltage; empty otherwise."""


class FoundRow(Frozen):
    """One interval of the best found schedule of voltages on a periodic road, or the policy that none of them beats."""

    case: str
    found_by: str
    """`search`, or the policy."""
    evaluations: int
    """Short rides that the search took."""
    most_load_N: float
    """Largest r.m.s. wheel load that was admitted."""
    from_share_of_period: float | None
    """Where the interval begins, from where axle 1 meets the rising zero of the road."""
    voltage_1_V: float | None
    voltage_2_V: float | None


@dataclass(frozen=True, eq=False)
class Rides:
    """Every ride, its summary, and how quickly the damper responds to a step of voltage."""

    folder: ClassVar[str] = "5-simulate"

    rides: tuple[Ride, ...] = ()
    """Those whose history is written."""
    summary: tuple[SummaryRow, ...] = ()
    ridden: tuple[RideRow, ...] = ()
    wheels: tuple[WheelRow, ...] = ()
    weighted: tuple[WeightedRow, ...] = ()
    spectrum: tuple[SpectrumRow, ...] = ()
    responses: tuple[Response, ...] = ()
    found: tuple[FoundRow, ...] = ()

    def write(self, folder: Path, control: Control, jobs: int = 1) -> None:
        """Write the history of each case, so many at the same time, and one table of each kind over all cases."""
        history = {row.case: row.history for row in self.ridden}

        def written(ride: Ride) -> None:
            path = folder / f"{ride.case}.{history[ride.case]}"
            if history[ride.case] == "csv":
                write_columns(path, ride.columns, control, _RIDE_HEADER)
            else:
                write_parquet(path, ride.columns, control)

        parallel_map(written, self.rides, jobs)
        write_files(self, RIDES, folder, control)
        if self.found:
            write_files(self, FOUND, folder, control)

    @classmethod
    def read(cls, folder: Path, control: Control, jobs: int = 1) -> Self:
        """Read and check them again, so many at the same time."""

        def ride(row: RideRow) -> Ride:
            read = read_columns if row.history == "csv" else read_parquet
            return Ride(row.case, read(folder / f"{row.case}.{row.history}", _RIDE_HEADER, control, _RIDE_OPTIONAL))

        rows = read_files(RIDES, folder, control)
        kept = [row for row in rows["ridden"] if row.history != "none"]
        found = read_files(FOUND, folder, control, optional=FOUND)
        return cls(tuple(parallel_map(ride, kept, jobs)), **rows, **found)

    def untrusted(self, _: Control) -> tuple[str, ...]:
        """Return why the result is not to be trusted (exit 4): rides whose energy balance does not close."""
        return tuple(
            f"{row.case}: energy error {row.energy_error:.1e}, above {ENERGY_LIMIT:g}"
            for row in self.summary
            if not abs(row.energy_error) <= ENERGY_LIMIT
        )


ENERGY_LIMIT = 1e-6
"""Largest error of the energy balance, as a share of the dissipated energy."""

RIDES: Files = {
    "summary": ("summary.csv", SummaryRow),
    "ridden": ("rides.csv", RideRow),
    "wheels": ("wheels.csv", WheelRow),
    "weighted": ("weighted.csv", WeightedRow),
    "spectrum": ("spectrum.csv", SpectrumRow),
    "responses": ("response.csv", Response),
}
FOUND: Files = {"found": ("best_found.csv", FoundRow)}
