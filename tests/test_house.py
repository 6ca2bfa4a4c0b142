"""The house rules that no tool knows: imports point down, sets are found, the judge shares nothing with the judged.

Beside them: every exception from a rule says why, and every random draw of a test can be repeated.
"""

from __future__ import annotations

import ast
import io
import os
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import pytest
from parsed import tree

import pzd

ORDER = (
    "quantities",
    "own_effects",
    "schema",
    "parallel",
    "record",
    "compiled",
    "signals",
    "damper",
    "fit",
    "artefacts",
    "rig",
    "identification",
    "diagnosis",
    "force_table",
    "comfort",
    "simulate",
    "report",
    "export",
    "blind",
    "config",
    "runs",
    "pipeline",
    "sweep",
    "paper",
    "front",
    "cli",
    "__main__",
)
"""The order of the house: a module imports its own package and what stands above it here, nothing else."""
FRONT_DOOR = {"read", "identify", "diagnose", "changes", "table", "ride", "rate", "run", "load"}
"""Functions that `import pzd` offers or will offer: importing a module of such a name would take their place."""
SAYS_NOTHING = {"base", "common", "helper", "helpers", "misc", "util", "utils"}
JUDGED = {"damper", "rig", "identification", "diagnosis", "signals"}
"""What the second generator of the blind benchmark judges, and therefore does not share."""

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = Path(pzd.__file__).parent


def modules(package: Path) -> dict[str, Path]:
    """Every module below a package folder by its dotted name."""
    return {
        ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__"): path
        for path in sorted(package.rglob("*.py"))
    }


@cache
def imported(path: Path) -> tuple[tuple[int, str], ...]:
    """Line and dotted name of everything of pzd that a module imports, wherever in the file and by whatever means."""
    return tuple(_imported(path))


def _imported(path: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.lineno, f"{node.module}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in {"import_module", "__import__"}:
            first = node.args[0] if node.args else None
            if isinstance(first, ast.Constant) and isinstance(first.value, str):
                yield node.lineno, first.value


def room(name: str) -> str | None:
    """The room that a dotted name belongs to; None for the package itself and for what is not of pzd."""
    parts = name.split(".")
    return parts[1] if parts[0] == "pzd" and len(parts) > 1 else None


def upward(package: Path) -> list[str]:
    """Imports of what stands below the importing module."""
    return [
        f"{name}:{line}: {target}"
        for name, path in modules(package).items()
        for line, target in imported(path)
        if room(name) and room(target) in ORDER and ORDER.index(room(target)) > ORDER.index(room(name))
    ]


def circles(package: Path) -> list[str]:
    """Modules that import each other, directly or through others, one line for each circle that is found."""
    found = {name: path for name, path in modules(package).items() if path.name != "__init__.py"}
    uses = {
        name: sorted({t if t in found else t.rpartition(".")[0] for _, t in imported(path)} & set(found) - {name})
        for name, path in found.items()
    }
    done: set[str] = set()

    def from_here(name: str, way: tuple[str, ...]) -> Iterator[str]:
        if name in way:
            yield " -> ".join((*way[way.index(name) :], name))
        elif name not in done:
            for used in uses[name]:
                yield from from_here(used, (*way, name))
            done.add(name)

    return [line for name in uses for line in from_here(name, ())]


def shared_with_the_judged(package: Path) -> list[str]:
    """What the second generator imports of the code that it judges."""
    own = {name: path for name, path in modules(package).items() if name.startswith("pzd.blind.independent")}
    return [
        f"{name}:{line}: {target}"
        for name, path in own.items()
        for line, target in imported(path)
        if room(target) in JUDGED or (room(target) == "blind" and not target.startswith("pzd.blind.independent"))
    ]


def test_every_room_has_its_place_and_imports_point_down_only() -> None:
    assert {room(name) for name in modules(PACKAGE)} - {None} <= set(ORDER)
    assert upward(PACKAGE) == []


def test_no_modules_import_each_other() -> None:
    assert circles(PACKAGE) == []


def test_the_second_generator_shares_nothing_with_what_it_judges() -> None:
    assert (PACKAGE / "blind" / "independent" / "kernel.py").exists()
    assert shared_with_the_judged(PACKAGE) == []


def test_only_the_command_line_knows_the_paper() -> None:
    users = {
        room(name) for name, path in modules(PACKAGE).items() if any(room(t) == "paper" for _, t in imported(path))
    }
    assert users <= {"paper", "cli"}


@pytest.mark.parametrize(
    ("file", "line", "rule"),
    [
        ("damper/wrong.py", "def f():\n    from pzd.cli import main", upward),
        ("damper/wrong.py", "if TYPE_CHECKING:\n    from pzd.runs import Run", upward),
        ("damper/wrong.py", "import importlib\nimportlib.import_module('pzd.cli')", upward),
        ("damper/wrong.py", "def f():\n    from pzd.damper import wrong_too", circles),
        ("blind/independent/wrong.py", "from pzd.damper.element import element_force", shared_with_the_judged),
        ("blind/independent/wrong.py", "import pzd.blind.hide", shared_with_the_judged),
    ],
)
def test_an_import_against_a_rule_is_found(file: str, line: str, rule, tmp_path: Path) -> None:
    module = tmp_path / "pzd" / file
    module.parent.mkdir(parents=True)
    module.write_text(line)
    if rule is circles:
        module.with_name("wrong_too.py").write_text("from pzd.damper.wrong import f")
    assert len(rule(tmp_path / "pzd")) == 1


def test_no_module_is_called_as_a_function_of_the_front_door_or_says_nothing() -> None:
    assert [name for name in modules(PACKAGE) if name.split(".")[1:2] and name.split(".")[1] in FRONT_DOOR] == []
    assert [name for name in modules(PACKAGE) if SAYS_NOTHING & set(name.split("."))] == []


IMPORTED_ALONE = """
import importlib, os, sys, traceback

for name in ("matplotlib.figure", "numba", "pandas", "pydantic", "scipy.signal", "scipy.stats", "typer"):
    importlib.import_module(name)  # once, for these take most of the time
assert not any(name.split(".")[0] == "pzd" for name in sys.modules)
for name in sys.argv[1:]:
    child = os.fork()
    if child == 0:
        try:
            importlib.import_module(name)
        except BaseException:
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    if os.waitpid(child, 0)[1]:
        print(name)
"""
"""Prints which of the modules given cannot be imported, each in a process that has imported nothing of pzd."""


def alone(names: Iterable[str], path: Path) -> list[str]:
    """The modules that cannot be imported first, from the packages below a path."""
    environment = {**os.environ, "PYTHONPATH": str(path)}
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED_ALONE, *names], env=environment, stdout=subprocess.PIPE, text=True, check=True
    )
    return done.stdout.split()


