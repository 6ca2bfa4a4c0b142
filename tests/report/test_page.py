"""The page stands alone, tells the story in order, and copes with whatever is absent."""

from __future__ import annotations

import base64
import hashlib
import os
import re
import subprocess
import sys
from collections import defaultdict
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pzd.artefacts import (
    Characteristics,
    Hypotheses,
    HypothesisPoint,
    HypothesisRow,
    Identified,
    Rides,
    Rig,
    Table,
    TableNotes,
)
from pzd.artefacts.diagnosis import Support
from pzd.artefacts.identified import WarmUpRow
from pzd.damper.model import BaseRow, Damper
from pzd.identification.characteristics import characteristics
from pzd.quantities import Control
from pzd.record import conditions
from pzd.report.config import ReportConfig
from pzd.report.plots import library
from pzd.simulate.config import CarBlock, SensorNoise, Sensors, SimulateConfig, Supply

HERE = Path(__file__).parent
ORDER = ["tested", "characteristics", "model", "missing", "damper", "passenger", "trust", "made"]
FETCHES = {"src", "href", "srcset", "data", "action", "poster"}


class Reader(HTMLParser):
    """Tags with their attributes, the text, and whether every tag is closed."""

    EMPTY = frozenset({"meta", "link", "img", "br", "wbr", "input"})

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.said: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in {"style", "script"}:
            self.said.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.said).split()).replace("\u202f", " ")

    def sections(self) -> list[str | None]:
        """But for the explorer, which stands before them where scripts run."""
        every = [attributes.get("id") for tag, attributes in self.tags if tag == "section"]
        return [name for name in every if name != "explorer"]

    def pictures(self) -> list[dict[str, str | None]]:
        return [attributes for tag, attributes in self.tags if tag == "img"]


@pytest.fixture(scope="module")
def page(run: Any) -> str:
    return run.told().page


@pytest.fixture(scope="module")
def read(page: str) -> Reader:
    return Reader(page)


@pytest.fixture
def words_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """No pictures and no explorer: for what the text alone must say."""
    monkeypatch.setattr("pzd.report.page.explorer_of", lambda context: None)
    monkeypatch.setattr("pzd.report.page.pictures", lambda plots, context, jobs: defaultdict(tuple))


def test_sections_stand_in_the_order_of_the_stages_and_every_tag_is_closed(read: Reader) -> None:
    assert read.sections() == ORDER
    assert read.open == []


def test_nothing_is_fetched_and_no_other_script_is_run(read: Reader) -> None:
    for tag, attributes in read.tags:
        assert tag not in {"iframe", "object", "embed"}
        assert not any(name.startswith("on") for name in attributes)
        for name in FETCHES & set(attributes):
            assert re.match(r"data:|#", attributes[name] or "")


def test_styles_and_pictures_fetch_nothing(page: str, read: Reader) -> None:
    own, _, scripts = page.partition('<script type="application/json"')
    assert scripts
    assert "@import" not in own
    assert "url(" not in own
    for picture in read.pictures():
        svg = base64.b64decode((picture["src"] or "").partition(",")[2]).decode()
        assert svg.startswith("<svg")
        assert "<script" not in svg
        assert re.findall(r'(?:xlink:)?href="(?!#|data:)[^"]*"', svg) == []
        assert not re.search(r"url\((?!#)", svg)


def test_every_picture_says_what_it_shows(read: Reader) -> None:
    assert len(read.pictures()) >= len(library())
    assert all(len(picture.get("alt") or "") > 20 for picture in read.pictures())


def test_force_over_speed_stands_as_damper_people_chart_it(read: Reader, run: Any) -> None:
    part = read.text.partition("2 Force over speed, as measured")[2].partition("3 Where the simple model fails")[0]
    assert "Rebound is extension: its speed and force are positive, those of compression negative." in part
    assert "Found by their motion: 4 such tests in 4 records." in part
    for row in run.identified.characteristics.peak_velocity:
        assert f"{row.rebound_force_N:.3g}"[:2] in part.replace("\u2212", "")
        assert row.record in part
    assert "0 to 150 0.1 400 to 1 400 4.1 12.3 ok r09 1.5" in part.replace("\u00a0", " ")
    assert "states 9 ms for its damper" in part
    titles = [picture["alt"] for picture in read.pictures()]
    assert any("Force over peak speed of 4 tests, rebound above zero" in (alt or "") for alt in titles)
    assert any("one average settled cycle, one test each for 0" in (alt or "") for alt in titles)


