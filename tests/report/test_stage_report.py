"""The stage from end to end on a run made by hand: rows, statuses, and the files it writes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from pzd.artefacts import Report
from pzd.comfort.iso2631_1978 import exposure
from pzd.comfort.weighting import WK, response
from pzd.quantities import Control
from pzd.report.config import ReportConfig
from pzd.report.ride_comfort import assess, rated
from pzd.schema.errors import DataError

ALL = ReportConfig(
    editions=("ISO 2631-1:1997", "ISO 2631:1978", "Directive 2002/44/EC"), health_guidance_zone="0.45-0.90"
)


@pytest.fixture(scope="module", autouse=True)
def rows_only() -> Iterator[None]:
    """No pictures: these tests are about the rows."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pzd.report.page.pictures", lambda plots, context, jobs: defaultdict(tuple))
        yield


@pytest.fixture(scope="module")
def told(run: Any) -> Report:
    return run.told(ALL)


def row(told: Report, case: str, measure: str) -> Any:
    return next(r for r in told.comfort if (r.case, r.measure) == (case, measure))


def test_every_ride_has_the_same_measures_in_the_same_order(told: Report, run: Any) -> None:
    cases = [r.case for r in run.rides.summary]
    measures = {case: [r.measure for r in told.comfort if r.case == case] for case in cases}
    assert list(dict.fromkeys(r.case for r in told.comfort)) == cases
    assert len({tuple(names) for names in measures.values()}) == 1
    assert len(set(measures[cases[0]])) == len(measures[cases[0]])


@pytest.mark.parametrize(("frequency", "amplitude"), [(2.25, 2.2), (4.5, 3.6)])
def test_a_w_of_a_tone_is_its_closed_form(told: Report, frequency: float, amplitude: float) -> None:
    factor = abs(response(WK, np.array([frequency]))[0])
    found = row(told, f"sine-{frequency:g}Hz-constant-ideal", "a_w")
    assert found.value == pytest.approx(amplitude * factor / np.sqrt(2.0), rel=5e-4)
    assert (found.edition, found.unit, found.status) == ("ISO 2631-1:1997", "m/s2", "verified")


def test_the_papers_constant_c_rides_are_over_the_chart_of_reduced_comfort(told: Report) -> None:
    for road in ("sine-2.25Hz", "sine-4.5Hz"):
        found = row(told, f"{road}-constant-ideal", "exposure_time_reduced_comfort")
        assert found.value == 0.0
        assert found.status.startswith("unverified transcription; over the chart; a tone at its own frequency")


def test_a_controlled_ride_takes_the_time_of_its_worst_harmonic(told: Report) -> None:
    found = row(told, "sine-2.25Hz-comfort-ideal", "exposure_time_reduced_comfort")
    alone = exposure(0.75 / np.sqrt(2.0), 2.25, "reduced_comfort").minutes
    assert found.value == pytest.approx(alone, rel=1e-6)
    assert "harmonic by harmonic" in found.status


def test_every_row_of_1978_is_called_an_unverified_transcription(told: Report) -> None:
    rows = [r for r in told.comfort if r.edition == "ISO 2631:1978"]
    assert rows
    assert all(r.status.startswith("unverified transcription") for r in rows)
    assert all(r.unit == "min" for r in rows)


def test_recalled_reactions_and_the_disputed_zone_say_so(told: Report) -> None:
    assert "recalled, not verified" in row(told, "sine-4.5Hz-constant-ideal", "comfort_reaction").status
    assert "sources disagree" in row(told, "sine-4.5Hz-constant-ideal", "health_guidance_zone").status


def test_the_directive_scales_with_the_root_of_the_day(run: Any, told: Report) -> None:
    half = run.told(ReportConfig(editions=("Directive 2002/44/EC",), daily_exposure_h=2.0))
    case = "sine-4.5Hz-constant-ideal"
    assert row(told, case, "A(8)").value == pytest.approx(2.0 * row(half, case, "A(8)").value)
    assert row(told, case, "VDV_day").value == pytest.approx(4.0**0.25 * row(half, case, "VDV_day").value)
    assert "above the limit value 1.15" in row(told, case, "A(8)").status
    a_w = row(told, case, "a_w").value
    assert row(told, case, "time_to_action_value").value == pytest.approx(8.0 * (0.5 / a_w) ** 2)


