"""The house marks that ruff does not know: reasons for exceptions, no stubs, one source of random draws, lengths."""

from __future__ import annotations

import ast
import io
import re
import subprocess
import sys
import tokenize
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import pzd

PACKAGE = Path(pzd.__file__).parent
ROOT = Path(__file__).resolve().parent.parent
MODULES = sorted(PACKAGE.rglob("*.py"))
SOURCES = [*MODULES, *sorted((ROOT / "tests").rglob("*.py"))]

EXCEPTION = re.compile(r"#\s*(type:\s*ignore|noqa)\b")
EXCEPTION_WITH_REASON = re.compile(
    r"#\s*(type: ignore\[[a-z-]+(, ?[a-z-]+)*\]|noqa: [A-Z]+\d+(, ?[A-Z]+\d+)*)\s+# \S+ \S+"
)

LONG_FUNCTION, LONG_MODULE = 60, 300
"""Lines beyond which a function or a module is asked for its reason: what a screen, and what one sitting, takes in."""
LONG_WITH_REASON = {"damper/element.py": "one equation: its force, its slopes, and what ends each piece of it"}
"""Function or module as `long_ones` names it, and why it is better left whole; each shows as a warning."""

PRIVATE_WORDS = frozenset(
    (
        *("at_once", "beside", "believable", "bring", "coarse", "desk", "felt", "foil", "foiled", "foils", "ground"),
        *(
            "hopeless",
            "judge",
            "judged",
            "named",
            "naming",
            "near",
            "nought",
            "observation",
            "oil",
            "outing",
            "patient",
        ),
        *("rich", "room", "scene", "settling", "stand_in", "standing", "story", "stuck", "tell", "telling"),
        *("there", "told", "unsure", "used", "weighing"),
    )
)
"""Names that modules, classes, functions and constants once had and that said nothing to anybody else."""

ALIKE_IN_MEANING = {"Condition", "Loop", "Sine", "Test"}
"""Classes of two packages that share a name because they mean the same: where the damper stands, a closed loop, a
harmonic motion, a test of the rig. Any other word stands for one thing."""

SOURCE_OF_DRAWS = ROOT / "tests" / "conftest.py"
GENERATOR = re.compile(
    r"\bdefault_rng\b|\bRandomState\b|\bSeedSequence\b|\bnp\.random\.(?!Generator\b)\w+"
    r"|\brandom\.Random\b|\bimport (random|secrets)\b|\bfrom (random|secrets|numpy\.random) import (?!Generator\b)"
)
"""What makes or seeds a generator, in a test as in its helpers."""


@cache
def tree_of(path: Path) -> ast.Module:
    """The syntax tree of a module of pzd, parsed once for all tests."""
    return ast.parse(path.read_text(encoding="utf-8"))


def comments(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of every comment."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def without_reason(source: str) -> list[int]:
    """Lines that except themselves from a rule without naming it and saying why."""
    return [
        line for line, text in comments(source) if EXCEPTION.search(text) and not EXCEPTION_WITH_REASON.search(text)
    ]


def test_every_exception_from_a_rule_names_it_and_says_why() -> None:
    found = {str(path.relative_to(ROOT)): without_reason(path.read_text(encoding="utf-8")) for path in SOURCES}
    assert {path: lines for path, lines in found.items() if lines} == {}


@pytest.mark.parametrize(
    "mark", ["type: ignore", "noqa", "type: ignore[arg-type]", "noqa: S101", "noqa:S101 # a reason"]
)
def test_an_exception_without_rule_or_reason_is_found(mark: str) -> None:
    assert without_reason(f"x = 1  # {mark}\n") == [1]


@pytest.mark.parametrize(
    "mark", ["type: ignore[arg-type]  # numba is untyped", "noqa: S101, E501  # numbers of the paper"]
)
def test_an_exception_with_rule_and_reason_is_none(mark: str) -> None:
    assert without_reason(f"x = 1  # {mark}\n") == []


def test_every_exception_in_the_project_file_says_why() -> None:
    lines = (ROOT / "pyproject.toml").read_text(encoding="utf-8").splitlines()
    rules = [line for line in lines if re.match(r'\s+"[A-Z]+\d*",', line) or "ignore_" in line]
    assert [line for line in rules if not re.search(r"# \S+ \S+", line)] == []


def test_ruff_looks_at_every_source() -> None:
    listing = [sys.executable, "-m", "ruff", "check", "--show-files", "."]
    looked_at = subprocess.run(listing, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    assert {str(path) for path in SOURCES} <= set(looked_at)


def test_nothing_is_left_unfinished() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in MODULES
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.Name) and node.id == NotImplementedError.__name__
    ]
    assert found == []


