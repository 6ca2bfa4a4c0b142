"""`pzd export` writes what a run holds, and refuses in one line where there is nothing to write."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest
from exported_dampers import DAMPERS, content_of
from stub_stages import UNDETERMINED, project

from pzd.cli.app import status
from pzd.export.formats import formats


@pytest.fixture
def typed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, list[str], list[str]]]:
    """Type a command in a folder with a config; gives the exit code and what was printed."""
    project(tmp_path, monkeypatch)
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[int, list[str], list[str]]:
        capsys.readouterr()
        code = status(arguments)
        printed = capsys.readouterr()
        return code, printed.out.splitlines(), printed.err.splitlines()

    return run


def test_the_files_stand_in_the_folder_of_the_run_or_where_out_says(typed) -> None:
    typed("table", "first.yaml")
    code, out, err = typed("export", "first.yaml", "--to", "csv")
    assert (code, err) == (0, [])
    assert out[0] == "export: runs/first/export/first-force.csv"
    assert Path("runs/first/export/first-force.csv").read_text().startswith("# pzd ")
    typed("export", "first.yaml", "--to", "csv", "--out", "elsewhere/far")
    assert sorted(path.name for path in Path("elsewhere/far").iterdir()) == [Path(line).name for line in sorted(out)]
    assert typed("show", "first.yaml")[0] == typed("run", "first.yaml")[0] == 0


def test_json_lists_the_files(typed) -> None:
    typed("table", "first.yaml")
    _, out, _ = typed("export", "first.yaml", "--to", "json", "--json")
    assert json.loads("\n".join(out)) == {
        "format": "json",
        "files": ["runs/first/export/first.json"],
        "not_to_be_trusted": [],
    }


def test_a_run_that_is_not_there_says_what_to_run(typed) -> None:
    assert typed("export", "first.yaml", "--to", "csv") == (
        2,
        [],
        ["runs/first/3-diagnose: there is no result to export yet; pzd table first.yaml makes it"],
    )
    typed("diagnose", "first.yaml")
    assert "runs/first/4-table: there is no result" in typed("export", "first.yaml", "--to", "csv")[2][0]


def test_a_stale_run_says_why_and_what_to_run_and_a_stale_report_does_not_matter(typed) -> None:
    typed("run", "first.yaml")
    code, _, err = typed("export", "first.yaml", "--to", "csv", "--set", "table.speed_points=30")
    assert code == 2
    assert len(err) == 1
    assert err[0].startswith("runs/first: table is stale: ")
    assert err[0].endswith("; pzd table first.yaml --set table.speed_points=30 brings it up to date")
    assert not Path("runs/first/export").exists()
    assert typed("export", "first.yaml", "--to", "csv", "--set", "report.daily_exposure_h=3")[0] == 0


def test_what_it_says_to_type_makes_the_run_and_brings_it_up_to_date(typed) -> None:
    for given in ((), ("--set", "table.speed_points=30")):
        export = ("export", "first.yaml", "--to", "csv", "--runs", "my results", *given)
        code, _, (line,) = typed(*export)
        says = re.search(r"; pzd (.*) (?:makes it|brings it up to date)$", line)
        assert code == 2
        assert typed(*shlex.split(says[1]))[0] == 0
        assert typed(*export)[0] == 0


def test_a_table_that_a_format_cannot_hold_is_refused_with_its_place_in_the_config(
    typed, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Path("first.yaml").open("a") as config:
        config.write("table: {outside: error}\n")
    typed("table", "first.yaml")
    empty = content_of(DAMPERS["plain"], outside="error")
    monkeypatch.setattr("pzd.pipeline.exporting.content_of", lambda _: empty)
    code, out, (line,) = typed("export", "first.yaml", "--to", "c")
    assert (code, out) == (2, [])
    assert line.startswith("first.yaml:4:18: table.outside: --to c cannot hold the empty cells")


def test_a_format_that_there_is_not_gets_the_nearest(typed) -> None:
    typed("table", "first.yaml")
    code, _, err = typed("export", "first.yaml", "--to", "jsom")
    assert (code, err) == (
        2,
        [f"--to: no such format; there are {', '.join(formats())}; did you mean json? (got jsom)"],
    )


def test_a_certificate_goes_with_what_has_dynamics_and_nothing_else(typed) -> None:
    typed("table", "first.yaml")
    code, _, (line,) = typed("export", "first.yaml", "--to", "csv", "--certify")
    assert code == 2
    assert "--certify: runs a form that has dynamics: --to c-dynamics, fmu (got csv)" in line
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed: apt-get install gcc")
    assert typed("export", "first.yaml", "--to", "c-dynamics", "--certify")[0] == 0
    found = json.loads(Path("runs/first/export/certificate.json").read_text())
    assert found["same"]
    assert {one["record"] for one in found["records"]} == {path.stem for path in Path("runs/first/1-rig").glob("*.csv")}


def test_a_waveform_drives_the_stand_and_nothing_else(typed) -> None:
    typed("table", "first.yaml")
    waveform = ("--waveform", "{kind: sine, frequency_Hz: 1, amplitude_m: 0.001}")
    code, _, (line,) = typed("export", "first.yaml", "--to", "csv", *waveform)
    assert code == 2
    assert "--waveform: is what drives the stand, with --to drive (got --to csv)" in line
    assert typed("export", "first.yaml", "--to", "drive", *waveform)[0] == 0
    written = Path("runs/first/export")
    assert sorted(path.suffix for path in written.glob("first-sine-1Hz-0.001m.*")) == [".csv", ".drv", ".mat"]


def test_two_formats_at_once_are_refused(typed) -> None:
    typed("table", "first.yaml")
    code, out, (line,) = typed("export", "first.yaml", "--to", "csv", "--to", "c")
    assert (code, out) == (2, [])
    assert "'--to': takes one format, and so one command each (got csv, c)" in line
    assert not Path("runs/first/export").exists()


def test_without_its_library_a_format_names_the_extra(typed, monkeypatch: pytest.MonkeyPatch) -> None:
    typed("table", "first.yaml")
    monkeypatch.setattr("pzd.export.formats.find_spec", lambda name: None if name == "pyarrow" else find_spec(name))
    code, _, (line,) = typed("export", "first.yaml", "--to", "parquet")
    assert code == 2
    assert "pip install 'pzd[formats]'" in line


def test_a_table_that_was_edited_by_hand_says_so_on_the_screen_and_in_the_file(typed) -> None:
    typed("table", "first.yaml")
    table = Path("runs/first/4-table/force.csv")
    head, *rows = table.read_text().splitlines()
    table.write_text("\n".join([head, rows[0].replace(",0.1,", ",0.2,"), *rows[1:]]) + "\n")
    code, _, err = typed("export", "first.yaml", "--to", "csv")
    assert (code, err) == (0, ["runs/first: edited by hand: 4-table/force.csv; exported as it is"])
    first_line = Path("runs/first/export/first-force.csv").read_text().splitlines()[0]
    assert first_line.endswith(", config first.yaml, edited by hand: 4-table/force.csv: force")


def test_a_damper_that_is_not_to_be_trusted_is_written_and_marked(typed) -> None:
    seed = ("--set", f"seed={UNDETERMINED}")
    typed("table", "first.yaml", *seed)
    code, out, err = typed("export", "first.yaml", "--to", "csv", *seed)
    assert (code, bool(out)) == (4, True)
    assert err[0].startswith("not to be trusted: ")
    first_line = Path("runs/first/export/first-force.csv").read_text().splitlines()[0]
    assert first_line.endswith(f", config first.yaml, {'; '.join(err)}: force")


def test_help_names_every_format(typed) -> None:
    _, out, _ = typed("export", "--help")
    assert all(f"{name}: " in " ".join(out) for name in formats())


def test_what_is_not_from_an_export_is_not_written_over(typed) -> None:
    typed("table", "first.yaml")
    export = ("export", "first.yaml", "--to", "csv", "--out", "elsewhere")
    assert typed(*export)[0] == typed(*export)[0] == 0
    mine = [Path("elsewhere/first-base.csv"), Path("elsewhere/first-force.csv")]
    before = Path("elsewhere/first-inverse.csv").stat().st_mtime_ns
    for path in mine:
        path.write_text("mine")
    code, out, err = typed(*export)
    assert (code, out) == (5, [])
    says = "pzd export did not write this; move it away, or choose another folder by --out"
    assert sorted(err) == [f"{path}: {says}" for path in mine]
    assert [path.read_text() for path in mine] == ["mine", "mine"]
    assert Path("elsewhere/first-inverse.csv").stat().st_mtime_ns == before


@pytest.mark.parametrize("out", [None, "elsewhere"])
@pytest.mark.parametrize(("form", "ending"), [("tir", ".dpr"), ("chrono", "-chrono.json")])
def test_curves_of_an_earlier_export_go_and_nothing_else_does(
    typed, form: str, ending: str, out: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    typed("table", "first.yaml")
    folder = Path(out or "runs/first/export")
    export = ("export", "first.yaml", "--to", form, *(("--out", out) if out else ()))
    many, few = content_of(DAMPERS["plain"]), content_of(DAMPERS["single"])
    named = {"name": "first", "config": "first.yaml"}
    monkeypatch.setattr("pzd.pipeline.exporting.content_of", lambda _: replace(many, **named))
    assert len(typed(*export)[1]) == 3
    foreign = {folder / f"first-mine{ending}": "mine", folder / f"first-9V{ending}": "pzd 1, config first.yaml2"}
    foreign[folder / "first.json"] = "pzd 1, config first.yaml"
    for path, text in foreign.items():
        path.write_text(text)
    monkeypatch.setattr("pzd.pipeline.exporting.content_of", lambda _: replace(few, **named))
    (line,) = typed(*export)[1]
    assert {path for path in folder.iterdir() if path not in foreign} == {Path(line.removeprefix("export: "))}
    assert {path: path.read_text() for path in foreign} == foreign


def test_an_export_follows_no_link_that_stands_in_the_run(typed, tmp_path: Path) -> None:
    typed("table", "first.yaml")
    mine, folder = tmp_path / "mine.txt", Path("runs/first/export")
    mine.write_text("mine")
    folder.mkdir()
    for name in ("first-force.csv", ".first-force.csv.new"):
        (folder / name).symlink_to(mine)
    assert typed("export", "first.yaml", "--to", "csv")[0] == 0
    assert mine.read_text() == "mine"
    assert not (folder / "first-force.csv").is_symlink()
    folder.rename("elsewhere")
    folder.symlink_to(tmp_path / "elsewhere")
    code, _, err = typed("export", "first.yaml", "--to", "csv")
    assert (code, len(err)) == (5, 1)
    assert "this is a link" in err[0]


def test_a_file_where_the_folder_should_be_is_a_fault_of_the_files(typed) -> None:
    typed("table", "first.yaml")
    Path("taken").write_text("mine")
    code, _, err = typed("export", "first.yaml", "--to", "csv", "--out", "taken")
    assert (code, len(err)) == (5, 1)
    assert Path("taken").read_text() == "mine"
