"""Every command with what users type, right and wrong: what it prints, where, and how it exits."""

from __future__ import annotations

import json
import logging
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
import yaml
from stub_stages import NAMES, NEXT_TEST, UNDETERMINED, project

from pzd.artefacts import Diagnosis, Gap, HeldOutTest, HeldOutVoltage, Prediction, Ranked, Region, Value
from pzd.artefacts.diagnosis import Support
from pzd.cli.app import status
from pzd.cli.output import Output, complain
from pzd.config import load
from pzd.damper.effects import library
from pzd.parallel.processes import Progress
from pzd.quantities import Control
from pzd.report.diagnosis_text import diagnosis_lines, headline
from pzd.runs import Run

COMMANDS = [
    *(
        "run",
        "synthesise",
        "ingest",
        "identify",
        "diagnose",
        "table",
        "simulate",
        "report",
        "watch",
        "peers",
        "changes",
    ),
    *("check", "show", "compare", "rate", "export", "figures", "sweep", "blind", "init", "schema", "effects"),
]
HEAVY = ("numba", "pandas", "scipy", "matplotlib", "pint", "jinja2")


class Terminal:
    """A folder in which commands are typed; keeps what they printed."""

    def __init__(self, config: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.config, self.capsys = config, capsys
        self.out: list[str] = []
        self.err: list[str] = []

    def __call__(self, *arguments: str) -> int:
        self.capsys.readouterr()
        code = status(arguments)
        printed = self.capsys.readouterr()
        self.out, self.err = printed.out.splitlines(), printed.err.splitlines()
        return code


@pytest.fixture
def typed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Terminal:
    terminal = Terminal(project(tmp_path, monkeypatch), capsys)
    monkeypatch.chdir(tmp_path)
    return terminal


# ---------------------------------------------------------------- running


def test_run_tells_a_line_a_stage_and_where_the_report_lies(typed: Terminal) -> None:
    assert typed("run", "first.yaml") == 0
    assert typed.err == []
    assert [line.split()[0] for line in typed.out if " runs: " in line] == NAMES
    assert typed.out[-3:] == ["The answer.", "What rides best.", "report: runs/first/6-report/report.html"]
    assert typed("run", "first.yaml") == 0
    assert typed.out[:-3] == [f"{name:<10} fresh: nothing it depends on has changed" for name in NAMES]


def test_every_stage_is_a_command_that_goes_so_far(typed: Terminal) -> None:
    for name, folder in zip(
        NAMES, ("1-rig", "2-identify", "3-diagnose", "4-table", "5-simulate", "6-report"), strict=True
    ):
        assert typed(name, "first.yaml") == 0
        assert (Path("runs/first") / folder / "manifest.json").is_file()
        assert [line.split()[0] for line in typed.out if " runs: " in line] == [name]


def test_results_go_where_runs_says(typed: Terminal, tmp_path: Path) -> None:
    assert typed("run", "first.yaml", "--runs", str(tmp_path / "far" / "away")) == 0
    assert (tmp_path / "far" / "away" / "first" / "6-report" / "report.html").is_file()
    assert not Path("runs").exists()


def test_rig_files_are_looked_for_beside_the_config_wherever_one_stands(
    typed: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert typed("ingest", "../first.yaml") == 0


def test_the_written_config_holds_every_default_and_every_override(typed: Terminal) -> None:
    typed("run", "first.yaml", "--set", "seed=5", "--set", "table.outside=clamp")
    written = Path("runs/first/config.yaml")
    data = yaml.safe_load(written.read_text())
    assert (data["seed"], data["table"]["outside"], data["rig"]["files"][0]["path"]) == (5, "clamp", "data/*.csv")
    assert set(data) == {
        *("seed", "control", "setting", "rig", "identify", "diagnose", "table", "simulate", "report"),
    } | set(data)
    assert load(written) == load(typed.config, ["seed=5", "table.outside=clamp"])


def test_quiet_prints_nothing_but_errors(typed: Terminal) -> None:
    assert typed("run", "first.yaml", "-q") == 0
    assert (typed.out, typed.err) == ([], [])
    assert typed("run", "first.yaml", "-q", "--set", f"seed={UNDETERMINED}") == 4
    assert typed.out == []
    assert len(typed.err) == 1
    assert typed("run", "absent.yaml", "-q") == 2
    assert typed.err == ["absent.yaml: the file is missing; check the path"]


def test_force_runs_again(typed: Terminal) -> None:
    typed("run", "first.yaml")
    assert typed("identify", "first.yaml", "--force") == 0
    assert [line for line in typed.out if "runs: forced" in line] == ["identify   runs: forced"]


def test_what_is_not_to_be_trusted_is_code_4_every_time(typed: Terminal) -> None:
    for _ in range(2):
        assert typed("run", "first.yaml", "--set", f"seed={UNDETERMINED}") == 4
        assert typed.err == ["not to be trusted: rig, 1 V, 22 degC: undetermined: C, the records are too slow"]
        assert Path("runs/first/6-report/report.html").is_file()
    assert typed("ingest", "first.yaml", "--set", f"seed={UNDETERMINED}") == 0


def test_diagnose_tells_the_story(typed: Terminal) -> None:
    typed("diagnose", "first.yaml")
    told = [line for line in typed.out if not re.match(r"[a-z]+ +(runs|done|fresh)", line)]
    assert told[0] == "verdict: none, nothing is missing that the data can show"
    assert told[1] == "reason: 2 records are explained"


# ---------------------------------------------------------------- mistakes


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["rnu", "first.yaml"], 2, "pzd: no such command; did you mean run? (got rnu); see pzd --help"),
        (["zzz"], 2, "pzd: no such command (got zzz); see pzd --help"),
        (["--zzz"], 2, "pzd: No such option: --zzz"),
        (["run"], 2, "pzd run: Missing argument"),
        (["run", "first.yaml", "second.yaml"], 2, "pzd run: Got unexpected extra argument"),
        (["run", "first.yaml", "--frce"], 2, "pzd run: No such option: --frce"),
        (
            ["run", "first.yaml", "--jobs", "many"],
            2,
            "pzd run: Invalid value for '--jobs': must be a whole number, 1 or more (got many)",
        ),
        (
            ["run", "first.yaml", "--jobs", "0"],
            2,
            "pzd run: Invalid value for '--jobs': must be a whole number, 1 or more (got 0)",
        ),
        (["run", "first.yaml", "--set"], 2, "pzd run: Option '--set' requires an argument; see pzd run --help"),
        (
            ["-v", "diagnose", "first.yaml"],
            2,
            "pzd diagnose: options of a command stand behind it: pzd diagnose ... -v",
        ),
        (["--frce"], 2, "pzd: No such option: --frce"),
        (["run", "absent.yaml"], 2, "absent.yaml: the file is missing; check the path"),
        (["run", "first"], 2, "first: the file is missing; did you mean first.yaml?"),
        (["run", "frist.yml"], 2, "frist.yml: the file is missing; did you mean first.yaml?"),
        (["run", "data"], 2, "data: this is a folder, a file is needed"),
        (["run", "first.yaml", "--set", "sed=1"], 2, "--set sed: no such key; did you mean seed? (got sed)"),
        (["run", "first.yaml", "--set", "seed"], 2, "--set seed: must read a.b=VALUE (got seed)"),
        (["run", "first.yaml", "--set", "seed=[1]"], 2, "--set seed: must be a whole number (got [1])"),
        (
            ["run", "first.yaml", "--set", "seed={a: 1}"],
            2,
            "--set seed: VALUE must be one YAML scalar, or a list of them",
        ),
        (["run", "first.yaml", "--set", "rig.files.7.path=X"], 2, "--set rig.files.7.path: the list here has 1 item"),
        (["synthesise", "first.yaml"], 2, "pzd synthesise: the config has rig.files, so the command is pzd ingest"),
        (["run", "first.yaml", "--runs", "first.yaml"], 5, "first.yaml"),
        (["show", "first.yaml"], 2, "runs/first: there are no results yet; pzd run first.yaml makes them"),
        (["show", "absent.yaml"], 2, "absent.yaml: the file is missing"),
        (["check", "absent.yaml"], 2, "absent.yaml: the file is missing"),
        (["compare", "runs/first"], 2, "runs/first: there is no such folder; give the folder of a run"),
        (["compare", "."], 2, ".: this folder holds no run, it has no config.yaml"),
        (["compare", "first.yaml"], 2, "first.yaml: this is a file; give the folder of a run"),
        (["compare"], 2, "pzd compare: Missing argument"),
        (["init", "absent.csv"], 2, "absent.csv: no such file; check the path"),
        (["init", "data"], 2, "data: this is a folder; name the files in it, e.g. data/*.csv"),
        (["rate", "data"], 2, "data: this is a folder; name the files in it, e.g. data/*.csv"),
        (
            ["check", "first.yaml", "--plot", "no/such/page.html"],
            2,
            "--plot no/such/page.html: there is no folder no/such; make it, or name another one",
        ),
        (["init"], 2, "pzd init: Missing argument"),
        (["schema", "first.yaml"], 2, "pzd schema: Got unexpected extra argument"),
    ],
)
def test_a_mistake_is_one_plain_line_on_stderr(typed: Terminal, arguments: list[str], code: int, message: str) -> None:
    assert typed(*arguments) == code
    assert typed.out == []
    assert len(typed.err) == 1
    assert typed.err[0].startswith(message)
    assert "Traceback" not in typed.err[0]


