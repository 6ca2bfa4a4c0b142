"""Rules of effect files: a broken one is an error at import, with the name of the file."""

from __future__ import annotations

import pkgutil
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pzd.damper.confounders import known, module_of
from pzd.damper.effect import Scales, arguments, functions
from pzd.damper.effects import effects_in, library, nameable

GOOD = """
from pzd.damper.effect import Effect, Parameter, Search, growing

EFFECT = Effect(
    name="NAME",
    place="PLACE",
    law="+ q w^3",
    parameters=(Parameter("q", "N s3/m3", 0.0, 0.0, 1e9, "made up", Search(lambda s: 1.0, (1.0,))),),
    source="made up",
    tests=(),
    hidden=growing("q", lambda s: 1.0),
)


def extra_force(w, q):
    return q * w**3


def extra_slope(w, q):
    return 3.0 * q * w**2
"""

BRANCH = (
    GOOD.replace("NAME", "cubic").replace("PLACE", "branch").partition("def extra_force")[0]
    + """
def advance(deflection, travel): ...
def law(deflection, q): ...
def rate(deflection, side): ...
"""
)

Effects = Callable[..., list[str]]


@pytest.fixture
def effects(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Effects:
    """Names of the effects in a folder of files, given by name and text."""

    def found(**files: str) -> list[str]:
        package = tmp_path / "made_up_effects"
        package.mkdir()
        (package / "__init__.py").touch()
        for name, text in files.items():
            (package / f"{name}.py").write_text(text, encoding="utf-8")
        monkeypatch.syspath_prepend(tmp_path)
        try:
            return [e.name for e in effects_in("made_up_effects", pkgutil.iter_modules([str(package)]))]
        finally:
            for name in [name for name in sys.modules if name.startswith("made_up_effects")]:
                del sys.modules[name]

    return found


def text(old: str = "", new: str = "", name: str = "cubic", place: str = "flow") -> str:
    """A good file with one change."""
    return GOOD.replace("NAME", name).replace("PLACE", place).replace(old, new)


def test_a_file_that_keeps_the_rules_declares_an_effect(effects: Effects) -> None:
    assert effects(cubic=text()) == ["cubic"]


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (text("EFFECT =", "OTHER ="), "cubic.py: declares no EFFECT"),
        (text("def extra_slope", "def slope"), "cubic.py: extra_slope must stand beside extra_force"),
        (text("w, q", "w, b"), "cubic.py: extra_force takes w, side, q .got b."),
        (text(place="parallel"), "cubic.py: an effect of the parallel needs law"),
        (text(place="inside"), "cubic.py: there is no place inside"),
        (text('"q"', '"T0"').replace("w, q", "w, T0"), "cubic.py: parameter T0 has .* quantity.*model.py"),
        (text('"q"', '"k"').replace("w, q", "w, k"), "cubic.py: parameter k has a name of the element's.*model.py"),
        (text('"q"', '"w"').replace("w, q", "w"), "cubic.py: parameter w has the name of a quantity"),
        (text("),),\n", "),) * 2,\n"), "cubic.py: parameter q is declared twice"),
        (BRANCH.replace("def rate", "def slope"), "cubic.py: rate must stand beside advance"),
        (BRANCH.replace("def law", "def force"), "cubic.py: law must stand beside advance"),
        (text(name="other"), "cubic.py: declares the effect other, so it must be called other.py"),
    ],
)
def test_a_broken_rule_is_an_error_at_import(effects: Effects, fault: str, said: str) -> None:
    with pytest.raises(ImportError, match=said):
        effects(cubic=fault)


def test_two_files_of_one_name_are_an_error_with_both(effects: Effects) -> None:
    with pytest.raises(ImportError, match=r"cubic.py and .*other.py both declare the effect cubic"):
        effects(cubic=text(), other=text())


