"""The ride's kernels are compiled ahead by one process, however many runs there are, and nobody leaves it a zombie."""

from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path

import pytest
from filelock import FileLock

from pzd import compiled
from pzd.simulate import precompile as warm


@pytest.fixture
def rides(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """One entry for each ride that would have been compiled."""
    done: list[str] = []
    monkeypatch.setattr(warm, "_smallest_ride", lambda: done.append("ride"))
    return done


def test_what_was_compiled_is_not_compiled_again(rides: list[str], tmp_path: Path) -> None:
    for _ in range(2):
        warm._once(tmp_path)
    assert rides == ["ride"]


def test_a_second_process_leaves_the_compiling_to_the_first(rides: list[str], tmp_path: Path) -> None:
    with FileLock(tmp_path / warm._LOCK):
        warm._once(tmp_path)
        assert rides == []
    warm._once(tmp_path)
    assert rides == ["ride"]


def test_a_command_starts_one_process_and_reaps_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    begun: list[subprocess.Popen[bytes]] = []

    class Started(subprocess.Popen[bytes]):
        def __init__(self, command: list[str], **options: object) -> None:
            super().__init__([sys.executable, "-c", ""], **options)  # type: ignore[call-overload] # as they come
            begun.append(self)

    monkeypatch.setattr(compiled, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(subprocess, "Popen", Started)
    warm.in_background.cache_clear()
    before = set(threading.enumerate())
    for _ in range(3):
        warm.in_background()
    for thread in set(threading.enumerate()) - before:
        thread.join(60.0)
    assert [process.returncode for process in begun] == [0]
    (tmp_path / warm._MARK).touch()
    warm.in_background.cache_clear()
    warm.in_background()
    assert len(begun) == 1
