"""The explorer has the numbers of the records, its scripts alone may run, and the cursor tells what it points at."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections import defaultdict
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_in_browser import CHROMIUM, chromium

from pzd.artefacts import Rig
from pzd.damper.compose import respond
from pzd.damper.motion import Motion

DRIVER = """<!doctype html><title>none</title><iframe id="page" src="report.html" width="1300" height="1400"></iframe>
<script>
const wait = (ms) => new Promise((done) => setTimeout(done, ms));
const deep = (root, name) => [...root.querySelectorAll("*")].flatMap((e) => [
  ...(e.matches(name) ? [e] : []), ...(e.shadowRoot ? deep(e.shadowRoot, name) : [])]);
addEventListener("load", async () => {
  const inside = document.getElementById("page").contentWindow, page = inside.document;
  await wait(3000);
  const says = () => Object.fromEntries([...page.querySelectorAll(".cursor td")].map((e) => [e.id, e.textContent]));
  const seen = {shown: !page.getElementById("explorer").hidden, plots: deep(page, ".bk-events").length, told: []};
  const move = async (plot, x, y) => {
    const box = plot.getBoundingClientRect();
    const at = {clientX: box.left + x * box.width, clientY: box.top + y * box.height, bubbles: true, composed: true};
    const mouse = {pointerType: "mouse", pointerId: 1, isPrimary: true};
    plot.dispatchEvent(new inside.PointerEvent("pointermove", {...at, ...mouse}));
    await wait(300);
    seen.told.push(says());
  };
  const [first] = deep(page, ".bk-events");
  if (first) { await move(first, 0.9, 0.2); await move(first, 0.2, 0.8); }
  document.title = JSON.stringify(seen);
});
</script>"""
"""Moves a cursor over the first plot, to the upper right and to the lower left."""


@pytest.fixture(scope="module")
def page(run: Any) -> str:
    """The page of the whole run, without the pictures."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pzd.report.page.pictures", lambda plots, context, jobs: defaultdict(tuple))
        return str(run.told().page)


def data_of(page: str) -> Any:
    found = re.search(r'<script type="application/json" id="explorer-data">(.*?)</script>', page)
    assert found is not None
    return json.loads(found[1])


def test_measured_force_and_both_models_are_those_of_the_record(page: str, run: Any) -> None:
    for test, record in zip(data_of(page)["tests"], run.rig.records, strict=True):
        rows = np.searchsorted(record.time - record.time[0], np.array(test["t"]) - 1e-6)
        columns = {
            "x": 1000.0 * record.displacement,
            "v": record.velocity,
            "F": record.force,
            "B": respond(run.diagnosed.baseline, Motion.of(record), float(record.force[0])),
            "A": respond(run.diagnosed.damper, Motion.of(record), float(record.force[0])),
        }
        for name, values in columns.items():
            assert np.array(test[name]) == pytest.approx(values[rows], abs=1e-4 * float(np.abs(values).max()))


