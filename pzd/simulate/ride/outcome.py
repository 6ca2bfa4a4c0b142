"""What a ride comes to: its history, the window in which it is judged, and the numbers taken from every step in it."""

from __future__ import annotations

import math
import operator
import tempfile
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from typing_extensions import override

from pzd.artefacts import (
    AXLE_COLUMNS,
    AXLES,
    RIDE_COLUMNS,
    Ending,
    Ride,
    SpectrumRow,
    SummaryRow,
    WeightedRow,
    WheelRow,
)
from pzd.comfort.iso2631_1997 import INTEGRATION_TIME_S
from pzd.comfort.weighting import MEMORY_S, weighted
from pzd.record import Array
from pzd.schema.model import Frozen
from pzd.signals.measures import rms
from pzd.signals.noise import all_pole
from pzd.simulate.config import SimulateConfig
from pzd.simulate.ride.loop import A_K, COLUMNS, LOAD_1, LOAD_2, LOST, TRAVEL
from pzd.simulate.roads import Road

Row = TypeVar("Row", bound=Frozen)

# --- The part of a ride in which its numbers are taken: settled motion, or an event until it has died away ---

DIED_AWAY = 0.01
"""A motion has died away where the acceleration stays below this share of its peak."""
FALLS = 0.9
"""A motion falls no further where its peak in a second is above this share of that in the second before. An
identified damper is elastic below its friction, and nothing else in this car damps: the body goes on
swinging on the oil stiffnesses."""
_SECOND = 1.0
"""Length of the intervals whose peaks are compared [s]."""


@dataclass(frozen=True)
class Window:
    """Steps of a ride, both ends included."""

    first: int
    last: int

    @property
    def steps(self) -> slice:
        """The steps of the ride."""
        return slice(self.first, self.last + 1)


@dataclass(frozen=True)
class Event:
    """When a single event is under the wheels."""

    entry: float
    """When axle 1 meets it [s]."""
    exit: float
    """When axle 2 has left it [s]."""


def event_of(road: Road, config: SimulateConfig) -> Event | None:
    """Return the single event of a road; None on a road that goes on and on."""
    if road.event is None:
        return None
    (begins, ends), speed = road.event, config.vehicle_speed
    return Event(begins / speed, (ends + config.car.car().wheelbase) / speed)


def settled(settle: float, step: float, steps: int) -> Window:
    """Return the window from the settling time [s] to the end of a ride, by length [s] and number of its steps."""
    return Window(round(settle / step), steps)


def of_event(event: Event, step: float, accelerations: Sequence[Array]) -> tuple[Window, tuple[Ending, ...]]:
    """Return the window from the entry of axle 1 until the motion has died away in every ride over the same event.

    One window for all, since an r.m.s. over a longer window is smaller: rides are compared over the same time.

    Parameters
    ----------
    event : when it is under the wheels
    step : of the rides [s]
    accelerations : of each ride (m,) at K at every step [m/s2]

    Returns
    -------
    the window, and how the motion of each ride ends
    """
    found = [_end(acceleration, event, step) for acceleration in accelerations]
    last = max(end for end, _ in found)
    return Window(int(event.entry / step), last), tuple(ending for _, ending in found)


def _end(acceleration: Array, event: Event, step: float) -> tuple[int, Ending]:
    """Find the step at which the motion has died away, a whole number of seconds behind the event, and how it ends."""
    size = np.abs(acceleration)
    peak, second = float(np.max(size)), round(_SECOND / step)
    start, before = round(event.exit / step), np.inf
    while start + second < size.size:
        now = float(np.max(size[start : start + second]))
        if now <= DIED_AWAY * peak:
            return start, "motion died away"
        if now > FALLS * before:
            return start, "motion falls no further"
        start, before = start + second, now
    return size.size - 1, "ride over before the motion died away"


# --- The history and the course of a ride ---

POINT = "K"
"""The point of the car at which comfort is judged."""

VOLTAGES = [len(RIDE_COLUMNS) + (axle + 1) * len(AXLE_COLUMNS) - 1 for axle in range(len(AXLES))]
"""Columns of the history with the voltage of each axle."""