def test_a_record_in_the_place_of_the_config_is_told_what_makes_one(typed: Terminal, tmp_path: Path) -> None:
    (tmp_path / "record.csv").write_text("time_s,displacement_m,force_N\n0,0,0\n", encoding="utf-8")
    assert typed("check", "record.csv") == 2
    assert typed.err[-1].startswith("record.csv: is this a config?")
    assert typed.err[-1].endswith("pzd init prints one for files of a rig")


def test_the_folder_of_a_run_in_the_place_of_its_config_is_told_which_one(typed: Terminal) -> None:
    typed("ingest", "first.yaml")
    assert typed("show", "runs/first") == 2
    assert typed.err == ["runs/first: these are the results of first.yaml; give first.yaml"]


def test_init_of_a_folder_names_the_ending_of_most_of_its_files(typed: Terminal) -> None:
    for name in ("a.txt", "b.txt", "c.tdms"):
        Path("data", name).write_text("")
    Path("data/deep").mkdir()
    for name in ("a", "b"):
        Path(f"data/{name}.csv").unlink()
    assert typed("init", "data") == 2
    assert typed.err == ["data: this is a folder; name the files in it, e.g. data/*.txt"]


def test_a_path_that_matches_no_file_is_a_wrong_config(typed: Terminal) -> None:
    assert typed("run", "first.yaml", "--set", "rig.files.0.path=dta/*") == 2
    (message,) = typed.err
    assert message.startswith("--set rig.files.0.path: no such file")


def test_a_file_of_expected_numbers_at_fault_is_refused_before_anything_runs(typed: Terminal) -> None:
    Path("lab.csv").write_text("id,selector,value,unit\npeak,measures.peak_forc,1,N\n")
    for command in ("run", "report", "check"):
        assert typed(command, "first.yaml", "--set", "report.reference=lab.csv") == 3
        (message,) = typed.err
        assert message.startswith("lab.csv:2: selector: no number of a run is called so; did you mean measures.peak_f")
        assert typed(command, "first.yaml", "--set", "report.reference=makowski2012") == 2
        (message,) = typed.err
        assert message.startswith("--set report.reference: there is no such file; did you mean makowski2021?")
    assert not Path("runs").exists()


def test_a_key_of_an_earlier_version_names_the_one_in_its_place(typed: Terminal) -> None:
    typed.config.write_text(typed.config.read_text() + "report:\n  published: true\n")
    assert typed("run", "first.yaml") == 2
    assert typed.err == ["first.yaml:5:3: report.published: no such key; did you mean reference? (got published)"]


def test_a_setting_that_no_record_has_is_refused_once_the_records_are_known(typed: Terminal) -> None:
    assert typed("run", "first.yaml", "--set", "setting=gap") == 2
    assert [line.split()[0] for line in typed.out] == ["ingest", "ingest"]
    (message,) = typed.err
    assert message.startswith("--set setting: no record of the rig has this setting; there is none that has a name")


def test_every_mistake_of_a_config_is_said_at_once_with_its_place(typed: Terminal) -> None:
    typed.config.write_text("sed: 1\nrig:\n  files:\n    - {path: 3}\ntable: {outside: modle}\n")
    assert typed("run", "first.yaml") == 2
    assert typed.err == [
        "first.yaml:1:1: sed: no such key; did you mean seed? (got sed)",
        "first.yaml:4:14: rig.files.0.path: must be text; put it in quotes (got 3)",
        "first.yaml:5:18: table.outside: must be one of clamp, error, model; did you mean model? (got modle)",
    ]
    assert not Path("runs").exists()


def test_wrong_data_are_code_3_and_every_file_is_listed(typed: Terminal) -> None:
    for name in ("a", "b"):
        Path(f"data/{name}.csv").write_text("nonsense")
    for command in ("run", "check"):
        assert typed(command, "first.yaml") == 3
        assert typed.err == [f"data/{name}.csv:1: a number is needed (got nonsense)" for name in ("a", "b")]
        assert not Path("runs").exists()