def test_a_warm_up_stands_from_its_first_cycles_to_its_last(run: Any, words_only: None) -> None:
    setting = run.identified.rows[0].setting
    rows = tuple(
        WarmUpRow(
            record="r77",
            setting=setting,
            voltage_V=150.0,
            cycle=n,
            time_s=float(n),
            temperature_degC=20.0 + n,
            velocity_m_per_s=0.131,
            rebound_force_N=2000.0 - 100.0 * n,
            compression_force_N=-1000.0,
        )
        for n in range(1, 8)
    )
    warmed = replace(run.identified, characteristics=replace(run.identified.characteristics, warm_up=rows))
    text = Reader(replace(run, identified=warmed).told().page).text.replace("\u00a0", " ").replace("\u2212", "-")
    assert "Warm-up: force at the peak speed from the first 3 cycles to the last" in text
    assert "150 0.131 7 22 to 26 1 800 to 1 400 -1 000 to -1 000 r77" in text


def test_without_characteristics_the_page_has_no_section_of_them(run: Any, words_only: None) -> None:
    bare = replace(run.identified, characteristics=Characteristics())
    assert "characteristics" not in Reader(replace(run, identified=bare).told().page).sections()


def test_the_headline_answers_five_questions(read: Reader) -> None:
    head = read.text.partition("1 What was tested")[0]
    assert "1 540 N at 0 V to 2 480 N at 150 V" in head
    assert "Orifice quadratic" in head
    assert "97 %" in head
    assert "Sine, 4 Hz, amplitude 10 mm about 31.35 mm, at 150 V" in head
    assert "It would reach 0.251 m/s and 1 510 N." in read.text
    best, _, law = head.partition("Which policy rides best?")[2].partition("The law of the paper (policy comfort)")
    assert "2.25 Hz sine: best fixed voltage 62 V, a_w 0.304 m/s²; 4.5 Hz sine: best fixed voltage 62 V" in best
    assert "beside the best fixed voltage, dynamic: 2.25 Hz sine: a_w 35 % more; 4.5 Hz sine: a_w 31 % more." in law
    assert "It knows neither the lag of the valve nor the oil spring." in law
    assert re.search(r"Where the force follows at once \(fidelity table\) it is: 2.25 Hz sine [0-9.]+ % less", law)


@pytest.mark.parametrize("road", ["2.25", "4.5"])
@pytest.mark.parametrize(
    ("fidelity", "policies", "beside"),
    [
        ("dynamic", "comfort best fixed voltage 62 V", "best fixed voltage [0-9.]+ % more \u2013"),
        ("table", "comfort best fixed voltage 62 V", "best fixed voltage [0-9.]+ % less \u2013"),
        ("ideal", "constant c = 4 500 N s/m comfort", "constant \u2013 [0-9.]+ % less"),
    ],
)
def test_rides_are_compared_at_equal_fidelity_and_by_name(
    read: Reader, road: str, fidelity: str, policies: str, beside: str
) -> None:
    """By the table control does better than the best fixed voltage, dynamically worse: each is told beside its own."""
    _, _, table = read.text.replace("\xa0", " ").partition(f"{road} Hz sine, {fidelity} ")
    assert re.match(rf"(\(\d+\) )?policy {policies} a_w \[m/s²\] [0-9.]+ [0-9.]+ a_w beside {beside}", table)


def test_a_run_in_which_nothing_controls_says_so(words_only: None, run: Any) -> None:
    calm = {row.case for row in run.rides.summary if row.policy != "comfort"}
    kept = {
        name: tuple(row for row in getattr(run.rides, name) if row.case in calm)
        for name in ("rides", "summary", "ridden", "wheels", "weighted", "spectrum")
    }
    text = Reader(replace(run, rides=replace(run.rides, **kept)).told().page).text
    assert "Nothing controls the dampers" in text
    assert "2.25 Hz sine: a_w 0.304 m/s², best fixed voltage 62 V, dynamic" in text


