"""The residual, measured less simulated force, where the verdict is `unexplained`: what pattern it has.

Over the shape that predicts it best, over planes of two quantities, by frequency, by its distribution, and through
T0, C and k of each test fitted alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from pzd.artefacts import ParameterRow
from pzd.identification.condition import identify_condition
from pzd.identification.config import IdentifyConfig
from pzd.quantities import BINGHAM, DISPLACEMENT, FORCE, VELOCITY
from pzd.record import Array, Condition, Record, is_constant, voltage_scale
from pzd.report.blocks import number, unit_of
from pzd.report.context import ReportContext
from pzd.report.drawing import AXIS, BASELINE, FINAL, MEASURED, Panel, Plot, axes, legend, legend_lines, shades
from pzd.report.rig_tests import settled
from pzd.signals.cycles import cycles
from pzd.signals.measures import rms


def _unexplained(context: ReportContext) -> bool:
    return context.diagnosed.diagnosis.verdict == "unexplained" and bool(context.tests.records)


# --- Over the shape of the best hypothesis ---


def hypothesis(context: ReportContext) -> Iterator[Panel]:
    """Draw class means of the residual with their scatter, a colour a voltage, and the fitted shape."""
    points = context.diagnosed.hypotheses.points
    if not points:
        return
    groups = [(voltage, list(mine)) for voltage, mine in groupby(points, key=lambda p: p.voltage_V)]
    labelled = len(groups) > 1
    largest = max(abs(p.left_N) + p.scatter_N for p in points)
    first = points[0]
    lines = legend_lines(len(groups)) if labelled else 0
    horizontal = f"{first.argument} [{first.unit}]"
    figure, ax = axes(horizontal, "what is left [N]", labels=(f"-{largest:.0f}",), key=lines)
    for (voltage, mine), colour in zip(groups, shades(len(groups)), strict=True):
        x, residual, scatter = ([getattr(p, name) for p in mine] for name in ("value", "left_N", "scatter_N"))
        label = context.voltage(voltage) if voltage is not None else f"moving {context.control.name}"
        ax.errorbar(x, residual, scatter, fmt="o", markersize=3.0, linewidth=0.7, color=colour, label=label)
        ax.plot(x, [p.fitted_N for p in mine], color=FINAL, linewidth=1.5)
    ax.axhline(0.0, color=AXIS, linewidth=0.8)
    ax.locator_params(axis="x", nbins=5)
    if labelled:
        legend(figure, 4)
    peak = max(points, key=lambda p: abs(p.fitted_N))
    alt = (
        f"What is left of the force over {first.argument}; c {first.shape} reaches {number(peak.fitted_N)} N at "
        f"{number(peak.value)} {first.unit}."
    )
    caption = (
        "Dots: mean and standard deviation of the samples of one class, with T0, C, k, the adopted effects and each "
        "test's own offset, gain and delay projected out. Line: the hypothesis, which is adopted nowhere."
    )
    yield Panel(figure, f"Hypothesis: what is left, as c {first.shape}", alt, caption)


# --- Over planes in which causes part: place and speed, speed and force, force and its rate ---

_CLASSES = 28
"""Classes of either quantity of a plane."""
_FEWEST_SAMPLES = 3
"""A cell with fewer samples stays empty."""
_DIVERGING = "RdBu_r"
"""White where the residual is 0; red where more force was measured."""
_PLANES = (
    ("x", "v", f"{DISPLACEMENT.name} and {VELOCITY.name}"),
    ("v", "F", f"{VELOCITY.name} and {FORCE.name}"),
    ("F", "dF/dt", f"{FORCE.name} and its rate"),
)
_UNITS = {"x": "mm", "v": "m/s", "F": "kN", "dF/dt": "kN/s"}


def planes(context: ReportContext) -> Iterator[Panel]:
    """Draw a picture a plane, a column a voltage, the baseline above and the final damper below."""
    if not _unexplained(context):
        return
    groups = context.tests.at_some_voltages()
    for first, second, words in _PLANES:
        yield _plane_panel(context, groups, (first, second), words)


def _plane_panel(context: ReportContext, groups: dict[str, list[Record]], plane: tuple[str, str], words: str) -> Panel:
    from matplotlib.figure import Figure

    dampers = (0, 1) if context.damper.extended else (0,)
    maps = {(i, name): _mean_map(context, records, i, plane) for i in dampers for name, records in groups.items()}
    top = max(float(np.nanmax(np.abs(mean))) for mean, _ in maps.values()) or 1.0
    figure: Figure = Figure(figsize=(4.5, 1.0 + 1.5 * len(dampers)))
    plots = figure.subplots(len(dampers), len(groups), sharex="col", sharey="col", squeeze=False)
    image = None
    for row, i in zip(plots, dampers, strict=True):
        for ax, name in zip(row, groups, strict=True):
            mean, extent = maps[i, name]
            cells = {"extent": extent, "origin": "lower", "aspect": "auto", "interpolation": "none"}
            image = ax.imshow(mean.T, _DIVERGING, vmin=-top, vmax=top, **cells)
            ax.grid(visible=False)
            ax.tick_params(labelsize=7)
            ax.locator_params(nbins=3)
            if i == dampers[0]:
                ax.set_title(name, fontsize=9)
        row[0].set_ylabel(f"{plane[1]} [{_UNITS[plane[1]]}]", fontsize=8)
    for ax in plots[-1]:
        ax.set_xlabel(f"{plane[0]} [{_UNITS[plane[0]]}]", fontsize=8)
    figure.subplots_adjust(left=0.14, right=0.8, top=0.9, bottom=0.16, wspace=0.55, hspace=0.25)
    if image is not None:
        figure.colorbar(image, cax=figure.add_axes((0.83, 0.2, 0.02, 0.65)), label="what is left [N]")
    baseline = f"the {context.damper.baseline_name}"
    rows = f"above {baseline}, below with what was added" if len(dampers) > 1 else baseline
    at = f" at {', '.join(groups)}" if context.controlled else ""
    alt = f"Mean of measured minus simulated force over {words}{at}, {rows}; the largest is {top:.3g} N."
    return Panel(figure, f"What is left over {words}", alt, f"Mean of the samples of a cell; {rows}.")


def _mean_map(
    context: ReportContext, records: Sequence[Record], damper: int, plane: tuple[str, str]
) -> tuple[Array, tuple[float, float, float, float]]:
    """Compute the mean residual of one damper (0 baseline, 1 final) in the cells of a plane.

    Returns
    -------
    (n, n) mean [N], NaN where there are too few samples; and the edges of the plane
    """
    columns = [_plane_signals(context, record, damper) for record in records]
    residual, x, y = (np.concatenate([of[name] for of in columns]) for name in ("residual", *plane))
    edges = [np.linspace(c.min(), c.max(), _CLASSES + 1) for c in (x, y)]
    count = np.histogram2d(x, y, edges)[0]
    total = np.histogram2d(x, y, edges, weights=residual)[0]
    mean = np.where(count >= _FEWEST_SAMPLES, total / np.maximum(count, 1.0), np.nan)
    return mean, (float(x.min()), float(x.max()), float(y.min()), float(y.max()))


def _plane_signals(context: ReportContext, record: Record, damper: int) -> dict[str, Array]:
    """Return the residual and the coordinates of the planes, past the start of the record."""
    part, force = settled(record), context.damper.simulated(record)[damper]
    return {
        "residual": context.damper.residuals(record)[damper],
        "x": 1000.0 * record.displacement[part],
        "v": record.velocity[part],
        "F": force[part] / 1000.0,
        "dF/dt": np.gradient(force, record.time)[part] / 1000.0,
    }


# --- By frequency, beside what differs from cycle to cycle ---

_BANDS_PER_DECADE = 10
"""Third octaves."""
_HIGHEST = 0.4
"""Highest frequency, as a share of the sampling rate: above, filters against aliasing act."""


def spectrum(context: ReportContext) -> Iterator[Panel]:
    """Draw the r.m.s. residual by third octaves before and after diagnose, a picture a voltage."""
    if not _unexplained(context):
        return
    for name, records in context.tests.at_some_voltages().items():
        yield _spectrum_panel(context, name, records)


def _spectrum_panel(context: ReportContext, name: str, records: Sequence[Record]) -> Panel:
    middles, before, after, noise = spectra(context, records)
    figure, ax = axes("frequency [Hz]", "r.m.s. of what is left [N]", labels=("10^-0",))
    curves = [(context.damper.baseline_name, before, BASELINE, "-")]
    curves += [("with what was added", after, FINAL, "-")] if context.damper.extended else []
    curves += [("from cycle to cycle", noise, MEASURED, "--")] if np.any(noise > 0.0) else []
    for label, values, colour, style in curves:
        positive = values > 0.0  # a logarithmic axis has no 0
        ax.loglog(middles[positive], values[positive], style, color=colour, label=label)
    legend(figure)
    last = after if context.damper.extended else before
    most = int(np.argmax(last))
    at = f" at {name}" if name else ""
    alt = f"R.m.s. of measured minus simulated force by third octaves{at}; "
    alt += f"the most, {number(last[most])} N, at {number(middles[most])} Hz."
    caption = "Where it stands above the dashed line it repeats, and is no noise." if np.any(noise > 0.0) else ""
    return Panel(figure, f"What is left by frequency{at}", alt, caption)


def spectra(context: ReportContext, records: Sequence[Record]) -> tuple[Array, Array, Array, Array]:
    """Compute spectra of the residual over all records, each weighted by its length.

    Returns
    -------
    (n,) middles of third octaves [Hz]; (n,) r.m.s. in each of the residual of the baseline, of that of the final
    damper, and of what differs from cycle to cycle in the records that repeat [N]
    """
    low = 1.0 / max(float(np.ptp(r.time)) for r in records)
    high = _HIGHEST * max(r.rate for r in records)
    count = max(int(np.ceil(_BANDS_PER_DECADE * np.log10(high / low))), 1)
    edges = low * 10.0 ** (np.arange(count + 1) / _BANDS_PER_DECADE)
    power, weight = np.zeros((3, count)), np.zeros(3)
    for record in records:
        part = settled(record)
        baseline, final = context.damper.residuals(record)
        noise = between_cycles(record.time[part], record.displacement[part], final)
        for i, values in enumerate((baseline, final, noise)):
            if values is not None:
                power[i] += values.size * _band_power(values, record.rate, edges)
                weight[i] += values.size
    before, after, between = np.sqrt(power / np.maximum(weight, 1.0)[:, np.newaxis])
    return np.sqrt(edges[1:] * edges[:-1]), before, after, between


def between_cycles(time: Array, displacement: Array, residual: Array) -> Array | None:
    """Return (m,) deviations from the average cycle, as large as noise is; None where nothing repeats.

    The factor sqrt(n / (n - 1)) makes up for the share of the noise that the average of n cycles takes with it.
    """
    run = cycles(time, displacement)
    if run is None:
        return None
    folded = run.fold(time, residual)
    deviation: Array = (folded - folded.mean(axis=0)) * np.sqrt(run.count / (run.count - 1.0))
    return deviation.ravel()


def _band_power(values: Array, rate: float, edges: Array) -> Array:
    """Compute the mean square in each band."""
    power = np.abs(np.fft.rfft(values) / values.size) ** 2
    power[1:] *= 2.0  # negative frequencies
    return np.histogram(np.fft.rfftfreq(values.size, 1.0 / rate), edges, weights=power)[0]


# --- Distribution ---

_QUANTILES = 120
"""Quantiles that are drawn."""


def normal_quantiles(context: ReportContext) -> Iterator[Panel]:
    """Draw the quantiles of the residual over those of a normal distribution."""
    if not _unexplained(context):
        return
    figure, ax = axes("quantile of a normal distribution", "of what is left, over its r.m.s.")
    curves = [(context.damper.baseline_name, 0, BASELINE)]
    curves += [("with what was added", 1, FINAL)] * context.damper.extended
    for label, damper, colour in curves:
        normal, found = quantiles(context, damper)
        ax.plot(normal, found, color=colour, label=label)
    line = [float(normal[0]), float(normal[-1])]
    ax.plot(line, line, "--", color=MEASURED, label="normal")
    legend(figure)
    ends = f"from {number(found[0])} to {number(found[-1])}"
    alt = f"Quantiles of measured minus simulated force against a normal distribution: {ends}."
    caption = (
        "On the dashed line the residual is normally distributed; long ends are rare large residuals, as jumps leave."
    )
    yield Panel(figure, "How what is left is spread", alt, caption)


def quantiles(context: ReportContext, damper: int) -> tuple[Array, Array]:
    """Compute quantiles of a normal distribution and of the residual, each test over its own r.m.s.

    Parameters
    ----------
    context : the run
    damper : 0 the baseline, 1 the final
    """
    from scipy.special import ndtri

    parts = [context.damper.residuals(record)[damper] for record in context.tests.sampled]
    scaled = np.concatenate([part / (rms(part) or 1.0) for part in parts])
    shares = (np.arange(_QUANTILES) + 0.5) / _QUANTILES
    return np.asarray(ndtri(shares)), np.quantile(scaled, shares)


# --- T0, C and k of every test fitted alone, over what the tests differ in ---

_FEWEST_TESTS = 4
"""Fewer tests that differ show nothing at a glance."""
_MOST_TESTS = 60
"""Most tests that are fitted: each takes some hundredths of a second."""
_SAME = 0.02
"""Tests that differ by a smaller share do not differ."""
_SEED = 1
"""Of the evolutionary search, where the fit falls back on it."""


@dataclass(frozen=True)
class SingleFit:
    """One test fitted alone, and what it differs in from others."""

    voltage: float | None
    row: ParameterRow
    over: Mapping[str, float | None]
    """By the label of the axis."""


def fitted_alone(context: ReportContext) -> Iterator[Panel]:
    """Draw parameters of the tests over frequency, amplitude, temperature and order: stand and oil show there."""
    if not _unexplained(context):
        return
    tests = fit_alone(context)
    for label in tests[0].over if tests else ():
        known = [test for test in tests if test.over[label] is not None]
        values = [test.over[label] or 0.0 for test in known]
        if len(known) >= _FEWEST_TESTS and max(values) - min(values) > _SAME * max(map(abs, values)):
            yield _fitted_alone_panel(context, label, known, values)


def fit_alone(context: ReportContext) -> list[SingleFit]:
    """Fit every test at a constant voltage by itself, every n-th where there are too many."""
    scale = voltage_scale(context.tests.records)
    constant = [(place, r) for place, r in enumerate(context.tests.records, 1) if is_constant(r, scale)]
    measures = {m.record: m for m in context.identified.measures}
    found = []
    for place, record in constant[:: -(-len(constant) // _MOST_TESTS) or 1]:
        measured = measures.get(record.name)
        over = {
            "frequency [Hz]": measured.frequency_Hz if measured else None,
            "amplitude [mm]": 1000.0 * measured.amplitude_m if measured and measured.frequency_Hz else None,
            "temperature [°C]": record.median_temperature(),
            "order of the files": float(place),
        }
        condition = Condition(record.setting, record.median_voltage(), record.median_temperature(), (record,))
        row = identify_condition(condition, IdentifyConfig(), _SEED)[0]
        found.append(SingleFit(context.tests.level(record), row, over))
    return found


def _fitted_alone_panel(
    context: ReportContext, label: str, tests: Sequence[SingleFit], values: Sequence[float]
) -> Panel:
    from matplotlib.figure import Figure

    levels = sorted({test.voltage for test in tests}, key=lambda v: v or 0.0)
    colours = dict(zip(levels, shades(len(levels)), strict=True))
    figure: Figure = Figure(figsize=(4.5, 4.6))
    plots = figure.subplots(3, 1, sharex=True)
    for ax, quantity in zip(plots, BINGHAM, strict=True):
        for level in levels:
            points = [
                (value, getattr(test.row, quantity.column))
                for test, value in zip(tests, values, strict=True)
                if test.voltage == level and getattr(test.row, quantity.column) is not None
            ]
            if points:
                x, y = np.array(points, dtype=np.float64).T
                name = context.voltage(level) if context.controlled and ax is plots[0] else None
                ax.plot(x, y / 1000.0, "o", color=colours[level], markersize=4.0, label=name)
        ax.set_ylabel(f"{quantity.symbol} [k{unit_of(quantity.unit)}]", fontsize=8)
        ax.margins(y=0.15)
    plots[-1].set_xlabel(label)
    if context.controlled and len(levels) > 1:
        figure.legend(loc="upper left", ncols=4, bbox_to_anchor=(0.02, 1.0), columnspacing=1.0, handletextpad=0.1)
    figure.subplots_adjust(left=0.16, right=0.97, top=0.9, bottom=0.11, hspace=0.18)
    over = label.partition(" [")[0]
    alt = f"T0, C and k of {len(tests)} tests, each fitted alone, over the {over}."
    caption = "Each point is one test. What follows the axis at one colour is of the stand or the oil, or an effect."
    return Panel(figure, f"Tests fitted alone, over the {over}", alt, caption)


PLOTS = (
    Plot("hypothesis", "missing", 3, hypothesis),
    Plot("planes", "missing", 4, planes),
    Plot("spectrum", "missing", 5, spectrum),
    Plot("normal_quantiles", "missing", 6, normal_quantiles),
    Plot("fitted_alone", "missing", 7, fitted_alone),
)
