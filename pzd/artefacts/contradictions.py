"""What damper.yaml says otherwise than the files beside it, after an edit that cannot be meant so.

An edit to another value that a damper may have is taken: it is told without an interval.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from pzd.artefacts.diagnosis import Diagnosis, Value
from pzd.artefacts.identified import ParameterRow
from pzd.damper.model import PHYSICAL, Damper
from pzd.damper.nature import against_nature
from pzd.quantities import Control
from pzd.schema.errors import DataError
from pzd.schema.yamlfile import Document, read_yaml

OTHER_UNIT = 100.0
"""From this ratio on two values of one parameter are in different units; the least between two units is 1000."""

Acting = float | tuple[float, ...]


def contradictions(
    diagnosis: Diagnosis, dampers: tuple[Damper, Damper], rows: Sequence[ParameterRow], folder: Path, control: Control
) -> list[str]:
    """Every fault of a damper beside its diagnosis and its T0, C and k, each with its place.

    Parameters
    ----------
    diagnosis : of diagnosis.json
    dampers : of damper.yaml and of plain.yaml; the law that identify fits may bring effects of its own
    rows : of parameters.csv
    folder : where the three stand
    control : the control signal, which names the voltage in messages
    """
    damper, plain = dampers
    if {*diagnosis.effects, *plain.effects} != set(damper.effects):
        return _effects_apart(diagnosis, damper, plain, folder)
    document = read_yaml(folder / "damper.yaml", DataError)
    return [*_base_apart(damper, rows, document, control), *_values_apart(diagnosis, damper, plain, document)]


def _effects_apart(diagnosis: Diagnosis, damper: Damper, plain: Damper, folder: Path) -> list[str]:
    """Effects that damper.yaml has and neither diagnosis.json nor plain.yaml, or the other way round."""
    told, acting = diagnosis.effects, damper.effects
    names = ("damper.yaml", "diagnosis.json", "plain.yaml")
    of_damper, of_diagnosis, of_plain = (read_yaml(folder / name, DataError) for name in names)
    return (
        [
            f"{of_damper.place(('effects', name))}: effects.{name}: diagnosis.json does not have it among its effects; "
            "add it there too, or take it out here"
            for name in acting
            if name not in {*told, *plain.effects}
        ]
        + [
            f"{of_diagnosis.place(('effects', str(number)))}: effects.{number}: damper.yaml has no {name}; "
            "add it there too, or take it out here"
            for number, name in enumerate(told)
            if name not in acting
        ]
        + [
            f"{of_plain.place(('effects', name))}: effects.{name}: damper.yaml has no {name}; "
            "add it there too, or take it out here"
            for name in plain.effects
            if name not in acting
        ]
    )


def _base_apart(damper: Damper, rows: Sequence[ParameterRow], document: Document, control: Control) -> Iterator[str]:
    """Values of T0, C and k that parameters.csv has in another unit."""
    by_condition = {(row.voltage_V, row.temperature_degC): row for row in rows}
    for number, base in enumerate(damper.base):
        row = by_condition.get((base.voltage_V, base.temperature_degC))
        for name in PHYSICAL if row else ():
            here, there = float(getattr(base, name)), getattr(row, name)
            if there is not None and _other_unit(here, there):
                yield (
                    f"{document.place(('base', str(number), name))}: base.{number}.{control.renamed(name)}: "
                    f"parameters.csv has {there:g} there; is it in another unit? change both if it is meant "
                    f"(got {here:g})"
                )


def _values_apart(diagnosis: Diagnosis, damper: Damper, plain: Damper, document: Document) -> Iterator[str]:
    """Values of effects that diagnosis.json has in another unit or with another sign, or that none has in nature."""
    impossible = against_nature(damper)
    for name, values in damper.effects.items():
        diagnosed = diagnosis.parameters.get(name, {})
        acting = {key: value for key, value in values.items() if key != "at_voltage_V"}
        if values == plain.effects.get(name):
            continue
        edited = {key: value for key, value in acting.items() if key not in diagnosed or diagnosed[key].value != value}
        if name in impossible and edited:
            got = ", ".join(f"{key} = {_shown(value)}" for key, value in acting.items())
            yield (
                f"{document.place(('effects', name))}: effects.{name}: no {name} has such values in nature; "
                f"take the edit back (got {got})"
            )
            continue
        for key, value in edited.items():
            if key in diagnosed and (fault := _apart(value, diagnosed[key])):
                yield (
                    f"{document.place(('effects', name, key))}: effects.{name}.{key}: diagnosis.json has "
                    f"{_shown(diagnosed[key].value)} {diagnosed[key].unit} there; {fault}; change both if it is meant "
                    f"(got {_shown(value)})"
                )


def _apart(acting: Acting, diagnosed: Value) -> str | None:
    """What is wrong with a value beside the one that was diagnosed, place by place of a list; None where nothing is."""
    here, there = _listed(acting), _listed(diagnosed.value)
    if len(here) != len(there):
        return None
    pairs = list(zip(here, there, strict=True))
    if any(_other_unit(abs(a), abs(b)) for a, b in pairs):
        return "is it in another unit?"
    lows, highs = _listed(diagnosed.low95), _listed(diagnosed.high95)
    if any(a * b < 0.0 and low * high > 0.0 for (a, b), low, high in zip(pairs, lows, highs, strict=False)):
        return "its interval holds no value of this sign"
    return None


def _other_unit(here: float, there: float) -> bool:
    """Whether two values are so far apart; zero is the same in every unit."""
    return 0.0 < min(here, there) * OTHER_UNIT < max(here, there)


def _listed(value: Acting | None) -> tuple[float, ...]:
    return () if value is None else value if isinstance(value, tuple) else (value,)


def _shown(value: Acting) -> str:
    return ", ".join(f"{each:g}" for each in _listed(value))