def test_what_the_rides_assume_stands_on_the_first_page(read: Reader) -> None:
    head = read.text.partition("1 What was tested")[0]
    assert "the car is makowski2021: 1200 kg on springs of 47.5 and 47.5 kN/m (simulate.car)" in head
    assert "a time constant of 3.9 ms" in head
    assert "ideal forces are bounded by the damper's own table (simulate.bounds)" in head


def test_wheels_that_pull_on_the_road_are_told_with_their_place(read: Reader) -> None:
    _, _, trust = read.text.partition("How far to trust it")
    assert "the wheels of 8 rides pull on the road, which no wheel can; worst axle 2 of sine-2.25Hz" in trust
    assert "1 230 N, and 26" in trust
    assert "Force between wheel and road: the static load less the force of spring and damper, at rest" in read.text
    _, _, table = read.text.partition("4.5 Hz sine, dynamic policy comfort best fixed voltage 62 V")
    assert "least force on the road, axle 1 [N] 3 210 3 210" in table
    assert "least force on the road, axle 2 [N] \u22121 230 3 210" in table
    assert "pulling on the road (at 0 or below), axle 2 [%] 26 0" in table


def test_intervals_statuses_and_findings_stand_on_the_page(read: Reader) -> None:
    assert "474 (465 to 485)" in read.text
    assert "undetermined: k (the stroke hardly reaches slip)" in read.text
    assert "one sample of the force stands out" in read.text
    assert "abs(v) > 0.25 m/s, 150 V" in read.text


def test_the_final_damper_s_parameters_stand_first_with_intervals_and_the_simple_model_s_behind(read: Reader) -> None:
    _, _, final = read.text.partition("T0, C and k of the adopted damper")
    final, _, simple = final.partition("The simple model: T0, C and k of the Bingham element alone")
    assert "474 (469 to 480)" in final
    assert "ok" in final
    assert "474 (465 to 485)" in simple
    assert "undetermined: k (the stroke hardly reaches slip)" in simple


def test_parameters_edited_by_hand_have_no_interval(run: Any, words_only: None) -> None:
    first, second = run.diagnosed.damper.base
    edited = run.diagnosed.damper.model_copy(update={"base": (first.model_copy(update={"T0_N": 480.0}), second)})
    text = Reader(replace(run, diagnosed=replace(run.diagnosed, damper=edited)).told().page).text
    assert "480 (no interval)" in text
    assert "edited by hand" in text
    assert "474 (469 to 480)" not in text


def test_the_prediction_of_every_held_out_test_stands_in_a_table(read: Reader) -> None:
    _, _, table = read.text.partition("Prediction of held-out data (whole tests)")
    for cells in (("r03", "150", "0.0123", "0.00091"), ("all tests, left out", "75", "0.0222", "0.0111")):
        for cell in cells:
            assert cell in table


def test_with_and_without_the_missing_effect_stand_side_by_side(read: Reader) -> None:
    """That of the ride above, whose a_w with the effect is 0.411."""
    table = read.text.replace("\xa0", " ").partition("2.25 Hz sine, dynamic policy")[2].partition("4.5 Hz sine")[0]
    assert "without the missing effect: a_w [m/s²] 0.457 \u2013" in table
    assert "without the missing effect: reduced comfort after 21 min \u2013" in table


@pytest.mark.ci
def test_pictures_drawn_at_the_same_time_are_the_same(page: str, run: Any) -> None:
    assert run.told(jobs=3).page == page


@pytest.mark.ci
def test_the_same_input_gives_the_same_bytes_in_another_process(page: str) -> None:
    code = (
        f"import sys; sys.path[:0] = [{str(HERE)!r}, {str(HERE.parent)!r}]; import hashlib, conftest as c\n"
        "run = c.Run(c.rig(), c.identified(), c.diagnosed(), c.table(), c.rides())\n"
        "print(hashlib.sha256(run.told().page.encode()).hexdigest())"
    )
    root = str(HERE.parent.parent)
    environment = {**os.environ, "PYTHONHASHSEED": "7", "PYTHONPATH": root}
    other = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert other.stdout.strip() == hashlib.sha256(page.encode()).hexdigest()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"verdict": "ambiguous", "effects": ("orifice_quadratic",), "rivals": ("shear_thinning",)},
            "Orifice quadratic or shear thinning: not settled",
        ),
        ({"verdict": "none", "effects": (), "parameters": {}, "confidence": None}, "Nothing that these tests can see"),
        ({"verdict": "unexplained", "effects": (), "parameters": {}, "confidence": None}, "Something unexplained"),
        ({"verdict": "unexplained", "next_test": None, "where": (), "ranking": ()}, "beside orifice quadratic"),
    ],
)
def test_every_verdict_has_its_words(words_only: None, run: Any, changes: dict[str, Any], said: str) -> None:
    read = Reader(run.with_diagnosis(**changes).told().page)
    assert said in read.text
    assert read.sections() == ORDER
    if "next_test" in changes:
        assert "None is proposed" in read.text


