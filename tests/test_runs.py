"""A run folder holds the old result or the new one, never half, and one command at a time."""

from __future__ import annotations

import contextlib
import errno
import json
import multiprocessing
import os
import shutil
import threading
import time
import warnings
from multiprocessing.context import ForkProcess
from multiprocessing.synchronize import Event
from pathlib import Path

import pytest
from filelock import FileLock, Timeout

from pzd.artefacts import Identified, ParameterRow
from pzd.quantities import Control
from pzd.runs import Run, file_hash
from pzd.runs.disk import refuse_links_below
from pzd.runs.folder import MANIFEST
from pzd.schema.errors import ConfigError, FilesError

CONTROL = Control()


def identified(level: float) -> Identified:
    row = ParameterRow(
        setting=None,
        voltage_V=level,
        temperature_degC=None,
        T0_N=level,
        T0_N_low95=None,
        T0_N_high95=None,
        C_Ns_per_m=1.0,
        C_Ns_per_m_low95=None,
        C_Ns_per_m_high95=None,
        k_N_per_m=2e5,
        k_N_per_m_low95=None,
        k_N_per_m_high95=None,
        W_s=0.0,
        rmse_N=0.0,
        status="ok",
    )
    return Identified((row,), ())


def write(run: Run, artefact: Identified) -> None:
    with run.locked("pzd identify"):
        run.write("identify", artefact, {"seed": "1"}, "key", (), 0.5)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    monkeypatch.setattr("os.fsync", lambda _: None)  # the disk's time is not what these tests are about
    config = tmp_path / "first.yaml"
    config.write_text("rig: {}\n")
    return Run.of(config, tmp_path / "runs", CONTROL)


def level(run: Run) -> float | None:
    return run.read(Identified).rows[0].T0_N


def test_what_is_written_reads_back_with_its_manifest(run: Run) -> None:
    write(run, identified(3.0))
    state = run.stage_folder("2-identify")
    assert level(run) == 3.0
    assert state.manifest is not None
    assert state.manifest.outputs == run.hashes("2-identify")
    assert (state.missing, state.edited) == ((), ())
    assert [path.name for path in run.folder.iterdir() if path.name != ".lock"] == ["2-identify"]


def test_an_edited_and_a_missing_file_are_told_from_each_other(run: Run) -> None:
    write(run, identified(3.0))
    (run.folder / "2-identify" / "parameters.csv").write_text("edited")
    (run.folder / "2-identify" / "measures.csv").unlink()
    state = run.stage_folder("2-identify")
    assert (state.missing, state.edited) == (("measures.csv",), ("parameters.csv",))


