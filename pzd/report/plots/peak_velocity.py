"""The peak-velocity plot (PVP): force at the peak speed of every test, rebound above and compression below."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

from pzd.artefacts import PeakVelocityRow
from pzd.report.context import ReportContext, characteristics_of, coloured, place_of
from pzd.report.drawing import Panel, Plot, axes, legend, shades

_MARKERS = {"sine": "o", "constant velocity": "s", "other swing": "D"}
_PLURALS = {
    "sine": "circles: sines",
    "constant velocity": "squares: constant velocity",
    "other swing": "diamonds: other",
}


def draw(context: ReportContext) -> Iterator[Panel]:
    """One colour a voltage, or a setting where there is no control signal; lines join the tests of a condition."""
    rows = characteristics_of(context).peak_velocity
    if not rows:
        return
    groups = coloured(context, rows)
    named = any(groups)
    figure, ax = axes(key=(len(groups) + 3) // 4 if named else 0)
    for (label, mine), colour in zip(groups.items(), shades(len(groups)), strict=True):
        ax.plot([], [], color=colour, label=label or None)
        for _, condition in groupby(sorted(mine, key=lambda r: (str(place_of(r)), r.speed)), key=place_of):
            tests = list(condition)
            for points in (_points(tests, "rebound"), _points(tests, "compression")):
                ax.plot([v for v, _, _ in points], [f for _, f, _ in points], color=colour, linewidth=1.0)
                for v, f, kind in points:
                    ax.plot(v, f, _MARKERS[kind], color=colour, markersize=4.0)
    ax.axhline(0.0, color="#9aa5b1", linewidth=0.8)
    ax.set_xlim(left=0.0)
    ax.set_xlabel("peak speed [m/s]")
    ax.set_ylabel("force [kN]")
    if named:
        legend(figure, 4)
    by = f", one colour each for {', '.join(groups)}" if named else ""
    marks = "; ".join(text for kind, text in _PLURALS.items() if any(row.kind == kind for row in rows))
    yield Panel(
        figure,
        "Peak-velocity plot (PVP)",
        f"Force over peak speed of {len(rows)} tests, rebound above zero and compression below{by}.",
        f"Rebound (extension) above, compression below; {marks}.",
    )


def _points(tests: Sequence[PeakVelocityRow], way: str) -> list[tuple[float, float, str]]:
    """Speed [m/s], force [kN] and kind of the tests that have this direction."""
    cells = [(getattr(r, f"{way}_velocity_m_per_s"), getattr(r, f"{way}_force_N"), r.kind) for r in tests]
    return [(abs(v), force / 1000.0, kind) for v, force, kind in cells if v is not None and force is not None]


PLOT = Plot("peak_velocity", "characteristics", 0, draw)
