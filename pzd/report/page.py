"""report.html: all sections in one file that asks nothing of the net and runs no script."""

from __future__ import annotations

from pzd.report.blocks import Card, Section
from pzd.report.context import ReportContext
from pzd.report.drawing import pictures
from pzd.report.headline import cards
from pzd.report.plots import library
from pzd.report.sections import characteristics, damper, expected, made, missing, model, passenger, tested, trust
from pzd.report.sections.pictures import Pictures

_PLACES = ("characteristics", "model", "missing", "damper", "passenger", "policies")


def page(context: ReportContext, jobs: int = 1) -> str:
    """The whole page as text.

    Parameters
    ----------
    context : the run
    jobs : pictures drawn at the same time

    Returns
    -------
    HTML, the same for the same sections
    """
    drawn = _drawn(context, jobs)
    sections = (
        tested.render(context),
        *characteristics.render(context, drawn),
        model.render(context, drawn),
        missing.render(context, drawn),
        damper.render(context, drawn),
        *([passenger.render(context, drawn)] if context.ridden else []),
        *expected.render(context),
        trust.render(context),
        made.render(context),
    )
    return render(_title(context), cards(context), context.assumed if context.ridden else (), sections)


def _drawn(context: ReportContext, jobs: int) -> Pictures:
    plots = list(library().values())
    drawn = list(zip(plots, pictures(plots, context, jobs), strict=True))
    return {place: tuple(of_plot for plot, of_plot in drawn if plot.place == place) for place in _PLACES}


def _title(context: ReportContext) -> str:
    kind = "Damper and comfort report" if context.ridden else "Damper report"
    return f"{kind}: {context.chosen}" if context.chosen else kind


_FOOTER = "Written by pzd. Every number of this page stands in the files of the run beside it, or follows from them."


def render(
    title: str,
    headline: tuple[Card, ...],
    assumed: tuple[str, ...],
    sections: tuple[Section, ...],
    footer: str = _FOOTER,
) -> str:
    """Fill the template; every text is escaped there."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("pzd.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template("report.html").render(
        title=title, cards=headline, assumed=assumed, sections=sections, footer=footer
    )
