"""Every ride in one artefact: the window of each road, and the numbers that are taken in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from pzd.artefacts import (
    AXLE_COLUMNS,
    Ending,
    FoundRow,
    Response,
    Ride,
    RideRow,
    Rides,
    SpectrumRow,
    SummaryRow,
    WeightedRow,
    WheelRow,
)
from pzd.comfort.iso2631_1997 import evaluate, maximum_transient
from pzd.comfort.spectrum import Components, harmonics, third_octaves
from pzd.comfort.weighting import WK, weighted
from pzd.record import Array
from pzd.signals.measures import rms
from pzd.simulate.config import SimulateConfig
from pzd.simulate.ride.outcome import (
    POINT,
    Event,
    Outcome,
    Pieces,
    Rows,
    Window,
    event_of,
    longest_piece,
    of_event,
    ride_of,
    settled,
    summary_row,
    wheel_rows,
)
from pzd.simulate.ride.riding import Clock, Held, Take
from pzd.simulate.roads.sine import Sine
from pzd.simulate.study.plan import Case

# ----------------------------------------------------------------------------------------------------
# What the passenger feels of a ride, from every step: weighted measures, and what the vibration is made of.


_PERIODIC = 0.98
"""Share of the mean square that the harmonics of the road must carry for the ride to count as periodic."""
_TONE = 0.999
"""Share of the mean square in one harmonic that makes a ride a tone."""


@dataclass(frozen=True)
class Vibration:
    """The weighted measures of a ride, and its components."""

    weighted: WeightedRow
    spectrum: tuple[SpectrumRow, ...]


def vibration(
    case: str, point: str, acceleration: Array, step: float, window: Window, fundamental: float | None, lead: int = 0
) -> Vibration:
    """Weight the whole ride from its start, then keep the window.

    Parameters
    ----------
    case, point : of the ride
    acceleration : (m,) of the whole ride from rest, at every step [m/s2]
    step : [s]
    window : in which the ride is judged
    fundamental : frequency of the road, None where it is not harmonic [Hz]
    lead : steps before the window into which the running r.m.s. of its first second reaches

    Returns
    -------
    what the passenger feels
    """
    rate = 1.0 / step
    history = weighted(acceleration, rate)
    found = evaluate(history[window.steps], rate)
    row = WeightedRow(
        case=case,
        point=point,
        weighting=WK.name,
        duration_s=found.duration,
        a_w_m_per_s2=found.a_w,
        peak_m_per_s2=found.peak,
        MTVV_m_per_s2=maximum_transient(history[window.first - lead : window.last + 1], rate) if lead else found.mtvv,
        VDV_m_per_s1_75=found.vdv,
    )
    parts, method = components(acceleration[window.steps], rate, fundamental)
    spectrum = tuple(
        SpectrumRow(case=case, point=point, method=method, frequency_Hz=float(f), rms_m_per_s2=float(level))
        for f, level in zip(parts.frequency, parts.rms, strict=True)
    )
    return Vibration(row, spectrum)


def components(acceleration: Array, rate: float, fundamental: float | None) -> tuple[Components, str]:
    """What an acceleration is made of, and how that was found.

    Parameters
    ----------
    acceleration : (n,) in the window [m/s2]
    rate : [Hz]
    fundamental : frequency of the road, None where it is not harmonic [Hz]

    Returns
    -------
    harmonics of the road where they carry the motion, else third-octave bands; and which
    """
    if fundamental is None or acceleration.size * fundamental < rate:  # less than one period
        return third_octaves(acceleration, rate), "third-octave bands"
    parts = harmonics(acceleration, rate, fundamental)
    if parts.share < _PERIODIC:
        return third_octaves(acceleration, rate), "third-octave bands, since the ride does not repeat with the road"
    total = rms(acceleration - np.mean(acceleration))
    tone = total > 0.0 and float(parts.rms.max()) ** 2 >= _TONE * total**2
    return parts, "a tone at its own frequency" if tone else "harmonic by harmonic"


# ----------------------------------------------------------------------------------------------------


_DEMANDED, _VOLTAGE = AXLE_COLUMNS[-2:]


@dataclass(frozen=True, eq=False)
class RideRows:
    """One ride as the artefact holds it: its history, and a row or more of each table."""

    ride: Ride
    summary: SummaryRow
    ridden: RideRow
    wheels: tuple[WheelRow, ...]
    weighted: WeightedRow
    spectrum: tuple[SpectrumRow, ...]
    found: tuple[FoundRow, ...]


def rows_of_ride(
    config: SimulateConfig, case: Case, held: Held, outcome: Outcome, window: Window, ending: Ending, voltage: bool
) -> RideRows:
    """Take the numbers of a ride in its window.

    Parameters
    ----------
    config : the block
    case, held, outcome : what was ridden, what it held constant, and how it went
    window, ending : in which it is judged, and how its motion ends
    voltage : whether the rig has a control signal
    """
    rows = _in_window(config, case, outcome, window)
    return _of_rows(config, case, held, outcome, window, ending, voltage, rows)


def _in_window(config: SimulateConfig, case: Case, outcome: Outcome, window: Window, lead: int | None = None) -> Rows:
    """The numbers of a ride, or of a piece of it, in a window."""
    name = case.name
    fundamental = case.road.frequency_Hz if isinstance(case.road, Sine) else None
    felt = vibration(name, POINT, outcome.comfort, outcome.step, window, fundamental, lead or 0)
    bands = felt.spectrum
    if lead is not None and fundamental is not None:
        bands = vibration(name, POINT, outcome.comfort, outcome.step, window, None).spectrum
    return (
        summary_row(name, case.road.name, case.policy.name, case.fidelity, outcome, window),
        tuple(wheel_rows(name, outcome, window, config.car.car().static_loads())),
        felt.weighted,
        felt.spectrum,
        bands,
    )


def _of_rows(
    config: SimulateConfig,
    case: Case,
    held: Held,
    outcome: Outcome,
    window: Window,
    ending: Ending,
    voltage: bool,
    rows: Rows,
) -> RideRows:
    summary, wheels, felt, spectrum, _ = rows
    return RideRows(
        ride_of(case.name, outcome, _left_out(case, voltage)),
        summary,
        _ride_row(config, case, held, outcome.step, window, ending, voltage),
        tuple(wheels),
        felt,
        tuple(spectrum),
        tuple(_found_rows(case.name, held)),
    )


class Gathering:
    """Rides are judged as soon as their window is known, and then forgotten but for their histories.

    On a road that goes on and on that is at once, and a long ride is judged piece by piece while it goes. Those over a
    single event wait for each other, since they are judged over the same time.
    """

    def __init__(self, config: SimulateConfig, with_voltage: bool) -> None:
        """Gather the rides of a config, on a rig with a control signal or without one."""
        self._config, self._with_voltage = config, with_voltage

    def of_ride(
        self, case: Case, ridden: Callable[[Case, Take | None], tuple[Held, Outcome]]
    ) -> RideRows | tuple[Held, Outcome]:
        """Ride a case, and judge it unless it goes over a single event.

        Parameters
        ----------
        case : the case
        ridden : rides it, see `Setup.ridden`
        """
        if event_of(case.road, self._config) is not None:
            return ridden(case, None)
        clock = Clock.of(self._config)
        window = settled(self._config.settle_s, clock.step, clock.steps)
        if clock.steps < longest_piece(clock.step) or case.policy.tuned == "schedule":
            held, outcome = ridden(case, None)
            return rows_of_ride(self._config, case, held, outcome, window, "end of the ride", self._with_voltage)
        pieces = Pieces(window.first, clock.step, partial(_in_window, self._config, case))
        held, outcome = ridden(case, pieces.take)
        rows = pieces.joined(outcome)
        return _of_rows(self._config, case, held, outcome, window, "end of the ride", self._with_voltage, rows)

    def all(
        self,
        planned: Sequence[Case],
        rides: Sequence[RideRows | tuple[Held, Outcome]],
        responses: tuple[Response, ...],
    ) -> Rides:
        """The artefact of the stage.

        Parameters
        ----------
        planned : the cases
        rides : of each case what `of_ride` gave
        responses : to a step of the voltage

        Returns
        -------
        histories, and a row or more of each table a case
        """
        every = {case.name: ride for case, ride in zip(planned, rides, strict=True) if isinstance(ride, RideRows)}
        for road in self._config.roads:
            over = [(c, r) for c, r in zip(planned, rides, strict=True) if c.road.name == road.name]
            event = event_of(road, self._config)
            if event is not None and over:
                every |= self._over_event(event, [(c, *ride) for c, ride in over if not isinstance(ride, RideRows)])
        found = [every[case.name] for case in planned]
        return Rides(
            tuple(one.ride for one in found if one.ridden.history != "none"),
            tuple(one.summary for one in found),
            tuple(one.ridden for one in found),
            tuple(row for one in found for row in one.wheels),
            tuple(one.weighted for one in found),
            tuple(row for one in found for row in one.spectrum),
            responses,
            tuple(row for one in found for row in one.found),
        )

    def _over_event(self, event: Event, ridden: Sequence[tuple[Case, Held, Outcome]]) -> dict[str, RideRows]:
        """All rides over the single event of one road, judged over the same time."""
        window, endings = of_event(event, ridden[0][2].step, [outcome.comfort for _, _, outcome in ridden])
        return {
            case.name: rows_of_ride(self._config, case, held, outcome, window, ending, self._with_voltage)
            for (case, held, outcome), ending in zip(ridden, endings, strict=True)
        }


def _found_rows(case: str, held: Held) -> Iterator[FoundRow]:
    """The best found schedule, an interval a row, or the policy that none beats."""
    if held.found is None:
        return
    found = held.found
    intervals: list[tuple[float | None, ...]] = [(None, None, None)]
    if found.voltages:
        count = len(found.voltages[0])
        intervals = [(n / count, one, two) for n, (one, two) in enumerate(zip(*found.voltages, strict=True))]
    for share, one, two in intervals:
        yield FoundRow(
            case=case,
            found_by=found.by,
            evaluations=found.evaluations,
            most_load_N=found.most_load,
            from_share_of_period=share,
            voltage_1_V=one,
            voltage_2_V=two,
        )


def _left_out(case: Case, with_voltage: bool) -> tuple[str, ...]:
    """Columns of the history that mean nothing in this case."""
    without = (_VOLTAGE,) if case.fidelity == "ideal" or not with_voltage else ()
    return without + ((_DEMANDED,) if case.policy.aim in ("voltage", "schedule") else ())


def _ride_row(
    config: SimulateConfig, case: Case, held: Held, step: float, window: Window, ending: Ending, with_voltage: bool
) -> RideRow:
    aim = case.policy.aim
    return RideRow(
        case=case.name,
        from_s=window.first * step,
        to_s=window.last * step,
        ending=ending,
        voltage_V=held.voltage if aim == "voltage" and with_voltage else None,
        damping_Ns_per_m=held.damping if aim == "damping" else None,
        history=config.histories,
    )
