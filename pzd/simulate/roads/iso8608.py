"""A road drawn from the spectrum of an ISO 8608 class; each seed is another road of the same class.

The height is a function of place and seed alone: a longer ride meets the same road and goes on.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Literal
from zlib import crc32

import numpy as np
from pydantic import AfterValidator, Field
from typing_extensions import override

from pzd.record import Array
from pzd.signals.iso8608 import classes, known_class, profile
from pzd.simulate.roads import END_REACH, Profile, Road, Way, through

_PIECE = 1000.0
"""The road is made of pieces of this length [m], ten times its longest wave, drawn one by one."""
_BAND_FROM = 0.01
"""Lowest wavenumber [cycles/m]; ISO 8608 begins at 0.011."""
_KNOTS_A_WAVE = 16
_RUN_IN = 5.0
"""Length over which the road rises out of the level [m]."""
_REMEMBERED = 4
"""Roads kept: thousands of rides of a sweep go over the same few."""


class Iso8608(Road):
    """A road of ISO 8608, by class."""

    kind: Literal["iso8608"] = "iso8608"
    """A road of ISO 8608."""
    road_class: Annotated[str, AfterValidator(known_class)] = "C"
    """Class A (very good) to H."""
    shortest_wave_m: float = Field(default=0.3, gt=0.0)
    """Waves shorter than this are left out: the tyre's footprint swallows them."""
    seed: int | None = Field(default=None, ge=0)
    """Of this road: the same seed gives the same road, in another run too. By default it comes from the
    seed of the run and the name of the road."""

    @override
    def own_name(self) -> str:
        return f"iso8608-{self.road_class}"

    @override
    def profile(self, way: Way) -> Profile:
        """Draw the road as far as the ride goes."""
        return _drawn(self, way)


@lru_cache(maxsize=_REMEMBERED)
def _drawn(road: Iso8608, way: Way) -> Profile:
    """Draw the road as far as a ride goes, from one piece fading into the next.

    Equation: xi = cos(r) xi_k + sin(r) xi_(k+1), r from 0 to pi/2 over half a piece; cos2 + sin2 = 1 keeps the
    spectrum
    """
    seed = [way.seed, crc32(road.name.encode())] if road.seed is None else [road.seed]
    half = math.ceil(0.5 * _KNOTS_A_WAVE * _PIECE / road.shortest_wave_m)
    spacing = 0.5 * _PIECE / half
    knots = math.ceil(way.distance / spacing) + END_REACH
    fade = 0.5 * np.pi * np.arange(half) / half
    piece, parts = _piece(road, [*seed, 0], 2 * half), []
    for number in range(1, knots // half + 2):
        following = _piece(road, [*seed, number], 2 * half)
        parts.append(np.cos(fade) * piece[half:] + np.sin(fade) * following[:half])
        piece = following
    heights = np.concatenate(parts)[: knots + 1]
    rising = spacing * np.arange(min(math.ceil(_RUN_IN / spacing), knots + 1)) / _RUN_IN
    heights[: rising.size] *= rising * rising * (3.0 - 2.0 * rising)
    return through(heights, spacing)


def _piece(road: Iso8608, seed: list[int], knots: int) -> Array:
    """Draw (knots,) heights of one piece [m]."""
    band = (_BAND_FROM, 1.0 / road.shortest_wave_m)
    heights = profile(classes()[road.road_class], _PIECE, np.random.default_rng(seed), band)
    return heights(_PIECE / knots * np.arange(knots, dtype=np.float64))[0]


ROADS = (Iso8608,)
