"""Whatever a person and a killed command do to a run, in any order: nothing that was written by hand is lost, no
result is torn, and a run by force gives what a first run gives."""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import warnings
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule, run_state_machine_as_test
from stub_stages import NAMES, project

from pzd.artefacts import Manifest
from pzd.pipeline.command import execute, opened
from pzd.quantities import Control
from pzd.schema.errors import DataError
from pzd.schema.validate import read_json

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = {
    "ingest": "1-rig",
    "identify": "2-identify",
    "diagnose": "3-diagnose",
    "table": "4-table",
    "simulate": "5-simulate",
    "report": "6-report",
}
RESULTS = [
    "config.yaml",
    "1-rig/a.csv",
    "1-rig/records.json",
    "2-identify/parameters.csv",
    "2-identify/parameters.csv.edited-00000000",
    "2-identify/manifest.json",
    "6-report/comfort.csv",
    "6-report/report.html",
    "6-report/notes.txt",
    "notes.txt",
]
WRITES = {"os.rename", "os.mkdir", "os.remove", "os.rmdir", "shutil.rmtree", "shutil.copyfile"}

goals = st.sampled_from(["run", "run", *NAMES])


class Sequences(RuleBasedStateMachine):
    """A person, a project, and commands on it; the stages take no time."""

    names = RESULTS
    folders = FOLDERS

    def __init__(self) -> None:
        super().__init__()
        self.patch = pytest.MonkeyPatch()
        self.patch.setattr("pzd.runs.disk.LOCK_TIMEOUT_S", 60.0)  # a busy machine is no fault
        self.home = Path(tempfile.mkdtemp(prefix="sequences-"))
        self.config = self.set_up()
        self.run = self.home / "runs" / self.config.stem
        self.count = 0
        self.by_hand: dict[str, str] = {}
        """What the person wrote and has not taken back: content by the path where it was written."""
        self.ever: set[str] = set()
        self.removed: dict[Path, str] = {}
        """Files that the person removed, with the manifest that stood there then."""
        self.firsts: dict[str, dict[str, str]] = {}

    def set_up(self) -> Path:
        return project(self.home, self.patch)

    def teardown(self) -> None:
        try:
            self.by_force_as_at_first()
        finally:
            self.patch.undo()
            shutil.rmtree(self.home)

    # ------------------------------------------------------------ what a person does

    def write(self, path: Path, text: str) -> None:
        if path.parent.is_dir():
            if path.is_file():
                self.take_back(path)
            path.write_text(text)
            self.by_hand[path.relative_to(self.home).as_posix()] = text
            self.ever.add(text)

    def take_back(self, path: Path) -> None:
        """The person does not want any longer what they wrote there."""
        content = path.read_text()
        self.by_hand = {place: text for place, text in self.by_hand.items() if text != content}

    @rule(name=st.sampled_from(range(len(RESULTS))), readable=st.booleans())
    def edit(self, name: int, readable: bool) -> None:
        """Edit a result, or write a file of one's own; a readable edit of numbers is taken as it is."""
        path = self.run / self.names[name]
        self.count += 1
        text = f"edit {self.count}\n"
        if readable and path.is_file() and "200.0" in (before := path.read_text()):
            text = before.replace("200.0", f"{1000 + self.count}.0")
        self.write(path, text)

    @rule(name=st.sampled_from(range(len(RESULTS))))
    def remove_file(self, name: int) -> None:
        path = self.run / self.names[name]
        if path.is_file():
            self.take_back(path)
            manifest = path.parent / "manifest.json"
            self.removed[path] = manifest.read_text() if manifest.is_file() else ""
            path.unlink()

    @rule(seed=st.integers(1, 3))
    def change_config(self, seed: int) -> None:
        text = self.config.read_text().split("\nseed: ")[0].rstrip("\n")
        self.config.write_text(f"{text}\nseed: {seed}\n")

    @rule(level=st.integers(1, 3))
    def change_input(self, level: int) -> None:
        (self.home / "data" / "a.csv").write_text(f"{100 * level}")

    # ------------------------------------------------------------ what commands do

    def command(self, goal: str, *, force: bool, runs: str = "runs") -> None:
        execute(opened(self.config, self.home / runs), goal, force=force, jobs=1, say=lambda _: None)

    @rule(goal=goals, force=st.booleans())
    def complete(self, goal: str, force: bool) -> None:
        """A command that nobody disturbs ends well, or refuses what the person wrote."""
        try:
            self.command(goal, force=force)
        except DataError:
            assert self.by_hand

    @rule(goal=goals, force=st.booleans(), at=st.integers(0, 40), torn=st.booleans())
    def killed(self, goal: str, force: bool, at: int, torn: bool) -> None:
        """A command that is killed at its nth change of the disk, or in the middle of it."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of threads, which the child does not need
            child = os.fork()
        if child == 0:
            try:
                sys.addaudithook(_killer(self.home, at, torn=torn))
                self.command(goal, force=force)
            finally:
                os._exit(0)
        os.waitpid(child, 0)

    @rule(pair=st.tuples(goals, goals), force=st.tuples(st.booleans(), st.booleans()))
    def two_at_once(self, pair: tuple[str, str], force: tuple[bool, bool]) -> None:
        """Two commands at the same time: one waits for the other."""
        failed: list[BaseException] = []

        def work(goal: str, force: bool) -> None:
            try:
                self.command(goal, force=force)
            except BaseException as error:  # noqa: BLE001  # told below, in the test's own thread
                failed.append(error)

        threads = [threading.Thread(target=work, args=pair) for pair in zip(pair, force, strict=True)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for error in failed:
            if not (isinstance(error, DataError) and self.by_hand):
                raise error

    # ------------------------------------------------------------ what always holds

    @invariant()
    def nothing_written_by_hand_is_lost(self) -> None:
        found = {path.read_text(errors="replace") for path in self.home.rglob("*") if path.is_file()}
        assert {text for text in self.by_hand.values() if text not in found} == set()

    @invariant()
    def no_result_is_torn(self) -> None:
        for folder in self.folders.values():
            for path, digest in self.outputs(self.run / folder).items():
                if path.is_file():
                    content = path.read_bytes()
                    assert content.decode() in self.ever or hashlib.sha256(content).hexdigest() == digest, path
                else:
                    assert self.removed.get(path) == (self.run / folder / "manifest.json").read_text(), path

    def outputs(self, folder: Path) -> dict[Path, str]:
        try:
            manifest = read_json(folder / "manifest.json", Manifest, Control())
        except DataError:
            assert not folder.exists() or folder / "manifest.json" in self.removed or self.edited(folder), folder
            return {}
        return {folder / name: digest for name, digest in manifest.outputs.items()}

    def edited(self, folder: Path) -> bool:
        return (folder / "manifest.json").is_file() and (folder / "manifest.json").read_text() in self.ever

    @rule()
    def by_force_as_at_first(self) -> None:
        """A run by force gives the bytes of a first run."""
        self.command("run", force=True)
        now = self.bytes_below(self.run)
        key = self.config.read_text() + (self.home / "data" / "a.csv").read_text()
        if key not in self.firsts:
            self.command("run", force=False, runs="first")
            self.firsts[key] = self.bytes_below(self.home / "first" / self.config.stem)
            shutil.rmtree(self.home / "first")
        assert now == self.firsts[key]

    def bytes_below(self, run: Path) -> dict[str, str]:
        """Hash of every result, and of the config."""
        paths = [run / "config.yaml", *(path for name in self.folders.values() for path in self.outputs(run / name))]
        return {path.relative_to(run).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def _killer(home: Path, at: int, *, torn: bool) -> Any:
    """Kills this process before its nth change of a file below a folder, or half way through a write."""
    left = [at]

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        writes = event == "open" and isinstance(arguments[1], str) and set(arguments[1]) & set("wax+")
        if (writes or event in WRITES) and str(arguments[0]).startswith(str(home)):
            left[0] -= 1
            if left[0] < 0:
                if writes and torn:
                    handle = os.open(arguments[0], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
                    os.write(handle, b"to")
                os.kill(os.getpid(), signal.SIGKILL)

    return hook


FEW = settings(
    max_examples=6,
    stateful_step_count=10,
    derandomize=True,
    database=None,
    suppress_health_check=list(HealthCheck),
)


def test_nothing_is_lost_or_torn_whatever_happens_to_a_run() -> None:
    run_state_machine_as_test(Sequences, settings=FEW)


@pytest.mark.ci
def test_nothing_is_lost_or_torn_in_long_sequences() -> None:
    run_state_machine_as_test(Sequences, settings=settings(FEW, max_examples=200, stateful_step_count=30))


@pytest.mark.ci
@pytest.mark.skipif(os.name == "nt", reason="no SIGKILL, and no sessions")
def test_a_run_that_is_killed_at_any_instant_is_finished_to_the_same_bytes(root: Path) -> None:
    """A short run of `make crash-study`."""
    done = subprocess.run(
        [sys.executable, root / "tests/studies/crash_study.py", "--kills", "5"],
        env=os.environ | {"PYTHONPATH": str(root)},
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
        timeout=600.0,
    )
    assert done.returncode == 0, done.stdout + done.stderr
