"""Compiled functions: what is compiled, by which process, and that an edited law is compiled anew."""

from __future__ import annotations

import errno
import json
import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import FunctionType

import numpy as np
import pytest

from pzd.compiled import Kernel, _passing, cache_folder, compiled
from pzd.record import Array
from pzd.schema.errors import FilesError

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


CALLED = """
import sys
import numpy as np
from pzd.compiled import compiled

@compiled
def risen(x):
    return x + 1.0

@compiled
def once(x):
    return risen(x)

@compiled
def twice(x):
    return risen(risen(x))

assert {"once": once, "twice": twice}[sys.argv[1]](1.0) == {"once": 2.0, "twice": 3.0}[sys.argv[1]]
inner = risen.inner
(kept,) = inner.overloads.values()
print(kept.library.get_pointer_to_function(kept.fndesc.llvm_func_name), sum(inner.stats.cache_hits.values()))
"""


def test_a_function_that_compiled_ones_call_is_machine_code_in_them_alone_and_is_kept_for_others(
    tmp_path: Path,
) -> None:
    said = [_compile(tmp_path / "called.py", tmp_path / "cache", CALLED, asked=asked) for asked in ("once", "twice")]
    assert [one.stderr for one in said] == ["", ""]
    assert [one.stdout.split() for one in said] == [["0", "0"], ["0", "1"]]


# --- The folder of the cache ---

TYPED = """
import sys
import numpy as np
from pzd.compiled import compiled

@compiled
def risen(x):
    return x + 1.0

assert risen(1.0) == 2.0
print(sum(risen.outer.stats.cache_misses.values()), sum(risen.outer.stats.cache_hits.values()))
"""


def _compile(
    script: Path, cache: Path, code: str = TYPED, asked: str = "", **more: str
) -> subprocess.CompletedProcess[str]:
    if not script.exists() or script.read_text(encoding="utf-8") != code:  # numba keeps kernels by the file's time
        script.write_text(code, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(cache), **more}
    command = [sys.executable, script, asked]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """A user's cache that cannot be made, as with HOME unwritable, and a temporary folder."""
    home, temporary = tmp_path / "home", tmp_path / "tmp"
    home.write_text("no folder")
    temporary.mkdir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(home))
    monkeypatch.setenv("PZD_CACHE", "")  # and afterwards as it was, whatever the test makes of it
    _passing.cache_clear()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    return home, temporary


needs_owners = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="files have no owners here")


@needs_owners
def test_kernels_are_kept_in_a_folder_of_this_user_alone(places: tuple[Path, Path]) -> None:
    folder = cache_folder()
    assert folder.parent.parent == places[1]
    assert {stat.S_IMODE(one.stat().st_mode) for one in (folder, folder.parent)} == {0o700}
    assert cache_folder() == folder


@needs_owners
@pytest.mark.parametrize("planted", ["of another user", "open to others", "a link", "in an open folder"])
def test_a_cache_that_others_can_write_to_is_not_used(
    places: tuple[Path, Path], planted: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    folder = cache_folder()
    (folder / "planted.nbc").write_text("bad")
    if planted == "of another user":
        monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
        folder.parent.rename(folder.parent.with_name(f"pzd-{os.geteuid()}"))
    elif planted == "open to others":
        folder.chmod(0o777)
    elif planted == "a link":
        folder.rename(tmp_path / "elsewhere")
        (tmp_path / "elsewhere").chmod(0o777)
        folder.symlink_to(tmp_path / "elsewhere")
    else:
        places[1].chmod(0o777)
    fresh = cache_folder()
    assert not (fresh / "planted.nbc").exists()
    assert fresh != folder
    assert cache_folder() == fresh
    assert os.environ["PZD_CACHE"] == str(fresh.parent)  # for the processes that this one starts
    assert stat.S_IMODE(fresh.stat().st_mode) == 0o700


@needs_owners
def test_a_folder_that_a_loose_umask_made_is_closed_and_used(places: tuple[Path, Path]) -> None:
    folder = cache_folder()
    folder.parent.chmod(0o775)
    assert cache_folder() == folder
    assert stat.S_IMODE(folder.parent.stat().st_mode) == 0o700


def _flipped(data: bytes) -> bytes:
    middle = len(data) // 2
    return data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :]


def _cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


@pytest.mark.parametrize("suffix", ["nbc", "nbi"])
@pytest.mark.parametrize("damage", [_flipped, _cut])
def test_a_damaged_kernel_is_compiled_anew(tmp_path: Path, suffix: str, damage: Callable[[bytes], bytes]) -> None:
    script = tmp_path / "kernels.py"
    assert _compile(script, tmp_path).stdout == "1 0\n"
    for path in (tmp_path / "pzd").rglob(f"*.{suffix}"):
        path.write_bytes(damage(path.read_bytes()))
    again = _compile(script, tmp_path)
    assert (again.returncode, again.stdout) == (0, "1 0\n"), again.stderr
    assert _compile(script, tmp_path).stdout == "0 1\n"


def test_a_damaged_module_of_kernels_is_written_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pzd.damper.compiled import kernels

    monkeypatch.setattr(kernels, "cache_folder", lambda: tmp_path)
    monkeypatch.delitem(sys.modules, "pzd_damper_kernels")  # put back by the end of the test
    path = tmp_path / "damper_kernels.py"
    path.write_text("raise SystemExit", encoding="utf-8")
    assert callable(kernels._load().interpolate)
    assert path.read_text(encoding="utf-8") == kernels.source()


FULL = """
import errno, os
from numba.core import caching

def refuse(self, name, data):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

caching.IndexDataCacheFile._save_data = refuse
"""


def test_a_full_disk_under_the_cache_is_told_as_such_and_stops_nothing(tmp_path: Path) -> None:
    done = _compile(tmp_path / "kernels.py", tmp_path, FULL + TYPED)
    assert (done.returncode, done.stdout) == (0, "1 0\n"), done.stderr
    [line] = done.stderr.splitlines()
    assert "cache of compiled kernels cannot be written (No space left on device)" in line
    assert str(tmp_path / "pzd") in line


def test_a_full_disk_under_the_module_of_kernels_is_told_as_that_of_the_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from pzd.damper.compiled import kernels

    def full(**_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(kernels, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(tempfile, "mkstemp", full)
    with pytest.raises(FilesError, match=r"cache of compiled kernels cannot be written .No space left on device"):
        kernels._load()
