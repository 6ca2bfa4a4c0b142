"""The page as a browser shows it, on a small screen and on a large one, and as it prints."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from test_runs_page import compared

from pzd.quantities import Control
from pzd.report.runs_page import runs_page

CHROMIUM = shutil.which("chromium")
QUIET = (
    "--headless",
    "--no-sandbox",  # a root of a container has none
    "--disable-gpu",
    "--disable-background-networking",
    "--no-first-run",
    "--hide-scrollbars",
    "--allow-file-access-from-files",
    "--virtual-time-budget=20000",
    "--enable-logging=stderr",
)
pytestmark = [
    pytest.mark.ci,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt-get install chromium"),
]

FRAME = """<!doctype html><title>none</title><iframe id="page" src="report.html" width="{width}" height="900"
style="border: 0"></iframe><script>
addEventListener("load", () => {{
  const inside = document.getElementById("page").contentWindow, page = inside.document, root = page.documentElement;
  const every = [...page.querySelectorAll("*")], style = (e) => inside.getComputedStyle(e);
  const says = (e) => e.getAttribute("alt") || e.getAttribute("aria-label") || e.querySelector?.("title")?.textContent;
  const named = (e) => `${{e.tagName}}.${{e.className}} ${{(e.textContent || "").trim().slice(0, 40)}}`;
  const scrolled = (e) => e && e !== page.body && (/auto|scroll/.test(style(e).overflowX) || scrolled(e.parentElement));
  const faults = (img) => {{
    const [kind, data] = img.src.split(";base64,"), name = (e) => e.textContent.trim();
    if (kind !== "data:image/svg+xml") return [];
    const place = document.createElement("div");
    place.style.cssText = `position: absolute; left: 0; top: 0; width: ${{img.getBoundingClientRect().width}}px`;
    place.innerHTML = new TextDecoder().decode(Uint8Array.from(atob(data), (c) => c.charCodeAt(0)));
    document.body.append(place);
    const svg = place.querySelector("svg"), found = [];
    svg.style.cssText = "width: 100%; height: auto; display: block";
    const edge = svg.getBoundingClientRect();
    const texts = [...svg.querySelectorAll("text")].filter(name).map((e) => [name(e), e.getBoundingClientRect()]);
    for (const [text, r] of texts)
      if (r.left < edge.left - 1 || r.right > edge.right + 1 || r.top < edge.top - 2 || r.bottom > edge.bottom + 1)
        found.push(`cut: ${{text}} in ${{img.alt.slice(0, 60)}}`);
    for (const [i, [text, r]] of texts.entries())
      for (const [other, q] of texts.slice(i + 1))
        if (Math.min(r.right, q.right) - Math.max(r.left, q.left) > 1.5 &&
            Math.min(r.bottom, q.bottom) - Math.max(r.top, q.top) > 0.35 * Math.min(r.height, q.height))
          found.push(`over one another: ${{text}} and ${{other}} in ${{img.alt.slice(0, 60)}}`);
    place.remove();
    return found;
  }};
  document.title = JSON.stringify({{
    width: inside.innerWidth,
    scroll: root.scrollWidth,
    requests: inside.performance.getEntriesByType("resource").map((e) => e.name).filter((n) => !n.startsWith("data:")),
    pictures: page.querySelectorAll("img, svg").length,
    silent: [...page.querySelectorAll("img, svg:not([aria-hidden=true])")].filter((e) => !says(e)).map(named),
    broken: [...page.querySelectorAll("img")].filter((e) => !e.naturalWidth).map(named),
    wide: every.filter((e) => e.getBoundingClientRect().right > inside.innerWidth + 1 && !scrolled(e)).map(named),
    sideways: [...page.querySelectorAll(".scroll")].filter((e) => e.scrollWidth > e.clientWidth + 1).map(named),
    written: [...page.querySelectorAll("img")].flatMap(faults),
    cut: every.filter((e) => style(e).overflowX === "hidden" && e.scrollWidth > e.clientWidth + 1).map(named),
    broken_by_pages: [...page.querySelectorAll("tr, figure, .card")]
      .filter((e) => e.offsetHeight && (style(e).breakInside !== "avoid" || e.offsetHeight > {page_height})).map(named),
    heads_once: [...page.querySelectorAll("thead")].filter((e) => style(e).display !== "table-header-group").map(named),
  }});
}});
</script>"""
"""A window of Chromium is never narrower than 500 pixels, a frame in it is."""


@pytest.fixture(scope="module")
def page(run: Any) -> str:
    """The page of the whole run."""
    return str(run.told().page)


def chromium(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Chromium without a window, and nothing of its own kept."""
    assert CHROMIUM is not None
    profile = f"--user-data-dir={folder / 'profile'}"
    command = [CHROMIUM, *QUIET, profile, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)


A4_WIDTH, A4_HEIGHT = 688, 1005
"""Pixels of 1/96 inch that the margins of the page leave of 210 x 297 mm."""


def printed(page: str) -> str:
    """Return a page that looks on a screen as it does on paper."""
    return page.replace("@media print", "@media all")


def shown(page: str, width: int, folder: Path) -> tuple[dict[str, Any], list[str]]:
    """What a page is like in a frame of so many pixels, and what its console says."""
    (folder / "report.html").write_text(page, encoding="utf-8")
    (folder / "frame.html").write_text(FRAME.format(width=width, page_height=A4_HEIGHT), encoding="utf-8")
    done = chromium(folder, "--window-size=1500,1000", "--dump-dom", (folder / "frame.html").as_uri())
    title = re.search(r"<title>(.*?)</title>", done.stdout, re.DOTALL)
    assert title is not None, done.stderr
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line and "[bokeh" not in line]
    return json.loads(unescape(title[1])), console