JERK_CORNER = 80.0
"""Corner of the low-pass behind which the jerk is taken [Hz]: the raw jerk of a law that switches has no r.m.s."""
_POLES = (math.pi / 8, 3 * math.pi / 8)
"""Angles of the pairs of poles of the fourth order off the negative real axis (Butterworth 1930)."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """One ride, computed."""

    history: Array | SpilledRows
    """(n, 16) rows thinned to the rate of output, columns as in the artefact `Ride`; in a file where the ride was taken
    piece by piece."""
    course: Array
    """(m, COURSE_COLUMNS) what is kept of every step, see `pzd.simulate.ride.loop`."""
    step: float
    """Length of a step [s]."""
    outside: float
    """Share of the ride in which a damper moves faster than the rig did."""
    energy_error: float
    """See `balance_error`."""

    @property
    def comfort(self) -> Array:
        """(m,) acceleration at K at every step [m/s2]."""
        return self.course[:, A_K]

    @property
    def loads(self) -> Array:
        """(m, 2) what each axle takes off the road's static load at every step [N]: S + T of wheels without mass."""
        return self.course[:, LOAD_1 : LOAD_2 + 1]


class SpilledRows:
    """Rows of the history of a long ride in a nameless temporary file, gone with this object.

    What a ride keeps in memory does not grow with its length.
    """

    def __init__(self, columns: int) -> None:
        """Begin a history of so many columns."""
        self._file = tempfile.TemporaryFile(prefix="pzd-ride-")  # noqa: SIM115  # it lives as long as the rows
        weakref.finalize(self, self._file.close)
        self._columns, self._rows = columns, 0

    def add(self, rows: Array) -> None:
        """Add (m, columns) rows behind those so far."""
        self._file.write(np.ascontiguousarray(rows).tobytes())
        self._file.flush()
        self._rows += len(rows)

    def column(self, number: int) -> Array:
        """Return one column (n,), mapped from the file: pages that nobody reads take no memory."""
        if self._rows == 0:
            return np.zeros(0)
        return np.memmap(self._file, np.float64, "r", shape=(self._rows, self._columns))[:, number]


class SpilledColumns(Mapping[str, Array]):
    """Named columns of such rows, each mapped anew when it is read, so that nothing stays in memory."""

    def __init__(self, rows: SpilledRows, numbers: Mapping[str, int]) -> None:
        """Take the rows, and the number of each column."""
        self._rows, self._numbers = rows, numbers

    @override
    def __getitem__(self, name: str) -> Array:
        return self._rows.column(self._numbers[name])

    @override
    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)

    @override
    def __len__(self) -> int:
        return len(self._numbers)


# --- The numbers of a ride in its window ---


def low_passed_jerk(acceleration: Array, step: float) -> Array:
    """Return the jerk behind a low-pass of 80 Hz (Butterworth, fourth order).

    Parameters
    ----------
    acceleration : (n,) at every step [m/s2]
    step : [s]

    Returns
    -------
    (n,) jerk [m/s3]
    """
    if 0.5 / step <= JERK_CORNER:
        return np.asarray(np.gradient(acceleration, step))
    warped = math.tan(math.pi * JERK_CORNER * step)
    smooth = acceleration - acceleration[0]
    for angle in _POLES:
        smooth = _low_passed(smooth, warped, 2.0 * math.cos(angle))
    return np.asarray(np.gradient(smooth + acceleration[0], step))


def _low_passed(values: Array, warped: float, damping: float) -> Array:
    """Filter (n,) values by one pair of poles, at rest before the first.

    Equation: H = W^2 / (s^2 + d W s + W^2), s = (1 - 1/z) / (1 + 1/z)      Source: bilinear transform, prewarped
    """
    square = warped * warped
    scale = 1.0 + damping * warped + square
    fed = np.convolve(values, np.array([1.0, 2.0, 1.0]) * square / scale)[: values.size]
    past = np.array([1.0, 2.0 * (square - 1.0) / scale, (1.0 - damping * warped + square) / scale])
    return all_pole(past, fed[:, np.newaxis])[:, 0]


