"""Imports point down only: a module imports its own package and what stands above it in ORDER."""

from __future__ import annotations

import ast
import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest

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
    "artefacts",
    "rig",
    "identify",
    "diagnose",
    "table",
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
    "cli",
    "__main__",
)
"""The one place where the order of the house stands."""

SAYS_NOTHING = {"base", "common", "helper", "helpers", "misc", "util", "utils"}
PACKAGE = Path(pzd.__file__).parent
MODULES = sorted(PACKAGE.rglob("*.py"))


def dotted(module: Path, package: Path) -> str:
    """The name under which a file is imported: pzd.damper.effect."""
    parts = module.relative_to(package.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(tree: ast.AST, own: str, *, is_package: bool) -> Iterator[tuple[int, str]]:
    """Line and name of everything of pzd that a module imports, wherever in the file and by whatever means."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = own.split(".")[: len(own.split(".")) - node.level + is_package] if node.level else []
            source = ".".join([*above, *([node.module] if node.module else [])])
            yield from ((node.lineno, f"{source}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in {"import_module", "__import__"}:
            first = node.args[0] if node.args else None
            if isinstance(first, ast.Constant) and isinstance(first.value, str):
                yield node.lineno, first.value


def layer(name: str, package: str = "pzd") -> str | None:
    """The layer that a dotted name belongs to; None for the package itself and for what is not of pzd."""
    parts = name.split(".")
    return parts[1] if parts[0] == package and len(parts) > 1 else None


def faults(module: Path, package: Path) -> list[str]:
    """What a module imports from below or beside it."""
    own = dotted(module, package)
    tree = ast.parse(module.read_text(encoding="utf-8"), str(module))
    place = layer(own)
    reachable = ORDER[: ORDER.index(place) + 1] if place else ()
    return [
        f"{module.relative_to(package.parent)}:{line}: {own} imports {name}"
        for line, name in imported(tree, own, is_package=module.stem == "__init__")
        if (target := layer(name)) in ORDER and target not in reachable
    ]


def test_every_module_has_its_place_in_the_order() -> None:
    assert {layer(dotted(module, PACKAGE)) for module in MODULES} - {None} <= set(ORDER)


def test_imports_point_down_only() -> None:
    assert [fault for module in MODULES for fault in faults(module, PACKAGE)] == []


def rounds(package: Path) -> list[str]:
    """Modules that import each other, directly or through others, one line for each round that is found."""
    modules = {dotted(path, package): path for path in sorted(package.rglob("*.py")) if path.name != "__init__.py"}
    uses: dict[str, list[str]] = {}
    for own, path in modules.items():
        names = (name for _, name in imported(ast.parse(path.read_text(encoding="utf-8")), own, is_package=False))
        found = {name if name in modules else name.rpartition(".")[0] for name in names}
        uses[own] = sorted((found & set(modules)) - {own})
    done: set[str] = set()

    def from_here(own: str, way: tuple[str, ...]) -> Iterator[str]:
        if own in way:
            yield " -> ".join((*way[way.index(own) :], own))
        elif own not in done:
            for used in uses[own]:
                yield from from_here(used, (*way, own))
            done.add(own)

    return [line for own in uses for line in from_here(own, ())]


def test_no_modules_import_each_other() -> None:
    assert rounds(PACKAGE) == []


def test_a_round_of_imports_is_found(tmp_path: Path) -> None:
    package = tmp_path / "pzd"
    package.mkdir()
    (package / "one.py").write_text("from pzd.two import a\n", encoding="utf-8")
    (package / "two.py").write_text("def a():\n    import pzd.three\n", encoding="utf-8")
    (package / "three.py").write_text("from pzd import one\n", encoding="utf-8")
    assert rounds(package) == ["pzd.one -> pzd.two -> pzd.three -> pzd.one"]


def users_of(part: str, package: Path) -> set[str]:
    """The layers that import one, wherever in the file."""
    return {
        own
        for module in sorted(package.rglob("*.py"))
        if (own := layer(dotted(module, package)))
        for _, name in imported(ast.parse(module.read_text("utf-8")), own, is_package=module.stem == "__init__")
        if layer(name) == part
    }


def test_only_the_command_line_knows_the_paper() -> None:
    assert users_of("paper", PACKAGE) == {"paper", "cli"}


def test_another_user_of_the_paper_is_found(tmp_path: Path) -> None:
    module = tmp_path / "pzd" / "sweep" / "wrong.py"
    module.parent.mkdir(parents=True)
    module.write_text("def f():\n    from pzd.paper.published import published")
    assert users_of("paper", tmp_path / "pzd") == {"sweep"}


@pytest.mark.parametrize(
    "line",
    [
        "import pzd.cli",
        "from pzd.cli import main",
        "from pzd import cli",
        "from ..cli import main",
        "def f():\n    from pzd.cli import main",
        "if TYPE_CHECKING:\n    from pzd.runs import Folder",
        "import importlib\nimportlib.import_module('pzd.cli')",
    ],
)
def test_an_import_from_below_is_found(line: str, tmp_path: Path) -> None:
    module = tmp_path / "pzd" / "damper" / "wrong.py"
    module.parent.mkdir(parents=True)
    module.write_text(line)
    assert faults(module, tmp_path / "pzd")


def test_an_import_from_above_or_of_its_own_package_is_none(tmp_path: Path) -> None:
    module = tmp_path / "pzd" / "damper" / "right.py"
    module.parent.mkdir(parents=True)
    module.write_text("import numpy\nfrom pzd.quantities import TIME\nfrom pzd.damper.model import Damper\nimport pzd")
    assert not faults(module, tmp_path / "pzd")


def test_names_of_modules_say_something() -> None:
    names = [dotted(module, PACKAGE) for module in MODULES]
    assert [name for name in names if SAYS_NOTHING & set(name.split("."))] == []


def sets() -> list[tuple[str, str]]:
    """The packages that are sets of files, each with the function that finds them."""
    return [
        (dotted(module, PACKAGE), node.name)
        for module in MODULES
        if module.stem == "__init__"
        for node in ast.parse(module.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef) and "iter_modules(__path__)" in ast.unparse(node)
    ]


def test_the_sets_of_the_house_are_found() -> None:
    assert {
        "pzd.damper.effects",
        "pzd.rig.files.formats",
        "pzd.simulate.cars",
        "pzd.report.plots",
        "pzd.export.formats",
    } <= {s for s, _ in sets()}


@pytest.mark.parametrize(("name", "function"), sets())
def test_a_set_holds_what_its_folder_holds(name: str, function: str) -> None:
    package = importlib.import_module(name)
    files = {path.stem for path in Path(package.__path__[0]).glob("*.py")} - {"__init__"}
    assert len(getattr(package, function)()) >= len(files)  # a file may hold a family


JUDGED = ("damper", "rig", "identify", "diagnose", "signals")
"""What the second generator of the blind benchmark judges, and therefore does not share."""


def borrowed(package: Path) -> list[str]:
    """What the second generator imports of the code that it judges."""
    return [
        f"{module.relative_to(package.parent)}:{line}: {name}"
        for module in sorted((package / "blind" / "independent").rglob("*.py"))
        for line, name in imported(
            ast.parse(module.read_text("utf-8")), dotted(module, package), is_package=module.stem == "__init__"
        )
        if layer(name) in JUDGED or (layer(name) == "blind" and not name.startswith("pzd.blind.independent"))
    ]


def test_the_second_generator_shares_nothing_with_what_it_judges() -> None:
    assert (PACKAGE / "blind" / "independent" / "kernel.py").exists()
    assert borrowed(PACKAGE) == []


@pytest.mark.parametrize("line", ["from pzd.damper.element import element_force", "import pzd.blind.hide"])
def test_a_loan_of_the_second_generator_is_found(line: str, tmp_path: Path) -> None:
    module = tmp_path / "pzd" / "blind" / "independent" / "laws" / "wrong.py"
    module.parent.mkdir(parents=True)
    module.write_text(f"def f():\n    {line}", encoding="utf-8")
    assert len(borrowed(tmp_path / "pzd")) == 1