def test_tests_stand_by_frequency_then_amplitude_then_control_and_those_that_do_not_repeat_last(
    run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pzd.report.page.pictures", lambda plots, context, jobs: defaultdict(tuple))
    of = run.identified.measures[0]
    swings = {"r01": (1.9999, 0.01), "r02": (1.50001, 0.01999), "r03": (1.50002, 0.01)}
    measured = tuple(
        of.model_copy(update={"record": name, "frequency_Hz": f, "amplitude_m": a}) for name, (f, a) in swings.items()
    )
    told = replace(run, identified=replace(run.identified, measures=measured)).told()
    labels = [test["label"].replace("\u00a0", " ").rpartition(", 22")[0] for test in data_of(told.page)["tests"]]
    assert labels == ["1.5 Hz, 10 mm, 150 V", "1.5 Hz, 20 mm, 0 V", "2 Hz, 10 mm, 150 V", "r00, 0 V"]


def test_tests_that_are_alike_are_told_apart_by_their_names_cut_where_they_are_long(
    run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pzd.report.page.pictures", lambda plots, context, jobs: defaultdict(tuple))
    of, entry = run.rig.records[0], run.rig.entries[0]
    names = ["damper_12_after_endurance_sine_2Hz_30mm_first", "damper_12_after_endurance_sine_2Hz_30mm_again"]
    measured = tuple(run.identified.measures[0].model_copy(update={"record": name}) for name in names)
    rig = Rig(
        tuple(replace(of, name=name) for name in names),
        tuple(entry.model_copy(update={"name": name, "findings": ()}) for name in names),
    )
    alike = replace(run, rig=rig, identified=replace(run.identified, measures=measured))
    labels = [test["label"].replace("\u00a0", " ") for test in data_of(alike.told().page)["tests"]]
    assert labels == [
        "2 Hz, 30 mm, 0 V, 22 °C, damper_12_after…e_2Hz_30mm_first",
        "2 Hz, 30 mm, 0 V, 22 °C, damper_12_after…e_2Hz_30mm_again",
    ]
    one = replace(alike, rig=Rig(rig.records[:1], rig.entries[:1]))
    assert data_of(one.told().page)["tests"][0]["label"].replace("\u00a0", " ") == "2 Hz, 30 mm, 0 V, 22 °C"


def test_the_page_stays_small_however_many_and_long_the_records_are(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """300 tests of which each could fill the page: below 5 MB with 2 MB left for pictures."""
    monkeypatch.setattr("pzd.report.page.pictures", lambda plots, context, jobs: defaultdict(tuple))
    of, entry = run.rig.records[0], run.rig.entries[0]
    names = [f"{of.name}-{number}" for number in range(300)]
    rig = Rig(
        tuple(replace(of, name=name) for name in names),
        tuple(entry.model_copy(update={"name": name, "findings": ()}) for name in names),
    )
    many = replace(run, rig=rig).told().page
    assert len(data_of(many)["tests"]) == 150
    assert "150 of 300 tests can be chosen" in many
    assert len(many.encode()) < 3_000_000


def test_only_the_scripts_of_the_page_may_run(page: str) -> None:
    found = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert found is not None
    rules = dict(rule.strip().split(" ", 1) for rule in unescape(found[1]).split(";"))
    assert rules["default-src"] == "'none'"
    scripts = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    hashes = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    assert rules["script-src"].split() == [f"'sha256-{each}'" for each in hashes]
    assert page.index("Content-Security-Policy") < page.index("<script")


def test_a_name_cannot_end_the_script(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pzd.report.page.pictures", lambda plots, context, jobs: defaultdict(tuple))
    name = "</script><script>x()</script>"
    records = (replace(run.rig.records[0], name=name), *run.rig.records[1:])
    entries = (run.rig.entries[0].model_copy(update={"name": name}), *run.rig.entries[1:])
    page = replace(run, rig=Rig(records, entries)).told().page
    assert "<script>x()" not in page
    assert name in data_of(page)["tests"][0]["label"]


@pytest.mark.ci
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt-get install chromium")
class TestInBrowser:
    def seen(self, page: str, folder: Path) -> Any:
        (folder / "report.html").write_text(page, encoding="utf-8")
        (folder / "driver.html").write_text(DRIVER, encoding="utf-8")
        done = chromium(folder, "--window-size=1400,1500", "--dump-dom", (folder / "driver.html").as_uri())
        title = re.search(r"<title>(.*?)</title>", done.stdout, re.DOTALL)
        assert title is not None, done.stderr
        return json.loads(unescape(title[1])), [line for line in done.stderr.splitlines() if "CONSOLE" in line]

    def test_a_cursor_changes_the_values_that_are_told(self, page: str, tmp_path: Path, run: Any) -> None:
        seen, _ = self.seen(page, tmp_path)
        assert seen["shown"]
        assert seen["plots"] >= 5
        high, low = seen["told"]
        assert float(high["explorer-v"].replace("\u2212", "-")) > 0.0 > float(low["explorer-v"].replace("\u2212", "-"))
        for told in (high, low):
            number = {
                name: float(text.replace("\u2212", "-")) for name, text in told.items() if name != "explorer-test"
            }
            (test,) = (t for t in data_of(page)["tests"] if t["label"] == told["explorer-test"])
            place = int(np.argmin(np.abs(np.array(test["t"]) - number["explorer-t"])))
            assert number["explorer-value-measured"] == pytest.approx(test["F"][place], abs=0.51)
            assert number["explorer-less-final"] == pytest.approx(test["F"][place] - test["A"][place], abs=0.06)

    def test_a_script_that_is_not_of_the_page_does_not_run(self, page: str, tmp_path: Path) -> None:
        """Its own last script changed by one letter: the page stands, the explorer does not."""
        seen, console = self.seen(
            page.replace("// The explorer of the records", "// the explorer of the records"), tmp_path
        )
        assert not seen["shown"]
        assert any("Content Security Policy" in line for line in console)
