"""The comfort rows of one ride, in the editions that the config asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

from pzd.artefacts import RIDE_COLUMNS, ComfortRow, Ride, SummaryRow
from pzd.comfort import directive, iso2631_1978, iso2631_1997
from pzd.comfort.measures import rms
from pzd.comfort.spectrum import Components, harmonics, third_octaves
from pzd.comfort.weighting import weighted
from pzd.record import Array
from pzd.report.config import ReportConfig

UNWEIGHTED = "unweighted"
_TIME, _ACCELERATION = RIDE_COLUMNS[0], RIDE_COLUMNS[-1]
_RUN_UP_S = 3.0
"""Within this time the weighting has forgotten how the ride began."""
_PERIODIC = 0.98
"""Share of the mean square that the harmonics of the road must carry for the ride to count as periodic."""
_TONE = 0.999
"""Share of the mean square in one harmonic that makes a ride a tone."""


@dataclass(frozen=True, eq=False)
class SettledRide:
    """One ride after `settle`, weighted and unweighted."""

    row: SummaryRow
    rate: float
    """[Hz]"""
    acceleration: Array
    """(n,) at K [m/s2]"""
    weighted: Array
    """(n,) by Wk [m/s2]"""
    fundamental: float | None
    """Frequency of a harmonic road [Hz]."""
    run_up: float
    """What was cut off [s]."""

    @cached_property
    def components(self) -> tuple[Components, str]:
        """What the ride is made of, and how that was found."""
        nominal = iso2631_1978.chart().frequency
        if self.fundamental is None:
            return third_octaves(self.acceleration, self.rate, nominal), "third-octave bands"
        parts = harmonics(self.acceleration, self.rate, self.fundamental, float(nominal[-1]))
        if parts.share < _PERIODIC:
            bands = third_octaves(self.acceleration, self.rate, nominal)
            return bands, "third-octave bands, since the ride does not repeat with the road"
        total = rms(self.acceleration - self.acceleration.mean())
        tone = total > 0.0 and float(parts.rms.max()) ** 2 >= _TONE * total**2
        return parts, "a tone at its own frequency" if tone else "harmonic by harmonic"


def settled(ride: Ride, row: SummaryRow, settle: float, fundamental: float | None) -> SettledRide:
    """Weight the whole ride from its start, then cut off the settling time.

    Parameters
    ----------
    ride : the whole history
    row : its line of the summary
    settle : time that peaks and r.m.s. leave out [s]
    fundamental : frequency of the road, None where it is not harmonic [Hz]

    Returns
    -------
    the ride after `settle`
    """
    time, acceleration = ride.columns[_TIME], ride.columns[_ACCELERATION]
    rate = float((time.size - 1) / (time[-1] - time[0]))
    first = min(round(settle * rate), time.size - 1)
    history = weighted(acceleration, rate)
    return SettledRide(row, rate, acceleration[first:], history[first:], fundamental, settle)


def assess(ride: SettledRide, config: ReportConfig) -> tuple[ComfortRow, ...]:
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


def _unweighted(ride: SettledRide) -> Iterator[tuple[str, float | None, str, str]]:
    yield "peak", ride.row.peak_abs_aK_m_per_s2, "m/s2", "computed from every step"
    yield "rms", ride.row.rms_aK_m_per_s2, "m/s2", "computed from every step"


def _edition_1997(ride: SettledRide, config: ReportConfig) -> Iterator[tuple[str, float | None, str, str]]:
    found = iso2631_1997.evaluate(ride.weighted, ride.rate)
    trust = "verified" + (f"; {ride.run_up:g} s settling holds the start" if ride.run_up < _RUN_UP_S else "")
    beyond = "; ".join(found.beyond)
    more = f"{trust}; to be read beside a_w: {beyond}" if beyond else f"{trust}; a_w suffices"
    yield "a_w", found.a_w, "m/s2", trust
    yield "weighted_peak", found.peak, "m/s2", trust
    yield "crest_factor", found.crest, "-", _condition(trust, found.crest, iso2631_1997.CREST_LIMIT)
    yield "VDV", found.vdv, "m/s^1.75", f"{more}; over {ride.weighted.size / ride.rate:.4g} s"
    yield "MTVV", found.mtvv, "m/s2", more
    yield "MTVV_over_a_w", found.mtvv_ratio, "-", _condition(trust, found.mtvv_ratio, iso2631_1997.MTVV_LIMIT)
    yield "VDV_over_a_w_T", found.vdv_ratio, "-", _condition(trust, found.vdv_ratio, iso2631_1997.VDV_LIMIT)
    reaction = "; ".join(f"{r.text} ({r.trust})" for r in iso2631_1997.reactions(found.a_w))
    yield "comfort_reaction", found.a_w, "m/s2", reaction
    if config.health_guidance_zone is not None:
        yield "health_guidance_zone", found.a_w, "m/s2", _zone(found.a_w, config.health_guidance_zone)


def _condition(trust: str, value: float, limit: float) -> str:
    return f"{trust}; {'above' if value > limit else 'not above'} {limit:g}"


def _zone(a_w: float, name: str) -> str:
    low, high = iso2631_1997.HEALTH_ZONES[name]
    place = "below" if a_w < low else "within" if a_w <= high else "above"
    return f"not verified: sources disagree on the zone; {place} {name} m/s2, for 8 h a day"


def _edition_1978(ride: SettledRide) -> Iterator[tuple[str, float | None, str, str]]:
    parts, how = ride.components
    for boundary in iso2631_1978.FACTORS:
        found = iso2631_1978.shortest(parts, boundary)
        place = f"governed by {found.frequency:.4g} Hz" if found.frequency is not None else ""
        status = "; ".join(text for text in (iso2631_1978.TRUST, found.remark, how, place) if text)
        yield f"exposure_time_{boundary}", found.minutes, "min", status


def _directive(ride: SettledRide, config: ReportConfig) -> Iterator[tuple[str, float | None, str, str]]:
    found = iso2631_1997.evaluate(ride.weighted, ride.rate)
    hours, note = config.daily_exposure_h, f"verified; {config.daily_exposure_h:g} h a day, vertical direction only"
    daily = directive.daily_exposure(found.a_w, hours)
    yield "A(8)", daily, "m/s2", f"{note}; {directive.zone(daily, directive.ACTION, directive.LIMIT)}"
    dose = directive.daily_dose(found.vdv, ride.weighted.size / ride.rate, hours)
    place = directive.zone(dose, directive.ACTION_VDV, directive.LIMIT_VDV)
    yield "VDV_day", dose, "m/s^1.75", f"{note}; {place}"
    for name, value in (("action", directive.ACTION), ("limit", directive.LIMIT)):
        until = directive.hours_until(value, found.a_w)
        yield f"time_to_{name}_value", until, "h", f"verified; A(8) = {value:g} m/s2, vertical direction only"
