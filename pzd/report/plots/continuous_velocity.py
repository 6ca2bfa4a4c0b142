"""The continuous-velocity plot (CVP): force over speed through the settled cycle of one test, both directions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pzd.artefacts import ContinuousVelocityRow
from pzd.report.blocks import amount, number
from pzd.report.context import ReportContext, characteristics_of, coloured, place_of
from pzd.report.drawing import Panel, Plot, axes, legend, shades


def draw(context: ReportContext) -> Iterator[Panel]:
    """The fastest test of each voltage, or of each setting where there is no control signal."""
    groups = coloured(context, characteristics_of(context).continuous_velocity)
    if not groups:
        return
    named = any(groups)
    figure, ax = axes(key=(len(groups) + 3) // 4 if named else 0)
    shown = [fastest(rows) for rows in groups.values()]
    for label, rows, colour in zip(groups, shown, shades(len(groups)), strict=True):
        closed = [*rows, rows[0]]
        speeds, forces = [r.velocity_m_per_s for r in closed], [r.force_N / 1000.0 for r in closed]
        ax.plot(speeds, forces, color=colour, linewidth=1.2, label=label or None)
    ax.locator_params(axis="x", nbins=6)
    ax.set_xlabel("velocity [m/s]")
    ax.set_ylabel("force [kN]")
    if named:
        legend(figure, 4)
    tests = sorted({f"{amount(r[0].frequency_Hz, 'Hz')}, {number(1000.0 * r[0].amplitude_m)} mm" for r in shown})
    each = f"one test each for {', '.join(groups)}" if named else f"test {shown[0][0].record}"
    listed = f" ({tests[0]})" if len(tests) == 1 else ""
    yield Panel(
        figure,
        "Continuous-velocity plot (CVP)",
        f"Loops of force over velocity through one average settled cycle, {each}.",
        f"The fastest test of each{listed}; rebound to the right." if named else f"Its fastest test{listed}.",
    )


def fastest(rows: Sequence[ContinuousVelocityRow]) -> list[ContinuousVelocityRow]:
    """The cycle of the test with the largest speed, in its order."""
    top = max(rows, key=lambda row: abs(row.velocity_m_per_s))
    same = (place_of(top), top.record, top.frequency_Hz, top.amplitude_m)
    return [row for row in rows if (place_of(row), row.record, row.frequency_Hz, row.amplitude_m) == same]


PLOT = Plot("continuous_velocity", "characteristics", 1, draw)