def test_control_characters_in_the_header_of_a_rig_file_are_written_out(typed: Terminal) -> None:
    rows = "".join(f"{i / 100},{i % 7}\n" for i in range(50))
    Path("data/a.csv").write_text(
        f"Time [s],Fo\x1b]0;owned\x07\x1b[2J\x9b31m\u202esnoitcurtsni\n{rows}", encoding="utf-8"
    )
    assert typed("init", "data/a.csv") == 0
    printed = "\n".join(typed.out)
    assert r"Fo\x1b]0;owned\x07\x1b[2J\x9b31m\u202esnoitcurtsni" in printed
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202e]", printed)


def test_complaints_hold_no_control_characters(capsys: pytest.CaptureFixture[str]) -> None:
    complain(["a.csv:1: missing column (got \x1b]0;owned\x07)"])
    assert capsys.readouterr().err == "a.csv:1: missing column (got \\x1b]0;owned\\x07)\n"


def test_lines_and_json_for_the_terminal_hold_no_control_characters(capsys: pytest.CaptureFixture[str]) -> None:
    output = Output(quiet=False, verbose=False)
    output.say("a\tb \x1b[31m\rred\x7f")
    output.say_json({"name": "\x1b[31m\x9b\x7f"})
    line, *data = capsys.readouterr().out.split("\n")
    assert line == r"a	b \x1b[31m\x0dred\x7f".replace(r"\t", "\t")
    assert json.loads("\n".join(data)) == {"name": "\x1b[31m\x9b\x7f"}
    assert "\x9b" not in "".join(data)


def test_an_artefact_edited_wrongly_is_code_3_with_file_and_line(typed: Terminal) -> None:
    typed("run", "first.yaml")
    path = Path("runs/first/2-identify/parameters.csv")
    path.write_text(path.read_text().replace("C_Ns_per_m,", "C_kNs_per_m,", 1))
    assert typed("run", "first.yaml") == 3
    assert typed.err[0].startswith(f"{path}:1: the header must read")
    assert "missing: C_Ns_per_m; unknown: C_kNs_per_m" in typed.err[0]


def test_a_second_config_of_the_same_stem_is_refused_and_both_are_named(typed: Terminal, tmp_path: Path) -> None:
    typed("run", "first.yaml")
    shutil.copytree("data", "other/data")
    shutil.copy("first.yaml", "other/first.yaml")
    for command in ("run", "check", "show"):
        assert typed(command, "other/first.yaml") == 2
        assert str(tmp_path / "first.yaml") in typed.err[0]
        assert str(tmp_path / "other" / "first.yaml") in typed.err[0]


