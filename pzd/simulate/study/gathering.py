"""Every ride in one artefact: the window of each road, and the numbers that are taken in it."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pzd.artefacts import AXLE_COLUMNS, Ending, FoundRow, Response, Ride, RideRow, Rides, SpectrumRow, WeightedRow
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
    Window,
    WindowRows,
    event_of,
    history_of,
    longest_piece,
    of_event,
    settled,
    summary_row,
    wheel_rows,
)
from pzd.simulate.ride.riding import CourseSink, FixedValues, SearchResult, clock_of
from pzd.simulate.roads.sine import Sine
from pzd.simulate.study.plan import Case, drawn

log = logging.getLogger(__name__)

# --- Weighted measures of a ride, and what its vibration is made of ---

_PERIODIC = 0.98
"""Share of the mean square that the harmonics of the road must carry for the ride to count as periodic."""
_TONE = 0.999
"""Share of the mean square in one harmonic that makes a ride a tone."""


def weighted_row(case: str, acceleration: Array, rate: float, window: Window, lead: int = 0) -> WeightedRow:
    """Weight the whole ride from its start, and take its measures in the window.

    Parameters
    ----------
    case : name of the ride
    acceleration : (m,) at K of the whole ride from rest [m/s2]
    rate : of its steps [Hz]
    window : in which the ride is judged
    lead : steps before the window into which the running r.m.s. of its first second reaches
    """
    history = weighted(acceleration, rate)
    found = evaluate(history[window.steps], rate)
    return WeightedRow(
        case=case,
        point=POINT,
        weighting=WK.name,
        duration_s=found.duration,
        a_w_m_per_s2=found.a_w,
        peak_m_per_s2=found.peak,
        MTVV_m_per_s2=maximum_transient(history[window.first - lead : window.last + 1], rate) if lead else found.mtvv,
        VDV_m_per_s1_75=found.vdv,
    )


def spectrum_rows(case: str, acceleration: Array, rate: float, fundamental: float | None) -> tuple[SpectrumRow, ...]:
    """Return the components of an acceleration at K, see `components`."""
    parts, method = components(acceleration, rate, fundamental)
    return tuple(
        SpectrumRow(case=case, point=POINT, method=method, frequency_Hz=float(f), rms_m_per_s2=float(level))
        for f, level in zip(parts.frequency, parts.rms, strict=True)
    )


def components(acceleration: Array, rate: float, fundamental: float | None) -> tuple[Components, str]:
    """Split an acceleration into harmonics of the road, or into third-octave bands.

    Parameters
    ----------
    acceleration : (n,) in the window [m/s2]
    rate : [Hz]
    fundamental : frequency of the road, None where it is not harmonic [Hz]

    Returns
    -------
    harmonics of the road where they carry the motion, else third-octave bands; and which of them, in words
    """
    if fundamental is None or acceleration.size * fundamental < rate:  # less than one period
        return third_octaves(acceleration, rate), "third-octave bands"
    parts = harmonics(acceleration, rate, fundamental)
    if parts.share < _PERIODIC:
        return third_octaves(acceleration, rate), "third-octave bands, since the ride does not repeat with the road"
    total = rms(acceleration - np.mean(acceleration))
    tone = total > 0.0 and float(parts.rms.max()) ** 2 >= _TONE * total**2
    return parts, "a tone at its own frequency" if tone else "harmonic by harmonic"


# --- Every ride in one artefact ---

_DEMANDED, _VOLTAGE = AXLE_COLUMNS[-2:]


@dataclass(frozen=True, eq=False)
class RideRows:
    """One ride as the artefact holds it: its history, and a row or more of each table."""

    ride: Ride
    ridden: RideRow
    rows: WindowRows
    found: tuple[FoundRow, ...]

    def without_history(self) -> RideRows:
        """Return the same ride, whose history is not written."""
        return replace(self, ridden=self.ridden.model_copy(update={"history": "none"}))


class Gathering:
    """Evaluates the rides of a config, each as soon as its window is known; only its history and rows are kept.

    On a road that goes on and on the window is known at once, and a long ride is evaluated piece by piece while it
    goes. Rides over a single event wait for each other, since they are compared over the same time.
    """

    def __init__(self, config: SimulateConfig, with_voltage: bool) -> None:
        """Gather the rides of a config, on a rig with a control signal or without one."""
        self._config, self._with_voltage = config, with_voltage

    def of_ride(
        self, case: Case, ridden: Callable[[Case, CourseSink | None], tuple[FixedValues, Outcome]]
    ) -> RideRows | tuple[FixedValues, Outcome]:
        """Ride a case, and judge it unless it goes over a single event.

        Parameters
        ----------
        case : the case
        ridden : rides it, see `Setup.ridden`
        """
        log.info("simulate: %s", case.name)
        if event_of(case.road, self._config) is not None:
            return ridden(case, None)
        clock = clock_of(self._config)
        window = settled(self._config.settle_s, clock.step, clock.steps)
        if clock.steps < longest_piece(clock.step) or case.policy.tuned == "schedule":
            return self._rows_of(case, *ridden(case, None), window, "end of the ride")
        pieces = Pieces(window.first, clock.step, partial(self._in_window, case))
        fixed, outcome = ridden(case, pieces.add)
        return self._rows_of(case, fixed, outcome, window, "end of the ride", pieces.joined(outcome))

    def all(
        self,
        planned: Sequence[Case],
        rides: Sequence[RideRows | tuple[FixedValues, Outcome]],
        responses: tuple[Response, ...],
    ) -> Rides:
        """Return the artefact of the stage.

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
        kept = {case.name for case in planned} if self._config.keep == "all" else drawn(planned)
        found = [every[case.name] if case.name in kept else every[case.name].without_history() for case in planned]
        return Rides(
            tuple(one.ride for one in found if one.ridden.history != "none"),
            tuple(one.rows.summary for one in found),
            tuple(one.ridden for one in found),
            tuple(row for one in found for row in one.rows.wheels),
            tuple(one.rows.weighted for one in found),
            tuple(row for one in found for row in one.rows.spectrum),
            responses,
            tuple(row for one in found for row in one.found),
        )

    def _over_event(self, event: Event, ridden: Sequence[tuple[Case, FixedValues, Outcome]]) -> dict[str, RideRows]:
        """Judge all rides over the single event of one road, over the same time."""
        window, endings = of_event(event, ridden[0][2].step, [outcome.comfort for _, _, outcome in ridden])
        return {
            case.name: self._rows_of(case, fixed, outcome, window, ending)
            for (case, fixed, outcome), ending in zip(ridden, endings, strict=True)
        }

    def _in_window(self, case: Case, outcome: Outcome, window: Window, lead: int | None = None) -> WindowRows:
        """Take the numbers of a ride in a window, or those of a piece of it with a lead before it, see `Pieces`."""
        name, rate, within = case.name, 1.0 / outcome.step, outcome.comfort[window.steps]
        fundamental = case.road.frequency_Hz if isinstance(case.road, Sine) else None
        spectrum = bands = spectrum_rows(name, within, rate, fundamental)
        if lead is not None and fundamental is not None:
            bands = spectrum_rows(name, within, rate, None)
        return WindowRows(
            summary_row(name, case.road.name, case.policy.name, case.fidelity, outcome, window),
            tuple(wheel_rows(name, outcome, window, self._config.car.car().static_loads())),
            weighted_row(name, outcome.comfort, rate, window, lead or 0),
            spectrum,
            bands,
        )

    def _rows_of(
        self,
        case: Case,
        fixed: FixedValues,
        outcome: Outcome,
        window: Window,
        ending: Ending,
        rows: WindowRows | None = None,
    ) -> RideRows:
        """Return a ride as the artefact holds it; its rows are taken in the window where none are given."""
        aim = case.policy.aim
        without: tuple[str, ...] = (_VOLTAGE,) if case.fidelity == "ideal" or not self._with_voltage else ()
        without += (_DEMANDED,) if aim in ("voltage", "schedule") else ()
        ridden = RideRow(
            case=case.name,
            from_s=window.first * outcome.step,
            to_s=window.last * outcome.step,
            ending=ending,
            voltage_V=fixed.voltage if aim == "voltage" and self._with_voltage else None,
            damping_Ns_per_m=fixed.damping if aim == "damping" else None,
            history=self._config.histories,
        )
        return RideRows(
            history_of(case.name, outcome, without),
            ridden,
            rows or self._in_window(case, outcome, window),
            tuple(_found_rows(case.name, fixed.searched)),
        )


def _found_rows(case: str, found: SearchResult | None) -> Iterator[FoundRow]:
    """Return the best found schedule, an interval a row, or the policy that none beats."""
    if found is None:
        return
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
