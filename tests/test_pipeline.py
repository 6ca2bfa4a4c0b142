"""What reruns when something changes, what is kept, what is carried on; on stages that take no time."""

from __future__ import annotations

import ast
import json
import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
import stub_stages
from parsed import tree
from stub_stages import NAMES, UNDETERMINED, project

from pzd.artefacts import Identified, Manifest, Rig
from pzd.cli import start
from pzd.config import load
from pzd.damper.effects import library
from pzd.parallel.processes import Listener, Progress, no_listener
from pzd.pipeline.command import execute, opened, stale_stages
from pzd.pipeline.dependencies import PACKAGE, _file, _imports_of, _modules, code_hash, modules_used
from pzd.pipeline.execution import Pipeline
from pzd.pipeline.stages import Stage, stages
from pzd.quantities import Control
from pzd.rig.config import RigConfig
from pzd.runs import versions
from pzd.schema.errors import ConfigError, DataError
from pzd.schema.validate import read_json


class Bench:
    """A project on which commands are given, and what they said."""

    def __init__(self, config: Path) -> None:
        self.config = config
        self.runs = config.parent / "runs"
        self.run = self.runs / config.stem
        self.lines: list[str] = []
        self.marks: tuple[str, ...] = ()

    def __call__(self, *overrides: str, target: str = "run", force: bool = False) -> list[str]:
        """Bring the run up to date; gives the stages that ran."""
        self.lines.clear()
        given = opened(self.config, self.runs, overrides)
        self.marks = execute(given, target, force=force, jobs=1, say=self.lines.append)
        return [line.split()[0] for line in self.lines if " runs: " in line]

    def said(self, stage: str) -> str:
        return next(line for line in self.lines if line.startswith(stage))

    def written(self) -> dict[str, tuple[int, bytes]]:
        return {
            str(path.relative_to(self.run)): (path.stat().st_mtime_ns, path.read_bytes())
            for path in self.run.rglob("*")
            if path.is_file() and not path.name.startswith(".")
        }

    def manifest(self, stage: str) -> Manifest:
        (path,) = self.run.glob(f"*-{stage}/manifest.json")
        return read_json(path, Manifest, Control())


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    return Bench(project(tmp_path, monkeypatch))


def test_a_first_run_makes_every_stage_in_order(bench: Bench) -> None:
    assert bench() == NAMES
    folders = ["1-rig", "2-identify", "3-diagnose", "4-table", "5-simulate", "6-report"]
    assert sorted(path.name for path in bench.run.iterdir() if path.is_dir()) == folders
    assert (bench.run / "config.yaml").is_file()
    assert bench.said("identify") == "identify   runs: it has no result yet"


def test_a_second_run_does_nothing_and_says_why_in_a_line_a_stage(bench: Bench) -> None:
    bench()
    before = bench.written()
    assert bench() == []
    assert bench.written() == before
    assert bench.lines == [f"{name:<10} fresh: nothing it depends on has changed" for name in NAMES]


def test_two_runs_of_one_config_write_the_same_bytes(bench: Bench) -> None:
    bench()
    before = {name: content for name, (_, content) in bench.written().items() if "manifest" not in name}
    shutil.rmtree(bench.run)
    bench()
    assert {name: content for name, (_, content) in bench.written().items() if "manifest" not in name} == before


@pytest.mark.parametrize(
    ("overrides", "ran"),
    [
        (["seed=2"], ["identify", "diagnose", "table", "simulate"]),
        (["identify.group.temperature_degC=3"], ["identify"]),  # and its result is what it was
        (["diagnose.significance=0.01"], ["diagnose", "table", "simulate"]),  # each hands on what it did before
        (["table.speed_max_m_per_s=2"], ["table", "simulate"]),
        (["simulate.settle_s=5"], ["simulate"]),
        (["report.daily_exposure_h=4"], ["report"]),
        (["control.name=current", "control.unit=A"], NAMES),
        (["rig.limits.stroke_m=0.1"], ["ingest"]),
    ],
)
def test_changing_a_value_reruns_exactly_what_depends_on_it(
    bench: Bench, overrides: Sequence[str], ran: Sequence[str]
) -> None:
    bench()
    assert bench(*overrides) == ran
    assert f"{overrides[0].split('=')[0]} has changed" in bench.said(ran[0])
    assert bench(*overrides) == []


