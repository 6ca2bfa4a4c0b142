"""How it was made: the stages, the methods, the sources."""

from __future__ import annotations

from pzd.comfort import directive, iso2631_1978, iso2631_1997
from pzd.report.blocks import Notes, Paragraph, Section
from pzd.report.context import ReportContext

_RIDE = "simulate: the half-car of the paper, equations (5) to (12), with an energy balance (5-simulate)"
_STAGES = (
    "rig: records in SI units, checked, never corrected unasked (1-rig)",
    "identify: T0, C and k of every condition by the global optimum of the paper's criterion (4) (2-identify)",
    "diagnose: where the gap lies and which effect of the library closes it, judged on held-out data (3-diagnose)",
)
_SOURCES = {
    iso2631_1997.EDITION: "weighting Wk by its exact frequency response over the whole ride from rest, so that neither "
    "sampling nor the start bends it; measures and conditions verified against independent sources",
    iso2631_1978.EDITION: "boundaries a_z interpolated log-log; a tone at its own frequency, a periodic ride harmonic "
    f"by harmonic, any other by third-octave bands, the shortest time counting; {iso2631_1978.TRUST}",
    directive.EDITION: "A(8) and the daily dose from the vertical direction alone; values verified",
}
_LINE = "One straight line of stages; each writes the files that the next one reads, in the folders beside this page's:"
_SIGNS = (
    "Extension (rebound) is positive for displacement, velocity and force; force times velocity above zero "
    "dissipates. The same input and seed give the same bytes; versions and times stand in each manifest.json."
)


def render(context: ReportContext) -> Section:
    """The last section."""
    axes = (
        "temperature, control signal and velocity, and its inverse"
        if context.controlled
        else "temperature and velocity"
    )
    stages = (
        *_STAGES,
        f"table: force over {axes} (4-table)",
        *([_RIDE] if context.ridden else []),
        f"report: this page{' and comfort.csv' if context.ridden else ''} (6-report)",
    )
    sources = tuple(f"{edition}: {_SOURCES[edition]}" for edition in context.config.editions)
    standards = (Paragraph("Standards:"), Notes(sources)) if context.ridden else ()
    return Section("made", "How it was made", (Paragraph(_LINE), Notes(stages), *standards, Paragraph(_SIGNS)))
