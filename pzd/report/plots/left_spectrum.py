"""What is left of the force by frequency, before and after diagnose, beside what differs from cycle to cycle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pzd.record import Array, Record
from pzd.report.blocks import number
from pzd.report.context import ReportContext
from pzd.report.drawing import BASELINE, FINAL, MEASURED, Panel, Plot, axes, legend
from pzd.report.gaps import at_some_voltages, begun
from pzd.signals.cycles import cycles

_BANDS_A_DECADE = 10
"""Bands of a third of an octave."""
_HIGHEST = 0.4
"""Highest frequency, as a share of the sampling rate: above, filters against aliasing act."""


def draw(context: ReportContext) -> Iterator[Panel]:
    """A picture a voltage, under the verdict `unexplained` alone."""
    if context.diagnosed.diagnosis.verdict != "unexplained" or not context.records:
        return
    for name, records in at_some_voltages(context).items():
        yield _panel(context, name, records)


def _panel(context: ReportContext, name: str, records: Sequence[Record]) -> Panel:
    middles, before, after, noise = spectra(context, records)
    figure, ax = axes(labels=("10^-0",), key=1)
    curves = [(context.model, before, BASELINE, "-")]
    curves += [("with what was added", after, FINAL, "-")] if context.extended else []
    curves += [("from cycle to cycle", noise, MEASURED, "--")] if np.any(noise > 0.0) else []
    for label, values, colour, style in curves:
        shown = values > 0.0
        ax.loglog(middles[shown], values[shown], style, color=colour, label=label)
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel("r.m.s. of what is left [N]")
    legend(figure)
    last = after if context.extended else before
    most = int(np.argmax(last))
    at = f" at {name}" if name else ""
    alt = f"R.m.s. of measured minus simulated force by third octaves{at}; "
    alt += f"the most, {number(last[most])} N, at {number(middles[most])} Hz."
    told = "Where it stands above the dashed line it repeats, and is no noise."
    return Panel(figure, f"What is left by frequency{at}", alt, told if np.any(noise > 0.0) else "")


def spectra(context: ReportContext, records: Sequence[Record]) -> tuple[Array, Array, Array, Array]:
    """Middles of third octaves [Hz], and r.m.s. in each before, after and of what differs between cycles [N].

    Over all records, each by its length; what differs between cycles is of those that repeat.
    """
    low = 1.0 / max(float(np.ptp(r.time)) for r in records)
    high = _HIGHEST * max(r.rate for r in records)
    count = max(int(np.ceil(_BANDS_A_DECADE * np.log10(high / low))), 1)
    edges = low * 10.0 ** (np.arange(count + 1) / _BANDS_A_DECADE)
    power, weight = np.zeros((3, count)), np.zeros(3)
    for record in records:
        part = begun(record)
        time = record.time[part]
        for i, force in enumerate(context.simulated(record)):
            power[i] += time.size * _power(record.force[part] - force[part], record.rate, edges)
            weight[i] += time.size
        differing = between_cycles(time, record.displacement[part], (record.force - context.simulated(record)[1])[part])
        if differing is not None:
            power[2] += differing.size * _power(differing, record.rate, edges)
            weight[2] += differing.size
    before, after, noise = np.sqrt(power / np.maximum(weight, 1.0)[:, np.newaxis])
    return np.sqrt(edges[1:] * edges[:-1]), before, after, noise


def between_cycles(time: Array, displacement: Array, left: Array) -> Array | None:
    """(m,) what differs from the average cycle, as large as noise is; None where nothing repeats."""
    run = cycles(time, displacement)
    if run is None:
        return None
    folded = run.fold(time, left)
    about: Array = (folded - folded.mean(axis=0)) * np.sqrt(run.count / (run.count - 1.0))
    return about.ravel()


def _power(values: Array, rate: float, edges: Array) -> Array:
    """Mean square in each band."""
    power = np.abs(np.fft.rfft(values) / values.size) ** 2
    power[1:] *= 2.0
    return np.histogram(np.fft.rfftfreq(values.size, 1.0 / rate), edges, weights=power)[0]


PLOT = Plot("left_spectrum", "missing", 5, draw)
