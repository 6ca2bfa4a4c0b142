"""The tables of `pzd.export.content` as they are: CSV, JSON, and Parquet.

CSV has a file for each table, behind a line with its origin. JSON has all of them as arrays in one document, with the
units of their columns. Parquet has a file for each, typed; the unit of a column is its metadata `unit`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from pzd.export.content import Content


def csv_files(content: Content) -> Files:
    """Write a file a table; its first line is a comment."""
    import csv
    import io

    from pzd.export.content import comment, tables
    from pzd.schema.csvfile import disarmed

    found = {}
    for name, table in tables(content).items():
        text = io.StringIO()
        text.write(comment([f"{content.origin}: {name}"], "#"))
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(table.cells)
        writer.writerows(
            ["" if cell is None else disarmed(cell) for cell in row] for row in zip(*table.cells.values(), strict=True)
        )
        found[f"{content.name}-{name}.csv"] = text.getvalue().encode()
    return found


def json_file(content: Content) -> Files:
    """Write one document."""
    from pzd.export.content import tables
    from pzd.schema.validate import json_text

    document = {"origin": content.origin} | {
        name: {"units": dict(table.units), "columns": {key: list(cells) for key, cells in table.cells.items()}}
        for name, table in tables(content).items()
    }
    return {f"{content.name}.json": f"{json_text(document)}\n".encode()}


def parquet_files(content: Content) -> Files:
    """Write a file a table."""
    from io import BytesIO

    import pyarrow as pa
    from pyarrow import parquet

    from pzd.export.content import tables

    found = {}
    for name, table in tables(content).items():
        fields, columns = [], []
        for key, cells in table.cells.items():
            kind = pa.string() if any(isinstance(cell, str) for cell in cells) else pa.float64()
            columns.append(pa.array(cells, kind))
            fields.append(pa.field(key, kind, metadata={"unit": table.units[key]} if key in table.units else None))
        written = BytesIO()
        schema = pa.schema(fields, metadata={"origin": content.origin})
        parquet.write_table(pa.table(columns, schema=schema), written)
        found[f"{content.name}-{name}.parquet"] = written.getvalue()
    return found


FORMATS = (
    Format("csv", "tables as delimited text", csv_files, ending=".csv"),
    Format("json", "tables as arrays in one document", json_file),
    Format("parquet", "tables as typed columns", parquet_files, needs="pyarrow", ending=".parquet"),
)
