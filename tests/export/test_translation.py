"""Every law in C is the law in Python over its whole range; what C cannot hold is said, with its place."""

from __future__ import annotations

import inspect
import math
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from exported_dampers import DAMPERS, content_of

from pzd.damper import path
from pzd.damper.compiled import kernels
from pzd.damper.compiled.columns import acting
from pzd.damper.confounders import module_of
from pzd.damper.effect import Effect, functions
from pzd.export.dynamics import ROW, laws, source
from pzd.export.translation import Translation, UntranslatableError, number

GCC = shutil.which("gcc")
needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not installed: apt-get install gcc")
POINTS = 400
QUANTITIES = {
    **dict.fromkeys(("effective", "before", "now"), (-200.0, 200.0)),
    **dict.fromkeys(("deflection", "extension", "travel", "x"), (-0.02, 0.02)),
    "k": (1e4, 1e9),
    **dict.fromkeys(("T0", "force", "viscous"), (0.0, 5000.0)),
    "w": (0.0, 3.0),
    "v": (-3.0, 3.0),
    "a": (-50.0, 50.0),
    "C": (1.0, 2e4),
    "step": (1e-5, 0.02),
    "rate": (-1e4, 1e4),
    "temperature": (-20.0, 120.0),
    "reference": (0.0, 40.0),
}
"""What a law may be asked, from standstill to more than any rig reaches."""
EFFECTS = [
    effect for place in ("drive", "material", "stroke", "flow", "parallel", "branch") for effect in acting(place)
]


def given(effect: Effect, law: Callable[..., float], rng: np.random.Generator) -> dict[str, float]:
    """A point in the range of a law: parameters from all their limits, some of them neutral, quantities beside them."""
    found = {}
    for name in inspect.signature(law).parameters:
        if name == "side":
            found[name] = float(rng.choice([-1.0, 1.0]))
        elif name in ("C", "k"):
            found[name] = float(rng.uniform(*QUANTITIES[name]))  # of a path, never 0
        elif name in QUANTITIES:
            found[name] = float(rng.choice([0.0, rng.uniform(*QUANTITIES[name])], p=[0.05, 0.95]))
        else:
            parameter = effect.parameter(name)
            low, high = max(parameter.low, -1e6), min(parameter.high, 1e6)
            spread = math.copysign(high, rng.uniform(low, high)) * 10.0 ** rng.uniform(-6.0, 0.0)
            found[name] = float(rng.choice([parameter.neutral, min(max(spread, low), high)], p=[0.1, 0.9]))
    if "deflection" in found and "side" in found and effect.place == "stroke":
        found["deflection"] = found["side"] * abs(found["deflection"])
    return found


def answers(calls: list[str], written: Translation, folder: Path, *flags: str) -> np.ndarray:
    """What expressions in C give."""
    (folder / "real.h").write_bytes(source(content_of(DAMPERS["plain"]), "real.h"))
    lines = "".join(f'    printf("%.17g\\n", (double)({call}));\n' for call in calls)
    extremes = "".join(
        f"real {name}(real one, real other)\n{{\n    return other {sign} one ? other : one;\n}}\n"
        for name, sign in (("least", "<"), ("most", ">"))
    )
    types = f"typedef struct {{ real at[{ROW}]; }} row;\n{written.types()}"
    text = f'#include <stdio.h>\n#include "real.h"\n{types}{extremes}{written.prototypes(shared=True)}'
    text += f"{written.prototypes(shared=False)}{written.definitions()}\nint main(void)\n{{\n{lines}    return 0;\n}}\n"
    (folder / "laws.c").write_text(text)
    command = [str(GCC), "-std=c99", "-O0", *flags, "laws.c", "-o", "laws", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    printed = subprocess.run([folder / "laws"], capture_output=True, text=True, check=True).stdout
    return np.array(printed.split(), dtype=np.float64)


@needs_gcc
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_every_law_of_an_effect_is_ours_over_its_whole_range(
    effect: Effect, tmp_path: Path, rng: np.random.Generator
) -> None:
    written, calls, ours = Translation(ROW, kernels, frozenset()), [], []
    for law in functions(effect, module_of(effect)).values():
        name = written.add(law)
        for _ in range(POINTS):
            point = given(effect, law, rng)
            calls.append(f"{name}({', '.join(in_c(value) for value in point.values())})")
            ours.append(float(law(**point)))
    double = answers(calls, written, tmp_path)
    np.testing.assert_allclose(double, ours, rtol=1e-12, atol=1e-300)


def in_c(value: float) -> str:
    """A number of a point as an argument."""
    return "R_INFINITY" if math.isinf(value) else f"R({value!r})"


def test_a_tolerance_has_as_large_a_share_of_the_digits_in_single_precision() -> None:
    assert number(0.5) == "R(0.5)"
    assert number(-math.inf) == "-R_INFINITY"
    word, double, single = number(1e-13).replace("(", ",").replace(")", "").split(",")
    digits = [np.log(float(np.finfo(kind).eps)) for kind in (np.float64, np.float32)]
    assert (word, float(double)) == ("EITHER", 1e-13)
    assert np.log(float(single)) / digits[1] == pytest.approx(np.log(1e-13) / digits[0], rel=0.01)


def test_the_laws_are_written_the_same_twice() -> None:
    first = laws()
    laws.cache_clear()
    assert laws() == first


def test_an_argument_that_c_does_without_is_left_out_with_all_that_asks_it() -> None:
    written = Translation(ROW, kernels, frozenset([path.Sensitivities]))
    written.add(path.advance)
    assert not any("sensitivities" in text.lower() for text in (*written.functions, *written.types()))


class _Parts(NamedTuple):
    whole: float
    rest: float


def _parts(w: float) -> _Parts:
    """Return the whole part of a number and the rest."""
    return _Parts(math.floor(w), w - math.floor(w))


def _one_part(w: float) -> float:
    """Return a field of what another function gives."""
    return _parts(w).rest + 10.0 * _parts(-w).whole


@needs_gcc
def test_a_field_of_what_a_function_gives_is_read(tmp_path: Path) -> None:
    written = Translation(ROW, kernels, frozenset())
    name = written.add(_one_part)
    assert answers([f"{name}(R(2.25))"], written, tmp_path) == _one_part(2.25) == -29.75


def _listed(w: float) -> float:
    """Return the sum of a list."""
    return sum([w, w])


def _looped(w: float) -> float:
    """Return a number after a loop."""
    while w > 1.0:
        w = 0.5 * w
    return w


def _named(w: float) -> float:
    """Return what a text decides."""
    return w if "a" == "b" else -w  # noqa: PLR0133  # what is translated, not what is run


def _no_part(w: float) -> float:
    """Return a field that there is not."""
    return math.floor(w).rest  # type: ignore[attr-defined,no-any-return]  # what is translated, not what is run


@pytest.mark.parametrize("law", [_listed, _looped, _named, _no_part], ids=lambda law: law.__name__)
def test_a_law_that_c_cannot_hold_is_refused_with_its_place(law: Any) -> None:
    with pytest.raises(UntranslatableError, match=r"test_translation\.py:\d+: .* is not written in C"):
        Translation(ROW, kernels, frozenset()).add(law)