def test_why_nobody_says_how_sure_a_verdict_is_stands_beside_it(words_only: None, run: Any) -> None:
    without: dict[str, Any] = {"effects": (), "parameters": {}, "confidence": None}
    for changes, said in (
        ({"verdict": "unexplained"}, "Not stated A probability is that of a name, and what is left has none."),
        ({"verdict": "ambiguous", "gap": None, "ranking": ()}, "Not stated No effect was tried on these tests."),
    ):
        assert said in Reader(run.with_diagnosis(**without, **changes).told().page).text


def test_each_share_of_the_force_says_what_it_is_a_share_of(words_only: None, run: Any) -> None:
    reason = "orifice_quadratic: the gap falls from 1 % to 0 % of peak"
    counted = run.with_diagnosis(run.diagnosed.damper, reason=reason)
    read = Reader(counted.told().page)
    assert "of the force, r.m.s.; noise alone leaves" in read.text
    assert "A gap in % of peak is its r.m.s. above the noise, beside the peak force" in read.text
    assert "A gap in % of peak" not in Reader(run.told().page).text
    assert "Where the gap lies; regions overlap, and so do their shares" in read.text
    assert "T0 is neither the friction that tests show without a model" in read.text
    assert "In rebound at 0.377 m/s and 22 °C, by the model in steady flow." in read.text.replace("\xa0", " ")


def test_what_came_in_for_its_prediction_is_not_said_to_be_in_the_damper(words_only: None, run: Any) -> None:
    known = Support(share=0.6, folds_better=4, folds=4, replaced_by=None, confidence=0.99, sure="certain")
    added = known.model_copy(update={"share": 0.1, "sure": "open", "added": True})
    effects = ("orifice_quadratic", "bouc_wen")
    support = dict(zip(effects, (known, added), strict=True))
    read = Reader(run.with_diagnosis(verdict="unexplained", effects=effects, support=support).told().page)
    assert "(orifice_quadratic) is part of it;" in read.text
    assert "unseen tests are predicted best with bouc wen, whatever it stands for." in read.text


def test_a_test_at_a_voltage_between_two_others_is_told_with_what_it_is_for(words_only: None, run: Any) -> None:
    test = run.diagnosed.diagnosis.next_test.model_copy(
        update={"separates": (), "voltage_V": 75.0, "between_voltage_V": (0.0, 150.0)}
    )
    read = Reader(run.with_diagnosis(next_test=test).told().page)
    assert (
        read.text.count("Between 0 V and 150 V the force is known least.") == 2
    )  # in the headline and where it belongs
    assert "at 75 V" in read.text


def with_hypotheses(run: Any, hypotheses: Hypotheses) -> Any:
    unexplained = run.with_diagnosis(verdict="unexplained", effects=(), parameters={}, confidence=None)
    return replace(unexplained, diagnosed=replace(unexplained.diagnosed, hypotheses=hypotheses))


BYPASS = HypothesisRow(
    place=1,
    shape="|x| v",
    beside=None,
    coefficient=15000.0,
    coefficient_low95=14000.0,
    coefficient_high95=16000.0,
    unit="N s/m2",
    second_coefficient=None,
    parameter=None,
    parameter_value=None,
    parameter_unit=None,
    width_m=None,
    closes=0.81,
    standard_errors=4.2,
    W_s_before=0.002,
    W_s_after=0.0004,
    physics="damping that depends on position, as bypass grooves give",
    library=None,
    source="Dixon 2007",
)


