"""`pzd watch` reruns what a new or changed file makes stale, waits for files being written, and tells mistakes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Generator
from itertools import islice
from pathlib import Path

import pytest
from stub_stages import project

from pzd.cli.app import status
from pzd.pipeline.watching import Look, State, WatchedFiles, looks

ROOT = Path(__file__).resolve().parent.parent
A, B = Path("a.csv"), Path("b.csv")

# ---------------------------------------------------------------- one look after another


def looked(*states: dict[Path, int]) -> list[Look]:
    """What the looks say where the files have these sizes, one state a look."""
    given = iter([{path: (size, size) for path, size in state.items()} for state in states])
    return list(islice(looks(lambda: next(given), lambda: None), len(states) - 1))


def test_the_first_time_that_all_stand_still_is_a_change_that_names_no_file() -> None:
    assert looked({A: 1}, {A: 1}, {A: 1}) == [Look((), settled=True), Look((), settled=False)]


def test_a_file_that_grows_is_waited_for_and_told_once() -> None:
    sizes = (5, 9, 12, 15, 15, 15)
    said = looked({A: 1}, {A: 1}, *({A: 1, B: size} for size in sizes))
    assert said[1:] == [
        Look((), settled=False),
        Look(("b.csv: still being written",), settled=False),
        Look((), settled=False),
        Look((), settled=False),
        Look(("b.csv: new",), settled=True),
        Look((), settled=False),
    ]


def test_new_changed_and_gone_are_told_together() -> None:
    before, after = {A: 1, B: 1}, {A: 2, Path("c.csv"): 1}
    said = looked(before, before, after, after)
    assert said[-1] == Look(("a.csv: changed", "b.csv: gone", "c.csv: new"), settled=True)


def test_what_changes_while_it_runs_counts_the_next_time() -> None:
    said = looked({A: 1}, {A: 1}, {A: 1, B: 1}, {A: 1, B: 1}, {A: 2, B: 1}, {A: 2, B: 1})
    assert [look.settled for look in said] == [True, False, True, False, True]
    assert said[-1].lines == ("a.csv: changed",)


def test_the_files_are_the_config_what_it_extends_its_layouts_and_its_records(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "a.csv").write_text("1", encoding="utf-8")
    (tmp_path / "ours.yaml").write_text("about: ours\n", encoding="utf-8")
    (tmp_path / "base.yaml").write_text("seed: 2\n", encoding="utf-8")
    config = tmp_path / "my.yaml"
    config.write_text(
        "extends: base.yaml\nrig: {files: [{path: data/*.csv, layout: ours}]}\nreport: {reference: lab.csv}\n",
        encoding="utf-8",
    )
    (tmp_path / "lab.csv").write_text("", encoding="utf-8")

    def names(watched: WatchedFiles) -> set[str]:
        state: State = watched.state()
        return {path.relative_to(tmp_path).as_posix() for path in state}

    watched = WatchedFiles(config)
    every = {"my.yaml", "base.yaml", "ours.yaml", "data/a.csv", "lab.csv"}
    assert names(watched) == every
    (tmp_path / "data" / "b.csv").write_text("1", encoding="utf-8")
    assert names(watched) == every | {"data/b.csv"}
    config.write_text("rig: [", encoding="utf-8")
    assert names(watched) == (every | {"data/b.csv"}) - {"base.yaml"}
    config.write_text("rig: {files: [{path: data/a.csv}]}\n", encoding="utf-8")
    assert names(watched) == {"my.yaml", "data/a.csv"}


# ---------------------------------------------------------------- the command

STUBS = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever started the tests may ignore it
sys.path.insert(0, {tests!r})
import stub_stages
import pzd.pipeline.command
pzd.pipeline.command.stages = stub_stages.stages
sys.argv = ["pzd", "watch", "first.yaml"]
from pzd.cli import main
main()
"""
PATIENCE_S = 120.0
"""A busy machine starts Python slowly."""


class Watching:
    """A watch at work: `until` gives the lines that it prints up to one that ends so."""

    def __init__(self, running: subprocess.Popen[str], printed: Path) -> None:
        self.running, self.printed, self.read = running, printed, 0

    def until(self, ending: str) -> list[str]:
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            whole = self.printed.read_text(encoding="utf-8").rpartition("\n")[0].split("\n")
            for count, line in enumerate(whole[self.read :], 1):
                if line.endswith(ending):
                    found = whole[self.read : self.read + count]
                    self.read += count
                    return found
            assert self.running.poll() is None, whole
            time.sleep(0.05)
        raise AssertionError(f"no {ending!r} in {whole[self.read :]}")


@pytest.fixture
def watching(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Generator[Watching]:
    """`pzd watch first.yaml` with stages that take no time; ended at the end of the test."""
    project(tmp_path, monkeypatch)
    paths = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    command = [sys.executable, "-c", STUBS.format(tests=str(ROOT / "tests"))]
    printed = tmp_path / "printed.txt"
    with printed.open("w", encoding="utf-8") as file:
        running = subprocess.Popen(
            command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": paths}, stdout=file, stderr=subprocess.STDOUT
        )
        try:
            yield Watching(running, printed)
        finally:
            running.kill()
            running.wait()


def test_a_new_file_a_mistake_its_mending_and_ctrl_c(
    watching: Watching, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    report = "report: runs/first/6-report/report.html"
    first = watching.until(report)
    assert first[0] == "watching first.yaml and the files that it names; Ctrl-C ends it"
    assert sum(" runs: " in line for line in first) == 6

    (tmp_path / "data" / "c.csv").write_text("500", encoding="utf-8")
    again = watching.until(report)
    assert again[0] == "data/c.csv: new"
    assert "ingest     runs: data/c.csv is new" in again
    parameters = (tmp_path / "runs" / "first" / "2-identify" / "parameters.csv").read_text(encoding="utf-8")
    assert ",300.0," in parameters  # the mean of 100, 300 and 500

    config = tmp_path / "first.yaml"
    sound = config.read_text(encoding="utf-8")
    config.write_text("sed: 2\n" + sound, encoding="utf-8")
    assert watching.until("(got sed)") == [
        "first.yaml: changed",
        "first.yaml:1:1: sed: no such key; did you mean seed? (got sed)",
    ]
    (tmp_path / "data" / "c.csv").write_text("nonsense", encoding="utf-8")
    watching.until("(got sed)")
    config.write_text(sound, encoding="utf-8")
    assert watching.until("(got nonsense)")[0] == "first.yaml: changed"
    (tmp_path / "data" / "c.csv").unlink()
    assert watching.until(report)[0] == "data/c.csv: gone"

    watching.running.send_signal(signal.SIGINT)
    assert watching.running.wait(timeout=PATIENCE_S) == 130
    assert watching.until("left what was there before")[-1].startswith("interrupted; ")
    monkeypatch.chdir(tmp_path)
    assert status(["run", "first.yaml"]) == 0
    assert capsys.readouterr().out.count("fresh: nothing it depends on has changed") == 6


@pytest.mark.parametrize("given", ["absent.yaml", "data"])
def test_what_is_no_config_is_no_watch(
    given: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    project(tmp_path, monkeypatch)
    monkeypatch.chdir(tmp_path)
    assert status(["watch", given]) == 2
    assert capsys.readouterr().err.startswith(f"{given}: th")
