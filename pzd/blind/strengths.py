"""How strong an effect may be: one number between nothing and the most, and what else is drawn beside it.

What the second parameter of an effect says (where, how fast) is drawn so that the effect acts inside
what the campaign reaches; the strength is found afterwards from the size that the effect shall have.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pzd.damper.effect import Scales

Values = dict[str, float]
Strength = Callable[[float], Values]
"""Parameters at a strength between 0 (next to nothing) and 1 (the most)."""
Rule = Callable[[np.random.Generator, Scales], Strength]


def _even(draw: np.random.Generator, low: float, high: float) -> float:
    return float(draw.uniform(low, high))


def _ratio(draw: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(draw.uniform(np.log(low), np.log(high))))


def _side(draw: np.random.Generator) -> float:
    return float(draw.choice([-1.0, 1.0]))


def _simple(name: str, most: Callable[[Scales], float], *, either: bool = False) -> Rule:
    """One parameter that grows from 0, to either side where the physics has no preference."""

    def rule(draw: np.random.Generator, scales: Scales) -> Strength:
        end = most(scales) * (_side(draw) if either else 1.0)
        return lambda s: {name: end * s}

    return rule


def _temperature_drift(draw: np.random.Generator, scales: Scales) -> Strength:
    ratio = _even(draw, 0.5, 1.5)
    return lambda s: {"beta_T0": 0.06 * ratio * s, "beta_C": 0.06 * s}


def _shear_thinning(draw: np.random.Generator, scales: Scales) -> Strength:
    return lambda s: {"n": 1.0 - 0.6 * s}


def _relief_valve(draw: np.random.Generator, scales: Scales) -> Strength:
    slope = _even(draw, 0.2, 0.6) * scales.damping
    return lambda s: {"F_r": scales.force * (1.0 - 0.95 * s), "C_r": slope}


def _stribeck(draw: np.random.Generator, scales: Scales) -> Strength:
    speed = _ratio(draw, 0.03, 0.3) * scales.speed
    return lambda s: {"F_s": 0.5 * scales.force * s, "v_s": speed}


def _end_stop(draw: np.random.Generator, scales: Scales) -> Strength:
    begins = _even(draw, 0.5, 0.85) * scales.stroke
    stiffness = scales.force / (scales.stroke - begins) ** 2
    return lambda s: {"k_e": stiffness * s, "x_e": begins}


RULES: dict[str, Rule] = {
    "valve_lag": _simple("tau", lambda _: 0.05),
    "piezo_hysteresis": _simple("r", lambda s: 0.15 * s.voltage),
    "temperature_drift": _temperature_drift,
    "lash": _simple("delta", lambda s: 0.2 * s.stroke),
    "orifice_quadratic": _simple("q", lambda s: s.force / s.speed**2),
    "shear_thinning": _shear_thinning,
    "relief_valve": _relief_valve,
    "rounded_yield": _simple("w_s", lambda s: 0.3 * s.speed),
    "asymmetry": _simple("alpha", lambda _: 0.5, either=True),
    "gas_spring": _simple("k_g", lambda s: 0.5 * s.force / s.stroke),
    "preload_offset": _simple("F_0", lambda s: 0.5 * s.force, either=True),
    "fluid_inertia": _simple("m", lambda s: 0.5 * s.force / s.acceleration),
    "stribeck_friction": _stribeck,
    "end_stop": _end_stop,
    "sensor_delay": _simple("tau", lambda _: 0.02, either=True),
}
"""How each effect of the library is drawn."""

_HALVINGS = 14


def of_size(strength: Strength, size_at: Callable[[Values], float], wanted: float) -> Values:
    """The parameters at which an effect has a size, or its most where that is smaller.

    Parameters
    ----------
    strength : the parameters at each strength
    size_at : how much an effect with these parameters changes the force; it rises with the strength
    wanted : the size
    """
    low, high = 0.0, 1.0
    if size_at(strength(high)) <= wanted:
        return strength(high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if size_at(strength(middle)) > wanted else (middle, high)
    return strength(high)
