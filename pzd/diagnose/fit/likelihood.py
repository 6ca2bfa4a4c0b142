"""One record as the evidence weighs it: what is simulated, what it is held against, and in which units of noise.

A periodic record under constant conditions is its average cycle, harmonic by harmonic, each in
units of its own noise; any other is its samples, whitened. What offset, gain and delay of the test
may explain within their priors is taken out of both sides once and for all, so that a residual
that is left counts as it should: |r|^2 is minus twice the logarithm of the likelihood.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from pzd.damper.compose import respond, sampling_steps, sensors_of, shown_moments
from pzd.damper.drive import effective_voltage
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnose.fit.integrated_out import IntegratedOut
from pzd.record import Array, Rows
from pzd.signals.autoregression import Autoregression
from pzd.signals.between_cycles import PureError
from pzd.signals.left_out import unbroken

SIMULATION_TOLERANCE = 1e-7
"""Of the damper's path, as a share of the force, in every step by itself.

Reason: over a record the errors add up, and jump as the parameters move; a search must not take that for a way down.
Looser, it would hardly be faster: most steps of a record lie in one piece."""
REMEMBERED = 4
"""Effective voltages kept: slopes by a parameter of the drive need three."""


@dataclass(frozen=True, eq=False)
class RecordLikelihood:
    """What one record, or a part of it, says."""

    name: str
    place: int
    """Which base row it belongs to; -1 where the voltage moves."""
    motion: Motion
    """(m,) what is simulated."""
    begins_with: float
    """Recorded force at the first sample of the motion [N]: that of the same phase where the motion repeats."""
    places: Rows
    """(s,) samples of the motion at which it was recorded, from the first one compared to the last."""
    compared: NDArray[np.bool_]
    """(s,) which of them are compared: n of them, in one stretch or several."""
    measured: Array
    """(n,) force [N]."""
    peak: float
    """Largest measured force [N]."""
    noise: PureError | Autoregression
    weights: Array
    """(H + 1,) of the harmonics of an average cycle; empty where samples are compared."""
    nuisances: IntegratedOut
    """Offset, gain and delay of the test, and its jumps."""

    @cached_property
    def steps(self) -> Array:
        """Sampling intervals of the motion [s], one where they are even."""
        return sampling_steps(self.motion.time)

    @cached_property
    def effective_voltage(self) -> Callable[[bytes], Array]:
        """(m,) effective voltage [V] by the row of the drive, (d,) as bytes; the same array for the same row."""
        return lru_cache(REMEMBERED)(self._followed)

    def _followed(self, row: bytes) -> Array:
        voltage = self.motion.voltage
        if voltage is None:
            raise ValueError(f"{self.name}: the damper depends on the voltage, and none is given")
        return effective_voltage(voltage, self.steps, np.frombuffer(row).copy())

    def at_compared(self, simulated: Array) -> Array:
        """(n,) or (n, p) of what was simulated at the samples that are compared."""
        return simulated[self._compared_places]

    @cached_property
    def _compared_places(self) -> Rows:
        return self.places[self.compared]

    def shown(self, simulated: Array, sensors: Mapping[str, Mapping[str, float]], late: float = 0.0) -> Array:
        """(m,) or (m, p) what was simulated as a channel shows it, between the samples by a cubic.

        Parameters
        ----------
        simulated : (m,) force [N], or (m, p) of them
        sensors : effects of the sensor, see `pzd.damper.compose.sensors_of`
        late : how much later yet the channel shows it [s]
        """
        from scipy.interpolate import CubicSpline

        if not sensors and late == 0.0:
            return simulated
        begin = int(self.places[0]) if isinstance(self.noise, PureError) else 0
        time = self.motion.time[begin:]
        shown = shown_moments(sensors, time - late)
        if np.array_equal(shown, time):
            return simulated
        if begin == 0:
            return np.asarray(CubicSpline(time, simulated)(np.clip(shown, time[0], time[-1])))
        period = time[-1] - time[0] + self.steps[-1]
        whole = np.concatenate([simulated[begin:], simulated[begin : begin + 1]])
        cycle = CubicSpline(np.append(time, time[0] + period), whole, bc_type="periodic")
        return np.concatenate([simulated[:begin], cycle(shown)])

    def in_noise(self, values: Array) -> Array:
        """(w,) or (w, p) of a force or its derivatives at the compared samples, in units of noise."""
        return self.nuisances.taken_out(self._scaled(values))

    @cached_property
    def _unbroken(self) -> NDArray[np.bool_]:
        """Which whitened samples count: those whose predecessors, as many as the noise remembers, are compared too."""
        return unbroken(self.compared, self.noise.coefficients.size if isinstance(self.noise, Autoregression) else 0)

    def _scaled(self, values: Array) -> Array:
        if isinstance(self.noise, Autoregression):
            return self.noise.whitened(values)[self._unbroken]
        weights = self.weights.reshape(-1, *([1] * (values.ndim - 1)))
        harmonics = np.fft.rfft(values, axis=0)[: self.weights.size] / len(values) * weights
        return np.concatenate([harmonics.real, harmonics.imag[1:]])


def response(observation: RecordLikelihood, damper: Damper) -> Array:
    """(n,) force that a damper gives at the compared samples [N]."""
    return responses(observation, damper)(0.0)


def responses(observation: RecordLikelihood, damper: Damper) -> Callable[[float], Array]:
    """(n,) force that a damper gives at the compared samples [N], by how much later yet a channel shows it [s]."""
    o, sensors = observation, sensors_of(damper)
    prompt = damper.without_effects(*sensors)
    force = respond(prompt, o.motion, o.begins_with, SIMULATION_TOLERANCE)
    return lambda late: o.at_compared(o.shown(force, sensors, late))
