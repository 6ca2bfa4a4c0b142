"""The laws that a verdict names, written anew from their sources, and how each is drawn for a case.

Nothing is taken from `pzd.damper`, which these laws judge: names and parameters alone are those of `pzd effects`. A law
that the kernel integrates is a compiled function of numbers; drive, material and sensor act on whole channels.

Sources: Dixon 2007, The Shock Absorber Handbook, unless a law names another one
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.random import Generator

from pzd.compiled import compiled
from pzd.record import Array

# --- What a law is ---


@dataclass(frozen=True)
class Scale:
    """Largest values over the tests of a case, in proportion to which the parameters of a law are drawn."""

    force: float
    """Of the baseline damper [N]."""
    friction: float
    """Largest T0 over the range of the control signal [N]."""
    speed: float
    """Of the piston [m/s]."""
    stroke: float
    """From the middle of the stroke [m]."""
    acceleration: float
    """Of the piston [m/s2]; a high percentile, as corners of a triangle have no acceleration of their own."""
    damping: float
    """C in the middle of the range of the control signal [N s/m]."""
    voltage: float
    """Range of the control signal [V]."""


Draw = Callable[[Generator, Scale, float], dict[str, float]]
"""Parameters of a law of some strength, of which 1 changes the force by about as much as the baseline damper has."""


@dataclass(frozen=True)
class Law:
    """A law that a case can hide; its equations precede its declaration."""

    name: str
    draw: Draw
    place: Literal["drive", "material", "damper", "sensor"] = "damper"
    """Where it acts: `damper` within the integration, the others before or after it."""
    described_by: tuple[str, ...] = ()
    """Effects of the library with which a verdict is right about a law that the library has not."""


def by_name(*laws: Law) -> Mapping[str, Law]:
    """Return the laws by their names, in the order given."""
    return {law.name: law for law in laws}


def either_side(rng: Generator) -> float:
    """Draw 1 or -1."""
    return float(rng.choice([-1.0, 1.0]))


# --- Drive: what of the control signal acts on the damper ---


def lagged_signal(signal: Array, step: float, tau: float) -> Array:
    """Return what the valve has of a control signal that it answers late.

    Equation: tau dUe/dt + Ue = U, the signal linear between its samples          Source: first-order lag

    Parameters
    ----------
    signal : (n,) control signal [V]
    step : between samples [s]
    tau : time constant [s]
    """
    from scipy.signal import lfilter

    # the exact answer to a ramp from one sample to the next: a first-order hold
    decay = np.exp(-step / tau)
    share = tau / step * (1.0 - decay)
    effective, _ = lfilter([1.0 - share, share - decay], [1.0, -decay], signal, zi=[signal[0] * share])
    return np.asarray(effective)


VALVE_LAG = Law("valve_lag", lambda rng, scale, strength: {"tau": min(0.1, 0.1 * strength)}, "drive")


def signal_with_play(signal: Array, r: float) -> Array:
    """Return what a stack with hysteresis follows of the control signal, from the middle of its play on.

    Equation: Ue = max(U - r, min(U + r, Ue))     Source: Brokate and Sprekels 1996, Hysteresis and Phase Transitions

    >>> signal_with_play(np.array([0.0, 3.0, 2.0, -2.0]), 1.0)
    array([ 0.,  2.,  2., -1.])
    """
    effective = np.empty_like(signal)
    now = float(signal[0])
    for i, demanded in enumerate(signal):
        now = min(max(now, demanded - r), demanded + r)
        effective[i] = now
    return effective


PIEZO_HYSTERESIS = Law(
    "piezo_hysteresis", lambda rng, scale, strength: {"r": min(0.2, strength) * scale.voltage}, "drive"
)

# --- Material: T0 and C in warm oil ---


def drift_factor(temperature: Array, reference: float, beta: float) -> Array:
    """Return the factor on T0 or C at (n,) temperatures [degC].

    Equation: exp(-beta (T - T_ref))                Source: Reynolds 1886, Phil. Trans. R. Soc. 177
    """
    return np.asarray(np.exp(-beta * (temperature - reference)))


def _draw_temperature_drift(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    beta = min(0.06, strength / 10.0)  # the strength is the share that is lost over 10 K
    return {"beta_T0": beta * float(rng.uniform(0.6, 1.4)), "beta_C": beta}


TEMPERATURE_DRIFT = Law("temperature_drift", _draw_temperature_drift, "material")

# --- Stroke: what of the deflection loads the oil spring ---


@compiled
def dead_zone(deflection: float, delta: float) -> float:
    """Return what free play of whole width delta leaves of a deflection [m].

    Equation: F = k dz(x - y)                       Source: Slotine and Li 1991, Applied Nonlinear Control
    """
    half = 0.5 * delta
    if deflection > half:
        return deflection - half
    if deflection < -half:
        return deflection + half
    return 0.0


LASH = Law("lash", lambda rng, scale, strength: {"delta": strength * 0.3 * scale.stroke})


@compiled
def squeezed(load: float, length: float, half: float) -> float:
    """Return by how much [m] a cushion of some length [m] gives under a load >= 0, as an extension of the spring [m].

    Equation: d s / (s + s_d): p V = const of a gas at a static force p A = k s_d               Source: Boyle 1662
    """
    return length * load / (load + half)


@compiled
def spring_behind_cushion(deflection: float, length: float, half: float) -> float:
    """Return the extension s [m] of the spring where spring and cushion together are deflected by e >= 0 [m].

    Method: Newton's, from the side on which it cannot overshoot: s + squeezed(s) is concave
    """
    s = deflection * half / (half + length)
    for _ in range(60):
        off = s + squeezed(s, length, half) - deflection
        step = off / (1.0 + length * half / (s + half) ** 2)
        s -= step
        if abs(step) <= 1e-13 * deflection:
            break
    return s


@compiled
def spring_behind_pocket(deflection: float, k: float, d_c: float, F_c: float) -> float:
    """Return what a pocket of gas in one chamber leaves of a deflection [m]: in rebound for d_c > 0.

    Equation: x - y = e + d_c F / (F + F_c) on the side of the pocket
    Source: Boyle's law; late filling as by Duym, Stiens and Reybrouck 1997, Vehicle System Dynamics 27
    """
    if d_c > 0.0 and deflection > 0.0:
        return spring_behind_cushion(deflection, d_c, F_c / k)
    if d_c < 0.0 and deflection < 0.0:
        return -spring_behind_cushion(-deflection, -d_c, F_c / k)
    return deflection


def _draw_cavitation(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    pressure = float(np.exp(rng.uniform(np.log(0.2), np.log(1.0)))) * scale.force
    return {"d_c": either_side(rng) * strength * 0.3 * scale.stroke, "F_c": pressure}


CAVITATION = Law("cavitation", _draw_cavitation)


@compiled
def spring_behind_mount(deflection: float, k: float, d_f: float, F_f: float) -> float:
    """Return what a mount that hardens to either side leaves of a deflection [m].

    Equation: x - y = e + d_f F / (|F| + F_f)       Source: Mindlin 1945, Bell System Technical Journal 24
    """
    s = spring_behind_cushion(abs(deflection), d_f, F_f / k)
    return s if deflection > 0.0 else -s


def _draw_frame_compliance(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    half = float(np.exp(rng.uniform(np.log(0.2), np.log(1.0)))) * scale.force
    return {"d_f": strength * 0.3 * scale.stroke, "F_f": half}


FRAME_COMPLIANCE = Law("frame_compliance", _draw_frame_compliance)

# --- Flow: the force against a flow speed w ---


@compiled
def direction_factor(rebound: bool, alpha: float) -> float:
    """Return the factor on T0 and C where ports differ between the two directions of flow.

    Equation: 1 + alpha sign(F)
    """
    return 1.0 + alpha if rebound else 1.0 - alpha


ASYMMETRY = Law("asymmetry", lambda rng, scale, strength: {"alpha": either_side(rng) * min(0.7, strength)})


@compiled
def shim_factor(rebound: bool, alpha_C: float) -> float:
    """Return the factor on C alone where shims differ between the two directions of flow.

    Equation: 1 + alpha_C sign(F)
    """
    return 1.0 + alpha_C if rebound else 1.0 - alpha_C


VISCOUS_ASYMMETRY = Law(
    "viscous_asymmetry", lambda rng, scale, strength: {"alpha_C": either_side(rng) * min(0.7, strength)}
)


@compiled
def orifice_force(flow: float, q: float) -> float:
    """Return the force [N] of turbulent flow through a sharp orifice at a flow speed >= 0 [m/s].

    Equation: dp = rho Q^2 / (2 Cd^2 A^2), so F = q w^2             Source: Merritt 1967, Hydraulic Control Systems
    """
    return q * flow * flow


ORIFICE_QUADRATIC = Law(
    "orifice_quadratic", lambda rng, scale, strength: {"q": strength * scale.force / scale.speed**2}
)


@compiled
def yield_force(flow: float, friction: float, w_s: float) -> float:
    """Return the force [N] of a yield that builds up over a flow speed > 0 [m/s], as in magneto-rheological fluids.

    Equation: T0 tanh(w/w_s)                        Source: Kwok et al. 2006, J. Sound Vib. 296
    """
    return friction * math.tanh(flow / w_s) if w_s > 0.0 else friction


ROUNDED_YIELD = Law("rounded_yield", lambda rng, scale, strength: {"w_s": min(0.5, strength) * scale.speed})

THINNING_REFERENCE = 0.3
"""Flow speed at which the oil takes the force C w whatever n [m/s]; part of the law's definition in `pzd effects`."""


