"""index.html: all twenty figures with what each is made from, relative links, no script."""

from __future__ import annotations

from collections.abc import Sequence

from pzd.paper.figures.entry import FigureEntry


def page(entries: Sequence[FigureEntry]) -> str:
    """Fill the template; every text is escaped there."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("pzd.paper.figures", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template("index.html").render(entries=entries)