@pytest.mark.ci
@pytest.mark.skipif(not hasattr(os, "fork"), reason="a fresh interpreter for each module would take ten minutes")
def test_every_module_can_be_imported_by_itself() -> None:
    names = [name for name in modules(PACKAGE) if not name.endswith("__main__")]
    assert alone(names, PACKAGE.parent) == []


@pytest.mark.ci
@pytest.mark.skipif(not hasattr(os, "fork"), reason="as above")
def test_a_module_that_needs_another_one_imported_before_is_found(tmp_path: Path) -> None:
    package = tmp_path / "pair"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "first.py").write_text("from pair import second\nsaid = 1\n")
    (package / "second.py").write_text("from pair.first import said\n")
    assert alone(["pair.first", "pair.second"], tmp_path) == ["pair.first"]


# ---------------------------------------------------------------- exceptions and draws

SOURCES = [*modules(PACKAGE).values(), *sorted((ROOT / "tests").rglob("*.py"))]
EXCEPTION = re.compile(r"#\s*(type:\s*ignore|noqa)\b")
EXCEPTION_WITH_REASON = re.compile(
    r"#\s*(type: ignore\[[a-z-]+(, ?[a-z-]+)*\]|noqa: [A-Z]+\d+(, ?[A-Z]+\d+)*)\s+# \S+ \S+"
)
GENERATOR = re.compile(
    r"\bdefault_rng\b|\bRandomState\b|\bSeedSequence\b|\bnp\.random\.(?!Generator\b)\w+"
    r"|\brandom\.Random\b|\bimport (random|secrets)\b|\bfrom (random|secrets|numpy\.random) import (?!Generator\b)"
)
"""What makes or seeds a generator, in a test as in what it uses."""


def without_reason(source: str) -> list[int]:
    """Lines that except themselves from a rule without naming it and saying why."""
    if not EXCEPTION.search(source):
        return []  # most files, whose tokens need not be looked through
    return [
        token.start[0]
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type == tokenize.COMMENT
        and EXCEPTION.search(token.string)
        and not EXCEPTION_WITH_REASON.search(token.string)
    ]


def test_every_exception_from_a_rule_names_it_and_says_why() -> None:
    found = {str(path.relative_to(ROOT)): without_reason(path.read_text(encoding="utf-8")) for path in SOURCES}
    assert {path: lines for path, lines in found.items() if lines} == {}
    rules = re.findall(r'^\s+"[A-Z]+\d*",.*$', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE)
    assert [line for line in rules if not re.search(r"# \S+ \S+", line)] == []


@pytest.mark.parametrize(
    ("mark", "lines"),
    [
        ("noqa", [1]),
        ("type: ignore[arg-type]", [1]),
        ("noqa:S101 # a reason", [1]),
        ("type: ignore[arg-type]  # numba is untyped", []),
        ("noqa: S101, E501  # numbers of the paper", []),
    ],
)
def test_an_exception_without_rule_or_reason_is_found(mark: str, lines: list[int]) -> None:
    assert without_reason(f"x = 1  # {mark}\n") == lines


def bound_twice(module: ast.Module) -> list[str]:
    """Return the names that the statements of a module give a value to more than once: the last one overrules."""
    targets = [t for node in module.body if isinstance(node, ast.Assign) for t in node.targets]
    names = [t.id for t in targets if isinstance(t, ast.Name)]
    return sorted({name for name in names if names.count(name) > 1})


def test_no_constant_of_a_module_overrules_another_one_of_its_name() -> None:
    assert {name: twice for name, path in modules(PACKAGE).items() if (twice := bound_twice(tree(path)))} == {}
    assert bound_twice(ast.parse("NEAR = 0.02\nFAR = 1.0\nNEAR = 0.1")) == ["NEAR"]


def test_every_random_draw_of_a_test_comes_from_the_one_fixture() -> None:
    own = {ROOT / "tests" / "conftest.py", Path(__file__)}
    tests = [path for path in SOURCES if "tests" in path.parts and "studies" not in path.parts and path not in own]
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in tests
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if GENERATOR.search(line)
    ]
    assert found == [], "ask for the fixture rng or seeds instead"
