"""What is shipped: locks that hold for every supported Python, declared imports, and a wheel that stands alone."""

from __future__ import annotations

import ast
import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import distribution, packages_distributions
from pathlib import Path

import pytest
from installed import Installed
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
from parsed import tree
from typer.core import TyperGroup
from typer.main import get_command

from pzd.cli.app import app
from pzd.rig.files.formats import formats

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
DECLARED = [Requirement(text) for text in PROJECT["project"]["dependencies"]]
EXTRAS = [Requirement(text) for extra in PROJECT["project"]["optional-dependencies"].values() for text in extra]
LOCKS = ("requirements.lock", "requirements-build.lock", "requirements-dev.lock", "requirements-docs.lock")
PYTHONS = ("3.11", "3.12", "3.13")


def pins(lock: str) -> dict[str, Requirement]:
    """Every pin of a lock by its canonical name."""
    lines = re.findall(r"^(\S[^=\n]*==[^\\\n]+?)\s*\\$", (ROOT / lock).read_text(encoding="utf-8"), re.MULTILINE)
    return {canonicalize_name(pin.name): pin for pin in map(Requirement, lines)}


def version(pin: Requirement) -> str:
    """The one version that a pin admits."""
    (specifier,) = pin.specifier
    return specifier.version


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_pins_and_hashes_everything_and_names_no_host(lock: str) -> None:
    text = (ROOT / lock).read_text(encoding="utf-8")
    entries = re.split(r"^(?=\S)", re.sub(r"^\s*#.*$", "", text, flags=re.MULTILINE), flags=re.MULTILINE)
    entries = [entry for entry in entries if entry.strip()]
    assert len(entries) == len(pins(lock))
    assert all("--hash=sha256:" in entry for entry in entries)
    assert not re.search(r"://|--(find-links|index-url|extra-index-url|trusted-host)", text)


def test_a_package_that_another_wants_with_an_extra_is_pinned_with_it() -> None:
    # Beside a pin of `coverage` alone, pip takes the newest release for `coverage[toml]` and refuses it as not pinned.
    locked = pins("requirements-dev.lock")
    installed = {name for name in locked if importlib.util.find_spec(name.replace("-", "_"))}
    wanted = {
        (canonicalize_name(need.name), extra)
        for name in installed
        for need in map(Requirement, distribution(name).requires or ())
        if need.marker is None or any(need.marker.evaluate({"extra": extra}) for extra in {"", *locked[name].extras})
        for extra in need.extras
    }
    assert ("coverage", "toml") in wanted
    assert {(name, extra) for name, extra in wanted if extra not in locked[name].extras} == set()


def test_the_lock_satisfies_what_the_project_declares() -> None:
    locked = pins("requirements.lock")
    assert [str(need) for need in DECLARED if version(locked[canonicalize_name(need.name)]) not in need.specifier] == []


def test_the_lock_for_the_tests_holds_the_extras_and_the_one_for_users_does_not() -> None:
    locked, runtime = pins("requirements-dev.lock"), pins("requirements.lock")
    assert [str(need) for need in EXTRAS if version(locked[canonicalize_name(need.name)]) not in need.specifier] == []
    assert [need.name for need in EXTRAS if canonicalize_name(need.name) in runtime] == []


def test_what_a_format_needs_is_an_extra() -> None:
    needed = {module.NEEDS for module in formats().values() if module.NEEDS}
    assert needed
    assert needed <= {canonicalize_name(need.name) for need in EXTRAS}


def test_the_locks_agree_with_each_other() -> None:
    runtime, build, dev, docs = map(pins, LOCKS)
    assert {name: version(pin) for name, pin in (runtime | build).items()} == {
        name: version(pin) for name, pin in dev.items() if name in runtime | build
    }
    shared = docs.keys() & dev.keys()
    assert {name: version(docs[name]) for name in shared} == {name: version(dev[name]) for name in shared}


