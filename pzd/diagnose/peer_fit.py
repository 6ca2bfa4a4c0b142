"""The fit of a peer to tests at one voltage, and the line between its parameters from voltage to voltage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.diagnose.peer import Peer, PeerForm, ShapeParameter, StrokeMotion
from pzd.record import Array, Mask

DESCENTS = 3
"""How many of the best points of the grid are followed down."""
AT_LIMIT = 1e-3
"""A shape parameter this close to a limit, as a share of the way searched, stands at it."""


@dataclass(frozen=True, eq=False)
class FittedTest:
    """A test, and the samples of it that may be fitted."""

    motion: StrokeMotion
    force: Array
    """(n,) measured [N]."""
    fitted: Mask
    """(n,) which samples."""


@dataclass(frozen=True, eq=False)
class PeerFit:
    """A form of a peer at one voltage."""

    parameters: Array
    """(p,) in the order of `Peer.parameters`."""
    error: float
    """Sum of the squared residual over the samples fitted [N^2]."""
    status: str
    """`converged`, or what else the search came to."""


def fit_peer(peer: Peer, form: PeerForm, tests: Sequence[FittedTest]) -> PeerFit:
    """The peer with the least criterion (4) over some tests at one voltage.

    The coefficients are solved for at every shape; the shape goes down by least squares from the best points of a grid.

    Equation: min_s |F - Phi(s) a(s)|^2, a(s) = Phi(s)^+ F          Source: variable projection, Golub and Pereyra 1973

    Parameters
    ----------
    peer, form : what is fitted
    tests : at one voltage, one or more
    """
    from scipy.optimize import least_squares

    force = np.concatenate([test.force[test.fitted] for test in tests])
    scale = float(np.linalg.norm(force))

    def solved(shape: Array) -> tuple[Array, Array]:
        columns = np.concatenate([form.columns(test.motion, shape)[test.fitted] for test in tests])
        coefficients = np.linalg.lstsq(columns, force, rcond=None)[0]
        return coefficients, (force - columns @ coefficients) / scale

    def missed(searched: Array) -> Array:
        return solved(_shape(peer, searched))[1]

    starts = [_searched(peer, shape) for shape in peer.grid([test.motion for test in tests])]
    starts.sort(key=lambda start: float(np.sum(missed(start) ** 2)))
    low = _searched(peer, np.array([p.low for p in peer.shape]))
    high = _searched(peer, np.array([p.high for p in peer.shape]))
    found = [least_squares(missed, start, bounds=(low, high), x_scale="jac") for start in starts[:DESCENTS]]
    best = min(found, key=lambda one: float(one.cost))
    shape = _shape(peer, best.x)
    coefficients, residual = solved(shape)
    inside = np.minimum(best.x - low, high - best.x) > AT_LIMIT * (high - low)
    held = [p.name for p, free in zip(peer.shape, inside, strict=True) if not free]
    status = f"at its limit: {', '.join(held)}" if held else "converged" if best.status > 0 else "not converged"
    return PeerFit(np.concatenate([coefficients, shape]), float(residual @ residual) * scale**2, status)


def between_voltages(fits: Mapping[float, PeerFit], voltage: float) -> Array:
    """(p,) parameters at a voltage [V], linear between those fitted and held beyond them.

    Parameters
    ----------
    fits : one or more, by voltage [V]
    voltage : of the test that is predicted [V]
    """
    nodes = sorted(fits)
    values = np.array([fits[node].parameters for node in nodes])
    return np.array([np.interp(voltage, nodes, column) for column in values.T])


def best_form(fits: Mapping[PeerForm, Mapping[float, PeerFit]]) -> PeerForm:
    """The form that misses least of the tests fitted, all voltages together."""
    return min(fits, key=lambda form: sum(fit.error for fit in fits[form].values()))


def _searched(peer: Peer, shape: Array) -> Array:
    """(s,) shape parameters as they are searched."""
    return np.array([np.log(v) if p.logarithmic else v for p, v in zip(peer.shape, shape, strict=True)])


def _shape(peer: Peer, searched: Array) -> Array:
    """(s,) shape parameters, within their limits to rounding."""
    return np.array([_value(p, v) for p, v in zip(peer.shape, searched, strict=True)])


def _value(parameter: ShapeParameter, searched: float) -> float:
    value = float(np.exp(searched)) if parameter.logarithmic else searched
    return min(max(value, parameter.low), parameter.high)