def test_a_rig_file_that_changes_reruns_everything(bench: Bench) -> None:
    bench()
    (bench.config.parent / "data" / "a.csv").write_text("101")
    assert bench() == NAMES
    assert "a.csv has changed" in bench.said("ingest")
    assert "1-rig/a.csv has changed" in bench.said("identify")


def test_expected_numbers_that_change_rerun_the_report_alone(bench: Bench) -> None:
    path = bench.config.parent / "lab.csv"
    path.write_text("id,value,unit\npeak,1,N\n")
    bench("report.reference=lab.csv")
    assert bench("report.reference=lab.csv") == []
    path.write_text("id,value,unit\npeak,2,N\n")
    assert bench("report.reference=lab.csv") == ["report"]
    assert bench.said("report") == "report     runs: lab.csv has changed"
    path.unlink()
    assert stale_stages(opened(bench.config, bench.runs, ["report.reference=lab.csv"])) == {"report": "lab.csv is gone"}


def test_what_the_preflight_finds_is_said_with_where_it_is_told_whole(bench: Bench) -> None:
    bench()
    assert not any("finding" in line for line in bench.lines)
    (bench.config.parent / "data" / "b.csv").write_text("901")
    bench()
    assert f"ingest     1 finding, b: range: all of it; pzd check {bench.config} prints what follows" in bench.lines


def test_of_several_findings_the_one_that_makes_another_damper_is_said(bench: Bench) -> None:
    (bench.config.parent / "data" / "b.csv").write_text("1001")
    bench()
    assert any(line.startswith("ingest     2 findings, b: level: force;") for line in bench.lines)


def test_many_files_that_change_are_counted_and_not_listed(bench: Bench) -> None:
    bench()
    for name in ("a", "b"):
        (bench.config.parent / "data" / f"{name}.csv").write_text("101")
    bench()
    assert bench.said("ingest") == "ingest     runs: 2 files of data have changed"
    assert bench.said("identify") == "identify   runs: 2 files of 1-rig have changed"


def test_a_rig_file_more_or_less_is_seen(bench: Bench) -> None:
    bench()
    (bench.config.parent / "data" / "c.csv").write_text("200")
    assert bench()[0] == "ingest"
    assert "c.csv is new" in bench.said("ingest")
    (bench.config.parent / "data" / "c.csv").unlink()
    assert bench()[0] == "ingest"
    assert "c.csv is gone" in bench.said("ingest")
    assert not (bench.run / "1-rig" / "c.csv").exists()


def test_a_file_touched_or_a_comment_added_reruns_nothing(bench: Bench) -> None:
    bench()
    (bench.config.parent / "data" / "a.csv").touch()
    bench.config.write_text("# said again\n" + bench.config.read_text())
    assert bench() == []


