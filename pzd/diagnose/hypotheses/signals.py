"""What shapes are made of: the signals along a test, and those columns that take more than one expression."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from pzd.diagnose.data.cleaning import Prepared
from pzd.record import Array

LENGTHS = tuple(float(x) for x in np.geomspace(0.2, 1.5, 42))
"""Wave lengths that are tried [half strokes]: 5 % apart, so that the shortest stays within a quarter of a wave over the
stroke; a longer one is a spring."""
PLACES = tuple(float(x) for x in np.linspace(-0.9, 0.9, 37))
"""Places of the stroke that are tried [half strokes from its middle]: a sixth of `SPOT` apart."""
SPOT = 0.3
"""Half-width of a place with friction of its own [half strokes]; a narrower one shows as well, and no ride would feel
it."""
WIDTHS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6)
"""Half-widths of the play that are tried [half strokes]."""
TIMES_S = (0.003, 0.01, 0.03, 0.1, 0.3)
"""Time constants of the lag that are tried [s], in half decades."""
SHORTEST_RISE = 0.5
"""Time constants of what changes while a test runs [s], and the doubles of it up to `LONGEST_RISE`."""
LONGEST_RISE = 8.0


@dataclass(frozen=True, eq=False)
class Signals:
    """What a shape may be made of, along one test."""

    t: Array
    """(n,) time since the test began [s]."""
    x: Array
    v: Array
    a: Array
    F: Array
    U: Array
    """(n,) 0 where there is none."""
    T: Array
    """(n,) temperature from that of the setting [K]; 0 where there is none."""
    half_stroke: float
    """Of all tests [m]."""

    @property
    def force_rate(self) -> Array:
        """(n,) dF/dt [N/s]."""
        return np.gradient(self.F, self.t)


Columns = Callable[[Signals], Iterator[tuple[float | None, Array]]]
"""Value of the parameter that is searched (None without one), and (n, k) columns: one a coefficient."""


def one_column(function: Callable[[Signals], Array]) -> Columns:
    """The one column that a function of the signals gives; nothing is searched."""

    def columns(s: Signals) -> Iterator[tuple[float | None, Array]]:
        yield None, np.asarray(function(s))[:, None]

    return columns


def waves(s: Signals) -> Iterator[tuple[float | None, Array]]:
    """Sine and cosine of each wave length [m] over the position."""
    for length in (share * s.half_stroke for share in LENGTHS):
        phase = 2.0 * np.pi * s.x / length
        yield length, np.column_stack([np.sin(phase), np.cos(phase)])


def at_a_place(s: Signals) -> Iterator[tuple[float | None, Array]]:
    """Friction of about one around each place [m], falling to nothing in a straight line to either side."""
    for place in (share * s.half_stroke for share in PLACES):
        yield place, (np.sign(s.v) * np.maximum(1.0 - np.abs(s.x - place) / (SPOT * s.half_stroke), 0.0))[:, None]


def behind_play(s: Signals) -> Iterator[tuple[float | None, Array]]:
    """Pull of what the rod drags behind a play of each half-width [m], one at most."""
    for half_width in (share * s.half_stroke for share in WIDTHS):
        yield half_width, (play(s.x, half_width) / half_width)[:, None]


def play(x: Array, half_width: float) -> Array:
    """(n,) by how far the rod is ahead of what it drags behind a play of that half-width [m].

    Equation: e_i = clip(e_(i-1) + x_i - x_(i-1), -r, r)     Source: Visintin 1994, Differential Models of Hysteresis
    """
    ahead, found = 0.0, np.empty(x.size)
    for i, step in enumerate(np.diff(x, prepend=x[0]).tolist()):
        ahead = min(max(ahead + step, -half_width), half_width)
        found[i] = ahead
    return found


def lagging(s: Signals) -> Iterator[tuple[float | None, Array]]:
    """Velocity behind a lag of first order, less the velocity itself: what the lag takes off the damping."""
    from scipy.signal import lfilter

    step = float(np.median(np.diff(s.t)))
    for tau in TIMES_S:
        share = step / (tau + step)
        behind = lfilter([share], [1.0, share - 1.0], s.v, zi=[(1.0 - share) * s.v[0]])[0]
        yield tau, (behind - s.v)[:, None]


def while_running(s: Signals) -> Iterator[tuple[float | None, Array]]:
    """Velocity by a share that grows from 0 towards 1 while a test runs, with each time constant [s]."""
    tau = SHORTEST_RISE
    while tau <= LONGEST_RISE:
        yield tau, (-np.expm1(-s.t / tau) * s.v)[:, None]
        tau *= 2.0


def signals_of(prepared: Prepared, force: Array, temperature: float | None, half_stroke: float) -> Signals:
    """What a shape may be made of, along one test.

    Parameters
    ----------
    prepared : the test, its displacement cleaned and counted from the middle of the stroke
    force : (n,) that the damper gives [N]
    temperature : median of all tests [degC]; None where none was recorded
    half_stroke : of all tests [m]
    """
    record = prepared.record
    warmth = record.median_temperature()
    T = 0.0 if warmth is None or temperature is None else warmth - temperature
    U = np.zeros(force.size) if record.voltage is None else record.voltage
    if prepared.constant and record.voltage is not None:
        U = np.full(force.size, record.median_voltage())
    return Signals(
        t=record.time - record.time[0],
        x=record.displacement,
        v=record.velocity,
        a=record.acceleration,
        F=force,
        U=U,
        T=np.full(force.size, T),
        half_stroke=half_stroke,
    )
