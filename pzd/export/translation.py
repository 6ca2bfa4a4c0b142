"""Compiled laws of the damper written in C, so that what is exported is what pzd itself computes with.

The functions that numba compiles take and return numbers, rows of numbers and named tuples of them; this subset of
Python is also one of C. A function is translated with all that it calls, statement by statement, in `real`: double or
single precision, as the macros of `laws.h` say. A number below `LEAST_LENGTH` is a tolerance, so many digits out of
those of a double; in single precision it is as large a share of the digits there are.
"""

from __future__ import annotations

import ast
import inspect
import math
import sys
import textwrap
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import FunctionType, ModuleType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from pzd.record import Array

LEAST_LENGTH = 1e-6
"""A constant below this is a share of the digits of a number; none of the damper itself is as small."""
_DIGITS = math.log(float(np.finfo(np.float32).eps)) / math.log(float(np.finfo(np.float64).eps))
"""Digits of single precision as a share of those of double."""

REAL, INT, ROW, VOID, POINTER = "real", "int", "row", "void", "real *"
_ABSENT = "absent"
_MATHEMATICS = {
    **{name: name for name in ("acos", "asin", "atan", "cos", "cosh", "exp", "expm1", "log", "log1p", "sin", "sinh")},
    **{name: name for name in ("sqrt", "tan", "tanh", "ceil", "floor", "fabs", "pow", "hypot", "atan2", "copysign")},
}
"""Functions of `math` and numpy, of numbers, that C has by the same name."""
_PLAIN = {"asarray": "", "float": "", "float64": ""}
"""Functions that leave a number as it is."""
_LARGEST = {"min": "least", "max": "most", "minimum": "least", "maximum": "most"}
"""Functions of `laws.h` by their names in Python and numpy."""
_TESTS = {"isnan": "isnan", "isinf": "isinf", "isfinite": "isfinite"}
_BINARY: Mapping[type, tuple[str, int]] = {
    ast.Add: ("+", 12),
    ast.Sub: ("-", 12),
    ast.Mult: ("*", 13),
    ast.Div: ("/", 13),
}
"""Operators with their precedence."""
_COMPARED: Mapping[type, str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
_UNARY, _CALL = 14, 16
_RESERVED = frozenset(
    ("double", "float", "int", "char", "short", "long", "real", "row", "least", "most", "default", "M")
)


class UntranslatableError(ValueError):
    """A law that has no counterpart in C, with its place."""


@dataclass(frozen=True)
class _Signature:
    name: str
    parameters: tuple[str, ...]
    result: str


@dataclass(frozen=True)
class _Code:
    """An expression in C."""

    text: str
    kind: str
    level: int = _CALL
    """Its precedence."""

    def within(self, level: int) -> str:
        """Return it in brackets where it binds less than its surroundings."""
        return self.text if self.level >= level else f"({self.text})"


@dataclass
class Translation:
    """Functions in C, with all that they call."""

    width: int
    """Numbers in a parameter row."""
    declared: ModuleType
    """Module whose annotations declare the functions that have none of their own."""
    absent: frozenset[type] = frozenset()
    """Types of arguments that the C does without, together with every branch that asks them."""
    singles: Mapping[str, float] = field(default_factory=dict)
    """What some constants, `module.name`, are in single precision."""
    structs: dict[str, tuple[tuple[str, str], ...]] = field(default_factory=dict)
    """Type and name of each field by the name of the structure."""
    functions: dict[str, str] = field(default_factory=dict)
    """Bodies by their heads."""
    _known: dict[object, _Signature] = field(default_factory=dict)
    _open: set[str] = field(default_factory=set)

    def add(self, function: Callable[..., Any]) -> str:
        """Translate a function that others may call, and all that it calls itself; return its name in C.

        Raises
        ------
        UntranslatableError : when it uses what C has no counterpart for
        """
        found = self.signature(function)
        self._open.add(found.name)
        return found.name

    def signature(self, function: Callable[..., Any]) -> _Signature:
        """Return how a function is called in C; the first time it is translated.

        Raises
        ------
        UntranslatableError : when it uses what C has no counterpart for
        """
        plain = inspect.unwrap(function)
        if not isinstance(plain, FunctionType):
            raise UntranslatableError(f"{function!r} is no function of pzd")
        if plain.__code__ not in self._known:
            hints = self._hints(plain)
            names = list(inspect.signature(plain).parameters)
            kinds = tuple(self.kind(hints.get(name, float), plain) for name in names)
            module = plain.__globals__["__name__"].rpartition(".")[2].removeprefix("pzd_damper_")
            found = _Signature(
                f"{module}_{plain.__name__.lstrip('_')}", kinds, self.kind(hints.get("return", float), plain)
            )
            self._known[plain.__code__] = found
            head = ", ".join(_declared(k, _name(n)) for k, n in zip(kinds, names, strict=True) if k != _ABSENT)
            body = _Body(self, plain, dict(zip(names, kinds, strict=True)), found.result)
            self.functions[f"{found.result} {found.name}({head or 'void'})"] = body.text()
        return self._known[plain.__code__]

    def kind(self, hint: object, where: FunctionType) -> str:  # noqa: PLR0911  # one for each kind of annotation
        """Return the type in C of an annotation.

        Raises
        ------
        UntranslatableError : when there is none
        """
        if hint in self.absent:
            return _ABSENT
        if hint in (float, int, bool, None, type(None)):
            return {float: REAL, int: INT, bool: INT}.get(typing.cast("Any", hint), VOID)
        if str(hint) == str(tuple[float, ...]):
            return ROW
        if get_origin(hint) is tuple:
            return self.pair([self.kind(one, where) for one in get_args(hint)])
        if hint == Array:
            return POINTER
        if float in get_args(hint):  # a number or an array of them
            return REAL
        if isinstance(hint, type) and issubclass(hint, tuple) and hasattr(hint, "_fields"):
            hints = get_type_hints(hint)
            name = "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in hint.__name__).strip("_")
            self.structs[name] = tuple((self.kind(hints[one], where), _name(one)) for one in hint._fields)
            return name
        raise UntranslatableError(
            f"{_place(where)}: {where.__name__} takes or returns {hint}, which is not written in C"
        )

    def pair(self, kinds: Sequence[str]) -> str:
        """Return the structure of several numbers."""
        name = "_".join(kinds)
        self.structs[name] = tuple((kind, f"at{i}") for i, kind in enumerate(kinds))
        return name

    def _hints(self, function: FunctionType) -> dict[str, Any]:
        """Return the annotations of a function, or those by which `declared` declares it."""
        written = vars(sys.modules[function.__globals__["__name__"]]).get(function.__name__)
        if isinstance(written, FunctionType) and written.__code__ is function.__code__:
            function = written  # a compiled law is a copy without annotations
        hints = get_type_hints(function)
        if hints.get("return") == Array and all(
            h is float or float in get_args(h) for n, h in hints.items() if n != "return"
        ):
            hints["return"] = float  # a law of numbers or arrays, here of numbers
        if hints:
            return hints
        declared = get_type_hints(self.declared).get(function.__name__)
        if declared is None:
            return {}
        arguments, result = get_args(declared)
        return {**dict(zip(inspect.signature(function).parameters, arguments, strict=True)), "return": result}

    def prototypes(self, shared: bool) -> str:
        """Write the prototypes of the functions that others may call, or of the rest."""
        return "".join(f"{self._head(head)};\n" for head in self.functions if self._is_shared(head) == shared)

    def definitions(self) -> str:
        """Write all functions."""
        parts = ((self._head(head), *body.split("\0")) for head, body in self.functions.items())
        return "\n".join(f"/* {summary} */\n{head}\n{body}" for head, summary, body in parts)

    def _is_shared(self, head: str) -> bool:
        return head.partition("(")[0].rpartition(" ")[2] in self._open

    def _head(self, head: str) -> str:
        return head if self._is_shared(head) else f"static {head}"

    def types(self) -> str:
        """Write the structures."""
        return "".join(
            f"typedef struct {{ {' '.join(f'{_declared(kind, name)};' for kind, name in fields)} }} {struct};\n"
            for struct, fields in self.structs.items()
        )


def number(value: float, single: float | None = None) -> str:
    """Write a number for either precision, where need be one for single precision."""
    if single is not None:
        return f"EITHER({float(value)!r}, {float(single)!r})"
    if math.isnan(value) or math.isinf(value):
        return "R_NAN" if math.isnan(value) else f"{'-' if value < 0.0 else ''}R_INFINITY"
    if 0.0 < abs(value) < LEAST_LENGTH:
        return f"EITHER({float(value)!r}, {math.copysign(float(f'{abs(value) ** _DIGITS:.2g}'), value)!r})"
    return f"R({float(value)!r})"


def _declared(kind: str, name: str) -> str:
    return f"{kind}{name}" if kind.endswith("*") else f"{kind} {name}"


def _name(name: str) -> str:
    return f"{name}_" if name in _RESERVED else name


def _place(function: FunctionType) -> str:
    return f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"


# --- One function ---


class _Body:
    """The statements of one function in C."""

    def __init__(self, into: Translation, function: FunctionType, parameters: Mapping[str, str], result: str) -> None:
        self.into, self.function, self.result = into, function, result
        self.kinds = dict(parameters)
        self.locals: dict[str, str] = {}
        self.temporaries = 0
        (self.tree,) = typing.cast(
            "list[ast.FunctionDef]", ast.parse(textwrap.dedent(inspect.getsource(function))).body
        )
        self.read = {
            node.id for node in ast.walk(self.tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
        }

    def text(self) -> str:
        """Return what it does in a line, a zero, and the function in braces."""
        doc = (ast.get_docstring(self.tree) or self.function.__name__).partition("\n")[0].replace("*/", "* /")
        lines = [line for statement in self.tree.body for line in self.statement(statement)]
        begun = [f"{_declared(kind, _name(name))}{_zero(kind)};" for name, kind in self.locals.items()]
        return f"{doc}\0{{\n" + "".join(f"    {line}\n" for line in (*begun, *lines)) + "}\n"

    def refused(self, node: ast.AST, what: str) -> UntranslatableError:
        """Return the error for what C has no counterpart for."""
        line = self.function.__code__.co_firstlineno + getattr(node, "lineno", 1) - 1
        return UntranslatableError(f"{self.function.__code__.co_filename}:{line}: {what} is not written in C")

    # --- Statements ---

    def statement(self, node: ast.stmt) -> Iterator[str]:  # noqa: C901  # one case for each kind of statement
        """Yield the lines of a statement."""
        match node:
            case ast.Expr(value=ast.Constant()) | ast.Pass():
                return
            case ast.Expr(value=call):
                yield f"{self.expression(call).text};"
            case ast.Return(value=None):
                yield "return;"
            case ast.Return(value=value) if value is not None:
                yield f"return {self.as_kind(value, self.result).text};"
            case ast.Assign(targets=[target], value=value):
                yield from self.assign(target, value)
            case ast.AugAssign(target=target, op=operator, value=value):
                found = self.expression(ast.BinOp(_loaded(target), operator, value), node)
                yield f"{self.expression(_loaded(target)).text} = {found.text};"
            case ast.If():
                yield from self.branch(node)
            case ast.For(target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=[end])):
                index = self.fresh() if name == "_" else _name(name)
                self.kinds[name] = INT
                yield f"for (int {index} = 0; {index} < {self.as_kind(end, INT).within(11)}; {index}++) {{"
                yield from self.block(node.body)
                yield "}"
            case ast.Break():
                yield "break;"
            case ast.Continue():
                yield "continue;"
            case _:
                raise self.refused(node, type(node).__name__)

    def block(self, statements: Sequence[ast.stmt]) -> Iterator[str]:
        """Yield lines set in."""
        yield from (f"    {line}" for statement in statements for line in self.statement(statement))

    def branch(self, node: ast.If) -> Iterator[str]:
        """Yield a branch, unless it asks an argument that C does without."""
        asked = {one.id for one in ast.walk(node.test) if isinstance(one, ast.Name)}
        if any(self.kinds.get(name) == _ABSENT for name in asked):
            for statement in node.orelse:
                yield from self.statement(statement)
            return
        yield f"if ({self.expression(node.test).text}) {{"
        yield from self.block(node.body)
        if node.orelse:
            yield "} else {"
            yield from self.block(node.orelse)
        yield "}"

    def assign(self, target: ast.expr, value: ast.expr) -> Iterator[str]:
        """Yield an assignment to a name, a place or several of them."""
        if not isinstance(target, ast.Tuple):
            yield from self.put(target, self.expression(value))
        elif isinstance(value, ast.Tuple):
            pairs = [(t, self.expression(v)) for t, v in zip(target.elts, value.elts, strict=True) if self.wanted(t)]
            if len(pairs) == 1 or not _names(target) & _names(value):
                for place, found in pairs:
                    yield from self.put(place, found)
                return
            for place, found in pairs:  # all are evaluated before the first is assigned
                kept = self.fresh()
                yield f"const {found.kind} {kept} = {found.text};"
                yield from self.put(place, _Code(kept, found.kind))
        else:
            found = self.expression(value)
            if found.kind not in self.into.structs:
                raise self.refused(value, f"unpacking {ast.unparse(value)}")
            fields = self.into.structs[found.kind]
            kept = found.text
            if found.level != _CALL or not found.text.isidentifier():
                kept = self.fresh()
                yield f"const {found.kind} {kept} = {found.text};"
            for place, (kind, name) in zip(target.elts, fields, strict=True):
                yield from self.put(place, _Code(f"{kept}.{name}", kind))

    def wanted(self, target: ast.expr) -> bool:
        """Return whether what is assigned is ever read."""
        return not (isinstance(target, ast.Name) and target.id not in self.read)

    def put(self, target: ast.expr, found: _Code) -> Iterator[str]:
        """Yield the assignment of an expression."""
        if not self.wanted(target):
            return
        if isinstance(target, ast.Name) and target.id not in self.kinds:
            self.kinds[target.id] = self.locals[target.id] = found.kind
        place = self.expression(_loaded(target))
        yield f"{place.text} = {self.cast(found, place.kind, target).text};"

    def fresh(self) -> str:
        """Return a name that nothing else has."""
        self.temporaries += 1
        return f"held{self.temporaries}"

    # --- Expressions ---

    def as_kind(self, node: ast.expr, kind: str) -> _Code:
        """Translate an expression of a wanted type."""
        if isinstance(node, ast.Tuple):
            if kind == ROW:
                return _Code(f"(row){{{{{', '.join(self.as_kind(one, REAL).text for one in node.elts)}}}}}", ROW)
            fields = self.into.structs[kind]
            entries = (self.as_kind(one, of).text for one, (of, _) in zip(node.elts, fields, strict=True))
            return _Code(f"({kind}){{{', '.join(entries)}}}", kind)
        if isinstance(node, ast.IfExp) and kind not in (REAL, INT):
            yes, no = self.as_kind(node.body, kind), self.as_kind(node.orelse, kind)
            return _Code(f"{self.expression(node.test).within(4)} ? {yes.within(4)} : {no.within(3)}", kind, 3)
        return self.cast(self.expression(node), kind, node)

    def cast(self, found: _Code, kind: str, node: ast.AST) -> _Code:
        """Return an expression as one of another type."""
        if found.kind == kind or (found.kind == _ABSENT and kind == _ABSENT):
            return found
        if kind == REAL and found.kind == INT:
            digits = found.text.removeprefix("-")
            return _Code(
                number(float(found.text)) if digits.isdigit() else f"(real){found.within(_UNARY)}", REAL, _UNARY
            )
        if found.kind in self.into.structs and kind in self.into.structs and isinstance(node, ast.expr):
            raise self.refused(node, f"{ast.unparse(node)}, a {found.kind} in the place of a {kind},")
        raise self.refused(node, f"a {found.kind} in the place of a {kind}")

    def expression(self, node: ast.expr, where: ast.AST | None = None) -> _Code:  # noqa: C901, PLR0911, PLR0912  # one case for each kind
        """Translate an expression."""
        match node:
            case ast.Constant(value=value):
                return self.constant(value, node)
            case ast.Name(id=name) if name in self.kinds:
                return _Code(_name(name), self.kinds[name])
            case ast.Attribute(value=ast.Call() as owner, attr=field_name):
                return self.field_of(self.expression(owner), field_name, node)
            case ast.Attribute(value=ast.Name(id=name) as owner, attr=field_name) if name in self.kinds:
                return self.field_of(self.expression(owner), field_name, node)
            case ast.Name() | ast.Attribute():
                return self.constant(self.found(node), node)
            case ast.Subscript(value=value, slice=index):
                return self.subscript(value, index)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return _Code(f"!{self.expression(operand).within(_UNARY)}", INT, _UNARY)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                found = self.expression(operand)
                return _Code(f"-{found.within(_CALL)}", found.kind, _UNARY)
            case ast.BinOp(left=left, op=operator, right=right):
                return self.binary(left, operator, right, where or node)
            case ast.BoolOp(op=operator, values=values):
                word = "&&" if isinstance(operator, ast.And) else "||"
                return _Code(f" {word} ".join(self.expression(one).within(7) for one in values), INT, 5)
            case ast.Compare():
                return self.compared(node)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                yes, no = self.expression(body), self.expression(orelse)
                kind = yes.kind if yes.kind == no.kind else REAL
                yes, no = self.cast(yes, kind, body), self.cast(no, kind, orelse)
                return _Code(f"{self.expression(test).within(4)} ? {yes.within(4)} : {no.within(4)}", kind, 3)
            case ast.Call():
                return self.call(node)
            case ast.Tuple(elts=elements):
                entries = [self.expression(one) for one in elements]
                kind = self.into.pair([one.kind for one in entries])
                return _Code(f"({kind}){{{', '.join(one.text for one in entries)}}}", kind)
            case _:
                raise self.refused(where or node, ast.unparse(node))

    def field_of(self, owner: _Code, name: str, node: ast.expr) -> _Code:
        """Translate a field of a structure."""
        kinds = {field_name: kind for kind, field_name in self.into.structs.get(owner.kind, ())}
        if _name(name) not in kinds:
            raise self.refused(node, ast.unparse(node))
        return _Code(f"{owner.within(_CALL)}.{_name(name)}", kinds[_name(name)])

    def found(self, node: ast.expr) -> Any:
        """Return what a name that is not of the function stands for."""
        if isinstance(node, ast.Name):
            if node.id in self.function.__globals__:
                return self.function.__globals__[node.id]
            raise self.refused(node, node.id)
        if isinstance(node, ast.Attribute):
            owner = self.found(node.value)
            if hasattr(owner, node.attr):
                return getattr(owner, node.attr)
        raise self.refused(node, ast.unparse(node))

    def constant(self, value: object, node: ast.expr) -> _Code:
        """Write a constant."""
        if isinstance(value, bool | int):
            return _Code(str(int(value)), INT)
        if isinstance(value, float):
            name = f"{self.function.__globals__['__name__']}.{node.id}" if isinstance(node, ast.Name) else ""
            written = number(value, self.into.singles.get(name))
            return _Code(written, REAL, _UNARY if value < 0.0 else _CALL)
        if isinstance(value, tuple) and value and all(isinstance(one, float | int) for one in value):
            entries = [self.constant(one, node) for one in value]
            kind = self.into.pair([one.kind for one in entries])
            return _Code(f"({kind}){{{', '.join(one.text for one in entries)}}}", kind)
        raise self.refused(node, ast.unparse(node))

    def subscript(self, value: ast.expr, index: ast.expr) -> _Code:
        """Translate a place of a row, of an array or of a constant."""
        if isinstance(value, ast.Call):
            whole, place = self.expression(value), self.expression(index)
            if whole.kind in self.into.structs and place.text.isdigit():
                kind, name = self.into.structs[whole.kind][int(place.text)]
                return _Code(f"{whole.text}.{name}", kind)
            raise self.refused(value, f"{ast.unparse(value)}[{ast.unparse(index)}]")
        root = value.value if isinstance(value, ast.Attribute) else value
        if not (isinstance(root, ast.Name) and root.id in self.kinds):
            constants, place = self.found(value), self.expression(index)
            if isinstance(constants, tuple) and place.text.isdigit():
                return self.constant(constants[int(place.text)], value)
            raise self.refused(value, f"{ast.unparse(value)}[{ast.unparse(index)}]")
        owner, place = self.expression(value), self.as_kind(index, INT)
        if owner.kind not in (ROW, POINTER):
            raise self.refused(value, f"{ast.unparse(value)}[{ast.unparse(index)}]")
        return _Code(f"{owner.text}{'.at' if owner.kind == ROW else ''}[{place.text}]", REAL)

    def binary(self, left: ast.expr, operator: ast.operator, right: ast.expr, where: ast.AST) -> _Code:
        """Translate an operation on two numbers."""
        first, second = self.expression(left), self.expression(right)
        if isinstance(operator, ast.Pow):
            return _Code(f"M(pow)({', '.join(self.cast(one, REAL, where).text for one in (first, second))})", REAL)
        if type(operator) not in _BINARY:
            raise self.refused(where, ast.unparse(ast.BinOp(left, operator, right)))
        sign, level = _BINARY[type(operator)]
        if REAL in (first.kind, second.kind) or sign == "/":
            first, second = self.cast(first, REAL, where), self.cast(second, REAL, where)
        return _Code(f"{first.within(level)} {sign} {second.within(level + 1)}", first.kind, level)

    def compared(self, node: ast.Compare) -> _Code:
        """Translate one comparison or a chain of them."""
        terms = [self.expression(one) for one in (node.left, *node.comparators)]
        if any(term.kind == REAL for term in terms):
            terms = [self.cast(term, REAL, node) for term in terms]
        parts = []
        for i, operator in enumerate(node.ops):
            if type(operator) not in _COMPARED or terms[i].kind not in (REAL, INT):
                raise self.refused(node, ast.unparse(node))
            parts.append(f"{terms[i].within(11)} {_COMPARED[type(operator)]} {terms[i + 1].within(11)}")
        return _Code(" && ".join(parts), INT, 9 if len(parts) == 1 else 5)

    def call(self, node: ast.Call) -> _Code:
        """Translate a call of a builtin, of `math`, of a named tuple or of another function of pzd."""
        name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
        if node.keywords or any(isinstance(one, ast.Starred) for one in node.args):
            raise self.refused(node, ast.unparse(node))
        if isinstance(node.func, ast.Name) and name in ("abs", "min", "max", "float"):
            return self.number_of(name, node)
        function = self.found(node.func)
        if isinstance(function, np.ufunc) or getattr(function, "__module__", "") in ("math", "numpy"):
            return self.number_of(name, node)
        if isinstance(function, type) and hasattr(function, "_fields"):
            kind = self.into.kind(function, self.function)
            fields = self.into.structs[kind]
            entries = (self.as_kind(one, of).text for one, (of, _) in zip(node.args, fields, strict=True))
            return _Code(f"({kind}){{{', '.join(entries)}}}", kind)
        if not callable(function):
            raise self.refused(node, ast.unparse(node))
        called = self.into.signature(function)
        pairs = zip(node.args, called.parameters, strict=True)
        given = ", ".join(self.as_kind(one, kind).text for one, kind in pairs if kind != _ABSENT)
        return _Code(f"{called.name}({given})", called.result)

    def number_of(self, name: str, node: ast.Call) -> _Code:
        """Translate a function of numbers."""
        given = [self.as_kind(one, REAL) for one in node.args]
        if name in _PLAIN:
            return given[0]
        if name in _LARGEST and len(given) >= 2:
            text = given[0].text
            for one in given[1:]:
                text = f"{_LARGEST[name]}({text}, {one.text})"
            return _Code(text, REAL)
        if name in _TESTS:
            return _Code(f"({_TESTS[name]}({given[0].text}) != 0)", INT)
        name = "fabs" if name == "abs" else name
        if name not in _MATHEMATICS:
            raise self.refused(node, ast.unparse(node))
        return _Code(f"M({_MATHEMATICS[name]})({', '.join(one.text for one in given)})", REAL)


def _zero(kind: str) -> str:
    return " = 0" if kind in (REAL, INT) else " = {0}" if kind != ROW else " = {{0}}"


def _names(node: ast.AST) -> set[str]:
    return {one.id for one in ast.walk(node) if isinstance(one, ast.Name)}


def _loaded(target: ast.expr) -> ast.expr:
    """Return a place as one that is read."""
    match target:
        case ast.Name(id=name):
            return ast.Name(name, ast.Load())
        case ast.Subscript(value=value, slice=index):
            return ast.Subscript(value, index, ast.Load())
        case _:
            return target
