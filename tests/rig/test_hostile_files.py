"""A damaged or hostile file of a binary format costs its reader, not the command: each becomes one line."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from scipy.io import savemat

from pzd.rig.config import FilesEntry
from pzd.rig.files import child
from pzd.rig.files.formats import format_of, formats, rows_in, tables_in
from pzd.rig.files.sheet import FileTable
from pzd.schema.errors import DataError, UserError

ADVICE = "export it again, or save its columns as CSV"


@pytest.fixture(autouse=True)
def own_child() -> Iterator[None]:
    """Begin and end without a child, as a command does."""
    child.end_child()
    yield
    child.end_child()


def read(path: Path) -> list[FileTable]:
    entry = FilesEntry(path=str(path))
    return tables_in(path, entry, formats()[format_of(path, None, "rig.files.0")])


def refused(path: Path) -> str:
    with pytest.raises(DataError) as caught:
        read(path)
    [message] = caught.value.messages
    return message


def recording(rows: int = 6) -> dict[str, np.ndarray]:
    time_s = np.arange(rows) / 500.0
    return {"time_s": time_s, "displacement_m": 0.02 * np.sin(6.0 * time_s), "force_N": np.cos(time_s) / 3.0}


def crashing(path: Path) -> Path:
    """A MATLAB file with one byte changed, at which scipy reads beyond its memory."""
    savemat(path, recording())
    whole = bytearray(path.read_bytes())
    assert whole[184] == 9  # the type of the numbers: double
    whole[184] = 0xFF
    path.write_bytes(whole)
    return path


def write_binary(path: Path) -> None:
    """Write a recording in the format of the ending."""
    if path.suffix == ".mat":
        savemat(path, recording())
    elif path.suffix == ".h5":
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            for name, values in recording().items():
                file[name] = values
    elif path.suffix == ".parquet":
        pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
        parquet.write_table(pa.table(recording()), path)
    else:
        openpyxl = pytest.importorskip("openpyxl")
        book = openpyxl.Workbook()
        book.active.append(list(recording()))
        for row in zip(*recording().values(), strict=True):
            book.active.append([float(cell) for cell in row])
        book.save(path)


@pytest.mark.parametrize("name", ["a.mat", "a.h5", "a.parquet", "a.xlsx"])
def test_what_a_child_reads_is_what_is_in_the_file_bit_for_bit(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    write_binary(path)
    (found,) = read(path)
    module = formats()[format_of(path, None, "rig.files.0")]
    (here,) = module.tables(path, FilesEntry(path=name))
    assert found.header == here.header
    for there, cells in zip(found.cells, here.cells, strict=True):
        assert isinstance(there, np.ndarray)
        assert there.dtype == np.float64
        assert there.tobytes() == np.asarray(cells).tobytes()
    assert child._child is not None  # one went to work
    if name == "a.xlsx":
        assert rows_in(path, module) == module.rows(path)


def test_a_file_that_crashes_its_library_is_one_line_and_the_next_is_read(tmp_path: Path) -> None:
    damaged = crashing(tmp_path / "a.mat")
    write_binary(tmp_path / "b.mat")
    message = refused(damaged)
    assert message.startswith(f"{damaged}: a MATLAB file that crashes its library (")
    assert message.endswith(f": it is damaged; {ADVICE}")
    (found,) = read(tmp_path / "b.mat")
    assert found.rows == 6


def test_one_child_reads_all_files_of_a_command(tmp_path: Path) -> None:
    for name in ("a.mat", "b.mat"):
        write_binary(tmp_path / name)
    read(tmp_path / "a.mat")
    first = child._child
    read(tmp_path / "b.mat")
    assert first is not None
    assert child._child is first


def test_a_refusal_keeps_its_words_and_the_child(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(200))
    write_binary(tmp_path / "b.mat")
    read(Path("b.mat"))
    first = child._child
    assert refused(Path("a.mat")).startswith("a.mat: a MATLAB file that cannot be read (")
    assert child._child is first


@pytest.mark.skipif(os.name == "nt", reason="no limit on computing time")
def test_a_file_that_is_read_for_ever_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        group = file
        for _ in range(40):  # each group holds the next one twice: 2^40 ways down
            below = group.create_group("a")
            group["b"] = below
            group = below
    assert path.stat().st_size < 1e5
    monkeypatch.setattr(child, "_SECONDS", 0.0)
    begun = time.monotonic()
    message = refused(path)
    assert time.monotonic() - begun < 30.0
    assert message.startswith(f"{path}: an HDF5 file that is not read after ")
    assert message.endswith(f" s: it is damaged; {ADVICE}")


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no limit on memory")
def test_a_small_file_that_fills_the_memory_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {"time_s": np.zeros(20_000_000)}, do_compression=True)
    assert path.stat().st_size < 0.2e6
    monkeypatch.setattr(child, "_MEMORY", 0.1e9)
    assert refused(path) == (
        f"{path}: a MATLAB file that takes more than 0.1 GB of memory to read: it is damaged, or holds far more than "
        f"a recording; {ADVICE}"
    )


FORMAT = """
import os, time
KIND, NEEDS = "a made-up file", None

def wait(path):
    time.sleep(60.0)

def leave(path):
    os._exit(3)

def chatter(path):
    print("loud", flush=True)
    os.write(1, b"louder")
    return path.read_text()
"""


@pytest.fixture
def made_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """A format whose library does as it likes."""
    folder = tmp_path / "modules"
    folder.mkdir()
    (folder / "made_up_format.py").write_text(FORMAT, encoding="utf-8")
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PYTHONPATH", f"{folder}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    return import_module("made_up_format")


def test_a_child_that_waits_for_ever_is_ended(
    tmp_path: Path, made_up: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.bin"
    path.write_text("text")
    assert child.read_in_child(path, made_up, "chatter") == "text"
    monkeypatch.setattr(child, "_PATIENCE", 0.2)
    monkeypatch.setattr(child, "_PATIENCE_A_SECOND", 0.0)
    with pytest.raises(UserError, match=rf"a made-up file that is not read after 0 s: it is damaged; {ADVICE}"):
        child.read_in_child(path, made_up, "wait")


def test_a_child_that_ends_by_itself_is_told(tmp_path: Path, made_up: ModuleType) -> None:
    with pytest.raises(DataError, match=r"crashes its library \(exit code 3\)"):
        child.read_in_child(tmp_path / "a.bin", made_up, "leave")


def test_text_is_read_without_a_child(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text('{"time_s": [0.0, 1.0], "force_N": [1.0, 2.0]}')
    assert read(tmp_path / "a.json")[0].rows == 2
    assert child._child is None


def test_a_module_beside_the_files_is_not_taken_for_a_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("numpy", "scipy", "pzd"):
        (tmp_path / f"{name}.py").write_text("open('executed', 'w')\nraise SystemExit(7)\n")
    write_binary(tmp_path / "a.mat")
    monkeypatch.chdir(tmp_path)
    assert read(Path("a.mat"))[0].rows == 6
    assert not Path("executed").exists()


@pytest.mark.ci
def test_damaged_files_and_texts_as_units_are_read_or_refused_and_nothing_else(root: Path) -> None:
    """A short run of `make fuzz`."""
    paths = os.pathsep.join(str(root / part) for part in (".", "tests", "tests/rig"))
    done = subprocess.run(
        [sys.executable, root / "tests/studies/fuzz.py", "--seconds", "30"],
        env=os.environ | {"PYTHONPATH": paths},
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
        timeout=300.0,
    )
    assert done.returncode == 0, done.stdout + done.stderr
