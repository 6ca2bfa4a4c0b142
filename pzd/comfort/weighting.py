"""Frequency weightings of ISO 2631-1:1997 by their exact frequency responses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array

_RAMP_S = 1.0
"""Duration of the ramp after the last value: a drop to zero would ring at the Nyquist frequency."""
_ON_THE_CIRCLE = 64
"""Points of the mean over a circle; the nearest other pole is four radii away, so 4^-64 is left out."""


@dataclass(frozen=True)
class Weighting:
    """Corner frequencies [Hz] and quality factors of one weighting curve."""

    name: str
    f1: float
    """High-pass of the band limit, Q1 = 1/sqrt(2)."""
    f2: float
    """Low-pass of the band limit, Q2 = 1/sqrt(2)."""
    f3: float
    """Zero of the acceleration-velocity transition; infinite for a curve without it."""
    f4: float
    """Poles of the acceleration-velocity transition; infinite for a curve without it."""
    Q4: float
    step: tuple[float, float, float, float] | None
    """f5, Q5, f6, Q6 of the upward step; None for a curve without one."""

    @property
    def memory(self) -> float:
        """After this time [s] nothing is left of what was: the high-pass decays as exp(-35), see `MEMORY_S`."""
        return 8.0 / self.f1


WK = Weighting("Wk", 0.4, 100.0, 12.5, 12.5, 0.63, (2.37, 0.91, 3.35, 0.91))
"""Vertical vibration of a seated person, ISO 2631-1:1997, Annex A (five independent sources agree)."""
WD = Weighting("Wd", 0.4, 100.0, 2.0, 2.0, 0.63, None)
"""Horizontal vibration, ISO 2631-1:1997, Annex A."""
WC = Weighting("Wc", 0.4, 100.0, 8.0, 8.0, 0.63, None)
"""Fore-and-aft vibration at the backrest, ISO 2631-1:1997, Annex A."""
WE = Weighting("We", 0.4, 100.0, 1.0, 1.0, 0.63, None)
"""Rotational vibration of a seated person, ISO 2631-1:1997, Annex A."""
WJ = Weighting("Wj", 0.4, 100.0, np.inf, np.inf, 1.0, (3.75, 0.91, 5.32, 0.91))
"""Vertical vibration under the head of a person who lies, ISO 2631-1:1997, Annex A."""
WF = Weighting("Wf", 0.08, 0.63, np.inf, 0.25, 0.86, (0.0625, 0.80, 0.1, 0.80))
"""Vertical vibration that makes sick, ISO 2631-1:1997, Annex A."""
WEIGHTINGS = {each.name: each for each in (WK, WD, WF, WC, WE, WJ)}
"""All weightings of the standard by their names."""

MEMORY_S = WK.memory
"""The response of the 0.4 Hz high-pass decays as exp(-1.8 t): after 20 s nothing is left that could wrap around."""


def response(weighting: Weighting, frequency: Array) -> NDArray[np.complex128]:
    """Compute the complex frequency response of a weighting.

    Equation: H = Hh Hl Ht Hs, with s = j 2 pi f, p_i = s / (2 pi f_i) = j f / f_i,
    Hh = p1^2 / (1 + sqrt(2) p1 + p1^2), Hl = 1 / (1 + sqrt(2) p2 + p2^2),
    Ht = (1 + p3) / (1 + p4/Q4 + p4^2),
    Hs = (1 + p5/Q5 + p5^2) / (1 + p6/Q6 + p6^2) (f5/f6)^2
                                                     Source: ISO 2631-1:1997, Annex A

    Parameters
    ----------
    weighting : the curve
    frequency : (n,) frequencies, from 0 [Hz]

    Returns
    -------
    (n,) H, a pure number
    """
    return _transfer(weighting, np.asarray(1j * np.asarray(frequency, dtype=np.float64), dtype=np.complex128))


def _transfer(weighting: Weighting, s: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Compute H at complex frequencies s / (2 pi) [Hz]."""
    high, low = s / weighting.f1, s / weighting.f2
    p4 = s / weighting.f4
    band = high**2 / (1.0 + np.sqrt(2.0) * high + high**2) / (1.0 + np.sqrt(2.0) * low + low**2)
    h = band * (1.0 + s / weighting.f3) / (1.0 + p4 / weighting.Q4 + p4**2)
    if weighting.step is not None:
        f5, q5, f6, q6 = weighting.step
        p5, p6 = s / f5, s / f6
        h = h * (1.0 + p5 / q5 + p5**2) / (1.0 + p6 / q6 + p6**2) * (f5 / f6) ** 2
    return np.asarray(h)


