"""Harmonics: Fourier sums with exact derivatives, and lines of the mains in a channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.record import Array, Complex, Mask

# --- Fourier sums: roads, triangles, random motions ---

_WHOLE = 1e-7
"""A period this close to a whole number of steps is one [steps]."""
_BLOCK = 8192
"""Samples a block in the sum by Horner's rule: their complex sums stay in the cache of the processor."""


@dataclass(frozen=True, eq=False)
class FourierSum:
    """A periodic function of time or distance.

    Equation: x(s) = Re sum c_n exp(2 pi i n s / P)        Source: definition

    Examples
    --------
    >>> cosine = FourierSum(1.0, np.array([0.0, 2.0 + 0.0j]))
    >>> [float(each[0]) for each in cosine(np.array([0.0]))]  # 2 cos(2 pi s) and its derivatives at s = 0
    [2.0, 0.0, -78.95683520871486]
    """

    period: float
    """P, in the unit of s."""
    coefficients: Complex
    """(n,) c_0, c_1, ...; the amplitude of line n is abs(c_n)."""

    def __call__(self, place: Array) -> tuple[Array, Array, Array]:
        """Evaluate the function and its first two derivatives, exactly.

        Parameters
        ----------
        place : (n,) s

        Returns
        -------
        x, dx/ds and d2x/ds2, each (n,)
        """
        orders = 2j * np.pi / self.period * np.arange(self.coefficients.size)
        sums = np.stack([self.coefficients, self.coefficients * orders, self.coefficients * orders**2])
        steps = _steps_a_period(place, self.period)
        values = (
            _sum_by_horner(sums, place / self.period) if steps is None else _sum_by_fft(sums, place, self.period, steps)
        )
        return values[0], values[1], values[2]


def _steps_a_period(place: Array, period: float) -> int | None:
    """Return the number of grid steps in a period; None where the grid is uneven or the number is not whole."""
    if place.size < 3:
        return None
    step = (place[-1] - place[0]) / (place.size - 1)
    whole = round(period / step) if step > 0.0 else 0
    even = np.allclose(np.diff(place), step, rtol=1e-6, atol=0.0)
    return whole if even and whole > 0 and abs(period / step - whole) < _WHOLE else None


