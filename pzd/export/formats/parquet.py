"""Parquet: the same tables, typed; the unit of a column is its metadata `unit`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from pzd.export.content import Content


def files(content: Content) -> Files:
    """A file a table."""
    from io import BytesIO

    import pyarrow as pa
    from pyarrow import parquet

    from pzd.export.content import tables

    found = {}
    for name, table in tables(content).items():
        columns = {
            key: pa.array(cells, pa.string() if any(isinstance(cell, str) for cell in cells) else pa.float64())
            for key, cells in table.cells.items()
        }
        fields = [pa.field(key, column.type, metadata=_unit(table.units.get(key))) for key, column in columns.items()]
        written = BytesIO()
        schema = pa.schema(fields, metadata={"origin": content.origin})
        parquet.write_table(pa.table(list(columns.values()), schema=schema), written)
        found[f"{content.name}-{name}.parquet"] = written.getvalue()
    return found


def _unit(unit: str | None) -> dict[str, str] | None:
    return {"unit": unit} if unit else None


FORMAT = Format("parquet", "tables as typed columns", files, needs="pyarrow", ending=".parquet")
