"""Forces outside the library, each a formula of the motion, in parallel with the damper of the virtual rig.

None of the eighteen effects that a verdict names has their shape (`rubber` is a `second_branch`, which none names):
position enters the damping, or friction, or a force that does not rise with x, or the force changes from one cycle to
the next without a temperature. Shapes that an effect of the library nearly has are left out, since to name that effect
is no mistake: x^3 is nearly an end stop that begins early, v^3 a quadratic orifice, a chamber that fills late a lash.
At 10 % of the peak, in two tests of two frequencies each, the effect that follows best leaves 77 to 100 % of the
visible gap of each form.

Each shape has a size of about one, and is scaled to the size that was drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import drive_row, effective_voltage
from pzd.record import Array


@dataclass(frozen=True)
class Envelope:
    """Operating envelope of a campaign."""

    stroke: float
    """Largest displacement X [m]."""
    speed: float
    """Largest speed V [m/s]."""


Shape = Callable[[Motion, Envelope, Mapping[str, float]], Array]


@dataclass(frozen=True)
class Form:
    """One force outside the library."""

    shape: Shape
    """(n,) force of about one."""
    ranges: Mapping[str, tuple[float, float]]
    """Its parameters, each drawn evenly between two limits."""
    named_shapes: tuple[str, ...]
    """Shapes among the hypotheses of `pzd/diagnosis/hypotheses/` that describe it rightly."""


def position_damping(motion: Motion, envelope: Envelope, values: Mapping[str, float]) -> Array:
    """Compute damping that rises towards both ends of the stroke (a grooved cylinder).

    Equation: F = (|x|/X)^p v/V
    """
    return np.asarray(np.abs(motion.displacement / envelope.stroke) ** values["p"] * motion.velocity / envelope.speed)


def tapered_rod(motion: Motion, envelope: Envelope, values: Mapping[str, float]) -> Array:
    """Compute damping that rises from one end of the stroke to the other (a metering rod).

    Equation: F = s (x/X) (v/V)
    """
    return np.asarray(values["side"] * motion.displacement * motion.velocity / (envelope.stroke * envelope.speed))


def covered_port(motion: Motion, envelope: Envelope, values: Mapping[str, float]) -> Array:
    """Compute a jump of the friction where the piston covers a port, on one side.

    Equation: F = tanh(v / (0.05 V)) (1 + tanh((x - x_p) / (0.02 X))) / 2
    """
    beyond = 0.5 + 0.5 * np.tanh((motion.displacement / envelope.stroke - values["x_p"]) / 0.02)
    return np.asarray(np.tanh(motion.velocity / (0.05 * envelope.speed)) * beyond)


def ripple(motion: Motion, envelope: Envelope, values: Mapping[str, float]) -> Array:
    """Compute a force that is periodic in the position (cogging, a thread).

    Equation: F = sin(2 pi x / (lambda X))
    """
    return np.asarray(np.sin(2.0 * np.pi * motion.displacement / (values["length"] * envelope.stroke)))


def even_spring(motion: Motion, envelope: Envelope, values: Mapping[str, float]) -> Array:
    """Compute a spring that pushes the same way on both sides of the middle (a gas charge at high compression).

    Equation: F = s (x/X)^2
    """
    return np.asarray(values["side"] * (motion.displacement / envelope.stroke) ** 2)


def tight_spot(motion: Motion, envelope: Envelope, values: Mapping[str, float]) -> Array:
    """Compute friction at one place of the stroke (a dent in the tube).

    Equation: F = tanh(v / (0.05 V)) exp(-((x - x_d) / b)^2)
    """
    far = (motion.displacement / envelope.stroke - values["x_d"]) / values["width"]
    return np.asarray(np.tanh(motion.velocity / (0.05 * envelope.speed)) * np.exp(-(far**2)))


def rubber(motion: Motion, envelope: Envelope, values: Mapping[str, float]) -> Array:
    """Compute the force of a rubber seat that follows the rod a good part of the stroke before it slips.

    Equation: F = (x - P_r[x]) / r, P the play operator of half-width r
    """
    half_width = values["r"] * envelope.stroke
    play = drive_row({"piezo_hysteresis": {"r": half_width}})
    follows = effective_voltage(np.ascontiguousarray(motion.displacement), np.diff(motion.time), play)
    return np.asarray((motion.displacement - follows) / half_width)


def aeration(motion: Motion, envelope: Envelope, values: Mapping[str, float]) -> Array:
    """Compute damping that fades during a test, as air mixes with the oil.

    Equation: F = -(1 - exp(-t/tau)) v/V from the beginning of the recording
    """
    mixed = -np.expm1(-np.maximum(motion.time, 0.0) / values["tau_s"])
    return np.asarray(-mixed * motion.velocity / envelope.speed)


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