def summary_row(case: str, road: str, policy: str, fidelity: str, outcome: Outcome, window: Window) -> SummaryRow:
    """Return the numbers of a ride that the summary has."""
    within = outcome.course[window.steps]
    lost = within[:, LOST]
    return SummaryRow(
        case=case,
        road=road,
        policy=policy,
        fidelity=fidelity,
        point=POINT,
        peak_abs_aK_m_per_s2=float(np.max(np.abs(within[:, A_K]))),
        rms_aK_m_per_s2=rms(within[:, A_K]),
        rms_jerk_m_per_s3=rms(low_passed_jerk(outcome.comfort, outcome.step)[window.steps]),
        peak_deflection_m=float(np.max(within[:, TRAVEL])),
        rms_wheel_load_N=max(rms(load) for load in outcome.loads[window.steps].T),
        dissipated_J=float(lost[-1] - lost[0]),
        energy_error=outcome.energy_error,
        outside_table=outcome.outside,
    )


def wheel_rows(case: str, outcome: Outcome, window: Window, static: tuple[float, float]) -> Iterator[WheelRow]:
    """Return the force between wheels and road, an axle a row.

    Equation: N_i = N_i0 - (S_i + T_i), N_i0 the static load        Source: balance of the massless wheel;
    where the wheels have mass N_i is the force of the tyre, see `pzd.simulate.vehicle.suspension`

    Parameters
    ----------
    case : name of the ride
    outcome : the ride
    window : in which it is judged
    static : static load of each axle [N], see `HalfCar.static_loads`
    """
    for axle, load, at_rest in zip(AXLES, outcome.loads[window.steps].T, static, strict=True):
        contact = at_rest - load
        yield WheelRow(
            case=case,
            axle=axle,
            static_load_N=at_rest,
            rms_dynamic_load_N=rms(load),
            min_contact_force_N=float(np.min(contact)),
            pulling=float(np.mean(contact <= 0.0)),
        )


def history_of(case: str, outcome: Outcome, without: tuple[str, ...]) -> Ride:
    """Return the history as the artefact holds it, without the columns that mean nothing in this ride."""
    names = RIDE_COLUMNS + tuple(name.format(axle) for axle in AXLES for name in AXLE_COLUMNS)
    left_out = {name.format(axle) for name in without for axle in AXLES}
    numbers, history = {name: n for n, name in enumerate(names) if name not in left_out}, outcome.history
    if isinstance(history, SpilledRows):
        return Ride(case, SpilledColumns(history, numbers))
    return Ride(case, {name: np.ascontiguousarray(history[:, n]) for name, n in numbers.items()})


# --- A long ride, judged piece by piece: what is kept of its steps does not grow with its length ---

PIECE_S = 120.0
"""Longest piece of a ride [s]: twelve waves of the lowest third-octave band. A shorter ride is one piece."""


class WindowRows(NamedTuple):
    """The numbers of a ride, or of a piece of it, in a window."""

    summary: SummaryRow
    wheels: tuple[WheelRow, ...]
    weighted: WeightedRow
    spectrum: tuple[SpectrumRow, ...]
    """As harmonics of the road where these carry the motion, else in third-octave bands."""
    bands: tuple[SpectrumRow, ...]
    """In third-octave bands."""


def longest_piece(step: float) -> int:
    """Return the steps of the longest piece, by their length [s]."""
    return max(round(PIECE_S / step), 1)


class Overlap:
    """The end of the pieces so far, as long as the weighting remembers."""

    def __init__(self, step: float) -> None:
        """Begin a ride of so long steps [s]."""
        self._steps = round(MEMORY_S / step)
        self._rows = np.zeros((0, 0))

    def with_piece(self, first: int, rows: Array) -> tuple[Array, int]:
        """Return rows (m, c) of the steps from `first` on behind those before, and the step of the first of all."""
        course = np.vstack([self._rows, rows]) if first > 0 else np.array(rows)
        self._rows = course[-min(self._steps, len(course)) :].copy()
        return course, first + len(rows) - len(course)


class MeanSquare:
    """The weighted r.m.s. of the acceleration at K from a step on, taken piece by piece."""

    def __init__(self, first: int, step: float) -> None:
        """Begin a ride that counts from a step on; length of a step [s]."""
        self._first, self._step, self._before = first, step, Overlap(step)
        self._sum, self._count = 0.0, 0

    def add(self, first: int, rows: Array) -> None:
        """Add (m, COURSE_COLUMNS) rows, of the steps from `first` on."""
        course, start = self._before.with_piece(first, rows)
        history = weighted(course[:, A_K], 1.0 / self._step)[max(self._first, first) - start :]
        self._sum, self._count = self._sum + float(history @ history), self._count + history.size

    def root(self) -> float:
        """Return the r.m.s. [m/s2]."""
        return math.sqrt(self._sum / max(self._count, 1))


