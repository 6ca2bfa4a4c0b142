"""The page of `pzd check --plot`: every record, nothing passed over, each finding at its place."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest

from pzd.artefacts import Finding, Rig
from pzd.quantities import Control
from pzd.report.page import envelope, records_page, times_of


def finding(where: str) -> Finding:
    return Finding(check="spikes", where=where, size=1.0, unit="N", follows="it stands out")


def test_no_sample_that_stands_out_is_passed_over(rng: np.random.Generator) -> None:
    time = np.arange(100_000) / 1000.0
    values = np.sin(time)
    spike = int(rng.integers(values.size))
    values[spike] = 5.0
    when, drawn = envelope(time, values)
    assert drawn.max() == 5.0
    assert when[np.argmax(drawn)] == time[spike]
    assert drawn.min() == pytest.approx(-1.0, abs=1e-6)
    assert np.all(np.diff(when) > 0.0)
    assert when.size < 1000


@pytest.mark.parametrize(
    ("where", "times"),
    [
        ("force, 1 sample, the largest at 3.21 s", [3.21]),
        ("before 4.233 s and after 10.66 s", [4.233, 10.66]),
        ("1 gap, the first after 2 s, the longest 0.02 s", [2.0]),
        ("force, held or jumping 3 times, the largest until 1e-05 s", [1e-5]),
        ("the cycles at 2 Hz", []),
        ("force, +18.9% of half its range", []),
    ],
)
def test_a_finding_is_marked_when_it_says_a_time(where: str, times: list[float]) -> None:
    assert times_of([finding("the whole record"), finding(where)]) == [(2, when) for when in times]


def test_each_record_has_its_section_with_its_findings(run: Any) -> None:
    entries = (run.rig.entries[0].model_copy(update={"findings": (finding("force at 0.412 s"),)}), *run.rig.entries[1:])
    page = records_page(replace(run.rig, entries=entries), Control())
    assert re.findall(r'<section id="([^"]*)"', page) == [record.name for record in run.rig.records]
    assert page.count("<img ") == 3 * len(run.rig.records)
    assert "4 records as read, with 1 finding of the preflight" in page
    assert "1. spikes: force at 0.412 s: 1\u00a0N; it stands out" in page
    assert page.count("Dashed: findings, by their number below.") == 1
    assert re.findall(r'(?:src|href)="(?!data:|#)', page) == []


def test_no_records_make_a_page_without_sections() -> None:
    assert "<section" not in records_page(Rig((), ()), Control())


def write_config(folder: Path) -> Path:
    time = np.arange(2000) / 500.0
    x, force = 0.01 * np.sin(2.0 * np.pi * 2.0 * time), 300.0 * np.cos(2.0 * np.pi * 2.0 * time)
    lines = [f"{t},{a},{f}" for t, a, f in zip(time, x, force, strict=True)]
    (folder / "a.csv").write_text("\n".join(["time_s,displacement_m,force_N", *lines]) + "\n", encoding="utf-8")
    config = folder / "c.yaml"
    config.write_text("rig: {files: [{path: a.csv}]}\n", encoding="utf-8")
    return config


def test_check_writes_that_page_only(tmp_path: Path, pzd_here: Callable[..., CompletedProcess[str]]) -> None:
    config = write_config(tmp_path)
    done = pzd_here("check", config, "--plot", tmp_path / "p.html", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert f"the records are drawn in {tmp_path / 'p.html'}" in done.stdout
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "c.yaml", "p.html"]


def test_a_record_is_never_overwritten_by_the_page(
    tmp_path: Path, pzd_here: Callable[..., CompletedProcess[str]]
) -> None:
    config = write_config(tmp_path)
    before = (tmp_path / "a.csv").read_bytes()
    done = pzd_here("check", config, "--plot", tmp_path / "a.csv", cwd=tmp_path)
    assert done.returncode == 2
    assert "must end in .html" in done.stderr
    assert (tmp_path / "a.csv").read_bytes() == before
