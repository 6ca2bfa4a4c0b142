"""The comfort rows of one ride, in the editions that the config asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from pzd.artefacts import ComfortRow, RideRow, Rides, SpectrumRow, SummaryRow, WeightedRow
from pzd.comfort import directive, iso2631_1978, iso2631_1997
from pzd.comfort.spectrum import Components
from pzd.report.config import ReportConfig
from pzd.schema.errors import DataError

UNWEIGHTED = "unweighted"
_RUN_UP_S = 3.0
"""Within this time the weighting has forgotten how the ride began."""


@dataclass(frozen=True, eq=False)
class RatedRide:
    """One ride as it is rated: all of it taken from every step in its window."""

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
        """What the unweighted acceleration is made of."""
        levels = np.array([row.rms_m_per_s2 for row in self.spectrum])
        return Components(np.array([row.frequency_Hz for row in self.spectrum]), levels, 1.0)

    @property
    def method(self) -> str:
        """How the components were found."""
        return self.spectrum[0].method

    @property
    def of_event(self) -> bool:
        """Whether the ride is over a single event."""
        return self.ridden.ending != "end of the ride"


def rated(rides: Rides) -> tuple[RatedRide, ...]:
    """Every ride with its rows of each table, in the order of the summary.

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


def assess(ride: RatedRide, config: ReportConfig) -> tuple[ComfortRow, ...]:
    """Every comfort row of one ride."""
    parts: dict[str, Callable[[], Iterator[tuple[str, float | None, str, str]]]] = {
        UNWEIGHTED: lambda: _unweighted(ride),
        iso2631_1997.EDITION: lambda: _edition_1997(ride, config),
        iso2631_1978.EDITION: lambda: _edition_1978(ride),
        directive.EDITION: lambda: _directive(ride, config),
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
        for measure, value, unit, status in parts[edition]()
    )


def _unweighted(ride: RatedRide) -> Iterator[tuple[str, float | None, str, str]]:
    yield "peak", ride.row.peak_abs_aK_m_per_s2, "m/s2", "computed from every step"
    yield "rms", ride.row.rms_aK_m_per_s2, "m/s2", "computed from every step"


def _edition_1997(ride: RatedRide, config: ReportConfig) -> Iterator[tuple[str, float | None, str, str]]:
    found = ride.evaluation
    trust = f"verified{_span(ride)}"
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


def _span(ride: RatedRide) -> str:
    """What is to be known about the window of a ride."""
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


def _edition_1978(ride: RatedRide) -> Iterator[tuple[str, float | None, str, str]]:
    parts = ride.components
    for boundary in iso2631_1978.FACTORS:
        found = iso2631_1978.shortest(parts, boundary)
        place = f"governed by {found.frequency:.4g} Hz" if found.frequency is not None else ""
        status = "; ".join(text for text in (iso2631_1978.TRUST, found.remark, ride.method, place) if text)
        yield f"exposure_time_{boundary}", found.minutes, "min", status


def _directive(ride: RatedRide, config: ReportConfig) -> Iterator[tuple[str, float | None, str, str]]:
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