def test_a_run_in_use_is_code_5_and_names_who_uses_it(typed: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pzd.runs.disk.LOCK_TIMEOUT_S", 0.1)
    with Run.of(typed.config, Path("runs"), load(typed.config).control.signal()).locked("pzd simulate"):
        assert typed("run", "first.yaml") == 5
    assert typed.err[0].startswith(f"runs/first: pzd simulate (process {os.getpid()} on ")


def test_a_fault_of_ours_is_code_1_in_one_line_with_the_traceback_in_a_file(
    typed: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pzd.pipeline.execution.yaml_text", lambda *_: 1 / 0)
    assert typed("run", "first.yaml") == 1
    (line,) = typed.err
    found = re.fullmatch(
        r"pzd: this is a fault of pzd, not yours: ZeroDivisionError: division by zero"
        r" \(traceback in (\S+); -v shows it\)",
        line,
    )
    assert found
    assert "Traceback (most recent call last)" in Path(found[1]).read_text()
    Path(found[1]).unlink()
    assert typed("run", "first.yaml", "-v") == 1
    assert "Traceback (most recent call last):" in typed.err
    Path(re.findall(r"traceback in (\S+);", typed.err[-1])[0]).unlink()


def test_an_interrupt_is_code_130_and_leaves_what_was_there(typed: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    typed("run", "first.yaml")

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("pzd.artefacts.Table.write", interrupted)
        assert typed("run", "first.yaml", "--force") == 130
    assert typed.err == ["interrupted; finished stages stand, the one at work left what was there before"]
    assert typed("run", "first.yaml") == 0
    assert not any("table" in line and "runs:" in line for line in typed.out)


def test_a_full_disk_is_code_5(typed: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device", "runs/first/2-identify")

    monkeypatch.setattr("pzd.artefacts.Identified.write", refuse)
    assert typed("run", "first.yaml") == 5
    assert typed.err == ["runs/first/2-identify: No space left on device"]


# ---------------------------------------------------------------- looking


def files_below(folder: Path) -> set[Path]:
    return set(folder.rglob("*"))


def test_check_says_what_it_found_and_writes_nothing(typed: Terminal, tmp_path: Path) -> None:
    before = files_below(tmp_path)
    assert typed("check", "first.yaml") == 0
    assert typed.out == [
        "a: 0 cycles at 1 Hz",
        "b: 0 cycles at 1 Hz",
        "2 records, 0 findings; the config is in order, nothing was written",
    ]
    assert typed("check", "first.yaml", "--set", "setting=gap") == 2
    assert typed.out == ["a: 0 cycles at 1 Hz", "b: 0 cycles at 1 Hz"]  # the preflight of all, whatever the setting
    assert files_below(tmp_path) == before


BINARY = b"$KD_DEFINITION\n#:KRBI\nD:long section 1,m\n" + b"$" * 72 + b"\n\x00\x7f\xc0\x00"


@pytest.mark.parametrize(
    ("kind", "name", "content", "says"),
    [
        ("file", "gone.csv", None, "there is no such file; the path counts from the config (got gone.csv)"),
        (
            "file",
            "short.csv",
            b"distance_m,height_m\n0,0\n100,0.01\n",
            "make simulate.duration_s 4 s or less, or",
        ),
        ("file", "wrong.csv", b"s,z\n0,0\n", "wrong.csv:1: the header must be distance_m,height_m (got s,z)"),
        ("opencrg", "binary.crg", BINARY, "of the forms LRFI and LDFI are read; save it as one of them (got KRBI)"),
        ("opencrg", "zip.crg", b"PK\x03\x04\xff\x00", "no line of $ signs begins the data; is it an OpenCRG file?"),
    ],
)
@pytest.mark.parametrize("flags", [(), ("--json",)], ids=["text", "json"])
def test_check_opens_the_roads_and_tells_where_and_what_to_do(
    typed: Terminal, tmp_path: Path, kind, name, content, says, flags
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    config = typed.config.read_text(encoding="utf-8")
    roads = f"simulate:\n  roads:\n    - {{kind: sine, frequency_Hz: 2}}\n    - {{kind: {kind}, path: {name}}}\n"
    typed.config.write_text(f"{config}\n{roads}", encoding="utf-8")
    line = typed.config.read_text(encoding="utf-8").splitlines().index(roads.splitlines()[3]) + 1
    assert typed("check", "first.yaml", *flags) == 2
    assert len(typed.err) == 1
    assert re.match(rf"first\.yaml:{line}:\d+: simulate\.roads\.1\.path: ", typed.err[0])
    assert says in typed.err[0]


def test_show_prints_the_numbers_of_the_run_and_writes_nothing(typed: Terminal, tmp_path: Path) -> None:
    typed("run", "first.yaml")
    before = files_below(tmp_path)
    assert typed("show", "first.yaml") == 0
    text = "\n".join(typed.out)
    for part in ("200 (200 to 200)", "verdict: none", "sine-comfort-ideal", "a_w", "verified", "report.html"):
        assert part in text
    assert "assumed, since the config does not say it:" in typed.out
    assert any(line.startswith("  the car is makowski2021: 1200 kg") for line in typed.out)
    assert files_below(tmp_path) == before


def test_show_prints_what_there_is_after_a_part_of_the_stages(typed: Terminal) -> None:
    typed("identify", "first.yaml")
    assert typed("show", "first.yaml") == 0
    assert "report: not written yet" in typed.out
    assert not any("verdict" in line for line in typed.out)


def test_report_opens_its_page_in_the_browser(typed: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: bool(opened.append(address) or True))
    assert typed("report", "first.yaml") == 0
    assert opened == []
    assert typed("report", "first.yaml", "--open") == 0
    assert opened == [Path("runs/first/6-report/report.html").resolve().as_uri()]


def test_where_no_browser_is_found_the_page_is_named(typed: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("webbrowser.open", lambda address: False)
    assert typed("report", "first.yaml", "--open") == 5
    assert typed.err == ["runs/first/6-report/report.html: no browser was found to open it; open the file by hand"]


def test_show_says_what_is_not_to_be_trusted(typed: Terminal) -> None:
    typed("run", "first.yaml", "--set", f"seed={UNDETERMINED}")
    assert typed("show", "first.yaml") == 0
    assert [line for line in typed.out if line.startswith("not to be trusted: rig")]


def stale(typed: Terminal) -> list[str]:
    return [line for line in typed.out if line.startswith("stale: ")]


def test_numbers_of_the_config_as_it_is_are_not_called_stale(typed: Terminal) -> None:
    typed("run", "first.yaml")
    for look in (["show", "first.yaml"], ["compare", "runs/first"]):
        assert typed(*look) == 0
        assert stale(typed) == []


def test_show_and_compare_say_what_is_of_an_older_config_and_why(typed: Terminal) -> None:
    typed("run", "first.yaml")
    with typed.config.open("a") as file:
        file.write("table: {speed_max_m_per_s: 2}\n")
    wanted = [
        "table: table.speed_max_m_per_s has changed",
        "simulate: it is made from table",
        "report: it is made from simulate",
    ]
    assert typed("show", "first.yaml") == 0
    assert typed.out[1:4] == [f"stale: {line}" for line in wanted]
    assert "comfort:" in typed.out
    assert typed("compare", "runs/first") == 0
    assert stale(typed) == [f"stale: runs/first: {line}" for line in wanted]
    typed("table", "first.yaml")
    typed("show", "first.yaml")
    assert [line.split(":")[1] for line in stale(typed)] == [" simulate", " report"]


def test_show_says_stale_where_a_rig_file_has_changed_or_gone(typed: Terminal) -> None:
    typed("run", "first.yaml")
    Path("data/a.csv").write_text("101")
    typed("show", "first.yaml")
    assert stale(typed)[0] == "stale: ingest: data/a.csv has changed"
    assert len(stale(typed)) == len(NAMES)
    for name in ("a", "b"):
        Path(f"data/{name}.csv").unlink()
    typed("compare", "runs/first")
    assert stale(typed)[0] == "stale: runs/first: ingest: 2 files of data have changed"


def test_a_number_mended_by_hand_makes_stale_what_hangs_on_it_and_not_itself(typed: Terminal) -> None:
    typed("run", "first.yaml", "--set", f"seed={UNDETERMINED}")
    path = Path("runs/first/2-identify/parameters.csv")
    path.write_text(path.read_text().replace("200.0,200.0,200.0,,,,", "200.0,200.0,200.0,5,4,6,"))
    show = ["show", "first.yaml", "--set", f"seed={UNDETERMINED}"]
    typed(*show)
    assert [line.split(":")[1].strip() for line in stale(typed)] == ["diagnose", "table", "simulate", "report"]
    typed("run", "first.yaml", "--set", f"seed={UNDETERMINED}")
    typed(*show)
    assert stale(typed) == []


def test_show_reads_what_an_older_config_called_by_another_name(typed: Terminal) -> None:
    typed("run", "first.yaml")
    typed.config.write_text("control: {name: current, unit: A}\n" + typed.config.read_text())
    assert typed("show", "first.yaml") == 0
    assert "stale: ingest: control.name has changed, control.unit has changed" in typed.out


def test_compare_says_where_the_config_of_a_run_is_gone_or_broken(typed: Terminal) -> None:
    typed("run", "first.yaml")
    typed.config.write_text("rig: 1\n")
    assert typed("compare", "runs/first") == 0
    assert stale(typed)[0].startswith("stale: runs/first: all: their config would be refused: first.yaml:1:6: ")
    typed.config.unlink()
    assert typed("compare", "runs/first") == 0
    assert stale(typed)[0].startswith("stale: runs/first: all: their config first.yaml is missing")


def test_compare_sets_runs_side_by_side(typed: Terminal) -> None:
    shutil.copy("first.yaml", "second.yaml")
    typed("run", "first.yaml")
    typed("run", "second.yaml", "--set", "seed=7", "--set", "rig.files.0.path=data/a.csv")
    assert typed("compare", "runs/first", "runs/second") == 0
    rows = {re.split(r"  +", line)[0]: re.split(r"  +", line)[1:] for line in typed.out[1:]}
    assert typed.out[0].split() == ["runs/first", "runs/second"]
    assert rows["T0 [N], 1 V, 22 degC"] == ["200 (200 to 200)", "100 (100 to 100)"]
    assert rows["k [N/m], 1 V, 22 degC"] == ["1e+05 (no interval)", "7e+05 (no interval)"]
    assert rows["verdict"] == ["none", "none"]
    assert rows["sine-comfort-ideal: peak |a_K| at K [m/s2]"] == ["200", "100"]


def test_compare_matches_conditions_whatever_the_runs_call_their_setting_and_says_which_damper_it_is(
    typed: Terminal,
) -> None:
    shutil.copy("first.yaml", "second.yaml")
    typed("run", "first.yaml", "--set", "rig.files.0.setting=gap 0.25 mm")
    typed("identify", "second.yaml")
    assert typed("compare", "runs/first", "runs/second") == 0
    rows = {re.split(r"  +", line)[0]: re.split(r"  +", line)[1:] for line in typed.out[1:]}
    assert rows["T0 [N], 1 V, 22 degC"] == ["200 (200 to 200)", "200 (200 to 200)"]
    assert rows["T0, C and k of"] == ["adopted damper", "simple model"]
    assert len(rows["W_s of the simple model, 1 V, 22 degC"]) == 2
    assert not any("gap 0.25 mm" in name for name in rows)


def test_compare_prints_of_the_comfort_a_w_and_every_measure_where_it_is_asked(typed: Terminal) -> None:
    typed("run", "first.yaml")
    written = Path("runs/first/6-report/comfort.csv")
    (head, row, *_) = written.read_text().splitlines()
    written.write_text("\n".join([head, row, row.replace("a_w", "mtvv")]) + "\n")
    assert typed("compare", "runs/first") == 0
    assert [": a_w at" in line for line in typed.out if ": a_w at" in line or "mtvv" in line] == [True]
    assert "further measures of comfort: --verbose prints them" in typed.out
    assert typed("compare", "runs/first", "--verbose") == 0
    assert any(": mtvv at" in line for line in typed.out)


def test_compare_writes_a_page_into_the_last_run(typed: Terminal) -> None:
    shutil.copy("first.yaml", "second.yaml")
    typed("run", "first.yaml")
    typed("run", "second.yaml", "--set", "seed=7", "--set", "rig.files.0.path=data/a.csv")
    assert typed("compare", "runs/first", "runs/second") == 0
    assert typed.out[-1] == "page: runs/second/compare/first--and--second.html"
    page = Path("runs/second/compare/first--and--second.html").read_text(encoding="utf-8")
    assert "Where does second differ from first?" in page
    assert "stale: runs/second: " in page
    assert typed("compare", "runs/second", "runs/first") == 0
    assert typed("compare", "runs/first", "runs/first") == 0
    assert not any(line.startswith("page: ") for line in typed.out)
    again = Path("runs/first/compare/second--and--first.html").read_bytes()
    assert typed("compare", "runs/second", "runs/first") == 0
    assert Path("runs/first/compare/second--and--first.html").read_bytes() == again


def test_compare_puts_a_dash_where_a_run_has_no_such_number(typed: Terminal) -> None:
    shutil.copy("first.yaml", "second.yaml")
    typed("run", "first.yaml")
    typed("identify", "second.yaml")
    assert typed("compare", "runs/second", "runs/first") == 0
    (verdict,) = [line for line in typed.out if line.startswith("verdict")]
    assert verdict.split() == ["verdict", "-", "none"]


def test_the_control_goes_by_its_own_name(typed: Terminal) -> None:
    typed.config.write_text("control: {name: current, unit: A}\n" + typed.config.read_text())
    assert typed("run", "first.yaml") == 0
    assert Path("runs/first/2-identify/parameters.csv").read_text().startswith("setting,current_A,")
    typed("show", "first.yaml")
    assert any("current [A]" in line for line in typed.out)
    assert typed("compare", "runs/first") == 0
    assert any(line.startswith("T0 [N], 1 A, 22 degC") for line in typed.out)


# ---------------------------------------------------------------- for other programs


def printed_json(typed: Terminal, *arguments: str) -> Any:
    assert typed(*arguments, "--json") == 0
    return json.loads("\n".join(typed.out))


def test_check_as_json_holds_every_record_with_its_findings(typed: Terminal) -> None:
    found = printed_json(typed, "check", "first.yaml", "--set", "control.name=current", "--set", "control.unit=A")
    assert found["config"] == "first.yaml"
    assert [(one["name"], one["cycles"], one["current_A"], one["findings"]) for one in found["records"]] == [
        ("a", 0.0, 1.0, []),
        ("b", 0.0, 1.0, []),
    ]
    assert not Path("runs").exists()


def test_show_as_json_holds_what_show_prints(typed: Terminal) -> None:
    typed("identify", "first.yaml", "--set", f"seed={UNDETERMINED}")
    found = printed_json(typed, "show", "first.yaml")
    assert (found["run"], found["report"], found["diagnosis"], found["rides"]) == ("runs/first", None, None, [])
    assert found["stale"] == {"identify": "seed has changed"}
    assert len(found["not_to_be_trusted"]) == 1
    typed("run", "first.yaml")
    found = printed_json(typed, "show", "first.yaml")
    assert (found["stale"], found["not_to_be_trusted"]) == ({}, [])
    assert (found["parameters"][0]["T0_N"], found["parameters"][0]["C_Ns_per_m"]) == (200.0, 2.0)
    assert (found["diagnosis"]["verdict"], found["rides"][0]["peak_abs_aK_m_per_s2"]) == ("none", 200.0)
    assert found["comfort"][0]["measure"] == "a_w"
    assert found["report"] == "runs/first/6-report/report.html"


def test_compare_as_json_holds_the_runs_as_show_does(typed: Terminal) -> None:
    shutil.copy("first.yaml", "second.yaml")
    typed("run", "first.yaml")
    typed("identify", "second.yaml")
    shown = [printed_json(typed, "show", name) for name in ("second.yaml", "first.yaml")]
    assert printed_json(typed, "compare", "runs/second", "runs/first") == shown


def test_effects_as_json_hold_every_parameter(typed: Terminal) -> None:
    found = printed_json(typed, "effects")
    assert [(one["name"], p["name"]) for one in found for p in one["parameters"]] == [
        (effect.name, p.name) for effect in library().values() for p in effect.parameters
    ]


@pytest.mark.parametrize("command", ["check", "show"])
def test_a_mistake_is_a_line_on_stderr_also_where_json_is_wanted(typed: Terminal, command: str) -> None:
    assert typed(command, "absent.yaml", "--json") == 2
    assert (typed.out, len(typed.err)) == ([], 1)


# ---------------------------------------------------------------- starting


def test_schema_describes_every_block(typed: Terminal) -> None:
    assert typed("schema") == 0
    schema = json.loads("\n".join(typed.out))
    assert {"seed", "control", "setting", "rig", "identify", "table"} <= set(schema["properties"])


def test_effects_lists_every_parameter_of_every_effect(typed: Terminal) -> None:
    assert typed("effects") == 0
    listed = [tuple(line.split()[:3:2]) for line in typed.out[1:]]
    assert listed == [(effect.name, p.name) for effect in library().values() for p in effect.parameters]


def test_init_maps_headers_and_leaves_unknown_units_to_be_filled_in(typed: Terminal) -> None:
    for name in ("one", "two"):
        Path(f"data/{name}.csv").write_text("Time [s];Position;Load (kN);U\n0;1;2;3\n1;2;3;4\n")
    assert typed("init", "data/one.csv", "data/two.csv") == 0
    text = "\n".join(typed.out)
    entries = yaml.safe_load(text)["rig"]["files"]
    assert [entry["path"] for entry in entries] == ["data/one.csv", "data/two.csv"]
    assert entries[0]["columns"] == {
        "time": "Time [s]",
        "displacement": "Position",
        "force": "Load (kN)",
        "voltage": "U",
    }
    assert entries[0]["units"] == {"displacement": None, "voltage": None}
    assert "fill in: Position names no unit" in text


def test_init_needs_nothing_more_for_canonical_columns(typed: Terminal, tmp_path: Path) -> None:
    Path("rig").mkdir()
    for name in ("one", "two"):
        Path(f"rig/{name}.csv").write_text(
            "time_s,displacement_m,force_N,voltage_V,temperature_C\n0,1,2,3,4\n1,2,3,4,5\n"
        )
    assert typed("init", "rig/one.csv", "rig/two.csv") == 0
    (tmp_path / "made.yaml").write_text("\n".join(typed.out))
    config = load(tmp_path / "made.yaml")
    assert config.rig.files is not None
    assert [entry.path for entry in config.rig.files] == ["rig/*.csv"]


def test_init_says_which_quantity_it_did_not_find(typed: Terminal) -> None:
    """Of the columns that hold nothing else, and have a name."""
    Path("odd.csv").write_text("a1,b1,force_N,\n1,2,3,\n")
    assert typed("init", "odd.csv") == 0
    assert any(
        line.endswith("time:   # fill in: one of a1, b1; or say rate_Hz: N instead, where no column holds it")
        for line in typed.out
    )


# ---------------------------------------------------------------- the story


def diagnosis() -> Diagnosis:
    gap = Gap(
        before=0.0121,
        after=0.0009,
        noise_floor=0.0008,
        standard_error=0.00004,
        held_out=("r03", "r09"),
        hold_out="records",
    )
    return Diagnosis(
        verdict="named",
        reason="only orifice_quadratic closes the gap",
        effects=("orifice_quadratic",),
        confidence=0.97,
        gap=gap,
        parameters={"orifice_quadratic": {"q": Value(value=1510.0, low95=1490.0, high95=1530.0, unit="N s2/m2")}},
        ranking=(
            Ranked(effect="orifice_quadratic", gap_after=0.0009, delta_bic=-5120.3, parameters={}, reason="adopted"),
            Ranked(effect="lash", gap_after=0.012, delta_bic=3.0, parameters={}, reason="closes nothing"),
        ),
        rivals=("shear_thinning",),
        where=(Region(region="abs(v) > 0.25 m/s, 150 V", share_of_gap=0.71),),
        next_test=NEXT_TEST,
    )


def test_the_story_tells_what_a_test_between_two_voltages_is_for() -> None:
    test = NEXT_TEST.model_copy(update={"separates": (), "voltage_V": 75.0, "between_voltage_V": (50.0, 100.0)})
    told = diagnosis_lines(diagnosis().model_copy(update={"next_test": test}), Control())[-1]
    assert told.startswith("next test: ")
    assert told.endswith("since between 50 and 100 V the force is known least")


def test_the_story_tells_every_kept_back_test_where_it_is_asked_to() -> None:
    kept_back = Prediction(
        hold_out="tests",
        by=(HeldOutTest(record="r03", voltage=100.0, W_s_plain=0.012, W_s=0.003, R2_plain=0.9871, R2=0.99675),),
        W_s_plain=0.011,
        W_s=0.004,
        left_out_voltages=(HeldOutVoltage(voltage=50.0, W_s_plain=0.02, W_s=0.01),),
    )
    predicted = diagnosis().model_copy(update={"prediction": kept_back})
    whole = "prediction of whole tests kept back: W_s 0.011 plain, 0.004 as handed on"
    each = [
        "kept back: r03 at 100 V, W_s 0.012 plain, 0.003 as handed on; R2 0.9871 and 0.9968",
        "left out: 50 V, predicted from its neighbours with W_s 0.02 plain, 0.01 as handed on",
    ]
    plain = diagnosis_lines(diagnosis(), Control())
    assert diagnosis_lines(predicted, Control()) == [*plain[:3], whole, each[-1], *plain[3:]]
    assert diagnosis_lines(predicted, Control(), every_test=True) == [*plain[:3], whole, *each, *plain[3:]]


@pytest.mark.parametrize(("third", "told"), [(100.0, True), (None, False), (50.0, False)])
def test_between_two_levels_a_line_is_taken_unless_something_shows_it(third: float | None, told: bool) -> None:
    levels = (0.0, 100.0, third)
    by = tuple(HeldOutTest(record=f"r{n}", voltage=u, W_s_plain=0.01, W_s=0.01) for n, u in enumerate(levels))
    kept_back = Prediction(hold_out="tests", by=by, W_s_plain=0.01, W_s=0.01, left_out_voltages=())
    lines = diagnosis_lines(diagnosis().model_copy(update={"prediction": kept_back}), Control())
    assert any("no third level was tested" in line for line in lines) is told


def test_the_story_of_a_diagnosis_in_ten_lines() -> None:
    assert diagnosis_lines(diagnosis(), Control()) == [
        "verdict: named, one answer fits, and no other does",
        "reason: only orifice_quadratic closes the gap",
        "gap on what no fit has seen (2 records): W_s 0.0121 before, 0.0009 after, 93% less; noise alone gives 0.0008",
        "where: abs(v) > 0.25 m/s, 150 V, 71% of the gap",
        "adopted: orifice_quadratic, q = 1510 (1490 to 1530) N s2/m2",
        "confidence: 97%",
        "rivals: shear_thinning",
        "not taken: lash, W_s 0.012 against 0.0009 on the tests seen, closes nothing",
        (
            "next test: sine 4 Hz 0.01 m about 0.03135 m at 150 V, up to 0.2513 m/s and 1512 N"
            " to tell orifice_quadratic from shear_thinning"
        ),
    ]


@pytest.mark.parametrize(
    ("own", "told"),
    [
        (0.00007, "noise alone gives 0.0008"),
        (0.0002, "noise with the zero, gain and delay that each test may have gives 0.0008"),
    ],
)
def test_the_story_says_where_the_floor_is_not_noise_alone(own: float, told: str) -> None:
    found = diagnosis()
    assert found.gap is not None
    line = diagnosis_lines(found.model_copy(update={"gap": found.gap.model_copy(update={"tests_own": own})}), Control())
    assert line[2].endswith(f"; {told}")


@pytest.mark.parametrize(
    ("effects", "rivals", "told"),
    [
        (("gas_spring",), ("fluid_inertia",), " that it is gas_spring or fluid_inertia, alone or together"),
        (("lash", "end_stop"), ("gas_spring",), " that it is lash or end_stop or gas_spring, alone or together"),
        ((), ("lash",), " that it is nothing or lash"),
        (("lash", "end_stop"), (), ""),
    ],
)
def test_the_confidence_is_that_of_all_adopted_effects_together_or_of_a_rival(
    effects: tuple[str, ...], rivals: tuple[str, ...], told: str
) -> None:
    changes = {"verdict": "ambiguous", "effects": effects, "rivals": rivals, "parameters": {}}
    assert f"confidence: 97%{told}" in diagnosis_lines(diagnosis().model_copy(update=changes), Control())


def test_intervals_beside_a_force_without_a_name_say_what_they_leave_out() -> None:
    unexplained = diagnosis().model_copy(update={"verdict": "unexplained"})
    told = [line for line in diagnosis_lines(unexplained, Control()) if line.startswith("intervals: ")]
    assert told == [
        "intervals: these count noise and how the tests differ; what has no name may move the values by more"
    ]
    assert not any(line.startswith("intervals: ") for line in diagnosis_lines(diagnosis(), Control()))


def test_the_story_of_an_unexplained_gap_begins_with_what_is_known() -> None:
    """The effect that closes most comes first; one that is open, or closes nothing, is not listed."""
    shares = {"gas_spring": (0.09, "likely"), "rounded_yield": (0.61, "certain"), "lash": (0.3, "open")}
    shares["sensor_delay"] = 0.004, "certain"
    support = {
        name: Support.model_validate(
            {"share": share, "folds_better": 5, "folds": 5, "replaced_by": None, "confidence": 0.95, "sure": sure}
        )
        for name, (share, sure) in shares.items()
    }
    known = diagnosis().model_copy(update={"verdict": "unexplained", "support": support, "left_of_peak": 0.0612})
    assert diagnosis_lines(known, Control())[0] == (
        "verdict: unexplained, but rounded yield is certain (61% of the gap comes back without it), "
        "gas spring is likely (9% of the gap comes back without it); 6.1 % of peak has no name"
    )
    added = {
        **support,
        "bouc_wen": support["rounded_yield"].model_copy(update={"share": 0.2, "added": True, "sure": "open"}),
    }
    assert diagnosis_lines(known.model_copy(update={"support": added}), Control())[0] == (
        "verdict: unexplained, but rounded yield is certain (61% of the gap comes back without it), "
        "gas spring is likely (9% of the gap comes back without it); "
        "bouc wen (20% of the gap comes back without it) predicts, whatever it stands for; 6.1 % of peak has no name"
    )
    doubtful = {"bouc_wen": added["bouc_wen"].model_copy(update={"confidence": 0.8})}
    assert "bouc wen" not in headline(known.model_copy(update={"support": {**support, **doubtful}}))
    alone = {
        name: added[name].model_copy(update={"added": True, "sure": "open"}) for name in ("rounded_yield", "gas_spring")
    }
    assert diagnosis_lines(known.model_copy(update={"support": alone}), Control())[0] == (
        "verdict: unexplained, but rounded yield (61% of the gap comes back without it) and gas spring (9% of the gap "
        "comes back without it) predict, whatever they stand for; 6.1 % of peak has no name"
    )
    bare = known.model_copy(update={"support": {}})
    assert diagnosis_lines(bare, Control())[0].startswith("verdict: unexplained, a gap that repeats")


def test_the_headline_of_a_doubtful_verdict_does_not_say_that_nothing_else_fits() -> None:
    for verdict, sure in (("named", "no other does"), ("none", "nothing is missing")):
        told = diagnosis().model_copy(update={"verdict": verdict, "support": {}})
        assert sure in headline(told.model_copy(update={"confidence": 0.95}))
        assert sure not in headline(told.model_copy(update={"confidence": 0.02}))


def test_a_parameter_that_moves_with_the_voltage_is_told_at_each() -> None:
    value = Value(value=(1.0, 2.0), low95=(0.9, 1.9), high95=(1.1, 2.1), unit="N", at_voltage_V=(0.0, 150.0))
    told = diagnosis_lines(
        diagnosis().model_copy(update={"parameters": {"orifice_quadratic": {"q": value}}}), Control("current", "A")
    )
    assert "adopted: orifice_quadratic, q = 1 N at 0 A; 2 N at 150 A" in told


# ---------------------------------------------------------------- as a program


Command = Callable[..., "subprocess.CompletedProcess[str]"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent.parent)}


def test_help_lists_every_command(pzd: Command) -> None:
    printed = pzd("--help")
    assert (printed.returncode, printed.stderr) == (0, "")
    listed = re.findall(r"^  ([a-z]+)  +\S", printed.stdout.partition("Commands:")[2], re.MULTILINE)
    assert listed == COMMANDS
    assert not re.search("[╭│╰]|\x1b", printed.stdout)
    assert pzd().stdout == printed.stdout


def test_the_version_is_that_of_the_installed_package(typed: Terminal) -> None:
    assert typed("--version") == 0
    assert typed.out == [f"pzd {version('pzd')}"]


@pytest.mark.parametrize(
    ("words", "completed"),
    [("pzd i", ["ingest", "identify", "init"]), ("pzd show --j", ["--json"]), ("pzd run first.yaml --f", ["--force"])],
)
def test_the_shell_completes_commands_and_options(words: str, completed: list[str]) -> None:
    asked = {"_PZD_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    ended = subprocess.run(
        [sys.executable, "-m", "pzd"], capture_output=True, text=True, check=True, env=ENVIRONMENT | asked
    )
    assert ended.stdout.split() == completed


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(typed: Terminal, command: str) -> None:
    assert typed(command, "--help") == 0
    assert typed.out[0].startswith(f"Usage: pzd {command} ")


IMPORTING = """
import json, sys
from types import SimpleNamespace as S

def tell(step, *more):
    loaded = [name for name in (*{heavy!r}, *more) if name in sys.modules]
    print(json.dumps([step, loaded]), file=sys.stderr)

from pzd.cli.app import status
status(['--help'])
tell('help', 'numpy', 'pydantic', 'yaml')

from pzd.damper.effects import library
from pzd.damper.model import Damper
assert {{'bouc_wen', 'cavitation', 'frame_compliance'}} <= set(library())
base = ({{'T0_N': 300, 'C_Ns_per_m': 2500, 'k_N_per_m': 2e5}},)
Damper(base=base, effects={{'gas_spring': {{'k_g': 1000}}}})
tell('a config that names effects')

from pzd.pipeline.stages import stages
import pzd.pipeline.command, pzd.pipeline.dependencies, pzd.pipeline.run_summary
stages(S(rig=S(virtual=None), car=True))
tell('all is fresh')
"""
"""What is loaded after each of three steps of one process, the lightest first."""


def test_nothing_heavy_is_imported_for_help_nor_to_read_effects_nor_to_find_that_all_is_fresh() -> None:
    """Help imports neither numbers nor what checks them, and reading a config that names effects compiles no law."""
    text = IMPORTING.format(heavy=HEAVY)
    printed = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=False, env=ENVIRONMENT)
    assert printed.returncode == 0, printed.stderr
    told = [json.loads(line) for line in printed.stderr.splitlines()]
    assert told == [["help", []], ["a config that names effects", []], ["all is fresh", []]]


def test_a_closed_pipe_is_quiet() -> None:
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "w") as closed:
        ended = subprocess.run(
            [sys.executable, "-m", "pzd", "schema"],
            stdout=closed,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            env=ENVIRONMENT,
        )
    assert ended.stderr == ""
    assert ended.returncode == 0


def opened_by_reader(pipe: Path) -> int:
    """The pipe's end for writing, as soon as somebody reads at the other."""
    deadline = time.monotonic() + 120.0  # a busy machine starts Python slowly
    while True:
        try:
            return os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)
        except OSError:
            assert time.monotonic() < deadline
            time.sleep(0.02)


def interrupted(running: subprocess.Popen[str]) -> str:
    """What it says to Ctrl-C, pressed again while it does not end: one that comes right before it waits is lost."""
    for _ in range(60):
        running.send_signal(signal.SIGINT)
        try:
            return running.communicate(timeout=2.0)[1]
        except subprocess.TimeoutExpired:
            continue
    return ""


def test_ctrl_c_is_code_130_in_one_line(tmp_path: Path) -> None:
    pipe = tmp_path / "slow.yaml"
    os.mkfifo(pipe)  # reading it waits for somebody who writes
    command = [sys.executable, "-m", "pzd", "run", "slow.yaml"]
    # A shell starts jobs in the background with Ctrl-C ignored, and whoever they start inherits that.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=tmp_path, env=ENVIRONMENT) as running:
        signal.signal(signal.SIGINT, before)
        end = opened_by_reader(pipe)
        try:
            err = interrupted(running)
        finally:
            running.kill()  # else leaving waits for it
            os.close(end)
    assert running.returncode == 130
    assert err.count("\n") == 1
    assert err.startswith("interrupted; ")


PRESSED_AT = """
import importlib.abc, os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever started the tests may ignore it

class Pressed(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == {module!r}:
            exec("os.kill(os.getpid(), signal.SIGINT)\\nfor _ in range(9): pass")  # as dataclasses are made

sys.meta_path.insert(0, Pressed())
"""


@pytest.mark.parametrize("module", ["pzd.cli.app", "typer", "pzd.cli.look", "pydantic", "pzd.damper.effects"])
def test_ctrl_c_while_the_program_starts_is_code_130_in_one_line(tmp_path: Path, module: str) -> None:
    (tmp_path / "sitecustomize.py").write_text(PRESSED_AT.format(module=module))
    environment = {**ENVIRONMENT, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ENVIRONMENT['PYTHONPATH']}"}
    command = [sys.executable, "-m", "pzd", "effects"]
    ended = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert ended.stderr == "interrupted; finished stages stand, the one at work left what was there before\n"
    assert ended.returncode == 130
    assert ended.stdout == ""


SLOW = """
import sys, time
from concurrent.futures import ThreadPoolExecutor
sys.path[:0] = [{here!r}, {root!r}]
import stub_stages
from pzd.artefacts import Identified, Rig
from pzd.identification.config import IdentifyConfig
from pzd.pipeline import command
from pzd.pipeline.stages import Stage

def identify(identify: IdentifyConfig, rig: Rig, seed: int) -> Identified:
    with ThreadPoolExecutor(2) as pool:
        futures = [pool.submit(time.sleep, 30) for _ in range(4)]
        print("at work", flush=True)
        futures[0].result()

identify.__module__ = "pzd.identification.stage"
command.stages = lambda config: tuple(
    Stage("identify", identify) if stage.name == "identify" else stage for stage in stub_stages.stages(config)
)
sys.argv = ["pzd", "run", "first.yaml"]
from pzd.cli import main
main()
"""


def test_an_interrupted_command_does_not_wait_for_its_threads_and_the_next_one_goes_on(
    typed: Terminal, tmp_path: Path
) -> None:
    here = Path(__file__).resolve().parent
    command = [sys.executable, "-c", SLOW.format(here=str(here), root=str(here.parent))]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    with subprocess.Popen(command, **pipes, text=True, cwd=tmp_path, env=ENVIRONMENT) as running:
        signal.signal(signal.SIGINT, before)
        try:
            assert running.stdout is not None
            assert any(line == "at work\n" for line in running.stdout), running.communicate()
            running.send_signal(signal.SIGINT)
            _, err = running.communicate(timeout=20.0)  # its threads would sleep for a minute
        finally:
            running.kill()
    assert running.returncode == 130
    assert err == "interrupted; finished stages stand, the one at work left what was there before\n"
    assert typed("run", "first.yaml") == 0
    assert typed.out[0] == "ingest     fresh: nothing it depends on has changed"
    assert typed.err == []
    assert not [path for path in Path("runs/first").iterdir() if path.suffix == ".new" or path.name == ".holder"]


@pytest.mark.parametrize(
    ("flags", "out", "err"),
    [
        ({}, "", "\r\x1b[K[######..................] 1 of 4 conditions: ok"),
        ({"verbose": True}, "  1 of 4 conditions: ok\n", "\r\x1b[K"),
        ({"quiet": True, "verbose": True}, "", ""),
    ],
)
def test_progress_is_a_bar_on_a_terminal_and_a_line_where_all_is_wanted(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, flags: dict[str, bool], out: str, err: str
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    Output(**({"quiet": False, "verbose": False} | flags)).progress(Progress(1, 4, "conditions: ok"))
    assert capsys.readouterr() == (out, err)


@pytest.mark.parametrize(
    ("flags", "out", "err"),
    [
        ({}, "", "\r\x1b[Kdiagnose: step"),
        ({"verbose": True}, "  diagnose: step\n", "\r\x1b[K"),
        ({"quiet": True}, "", ""),
    ],
)
def test_what_a_stage_says_of_its_work_is_seen_in_passing_on_a_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, flags: dict[str, bool], out: str, err: str
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    Output(**({"quiet": False, "verbose": False} | flags))
    logging.getLogger("pzd.diagnosis").info("diagnose: step")
    assert capsys.readouterr() == (out, err)


def test_a_terminal_of_another_encoding_is_no_fault() -> None:
    environment = {**ENVIRONMENT, "PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    command = [sys.executable, "-m", "pzd", "schema"]
    assert subprocess.run(command, capture_output=True, env=environment, check=False).returncode == 0
