"""Figure 19: acceleration at K with constant c and controlled, and what its peaks depend on.

Three pictures: the paper's own, the controlled peaks of every plausible car under every tie-break, and the peaks by
fidelity and gap: how much the control does, and what a real damper leaves of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pzd.artefacts import RIDE_COLUMNS, Rides, SummaryRow, base_of
from pzd.comfort.iso2631_1978 import TRUST, Boundary, Exposure, exposure, shortest
from pzd.paper.cars import (
    BOUNDS,
    CONSTANT_PEAKS,
    CONTROLLED_PEAKS,
    DAMPING,
    FREQUENCIES,
    CarRow,
    closest,
    constant_peaks,
    stored,
)
from pzd.paper.figures.canvas import BASELINE, COLOURS, FINAL, INK, SOFT, key, panels
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.sources import FigureData, SettingRides, rides_on
from pzd.paper.published import LARGE_GAP, SMALL_GAP, published
from pzd.report.ride_comfort import rated
from pzd.schema.errors import ConfigError
from pzd.simulate.control.demand import TIE_BREAKS

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw(data: FigureData) -> Iterator[Drawing]:
    """Draw the paper's picture, the survey of cars, and the peaks by fidelity."""
    yield accelerations(data)
    yield survey()
    yield fidelities(data)


# --- The paper's picture ---


_SHOWN = 2.0
"""Length of the settled ride that is shown [s]."""
_TIME, _ACCELERATION = RIDE_COLUMNS[0], RIDE_COLUMNS[-1]
_CURVES = {"constant": ("c-const.", BASELINE), "comfort": ("c-control", FINAL)}


def accelerations(data: FigureData) -> Drawing:
    """Draw |a_K| over the last two seconds of the ideal rides at 2.25 and 4.5 Hz.

    Raises
    ------
    ConfigError : when no history was written
    """
    rides = {ride.case: ride.columns for ride in data.rides_of_setting.rides.rides}
    figure, axes = panels()
    captions = []
    for ax, frequency, *printed in zip(axes, FREQUENCIES, CONSTANT_PEAKS, CONTROLLED_PEAKS, strict=True):
        for (policy, (label, colour)), peak in zip(_CURVES.items(), printed, strict=True):
            row = data.ride(frequency, policy, "ideal")
            if row.case not in rides:
                raise ConfigError(
                    "simulate.keep: Fig. 19 is drawn from histories at the fidelity ideal; say all, and histories: csv"
                )
            time = rides[row.case][_TIME]
            part = time >= time[-1] - _SHOWN
            ax.plot(time[part] - time[part][0], np.abs(rides[row.case][_ACCELERATION][part]), color=colour, label=label)
            captions.append(f"{frequency:g} Hz {label} {row.peak_abs_aK_m_per_s2:.3f} m/s², paper {peak:g}")
        ax.set_xlabel("time t [s]")
        ax.set_ylabel("|a_K| [m/s²]")
        ax.set_xlim(0.0, _SHOWN)
        ax.set_ylim(bottom=0.0)
    key(figure, axes[0])
    caption = (
        f"Settled rides, forces ideal within c_min and c_max, tie-break {data.simulate.tie_break}. Peaks: "
        + "; ".join(captions)
        + f". {_wheel_contact(data)}"
    )
    return Drawing("acceleration", figure, "Magnitude of the acceleration at K over time at 2.25 and 4.5 Hz.", caption)


def _wheel_contact(data: FigureData) -> str:
    """Return the least force between wheels and road in the controlled rides, in words.

    The paper's half-car has no unsprung masses: wheels without mass pass on the force of spring and damper, so that the
    road carries it and the static load, see `pzd.simulate.ride.outcome.wheel_rows`.
    """
    least = []
    for frequency in FREQUENCIES:
        case = data.ride(frequency, "comfort", "ideal").case
        wheels = [wheel for wheel in data.rides_of_setting.rides.wheels if wheel.case == case]
        worst = min(wheels, key=lambda wheel: wheel.min_contact_force_N)
        least.append(
            f"{worst.min_contact_force_N / 1000.0:.1f} kN at axle {worst.axle} at {frequency:g} Hz, "
            f"0 or less {worst.pulling:.0%} of the time"
        )
    return (
        "The car has no unsprung masses, so the force between wheel and road is the static load less the force of "
        f"spring and damper; under control it falls to {'; '.join(least)}: below 0 the wheels pull on the road, which "
        "no wheel can."
    )


