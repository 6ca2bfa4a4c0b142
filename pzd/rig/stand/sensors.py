"""What the sensors make of the truth: gain, offset, noise and resolution, each drawn by the record's name."""

from __future__ import annotations

import hashlib
import math

import numpy as np

from pzd.record import Array
from pzd.rig.stand.config import ChannelNoise
from pzd.signals.recursion import recursion


def draw_for(seed: int, *names: str) -> np.random.Generator:
    """Random numbers that depend on the seed and these names alone, whatever else is drawn.

    Parameters
    ----------
    seed : of the run
    names : e.g. the record and the channel
    """
    digests = [hashlib.blake2b(name.encode(), digest_size=8).digest() for name in names]
    key = tuple(int.from_bytes(digest, "little") for digest in digests)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def coloured(count: int, rho: float, draw: np.random.Generator) -> Array:
    """Stationary Gaussian noise of unit variance.

    Equation: e_i = rho e_(i-1) + sqrt(1 - rho^2) g_i, e_0 = g_0      Source: AR(1)

    Parameters
    ----------
    count : number of samples
    rho : correlation from one sample to the next
    draw : where the numbers come from

    Returns
    -------
    (count,)
    """
    innovations = draw.standard_normal(count)
    innovations[1:] *= math.sqrt(1.0 - rho**2)
    return recursion(rho, innovations)


def sensed(truth: Array, noise: ChannelNoise, resolution: float, draw: np.random.Generator) -> Array:
    """A channel with its noise, rounded to what it can show.

    Parameters
    ----------
    truth : (n,) what is there
    noise : size and colour of the noise
    resolution : smallest step; 0 for none
    draw : where the numbers come from

    Returns
    -------
    (n,) what is recorded
    """
    size = noise.absolute + noise.share_of_peak * float(np.max(np.abs(truth)))
    shown = truth + size * coloured(truth.size, noise.rho, draw) if size > 0.0 else truth
    return np.round(shown / resolution) * resolution if resolution > 0.0 else shown