def point(value: float, voltage: float | None = None) -> HypothesisPoint:
    return HypothesisPoint(
        shape="|x| v",
        argument="|x| v",
        unit="m2/s",
        voltage_V=voltage,
        value=value,
        left_N=15100.0 * value,
        scatter_N=3.0,
        samples=50,
        fitted_N=15000.0 * value,
    )


def test_a_hypothesis_is_told_in_words_in_a_table_and_in_a_picture(run: Any) -> None:
    points = tuple(point(value, voltage) for voltage in (0.0, 150.0) for value in (-0.003, 0.0, 0.002))
    page = with_hypotheses(run, Hypotheses((BYPASS,), points, sought=True)).told().page
    read = Reader(page)
    assert (
        "A hypothesis on what is left: c |x| v, damping that depends on position, as bypass grooves give." in read.text
    )
    assert "would close 81 % of the gap on held-out tests" in read.text.replace("\u00a0", " ")
    assert "15 000 (14 000 to 16 000) N s/m\u00b2" in read.text.replace("\u00a0", " ")
    (alt,) = (of["alt"] for tag, of in read.tags if tag == "img" and "what is left" in (of["alt"] or "").lower())
    assert "c |x| v reaches \u221245 N at \u22120.003 m2/s" in str(alt)


@pytest.mark.ci
def test_only_an_unexplained_residual_is_drawn_over_planes_by_frequency_by_distribution_and_by_test(
    run: Any, read: Reader
) -> None:
    begins = ("Mean of measured minus", "R.m.s. of measured minus", "Quantiles of measured minus", "T0, C and k of")

    def alts(page: Reader) -> list[str]:
        every = (str(picture["alt"]).replace("\u00a0", " ") for picture in page.pictures())
        return [alt for alt in every if alt.startswith(begins)]

    found = alts(Reader(with_hypotheses(run, Hypotheses(sought=True)).told().page))
    planes = [alt for alt in found if alt.startswith("Mean of")]
    assert [alt.split(" over ")[1].split(" at ")[0] for alt in planes] == [
        "displacement and velocity",
        "velocity and force",
        "force and its rate",
    ]
    assert all("at 0 V, 150 V" in alt for alt in planes)
    assert [alt.partition(";")[0] for alt in found if alt.startswith("R.m.s.")] == [
        "R.m.s. of measured minus simulated force by third octaves at 0 V",
        "R.m.s. of measured minus simulated force by third octaves at 150 V",
    ]
    assert sum(alt.startswith("Quantiles") for alt in found) == 1
    assert any(alt.endswith("each fitted alone, over the order of the files.") for alt in found)
    assert alts(read) == []


def test_without_a_hypothesis_the_page_says_that_none_predicts_or_says_nothing(words_only: None, run: Any) -> None:
    none = Reader(with_hypotheses(run, Hypotheses(sought=True)).told().page).text
    assert "No shape of what is left predicts held-out tests better" in none
    assert "hypothesis" not in Reader(run.told().page).text.lower()


def test_an_unchanged_damper_shows_no_second_curve(run: Any) -> None:
    page = run.with_diagnosis(verdict="none", effects=(), parameters={}).told().page
    assert "with what was missing" not in page


def test_names_of_users_cannot_break_the_page(words_only: None, run: Any) -> None:
    bad = "<script>alert(1)</script>&"
    entries = tuple(entry.model_copy(update={"removed": bad}) for entry in run.rig.entries)
    read = Reader(replace(run, rig=Rig(run.rig.records, entries)).told().page)
    assert all(tag != "script" for tag, _ in read.tags)
    assert bad in read.text


def test_a_control_that_is_a_current_is_called_so(words_only: None, run: Any) -> None:
    read = Reader(replace(run, control=Control("current", "A")).told().page)
    assert "1 540 N at 0 A to 2 480 N at 150 A" in read.text
    assert "150 V" not in read.text.replace("abs(v) > 0.25 m/s, 150 V", "")


