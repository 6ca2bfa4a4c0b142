"""Compiled functions: what is made for calls from Python, and that no two processes compile the same one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from pzd.compiled import compiled
from pzd.record import Array

SCRIPT = """
import gc, json, sys
import numpy as np
from pzd.compiled import compiled, inlined

@inlined
def twice(x):
    return 2.0 * x

@compiled
def risen(x):
    return twice(x) + 1.0

@compiled
def fill(found):
    for i in range(found.size):
        found[i] = risen(float(i))

found = np.zeros(3)
print("ready", flush=True)
sys.stdin.readline()
fill(found)
assert gc.isenabled()
print(json.dumps([found.tolist(), sum(fill._cache_misses.values())]))
"""
"""Says when it is ready, and after a line goes on to compile; prints what it computed, and how often it compiled."""


@compiled
def _within(x: float) -> float:
    return x + 1.0


@compiled
def _fill(found: Array) -> None:
    for i in range(found.size):
        found[i] = _within(found[i])


def test_what_reads_arguments_from_python_is_made_where_python_calls_alone() -> None:
    found = np.zeros(2)
    _fill(found)
    assert found.tolist() == [1.0, 1.0]
    assert not _within.overloads  # type: ignore[attr-defined]  # numba's, which is untyped
    assert _within(2.0) == 3.0
    assert len(_within.overloads) == 1  # type: ignore[attr-defined]  # numba's, which is untyped


def test_a_kernel_is_compiled_by_one_of_the_processes_that_need_it_at_once(tmp_path: Path) -> None:
    script = tmp_path / "kernels.py"
    script.write_text(SCRIPT, encoding="utf-8")
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    pipe = subprocess.PIPE
    processes = [
        subprocess.Popen([sys.executable, script], env=environment, stdin=pipe, stdout=pipe, text=True)
        for _ in range(2)
    ]
    for process in processes:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
    for process in processes:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    found = [json.loads(process.communicate()[0]) for process in processes]
    assert [values for values, _ in found] == [[1.0, 3.0, 5.0]] * 2
    assert sorted(count for _, count in found) == [0, 1]
