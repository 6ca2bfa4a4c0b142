"""JSON: the same tables as arrays in one document, with the units of their columns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from pzd.export.content import Content


def files(content: Content) -> Files:
    """One document."""
    from pzd.export.content import tables
    from pzd.schema.validate import json_text

    document = {"origin": content.origin} | {
        name: {"units": dict(table.units), "columns": {key: list(cells) for key, cells in table.cells.items()}}
        for name, table in tables(content).items()
    }
    return {f"{content.name}.json": f"{json_text(document)}\n".encode()}


FORMAT = Format("json", "tables as arrays in one document", files)
