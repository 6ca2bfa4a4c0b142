"""A hypothesis as an effect file: a force beside the element, ready to be forced on the next diagnosis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from pzd.artefacts import HypothesisRow
from pzd.diagnose.hypotheses.shapes import SHAPES, Shape
from pzd.schema.errors import ConfigError

OF_THE_CONTROL = "U "
"""How the name of a shape begins that goes with the control signal."""
AT = {"x": 0.01, "v": 0.1, "a": 1.0}
"""Where the file gives a reference number [m, m/s, m/s2]."""


@dataclass(frozen=True)
class Proposal:
    """An effect file, and why the hypotheses before it are none."""

    name: str
    text: str
    row: HypothesisRow
    passed_over: tuple[str, ...]


def proposal_of(rows: Sequence[HypothesisRow], run: str, largest_control: float) -> Proposal:
    """The best hypothesis that an effect file can hold.

    Parameters
    ----------
    rows : the hypotheses by themselves, the best first
    run : what the file says that it was drawn from
    largest_control : largest magnitude of the control signal [its unit]

    Raises
    ------
    ConfigError : when none can be written, with the reason for each
    """
    passed_over: list[str] = []
    for row in rows:
        if why := _not_written(row):
            passed_over.append(f"{row.shape}: {why}")
            continue
        name = _name(row.shape)
        return Proposal(name, _text(row, name, run, largest_control), row, tuple(passed_over))
    listed = "; ".join(passed_over) or "diagnose told none"
    raise ConfigError(f"{run}: there is no hypothesis that an effect file can hold ({listed})")


def _shape(row: HypothesisRow) -> Shape | None:
    name = row.shape.removeprefix(OF_THE_CONTROL)
    return next((shape for shape in SHAPES if shape.name == name), None)


def _not_written(row: HypothesisRow) -> str | None:
    shape = _shape(row)
    if row.library and not row.shape.startswith(OF_THE_CONTROL):
        return f"is {row.library} of the library, which diagnose.force takes"
    if shape is None or shape.law is None:
        return "is no function of x, v and a, as the force beside the element in an effect file is"
    return None


def _name(shape: str) -> str:
    """The shape as a name: |x| v becomes abs_x_v."""
    plain = shape.removeprefix(OF_THE_CONTROL).split("/")[0]
    for symbol, word in (("2 pi ", ""), ("|x|", "abs_x"), ("|v|", "abs_v"), ("|a|", "abs_a"), ("^", "")):
        plain = plain.replace(symbol, word)
    name = "_".join(plain.split())
    return name if name.isidentifier() else f"hypothesis_{name}"


def _text(row: HypothesisRow, name: str, run: str, largest_control: float) -> str:
    shape = next(shape for shape in SHAPES if shape.name == row.shape.removeprefix(OF_THE_CONTROL))
    by_control = row.shape.startswith(OF_THE_CONTROL)
    laws = (shape.law or "").format(parameter=row.parameter_value, width=row.width_m).split(";")
    values = [row.coefficient, *([row.second_coefficient] if row.second_coefficient is not None else [])]
    values = [value * (largest_control if by_control else 1.0) for value in values]
    symbols = _symbols(len(values))
    printed = (
        f"{symbols[0]} {shape.name}"
        if len(values) == 1
        else (
            f"{symbols[0]} sin(2 pi x/lambda) + {symbols[1]} cos(2 pi x/lambda), lambda = {row.parameter_value:.4g} m"
        )
    )
    body = " + ".join(f"{symbol} * {law}" for symbol, law in zip(symbols, laws, strict=True))
    taken = [letter for letter in AT if letter in _letters(body)]
    arguments = ", ".join(f"{letter}: float" for letter in (*taken, *symbols))
    given = {letter: AT[letter] for letter in taken} | dict(zip(symbols, values, strict=True))
    expected = float(eval(body, {"math": math, **given}))  # noqa: S307  # a law of `SHAPES`, with numbers
    lines = [_parameter(name, value, shape, by_control=by_control) for name, value in zip(symbols, values, strict=True)]
    return "\n".join(
        [
            f'"""A hypothesis on what the diagnosis of {run} left: {row.physics}.',
            "",
            f"Law: {printed}. On tests kept back it would close {row.closes:.0%} of what is left there.",
            "It is no name: that the shape fits does not say that the physics is this one.",
            '"""',
            "",
            "from __future__ import annotations",
            "",
            *(["import math", ""] if "math" in _letters(body) else []),
            "from pzd.damper.effect import Effect, Parameter, Search",
            "",
            "EFFECT = Effect(",
            f'    name="{name}",',
            '    place="parallel",',
            f'    law="{printed}",',
            "    parameters=(",
            *lines,
            "    ),",
            f'    source="hypothesis of pzd diagnose; {row.source}",',
            f"    tests=(({given!r}, {expected!r}),),",
            '    never_named="a hypothesis that no benchmark has tried",',
            ")",
            "",
            "",
            f"def law({arguments}) -> float:",
            '    """Force [N] beside the element; x [m], v [m/s] and a [m/s2] of the rod."""',
            f"    return {body}",
            "",
        ]
    )


def _letters(body: str) -> set[str]:
    import ast

    return {node.id for node in ast.walk(ast.parse(body)) if isinstance(node, ast.Name)}


def _symbols(count: int) -> tuple[str, ...]:
    """Names of the coefficients; the element has C, and no effect of a place shares columns with another."""
    return ("c",) if count == 1 else ("c_sin", "c_cos")


def _parameter(symbol: str, value: float, shape: Shape, *, by_control: bool) -> str:
    size = f"Search(lambda s: {abs(value)!r}, ({math.copysign(1.0, value)!r},))"
    more = ", with_friction=True" if by_control else ""
    return f'        Parameter("{symbol}", "{shape.unit}", 0.0, -1.0e12, 1.0e12, "coefficient", {size}{more}),'