# --- The controlled peaks of every plausible car under every tie-break ---


def survey() -> Drawing:
    """Draw peak at 4.5 Hz over peak at 2.25 Hz, a panel a tie-break, with the spread for 1 % in each parameter."""
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
        captions.append(_car_in_words(best))
    key(figure, axes[0])
    count = len({(row.a1_m, row.a2_m, row.pitch_inertia_kgm2, row.x_K_m) for row in rows if row.found == "survey"})
    caption = f"{count} plausible cars of a grid that meet both peaks with constant c within 5 %. Closest: " + " ".join(
        captions
    )
    return Drawing("cars", figure, "Controlled peaks of all plausible cars under three tie-breaks.", caption)


def _spread(ax: Axes, cars: list[CarRow], colour: str, alpha: float, label: str, width: float = 0.6) -> None:
    """Draw error bars in both directions."""
    peaks = np.array([car.controlled for car in cars])
    low, high = (np.array([getattr(car, f"controlled_{end}") for car in cars]) for end in ("low", "high"))
    across, along = np.stack([peaks - low, high - peaks]).transpose(2, 0, 1)
    ax.errorbar(
        peaks[:, 0],
        peaks[:, 1],
        along,
        across,
        fmt="none",
        ecolor=colour,
        elinewidth=width,
        alpha=alpha,
        label=label,
        zorder=3 if width > 1 else 1,
    )


def _car_in_words(row: CarRow) -> str:
    spreads = (
        f"{peak:.3f} ({low:.3f} to {high:.3f}{words})"
        for peak, low, high, words in zip(
            row.controlled, row.controlled_low, row.controlled_high, (" for 1 %", ""), strict=True
        )
    )
    return (
        f"{row.tie_break} {row.deviation:.1%} at worst (a1 {row.a1_m:g} m, a2 {row.a2_m:g} m, "
        f"J_y {row.pitch_inertia_kgm2:g} kg m², x_K {row.x_K_m:g} m; constant {row.constant[0]:.3f} and "
        f"{row.constant[1]:.3f}, controlled {' and '.join(spreads)} m/s²)."
    )


# --- The peaks by fidelity and gap ---


_BOUNDARY: Boundary = "reduced_comfort"
_POLICIES = {"passive": "0 V", "comfort": "control"}


@dataclass(frozen=True)
class Bar:
    """One policy at one fidelity: its peaks [m/s2] and its exposure times at both frequencies."""

    name: str
    colour: str
    peaks: tuple[float, ...]
    times: tuple[str, ...]


def fidelities(data: FigureData) -> Drawing:
    """Draw the peaks of |a_K| and the exposure times of the paper, of ideal forces, and of a damper at each gap."""
    gaps = [_rides_at_gap(data, setting) for setting in (LARGE_GAP, SMALL_GAP)]
    bars = [*_bars_of_the_paper(), *_ideal_bars(data), *(bar for gap in gaps for bar in _bars_of_a_gap(gap))]
    figure, axes = panels(width=10.2, height=0.55 + 0.3 * len(bars))
    for n, (ax, frequency) in enumerate(zip(axes, FREQUENCIES, strict=True)):
        for place, bar in enumerate(reversed(bars)):
            ax.barh(place, bar.peaks[n], color=bar.colour, height=0.62)
            ax.annotate(f"{bar.peaks[n]:.2f};  {bar.times[n]}", (bar.peaks[n], place), (4, 0), va="center",
                        textcoords="offset points", fontsize=8.0)  # fmt: skip
        ax.set_yticks(range(len(bars)), [bar.name for bar in reversed(bars)] if n == 0 else [])
        ax.grid(visible=False, axis="y")
        ax.set_xlim(0.0, 1.45 * max(bar.peaks[n] for bar in bars))
        ax.set_xlabel(f"peak |a_K| at {frequency:g} Hz [m/s²];  exposure time in comfort")
    floor = ", ".join(f"{gap.setting} at least {gap.least_damping:.0f} N s/m" for gap in gaps)
    peaks = "; ".join(f"{bar.name} {' and '.join(f'{peak:.2f}' for peak in bar.peaks)}" for bar in bars)
    caption = (
        f"Peaks at 2.25 and 4.5 Hz [m/s²]: {peaks}. "
        f"The damper's force over speed is nowhere below: {floor}; c_min = {BOUNDS[0]:g} N s/m is out of reach at any "
        f"voltage. {_gain_of_control(data)} Exposure times: reduced comfort of ISO 2631:1978, {TRUST}, "
        "each harmonic by itself; beside the bars of the paper stand its own."
    )
    return Drawing("fidelity", figure, "Peaks of |a_K| and exposure times, ideal, by table and dynamically.", caption)


