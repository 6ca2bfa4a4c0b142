"""The names of the control signal in files: `voltage_V` to the code, `current_A` where the config says so."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from pzd.quantities import VOLTAGE, Control
from pzd.schema.nodes import Entry, Node, collection


def canonical(name: str, control: Control) -> str:
    """The canonical name of a column or key that a file calls by the control: current_1_A -> voltage_1_V."""
    if control == Control():
        return name
    unit = control.quantity.column.removeprefix(control.name)
    candidate = re.sub(rf"(?<![A-Za-z]){re.escape(control.name)}", VOLTAGE.name, name)
    if unit and candidate.endswith(unit):
        candidate = f"{candidate.removesuffix(unit)}_{VOLTAGE.unit}"
    return candidate if control.renamed(candidate) == name else name


def renamed_keys(data: Any, control: Control) -> Any:
    """Plain data with every canonical key under the control's name."""
    if isinstance(data, Mapping):
        return {control.renamed(key): renamed_keys(value, control) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [renamed_keys(value, control) for value in data]
    return data


def canonical_nodes(root: Node, control: Control) -> Node:
    """The tree with every key of the control under its canonical name."""
    if control == Control() or not isinstance(root.value, Mapping | tuple):
        return root
    if isinstance(root.value, tuple):
        return collection(tuple(canonical_nodes(item, control) for item in root.value), root.place)
    entries: dict[str, Entry] = {}
    for key, entry in root.value.items():
        name = canonical(key, control)
        name = key if name in root.value else name  # both names stand here: the model refuses one of them
        entries[name] = Entry(entry.place, canonical_nodes(entry.node, control))
    return collection(entries, root.place)


def misnamed(root: Node, control: Control) -> list[str]:
    """Every key that carries the canonical name although the control is called otherwise, with its place."""
    faults: list[str] = []
    if isinstance(root.value, tuple):
        for item in root.value:
            faults += misnamed(item, control)
    elif isinstance(root.value, Mapping):
        for key, entry in root.value.items():
            if control.renamed(key) != key:
                faults.append(f"{entry.place}: {key}: must be called {control.renamed(key)} here (got {key})")
            faults += misnamed(entry.node, control)
    return faults