def test_the_same_config_by_another_path_reruns_nothing(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    bench()
    monkeypatch.chdir(bench.config.parent)
    bench.config, bench.runs = Path("first.yaml"), Path("runs")
    assert bench() == []


def test_edited_code_reruns_what_may_use_it(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    bench()
    monkeypatch.setattr(
        "pzd.pipeline.dependencies.code_hash",
        lambda module: "edited" if module == "pzd.force_table.stage" else code_hash(module),
    )
    assert bench() == ["table"]
    assert bench.said("table").endswith("runs: the code has changed")


def test_another_version_of_a_library_that_computes_reruns_every_stage(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench()
    found = versions()
    monkeypatch.setattr("pzd.pipeline.dependencies.versions", lambda: found | {"pandas": "0.1"})
    assert bench() == []
    monkeypatch.setattr("pzd.pipeline.dependencies.versions", lambda: found | {"scipy": "0.1"})
    assert bench() == NAMES
    assert bench.said("identify") == "identify   runs: scipy version has changed"


@pytest.fixture
def copied(bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the package whose code the stages of the bench hang on, to be edited."""
    package = tmp_path / "copy" / "pzd"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))

    monkeypatch.setattr("pzd.pipeline.dependencies.code_hash", lambda module: code_hash(module, package))
    bench()
    return package


def edited(path: Path | None) -> None:
    """Add a comment to a module, and have it read again."""
    assert path is not None
    with path.open("a") as file:
        file.write("# edited\n")
    code_hash.cache_clear()
    _imports_of.cache_clear()
    _modules.cache_clear()


def test_a_comment_in_what_no_stage_imports_reruns_nothing(bench: Bench, copied: Path) -> None:
    (guess,) = re.findall(r"from (pzd[\w.]+) import guessed", Path(start.__file__).read_text())
    edited(_file(guess, copied))
    assert bench() == []


@pytest.mark.parametrize(
    ("module", "ran"),
    [
        ("pzd.identification.stage", ["identify"]),
        ("pzd.report.stage", ["report"]),
        ("pzd.force_table.stage", ["table"]),
        ("pzd.simulate.stage", ["simulate"]),
        ("pzd.quantities", NAMES),
    ],
)
def test_a_comment_in_what_a_stage_imports_reruns_it(
    bench: Bench, copied: Path, module: str, ran: Sequence[str]
) -> None:
    edited(_file(module, copied))
    assert bench() == ran


def test_a_page_about_the_code_reruns_nothing(bench: Bench, copied: Path) -> None:
    edited(copied / "README.md")
    assert bench() == []


def test_a_new_member_of_a_set_reruns_what_uses_the_set(bench: Bench, copied: Path) -> None:
    edited(copied / "report" / "plots" / "another.py")
    assert bench() == ["report"]
    edited(copied / "damper" / "effects" / "another.py")
    assert "identify" in bench()


def test_the_code_of_a_stage_is_all_that_it_may_import_and_the_data_beside(tmp_path: Path) -> None:
    package = tmp_path / "pzd"
    for name, text in (
        ("__init__.py", ""),
        (
            "identify/stage.py",
            "from pzd.identify import (\n    fit,\n)\nif TYPE_CHECKING:\n    import pzd.report.page\n",
        ),
        ("identify/fit.py", "from pzd.damper.element import f\n"),
        ("identify/alone.py", "import pzd.report.page\n"),
        ("identify/numbers.csv", "1\n"),
        ("identify/templates/page.html", "1\n"),
        ("identify/README.md", "1\n"),
        (
            "damper/element.py",
            "def f():\n    from pzd.quantities import x\n    find(f'pzd.damper.laws.{name}')\n",
        ),
        ("damper/laws/__init__.py", ""),
        ("damper/laws/lash.py", ""),
        ("quantities.py", "x = 1\n"),
        ("report/__init__.py", "found = pkgutil.iter_modules(__path__)\n"),
        ("report/stage.py", "import pzd.identify.fit as fit\n"),
        ("report/page.py", ""),
    ):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text)

    def hashes() -> dict[str, str]:
        return {part: code_hash(f"pzd.{part}", package) for part in ("quantities", "identify.stage", "report.stage")}

    def changed(name: str) -> list[str]:
        before = hashes()
        edited(package / name)
        return [part for part, value in hashes().items() if value != before[part]]

    assert changed("__init__.py") == ["quantities", "identify.stage", "report.stage"]
    assert changed("quantities.py") == ["quantities", "identify.stage", "report.stage"]
    assert changed("damper/element.py") == ["identify.stage", "report.stage"]
    assert changed("damper/laws/lash.py") == ["identify.stage", "report.stage"]
    assert changed("identify/numbers.csv") == ["identify.stage", "report.stage"]
    assert changed("identify/templates/page.html") == ["identify.stage", "report.stage"]
    assert changed("identify/README.md") == []
    assert changed("identify/stage.py") == ["identify.stage"]
    assert changed("identify/alone.py") == []
    assert changed("report/page.py") == ["report.stage"]
    (package / "report" / "__pycache__").mkdir()
    before = hashes()
    edited(package / "report" / "__pycache__" / "page.pyc")
    assert hashes() == before


def executed_imports(tree: ast.Module) -> Iterator[str]:
    """Everything of pzd that a module imports when it runs, by its syntax."""
    for node in tree.body:
        if not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            for inner in ast.walk(node):
                if isinstance(inner, ast.Import):
                    yield from (alias.name for alias in inner.names)
                elif isinstance(inner, ast.ImportFrom):
                    yield from (f"{inner.module}.{alias.name}" for alias in inner.names)


def test_no_import_is_missed() -> None:
    for path in sorted(PACKAGE.rglob("*.py")):
        name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
        imports = set(executed_imports(tree(path)))
        modules = {one if _file(one, PACKAGE) else one.rpartition(".")[0] for one in imports if one.startswith("pzd.")}
        assert modules - {name, "pzd"} <= _imports_of(name, PACKAGE), name


def test_a_stage_hangs_on_the_equations_of_the_damper_and_not_on_what_stands_above_it() -> None:
    for stage in stages(load(PACKAGE.parent / "configs" / "quickstart.yaml")):
        used = modules_used(stage.function.__module__)
        assert {f"pzd.damper.effects.{name}" for name in library()} <= used, stage.name
        assert not {"pzd.config", "pzd.runs", "pzd.pipeline", "pzd.cli"} & used, stage.name


def test_a_deleted_file_is_made_again_and_what_hangs_on_it_stays(bench: Bench) -> None:
    bench()
    (bench.run / "2-identify" / "measures.csv").unlink()
    assert bench() == ["identify"]
    assert bench.said("identify") == "identify   runs: measures.csv missing"


def test_a_deleted_folder_is_made_again(bench: Bench) -> None:
    bench()
    shutil.rmtree(bench.run / "3-diagnose")
    assert bench() == ["diagnose"]


@pytest.mark.parametrize("text", ["", "{", "{}", "[1]"])
def test_a_manifest_that_cannot_be_read_counts_as_none(bench: Bench, text: str) -> None:
    bench()
    (bench.run / "2-identify" / "manifest.json").write_text(text)
    assert bench() == ["identify"]


def parameters(bench: Bench, edit: Callable[[str], str]) -> Path:
    path = bench.run / "2-identify" / "parameters.csv"
    path.write_text(edit(path.read_text()))
    return path


def test_an_artefact_edited_by_hand_is_kept_and_said_and_what_hangs_on_it_reruns(bench: Bench) -> None:
    bench()
    path = parameters(bench, lambda text: text.replace("200.0", "222.0"))
    edited = path.read_bytes()
    assert bench() == ["diagnose", "table", "simulate", "report"]
    assert bench.said("identify").endswith(
        "fresh: nothing it depends on has changed; edited by hand and kept: parameters.csv"
    )
    assert path.read_bytes() == edited
    assert "222.0" in (bench.run / "6-report" / "comfort.csv").read_text()
    assert bench() == []
    assert "edited by hand" in bench.said("identify")


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda text: text.replace("T0_N,", "T0_kN,", 1), "parameters.csv:1: the header must read"),
        (
            lambda text: text.replace("200.0", "-5", 1),
            "parameters.csv:2: T0_N: must be greater than or equal to 0 (got -5)",
        ),
        (lambda text: text.replace("200.0", "much", 1), "parameters.csv:2: T0_N: must be a number (got 'much')"),
        (lambda text: text.replace(",ok", ""), "parameters.csv:2: "),
        (lambda text: text.replace(",ok", ",good"), "parameters.csv:2: status: "),
    ],
)
def test_an_artefact_edited_wrongly_is_refused_with_file_and_line(
    bench: Bench, edit: Callable[[str], str], message: str
) -> None:
    bench()
    parameters(bench, edit)
    before = bench.written()
    for target in ("identify", "run"):
        with pytest.raises(DataError) as caught:
            bench(target=target)
        assert message in caught.value.messages[0]
    assert bench.written() == before


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("1-rig/records.json", '"cycles": 0.0', '"cycles": "many"'),
        ("1-rig/a.csv", "force_N", "force_kN"),
        ("3-diagnose/diagnosis.json", '"none"', '"nothing"'),
        ("3-diagnose/damper.yaml", "T0_N:", "T0_kN:"),
        ("4-table/force.csv", ",1\n", ",2\n"),
        ("5-simulate/summary.csv", "dissipated_J", "dissipated_kJ"),
        ("5-simulate/sine-comfort-ideal.csv", "0.0,0.0,0.0", "0.0,x,0.0"),
        ("6-report/comfort.csv", "edition", "edtion"),
    ],
)
def test_every_artefact_edited_wrongly_is_refused(bench: Bench, name: str, old: str, new: str) -> None:
    bench()
    path = bench.run / name
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(DataError) as caught:
        bench()
    assert caught.value.messages[0].startswith(f"{path}:")


def test_an_edited_artefact_that_must_be_made_anew_is_laid_beside(bench: Bench) -> None:
    bench()
    path = parameters(bench, lambda text: text.replace("200.0", "222.0"))
    edited = path.read_bytes()
    assert bench("seed=2")[0] == "identify"
    assert "kept beside the new as .edited-HASH: parameters.csv" in bench.said("identify")
    assert [copy.read_bytes() for copy in path.parent.glob("parameters.csv.edited-*")] == [edited]
    assert "222.0" not in path.read_text()
    assert bench("seed=2") == []
    assert bench("seed=3")[0] == "identify"
    assert [copy.read_bytes() for copy in path.parent.glob("parameters.csv.edited-*")] == [edited]


def test_what_a_person_laid_beside_the_results_stays_and_counts_for_nothing(bench: Bench) -> None:
    bench()
    (bench.run / "2-identify" / "notes.txt").write_text("mine")
    assert bench() == []
    bench("seed=2")
    assert (bench.run / "2-identify" / "notes.txt").read_text() == "mine"
    assert "notes.txt" not in bench.manifest("identify").outputs


def test_force_reruns_the_stage_that_is_asked_for(bench: Bench) -> None:
    bench()
    assert bench(target="table", force=True) == ["table"]
    assert bench(force=True) == NAMES
    assert bench.said("ingest").endswith("runs: forced")


def test_a_stage_command_goes_as_far_as_its_stage(bench: Bench) -> None:
    assert bench(target="diagnose") == ["ingest", "identify", "diagnose"]
    assert not (bench.run / "4-table").exists()
    assert bench(target="identify") == []


def test_a_stage_that_fails_leaves_what_was_there_before(bench: Bench) -> None:
    bench()
    before = bench.written()
    (bench.config.parent / "data" / "a.csv").write_text("nonsense")
    (bench.config.parent / "data" / "b.csv").write_text("nonsense")
    with pytest.raises(DataError) as caught:
        bench()
    assert len(caught.value.messages) == 2
    assert bench.written() == before


def test_marks_are_carried_on_and_said_again_when_all_is_fresh(bench: Bench) -> None:
    seed = f"seed={UNDETERMINED}"
    bench(seed)
    (mark,) = bench.marks
    assert "undetermined: C" in mark
    assert bench.manifest("rig").marks == ()
    assert {bench.manifest(name).marks for name in NAMES[1:]} == {(mark,)}
    assert bench(seed) == []
    assert bench.marks == (mark,)
    bench("seed=1")
    assert bench.marks == ()
    assert bench.manifest("report").marks == ()


def test_a_mark_goes_when_a_person_mends_the_value(bench: Bench) -> None:
    seed = f"seed={UNDETERMINED}"
    bench(seed)
    parameters(bench, lambda text: text.replace("200.0,200.0,200.0,,,,", "200.0,200.0,200.0,5,4,6,"))
    assert bench(seed) == ["diagnose", "table", "simulate", "report"]
    assert bench.marks == ()
    assert bench.manifest("report").marks == ()


def test_a_manifest_says_what_was_made_of_what(bench: Bench) -> None:
    bench()
    path = bench.run / "2-identify" / "manifest.json"
    found = json.loads(path.read_text())
    assert set(found) == {"stage", "key", "config", "inputs", "outputs", "versions", "finished", "seconds", "marks"}
    assert found["stage"] == "identify"
    assert (bench.run / found["config"]).resolve() == bench.config
    fitted, shown = (
        {"parameters", "measures", "auxiliary"},
        {"pvp", "cvp", "gas_and_friction", "steps", "warm_up", "as_it_stands"},
    )
    assert set(found["outputs"]) == {f"{name}.csv" for name in fitted | shown}
    assert {"1-rig/records.json", "1-rig/a.csv", "1-rig/b.csv", "seed", "code", "identify.method"} <= set(
        found["inputs"]
    )
    assert {"pzd", "python", "numpy"} <= set(found["versions"])
    assert not any("rig." in name or "table." in name for name in found["inputs"])


def test_stages_read_their_inputs_from_files(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str] = []
    monkeypatch.setattr(Identified, "read", classmethod(lambda cls, folder, _: read.append(folder.name) or cls((), ())))
    with pytest.raises(ValueError, match="no identified parameters"):
        bench(target="diagnose")
    assert read == ["2-identify"]


SETTINGS = (
    "rig:\n  files:\n    - {path: data/a.csv, setting: gap 0.15 mm}\n    - {path: data/b.csv, setting: gap 0.25 mm}\n"
)


def test_several_settings_need_one_to_be_chosen(bench: Bench) -> None:
    bench.config.write_text(SETTINGS)
    assert bench(target="identify") == ["ingest", "identify"]
    with pytest.raises(ConfigError) as caught:
        bench()
    assert caught.value.messages[0].startswith(f"{bench.config}:1:1: setting: the rig has several")
    bench("setting=gap 0.25 mm")
    assert "300.0" in (bench.run / "6-report" / "comfort.csv").read_text()


def test_another_setting_reruns_what_takes_it(bench: Bench) -> None:
    bench.config.write_text(SETTINGS)
    bench("setting=gap 0.25 mm")
    assert bench("setting=gap 0.15 mm") == ["diagnose", "table", "simulate", "report"]
    assert "setting has changed" in bench.said("diagnose")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("setting: gap 0.24 mm\n" + SETTINGS, "first.yaml:1:10: setting: no record of the rig has this setting"),
        ("setting: gap\nrig: {files: [{path: data/*.csv}]}\n", "first.yaml:1:10: setting: no record"),
    ],
)
def test_a_setting_that_no_record_has_is_refused_with_its_place(bench: Bench, text: str, message: str) -> None:
    bench.config.write_text(text)
    with pytest.raises(ConfigError) as caught:
        bench()
    assert message in caught.value.messages[0]


def test_the_only_setting_needs_no_choice(bench: Bench) -> None:
    bench.config.write_text("rig:\n  files:\n    - {path: data/*.csv, setting: gap}\n")
    assert bench() == NAMES


def test_a_path_that_matches_no_file_is_a_wrong_config_with_its_place(bench: Bench) -> None:
    bench.config.write_text("rig:\n  files:\n    - path: dta/*.csv\n")
    with pytest.raises(ConfigError) as caught:
        bench()
    assert caught.value.messages[0].startswith(f"{bench.config}:3:13: rig.files.0.path: no such file")


@pytest.mark.parametrize(("target", "right"), [("synthesise", "ingest")])
def test_the_wrong_source_is_named_with_the_right_one(bench: Bench, target: str, right: str) -> None:
    with pytest.raises(ConfigError, match=f"pzd {target}: the config has rig.files, so the command is pzd {right}"):
        bench(target=target)


def test_a_stage_declares_itself_by_its_signature() -> None:
    stage = Stage("identify", stub_stages.identify)
    assert list(stage.takes) == ["identify", "rig", "seed"]
    assert stage.makes is Identified
    assert stage.folder == "2-identify"


def test_a_stage_that_asks_for_it_can_say_how_far_it_is(bench: Bench) -> None:
    def slow(rig: RigConfig, control: Control, folder: Path, progress: Listener = no_listener) -> Rig:
        progress(Progress(1, 2, "files"))
        return stub_stages.ingest(rig, control, folder)

    heard: list[Progress] = []
    given = opened(bench.config, bench.runs)
    pipeline = Pipeline(given.config, given.run, (Stage("ingest", slow),), lambda _: None, heard.append)
    assert pipeline.stages[0].folder == "1-rig"
    pipeline.made(pipeline.stages[0])
    assert heard == [Progress(1, 2, "files")]