@pytest.mark.parametrize("width", [400, 1024, 1400])
def test_the_page_fits_the_screen_asks_for_nothing_and_says_what_its_pictures_show(page, width, tmp_path) -> None:
    seen, console = shown(page, width, tmp_path)
    assert seen["width"] == width
    assert seen["scroll"] <= width
    assert seen["pictures"] > 5
    assert [seen[name] for name in ("requests", "silent", "broken", "wide", "cut", "written")] == [[]] * 6
    assert width < 1024 or seen["sideways"] == []
    assert console == []


def test_long_units_and_rides_that_are_alike_fit_their_pictures(run: Any, made_ride: Any, tmp_path: Path) -> None:
    """a_w of 1.497 and 1.524 m/s2 needs digits on its axis, and a control in clicks makes long names of policies."""
    made = [
        made_ride(f"sine-2.25Hz-{name}-dynamic", "sine-2.25Hz", name, "dynamic", {2.25: size}, 2.25, held=held)
        for name, size, held in (
            ("best_fixed_voltage", 3.497, {"voltage_V": 62.5}),
            ("passive", 3.524, {"voltage_V": 0.0}),
            ("comfort_predictive", 3.51, {}),
            ("comfort", 3.50, {}),
        )
    ]
    clicks = replace(run.with_rides(made), control=Control("rebound adjuster", "clicks"))
    seen, _ = shown(str(clicks.told().page), 1400, tmp_path)
    assert [seen[name] for name in ("wide", "cut", "written", "sideways")] == [[]] * 4


def test_the_page_of_compared_runs_fits_every_screen_and_the_paper(tmp_path: Path) -> None:
    names = ("gap_0.25_mm_new_and_cold", "gap_0.25_mm_after_endurance_run_12", "worn")
    page = runs_page([compared(name, 300.0 + 20.0 * n) for n, name in enumerate(names)])
    for width in (400, 1024, 1400):
        seen, console = shown(page, width, tmp_path)
        assert [seen[name] for name in ("requests", "silent", "broken", "wide", "cut", "written")] == [[]] * 6
        assert width < 1024 or seen["sideways"] == []
        assert console == []
    seen, _ = shown(printed(page), A4_WIDTH, tmp_path)
    assert [seen[name] for name in ("wide", "sideways", "cut", "written", "broken_by_pages", "heads_once")] == [[]] * 6


def test_what_is_wrong_with_a_page_is_seen(tmp_path) -> None:
    """A page with every fault: else the test above would pass whatever it looked at."""
    page = """<body><img src="data:,x"><img alt="far" src="https://example.org/far.png">
    <div style="width: 900px">wide</div><div style="overflow: hidden; width: 90px"><p style="width: 300px">cut</p></div>
    <div class="scroll" style="overflow-x: auto; width: 90px"><p style="width: 300px">far</p></div>
    <script>console.error("wrong")</script>"""
    texts = [f'<text x="{x}" y="20">{text}</text>' for x, text in ((20, "one"), (25, "two"), (180, "beyond"))]
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 40">{"".join(texts)}</svg>'
    data = base64.b64encode(svg.encode()).decode()
    page += f'<img style="width: 200px" alt="of words" src="data:image/svg+xml;base64,{data}">'
    seen, console = shown(page, 400, tmp_path)
    assert seen["requests"] == ["https://example.org/far.png"]
    assert len(seen["silent"]) == 1
    assert len(seen["broken"]) == 2
    assert [len(seen[name]) > 0 for name in ("wide", "cut", "sideways")] == [True, True, True]
    assert sorted(seen["written"]) == ["cut: beyond in of words", "over one another: one and two in of words"]
    assert seen["scroll"] > 400
    assert any("wrong" in line for line in console)


def test_no_table_and_no_picture_is_cut_on_paper(page: str, tmp_path: Path) -> None:
    """On A4 nothing is wider than the page, and nothing that belongs together is parted by its end."""
    seen, _ = shown(printed(page), A4_WIDTH, tmp_path)
    assert seen["width"] == A4_WIDTH
    assert [seen[name] for name in ("wide", "sideways", "cut", "written", "broken_by_pages", "heads_once")] == [[]] * 6


def test_a_table_that_is_cut_on_paper_is_seen(tmp_path: Path) -> None:
    cells = "".join(f"<td>column{number}</td>" for number in range(40))
    page = f"""<style>@media print {{ tr {{ break-inside: auto; }} thead {{ display: table-row-group; }} }}</style>
    <table><thead><tr><th>head</th></tr></thead><tbody><tr>{cells}</tr></tbody></table>"""
    seen, _ = shown(printed(page), A4_WIDTH, tmp_path)
    assert [len(seen[name]) > 0 for name in ("wide", "broken_by_pages", "heads_once")] == [True] * 3


def test_the_page_prints(page: str, tmp_path: Path) -> None:
    """To PDF, in several pages, each with something on it."""
    (tmp_path / "report.html").write_text(page, encoding="utf-8")
    target = tmp_path / "report.pdf"
    chromium(tmp_path, f"--print-to-pdf={target}", "--no-pdf-header-footer", (tmp_path / "report.html").as_uri())
    printed = target.read_bytes()
    assert printed.startswith(b"%PDF")
    assert len(re.findall(rb"/Type\s*/Page\b", printed)) > 3
    assert len(printed) > 50_000
