"""Forces that are not in the library, each a formula of the motion that stands beside the damper.

None of the fifteen effects that a verdict names has their shape (`rubber` is a `second_branch`, which none names):
position enters the damping, or friction, or a force that is no function rising with x, or the force changes from one
cycle to the next without a temperature.
(Shapes that an effect of the library nearly has, as x^3 is nearly an end stop that begins early, v^3 nearly
a quadratic orifice, and a chamber that fills late on one side nearly a lash, are left out: to name that
effect is no mistake.) At 10 % of the peak, in two tests of two frequencies each, the effect that follows
best leaves 77 to 100 % of the visible gap of each form.
Each gives a force of about one; it is scaled afterwards to its size.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import drive_row, effective_voltage
from pzd.record import Array


@dataclass(frozen=True)
class Reached:
    """How far and how fast the campaign goes."""

    stroke: float
    """Largest displacement X [m]."""
    speed: float
    """Largest speed V [m/s]."""


Shape = Callable[[Motion, Reached, Mapping[str, float]], Array]


@dataclass(frozen=True)
class Form:
    """One force outside the library."""

    shape: Shape
    """(n,) force of about one."""
    ranges: Mapping[str, tuple[float, float]]
    """Its parameters, each drawn evenly between two limits."""
    named_shapes: tuple[str, ...]
    """Names of the shapes in `pzd/diagnosis/hypotheses/shapes.py` that describe it rightly."""


def position_damping(motion: Motion, reached: Reached, values: Mapping[str, float]) -> Array:
    """Damping that rises towards both ends of the stroke (a grooved cylinder).

    Equation: F = (|x|/X)^p v/V
    """
    return np.asarray(np.abs(motion.displacement / reached.stroke) ** values["p"] * motion.velocity / reached.speed)


def tapered_rod(motion: Motion, reached: Reached, values: Mapping[str, float]) -> Array:
    """Damping that rises from one end of the stroke to the other (a metering rod).

    Equation: F = s (x/X) (v/V)
    """
    return np.asarray(values["side"] * motion.displacement * motion.velocity / (reached.stroke * reached.speed))


def covered_port(motion: Motion, reached: Reached, values: Mapping[str, float]) -> Array:
    """A jump of the friction where the piston covers a port, on one side.

    Equation: F = tanh(v / (0.05 V)) (1 + tanh((x - x_p) / (0.02 X))) / 2
    """
    beyond = 0.5 + 0.5 * np.tanh((motion.displacement / reached.stroke - values["x_p"]) / 0.02)
    return np.asarray(np.tanh(motion.velocity / (0.05 * reached.speed)) * beyond)


def ripple(motion: Motion, reached: Reached, values: Mapping[str, float]) -> Array:
    """A force that waves over the position (cogging, a thread).

    Equation: F = sin(2 pi x / (lambda X))
    """
    return np.asarray(np.sin(2.0 * np.pi * motion.displacement / (values["length"] * reached.stroke)))


def even_spring(motion: Motion, reached: Reached, values: Mapping[str, float]) -> Array:
    """A spring that pushes the same way on both sides of the middle (a gas charge at high compression).

    Equation: F = s (x/X)^2
    """
    return np.asarray(values["side"] * (motion.displacement / reached.stroke) ** 2)


def tight_spot(motion: Motion, reached: Reached, values: Mapping[str, float]) -> Array:
    """Friction at one place of the stroke (a dent in the tube).

    Equation: F = tanh(v / (0.05 V)) exp(-((x - x_d) / b)^2)
    """
    far = (motion.displacement / reached.stroke - values["x_d"]) / values["width"]
    return np.asarray(np.tanh(motion.velocity / (0.05 * reached.speed)) * np.exp(-(far**2)))


def rubber(motion: Motion, reached: Reached, values: Mapping[str, float]) -> Array:
    """A rubber seat that goes with the rod a good part of the stroke before it slips, whatever the speed.

    Equation: F = (x - P_r[x]) / r, P the play operator of half-width r
    """
    half_width = values["r"] * reached.stroke
    play = drive_row({"piezo_hysteresis": {"r": half_width}})
    follows = effective_voltage(np.ascontiguousarray(motion.displacement), np.diff(motion.time), play)
    return np.asarray((motion.displacement - follows) / half_width)


def aeration(motion: Motion, reached: Reached, values: Mapping[str, float]) -> Array:
    """Damping that fades while a test runs, as air mixes with the oil.

    Equation: F = -(1 - exp(-t/tau)) v/V from the beginning of the recording
    """
    mixed = -np.expm1(-np.maximum(motion.time, 0.0) / values["tau_s"])
    return np.asarray(-mixed * motion.velocity / reached.speed)


FORMS: Mapping[str, Form] = {
    "position_damping": Form(position_damping, {"p": (2.0, 4.0)}, ("|x| v", "x^2 v")),
    "tapered_rod": Form(tapered_rod, {"side": (-1.0, 1.0)}, ("x v",)),
    "covered_port": Form(covered_port, {"x_p": (-0.3, 0.3)}, ("x sign v",)),
    "ripple": Form(ripple, {"length": (0.3, 0.8)}, ("sin 2 pi x/lambda",)),
    "even_spring": Form(even_spring, {"side": (-1.0, 1.0)}, ("x^2",)),
    "tight_spot": Form(tight_spot, {"x_d": (-0.4, 0.4), "width": (0.1, 0.25)}, ("sign v about x_p",)),
    "rubber": Form(rubber, {"r": (0.2, 0.45)}, ("(x behind a play)/r",)),
    "aeration": Form(aeration, {"tau_s": (1.0, 4.0)}, ("(1 - exp(-t/tau)) v",)),
}
"""Every form by name."""
