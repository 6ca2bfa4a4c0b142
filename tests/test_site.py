"""The notebook and the five lines of the README run as they stand; the pages make a site whose links hold."""

from __future__ import annotations

import html
import os
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pandas as pd
import pytest
from installed import Installed
from notebooks import cells_of, executed, text_of

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOK = ROOT / "docs" / "first_hour.ipynb"
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def own_plot() -> str:
    """The lines of the README that lead from a recording to a plot."""
    found = re.search(r"<!-- own plot -->\n```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    assert found
    return found[1]


def write_run(folder: Path, rng: np.random.Generator) -> None:
    """A recording as the lines read it: F = 300 sign(v) + 1000 v, with noise."""
    time = np.arange(2500) / 500.0
    velocity = 0.25 * np.cos(4.0 * np.pi * time)
    force = 300.0 * np.sign(velocity) + 1000.0 * velocity + rng.normal(0.0, 3.0, time.size)
    displacement = 0.25 / (4.0 * np.pi) * np.sin(4.0 * np.pi * time)
    pd.DataFrame({"time_s": time, "displacement_m": displacement, "force_N": force}).to_csv(folder / "run.csv")


def test_the_five_lines_of_the_readme_draw_a_plot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    from matplotlib import pyplot as plt

    write_run(tmp_path, rng)
    monkeypatch.chdir(tmp_path)
    lines = own_plot()
    assert len(list(filter(None, lines.splitlines()))) == 5
    names: dict[str, object] = {}
    exec(lines, names)
    drawn = plt.gcf().axes[0]
    assert {line.get_label() for line in drawn.lines} >= {"measured", "baseline"}
    plt.close("all")
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]


@pytest.mark.ci
def test_the_five_lines_run_on_the_installed_wheel(
    installed: Installed, tmp_path: Path, rng: np.random.Generator
) -> None:
    write_run(tmp_path, rng)
    installed.output(
        "python", "-c", f"{own_plot()}\nimport matplotlib.pyplot as plt\nplt.savefig('own.png')", cwd=tmp_path
    )
    assert (tmp_path / "own.png").stat().st_size > 5000


@pytest.mark.ci
def test_the_notebook_says_today_what_it_says_on_its_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its words are those of a fresh execution, and there are as many pictures; digits may differ by the processor."""
    monkeypatch.chdir(tmp_path)
    kept, fresh = cells_of(NOTEBOOK), [cell for cell in executed(NOTEBOOK)["cells"] if cell["cell_type"] == "code"]
    for before, now in zip(kept, fresh, strict=True):
        assert _NUMBER.sub("0", text_of(before)) == _NUMBER.sub("0", text_of(now)), "make notebook"
        assert len(before["outputs"]) == len(now["outputs"]), "make notebook"
    assert sum("image/png" in one.get("data", {}) for cell in kept for one in cell["outputs"]) >= 6
    assert list(tmp_path.iterdir()) == []


@pytest.mark.ci
def test_every_link_of_the_site_leads_somewhere(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs", reason="MkDocs is not installed: make docs installs it")
    paths = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    environment = {**os.environ, "PYTHONPATH": paths, "NO_MKDOCS_2_WARNING": "1"}
    subprocess.run([sys.executable, ROOT / "docs" / "gather.py", tmp_path / "docs"], env=environment, check=True)
    config = (ROOT / "mkdocs.yml").read_text().replace("docs_dir: build/docs", f"docs_dir: {tmp_path / 'docs'}")
    (tmp_path / "mkdocs.yml").write_text(config.replace("site_dir: build/site", f"site_dir: {tmp_path / 'site'}"))
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-f", str(tmp_path / "mkdocs.yml")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    site = tmp_path / "site"
    for page in site.rglob("*.html"):
        if page.name == "404.html":
            continue
        text = page.read_text(encoding="utf-8")
        for link in re.findall(r'(?:href|src)="([^"]+)"', text):
            target, _, anchor = unquote(html.unescape(link)).partition("#")
            if re.match(r"[a-z]+:", target) or target.startswith("data"):
                continue
            there = (page.parent / target) if target else page
            there = there / "index.html" if there.is_dir() else there
            assert there.exists(), f"{page.relative_to(site)}: {link}"
            if anchor and there.suffix == ".html":
                assert f'id="{anchor}"' in there.read_text(encoding="utf-8"), f"{page.relative_to(site)}: {link}"
    reference = (site / "docs" / "reference.html").read_text(encoding="utf-8")
    for name in ("Test", "read", "identify", "diagnose", "changes", "table", "ride", "rate", "run", "load", "Damper"):
        assert f'id="pzd.{name}"' in reference, name