def test_peak_and_rms_are_those_of_every_step(run: Any, told: Report) -> None:
    for summary in run.rides.summary:
        assert row(told, summary.case, "peak").value == summary.peak_abs_aK_m_per_s2
        assert row(told, summary.case, "rms").value == summary.rms_aK_m_per_s2


def test_a_ride_that_does_not_repeat_with_its_road_falls_back_to_bands(made_ride: Callable[..., Any]) -> None:
    ride = made_ride("r-comfort-ideal", "r", "comfort", "ideal", {2.25: 0.5, 3.1: 0.5}, 2.25)
    rows = [r for r in assess(ride.rated(), ReportConfig()) if r.edition == "ISO 2631:1978"]
    assert rows
    assert all("third-octave bands, since" in r.status for r in rows)


def test_a_random_ride_is_rated_by_third_octaves(made_ride: Callable[..., Any]) -> None:
    ride = made_ride("r-comfort-ideal", "r", "comfort", "ideal", {5.0: 0.5, 12.5: 0.2})
    rows = assess(ride.rated(), ReportConfig())
    found = next(r for r in rows if r.measure == "exposure_time_fatigue_decreased_proficiency")
    assert found.value == pytest.approx(
        exposure(0.5 / np.sqrt(2.0), 5.0, "fatigue_decreased_proficiency").minutes, rel=0.02
    )
    assert "third-octave bands; governed by 5 Hz" in found.status


def test_a_car_at_rest_may_ride_for_ever(made_ride: Callable[..., Any]) -> None:
    for fundamental in (None, 2.25):
        ride = made_ride("r-comfort-ideal", "r", "comfort", "ideal", {5.0: 0.0}, fundamental)
        rows = {r.measure: r for r in assess(ride.rated(), ALL)}
        assert rows["a_w"].value == 0.0
        assert rows["exposure_time_reduced_comfort"].value == 1440.0
        assert rows["time_to_limit_value"].value is None


def test_a_short_settling_time_is_said(made_ride: Callable[..., Any]) -> None:
    ride = made_ride("r-comfort-ideal", "r", "comfort", "ideal", {5.0: 0.5}, 5.0, settle=1.0)
    rows = {r.measure: r for r in assess(ride.rated(), ReportConfig())}
    assert "1 s settling holds the start" in rows["a_w"].status


def test_a_ride_below_1_hz_is_not_covered_by_the_edition_of_1978(made_ride: Callable[..., Any]) -> None:
    for fundamental in (None, 0.9):
        ride = made_ride("r-comfort-ideal", "r", "comfort", "ideal", {0.9: 5.0}, fundamental)
        rows = {r.measure: r for r in assess(ride.rated(), ALL)}
        found = rows["exposure_time_reduced_comfort"]
        assert found.value is None
        assert "not covered" in found.status


def test_the_window_of_an_event_is_said(made_ride: Callable[..., Any]) -> None:
    whole = made_ride("r-comfort-ideal", "r", "comfort", "ideal", {5.0: 0.5})
    ridden = whole.ridden.model_copy(update={"from_s": 0.4, "to_s": 2.9, "ending": "motion died away"})
    rows = {r.measure: r for r in assess(replace(whole, ridden=ridden).rated(), ReportConfig())}
    assert rows["a_w"].status == "verified; over 2.5 s from the entry of axle 1 on, motion died away"


def test_a_table_without_a_ride_of_the_summary_is_refused_by_name(run: Any) -> None:
    with pytest.raises(DataError, match=r"5-simulate/weighted\.csv: has no row of sine-2\.25Hz-constant-ideal"):
        rated(replace(run.rides, weighted=run.rides.weighted[1:]))


def test_the_report_writes_itself_and_reads_itself_back(told: Report, tmp_path: Path) -> None:
    told.write(tmp_path, Control())
    again = Report.read(tmp_path, Control())
    assert (again.comfort, again.page, again.reference, again.answer) == (told.comfort, told.page, None, told.answer)
    header = (tmp_path / "comfort.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header == "case,point,edition,measure,value,unit,status"


@pytest.mark.parametrize("wrong", [{"editions": ()}, {"editions": ("ISO 2631:1978",) * 2}, {"daily_exposure_h": 25.0}])
def test_a_wrong_block_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        ReportConfig(**wrong)