def _rides_at_gap(data: FigureData, setting: str) -> SettingRides:
    """Ride by table and dynamically, controlled and without voltage, on one setting of the valve."""
    records = tuple(record for record in data.rig.records if record.setting == setting)
    if not records:
        raise LookupError(f"the rig has no tests at {setting}")
    damper = base_of(data.identified.rows, setting)
    rig = replace(data.rig, records=records)
    real = data.simulate.model_copy(update={"policies": ("comfort", "passive"), "fidelities": ("table", "dynamic")})
    return rides_on(damper, setting, rig, real, data.tabulate, data.control)


def _bars_of_the_paper() -> Iterator[Bar]:
    for name, policy, peaks in (("constant c", "c", CONSTANT_PEAKS), ("control", "ctrl", CONTROLLED_PEAKS)):
        times = tuple(_minutes(published()[f"EXP{part}-{policy}"].number) for part in "ab")
        yield Bar(f"paper, {name}", SOFT, peaks, times)


def _ideal_bars(data: FigureData) -> Iterator[Bar]:
    car = data.simulate.car.car()
    for damping in (DAMPING, BOUNDS[0]):
        peaks = constant_peaks(car, damping)
        times = tuple(
            _time(exposure(peak / 2.0**0.5, frequency, _BOUNDARY))
            for peak, frequency in zip(peaks, FREQUENCIES, strict=True)
        )
        yield Bar(f"constant c = {damping:g} N s/m", BASELINE, peaks, times)
    rows = [data.ride(frequency, "comfort", "ideal") for frequency in FREQUENCIES]
    yield _bar_of_rides("control, ideal", COLOURS[0], data.rides_of_setting.rides, rows)


def _bars_of_a_gap(gap: SettingRides) -> Iterator[Bar]:
    colour = COLOURS[1] if gap.setting == LARGE_GAP else COLOURS[2]
    for policy, fidelity in (("passive", "dynamic"), ("comfort", "table"), ("comfort", "dynamic")):
        rows = [row for row in gap.rides.summary if (row.policy, row.fidelity) == (policy, fidelity)]
        yield _bar_of_rides(f"{gap.setting}, {_POLICIES[policy]}, {fidelity}", colour, gap.rides, rows)


def _bar_of_rides(name: str, colour: str, rides: Rides, rows: list[SummaryRow]) -> Bar:
    by_case = {ride.row.case: ride for ride in rated(rides)}
    times = tuple(_time(shortest(by_case[row.case].components, _BOUNDARY)) for row in rows)
    return Bar(name, colour, tuple(row.peak_abs_aK_m_per_s2 for row in rows), times)


def _time(found: Exposure) -> str:
    if found.minutes is None:
        return found.remark
    return found.remark if found.remark and found.minutes > 0.0 else _minutes(found.minutes)


def _minutes(minutes: float) -> str:
    return f"{minutes:.0f} min" if minutes < 120.0 else f"{minutes / 60.0:.1f} h"


def _gain_of_control(data: FigureData) -> str:
    """Return in words how much of the gain of control c_min alone gives."""
    car = data.simulate.car.car()
    captions = []
    for frequency, constant, soft in zip(FREQUENCIES, constant_peaks(car), constant_peaks(car, BOUNDS[0]), strict=True):
        controlled = data.ride(frequency, "comfort", "ideal").peak_abs_aK_m_per_s2
        share = (constant - soft) / (constant - controlled)
        gain = f"{share:.0%} of the gain" if share > 0.0 else "worse than the larger c"
        captions.append(
            f"{constant:.2f} to {controlled:.2f} m/s² at {frequency:g} Hz, where c_min alone gives {soft:.2f} ({gain})"
        )
    return f"Control takes the peak from {' and from '.join(captions)}."


FIGURES = (
    PaperFigure(
        19,
        "Acceleration at K with and without control, 2.25 and 4.5 Hz",
        "rides",
        "Rides of the half-car. The paper leaves a1, a2, J_y, x_K and the tie-break out: car and tie-break were chosen "
        "so that the four peaks come closest, so agreement of these peaks confirms nothing.",
        draw,
    ),
)
