"""Compiled functions: what is compiled, by which process, and that an edited law is compiled anew."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from types import FunctionType

import numpy as np
import pytest

from pzd.compiled import Kernel, compiled
from pzd.record import Array

ROOT = Path(__file__).resolve().parents[1]

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
print(json.dumps([found.tolist(), sum(fill.outer.stats.cache_misses.values())]))
"""
"""Says when it is ready, and after a line goes on to compile; prints what it computed, and how often it compiled."""


@compiled
def _within(x: float) -> float:
    return x + 1.0


@compiled
def _fill(found: Array) -> None:
    for i in range(found.size):
        found[i] = _within(found[i])


def test_code_that_reads_arguments_from_python_is_compiled_only_for_functions_that_python_calls() -> None:
    found = np.zeros(2)
    _fill(found)
    assert found.tolist() == [1.0, 1.0]
    assert isinstance(_within, Kernel)
    assert len(_within.outer.signatures) == 0
    assert _within(2.0) == 3.0
    assert len(_within.outer.signatures) == 1


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


def test_compiling_the_laws_leaves_the_functions_of_the_effect_files_plain() -> None:
    import pzd.damper.compiled.kernels  # noqa: F401  # compiles the laws
    from pzd.damper.effects import cavitation

    assert isinstance(cavitation.law, FunctionType)
    assert isinstance(cavitation.extension_behind, FunctionType)  # which the law calls


EFFECT = """
from pzd.damper.effect import Effect, Parameter, Search

EFFECT = Effect(
    name="detent",
    place="parallel",
    law="F_d",
    parameters=(Parameter("F_d", "N", 0.0, -1.0e6, 1.0e6, "force", Search(lambda s: s.force, (0.05,))),),
    source="made up for a test",
    tests=(({"F_d": 100.0}, 100.0),),
    never_named="made up",
)


def scaled(force):
    return FACTOR * force


def law(F_d):
    return scaled(F_d)
"""

FORCE = """
import numpy as np
from pzd.damper.compiled.columns import columns_of, PARALLEL
from pzd.damper.compiled.kernels import parallel_forces
from pzd.damper.model import BaseRow, Damper

damper = Damper(base=(BaseRow(T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),), effects={"detent": {"F_d": 50.0}})
rest = np.zeros(1)
print(parallel_forces(rest, rest, rest, columns_of(damper, PARALLEL, None))[0])
"""


@pytest.mark.ci
def test_an_edited_effect_file_is_compiled_anew_although_the_kernels_that_call_it_were_cached(tmp_path: Path) -> None:
    effect = tmp_path / "effects" / "detent.py"
    effect.parent.mkdir()
    environment = {
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "PZD_EFFECTS": str(effect.parent),
        "XDG_CACHE_HOME": str(tmp_path),
    }

    def force(factor: str) -> float:
        effect.write_text(EFFECT.replace("FACTOR", factor), encoding="utf-8")
        command = [sys.executable, "-c", FORCE]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return float(done.stdout)

    assert force("1.0") == 50.0
    assert force("3.0") == 150.0