def test_a_damper_without_control_and_without_a_car_is_told_without_either(run: Any) -> None:
    plain = Damper(base=(BaseRow(T0_N=474.0, C_Ns_per_m=2260.0, k_N_per_m=263000.0),))
    records = tuple(replace(r, voltage=None, temperature=None) for r in run.rig.records[::2])
    blank = {"voltage_V": None, "temperature_degC": None}
    entries = tuple(entry.model_copy(update=blank) for entry in run.rig.entries[::2])
    rows = (run.identified.rows[0].model_copy(update=blank),)
    force = tuple(r.model_copy(update=blank) for r in run.table.force if r.voltage_V == 0.0)
    bare = replace(
        run.with_diagnosis(verdict="none", effects=(), parameters={}),
        rig=Rig(records, entries),
        identified=Identified(rows, (), characteristics=characteristics(*conditions(records))),
        table=Table(force, (), run.table.notes),
        rides=Rides(),
    )
    diagnosis = bare.diagnosed.diagnosis.model_copy(update={"where": (), "prediction": None, "next_test": None})
    bare = replace(bare, diagnosed=replace(bare.diagnosed, diagnosis=diagnosis, damper=plain, baseline=plain))
    read = Reader(bare.told().page)
    assert read.sections() == [name for name in ORDER if name != "passenger"]
    said = " ".join([read.text, *(picture["alt"] or "" for picture in read.pictures())])
    assert re.findall(r"(?i)volt|control|valve|\bV\b|\bride|comfort|passenger", said) == []
    assert "It gives 1 540 N" in read.text
    assert "no temperature was recorded" in read.text


@pytest.mark.ci
def test_a_force_that_is_there_at_rest_is_in_the_force_at_speed(run: Any, read: Reader) -> None:
    """The table leaves it to the static balance; a rig measures it, and the page tells what a rig measures."""
    damper = run.diagnosed.damper.with_effect("preload_offset", {"F_0": 90.0})
    charged = replace(run, diagnosed=replace(run.diagnosed, damper=damper))

    def forces(text: str) -> list[float]:
        (ends,) = re.findall(r"([\d ]+) N at 0 V to ([\d ]+) N at 150 V", text)
        (row,) = re.findall(r"force at 150 V \[N\].*? 0\.377 (\d \d{3}) (\d \d{3}) ", text)
        return [float(force.replace(" ", "")) for force in (*ends, *row)]

    without, text = (page.text.replace("\xa0", " ") for page in (read, Reader(charged.told().page)))
    assert forces(text) == [pytest.approx(force + 90.0, rel=5e-3) for force in forces(without)]
    assert "In rebound at 0.377 m/s and 22 °C, by the model in steady flow; 90 N of it act at rest as well." in text
    told = "ith the 90 N at rest that the table (4-table) leaves out"
    assert [text.count(f"{start}{told}") for start in "wW"] == [1, 1]
    assert "leaves out" not in without


