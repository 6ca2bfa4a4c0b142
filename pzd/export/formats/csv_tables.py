"""CSV: a file for each table of `pzd.export.content`, behind a line that says where it is from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from pzd.export.content import Content


def files(content: Content) -> Files:
    """A file a table; its first line is a comment."""
    import csv
    import io

    from pzd.export.content import comment, tables

    found = {}
    for name, table in tables(content).items():
        text = io.StringIO()
        text.write(comment([f"{content.origin}: {name}"], "#"))
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(table.cells)
        writer.writerows(
            ["" if cell is None else cell for cell in row] for row in zip(*table.cells.values(), strict=True)
        )
        found[f"{content.name}-{name}.csv"] = text.getvalue().encode()
    return found


FORMAT = Format("csv", "tables as delimited text", files, ending=".csv")