def test_every_locked_version_runs_on_every_supported_python() -> None:
    supported = SpecifierSet(PROJECT["project"]["requires-python"])
    assert all(python in supported for python in PYTHONS)
    refused = []
    for name, pin in pins("requirements-dev.lock").items():
        if pin.marker and not pin.marker.evaluate():
            continue
        installed = distribution(name)
        wanted = SpecifierSet(str(installed.metadata.json.get("requires_python", "")))
        refused += [f"{name} on {python}" for python in PYTHONS if python not in wanted]
        assert installed.version == version(pin), f"{name}: installed {installed.version}, locked {version(pin)}"
    assert refused == []


def imported(module: Path) -> set[str]:
    """The top-level names that a module imports, wherever in the file."""
    found = set()
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module.split(".")[0])
    return found - set(sys.stdlib_module_names) - {"pzd"}


def test_every_import_is_declared() -> None:
    providers = packages_distributions()
    declared = {canonicalize_name(need.name) for need in DECLARED + EXTRAS}
    assert [
        f"{module.relative_to(ROOT)}: {name}"
        for module in sorted((ROOT / "pzd").rglob("*.py"))
        for name in sorted(imported(module))
        if not declared & {canonicalize_name(provider) for provider in providers.get(name, ())}
    ] == []


def test_starting_the_command_imports_nothing_heavy() -> None:
    heavy = ("jinja2", "matplotlib", "numba", "pandas", "pint", "scipy")
    code = f"import sys, pzd.cli; print(*({{*{heavy}}} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_the_wheel_holds_the_package_with_its_data_and_nothing_else(wheel: Path) -> None:
    held = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    package = ROOT / "pzd"
    wanted = {
        str(path.relative_to(ROOT)) for path in package.rglob("*") if path.is_file() and "__pycache__" not in path.parts
    }
    assert held == wanted


# ---------------------------------------------------------------- the wheel, installed elsewhere


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """A folder with configs, and nothing else of the repository."""
    shutil.copy(ROOT / "configs" / "quickstart.yaml", tmp_path / "first.yaml")
    shutil.copy(ROOT / "configs" / "quickstart.yaml", tmp_path / "second.yaml")
    for name in ("blind.yaml", "quickstart.yaml", "sweep.yaml"):  # the last extends the one before
        shutil.copy(ROOT / "configs" / name, tmp_path / name)
    return tmp_path


@pytest.mark.ci
def test_the_wheel_alone_runs_every_command(installed: Installed, elsewhere: Path) -> None:
    where = "import pzd; print(pzd.__file__)"
    assert str(installed.folder) in installed.output("python", "-c", where, cwd=elsewhere)

    tried = set()

    def pzd(command: str, *arguments: str) -> str:
        tried.add(command)
        return installed.output("pzd", command, *arguments, cwd=elsewhere)

    for stage in ("check", "synthesise", "identify", "diagnose", "table", "simulate", "report"):
        pzd(stage, "first.yaml")
    pzd("run", "second.yaml", "--set", "seed=2")
    assert "index.html" in pzd("figures", "first.yaml")
    assert pzd("blind", "blind.yaml", "--set", "blind.cases=2")
    assert "runs, 0 without a result" in pzd("sweep", "sweep.yaml", "--set", "sweep.draws=2")
    assert pzd("show", "first.yaml")
    assert pzd("peers", "first.yaml")
    assert pzd("export", "first.yaml", "--to", "csv")
    assert pzd("compare", "runs/first", "runs/second")
    assert '"unchanged"' in pzd("changes", "first.yaml", "second.yaml", "--json")
    ride = "\n".join(f"{0.01 * n:.2f},{(-1) ** n * 0.1}" for n in range(400))
    (elsewhere / "ride.csv").write_text(f"time_s,az [m/s2]\n{ride}\n", encoding="utf-8")
    assert "a_w" in pzd("rate", "ride.csv")
    assert "orifice_quadratic" in pzd("effects")
    assert "properties" in json.loads(pzd("schema"))
    records = sorted((elsewhere / "runs" / "first" / "1-rig").glob("*.csv"))
    (elsewhere / "own.yaml").write_text(pzd("init", *map(str, records)), encoding="utf-8")
    pzd("ingest", "own.yaml")
    assert (elsewhere / "runs" / "own" / "1-rig" / records[0].name).exists()
    group = get_command(app)
    assert isinstance(group, TyperGroup)
    assert tried == set(group.commands) - {"watch"}  # which runs for ever
