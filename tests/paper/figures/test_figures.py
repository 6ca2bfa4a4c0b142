"""The twenty figures: each is there, each says what it is made from, and the same bytes come out again."""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pzd.artefacts import base_of
from pzd.artefacts.rig import Conditions
from pzd.config import RunConfig
from pzd.paper.figures.draw import FigureSet, _entry, drawn
from pzd.paper.figures.numbered import library
from pzd.paper.figures.numbered.heating import heating
from pzd.paper.figures.numbered.modelled_loops import loop, tabulated
from pzd.paper.figures.sources import FigureData, rides_on
from pzd.paper.published import published

SMALL, LARGE = "gap 0.15 mm", "gap 0.25 mm"
PHOTOGRAPHS = {2, 3, 20}
ALL = tuple(range(1, 21))


def entry(setting: str, base: list[dict[str, float]], sines: list[tuple[float, float]], warm: list[float]) -> Any:
    return {
        "setting": setting,
        "damper": {"base": base},
        "voltages_V": [row["voltage_V"] for row in base if row["temperature_degC"] == 22],
        "temperatures_degC": warm,
        "tests": [{"waveform": {"kind": "sine", "frequency_Hz": f, "amplitude_m": a}, "cycles": 4} for f, a in sines],
        "noise": {"force": {"share_of_peak": 0.005}},
        "rate_Hz": 500,
    }


def row(voltage: float, warm: float, friction: float, damping: float) -> dict[str, float]:
    return {
        "voltage_V": voltage,
        "temperature_degC": warm,
        "T0_N": friction,
        "C_Ns_per_m": damping,
        "k_N_per_m": 5e5,
    }


@pytest.fixture(scope="module")
def data() -> FigureData:
    """A stand like the paper's, identified; nothing is missing from its damper."""
    from pzd.identification.stage import identify
    from pzd.rig.stage import synthesise

    small = [row(u, 22, t0, c) for u, t0, c in ((0, 800, 10000), (100, 2000, 16000), (150, 3400, 14000))]
    large = [row(u, 22, t0, c) for u, t0, c in ((0, 170, 3700), (50, 350, 3700), (100, 800, 4000), (150, 1300, 4200))]
    large += [row(r["voltage_V"], 43, 0.6 * r["T0_N"], 0.9 * r["C_Ns_per_m"]) for r in large]
    rig = {
        "virtual": [
            entry(SMALL, small, [(1, 0.022)], [22]),
            entry(LARGE, large, [(1, 0.03), (2, 0.03)], [22, 43]),
        ]
    }
    car = {"a1_m": 1.962, "a2_m": 1.068, "pitch_inertia_kgm2": 2216, "x_K_m": -0.856}
    ride = {
        "car": car,
        "c_min_Ns_per_m": 750,
        "c_max_Ns_per_m": 45000,
        "tie_break": "largest",
        "fidelities": ["ideal"],
        "integration_step_s": 0.002,
    }
    ride |= {"control_period_s": 0.002, "tolerance": 1e-6, "duration_s": 12, "settle_s": 8, "output_rate_Hz": 250}
    whole = {"rig": rig, "setting": LARGE, "simulate": ride}
    config = RunConfig.model_validate_json(json.dumps(whole))
    records = synthesise(config.rig, 1, config.control.signal(), Path())
    identified = identify(config.identify, records, 1)
    control = config.control.signal()
    rides_of_setting = rides_on(base_of(identified.rows, LARGE), LARGE, records, config.simulate, config.table, control)
    return FigureData(records, identified, rides_of_setting, config.simulate, config.table, control, LARGE)


@pytest.fixture(scope="module")
def figure_set(data: FigureData) -> FigureSet:
    """All twenty, which takes some seconds."""
    return drawn(data)


