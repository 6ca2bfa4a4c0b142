"""The voltages at which records with moving voltage are fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.record import CONSTANT_SHARE, Array, Record
from pzd.schema.errors import ConfigError

DWELL_SHARE = 0.05
"""A level holds at least this share of the samples, in a band of 2 % of the voltage's scale."""


def nodes_of(
    moving: Sequence[Record], constant: Sequence[float], chosen: Sequence[float] | None, scale: float
) -> Array:
    """The nodes of the piecewise linear parameters, rising [V].

    The voltages of constant records always are nodes. The config may add others; where it does
    not and there are fewer than two, the levels that the voltage dwells on join them.

    Parameters
    ----------
    moving : the records with moving voltage
    constant : voltages of the constant records of the same setting and temperature
    chosen : `identify.nodes`, None where the config does not give any
    scale : the rig's voltage scale [V]

    Returns
    -------
    (m,) nodes

    Raises
    ------
    ConfigError : when two chosen nodes are closer than 2 % of the scale
    """
    apart = CONSTANT_SHARE * scale
    constant = _merged(constant, apart)
    if chosen is not None and np.any(np.diff(np.sort(chosen)) <= apart):
        raise ConfigError(f"identify.nodes: two nodes are closer than {apart:g}; leave one out (got {list(chosen)})")
    if chosen is None and len(constant) > 1:
        return np.sort(constant)
    voltage = np.concatenate([r.voltage for r in moving if r.voltage is not None])
    added = dwelled_levels(voltage, apart) if chosen is None else chosen
    return np.sort([*constant, *(v for v in added if all(abs(v - c) > apart for c in constant))])


def _merged(voltages: Sequence[float], apart: float) -> list[float]:
    """Voltages, those no further apart than that counting as the lowest of them: one voltage at two temperatures."""
    kept: list[float] = []
    for voltage in sorted(voltages):
        if not kept or voltage - kept[-1] > apart:
            kept.append(voltage)
    return kept


def dwelled_levels(voltage: Array, band: float) -> list[float]:
    """Levels on which a voltage dwells, its extremes where there are fewer than two.

    Parameters
    ----------
    voltage : (n,) voltage [V]
    band : width of the band that makes a level [V]

    Returns
    -------
    medians of the bands that hold most samples, most first
    """
    rest = np.sort(voltage)
    levels: list[float] = []
    while rest.size:
        held = np.searchsorted(rest, rest + band, side="right") - np.arange(rest.size)
        first = int(np.argmax(held))
        if held[first] < DWELL_SHARE * voltage.size:
            break
        levels.append(float(np.median(rest[first : first + held[first]])))
        rest = rest[np.abs(rest - levels[-1]) > 2.0 * band]
    if len(levels) < 2:
        extremes = [float(voltage.min()), float(voltage.max())]
        levels += [e for e in extremes if all(abs(e - level) > 2.0 * band for level in levels)]
    return levels


def weights(nodes: Array, voltage: Array) -> Array:
    """(n, m) share of each node in the parameters at each voltage, held beyond the outermost."""
    return np.stack([np.interp(voltage, nodes, unit) for unit in np.eye(nodes.size)], axis=-1)
