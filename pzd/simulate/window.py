"""The part of a ride in which its numbers are taken: settled motion, or a single event until it has died away."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pzd.artefacts import Ending
from pzd.record import Array
from pzd.simulate.config import KM_PER_H, SimulateConfig
from pzd.simulate.road import Road

DIED_AWAY = 0.01
"""A motion has died away where the acceleration stays below this share of its peak."""
FALLS = 0.9
"""A motion falls no further where its peak in a second is above this share of that in the second before. An
identified damper is elastic below its friction, and nothing else in this car damps: the body goes on
swinging on the oil springs."""
_SECOND = 1.0


@dataclass(frozen=True)
class Window:
    """Steps of a ride, both ends included."""

    first: int
    last: int

    @property
    def steps(self) -> slice:
        """The steps of the ride."""
        return slice(self.first, self.last + 1)


@dataclass(frozen=True)
class Event:
    """When a single event is under the wheels."""

    entry: float
    """When axle 1 meets it [s]."""
    exit: float
    """When axle 2 has left it [s]."""


def event_of(road: Road, config: SimulateConfig) -> Event | None:
    """The single event of a road; None on a road that goes on and on."""
    if road.event is None:
        return None
    begins, ends = road.event
    speed = config.vehicle_speed_km_per_h * KM_PER_H
    return Event(begins / speed, (ends + config.car.car().wheelbase) / speed)


def settled(settle: float, step: float, steps: int) -> Window:
    """From the settling time [s] to the end of a ride of so many steps [s]."""
    return Window(round(settle / step), steps)


def of_event(event: Event, step: float, accelerations: Sequence[Array]) -> tuple[Window, tuple[Ending, ...]]:
    """From the entry of axle 1 until the motion has died away in every ride over the same event.

    One window for all, since an r.m.s. over a longer window is smaller: rides are compared over the same time.

    Parameters
    ----------
    event : when it is under the wheels
    step : of the rides [s]
    accelerations : of each ride (m,) at K at every step [m/s2]

    Returns
    -------
    the window, and how the motion of each ride ends
    """
    found = [_end(acceleration, event, step) for acceleration in accelerations]
    last = max(end for end, _ in found)
    return Window(int(event.entry / step), last), tuple(ending for _, ending in found)


def _end(acceleration: Array, event: Event, step: float) -> tuple[int, Ending]:
    """The step at which the motion has died away, a whole number of seconds behind the event, and how it ends."""
    size = np.abs(acceleration)
    peak, second = float(np.max(size)), round(_SECOND / step)
    start, before = round(event.exit / step), np.inf
    while start + second < size.size:
        now = float(np.max(size[start : start + second]))
        if now <= DIED_AWAY * peak:
            return start, "motion died away"
        if now > FALLS * before:
            return start, "motion falls no further"
        start, before = start + second, now
    return size.size - 1, "ride over before the motion died away"