def _sum_by_fft(sums: Complex, place: Array, period: float, steps: int) -> Array:
    """Evaluate the sums on an even grid that repeats after one period."""
    lines = sums.shape[1]
    shifted = sums * np.exp(2j * np.pi * np.arange(lines) * (place[0] / period))
    if 2 * (lines - 1) >= steps:
        return _sum_by_horner(sums, place / period)
    spectrum = np.zeros((3, steps // 2 + 1), dtype=np.complex128)
    spectrum[:, :lines] = 0.5 * steps * shifted
    spectrum[:, 0] = steps * shifted[:, 0].real
    once = np.fft.irfft(spectrum, steps, axis=1)
    return np.stack([np.resize(row, place.size) for row in once])


def _sum_by_horner(sums: Complex, phase: Array) -> Array:
    """Evaluate the sums at any places, by Horner's rule in exp(2 pi i phase)."""
    result = np.empty((3, phase.size))
    for start in range(0, phase.size, _BLOCK):
        turn = np.exp(2j * np.pi * phase[start : start + _BLOCK])
        total = np.zeros((3, turn.size), dtype=np.complex128)
        for line in range(sums.shape[1] - 1, -1, -1):
            total *= turn
            total += sums[:, line, None]
        result[:, start : start + _BLOCK] = total.real
    return result


# --- Mains hum ---

MAINS = (50.0, 60.0)
"""Frequencies of the mains of the world [Hz]."""
MAINS_TOLERANCE = 0.2
"""Largest deviation of the mains from their nominal frequency [Hz]."""
PROMINENCE = 3.0
"""Least ratio of a line to the largest amplitude in its neighbourhood."""
LEAST_RATE = 2.5
"""Least ratio of the sampling rate to the frequency of a line."""
MAINS_ORDERS = (1, 3)
"""Harmonics of the mains that transformers and rectifiers produce."""
LOW_ORDER = 12.0
"""Order of the motion below which a harmonic may be prominent by itself, and is then not taken for the mains."""
_STEP = 0.01
"""Step of the frequency grid, times the length of the record: half of it is 1 degree of phase at either end."""


def line_amplitudes(values: Array, rate: float, frequencies: Sequence[float], cycle: float) -> list[float]:
    """Return the amplitudes of lines that exceed their neighbourhood, harmonics of the motion included; else 0.

    Parameters
    ----------
    values : (n,) of any channel
    rate : sampling rate [Hz]
    frequencies : of the lines [Hz]
    cycle : frequency of the motion, 0 where it does not repeat [Hz]

    Returns
    -------
    one amplitude a frequency, in the unit of the channel
    """
    if values.size == 0 or not frequencies:
        return [0.0] * len(frequencies)
    window = np.hanning(values.size)
    ramp = np.linspace(values[0], values[-1], values.size)
    spectrum = 2.0 * np.abs(np.fft.rfft((values - ramp) * window)) / window.sum()
    resolution, places = rate / values.size, np.fft.rfftfreq(values.size, 1.0 / rate)
    return [_prominent_amplitude(spectrum, np.abs(places - frequency), resolution, cycle) for frequency in frequencies]


def _prominent_amplitude(spectrum: Array, off: Array, resolution: float, cycle: float) -> float:
    """Return the amplitude of a prominent line, else 0; `off` (n,) is the distance of each frequency from it [Hz]."""
    wide = max(MAINS_TOLERANCE, 1.5 * resolution)
    inside, around = off <= wide, (off > wide + 3.0 * resolution) & (off <= max(5.0, 3.0 * cycle, 20.0 * resolution))
    if not inside.any() or not around.any():
        return 0.0
    amplitude = float(spectrum[inside].max())
    return amplitude if amplitude > PROMINENCE * float(spectrum[around].max()) else 0.0


def hum(time: Array, values: Array, wanted: Mask, cycle: float, least: float) -> Array:
    """Estimate the hum of the mains and their third harmonic in a channel.

    Equation: min |r - sum a_h cos(2 pi h f t) + b_h sin(2 pi h f t)|^2, f within 0.2 Hz of the mains
                                                                                    Source: least squares

    Parameters
    ----------
    time : (n,) evenly spaced [s]
    values : (n,) of the channel, the known motion subtracted
    wanted : (n,) mask of the samples that are fitted
    cycle : frequency of the motion, 0 where it does not repeat [Hz]
    least : least amplitude of a line, in the unit of the channel

    Returns
    -------
    (n,) in the unit of the channel; zero where no line is prominent
    """
    wave, rate = np.zeros(values.size), (values.size - 1) / float(time[-1] - time[0])
    if np.count_nonzero(wanted) <= 2 * len(MAINS_ORDERS):
        return wave
    level = values - values[wanted].mean()
    asked = [m for m in MAINS if rate >= LEAST_RATE * m and not _is_motion_harmonic(m, cycle, rate / values.size)]
    for mains, amplitude in zip(asked, line_amplitudes(values, rate, asked, cycle), strict=True):
        if amplitude <= least:
            continue
        from scipy.signal import zoom_fft  # it takes 0.7 s to load, and few records hum

        points = 1 + int(np.ceil(2.0 * MAINS_TOLERANCE * values.size / rate / _STEP))
        near = np.linspace(mains - MAINS_TOLERANCE, mains + MAINS_TOLERANCE, points)
        spectrum = zoom_fft(level * np.hanning(level.size), [near[0], near[-1]], m=points, fs=rate, endpoint=True)
        found = near[int(np.argmax(np.abs(spectrum)))]
        found = float(np.clip(found + _frequency_correction(found, time, level, wanted), near[0], near[-1]))
        waves = _waves(found, time)
        wave += waves @ np.linalg.lstsq(waves[wanted], level[wanted], rcond=None)[0]
    return wave


Line = tuple[int, float]
"""A line of the mains: its order, and the frequency of the mains [Hz]."""
MAINS_LINES: tuple[Line, ...] = tuple((order, mains) for order in MAINS_ORDERS for mains in MAINS)
"""Every line of the mains of the world."""


def mains_harmonics(cycle: float, last: int, resolution: float) -> Mask:
    """Return (last + 1,) which harmonics of a motion lie upon a line of the mains, so that it stands in every cycle.

    Parameters
    ----------
    cycle : frequency of the motion [Hz]
    last : highest harmonic
    resolution : of the record, the inverse of its length [Hz]
    """
    return np.asarray(np.any([_upon(line, cycle, last, resolution) for line in MAINS_LINES], axis=0))


def _upon(line: Line, cycle: float, last: int, resolution: float) -> Mask:
    """Return (last + 1,) which harmonics of a motion lie upon one line of the mains."""
    (order, mains), harmonics = line, np.arange(last + 1) * cycle
    return np.asarray(np.abs(harmonics - order * mains) <= order * MAINS_TOLERANCE + resolution)


def mains_amplitudes(residual: Array, rate: float, cycle: float, least: float) -> dict[Line, float]:
    """Return the amplitudes of the lines of the mains that are prominent and upon no low harmonic of the motion.

    Parameters
    ----------
    residual : (n,) of a channel, the known motion subtracted
    rate : sampling rate [Hz]
    cycle : frequency of the motion, 0 where it does not repeat [Hz]
    least : amplitude up to which a line counts as none, in the unit of the channel
    """
    shown = {}
    for order, mains in MAINS_LINES:
        line = order * mains
        if rate >= LEAST_RATE * line and not _is_motion_harmonic(line, cycle, rate / residual.size):
            (amplitude,) = line_amplitudes(residual, rate, [line], cycle)
            if amplitude > least:
                shown[order, mains] = amplitude
    return shown


def hum_variance(amplitudes: Mapping[Line, float], cycle: float, last: int, resolution: float) -> Array:
    """Return (last + 1,) variance |.|^2 of the harmonics of an average cycle by a hum of any phase in step with it.

    Equation: sum_l (A_l / 2)^2 over the lines l upon which a harmonic lies             Source: Parseval

    Parameters
    ----------
    amplitudes : of the lines of the mains
    cycle : frequency of the motion [Hz]
    last : highest harmonic
    resolution : of the record, the inverse of its length [Hz]
    """
    lines = (_upon(line, cycle, last, resolution) * (0.5 * size) ** 2 for line, size in amplitudes.items())
    return np.asarray(sum(lines, start=np.zeros(last + 1)))


def _waves(frequency: float, time: Array) -> Array:
    """Return cosine and sine of each harmonic below half the sampling rate (n, 2 h)."""
    rate = (time.size - 1) / float(time[-1] - time[0])
    phases = [2.0 * np.pi * h * frequency * time for h in MAINS_ORDERS if rate > 2.0 * h * frequency]
    return np.column_stack([f(phase) for phase in phases for f in (np.cos, np.sin)])


def _frequency_correction(frequency: float, time: Array, level: Array, wanted: Mask) -> float:
    """Return the Gauss-Newton step from a frequency of the grid to the least-squares one [Hz], by all harmonics."""
    waves = _waves(frequency, time)
    sizes = np.linalg.lstsq(waves[wanted], level[wanted], rcond=None)[0]
    cosines, sines = waves[:, ::2], waves[:, 1::2]
    rising = 2.0 * np.pi * time[:, np.newaxis] * np.array(MAINS_ORDERS[: cosines.shape[1]])
    slope = np.sum(rising * (sizes[1::2] * cosines - sizes[::2] * sines), axis=1)
    more = np.column_stack([waves, slope])
    return float(np.linalg.lstsq(more[wanted], level[wanted], rcond=None)[0][-1])


def _is_motion_harmonic(mains: float, cycle: float, resolution: float) -> bool:
    """Tell whether a low harmonic of the motion lies at the frequency of the mains."""
    order = mains / cycle if cycle > 0.0 else LOW_ORDER
    return order < LOW_ORDER and abs(order - round(order)) * cycle <= MAINS_TOLERANCE + 2.0 * resolution
