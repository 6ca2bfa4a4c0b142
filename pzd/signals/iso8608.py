"""Road roughness by ISO 8608: classes, spectral density of the height, and random profiles.

The classes stand in `iso8608_classes.csv`: the spectral density at the reference wavenumber
n0 = 0.1 cycles/m is 16e-6 4^k m3 for class k = A..H (the geometric mean, not the upper limit,
which is twice that); A-D are sourced, E-H extrapolated by the same law.
"""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np

from pzd.record import Array
from pzd.signals.harmonics import FourierSum

REFERENCE_WAVENUMBER = 0.1
"""n0 [cycles/m]; not the Omega0 = 1 rad/m of other tables, at which the density is 16 times smaller."""
WAVINESS = 2.0
"""Exponent of the spectrum: 2 gives a constant density of the slope."""


@cache
def classes() -> dict[str, float]:
    """Return the spectral density Gd(n0) [m3] of every road class: the geometric mean of its range (ISO 8608:2016)."""
    with (Path(__file__).parent / "iso8608_classes.csv").open(encoding="utf-8", newline="") as file:
        return {row["class"]: float(row["Gd_n0_geomean_m3"]) for row in csv.DictReader(file)}


def known_class(name: str) -> str:
    """Return the name of a road class.

    Raises
    ------
    ValueError : when there is no such class
    """
    if name not in classes():
        raise ValueError(f"a road class is one of {', '.join(classes())} (got {name})")
    return name


def height_density(wavenumber: Array, density: float, waviness: float = WAVINESS) -> Array:
    """Compute the one-sided spectral density of the height of a road.

    Equation: Gd(n) = Gd(n0) (n / n0)^-w                        Source: ISO 8608:2016

    Parameters
    ----------
    wavenumber : (n,) n [cycles/m]
    density : Gd(n0) [m3], see `classes`
    waviness : w

    Returns
    -------
    (n,) [m3]

    Examples
    --------
    >>> height_density(np.array([0.1, 1.0]), classes()["A"]).round(8).tolist()
    [1.6e-05, 1.6e-07]
    """
    return np.asarray(density * (wavenumber / REFERENCE_WAVENUMBER) ** -waviness)


def profile(
    density: float,
    length: float,
    draw: np.random.Generator,
    band: tuple[float, float] = (0.01, 10.0),
    waviness: float = WAVINESS,
) -> FourierSum:
    """Draw a road from its spectrum: height over distance, periodic over its length.

    Equation: xi(s) = sum sqrt(2 Gd(n_i) dn) cos(2 pi n_i s + phi_i), n_i = i dn, dn = 1 / length
              Source: definition of the one-sided density; phi_i uniform

    Parameters
    ----------
    density : Gd(n0) [m3], e.g. ``classes()["C"]``
    length : after which the road repeats [m]
    draw : random generator of the phases; the phase of a line depends on its number alone
    band : lowest and highest wavenumber [cycles/m], both included; ISO 8608 covers 0.011 to 2.83
    waviness : exponent of the spectrum

    Returns
    -------
    the road, with exact slope and curvature

    Raises
    ------
    ValueError : when no line lies in the band
    """
    first, last = int(np.ceil(band[0] * length - 1e-9)), int(np.floor(band[1] * length + 1e-9))
    first = max(first, 1)
    if last < first:
        raise ValueError(f"a road of {length:g} m has no wavenumber between {band[0]:g} and {band[1]:g} cycles/m")
    phases = draw.uniform(0.0, 2.0 * np.pi, last)[first - 1 :]
    wavenumbers = np.arange(first, last + 1) / length
    amplitudes = np.sqrt(2.0 * height_density(wavenumbers, density, waviness) / length)
    coefficients = np.zeros(last + 1, dtype=np.complex128)
    coefficients[first:] = amplitudes * np.exp(1j * phases)
    return FourierSum(length, coefficients)
