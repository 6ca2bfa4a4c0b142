"""Expected numbers of a file (`report.reference`) beside those that a run computes.

`report.reference: FILE.csv` names a file with one expected number a row. Its columns stand in any order:

    id          of its own
    value       the expected number; a text such as `200-250` is repeated and has no ratio
    unit        of the value: that of the run's number, or one that it can be converted to (`ms`, `kN`, `um`)
    selector    which number of the run is meant (below); empty where the run has none
    setting, voltage_V, temperature_degC, frequency_Hz, amplitude_m, record     which test
    road (or frequency_Hz and amplitude_m), policy, fidelity, case              which ride
    tolerance   largest difference as a share of the value
    kind, figure_or_table, quantity, note     for the reader

The first three are needed, the others may be left out. A selector is a name of `pzd.report.run_numbers.UNITS` or
arithmetic between other rows, in their units:

    id,setting,voltage_V,frequency_Hz,amplitude_m,selector,value,unit,tolerance
    peak,soft,0,2,0.03,measures.peak_force_N,1514,N,0.05
    peak-on,soft,150,2,0.03,measures.peak_force_N,2940,N,0.05
    rise,,,,,100 * ([peak-on] / [peak] - 1),94,percent,0.1

`pzd.artefacts.rig` says when two tests are the same. A number of its own as selector (`59.7`) stands for what the run
cannot compute; reference.csv says so.
"""

from __future__ import annotations

import ast
import logging
import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

import pzd
from pzd.artefacts import ReferenceRow
from pzd.artefacts.rig import Conditions, same_motion
from pzd.quantities import Control, Quantity
from pzd.record import CONSTANT_SHARE, SAME_TEMPERATURE
from pzd.report.run_numbers import PURE, UNITS, Computed, RunNumbers, Selection, computed_number
from pzd.schema.csvfile import read_table
from pzd.schema.errors import ConfigError, DataError, at
from pzd.schema.model import Frozen, nearest

# --- Arithmetic between rows: `100 * ([b] / [a] - 1)` ---

_TERM = re.compile(r"\[([^\[\]]+)\]")
_OPERATORS: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


def terms(text: str) -> tuple[str, ...]:
    """Return the ids between brackets, each once, in the order of the text.

    >>> terms("100 * ([b] / [a] - 1)")
    ('b', 'a')
    """
    return tuple(dict.fromkeys(_TERM.findall(text)))


