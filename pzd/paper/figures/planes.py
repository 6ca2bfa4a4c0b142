"""Both planes of the paper: force over displacement and force over velocity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pzd.artefacts import ParameterRow
from pzd.damper.model import BaseRow, Damper
from pzd.paper.figures.canvas import COLOURS, DISPLACEMENT, FORCE, NUMBERS_OF_OTHERS, VELOCITY, key, panels
from pzd.paper.figures.numbered import Drawing, PaperFigure
from pzd.paper.figures.sources import Condition, FigureData, Sine, Test
from pzd.paper.published import LARGE_GAP, TABLES, Loop, loop_of, published, table_damper
from pzd.record import Array
from pzd.signals.measures import criterion

# ----------------------------------------------------------------------------------------------------


if TYPE_CHECKING:
    from matplotlib.figure import Figure

_POINTS = 1000
"""Of a drawn cycle: fewer than one a pixel would show."""


@dataclass(frozen=True, eq=False)
class Curve:
    """One loop with its name; the samples behind it where it was measured."""

    label: str
    loop: Loop
    test: Test | None = None
    colour: str | None = None
    style: dict[str, Any] | None = None


def measured(data: FigureData, labels: Mapping[str, str], what: str) -> Drawing:
    """The average cycles of the tests that published peak forces were measured in, and their peaks beside the paper's.

    Parameters
    ----------
    data : the run
    labels : name of the curve by id of the published number
    what : the picture in words

    Returns
    -------
    the drawing

    Raises
    ------
    LookupError : when the rig lacks one of the tests
    """
    curves, captions = [], []
    for name, label in labels.items():
        row = published()[name]
        test = data.test_of(row)
        curves.append(Curve(label, test.cycle(), test))
        captions.append(f"{label}: {test.measure.peak_force_N:.0f} N, paper {row.number:.0f} N")
    return Drawing("measured", both_planes(curves), what, "Peak of the average cycle, " + "; ".join(captions) + ".")


def identified(row: ParameterRow) -> BaseRow:
    """The identified parameters of a condition.

    Raises
    ------
    LookupError : when one of them is undetermined
    """
    if row.T0_N is None or row.C_Ns_per_m is None or row.k_N_per_m is None:
        raise LookupError(f"{row.setting}, {row.voltage_V} V: {row.status}")
    return BaseRow(voltage_V=row.voltage_V, T0_N=row.T0_N, C_Ns_per_m=row.C_Ns_per_m, k_N_per_m=row.k_N_per_m)


def element(row: BaseRow) -> Damper:
    """The Bingham element with the parameters of one row, whatever the voltage."""
    return Damper(base=(row.model_copy(update={"voltage_V": None, "temperature_degC": None}),))


def loop(damper: Damper, sine: Sine) -> Loop:
    """The settled cycle of a damper in a sine."""
    return loop_of(damper, sine.frequency, sine.amplitude, samples=_POINTS)


def fitted(test: Test, row: ParameterRow) -> tuple[Array, float]:
    """The identified element in the motion of a test.

    Parameters
    ----------
    test : a test of the rig
    row : the parameters of its condition

    Returns
    -------
    (n,) force [N], and W_s over all but the first cycle

    Raises
    ------
    LookupError : when a parameter is undetermined
    """
    from pzd.damper.compose import respond
    from pzd.damper.motion import Motion

    force = respond(element(identified(row)), Motion.of(test.record))
    period = 1.0 / (test.measure.frequency_Hz or 1.0)
    settled = test.record.time >= test.record.time[0] + period
    return force, criterion((test.record.force - force)[settled], test.record.force[settled])


def over_last_cycle(test: Test, force: Array) -> Loop:
    """A force in the motion of a test, over its last cycle."""
    part, record = test.last(1), test.record
    return Loop(record.displacement[part], record.velocity[part], force[part], record.time[part])


def both_planes(curves: Sequence[Curve], columns: int = 4) -> Figure:
    """(a) force over displacement, (b) force over velocity.

    Parameters
    ----------
    curves : loops by name, a colour each
    columns : of the key

    Returns
    -------
    the figure
    """
    figure, (left, right) = panels()
    for curve, usual in zip(curves, COLOURS * 3, strict=False):
        colour, style = curve.colour or usual, curve.style or {}
        for ax, name in ((left, "displacement"), (right, "velocity")):
            if curve.test is not None:
                record, part = curve.test.record, curve.test.last(3)
                ax.plot(getattr(record, name)[part][::5], record.force[part][::5], ".", color=colour, markersize=1.2,
                        alpha=0.5)  # fmt: skip
            ax.plot(getattr(curve.loop, name), curve.loop.force, color=colour, label=curve.label, **style)
    for ax, label in ((left, DISPLACEMENT), (right, VELOCITY)):
        ax.set_xlabel(label)
        ax.set_ylabel(FORCE)
    key(figure, left, columns)
    return figure


# ----------------------------------------------------------------------------------------------------
# Loops of the Bingham element: as identified from the stand, and with the parameters of the paper's tables.


def tabulated(condition: Condition) -> BaseRow:
    """The paper's parameters of a condition.

    Raises
    ------
    LookupError : when no table has it
    """
    for table, (setting, temperature) in TABLES.items():
        if setting == condition.setting and abs(temperature - condition.temperature) <= 2.0:
            for row in table_damper(table):
                if row.voltage_V == condition.voltage:
                    return row
    raise LookupError(f"the paper has no parameters at {condition}")


def modelled(part: str, data: FigureData, labels: dict[str, Condition], sine: Sine, what: str) -> Drawing:
    """The identified element at several conditions, the paper's element beside each.

    Parameters
    ----------
    part : ends the name of the file
    data : the run
    labels : conditions by the name of their curve
    sine : the motion
    what : the picture in words

    Returns
    -------
    the drawing

    Raises
    ------
    LookupError : when a condition was not identified
    """
    curves: list[Curve] = []
    captions: list[str] = []
    for (label, condition), colour in zip(labels.items(), COLOURS, strict=False):
        row = data.row(condition)
        ours, theirs = loop(element(identified(row)), sine), loop(element(tabulated(condition)), sine)
        curves.append(Curve(label, ours, colour=colour))
        curves.append(Curve(f"{label}, paper's parameters", theirs, colour=colour, style=NUMBERS_OF_OTHERS))
        captions.append(
            f"{label}: {ours.peak:.0f} N, with the paper's parameters {theirs.peak:.0f} N; {parameters(row)}"
        )
    figure = both_planes(curves, columns=len(labels))
    return Drawing(part, figure, what, f"{sine}. Peak, " + ". ".join(captions) + ".")


def at_two_temperatures(number: int, voltage: float, in_words: str) -> PaperFigure:
    """Figures 15 and 16: the model at 23 and 43 °C at one voltage.

    Parameters
    ----------
    number : of the figure
    voltage : [V]
    in_words : the voltage as the title says it
    """
    conditions = {f"{warm:g} °C": Condition(LARGE_GAP, voltage, warm) for warm in (23.0, 43.0)}
    what = f"Modelled force on both planes at 23 and 43 °C, {voltage:g} V."
    return PaperFigure(
        number,
        f"Model at 23 and 43 °C {in_words}",
        "model",
        "The Bingham element with the parameters identified from the virtual stand; dashed with those of Tables 2 and "
        "3. The paper states no motion: 2 Hz and 0.03 m are assumed, as in Figures 8 and 9.",
        lambda data: (modelled("model", data, conditions, Sine(2.0, 0.030), what),),
    )


def parameters(row: ParameterRow) -> str:
    """T0, C, k of a row with their 95 % intervals, in words."""
    intervals = [
        f"{name} {value:.4g} ({low:.4g} to {high:.4g}) {unit}"
        for name, value, low, high, unit in (
            ("T0", row.T0_N, row.T0_N_low95, row.T0_N_high95, "N"),
            ("C", row.C_Ns_per_m, row.C_Ns_per_m_low95, row.C_Ns_per_m_high95, "N s/m"),
            ("k", row.k_N_per_m, row.k_N_per_m_low95, row.k_N_per_m_high95, "N/m"),
        )
        if value is not None and low is not None and high is not None
    ]
    return ", ".join(intervals)
