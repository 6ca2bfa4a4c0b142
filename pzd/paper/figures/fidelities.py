"""What stands behind the peaks of Figure 19: how much the control does, and what a real damper leaves of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from pzd.artefacts import Rides, SummaryRow, base_of
from pzd.comfort.iso2631_1978 import TRUST, Boundary, Exposure, exposure, shortest
from pzd.paper.car_search import (
    AMPLITUDE,
    BOUNDS,
    CONSTANT_PEAKS,
    CONTROLLED_PEAKS,
    DAMPING,
    FREQUENCIES,
    SPEED,
    constant_peaks,
)
from pzd.paper.fidelity import SettingRides, rides_on
from pzd.paper.figures.canvas import BASELINE, COLOURS, SOFT, panels
from pzd.paper.figures.figure import Drawing
from pzd.paper.figures.sources import FigureData
from pzd.paper.published import LARGE_GAP, SMALL_GAP, published
from pzd.report.ride_comfort import rated
from pzd.simulate.linear import harmonic_response

_BOUNDARY: Boundary = "reduced_comfort"
_NAMES = {"passive": "0 V", "comfort": "control"}


@dataclass(frozen=True)
class Bar:
    """One ride: its peaks and its exposure times at both frequencies."""

    name: str
    colour: str
    peaks: tuple[float, ...]
    times: tuple[str, ...]


def fidelities(data: FigureData) -> Iterator[Drawing]:
    """Peaks of |a_K| by fidelity and gap."""
    gaps = [_gap(data, setting) for setting in (LARGE_GAP, SMALL_GAP)]
    bars = [*_of_the_paper(), *_ideal(data), *(bar for gap in gaps for bar in _real(data, gap))]
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
        f"voltage. {_share(data)} Exposure times: reduced comfort of ISO 2631:1978, {TRUST}, "
        "each harmonic by itself; beside the bars of the paper stand its own."
    )
    yield Drawing("fidelity", figure, "Peaks of |a_K| and exposure times, ideal, by table and dynamically.", caption)


def _gap(data: FigureData, setting: str) -> SettingRides:
    """Control by the table and dynamically, and the damper without voltage, on one setting of the valve."""
    records = tuple(record for record in data.rig.records if record.setting == setting)
    if not records:
        raise LookupError(f"the rig has no tests at {setting}")
    damper = base_of(data.identified.rows, setting)
    rig = replace(data.rig, records=records)
    real = data.simulate.model_copy(update={"policies": ("comfort", "passive"), "fidelities": ("table", "dynamic")})
    return rides_on(damper, setting, rig, real, data.tabulate, data.control)


def _of_the_paper() -> list[Bar]:
    rows = published()

    def times(policy: str) -> tuple[str, ...]:
        return tuple(_minutes(rows[f"EXP{part}-{policy}"].number) for part in "ab")

    return [
        Bar("paper, constant c", SOFT, CONSTANT_PEAKS, times("c")),
        Bar("paper, control", SOFT, CONTROLLED_PEAKS, times("ctrl")),
    ]


def _ideal(data: FigureData) -> list[Bar]:
    car = data.simulate.car.car()
    bars = []
    for damping in (DAMPING, BOUNDS[0]):
        peaks = constant_peaks(car, damping)
        times = tuple(
            _time(exposure(peak / 2.0**0.5, frequency, _BOUNDARY))
            for peak, frequency in zip(peaks, FREQUENCIES, strict=True)
        )
        bars.append(Bar(f"constant c = {damping:g} N s/m", BASELINE, peaks, times))
    rows = [data.ride(frequency, "comfort", "ideal") for frequency in FREQUENCIES]
    return [*bars, _bar("control, ideal", COLOURS[0], data.rides_of_setting.rides, rows)]


def _real(data: FigureData, gap: SettingRides) -> Iterator[Bar]:
    colour = COLOURS[1] if gap.setting == LARGE_GAP else COLOURS[2]
    for policy, fidelity in (("passive", "dynamic"), ("comfort", "table"), ("comfort", "dynamic")):
        rows = [row for row in gap.rides.summary if (row.policy, row.fidelity) == (policy, fidelity)]
        yield _bar(f"{gap.setting}, {_NAMES[policy]}, {fidelity}", colour, gap.rides, rows)


def _bar(name: str, colour: str, rides: Rides, rows: list[SummaryRow]) -> Bar:
    by_case = {ride.row.case: ride for ride in rated(rides)}
    times = tuple(_time(shortest(by_case[row.case].components, _BOUNDARY)) for row in rows)
    return Bar(name, colour, tuple(row.peak_abs_aK_m_per_s2 for row in rows), times)


def _time(found: Exposure) -> str:
    if found.minutes is None:
        return found.remark
    return found.remark if found.remark and found.minutes > 0.0 else _minutes(found.minutes)


def _minutes(minutes: float) -> str:
    return f"{minutes:.0f} min" if minutes < 120.0 else f"{minutes / 60.0:.1f} h"


def _share(data: FigureData) -> str:
    """How much of the gain c_min alone gives."""
    car = data.simulate.car.car()
    captions = []
    soft = constant_peaks(car, BOUNDS[0])
    for n, frequency in enumerate(FREQUENCIES):
        constant = abs(harmonic_response(car, DAMPING, frequency, AMPLITUDE, SPEED)[1])
        controlled = data.ride(frequency, "comfort", "ideal").peak_abs_aK_m_per_s2
        share = (constant - soft[n]) / (constant - controlled)
        gain = f"{share:.0%} of the gain" if share > 0.0 else "worse than the larger c"
        captions.append(
            f"{constant:.2f} to {controlled:.2f} m/s² at {frequency:g} Hz, where c_min alone gives {soft[n]:.2f}"
            f" ({gain})"
        )
    return f"Control takes the peak from {' and from '.join(captions)}."
