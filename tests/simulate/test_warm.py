"""The ride's kernels are compiled ahead by one process, however many runs there are, and nobody leaves it a zombie."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from filelock import FileLock, Timeout

from pzd import compiled
from pzd.simulate import compiled_ahead as ahead
from pzd.simulate import precompile


@pytest.fixture
def rides(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """One entry for each ride that would have been compiled."""
    done: list[str] = []
    monkeypatch.setattr(precompile, "_smallest_ride", done.append)
    return done


def test_what_was_compiled_is_not_compiled_again(rides: list[str], tmp_path: Path) -> None:
    for _ in range(2):
        precompile._once(tmp_path)
    assert rides == ["ride"]


def test_a_second_process_leaves_the_compiling_to_the_first(rides: list[str], tmp_path: Path) -> None:
    with FileLock(ahead.lock(tmp_path).lock_file):
        precompile._once(tmp_path)
        assert rides == []
    precompile._once(tmp_path)
    assert rides == ["ride"]


def test_a_ride_waits_for_the_process_that_compiles_and_not_for_itself(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(compiled, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(precompile, "_smallest_ride", ahead.wait.__wrapped__)
    precompile._once(tmp_path, ("ride", "prediction"))  # would never end
    assert ahead.mark(tmp_path).exists()
    ahead.mark(tmp_path).unlink()
    waiting = threading.Thread(target=ahead.wait.__wrapped__)
    with FileLock(ahead.lock(tmp_path).lock_file):
        waiting.start()
        waiting.join(0.2)
        assert waiting.is_alive()
    waiting.join(60.0)
    assert not waiting.is_alive()


def test_a_ride_does_not_wait_for_the_kernels_of_a_predictive_control(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(compiled, "cache_folder", lambda: tmp_path)
    free: list[tuple[str, bool, bool]] = []

    def others_can(kernels: str) -> None:
        """What another process could take while these are compiled."""
        found = []
        for each in ("ride", "prediction"):
            other = FileLock(ahead.lock(tmp_path, each).lock_file)
            try:
                with other.acquire(blocking=False):
                    found.append(True)
            except Timeout:
                found.append(False)
        free.append((kernels, *found))

    monkeypatch.setattr(precompile, "_smallest_ride", others_can)
    precompile._once(tmp_path, ("ride", "prediction"))
    assert free == [("ride", False, False), ("prediction", True, False)]
    assert ahead.mark(tmp_path).exists()
    assert ahead.mark(tmp_path, "prediction").exists()


def test_what_another_copy_of_pzd_compiled_is_no_use(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    source = tmp_path / "law.py"
    monkeypatch.setattr(compiled, "sources", lambda: [source])
    marks = set()
    for changed in (1, 2):
        source.touch()
        os.utime(source, (changed, changed))
        marks.add(ahead.mark(tmp_path))
    monkeypatch.setattr(compiled, "sources", lambda: [tmp_path / "copy" / "law.py"])
    (tmp_path / "copy").mkdir()
    (tmp_path / "copy" / "law.py").touch()
    os.utime(tmp_path / "copy" / "law.py", (2, 2))
    assert len(marks | {ahead.mark(tmp_path)}) == 3


def test_a_command_starts_one_process_and_reaps_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    begun: list[subprocess.Popen[bytes]] = []

    class Started(subprocess.Popen[bytes]):
        def __init__(self, command: list[str], **options: object) -> None:
            super().__init__([sys.executable, "-c", ""], **options)  # type: ignore[call-overload] # as they come
            begun.append(self)

    monkeypatch.setattr(compiled, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(subprocess, "Popen", Started)
    ahead.in_background.cache_clear()
    before = set(threading.enumerate())
    for _ in range(3):
        ahead.in_background()
    for thread in set(threading.enumerate()) - before:
        thread.join(60.0)
    assert [process.returncode for process in begun] == [0]
    ahead.mark(tmp_path).touch()
    ahead.in_background.cache_clear()
    ahead.in_background()
    assert len(begun) == 1