def test_a_hash_follows_the_content_even_when_the_length_stays(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_text("1")
    before = file_hash(path)
    path.write_text("2")
    assert file_hash(path) != before


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EACCES, errno.EIO, errno.EROFS])
def test_a_disk_that_refuses_is_said_in_a_line_and_the_old_result_stands(
    run: Run, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    write(run, identified(3.0))

    def refuse(_: Identified, folder: Path, __: Control) -> None:
        (folder / "parameters.csv").write_text("half")
        raise OSError(code, os.strerror(code), str(folder / "parameters.csv"))

    with monkeypatch.context() as patch:
        patch.setattr(Identified, "write", refuse)
        with pytest.raises(FilesError) as caught:
            write(run, identified(4.0))
    (message,) = caught.value.messages
    assert message.endswith(os.strerror(code))
    assert level(run) == 3.0
    assert not list(run.folder.glob(".*.new"))


def test_a_fault_of_ours_while_writing_leaves_the_old_result(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    write(run, identified(3.0))
    with monkeypatch.context() as patch:
        patch.setattr(Identified, "write", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            write(run, identified(4.0))
    assert level(run) == 3.0


def test_runs_below_a_file_are_a_fault_of_files(tmp_path: Path) -> None:
    (tmp_path / "runs").write_text("a file")
    with pytest.raises(FilesError, match="runs"), Run.of(tmp_path / "a.yaml", tmp_path / "runs", CONTROL).locked("x"):
        pass


class Slow:
    """An artefact that stands half written for a minute, and says so."""

    folder = Identified.folder

    def __init__(self, told: Event) -> None:
        self.told = told

    def write(self, folder: Path, control: Control) -> None:
        identified(4.0).write(folder, control)
        (folder / "parameters.csv").write_text("half")
        self.told.set()
        time.sleep(60)


def write_slowly(run: Run, told: Event, *, hold: bool) -> None:
    with run.locked("pzd identify"):
        if hold:
            told.set()
            time.sleep(60)
        run.write("identify", Slow(told), {}, "key", (), 0.5)  # type: ignore[arg-type]  # stands for an artefact


def other_process(run: Run, *, hold: bool) -> ForkProcess:
    """A process that writes half of a result, or holds the run; forked, since a new one takes long to start."""
    forking = multiprocessing.get_context("fork")
    told = forking.Event()
    process = forking.Process(target=write_slowly, args=(run, told), kwargs={"hold": hold}, daemon=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads, which the child does not need
        process.start()
    assert told.wait(60.0)
    return process


def end(process: ForkProcess) -> None:
    process.kill()
    process.join()


def test_a_run_killed_in_the_middle_of_writing_leaves_the_old_result(run: Run) -> None:
    write(run, identified(3.0))
    process = other_process(run, hold=False)
    end(process)
    assert level(run) == 3.0
    assert list(run.folder.glob(".*.new"))
    write(run, identified(5.0))
    assert level(run) == 5.0
    assert not list(run.folder.glob(".*.new"))


def test_a_first_run_killed_in_the_middle_of_writing_leaves_nothing(run: Run) -> None:
    process = other_process(run, hold=False)
    end(process)
    assert not (run.folder / "2-identify").exists()
    assert run.stage_folder("2-identify").manifest is None


@pytest.mark.parametrize("renames", [0, 1, 2])
def test_a_run_killed_between_the_renames_leaves_the_old_result_or_the_new(
    run: Run, monkeypatch: pytest.MonkeyPatch, renames: int
) -> None:
    write(run, identified(3.0))
    done: list[Path] = []
    rename = Path.rename

    def until_killed(self: Path, target: Path) -> Path:
        if len(done) == renames:
            raise KeyboardInterrupt
        done.append(target)
        return rename(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "rename", until_killed)
        patch.setattr(shutil, "rmtree", lambda *_, **__: None)  # a killed process tidies nothing up
        with contextlib.suppress(KeyboardInterrupt):
            write(run, identified(4.0))
    with run.locked("pzd show"):
        assert level(run) == (4.0 if renames == 2 else 3.0)
    assert not [path.name for path in run.folder.iterdir() if path.suffix in (".new", ".old")]


def test_a_held_run_is_refused_after_a_short_wait_and_names_who_holds_it(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pzd.runs.disk.LOCK_TIMEOUT_S", 0.2)
    process = other_process(run, hold=True)
    try:
        begun = time.monotonic()
        with pytest.raises(FilesError) as caught:
            write(run, identified(3.0))
        assert time.monotonic() - begun < 30.0  # and not the minute that the other holds it
        (message,) = caught.value.messages
        assert f"pzd identify (process {process.pid} on " in message
        assert message.startswith(f"{run.folder}: ")
    finally:
        end(process)
    write(run, identified(3.0))
    assert level(run) == 3.0


def test_a_folder_of_another_config_of_the_same_stem_is_refused_and_both_are_named(run: Run, tmp_path: Path) -> None:
    write(run, identified(3.0))
    other = tmp_path / "elsewhere" / "first.yaml"
    other.parent.mkdir()
    other.write_text("rig: {}\n")
    with pytest.raises(ConfigError) as caught:
        Run.of(other, tmp_path / "runs", CONTROL)
    (message,) = caught.value.messages
    assert str(run.config) in message
    assert str(other) in message
    run.config.unlink()
    Run.of(other, tmp_path / "runs", CONTROL)


def test_a_config_named_by_another_path_is_the_same(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(run, identified(3.0))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    for named in (Path("first.yaml"), Path("sub/../first.yaml")):
        assert level(Run.of(named, Path("runs"), CONTROL)) == 3.0


def test_a_project_that_was_moved_keeps_its_runs(tmp_path: Path) -> None:
    old = tmp_path / "old"
    old.mkdir()
    (old / "first.yaml").write_text("rig: {}\n")
    write(Run.of(old / "first.yaml", old / "runs", CONTROL), identified(3.0))
    shutil.copytree(old, tmp_path / "new")
    moved = Run.of(tmp_path / "new" / "first.yaml", tmp_path / "new" / "runs", CONTROL)
    assert level(moved) == 3.0


def test_the_config_is_written_once_and_then_left_alone(run: Run) -> None:
    with run.locked("pzd run"):
        run.write_config("seed: 1\n")
        written = (run.folder / "config.yaml").stat().st_mtime_ns
        run.write_config("seed: 1\n")
        assert (run.folder / "config.yaml").stat().st_mtime_ns == written
        run.write_config("seed: 2\n")
    assert (run.folder / "config.yaml").read_text().endswith("\nseed: 2\n")


# ---------------------------------------------------------------- hand edits


def edit(run: Run, text: str, name: str = "parameters.csv") -> None:
    (run.folder / "2-identify" / name).write_text(text)


def contents(folder: Path) -> dict[str, str]:
    return {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*") if path.is_file()}


def copies(folder: Path, name: str) -> list[str]:
    """What the kept edits of a file hold."""
    return sorted(path.read_text() for path in folder.glob(f"{name}.edited-*"))


def test_every_hand_edit_of_a_file_is_kept_once(run: Run) -> None:
    write(run, identified(3.0))
    for number in (1, 2, 1):
        edit(run, f"edit {number}")
        write(run, identified(3.0 + number))
    assert copies(run.folder / "2-identify", "parameters.csv") == ["edit 1", "edit 2"]
    assert level(run) == 4.0


def test_an_edit_of_an_edited_copy_stays(run: Run) -> None:
    write(run, identified(3.0))
    edit(run, "edit 1")
    write(run, identified(4.0))
    (kept,) = (run.folder / "2-identify").glob("parameters.csv.edited-*")
    kept.write_text("edit 2")
    edit(run, "edit 1")  # whose copy would have the name of the one that holds edit 2 now
    write(run, identified(5.0))
    assert copies(run.folder / "2-identify", "parameters.csv") == ["edit 1", "edit 2"]


def test_a_file_of_a_person_is_kept_where_a_result_is_written_in_its_place(run: Run) -> None:
    write(run, identified(3.0))
    path = run.folder / "2-identify" / MANIFEST
    manifest = json.loads(path.read_text())
    del manifest["outputs"]["measures.csv"]  # as if this version of the stage had not written it
    path.write_text(json.dumps(manifest))
    edit(run, "mine", "measures.csv")
    write(run, identified(4.0))
    assert copies(run.folder / "2-identify", "measures.csv") == ["mine"]


@pytest.mark.parametrize("manifest", [None, "", "{"])
def test_what_a_person_wrote_is_kept_where_the_manifest_cannot_say_what_was_ours(
    run: Run, manifest: str | None
) -> None:
    write(run, identified(3.0))
    edit(run, "edited")
    edit(run, "notes", "notes.txt")
    (run.folder / "2-identify" / MANIFEST).unlink()
    if manifest is not None:
        edit(run, manifest, MANIFEST)
    write(run, identified(4.0))
    found = contents(run.folder / "2-identify")
    assert copies(run.folder / "2-identify", "parameters.csv") == ["edited"]
    assert found["notes.txt"] == "notes"
    assert copies(run.folder / "2-identify", MANIFEST) == ([] if manifest is None else [manifest])
    assert run.stage_folder("2-identify").edited == ()


def test_a_person_may_call_a_file_as_a_manifest_is_called(run: Run) -> None:
    write(run, identified(3.0))
    (run.folder / "2-identify" / "mine").mkdir()
    edit(run, "mine", f"mine/{MANIFEST}")
    write(run, identified(4.0))
    assert contents(run.folder / "2-identify")[f"mine/{MANIFEST}"] == "mine"


def test_the_written_config_is_kept_where_a_person_edited_it(run: Run) -> None:
    with run.locked("pzd run"):
        for number in (1, 2, 3):
            run.write_config(f"seed: {number}\n")
    assert contents(run.folder).keys() == {"config.yaml", ".lock"}
    for number in (4, 5):
        (run.folder / "config.yaml").write_text(f"edit {number}")
        with run.locked("pzd run"):
            run.write_config(f"seed: {number}\n")
    assert contents(run.folder)["config.yaml"].endswith("\nseed: 5\n")
    assert copies(run.folder, "config.yaml") == ["edit 4", "edit 5"]


def test_a_number_changed_in_the_written_config_is_an_edit_and_kept(run: Run) -> None:
    with run.locked("pzd run"):
        run.write_config("seed: 1\n")
    path = run.folder / "config.yaml"
    path.write_text(path.read_text().replace("seed: 1", "seed: 9"))
    with run.locked("pzd run"):
        run.write_config("seed: 1\n")
    assert [text.splitlines()[-1] for text in copies(run.folder, "config.yaml")] == ["seed: 9"]


def test_what_a_person_left_beside_the_figures_is_kept(run: Run) -> None:
    def drawn(text: str) -> None:
        with run.locked("pzd figures"):
            run.write_extra("figures", lambda folder: (folder / "fig-01.svg").write_text(text))

    drawn("one")
    drawn("two")
    assert "one" not in contents(run.folder / "figures").values()
    (run.folder / "figures" / "fig-01.svg").write_text("edited")
    (run.folder / "figures" / "notes.txt").write_text("notes")
    drawn("three")
    found = contents(run.folder / "figures")
    assert (found["fig-01.svg"], found["notes.txt"]) == ("three", "notes")
    assert copies(run.folder / "figures", "fig-01.svg") == ["edited"]


# ---------------------------------------------------------------- leftovers


def test_a_command_killed_while_it_wrote_the_config_stops_no_later_one(run: Run) -> None:
    write(run, identified(3.0))
    (run.folder / ".config.yaml.new").write_text("seed: ")
    write(run, identified(4.0))
    assert level(run) == 4.0
    assert not (run.folder / ".config.yaml.new").exists()


def test_what_only_looks_like_a_leftover_is_named_and_left(run: Run, caplog: pytest.LogCaptureFixture) -> None:
    write(run, identified(3.0))
    strange = [".config.yaml.old", ".mine.new", ".5-simulate.new"]
    for name in strange:
        (run.folder / name).write_text("mine")
    (run.folder / ".4-table.old").symlink_to(run.folder.parent)
    write(run, identified(4.0))
    assert level(run) == 4.0
    assert [record.args for record in caplog.records] == [
        (run.folder / name,) for name in sorted([*strange, ".4-table.old"])
    ]
    assert {name: contents(run.folder)[name] for name in strange} == dict.fromkeys(strange, "mine")


@pytest.mark.parametrize("name", [".2-identify.new", ".2-identify.old"])
def test_what_stands_where_we_write_is_named_and_left(run: Run, name: str) -> None:
    write(run, identified(3.0))
    (run.folder / name).write_text("mine")
    with pytest.raises(FilesError) as caught:
        write(run, identified(4.0))
    assert caught.value.messages[0].startswith(f"{run.folder / name}: this stands where ")
    assert (run.folder / name).read_text() == "mine"
    assert level(run) == 3.0


# ---------------------------------------------------------------- links that somebody planted


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    """A folder outside of the run, with a file that nobody may touch."""
    folder = tmp_path / "outside"
    folder.mkdir()
    (folder / "mine.txt").write_text("mine")
    return folder


def test_a_stage_folder_that_is_a_link_is_told_in_one_line_and_left(run: Run, outside: Path) -> None:
    run.folder.mkdir(parents=True)
    (run.folder / "2-identify").symlink_to(outside)
    with pytest.raises(FilesError) as caught:
        write(run, identified(3.0))
    [message] = caught.value.messages
    assert message.startswith(f"{run.folder / '2-identify'}: this is a link (to {outside})")
    assert contents(outside) == {"mine.txt": "mine"}
    assert (run.folder / "2-identify").is_symlink()


@pytest.mark.parametrize("name", ["1-rig", "export", "sweep", "blind", "figures", ".lock"])
def test_no_command_writes_beside_or_through_a_link(run: Run, outside: Path, name: str) -> None:
    run.folder.mkdir(parents=True)
    (run.folder / name).symlink_to(outside / "mine.txt" if name == ".lock" else outside)
    with pytest.raises(FilesError, match="this is a link"):
        write(run, identified(3.0))
    assert contents(outside) == {"mine.txt": "mine"}


def test_a_run_folder_that_is_a_link_is_refused(run: Run, outside: Path) -> None:
    run.folder.parent.mkdir()
    run.folder.symlink_to(outside)
    with pytest.raises(FilesError, match="this is a link"):
        write(run, identified(3.0))
    assert contents(outside) == {"mine.txt": "mine"}


@pytest.mark.parametrize("name", [".holder", ".config.yaml.new", "config.yaml"])
def test_a_link_in_the_place_of_a_file_is_replaced_and_not_followed(run: Run, outside: Path, name: str) -> None:
    run.folder.mkdir(parents=True)
    (run.folder / name).symlink_to(outside / "mine.txt")
    with run.locked("pzd run"):
        run.write_config("seed: 1\n")
    assert contents(outside) == {"mine.txt": "mine"}
    assert not (run.folder / "config.yaml").is_symlink()
    assert (run.folder / "config.yaml").read_text().endswith("\nseed: 1\n")


def test_an_edited_result_is_not_copied_through_a_link_to_nowhere(run: Run, outside: Path) -> None:
    with run.locked("pzd run"):
        run.write_config("seed: 1\n")
        (run.folder / "config.yaml").write_text("edit")
        name = f"config.yaml.edited-{file_hash(run.folder / 'config.yaml')[:8]}"
        (run.folder / name).symlink_to(outside / "planted")
        run.write_config("seed: 1\n")
    assert contents(outside) == {"mine.txt": "mine"}
    assert [path.read_text() for path in run.folder.glob("config.yaml.edited-*") if not path.is_symlink()] == ["edit"]


def test_a_link_deep_in_a_folder_that_is_written_file_by_file_is_found(tmp_path: Path, outside: Path) -> None:
    chunks = tmp_path / "sweep" / "chunks"
    chunks.mkdir(parents=True)
    refuse_links_below(tmp_path / "sweep")
    (chunks / "000000-000003.new").symlink_to(outside / "mine.txt")
    with pytest.raises(FilesError, match="this is a link"):
        refuse_links_below(tmp_path / "sweep")


# ---------------------------------------------------------------- who waits


def test_a_waiting_command_goes_on_where_a_refused_first_run_takes_the_folder_away(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pzd.runs.disk.LOCK_TIMEOUT_S", 30.0)
    failed: list[BaseException] = []

    def wait() -> None:
        try:
            write(run, identified(4.0))
        except BaseException as error:  # noqa: BLE001  # whatever it is, the test tells it
            failed.append(error)

    for _ in range(10):
        with run.locked("pzd run"):
            waiting = threading.Thread(target=wait)
            waiting.start()
            time.sleep(0.02)
        waiting.join()
        assert failed == []
        assert level(run) == 4.0
        shutil.rmtree(run.folder)


def test_a_lock_on_a_file_that_is_no_longer_at_its_path_is_tried_again(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken: list[Path] = []
    acquire = FileLock.acquire

    def unlinked_meanwhile(self: FileLock, **arguments: float) -> object:
        proxy = acquire(self, **arguments)
        if not taken:
            taken.append(Path(self.lock_file))
            Path(self.lock_file).unlink()
        return proxy

    monkeypatch.setattr(FileLock, "acquire", unlinked_meanwhile)
    with run.locked("pzd run"):
        assert (run.folder / ".lock").is_file()
        with pytest.raises(Timeout), FileLock(run.folder / ".lock", timeout=0):
            pass


def test_a_refused_first_run_leaves_nothing(run: Run) -> None:
    with pytest.raises(ConfigError), run.locked("pzd run"):
        raise ConfigError("refused")
    assert not run.folder.parent.exists()


def test_a_folder_removed_under_a_command_is_no_second_fault(run: Run) -> None:
    with run.locked("pzd run"):
        shutil.rmtree(run.folder)
    assert not run.folder.exists()
