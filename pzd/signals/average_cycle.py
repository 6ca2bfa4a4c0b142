"""Average cycle of a displacement, without its noise and its steps: no filter of fixed corner.

Noise of the displacement goes through a stiff oil into the force, and its second derivative looks like inertia. Where
the motion repeats, cycles are averaged, and only harmonics well above their own scatter are kept, over the whole cycle
or in short parts of it, such as the corners of a triangle. Steps that each cycle meets alike do not scatter: of the
harmonics that noise or steps hide, as much is expected as where the corners of the motion go on, or as a drive distorts
it, with what is left unknown of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array
from pzd.signals.cycles import Cycles, drift_over_cycles
from pzd.signals.lack_of_fit import ShortTimeMask
from pzd.signals.measures import resolution
from pzd.signals.noise import neighbouring_harmonics, pure_error
from pzd.signals.smoothing import resolved_lines
from pzd.signals.splines import even_cubic

Motion = tuple[Array, Array, Array]
"""Displacement, velocity and acceleration, each (n,)."""

SIGNIFICANT_HARMONIC = 4.0
"""Standard errors from which a harmonic of the displacement is kept, over a cycle or in parts of it."""
POINTS_OF_CYCLE = 16
"""Points per sample of the cleaned cycle."""
DISTORTION = 0.01
"""Second harmonic that the drive of a test stand may add to its motion, as a share of the first (standard deviation);
the h-th is (2/h)^2 of it, as where the speed of the rod jumps at a reversal.

Reason: makers of servo-hydraulic stands state a distortion of 0.5 to 3 % in all. Not tuned."""
FAR_TAIL = 1e4
"""Standard errors below zero beyond which a truncated normal is taken for its limit, an exponential.

Reason: the two differ by 1e-8 there, and farther out the exact mean is the difference of two large numbers."""
BEYOND = 3
"""Multiple of the highest harmonic up to which an error is drawn.

