"""Sums, differences, products and quotients of numbers that stand elsewhere: `100 * ([b] / [a] - 1)`."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping

_TERM = re.compile(r"\[([^\[\]]+)\]")
_TWO: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


def terms(text: str) -> tuple[str, ...]:
    """The ids between brackets, each once, in the order of the text."""
    return tuple(dict.fromkeys(_TERM.findall(text)))


def parsed(text: str) -> ast.expr:
    """The tree of an expression; each id is a name in it, by its place in `terms`.

    Raises
    ------
    ValueError : when it is anything else than + - * / and parentheses between numbers and `[id]`
    """
    places = {name: number for number, name in enumerate(terms(text))}
    try:
        tree = ast.parse(_TERM.sub(lambda found: f" term{places[found[1]]} ", text).strip(), mode="eval").body
    except SyntaxError:
        tree = None
    if tree is None or not _is_arithmetic(tree, set(range(len(places)))):
        raise ValueError("is neither a name like measures.peak_force_N nor arithmetic like 100 * ([b] / [a] - 1)")
    return tree


def evaluated(text: str, numbers: Mapping[str, float]) -> float:
    """The value of an expression.

    Parameters
    ----------
    text : + - * / and parentheses between numbers and `[id]`
    numbers : the value of each id

    Raises
    ------
    ValueError : when it is no such expression
    ZeroDivisionError : when a divisor is 0
    """
    return _value(parsed(text), {f"term{number}": numbers[name] for number, name in enumerate(terms(text))})


def _is_arithmetic(node: ast.expr, places: set[int]) -> bool:
    if isinstance(node, ast.BinOp):
        return type(node.op) in _TWO and _is_arithmetic(node.left, places) and _is_arithmetic(node.right, places)
    if isinstance(node, ast.UnaryOp):
        return isinstance(node.op, ast.USub) and _is_arithmetic(node.operand, places)
    if isinstance(node, ast.Name):
        return node.id in {f"term{place}" for place in places}
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def _value(node: ast.expr, numbers: Mapping[str, float]) -> float:
    if isinstance(node, ast.BinOp):
        return _TWO[type(node.op)](_value(node.left, numbers), _value(node.right, numbers))
    if isinstance(node, ast.UnaryOp):
        return -_value(node.operand, numbers)
    return numbers[node.id] if isinstance(node, ast.Name) else float(ast.literal_eval(node))
