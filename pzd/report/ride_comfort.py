"""The rides of a run with their comfort: rated by each edition asked for, and compared road by road."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pzd.artefacts import ComfortRow, RideRow, Rides, SpectrumRow, SummaryRow, WeightedRow
from pzd.comfort import directive, iso2631_1978, iso2631_1997
from pzd.comfort.spectrum import Components
from pzd.quantities import Control
from pzd.report.blocks import amount, spelled
from pzd.report.config import ReportConfig
from pzd.schema.errors import DataError
from pzd.simulate.config import SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.roads.sine import Sine
from pzd.simulate.study.plan import PLAIN_SUFFIX, REALISTIC

UNWEIGHTED = "unweighted"
"""Edition of the rows that follow no standard."""
UNCONTROLLED = ("best_fixed_voltage", "best_constant_c", "passive", "constant")
"""Policies that a controlled one is compared with, the strongest first."""
_FEWEST_CONTROLLED = 2
"""With fewer policies that control there is no trade-off to choose from; a `Comparison` says what the one is worth."""
_RUN_UP_S = 3.0
"""Within this time the weighting has forgotten how the ride began."""


Measure = tuple[str, float | None, str, str]
"""Name, value, unit and status of a comfort row."""


@dataclass(frozen=True, eq=False)
class RatedRide:
    """One ride with its row of each table; every number is taken over all steps of its window."""

    row: SummaryRow
    ridden: RideRow
    weighted: WeightedRow
    spectrum: tuple[SpectrumRow, ...]

    @property
    def evaluation(self) -> iso2631_1997.Evaluation:
        """The weighted measures."""
        found = self.weighted
        return iso2631_1997.Evaluation(
            a_w=found.a_w_m_per_s2,
            peak=found.peak_m_per_s2,
            vdv=found.VDV_m_per_s1_75,
            mtvv=found.MTVV_m_per_s2,
            duration=found.duration_s,
        )

    @property
    def components(self) -> Components:
        """Frequency components of the unweighted acceleration."""
        levels = np.array([row.rms_m_per_s2 for row in self.spectrum])
        return Components(np.array([row.frequency_Hz for row in self.spectrum]), levels, 1.0)

    @property
    def of_event(self) -> bool:
        """Whether the ride is over a single event."""
        return self.ridden.ending != "end of the ride"


def rated(rides: Rides) -> tuple[RatedRide, ...]:
    """Join the tables of the rides, in the order of the summary.

    Raises
    ------
    DataError : when a table has no row of a ride, as after a careless edit
    """
    ridden = {row.case: row for row in rides.ridden}
    weighted = {row.case: row for row in rides.weighted}
    spectrum: dict[str, list[SpectrumRow]] = {}
    for row in rides.spectrum:
        spectrum.setdefault(row.case, []).append(row)
    tables = {"rides.csv": set(ridden), "weighted.csv": set(weighted), "spectrum.csv": set(spectrum)}
    faults = [
        f"{Rides.folder}/{name}: has no row of {row.case}; run the stage again"
        for name, cases in tables.items()
        for row in rides.summary
        if row.case not in cases
    ]
    if faults:
        raise DataError(faults)
    return tuple(
        RatedRide(row, ridden[row.case], weighted[row.case], tuple(spectrum[row.case])) for row in rides.summary
    )


@dataclass(frozen=True)
class Comparison:
    """Rides over one road at one fidelity."""

    controlled: SummaryRow
    others: tuple[SummaryRow, ...]
    """Those that do not control, in the order of `UNCONTROLLED`."""


@dataclass(frozen=True, eq=False)
class RatedRides:
    """All rides of a run, seen road by road."""

    rides: tuple[RatedRide, ...]
    """In the order of the summary."""
    comfort: tuple[ComfortRow, ...]
    simulate: SimulateConfig
    control: Control

    @cached_property
    def roads(self) -> tuple[str, ...]:
        """Names of the roads in the order of the rides."""
        return tuple(dict.fromkeys(ride.row.road for ride in self.rides))

    def over(self, road: str) -> tuple[SummaryRow, ...]:
        """Return the rides of the final damper over one road."""
        rows = (ride.row for ride in self.rides if ride.row.road == road)
        return tuple(row for row in rows if not row.case.endswith(PLAIN_SUFFIX))

    def on_baseline(self, row: SummaryRow) -> SummaryRow | None:
        """Return the same ride on the damper before diagnose; None where it was not simulated."""
        ride = self._by_case.get(f"{row.case}{PLAIN_SUFFIX}")
        return None if ride is None else ride.row

    # --- Values ---

    @cached_property
    def measures(self) -> dict[tuple[str, str], ComfortRow]:
        """Comfort rows by case and measure."""
        return {(row.case, row.measure): row for row in self.comfort}

    def value(self, case: str, measure: str) -> float | None:
        """Return a comfort value; None where its edition was not asked for."""
        row = self.measures.get((case, measure))
        return None if row is None else row.value

    def a_w(self, row: SummaryRow) -> float:
        """Return the weighted r.m.s. acceleration of a ride [m/s2]."""
        return self._by_case[row.case].weighted.a_w_m_per_s2

    @cached_property
    def _by_case(self) -> dict[str, RatedRide]:
        return {ride.row.case: ride for ride in self.rides}

    # --- Comparisons ---

    def comparisons(self, road: str) -> tuple[Comparison, ...]:
        """Compare the controlled policy with the others over a road, one fidelity each, the most realistic first."""
        found = []
        for fidelity in REALISTIC:
            rows = {row.policy: row for row in self.over(road) if row.fidelity == fidelity}
            controlled = [row for policy, row in rows.items() if self.simulate.is_controlled(policy)]
            others = tuple(rows[policy] for policy in UNCONTROLLED if policy in rows)
            if controlled and others:
                found.append(Comparison(controlled[0], others))
        return tuple(found)

    def most_realistic(self, road: str) -> tuple[SummaryRow, ...]:
        """Return the rides that are drawn: at the most realistic fidelity compared on a road, or ridden at all.

        Where two are compared: the controlled one, those that do not control, and the most comfortable of all.
        """
        compared = self.comparisons(road)
        if compared:
            shown = (compared[0].controlled, *compared[0].others)
            best = self.best(road)
            return shown if best is None or best in shown or best.fidelity != shown[0].fidelity else (*shown, best)
        nearest = min((REALISTIC.index(row.fidelity) for row in self.over(road)), default=0)
        return tuple(row for row in self.over(road) if row.fidelity == REALISTIC[nearest])

    def trade_off(self, road: str) -> tuple[SummaryRow, ...]:
        """Return the rides of all policies over a road, the most comfortable first.

        At the most realistic fidelity at which two policies or more control; empty where there is none.
        """
        for fidelity in REALISTIC:
            rows = [row for row in self.over(road) if row.fidelity == fidelity]
            if sum(policies()[row.policy].controlled for row in rows) >= _FEWEST_CONTROLLED:
                return tuple(sorted(rows, key=self.a_w))
        return ()

    def by_comfort(self, road: str) -> tuple[SummaryRow, ...]:
        """Return the rides over a road at the most realistic fidelity that was ridden, the most comfortable first."""
        rows = self.over(road)
        nearest = min((REALISTIC.index(row.fidelity) for row in rows), default=0)
        return tuple(sorted((row for row in rows if row.fidelity == REALISTIC[nearest]), key=self.a_w))

    def best(self, road: str) -> SummaryRow | None:
        """Return the most comfortable of `by_comfort`; a schedule that was searched for is no policy to drive with."""
        rows = self.by_comfort(road)
        return next((row for row in rows if policies()[row.policy].tuned != "schedule"), None)

    def held(self, rows: Sequence[SummaryRow]) -> SummaryRow | None:
        """Return the strongest of the rides that do not control, in the order of `UNCONTROLLED`."""
        by_policy = {row.policy: row for row in rows}
        return next((by_policy[policy] for policy in UNCONTROLLED if policy in by_policy), None)

    def pareto_front(self, rows: Sequence[SummaryRow]) -> tuple[SummaryRow, ...]:
        """Return the rides than which none has both a lower a_w and a lower wheel load, in the order given."""

        def dominates(one: SummaryRow, other: SummaryRow) -> bool:
            return self.a_w(one) < self.a_w(other) and one.rms_wheel_load_N < other.rms_wheel_load_N

        return tuple(row for row in rows if not any(dominates(other, row) for other in rows))

    # --- Labels ---

    def road_label(self, name: str) -> str:
        """Return a road in words: a sine by its frequency, any other by its name."""
        for road in self.simulate.roads:
            if road.name == name and isinstance(road, Sine) and road.label is None:
                return f"{amount(road.frequency_Hz, 'Hz')} sine"
        return name

    def policy_name(self, row: SummaryRow) -> str:
        """Return the policy of a ride in words."""
        return self.control.told(spelled(row.policy)).removesuffix(" c")

    def policy_label(self, row: SummaryRow) -> str:
        """Return the policy of a ride in words, with what it held constant."""
        ridden = self._by_case[row.case].ridden
        name = self.policy_name(row)
        if ridden.damping_Ns_per_m is not None:
            return f"{name} c = {amount(ridden.damping_Ns_per_m, 'N s/m', 3)}"
        return name if ridden.voltage_V is None else f"{name} {amount(ridden.voltage_V, self.control.unit)}"

    def label(self, row: SummaryRow) -> str:
        """Return policy and fidelity of a ride in words."""
        return f"{self.policy_label(row)}, {row.fidelity}"


# --- Rating of one ride ---


def assess(ride: RatedRide, config: ReportConfig) -> tuple[ComfortRow, ...]:
    """Return every comfort row of one ride."""
    measures = {
        UNWEIGHTED: _unweighted(ride),
        iso2631_1997.EDITION: _edition_1997(ride, config),
        iso2631_1978.EDITION: _edition_1978(ride),
        directive.EDITION: _directive(ride, config),
    }
    return tuple(
        ComfortRow(
            case=ride.row.case,
            point=ride.row.point,
            edition=edition,
            measure=measure,
            value=value,
            unit=unit,
            status=status,
        )
        for edition in (UNWEIGHTED, *config.editions)
        for measure, value, unit, status in measures[edition]
    )


def _unweighted(ride: RatedRide) -> Iterator[Measure]:
    yield "peak", ride.row.peak_abs_aK_m_per_s2, "m/s2", "computed from every step"
    yield "rms", ride.row.rms_aK_m_per_s2, "m/s2", "computed from every step"


def _edition_1997(ride: RatedRide, config: ReportConfig) -> Iterator[Measure]:
    found = ride.evaluation
    trust = f"verified{_window(ride)}"
    beyond = "; ".join(found.beyond)
    more = f"{trust}; to be read beside a_w: {beyond}" if beyond else f"{trust}; a_w suffices"
    yield "a_w", found.a_w, "m/s2", trust
    yield "weighted_peak", found.peak, "m/s2", trust
    yield "crest_factor", found.crest, "-", _condition(trust, found.crest, iso2631_1997.CREST_LIMIT)
    yield "VDV", found.vdv, "m/s^1.75", f"{more}; over {found.duration:.4g} s"
    yield "MTVV", found.mtvv, "m/s2", more
    yield "MTVV_over_a_w", found.mtvv_ratio, "-", _condition(trust, found.mtvv_ratio, iso2631_1997.MTVV_LIMIT)
    yield "VDV_over_a_w_T", found.vdv_ratio, "-", _condition(trust, found.vdv_ratio, iso2631_1997.VDV_LIMIT)
    reaction = "; ".join(f"{r.text} ({r.trust})" for r in iso2631_1997.reactions(found.a_w))
    yield "comfort_reaction", found.a_w, "m/s2", reaction
    if config.health_guidance_zone is not None:
        yield "health_guidance_zone", found.a_w, "m/s2", _zone(found.a_w, config.health_guidance_zone)


def _window(ride: RatedRide) -> str:
    """Return what is to be known about the window of a ride."""
    start, end = ride.ridden.from_s, ride.ridden.to_s
    if ride.of_event:
        return f"; over {end - start:.4g} s from the entry of axle 1 on, {ride.ridden.ending}"
    return f"; {start:g} s settling holds the start" if start < _RUN_UP_S else ""


def _condition(trust: str, value: float, limit: float) -> str:
    return f"{trust}; {'above' if value > limit else 'not above'} {limit:g}"


def _zone(a_w: float, name: str) -> str:
    low, high = iso2631_1997.HEALTH_ZONES[name]
    place = "below" if a_w < low else "within" if a_w <= high else "above"
    return f"not verified: sources disagree on the zone; {place} {name} m/s2, for 8 h a day"


def _edition_1978(ride: RatedRide) -> Iterator[Measure]:
    parts = ride.components
    for boundary in iso2631_1978.FACTORS:
        found = iso2631_1978.shortest(parts, boundary)
        place = f"governed by {found.frequency:.4g} Hz" if found.frequency is not None else ""
        status = "; ".join(text for text in (iso2631_1978.TRUST, found.remark, ride.spectrum[0].method, place) if text)
        yield f"exposure_time_{boundary}", found.minutes, "min", status


def _directive(ride: RatedRide, config: ReportConfig) -> Iterator[Measure]:
    found = ride.evaluation
    hours, note = config.daily_exposure_h, f"verified; {config.daily_exposure_h:g} h a day, vertical direction only"
    daily = directive.daily_exposure(found.a_w, hours)
    yield "A(8)", daily, "m/s2", f"{note}; {directive.zone(daily, directive.ACTION, directive.LIMIT)}"
    dose = directive.daily_dose(found.vdv, found.duration, hours)
    place = directive.zone(dose, directive.ACTION_VDV, directive.LIMIT_VDV)
    yield "VDV_day", dose, "m/s^1.75", f"{note}; {place}"
    for name, value in (("action", directive.ACTION), ("limit", directive.LIMIT)):
        until = directive.hours_until(value, found.a_w)
        yield f"time_to_{name}_value", until, "h", f"verified; A(8) = {value:g} m/s2, vertical direction only"