Reason: two thirds of the power that the speed at a corner has beyond the highest harmonic lie below, and a drawn cycle
has the points for it."""
LEFT_OUT_DRAWS = 6
"""Draws of the noise by which the power of the motion in what is left out is told from it."""


@dataclass(frozen=True, eq=False)
class AverageCycle:
    """Average cycle of a displacement, harmonic by harmonic."""

    run: Cycles
    points: int
    harmonics: NDArray[np.complex128]
    """(H + 1,) Fourier coefficients [m]."""
    variance: Array
    """(H + 1,) variance |.|^2 of the harmonics by noise and resolution [m^2]."""
    resolved: int
    """Number of the first harmonics, beyond which there is no more than the steps of the channel add."""
    step: float = 0.0
    """Of the channel, where its noise does not blur it [m]; else 0."""

    @classmethod
    def of(cls, time: Array, displacement: Array, run: Cycles) -> AverageCycle:
        """Average the cycles of a displacement (n,) [m] over time (n,) [s], and estimate how well that is known."""
        folded = run.fold(time, displacement)
        # A mean that walks would end every cycle with a step, which loads the oil spring.
        creep = drift_over_cycles(folded)
        error = pure_error(folded - creep + creep.mean())
        finest = resolution(displacement)
        hidden = finest > 0.0 and error.sample_variance < (0.5 * finest) ** 2
        if not hidden:
            return cls(run, error.points, error.mean, error.of_mean, error.mean.size)
        by_steps = variance_by_steps(folded.mean(axis=0), finest, error.mean.size)
        power = np.abs(error.mean) ** 2
        power[1:] *= 2.0
        return cls(run, error.points, error.mean, error.of_mean + by_steps, resolved_lines(power, finest), finest)

    def read_alike(self, other: AverageCycle) -> bool:
        """Whether the steps of the channel err alike in two cycles: equal motions from one zero, and no noise over it.

        Equation: |m_1 - m_2| + sum_h 2 ||c_1h| - |c_2h|| < q / 2 pi, at which the sawtooth x mod q moves by a radian;
        m the mean, whatever the phase at which a cycle begins
        """
        if self.step == 0.0 or other.step == 0.0:
            return False
        size = min(self.harmonics.size, other.harmonics.size)
        mine, others = (np.abs(each.harmonics[1:size]) for each in (self, other))
        apart = 2.0 * float(np.sum(np.abs(mine - others)[: min(self.resolved, other.resolved)]))
        apart += abs(float((self.harmonics[0] - other.harmonics[0]).real))
        return apart < max(self.step, other.step) / (2.0 * np.pi)

    @cached_property
    def clear(self) -> NDArray[np.bool_]:
        """(H + 1,) whether a harmonic stands clear of its own uncertainty."""
        clear: NDArray[np.bool_] = np.abs(self.harmonics) > SIGNIFICANT_HARMONIC * np.sqrt(self.variance)
        clear[0] = True
        clear[self.resolved :] = False
        return clear

    @cached_property
    def _in_parts(self) -> tuple[ShortTimeMask, Array]:
        resolved = np.arange(self.harmonics.size) < self.resolved
        left = self._cycle(np.where(self.clear | ~resolved, 0.0, self.harmonics))
        return ShortTimeMask.of(left, self.variance, SIGNIFICANT_HARMONIC)

    @cached_property
    def corner(self) -> float:
        """Power of a harmonic times the fourth power of its order, of the last octave that stands clear [m^2].

        Equation: mean over l/2 < h <= l of h^4 |c_h|^2, l the last clear harmonic; 0 where that is the first
        """
        last = int(np.max(np.flatnonzero(self.clear), initial=0))
        order = np.arange(max(last // 2 + 1, 2), last + 1)
        return float(np.mean((order**2 * np.abs(self.harmonics[order])) ** 2)) if order.size else 0.0

    @cached_property
    def expected(self) -> Array:
        """(H + 1,) power that a harmonic of the motion is expected to have before it is looked at [m^2].

        What stands clear goes on as where the speed of the rod jumps, and a drive distorts its motion.
        """
        distorted = (4.0 * DISTORTION * float(np.abs(self.harmonics[1]))) ** 2
        return np.asarray(max(self.corner, distorted) / np.maximum(np.arange(self.harmonics.size), 1.0) ** 4)

    @cached_property
    def hidden_by_steps(self) -> tuple[NDArray[np.complex128], Array]:
        """(H + 1,) harmonics that steps of the channel hide, as corners or the drive make them [m], and power unknown.

        A harmonic that steps know worse than what is expected is none, and all of that is unknown.

        Equation: c' = w c, s'^2 = w s^2, w = t^2 / (t^2 + s^2), t^2 as in `expected`; t < s: c' = 0, s'^2 = t^2
                                                                            Source: normal prior, normal error
        """
        prior = np.where(np.arange(self.harmonics.size) < max(self.resolved, 2), 0.0, self.expected)
        known = prior >= self.variance
        share = prior / np.maximum(prior + self.variance, np.finfo(np.float64).tiny)
        return np.where(known, share * self.harmonics, 0.0), np.where(known, share * self.variance, prior)

    @cached_property
    def clear_harmonics(self) -> NDArray[np.complex128]:
        """(H + 1,) harmonics that stand clear, over the whole cycle or in parts of it, or that steps hide [m]."""
        return np.where(self.clear, self.harmonics, self._spectrum(self._in_parts[1])) + self.hidden_by_steps[0]

    def _noise(self, draw: np.random.Generator) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Draw (H + 1,) noise, and return it with what `clear_harmonics` would keep of it."""
        size = self.harmonics.size
        unit = draw.standard_normal(size) + 1j * draw.standard_normal(size)
        noise: NDArray[np.complex128] = np.sqrt(0.5 * self.variance) * unit
        in_parts = self._spectrum(self._in_parts[0].kept(self._cycle(noise * ~self.clear)))
        return noise, np.where(self.clear, noise, in_parts)

    @cached_property
    def left_out(self) -> Array:
        """(H + 1,) power of the motion in what is not kept: of neighbours above noise, or of what steps hide."""
        drawn = [self._noise(draw) for draw in np.random.default_rng(LEFT_OUT_DRAWS).spawn(LEFT_OUT_DRAWS)]
        noise = np.mean([np.abs(whole - kept) ** 2 for whole, kept in drawn], axis=0)
        counted = ~self.clear & (np.arange(noise.size) < self.resolved)
        above = np.where(counted, np.abs(self.harmonics - self.clear_harmonics) ** 2 - noise, 0.0)
        low, high = neighbouring_harmonics(above.size - 1)
        added = (np.concatenate([[0.0], np.cumsum(each)]) for each in (above, noise**2 * counted, counted))
        sums, squares, counts = (each[high + 1] - each[low] for each in added)
        many = np.maximum(counts, 1.0)
        found = positive_mean(sums / many, np.sqrt(np.maximum(squares, 0.0)) / many, self.expected)
        return np.asarray(np.where(counted, found, self.hidden_by_steps[1]))

    def error(self, draw: np.random.Generator) -> NDArray[np.complex128]:
        """Draw (3 H + 1,) an error of `clear_harmonics`: noise in what is kept, what is left out and what is beyond."""
        _, found = self._noise(draw)
        beyond = self.corner / np.arange(found.size, BEYOND * (found.size - 1) + 1.0) ** 4
        power = np.concatenate([self.left_out, beyond])
        unknown = np.sqrt(0.5 * power) * (draw.standard_normal(power.size) + 1j * draw.standard_normal(power.size))
        unknown[: found.size] += found
        unknown[0] = 0.0
        return unknown

    def _cycle(self, harmonics: NDArray[np.complex128]) -> Array:
        """Return the (points,) cycle of some harmonics (H + 1,)."""
        return np.asarray(np.fft.irfft(harmonics, self.points) * self.points)

    def _spectrum(self, cycle: Array) -> NDArray[np.complex128]:
        """Return the (H + 1,) harmonics of a cycle (points,)."""
        return np.asarray(np.fft.rfft(cycle)[: self.harmonics.size] / self.points)

    def motion(self, harmonics: NDArray[np.complex128], finer: int = POINTS_OF_CYCLE) -> Callable[[Array], Motion]:
        """Return displacement, velocity and acceleration of some harmonics (H + 1,) as a function of time."""
        rate = 2j * np.pi * np.arange(harmonics.size) / self.run.period
        fine = finer * self.points
        values = np.fft.irfft(harmonics * rate ** np.arange(3)[:, None], fine) * fine
        cycle = even_cubic(values.T, periodic=True)

        def at(time: Array) -> Motion:
            x, v, a = np.ascontiguousarray(cycle(fine * self.run.phase(time)).T)
            return x, v, a

        return at