class Pieces:
    """The numbers of a long ride, taken piece by piece, each with as much before it as the weighting remembers."""

    def __init__(self, settled: int, step: float, judge: Callable[[Outcome, Window, int], WindowRows]) -> None:
        """Begin a ride.

        Parameters
        ----------
        settled : the step from which it is judged
        step : [s]
        judge : (piece, its window, steps before it over which a running r.m.s. may reach) -> its rows
        """
        self._settled, self._step, self._judge = settled, step, judge
        self._before = Overlap(step)
        self._count = 0
        self._rows: WindowRows | None = None
        self._lost: tuple[float, float] = (math.nan, math.nan)

    def add(self, first: int, rows: Array) -> None:
        """Judge (m, COURSE_COLUMNS) rows, of the steps from `first` on; they may be changed afterwards."""
        course, start = self._before.with_piece(first, rows)
        window = Window(max(self._settled, first) - start, len(course) - 1)
        if window.first <= window.last:
            lost = course[window.steps, LOST]
            self._lost = (float(lost[0]) if self._rows is None else self._lost[0], float(lost[-1]))
            lead = min(round(INTEGRATION_TIME_S / self._step), max(first, self._settled) - self._settled)
            piece = Outcome(np.zeros((0, COLUMNS)), course, self._step, outside=0.0, energy_error=0.0)
            found, count = self._judge(piece, window, lead), window.last - window.first + 1
            self._rows = found if self._rows is None else _joined(self._rows, self._count, found, count)
            self._count += count

    def joined(self, outcome: Outcome) -> WindowRows:
        """Return the rows of the whole ride; the outcome has its energy balance."""
        if self._rows is None:
            raise ValueError("no step of the ride lies behind the settling time")
        whole = {
            "dissipated_J": self._lost[1] - self._lost[0],
            "energy_error": outcome.energy_error,
            "outside_table": outcome.outside,
        }
        return self._rows._replace(summary=self._rows.summary.model_copy(update=whole))


def _joined(one: WindowRows, n: int, other: WindowRows, m: int) -> WindowRows:
    """Join the rows of two pieces of n and m steps.

    Equation: r.m.s. = sqrt((n r_1^2 + m r_2^2) / (n + m)); VDV = (VDV_1^4 + VDV_2^4)^(1/4)
    """

    def mean_square(a: float, b: float) -> float:
        return math.sqrt((n * a * a + m * b * b) / (n + m))

    def share(a: float, b: float) -> float:
        return (n * a + m * b) / (n + m)

    def dose(a: float, b: float) -> float:
        return float((a**4 + b**4) ** 0.25)

    def row(a: Row, b: Row, **rules: Callable[[float, float], float]) -> Row:
        return a.model_copy(update={name: rule(getattr(a, name), getattr(b, name)) for name, rule in rules.items()})

    def spectrum(rows: Sequence[SpectrumRow], others: Sequence[SpectrumRow]) -> tuple[SpectrumRow, ...]:
        return tuple(row(a, b, rms_m_per_s2=mean_square) for a, b in zip(rows, others, strict=True))

    wheels = tuple(
        row(a, b, rms_dynamic_load_N=mean_square, min_contact_force_N=min, pulling=share)
        for a, b in zip(one.wheels, other.wheels, strict=True)
    )
    summary = row(
        one.summary,
        other.summary,
        peak_abs_aK_m_per_s2=max,
        rms_aK_m_per_s2=mean_square,
        rms_jerk_m_per_s3=mean_square,
        peak_deflection_m=max,
    ).model_copy(update={"rms_wheel_load_N": max(wheel.rms_dynamic_load_N for wheel in wheels)})
    weighted_row = row(
        one.weighted,
        other.weighted,
        duration_s=operator.add,
        a_w_m_per_s2=mean_square,
        peak_m_per_s2=max,
        MTVV_m_per_s2=max,
        VDV_m_per_s1_75=dose,
    )
    bands = spectrum(one.bands, other.bands)
    # a piece whose motion does not repeat with the road turns the whole ride into bands
    same = one.spectrum[0].method == other.spectrum[0].method
    return WindowRows(summary, wheels, weighted_row, spectrum(one.spectrum, other.spectrum) if same else bands, bands)
