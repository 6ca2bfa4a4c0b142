"""What is left of the force over planes in which its causes part: place and speed, speed and force, force and rate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pzd.quantities import DISPLACEMENT, FORCE, VELOCITY
from pzd.record import Array, Record
from pzd.report.context import ReportContext
from pzd.report.drawing import Panel, Plot
from pzd.report.gaps import at_some_voltages, begun

_CLASSES = 28
"""Classes of either quantity of a plane."""
_FEWEST = 3
"""A cell with fewer samples stays empty."""
_CENTRED = "RdBu_r"
"""White where nothing is left; red where more force was measured."""

_PLANES = (
    ("x", "v", f"{DISPLACEMENT.name} and {VELOCITY.name}"),
    ("v", "F", f"{VELOCITY.name} and {FORCE.name}"),
    ("F", "dF/dt", f"{FORCE.name} and its rate"),
)
_UNITS = {"x": "mm", "v": "m/s", "F": "kN", "dF/dt": "kN/s"}


def draw(context: ReportContext) -> Iterator[Panel]:
    """A picture a plane, a column a voltage, before above and after below; under the verdict `unexplained` alone."""
    if context.diagnosed.diagnosis.verdict != "unexplained" or not context.records:
        return
    groups = at_some_voltages(context)
    which = (0, 1) if context.extended else (0,)
    for first, second, words in _PLANES:
        yield _panel(context, groups, which, (first, second), words)


def _panel(
    context: ReportContext,
    groups: dict[str, list[Record]],
    which: Sequence[int],
    plane: tuple[str, str],
    words: str,
) -> Panel:
    from matplotlib.figure import Figure

    maps = {(i, name): _left(context, records, i, plane) for i in which for name, records in groups.items()}
    top = max(float(np.nanmax(np.abs(mean))) for mean, _ in maps.values()) or 1.0
    figure: Figure = Figure(figsize=(4.5, 1.0 + 1.5 * len(which)))
    plots = figure.subplots(len(which), len(groups), sharex="col", sharey="col", squeeze=False)
    image = None
    for row, i in zip(plots, which, strict=True):
        for ax, name in zip(row, groups, strict=True):
            mean, extent = maps[i, name]
            cells = {"extent": extent, "origin": "lower", "aspect": "auto", "interpolation": "none"}
            image = ax.imshow(mean.T, _CENTRED, vmin=-top, vmax=top, **cells)
            ax.grid(visible=False)
            ax.tick_params(labelsize=7)
            ax.locator_params(nbins=3)
            if i == which[0]:
                ax.set_title(name, fontsize=9)
        row[0].set_ylabel(f"{plane[1]} [{_UNITS[plane[1]]}]", fontsize=8)
    for ax in plots[-1]:
        ax.set_xlabel(f"{plane[0]} [{_UNITS[plane[0]]}]", fontsize=8)
    figure.subplots_adjust(left=0.14, right=0.8, top=0.9, bottom=0.16, wspace=0.55, hspace=0.25)
    if image is not None:
        figure.colorbar(image, cax=figure.add_axes((0.83, 0.2, 0.02, 0.65)), label="what is left [N]")
    rows = f"above the {context.model}, below with what was added" if len(which) > 1 else f"the {context.model}"
    at = f" at {', '.join(groups)}" if context.controlled else ""
    alt = f"Mean of measured minus simulated force over {words}{at}, {rows}; the largest is {top:.3g} N."
    return Panel(figure, f"What is left over {words}", alt, f"Mean of the samples of a cell; {rows}.")


def _left(
    context: ReportContext, records: Sequence[Record], which: int, plane: tuple[str, str]
) -> tuple[Array, tuple[float, float, float, float]]:
    """(n, n) mean of what is left in the cells of a plane [N], NaN where there is too little; and the plane's edges."""
    columns = [_signals(context, record, which) for record in records]
    left, x, y = (np.concatenate([of[name] for of in columns]) for name in ("left", *plane))
    edges = [np.linspace(c.min(), c.max(), _CLASSES + 1) for c in (x, y)]
    count = np.histogram2d(x, y, edges)[0]
    total = np.histogram2d(x, y, edges, weights=left)[0]
    mean = np.where(count >= _FEWEST, total / np.maximum(count, 1.0), np.nan)
    return mean, (float(x.min()), float(x.max()), float(y.min()), float(y.max()))


def _signals(context: ReportContext, record: Record, which: int) -> dict[str, Array]:
    """What a plane may be of, and what is left, past the beginning of the record."""
    part, force = begun(record), context.simulated(record)[which]
    return {
        "left": (record.force - force)[part],
        "x": 1000.0 * record.displacement[part],
        "v": record.velocity[part],
        "F": force[part] / 1000.0,
        "dF/dt": np.gradient(force, record.time)[part] / 1000.0,
    }


PLOT = Plot("planes", "missing", 4, draw)