def positive_mean(seen: Array, error: Array, expected: Array) -> Array:
    """Compute the mean (n,) of positive quantities seen with an error: what noise hides is neither zero nor certain.

    Equation: z s + s phi(z) / Phi(z), z = d/s - s/m            Source: normal error, exponential prior of mean m

    Parameters
    ----------
    seen, error, expected : (n,) d, s and m, of which d may be negative

    Examples
    --------
    Seen well, not at all, and as nothing:

    >>> seen, error, expected = np.array([3.0, -5.0, 0.0]), np.array([1e-3, 1e3, 1.0]), np.array([1.0, 1.0, 1e6])
    >>> positive_mean(seen, error, expected).round(3).tolist()
    [3.0, 1.0, 0.798]
    """
    from scipy.special import erfcx

    tiny = np.finfo(np.float64).tiny
    error, expected = np.maximum(error, tiny**0.5), np.maximum(expected, tiny**0.25)
    z = np.maximum(seen / error - error / expected, -FAR_TAIL)
    inner = error * (z + np.sqrt(2.0 / np.pi) / erfcx(-z / np.sqrt(2.0)))
    return np.asarray(np.where(z > -FAR_TAIL, inner, expected / (1.0 - seen * expected / error**2)))


def variance_by_steps(cycle: Array, step: float, harmonics: int) -> Array:
    """Compute the variance |.|^2 of the harmonics (H + 1,) of a cycle (points,) by the steps of its channel [m^2].

    The error is a sawtooth in the displacement. It fills the harmonics up to the fastest of its teeth: all where a step
    takes less than two samples, else as many fewer.

    Equation: (q^2 / 12) / min(n, 2 h), h = max abs(dx/dphase) / q teeth a cycle; n samples
                                                                    Source: Bennett 1948, Bell Syst. Tech. J. 27
    """
    teeth = float(np.max(np.abs(np.gradient(cycle)))) * cycle.size / step
    density = np.full(harmonics, 1.0 / cycle.size)
    density[: int(np.ceil(teeth)) + 1] = 1.0 / min(cycle.size, max(2.0 * teeth, 1.0))
    return density * (step**2 / 12.0)