def parsed(text: str) -> ast.expr:
    """Parse an expression; each id becomes a name in the tree, numbered by its place in `terms`.

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
    """Evaluate an expression.

    Parameters
    ----------
    text : + - * / and parentheses between numbers and `[id]`
    numbers : the value of each id

    >>> evaluated("100 * ([b] / [a] - 1)", {"a": 2.0, "b": 3.0})
    50.0

    Raises
    ------
    ValueError : when it is no such expression
    ZeroDivisionError : when a divisor is 0
    """
    return _value(parsed(text), {f"term{number}": numbers[name] for number, name in enumerate(terms(text))})


def _is_arithmetic(node: ast.expr, places: set[int]) -> bool:
    if isinstance(node, ast.BinOp):
        return type(node.op) in _OPERATORS and _is_arithmetic(node.left, places) and _is_arithmetic(node.right, places)
    if isinstance(node, ast.UnaryOp):
        return isinstance(node.op, ast.USub) and _is_arithmetic(node.operand, places)
    if isinstance(node, ast.Name):
        return node.id in {f"term{place}" for place in places}
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def _value(node: ast.expr, numbers: Mapping[str, float]) -> float:
    if isinstance(node, ast.BinOp):
        return _OPERATORS[type(node.op)](_value(node.left, numbers), _value(node.right, numbers))
    if isinstance(node, ast.UnaryOp):
        return -_value(node.operand, numbers)
    return numbers[node.id] if isinstance(node, ast.Name) else float(ast.literal_eval(node))


# --- The file ---

SHIPPED = {"makowski2021": Path(pzd.__file__).parent / "paper" / "published.csv"}
"""Lists of expected numbers that come with the package, by name."""
_NAME = re.compile(r"[A-Za-z_]+\.[^\[\]\s]+")
"""A selector that looks like a name of `UNITS`."""


class Expected(Frozen):
    """One expected number, with the number of a run that it belongs to."""

    id: str = Field(min_length=1)
    kind: str = ""
    """For the reader: `measured`, `identified`, `claim` or the like."""
    figure_or_table: str = ""
    """For the reader: where it is printed."""
    setting: str | None = None
    voltage_V: float | None = None
    temperature_degC: float | None = None
    frequency_Hz: float | None = None
    amplitude_m: float | None = None
    record: str | None = None
    case: str | None = None
    road: str | None = None
    policy: str | None = None
    fidelity: str | None = None
    quantity: str = ""
    """For the reader: what it is, in words."""
    selector: str = ""
    value: float | str
    """A number, or a range as text."""
    unit: str
    tolerance: float | None = Field(default=None, ge=0.0)
    """Largest difference as a share of the value."""
    note: str = ""

    @field_validator("selector")
    @classmethod
    def _is_name_or_arithmetic(cls, selector: str) -> str:
        if _NAME.fullmatch(selector) and selector not in UNITS:
            near = nearest(selector, UNITS)
            hint = f"did you mean {near}?" if near else f"there is {', '.join(UNITS)}"
            raise ValueError(f"no number of a run is called so; {hint}")
        if selector and selector not in UNITS:
            parsed(selector)
        return selector

    @field_validator("unit")
    @classmethod
    def _fits_selector(cls, unit: str, info: ValidationInfo) -> str:
        selector = info.data.get("selector", "")
        if selector in UNITS:
            _factor(selector, unit)
        return unit

    @property
    def number(self) -> float:
        """The value of a row that holds a single number.

        Raises
        ------
        ValueError : when it is a range
        """
        if isinstance(self.value, str):
            raise ValueError(f"{self.id} is no single number (got {self.value})")  # noqa: TRY004  # the id is wrong, no type is
        return self.value

    @property
    def conditions(self) -> Conditions:
        """Conditions of the test that it belongs to."""
        return Conditions(self.setting, self.voltage_V, self.temperature_degC, self.frequency_Hz, self.amplitude_m)

    @property
    def selection(self) -> Selection:
        """Row of the run that it belongs to."""
        return Selection(self.conditions, self.record, self.case, self.road, self.policy, self.fidelity)


def _factor(selector: str, unit: str) -> float:
    """Return how many of the run's units one of `unit` is.

    Raises
    ------
    ValueError : when it measures something else
    """
    own = UNITS[selector]
    if unit == own:
        return 1.0
    if own == PURE:
        raise ValueError(f"{selector} is a pure number; write {PURE}")
    from pzd.rig.files.units import to_canonical

    return float(to_canonical(np.ones(1), unit, Quantity(selector, "", own, ""))[0])


def same_test(a: Expected, b: Expected) -> bool:
    """Tell whether two numbers belong to one quantity of one test: their conditions differ by less than a match may.

    Voltages count as the same within the share of the larger that `pzd.record` gives a condition.
    """
    voltages = a.voltage_V or 0.0, b.voltage_V or 0.0
    temperatures = a.temperature_degC or 0.0, b.temperature_degC or 0.0
    return (
        (a.selector, a.setting, a.record) == (b.selector, b.setting, b.record)
        and abs(voltages[0] - voltages[1]) <= CONSTANT_SHARE * max(map(abs, voltages))
        and abs(temperatures[0] - temperatures[1]) <= SAME_TEMPERATURE
        and same_motion(a.frequency_Hz or 0.0, b.frequency_Hz or 0.0)
        and same_motion(a.amplitude_m or 0.0, b.amplitude_m or 0.0)
    )


def range_of(row: Expected, expected: Iterable[Expected]) -> tuple[float, float]:
    """Return the smallest and the largest number expected of the test of a row."""
    values = [other.value for other in (row, *expected) if same_test(row, other)]
    numbers = [value for value in values if not isinstance(value, str)]
    return (min(numbers), max(numbers)) if numbers else (0.0, 0.0)


def path_of(reference: str, folder: Path) -> Path:
    """Return where the file that `report.reference` names should stand."""
    return SHIPPED.get(reference, folder / reference)


def file_of(reference: str, folder: Path) -> Path:
    """Return the file that `report.reference` names.

    Parameters
    ----------
    reference : a path, or a name of `SHIPPED`
    folder : from which a path counts

    Raises
    ------
    ConfigError : when there is no such file
    """
    path = path_of(reference, folder)
    if not path.is_file():
        near = nearest(reference, SHIPPED)
        hint = f"did you mean {near}?" if near else f"a path counts from {folder}, and {', '.join(SHIPPED)} is a name"
        raise ConfigError(f"report.reference: there is no such file; {hint} (got {reference})")
    return path


def read_reference(path: Path, control: Control) -> tuple[Expected, ...]:
    """Read the expected numbers of a file.

    Raises
    ------
    DataError : when its header or a row is wrong, with every place
    """
    rows = read_table(path, Expected, control, {"temperature_C": "temperature_degC"})
    faults = [f"{at(path, line)}: {fault}" for line, fault in _faults(rows)]
    if faults:
        raise DataError(faults)
    return tuple(row for _, row in rows)


def _faults(rows: Sequence[tuple[int, Expected]]) -> Iterator[tuple[int, str]]:
    """Yield what is wrong between rows, each with its line."""
    by_id: dict[str, Expected] = {}
    for line, row in rows:
        if row.id in by_id:
            yield line, f"id: occurs twice (got {row.id})"
        by_id[row.id] = row
    for line, row in rows:
        for term in terms(row.selector):
            if term not in by_id:
                near = nearest(term, by_id)
                yield line, f"selector: no row has the id{f'; did you mean {near}?' if near else ''} (got {term})"
            elif by_id[term].selector not in UNITS:
                yield line, f"selector: the row must name a number of the run itself (got {term})"


# --- Comparison ---


def compared(expected: Sequence[Expected], run: RunNumbers) -> tuple[ReferenceRow, ...]:
    """Set every expected number beside that of the run, in the order of its file.

    Parameters
    ----------
    expected : the numbers
    run : the artefacts of the run
    """
    units = {row.id: row.unit for row in expected}
    direct = {row.id: _direct(row, run) for row in expected if row.selector in UNITS}
    rows = []
    for row in expected:
        found = direct[row.id] if row.id in direct else _derived(row, direct, units)
        rows.append(_reference_row(row, found, _range_note(row, expected)))
    computed = sum(row.computed is not None for row in rows)
    logging.getLogger(__name__).info("%d of %d expected numbers are computed", computed, len(rows))
    return tuple(rows)


def _direct(row: Expected, run: RunNumbers) -> Computed:
    """Return a number of the run in the unit in which it is expected."""
    found = computed_number(run, row.selector, row.selection)
    value = None if found.value is None else found.value / _factor(row.selector, row.unit)
    return Computed(value, found.note)


def _derived(row: Expected, direct: Mapping[str, Computed], units: Mapping[str, str]) -> Computed:
    """Return what arithmetic between other rows gives."""
    names = terms(row.selector)
    if not row.selector:
        return Computed(None, "no selector: the run computes no such number")
    if not names:
        return Computed(evaluated(row.selector, {}), "a number of the reference file itself, not computed by the run")
    lacking = [f"{name}: {direct[name].note}" for name in names if direct[name].value is None]
    if lacking:
        return Computed(None, "; ".join(lacking))
    numbers = {name: direct[name].value or 0.0 for name in names}
    formula = f"{row.selector} of {', '.join(f'{name} {value:.5g} {units[name]}' for name, value in numbers.items())}"
    try:
        return Computed(evaluated(row.selector, numbers), formula)
    except ZeroDivisionError:
        return Computed(None, f"{formula} divides by 0")


def _range_note(row: Expected, expected: Iterable[Expected]) -> str:
    """Return the range of what is expected of the same test, where the file has several numbers for it."""
    low, high = range_of(row, expected) if row.selector.startswith("measures.") else (0.0, 0.0)
    return f"{low:g} to {high:g} {row.unit} are expected of this test" if low < high else ""


def _reference_row(row: Expected, found: Computed, range_note: str) -> ReferenceRow:
    comparable = found.value is not None and not isinstance(row.value, str) and row.value != 0.0
    ratio = found.value / row.number if found.value is not None and comparable else None
    within = ""
    if row.tolerance is not None and ratio is not None:
        inside = abs(ratio - 1.0) <= row.tolerance
        within = (
            f"{'within' if inside else 'NOT within'} the tolerance of {row.tolerance:.3g}: off by {ratio - 1.0:+.3g}"
        )
    parts = (found.note, range_note, within, f"reference: {row.note}" if row.note else "")
    return ReferenceRow(
        id=row.id,
        kind=row.kind,
        expected=row.value,
        computed=found.value,
        unit=row.unit,
        ratio=ratio,
        note="; ".join(part for part in parts if part),
    )