def test_a_confounder_with_the_name_of_an_effect_is_an_error_with_both_files(monkeypatch: pytest.MonkeyPatch) -> None:
    from pzd.damper import confounders

    known.cache_clear()
    monkeypatch.setattr(confounders, "confounders", lambda: {"lash": library()["lash"]})
    with pytest.raises(ImportError, match=r"effects/lash.py and .*confounders/lash.py both declare lash"):
        known()
    known.cache_clear()


SCALES = Scales(force=2000.0, low_force=800.0, speed=0.4, stroke=0.03, acceleration=5.0, damping=2700.0, voltage=150.0)


def hidden(name: str, strength: float, rng: np.random.Generator) -> dict[str, float]:
    """Parameters of an effect as the benchmark draws them."""
    hiding = library()[name].hidden
    assert hiding is not None
    return hiding(rng, SCALES)(strength)


@pytest.mark.parametrize("name", [name for name, effect in nameable().items() if not effect.beside_gas])
@pytest.mark.parametrize("strength", [1e-3, 1.0])
def test_an_effect_is_hidden_with_admissible_values_of_all_its_parameters(
    name: str, strength: float, rng: np.random.Generator
) -> None:
    values = hidden(name, strength, rng)
    assert set(values) == {p.name for p in library()[name].parameters}
    assert all(library()[name].parameter(key).admits(value) for key, value in values.items())


SLOPES = {"yield_force": "yield_slope", "viscous_force": "viscous_slope", "extra_force": "extra_slope"}


@pytest.mark.parametrize("name", [name for name, effect in library().items() if effect.place == "flow"])
def test_slopes_of_the_flow_are_derivatives_and_nothing_falls_with_the_speed(
    name: str, rng: np.random.Generator
) -> None:
    laws, values = functions(library()[name], module_of(library()[name])), hidden(name, 0.5, rng)
    for law, slope in SLOPES.items():
        if law not in laws:
            continue
        first = {"extra_force": (), "yield_force": (400.0,), "viscous_force": (2700.0,)}[law]
        for w in (0.003, 0.02, 0.3):
            step = 1e-6 * w
            difference = laws[law](w + step, *first, **values) - laws[law](w - step, *first, **values)
            assert laws[slope](w, *first, **values) == pytest.approx(difference / (2.0 * step), rel=1e-6)
            assert difference >= 0.0


@pytest.mark.parametrize("name", [name for name, effect in library().items() if effect.place == "flow"])
def test_inverses_of_the_flow_give_the_speed_back(name: str, rng: np.random.Generator) -> None:
    laws, values = functions(library()[name], module_of(library()[name])), hidden(name, 0.5, rng)
    for w in (0.003, 0.02, 0.3):
        if "viscous_speed" in laws:
            s = laws["viscous_force"](w, 2700.0, **values)
            assert laws["viscous_speed"](s, 2700.0, **values) == pytest.approx(w, rel=1e-12)
        if "extra_speed" in laws:
            force = 2700.0 * w + laws["extra_force"](w, **values)
            assert laws["extra_speed"](force, 2700.0, **values) == pytest.approx(w, rel=1e-12)
        if "extra_force" in laws:
            assert laws["extra_force"](0.0, **values) == 0.0


@pytest.mark.parametrize("name", [name for name, effect in library().items() if effect.place == "stroke"])
def test_the_inverse_of_a_stroke_law_gives_the_deflection_back(name: str, rng: np.random.Generator) -> None:
    values = {"delta": 3e-4, "F_m": 150.0} if name == "mount_play" else hidden(name, 0.5, rng)
    laws = {
        law: (lambda first, side, call=call: call(first, side, *([2e5] if "k" in arguments(call) else []), **values))
        for law, call in functions(library()[name], module_of(library()[name])).items()
    }
    for e in (-0.01, -0.001, 0.002, 0.02):
        side = float(np.sign(e))
        assert laws["inverse"](laws["law"](e, side), side) == pytest.approx(e, rel=1e-12)
