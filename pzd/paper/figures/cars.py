"""The controlled peaks of every plausible car under every tie-break."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.paper.car_search import CONTROLLED_PEAKS, CarRow, closest, stored
from pzd.paper.figures.canvas import BASELINE, COLOURS, INK, SOFT, key, panels
from pzd.paper.figures.figure import Drawing
from pzd.paper.figures.sources import FigureData
from pzd.simulate.minimise import TIE_BREAKS

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def survey(data: FigureData) -> Drawing:
    """Peak at 4.5 Hz over peak at 2.25 Hz, a panel a tie-break, with the spread for 1 % in each parameter."""
    rows = stored()
    figure, axes = panels(width=10.2, height=3.9, ratios=(1.0, 1.0, 1.0))
    captions = []
    for ax, tie_break, colour in zip(axes, TIE_BREAKS, COLOURS, strict=False):
        cars = [row for row in rows if row.tie_break == tie_break]
        best = closest(cars)
        _spread(ax, cars, SOFT, 0.7, "plausible cars, spread for 1 %")
        ax.plot([c.controlled[0] for c in cars], [c.controlled[1] for c in cars], ".", color=colour, markersize=3.5)
        _spread(ax, [best], INK, 1.0, "closest", 1.6)
        ax.plot(*CONTROLLED_PEAKS, "o", color=BASELINE, markersize=11, markerfacecolor="none", label="paper", zorder=4)
        ax.set_title(f"{ax.get_title(loc='left')} {tie_break}", loc="left", fontsize=9.5)
        ax.set_xlabel("controlled peak at 2.25 Hz [m/s²]")
        ax.set_ylabel("controlled peak at 4.5 Hz [m/s²]")
        ax.set_xlim(0.0, 2.2)
        ax.set_ylim(0.0, 2.2)
        captions.append(_described(best))
    key(figure, axes[0])
    count = len({(row.a1_m, row.a2_m, row.pitch_inertia_kgm2, row.x_K_m) for row in rows if row.found == "survey"})
    said = f"{count} plausible cars of a grid that meet both peaks with constant c within 5 %."
    caption = f"{said} Closest: {' '.join(captions)}"
    return Drawing("cars", figure, "Controlled peaks of all plausible cars under three tie-breaks.", caption)


def _spread(ax: Axes, cars: list[CarRow], colour: str, alpha: float, label: str, width: float = 0.6) -> None:
    x, y = [c.controlled[0] for c in cars], [c.controlled[1] for c in cars]
    across = [
        [c.controlled[0] - c.controlled_a_low_m_per_s2 for c in cars],
        [c.controlled_a_high_m_per_s2 - c.controlled[0] for c in cars],
    ]
    along = [
        [c.controlled[1] - c.controlled_b_low_m_per_s2 for c in cars],
        [c.controlled_b_high_m_per_s2 - c.controlled[1] for c in cars],
    ]
    ax.errorbar(
        x,
        y,
        along,
        across,
        fmt="none",
        ecolor=colour,
        elinewidth=width,
        alpha=alpha,
        label=label,
        zorder=3 if width > 1 else 1,
    )


def _described(row: CarRow) -> str:
    return (
        f"{row.tie_break} {row.miss:.1%} at worst (a1 {row.a1_m:g} m, a2 {row.a2_m:g} m, "
        f"J_y {row.pitch_inertia_kgm2:g} kg m², x_K {row.x_K_m:g} m; constant {row.constant[0]:.3f} and "
        f"{row.constant[1]:.3f}, controlled {row.controlled[0]:.3f} ({row.controlled_a_low_m_per_s2:.3f} to "
        f"{row.controlled_a_high_m_per_s2:.3f} for 1 %) and {row.controlled[1]:.3f} "
        f"({row.controlled_b_low_m_per_s2:.3f} to {row.controlled_b_high_m_per_s2:.3f}) m/s²)."
    )