def names_in(path: Path) -> Iterator[tuple[int, str]]:
    """Line and name, in small letters with underscores, of a module, its classes, functions and constants."""
    tree = tree_of(path)
    yield 1, path.stem
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield node.lineno, re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", node.name).lower().strip("_")
    for statement in tree.body:
        targets = getattr(statement, "targets", [getattr(statement, "target", None)])
        yield from ((t.lineno, t.id.lower().strip("_")) for t in targets if isinstance(t, ast.Name))


def test_no_name_is_a_private_word() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for path in MODULES
        for line, name in names_in(path)
        if name in PRIVATE_WORDS
    ]
    assert found == []


def test_a_private_word_is_found_as_module_class_function_and_constant(tmp_path: Path) -> None:
    module = tmp_path / "story.py"
    module.write_text("NEAR = 1\n_TOLD: int = 2\nclass StandIn:\n    def judged(self): ...\n", encoding="utf-8")
    assert {name for _, name in names_in(module)} & PRIVATE_WORDS == {"story", "near", "told", "stand_in", "judged"}


def test_no_class_of_another_package_has_the_same_name_and_another_meaning() -> None:
    packages: dict[str, set[str]] = {}
    for path in MODULES:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ClassDef):
                packages.setdefault(node.name, set()).add(path.relative_to(PACKAGE).parts[0])
    assert {name for name, found in packages.items() if len(found) > 1} == ALIKE_IN_MEANING


def test_no_type_of_array_is_named_twice() -> None:
    found: dict[str, list[str]] = {}
    for path in MODULES:
        for statement in tree_of(path).body:
            if isinstance(statement, ast.Assign) and ast.unparse(statement.value).startswith("NDArray["):
                found.setdefault(ast.unparse(statement.value), []).append(path.relative_to(ROOT).as_posix())
    assert found.keys() >= {"NDArray[np.float64]", "NDArray[np.bool_]"}
    assert {kind: places for kind, places in found.items() if len(places) > 1} == {}


def written_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function; its docstring does not make it long."""
    first = node.body[0]
    docstring = (first.end_lineno or first.lineno) - first.lineno + 1 if ast.get_docstring(node) else 0
    return (node.end_lineno or node.lineno) - node.lineno + 1 - docstring


def long_ones() -> dict[str, int]:
    """Lines of every function and module that is long: `rig/stage.py`, `rig/stage.py ingest`."""
    found = {}
    for path in MODULES:
        name, text = path.relative_to(PACKAGE).as_posix(), path.read_text(encoding="utf-8")
        if (lines := len(text.splitlines())) > LONG_MODULE:
            found[name] = lines
        for node in ast.walk(tree_of(path)):
            if (
                isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
                and (lines := written_lines(node)) > LONG_FUNCTION
            ):
                found[f"{name} {node.name}"] = lines
    return found


@pytest.mark.filterwarnings("default::UserWarning")
def test_what_is_long_says_why() -> None:
    found = long_ones()
    for name in found.keys() & LONG_WITH_REASON.keys():
        warnings.warn(f"{name} has {found[name]} lines: {LONG_WITH_REASON[name]}", stacklevel=1)
    assert {name: lines for name, lines in found.items() if name not in LONG_WITH_REASON} == {}
    assert sorted(LONG_WITH_REASON.keys() - found.keys()) == []


def test_a_docstring_does_not_make_a_function_long() -> None:
    (function,) = ast.parse('def f():\n    """One.\n\n    Two.\n    """\n    return 1\n').body
    assert isinstance(function, ast.FunctionDef)
    assert written_lines(function) == 2


def test_every_random_draw_of_a_test_comes_from_the_one_fixture() -> None:
    own = {SOURCE_OF_DRAWS, Path(__file__)}
    tests = [path for path in SOURCES if "tests" in path.parts and "studies" not in path.parts and path not in own]
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in tests
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if GENERATOR.search(line)
    ]
    assert len(tests) > 50
    assert found == [], "ask for the fixture rng or seeds instead"


@pytest.mark.parametrize(
    "line",
    [
        "rng = np.random.default_rng(1)",
        "rng = np.random.default_rng()",
        "from numpy.random import default_rng",
        "np.random.seed(3)",
        "x = np.random.normal(size=3)",
        "import random",
        "source = random.Random(1)",
        "import secrets",
    ],
)
def test_a_generator_of_another_source_is_found(line: str) -> None:
    assert GENERATOR.search(line)


@pytest.mark.parametrize(
    "line", ["def test_it(rng: np.random.Generator) -> None:", "from numpy.random import Generator"]
)
def test_the_type_of_a_generator_is_no_source(line: str) -> None:
    assert not GENERATOR.search(line)