def test_the_curve_of_the_damper_holds_what_is_there_at_rest(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    curves = []
    monkeypatch.setattr(
        "pzd.report.page.pictures",
        lambda plots, context, jobs: curves.append(next(iter(library()["force"].draw(context)))) or defaultdict(tuple),
    )
    for damper in (run.diagnosed.damper, run.diagnosed.damper.with_effect("preload_offset", {"F_0": 90.0})):
        replace(run, diagnosed=replace(run.diagnosed, damper=damper)).told()
    without, charged = (panel.figure.axes[0].lines[0].get_ydata() for panel in curves)
    assert charged - without == pytest.approx(0.09)  # kN


def test_a_car_on_dampers_without_control_is_told_without_it(run: Any, words_only: None) -> None:
    records = tuple(replace(r, voltage=None) for r in run.rig.records)
    rides = run.rides
    kept = {row.case for row in rides.summary if row.policy == "constant"}
    held = {"policy": "passive", "fidelity": "table"}
    rides = replace(
        rides,
        rides=tuple(one for one in rides.rides if one.case in kept),
        summary=tuple(row.model_copy(update=held) for row in rides.summary if row.case in kept),
        ridden=tuple(row.model_copy(update={"damping_Ns_per_m": None}) for row in rides.ridden if row.case in kept),
        responses=(),
    )
    force = tuple(row.model_copy(update={"voltage_V": None}) for row in run.table.force if row.voltage_V == 0.0)
    table = replace(run.table, force=force)
    text = Reader(replace(run, rig=Rig(records, run.rig.entries), table=table, rides=rides).told().page).text
    head = text.partition("1 What was tested")[0]
    assert "What does the passenger feel? 2.25 Hz sine: a_w" in head
    assert "passive: the damper as it is" in text
    assert "table: the force is that of the table at the speed of the damper" in text
    for said in ("What does control give", "Nothing controls", "the voltage stays", "the voltage comes"):
        assert said not in text


def test_an_empty_run_still_makes_a_page(run: Any) -> None:
    notes = TableNotes(outside="clamp", reached_m_per_s=0.0, lost=(), not_monotone=())
    empty = replace(
        run.with_diagnosis(verdict="none", effects=(), parameters={}, ranking=(), where=(), next_test=None),
        rig=Rig((), ()),
        identified=Identified((), ()),
        table=Table((), (), notes),
        rides=Rides(),
    )
    assert Reader(empty.told().page).sections() == ["tested", "model", "missing", "damper", "trust", "made"]


def test_without_the_standard_of_1978_the_gain_is_told_in_acceleration(words_only: None, run: Any) -> None:
    read = Reader(run.told(ReportConfig(editions=("ISO 2631-1:1997",))).page)
    assert "2.25 Hz sine: a_w 35 % more" in read.text
    assert "unverified transcription" not in read.text


def test_an_untrusted_ride_is_marked(words_only: None, run: Any) -> None:
    summary = tuple(row.model_copy(update={"energy_error": 1e-3}) for row in run.rides.summary)
    read = Reader(replace(run, rides=replace(run.rides, summary=summary)).told().page)
    assert "not to be trusted as they stand" in read.text
    assert "energy error 1.0e-03" in read.text


@pytest.mark.parametrize(("tested", "told"), [(0.02, True), (0.05, False), (None, False)])
def test_rides_beyond_the_tested_stroke_are_told_with_the_effects_that_depend_on_it(
    words_only: None, run: Any, tested: float | None, told: bool
) -> None:
    notes = run.table.notes.model_copy(update={"reached_stroke_m": tested})
    damper = run.diagnosed.damper.with_effect("end_stop", {"k_e": 1e6, "x_e": 0.02})
    stops = replace(run, table=replace(run.table, notes=notes), diagnosed=replace(run.diagnosed, damper=damper))
    text = Reader(stops.told().page).text
    assert ("rides go farther than any test did (0.02 m from the middle of the stroke)" in text) is told
    assert ("there no test shows what end_stop does" in text) is told


def test_sensors_and_supply_are_told_where_the_config_has_them_and_assumed_perfect_where_not(
    words_only: None, run: Any
) -> None:
    sensors = Sensors(delay_s=0.003, noise=SensorNoise(deflection_m=1e-4, pitch_rate_rad_per_s=2e-3))
    given = SimulateConfig(sensors=sensors, supply=Supply(step=0.5, power_W=17.0, capacitance_F=1e-5))
    told = Reader(replace(run, simulate=given).told().page).text
    assert "a sample every 1 ms, 3 ms late with noise of deflection 0.1 mm and pitch rate 2 mrad/s r.m.s." in told
    assert "sets values 0.5 V apart and charges 10 uF with 17 W" in told
    assert "simulate.sensors" not in told
    without = Reader(run.told().page).text
    assert "controllers see the ride exactly and at once (simulate.sensors)" in without
    assert "a sample every" not in without


@pytest.mark.ci
def test_a_car_whose_wheels_have_mass_is_told_with_how_it_swings_and_when_they_leave_the_road(run: Any) -> None:
    tyres = {"unsprung_mass_kg": (90.0, 80.0), "tyre_stiffness_N_per_m": (400000.0, 360000.0)}
    page = replace(run, simulate=SimulateConfig(car=CarBlock(**tyres))).told().page
    text = re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]+>", " ", page)))
    assert "wheels of 90 and 80 kg on tyres of 400 and 360 kN/m" in text
    assert "the wheels of 8 rides leave the road, axle 2 of sine-2.25Hz" in text
    assert "off the road (at 0), axle 2 [%]" in text
    assert "pull on the road" not in text
    found = re.search(r"wheel hop, axle 1 ([0-9.]+) ", text)
    assert found is not None
    assert float(found[1]) == pytest.approx(np.sqrt((47500.0 + 400000.0) / 90.0) / (2.0 * np.pi), rel=0.01)