@compiled
def viscous_force(flow: float, damping: float, n: float) -> float:
    """Return the force [N] of an oil that thins under shear, at a flow speed >= 0 [m/s].

    Equation: C w_r (w/w_r)^n       Source: Ostwald and de Waele; Bird, Stewart and Lightfoot 2002, Transport Phenomena
    """
    return damping * flow if n == 1.0 else damping * THINNING_REFERENCE * (flow / THINNING_REFERENCE) ** n


SHEAR_THINNING = Law("shear_thinning", lambda rng, scale, strength: {"n": max(0.3, 1.0 - strength)})


@compiled
def relief_opening(F_r: float, friction: float) -> float:
    """Return the force [N] at which a blow-off valve opens.

    Equation: b = max(F_r, T0)
    """
    return max(F_r, friction)


@compiled
def relief_flow(excess: float, C_r: float) -> float:
    """Return the flow speed [m/s] through an open blow-off valve at a force so far above its opening [N].

    Equation: F = b + C_r (w - w_b)
    """
    return excess / C_r


def _draw_relief_valve(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    # Below the friction it would be open always, and C_r another C.
    opens = scale.friction + float(rng.uniform(0.2, 0.8)) * max(scale.force - scale.friction, 0.0)
    return {"F_r": opens, "C_r": scale.damping / (1.0 + 10.0 * strength)}


RELIEF_VALVE = Law("relief_valve", _draw_relief_valve)

# --- Parallel: forces beside the oil spring, x from the middle of the stroke ---


@compiled
def gas_spring_force(x: float, k_g: float) -> float:
    """Return the force [N] of a gas charge, linear about the middle of the stroke.

    Equation: F = k_g x
    """
    return k_g * x


GAS_SPRING = Law("gas_spring", lambda rng, scale, strength: {"k_g": strength * scale.force / scale.stroke})


@compiled
def preload_force(F_0: float) -> float:
    """Return a constant force [N]: the gas pressure on the rod, or a load cell with an offset.

    Equation: F = F_0
    """
    return F_0


PRELOAD_OFFSET = Law("preload_offset", lambda rng, scale, strength: {"F_0": either_side(rng) * strength * scale.force})


@compiled
def inertia_force(acceleration: float, m: float) -> float:
    """Return the force [N] that accelerates the oil in a duct, or a mass that moves with the rod.

    Equation: F = m a                               Source: Swift et al. 2013, Vehicle System Dynamics 51(11)
    """
    return m * acceleration


FLUID_INERTIA = Law("fluid_inertia", lambda rng, scale, strength: {"m": strength * scale.force / scale.acceleration})


@compiled
def stribeck_force(speed: float, F_s: float, v_s: float) -> float:
    """Return the friction [N] of a seal, which falls as the lip floats up with the speed of the rod [m/s].

    Equation: F = F_s exp(-(v/v_s)^2) sign(v)
    Source: Armstrong-Helouvry, Dupont and Canudas de Wit 1994, Automatica 30
    """
    size = F_s * math.exp(-((speed / v_s) ** 2))
    return size if speed > 0.0 else -size if speed < 0.0 else 0.0


def _draw_stribeck_friction(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    return {"F_s": strength * scale.force, "v_s": float(rng.uniform(0.05, 0.3)) * scale.speed}


STRIBECK_FRICTION = Law("stribeck_friction", _draw_stribeck_friction)


@compiled
def end_stop_force(x: float, k_e: float, x_e: float) -> float:
    """Return the force [N] of progressive stops near both ends of the stroke.

    Equation: F = k_e (|x| - x_e)^2 sign(x) beyond x_e
    """
    if x > x_e:
        return k_e * (x - x_e) ** 2
    if x < -x_e:
        return -k_e * (-x - x_e) ** 2
    return 0.0


def _draw_end_stop(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    begins = float(rng.uniform(0.5, 0.85)) * scale.stroke
    return {"k_e": strength * scale.force / (scale.stroke - begins) ** 2, "x_e": begins}


END_STOP = Law("end_stop", _draw_end_stop)

GAS_EXPONENT = 1.3
"""Of the polytropic compression: between 1, isothermal, and 1.4, adiabatic."""


@compiled
def accumulator_force(x: float, F_g: float, L: float) -> float:
    """Return the force [N] of a gas that the rod compresses as it moves in, x from the middle of the stroke [m].

    Equation: p V^1.3 = const, so F = -F_g (L / (L + x))^1.3        Source: polytropic gas; Dixon 2007
    """
    return float(-F_g * (L / (L + x)) ** GAS_EXPONENT)


def _draw_accumulator(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    return {"F_g": strength * scale.force, "L": float(rng.uniform(1.5, 6.0)) * scale.stroke}


ACCUMULATOR = Law("accumulator", _draw_accumulator)

# --- Sensor: what of the force is recorded ---


def delayed_force(time: Array, force: Array, tau: float) -> Array:
    """Return the (n,) force a time tau [s] earlier, as force and displacement are sampled at different instants.

    Equation: F recorded at t - tau                 Source: dead time of a measuring chain
    """
    return np.asarray(np.interp(time - tau, time, force))


def _draw_sensor_delay(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    return {"tau": either_side(rng) * min(0.015, 0.05 * strength)}  # either channel may be the late one


SENSOR_DELAY = Law("sensor_delay", _draw_sensor_delay, "sensor")

# In the order in which cases hide them, which a seed depends on.
LAWS = by_name(
    *(ASYMMETRY, END_STOP, FLUID_INERTIA, GAS_SPRING, LASH, ORIFICE_QUADRATIC, PIEZO_HYSTERESIS, PRELOAD_OFFSET),
    *(RELIEF_VALVE, ROUNDED_YIELD, SENSOR_DELAY, SHEAR_THINNING, STRIBECK_FRICTION, TEMPERATURE_DRIFT, VALVE_LAG),
    *(ACCUMULATOR, CAVITATION, FRAME_COMPLIANCE, VISCOUS_ASYMMETRY),
)
"""Every law that a verdict names."""