def modes(weighting: Weighting) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Expand the weighting into first-order lags, for recursions of any step.

    Equation: H = 2 Re sum_j r_j / (s - p_j) over the poles above the real axis; r_j is the mean of
    H (s - p_j) over a circle about p_j        Source: partial fractions; residue theorem

    Parameters
    ----------
    weighting : the curve

    Returns
    -------
    (m,) poles p [rad/s] and (m,) residues r [rad/s], m = 2, one more for a transition and for a step
    """
    pairs = [(weighting.f1, np.sqrt(0.5)), (weighting.f2, np.sqrt(0.5))]
    if np.isfinite(weighting.f4):
        pairs.append((weighting.f4, weighting.Q4))
    if weighting.step is not None:
        pairs.append(weighting.step[2:])
    poles: NDArray[np.complex128] = np.array([f * (-0.5 / q + 1j * np.sqrt(1.0 - 0.25 / q**2)) for f, q in pairs])
    circle = np.exp(2j * np.pi * np.arange(_ON_THE_CIRCLE) / _ON_THE_CIRCLE)
    radii = [0.25 * min(abs(p - o) for o in (*poles, *poles.conj()) if o != p) for p in poles]
    around = [r * np.mean(_transfer(weighting, p + r * circle) * circle) for p, r in zip(poles, radii, strict=True)]
    return (2.0 * np.pi * poles).astype(np.complex128), (2.0 * np.pi * np.array(around)).astype(np.complex128)


def weighted(acceleration: Array, rate: float, weighting: Weighting = WK) -> Array:
    """Compute the frequency-weighted history of an acceleration.

    The spectrum is multiplied by the exact response, so nothing is lost to a bilinear transform
    (7 % at 63 Hz for 500 Hz sampling). The response is causal and the record is padded with zeros
    for the memory of the filter, so its end cannot wrap around to its start. Before the first sample the
    vehicle is at rest, as at the start of a whole ride: pass the whole ride, and cut the settling time off
    afterwards. A section from the middle of a vibration would have a start transient over its first 3 s.
    After the end the last value decays on a cosine ramp, which does not affect any sample of the ride.

    Parameters
    ----------
    acceleration : (n,) history from rest, evenly sampled [m/s2]
    rate : sampling rate [Hz]
    weighting : the curve

    Returns
    -------
    (n,) weighted acceleration [m/s2]
    """
    from scipy.fft import next_fast_len

    ramp = 0.5 + 0.5 * np.cos(np.linspace(0.0, np.pi, round(_RAMP_S * rate)))
    whole = np.concatenate([acceleration, acceleration[-1] * ramp])
    length = next_fast_len(whole.size + round(weighting.memory * rate), real=True)
    frequency = (np.arange(length // 2 + 1) * (rate / length)).astype(np.float64)
    spectrum = np.fft.rfft(whole, length)
    spectrum *= response(weighting, frequency)
    return np.asarray(np.fft.irfft(spectrum, length)[: acceleration.size])


# --- A record that begins in the middle of a vibration ---

_MOST_TONES = 6
"""Tones by which the start of a record is continued: harmonics of a road or an engine."""
_ITERATIONS = 8
"""Of Gauss and Newton for the frequencies of the tones; from the peak of the spectrum it converges in four or five."""
_LARGEST = 3.0
"""Amplitude of a tone, as a multiple of the largest sample, above which two tones cancel and the last is no tone."""
_FAINT = 1e-12
"""Share of the mean square below which nothing is left to continue."""
_WORTH = 0.9
"""A tone takes a tenth of what is left away, or it is noise and left to be mirrored."""
_CONVERGED = 1e-9
"""Change of the angles [rad over the whole record] below which the frequencies are found."""


def weighted_record(acceleration: Array, rate: float, weighting: Weighting = WK) -> Array:
    """Compute the frequency-weighted history of a record, which begins in the middle of a vibration.

    Before its first sample the record is continued, so that its start is no step: the tones of its beginning go on,
    what is left of it is mirrored. A constant such as gravity leaves nothing.

    Parameters
    ----------
    acceleration : (n,) evenly sampled, two samples or more [m/s2]
    rate : sampling rate [Hz]
    weighting : the curve

    Returns
    -------
    (n,) weighted acceleration [m/s2]
    """
    known = acceleration - acceleration.mean()
    count = round(weighting.memory * rate)
    beginning = known[: count + 1]
    before = np.arange(-count, 0, dtype=np.float64)
    tones, left = _tones_of(beginning)
    prefix = _sum_of(tones, before)
    mirrored = left[1:][::-1]
    prefix[count - mirrored.size :] += mirrored
    prefix *= 0.5 - 0.5 * np.cos(np.pi * np.clip(2.0 * np.arange(count) / count, 0.0, 1.0))
    return weighted(np.concatenate([prefix, known]), rate, weighting)[count:]


_Tones = tuple[Array, Array]
"""(m,) angles from sample to sample, and (1 + 2 m,) a constant, then the factors of cosine and sine of each."""


def _tones_of(samples: Array) -> tuple[_Tones, Array]:
    """Fit a constant and tones to (n,) samples, one more at a time; return them and what they leave (n,).

    Equation: minimise sum (x_n - c - sum_i a_i cos w_i n - b_i sin w_i n)^2   Source: least squares, w by Gauss-Newton
    """
    place = np.arange(samples.size, dtype=np.float64)
    tones = (np.zeros(0), np.array([samples.mean()]))
    left = samples - samples.mean()
    enough = _FAINT * float(np.sum(samples**2))
    largest = _LARGEST * float(np.max(np.abs(samples)))
    for _ in range(_MOST_TONES):
        if samples.size < 8 + 4 * tones[0].size or float(np.sum(left**2)) <= enough:
            break
        angles = np.append(tones[0], _strongest(left))
        for _ in range(_ITERATIONS):
            factors, change = _fitted(samples, place, angles)
            angles = angles + change
            if np.max(np.abs(change)) * place.size < _CONVERGED:
                break
        wrong = np.any((angles <= 0.0) | (angles >= np.pi)) or not np.all(np.isfinite(angles))
        if wrong or np.max(np.abs(factors := _fitted(samples, place, angles)[0])) > largest:
            break
        now = samples - _sum_of((angles, factors), place)
        if float(np.sum(now**2)) > _WORTH * float(np.sum(left**2)):
            break
        tones, left = (angles, factors), now
    return tones, left


def _strongest(left: Array) -> float:
    """Return the angle from sample to sample of the strongest tone, by the peak of the spectrum."""
    size = 4 * left.size
    spectrum = np.abs(np.fft.rfft(left * np.hanning(left.size), size))
    return 2.0 * np.pi * max(int(np.argmax(spectrum)), 1) / size


def _fitted(samples: Array, place: Array, angles: Array) -> tuple[Array, Array]:
    """Return the (1 + 2 m,) factors of tones of (m,) angles, and the step of Gauss and Newton of the angles."""
    turns = np.outer(place, angles)
    cosines, sines = np.cos(turns), np.sin(turns)
    shapes = np.column_stack([np.ones(place.size), cosines, sines])
    factors = _least_squares(shapes, samples)
    a, b = factors[1 : 1 + angles.size], factors[1 + angles.size :]
    slopes = (place / place.size)[:, np.newaxis] * (b * cosines - a * sines)
    steps = _least_squares(np.column_stack([shapes, slopes]), samples - shapes @ factors)[shapes.shape[1] :]
    return factors, np.clip(steps / place.size, -np.pi / place.size, np.pi / place.size)


def _least_squares(shapes: Array, wanted: Array) -> Array:
    from scipy.linalg import lstsq

    return np.asarray(lstsq(shapes, wanted, lapack_driver="gelsy", check_finite=False)[0])


def _sum_of(tones: _Tones, place: Array) -> Array:
    """Return constant and tones at (n,) places, in samples."""
    angles, factors = tones
    turns = np.outer(place, angles)
    count = angles.size
    return np.asarray(factors[0] + np.cos(turns) @ factors[1 : 1 + count] + np.sin(turns) @ factors[1 + count :])