@pytest.fixture(scope="module")
def folder(figure_set: FigureSet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made: Path = tmp_path_factory.mktemp("figures")
    figure_set.write(made)
    return made


def test_all_twenty_figures_are_found() -> None:
    assert tuple(library()) == ALL


@pytest.mark.ci
def test_every_figure_but_the_photographs_is_drawn_as_png_and_svg(figure_set: FigureSet, folder: Path) -> None:
    for one in figure_set.entries:
        if one.figure in PHOTOGRAPHS:
            assert (one.source, one.pictures) == ("photograph", ())
            assert "photograph" in (one.missing or "")
        else:
            assert one.missing is None
            assert one.pictures
    for picture in (p for one in figure_set.entries for p in one.pictures):
        assert re.fullmatch(r"fig-\d\d-[a-z0-9-]+\.png", picture.png)
        assert (folder / picture.png).read_bytes().startswith(b"\x89PNG")
        assert b"<svg" in (folder / picture.svg).read_bytes()
        assert picture.png[:-4] == picture.svg[:-4]


@pytest.mark.ci
def test_the_same_bytes_come_out_again(data: FigureData, figure_set: FigureSet) -> None:
    assert drawn(data).files == figure_set.files


@pytest.mark.ci
def test_the_same_bytes_come_out_of_another_process(root: Path, figure_set: FigureSet) -> None:
    script = """
import hashlib
import matplotlib as mpl
from pzd.paper.figures.canvas import PAPER_STYLE, encoded
from pzd.paper.figures.numbered.schemes import rheological_model
with mpl.rc_context(PAPER_STYLE):
    for drawing in rheological_model(None):
        print(*(hashlib.sha256(one).hexdigest() for one in encoded(drawing.figure)))
"""
    environment = {**os.environ, "PYTHONPATH": str(root), "PYTHONHASHSEED": "7"}
    run = [sys.executable, "-c", script]
    text = subprocess.run(run, env=environment, capture_output=True, text=True, check=True).stdout.split()
    mine = [figure_set.files[f"fig-10-scheme.{kind}"] for kind in ("png", "svg")]
    assert text == [hashlib.sha256(one).hexdigest() for one in mine]


@pytest.mark.ci
def test_the_manifest_lists_every_figure_with_its_files(figure_set: FigureSet, folder: Path) -> None:
    listed = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert [one["figure"] for one in listed] == [one.figure for one in figure_set.entries]
    for one in listed:
        for picture in one["pictures"]:
            for name, digest in picture["sha256"].items():
                assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest


@pytest.mark.ci
def test_the_index_shows_every_figure_with_relative_links_and_no_script(figure_set: FigureSet, folder: Path) -> None:
    text = (folder / "index.html").read_text(encoding="utf-8")
    shown = [one.figure for one in figure_set.entries]
    assert [int(n) for n in re.findall(r'<section id="figure-(\d+)">', text)] == shown
    assert "<script" not in text
    links = set(re.findall(r'(?:href|src)="([^"]+)"', text)) - {"data:,"}
    assert all(link.startswith("#figure-") or (folder / link).is_file() for link in links)
    for number in shown:
        assert library()[number].title in text.replace("&#39;", "'")


@pytest.mark.ci
def test_measured_peaks_stand_beside_the_papers_in_the_caption(figure_set: FigureSet) -> None:
    captions = {one.figure: " ".join(p.caption for p in one.pictures) for one in figure_set.entries}
    peaks = {name: row.number for name, row in published().items() if row.quantity == "peak_force"}
    assert len(peaks) >= 13
    beside = {name: captions[int(name[1])] for name in peaks if int(name[1]) in captions}
    assert beside
    for name, caption in beside.items():
        assert f"paper {peaks[name]:.0f} N" in caption


def caption_of(number: int, part: str, figure_set: FigureSet) -> str:
    (figure,) = (one for one in figure_set.entries if one.figure == number)
    return next(picture.caption for picture in figure.pictures if part in picture.png)


@pytest.mark.ci
def test_figure_19_shows_the_four_peaks_within_1_percent(figure_set: FigureSet) -> None:
    caption = caption_of(19, "acceleration", figure_set)
    pairs = re.findall(r"c-(?:const\.|control) ([\d.]+) m/s², paper ([\d.]+)", caption)
    assert len(pairs) == 4
    assert all(float(ours) == pytest.approx(float(theirs.rstrip(".")), rel=0.01) for ours, theirs in pairs)


@pytest.mark.ci
def test_figure_19_says_that_the_wheels_pull_on_the_road(figure_set: FigureSet) -> None:
    """The paper's half-car has no unsprung masses, so nothing in its equations keeps the wheels on the road."""
    caption = caption_of(19, "acceleration", figure_set)
    assert "static load less the force of spring and damper" in caption
    assert "2.6 kN at axle 2 at 2.25 Hz, 0 or less 0% of the time" in caption
    assert "-3.2 kN at axle 2 at 4.5 Hz, 0 or less 26% of the time" in caption


@pytest.mark.ci
def test_the_real_damper_cannot_reach_c_min(figure_set: FigureSet) -> None:
    caption = caption_of(19, "fidelity", figure_set)
    floors = [float(n) for n in re.findall(r"at least (\d+) N s/m", caption)]
    assert len(floors) == 2
    assert min(floors) > 750.0


@pytest.mark.ci
def test_a_run_without_the_papers_tests_says_what_it_lacks(data: FigureData) -> None:
    identified, rig = data.identified, data.rig
    poorer = replace(
        data,
        identified=replace(
            identified,
            rows=tuple(row for row in identified.rows if row.setting == LARGE),
            measures=tuple(measure for measure in identified.measures if measure.setting == LARGE),
        ),
        rig=replace(rig, records=tuple(record for record in rig.records if record.setting == LARGE)),
    )
    fourth, none = _entry(library()[4], poorer)
    assert "no test at gap 0.15 mm" in (fourth.missing or "")
    assert none == {}
    assert _entry(library()[5], poorer)[0].missing is None
    nineteenth = _entry(library()[19], poorer)[0]
    assert nineteenth.missing == "the rig has no tests at gap 0.15 mm"
    assert [picture.png for picture in nineteenth.pictures] == ["fig-19-acceleration.png", "fig-19-cars.png"]


def test_the_papers_element_gives_the_peaks_that_its_tables_give() -> None:
    for voltage, peak in ((0.0, 2085.0), (100.0, 4232.0), (150.0, 5298.0)):
        found = loop(tabulated(Conditions(SMALL, voltage, 22.0)), Conditions(frequency_Hz=1.0, amplitude_m=0.022))
        assert found.peak == pytest.approx(peak, abs=1.0)
    for voltage, peak in ((0.0, 1311.0), (50.0, 1592.0), (100.0, 1936.0), (150.0, 2287.0)):
        found = loop(tabulated(Conditions(LARGE, voltage, 22.0)), Conditions(frequency_Hz=2.0, amplitude_m=0.030))
        assert found.peak == pytest.approx(peak, abs=1.0)


def test_heating_is_that_of_a_lump(rng: np.random.Generator) -> None:
    power = float(rng.uniform(100.0, 400.0))
    time, temperature = heating(power, power, 25.0, 43.0)
    loss, heat = 1.0, 2500.0  # W/K to the air, J/K of the lump: what the caption of Figure 7 assumes
    settled = 22.0 + power / loss
    exact = settled + (25.0 - settled) * np.exp(-loss / heat * np.array(time))
    assert np.max(np.abs(exact - temperature)) < 0.02
    assert temperature[-2] < 43.0 <= temperature[-1]


def test_too_little_power_never_warms_the_damper() -> None:
    with pytest.raises(LookupError, match="do not warm"):
        heating(5.0, 5.0, 25.0, 43.0)
