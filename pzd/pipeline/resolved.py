"""Every value of a config as a run takes it, with where it comes from: a line of the file, `--set`, or the default."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pzd.pipeline.command import Opened
from pzd.schema.control import canonical_nodes
from pzd.schema.nodes import Node

DEFAULT = "default"
"""The origin of what neither the config nor the command line says."""


@dataclass(frozen=True)
class Resolved:
    """One value of a config."""

    path: str
    """Keys and indices, as `--set` takes them."""
    value: Any
    """A scalar, or an empty list or mapping."""
    origin: str
    """``file:line:column``, ``--set a.b``, or `default`."""


def resolved(given: Opened) -> tuple[Resolved, ...]:
    """The values of a config in the order of the reference, the control under its own name.

    Parameters
    ----------
    given : the config as a command was given it
    """
    control = given.run.control
    root = canonical_nodes(given.document.root, control)
    return tuple(
        Resolved(".".join(control.renamed(part) for part in path), value, _origin(root, path))
        for path, value in _leaves(given.config.model_dump(mode="json"), ())
    )


def _leaves(data: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    below = data.items() if isinstance(data, Mapping) else enumerate(data) if isinstance(data, list | tuple) else ()
    if not below:
        yield path, data
    for key, value in below:
        yield from _leaves(value, (*path, str(key)))


def _origin(root: Node, path: tuple[str, ...]) -> str:
    """Where a value stands in a tree with canonical keys."""
    node = root
    for part in path:
        if isinstance(node.value, Mapping) and part in node.value:
            node = node.value[part].node
        elif isinstance(node.value, tuple) and part.isdecimal() and int(part) < len(node.value):
            node = node.value[int(part)]
        else:
            return DEFAULT
    return node.place
