"""Laws outside the library, and how each is drawn for a case.

No name of a verdict is theirs. The effects that describe a law rightly are its `described_by`: a verdict that names
them is right, and `unexplained` is right for every law. The kernel integrates them together with those of `laws`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from pzd.blind.independent.laws import GAS_EXPONENT, Law, Scale, by_name
from pzd.compiled import compiled


def _log_uniform(rng: Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


# --- Nothing in the library describes these ---


@compiled
def bypass_factor(spool: float, bypass: float, bypass_force: float) -> float:
    """Return the factor on C of frequency-selective damping: a spool closes a bypass as its low-passed force builds up.

    Equation: tau ds/dt = F - s,  C (1 - a (1 - min(|s|/F_c, 1)))
    Source: principle of dampers with frequency-selective valves; Dixon 2007, The Shock Absorber Handbook, ch. 9
    """
    return 1.0 - bypass * (1.0 - min(abs(spool) / bypass_force, 1.0))


@compiled
def spool_rate(force: float, spool: float, bypass_lag: float) -> float:
    """Return the rate of the low-passed force of `bypass_factor` [N/s]."""
    return (force - spool) / bypass_lag


def _draw_frequency_dependent(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    return {
        "bypass": min(0.8, strength),
        "bypass_lag": float(rng.uniform(0.05, 0.3)),
        "bypass_force": float(rng.uniform(0.3, 0.8)) * scale.force,
    }


FREQUENCY_DEPENDENT = Law("frequency_dependent", _draw_frequency_dependent)


@compiled
def structure_factor(structure_now: float, structure: float) -> float:
    """Return the factor on T0 of a thixotropic fluid, whose structure is between 0 (broken) and 1 (built).

    Equation: dl/dt = (1 - l)/tau - beta |w| l,  T0 (1 + a l)
    Source: Moore 1959, Trans. Br. Ceram. Soc. 58; Barnes 1997, J. Non-Newtonian Fluid Mech. 70
    """
    return 1.0 + structure * structure_now


@compiled
def structure_rate(structure_now: float, flow: float, rebuilding: float, breakdown: float) -> float:
    """Return the rate of the structure of `structure_factor` [1/s] at a flow speed [m/s]."""
    return (1.0 - structure_now) / rebuilding - breakdown * abs(flow) * structure_now


def _draw_thixotropy(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    return {
        "structure": 4.0 * strength,
        "rebuilding": _log_uniform(rng, 0.1, 1.0),
        "breakdown": float(rng.uniform(3.0, 10.0)) / scale.stroke,
    }


THIXOTROPY = Law("thixotropy", _draw_thixotropy)


@compiled
def groove_factor(x: float, groove: float, groove_end: float, groove_run_out: float) -> float:
    """Return the factor on C where grooves in the tube let oil past the piston, x from the middle of the stroke [m].

    Equation: C (1 - a / (1 + exp((|x| - x_g)/b)))
    Source: position-sensitive damping by bypass grooves; Lee and Moon 2005, Vehicle System Dynamics 43(9)
    """
    beyond = min(50.0, (abs(x) - groove_end) / groove_run_out)  # exp(50) is as good as infinity, and no overflow
    return 1.0 - groove / (1.0 + math.exp(beyond))


def _draw_position_grooves(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    return {
        "groove": min(0.8, strength),
        "groove_end": float(rng.uniform(0.25, 0.65)) * scale.stroke,
        "groove_run_out": 0.04 * scale.stroke,
    }


POSITION_GROOVES = Law("position_grooves", _draw_position_grooves)

MOUNT_STOPS = 1e-3
"""Time in which a sliding mount comes to rest [s]."""


@compiled
def mount_slips(load: float, slipping: bool, mount_holds: float, mount_slides: float) -> bool:
    """Return whether the lower mount slips in its seat under the load that the spring of the seat leaves to friction.

    Equation: at rest while |F - k_f u| <= F_s, then c_f du/dt = F - k_f u - F_k sign(F - k_f u) until
    |F - k_f u| <= F_k
    Source: Coulomb friction with a higher friction at rest; Armstrong-Helouvry et al. 1994, Automatica 30
    """
    return abs(load) > (mount_slides if slipping else mount_holds)


@compiled
def slip_rate(load: float, mount_stiffness: float, mount_slides: float) -> float:
    """Return the speed of the sliding mount of `mount_slips` [m/s]."""
    over = max(abs(load) - mount_slides, 0.0)
    return math.copysign(over / (mount_stiffness * MOUNT_STOPS), load)


def _draw_frame_stick_slip(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    holds = float(rng.uniform(0.4, 0.7)) * scale.force
    stiffness = scale.force / (strength * 0.2 * scale.stroke)  # it slides by some of a twentieth of the stroke
    return {"mount_stiffness": stiffness, "mount_holds": holds, "mount_slides": float(rng.uniform(0.4, 0.8)) * holds}


FRAME_STICK_SLIP = Law("frame_stick_slip", _draw_frame_stick_slip)


@compiled
def bushing_force(x: float, relaxed: float, bushing_stiffness: float) -> float:
    """Return the force [N] of a rubber bushing beside the damper, of whose extension so much has relaxed [m].

    Equation: F = k_z (x - z),  c_z dz/dt = F       Source: standard linear solid; Zener 1948
    """
    return bushing_stiffness * (x - relaxed)


@compiled
def relaxation_rate(x: float, relaxed: float, bushing_time: float) -> float:
    """Return the rate at which the bushing of `bushing_force` relaxes [m/s]."""
    return (x - relaxed) / bushing_time


def _draw_viscoelastic_mount(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    stiffness = strength * scale.force / scale.stroke
    return {"bushing_stiffness": stiffness, "bushing_time": _log_uniform(rng, 0.02, 0.2)}


VISCOELASTIC_MOUNT = Law("viscoelastic_mount", _draw_viscoelastic_mount)


@compiled
def aeration_factor(time: float, fade: float, fade_time: float) -> float:
    """Return the factor on C of an oil that air mixes with since the beginning of the recording [s].

    The temperature does not change with it.

    Equation: C (1 - a (1 - exp(-t/tau)))           Source: Duym, Stiens and Reybrouck 1997, Vehicle System Dynamics 27
    """
    return 1.0 - fade * (1.0 - math.exp(-max(time, 0.0) / fade_time))


def _draw_aeration(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    return {"fade": min(0.7, strength), "fade_time": float(rng.uniform(1.0, 4.0))}


AERATION = Law("aeration", _draw_aeration)

# --- Look-alikes, which an effect of the library describes rightly ---


@compiled
def blow_off_flow(
    force: float, first_force: float, first_slope: float, second_force: float, second_slope: float
) -> float:
    """Return the flow speed [m/s] that a two-stage blow-off valve adds at a force above its first opening [N].

    At the second force it is fully open; beyond, its seat throttles.

    Equation: F = F_1 + C_1 (w - w_1) beyond F_1, and F_2 + C_2 (w - w_2) beyond F_2, C_1 < C < C_2
    Source: digressive-progressive valves; Dixon 2007, The Shock Absorber Handbook, ch. 6
    """
    if force <= second_force:
        return (force - first_force) / first_slope
    return (second_force - first_force) / first_slope + (force - second_force) / second_slope


def _draw_two_stage_blow_off(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    above = max(scale.force - scale.friction, 0.0)
    first = scale.friction + float(rng.uniform(0.2, 0.6)) * above
    return {
        "first_force": first,
        "first_slope": scale.damping / (1.0 + 20.0 * strength),
        "second_force": first + float(rng.uniform(0.1, 0.2)) * above,
        "second_slope": float(rng.uniform(1.5, 3.0)) * scale.damping,
    }


TWO_STAGE_BLOW_OFF = Law(
    "two_stage_blow_off", _draw_two_stage_blow_off, described_by=("relief_valve", "orifice_quadratic")
)


@compiled
def late_extension(deflection: float, gap: float) -> float:
    """Return what a chamber that fills late on one side leaves of a deflection [m] behind a reversal.

    Equation: F = k dz(x - y), a dead zone from 0 to delta         Source: Duym, Stiens and Reybrouck 1997, VSD 27
    """
    if deflection > gap:
        return deflection - gap
    return min(deflection, 0.0)


LATE_FILLING = Law(
    "late_filling",
    lambda rng, scale, strength: {"gap": strength * 0.3 * scale.stroke},
    described_by=("lash", "cavitation"),
)


@compiled
def cubic_force(x: float, cubic: float) -> float:
    """Return the force [N] of a spring that hardens with the cube of the extension from the middle [m].

    Equation: F = k_3 x^3                           Source: Duffing 1918
    """
    return cubic * x**3


CUBIC_SPRING = Law(
    "cubic_spring",
    lambda rng, scale, strength: {"cubic": strength * scale.force / scale.stroke**3},
    described_by=("end_stop", "gas_spring"),
)


@compiled
def duct_force(flow: float, duct: float) -> float:
    """Return the force [N] of turbulent flow in a smooth duct at a flow speed >= 0 [m/s].

    Equation: F = q w^(7/4)                         Source: Blasius 1913, friction factor 0.316 Re^(-1/4)
    """
    return float(duct * flow**1.75)


SMOOTH_PIPE = Law(
    "smooth_pipe",
    lambda rng, scale, strength: {"duct": strength * scale.force / scale.speed**1.75},
    described_by=("orifice_quadratic",),
)


@compiled
def gas_charge_force(x: float, charge: float, column: float) -> float:
    """Return the force [N] of a polytropic gas charge, which hardens towards compression, x from the middle [m].

    Equation: F = F_g (1 - (1 + x/L)^-1.3)          Source: polytropic gas law; Dixon 2007
    """
    return float(charge * (1.0 - (1.0 + x / column) ** -GAS_EXPONENT))


def _draw_polytropic_gas(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    length = float(rng.uniform(2.0, 8.0)) * scale.stroke
    return {"charge": strength * scale.force * length / (GAS_EXPONENT * scale.stroke), "column": length}


POLYTROPIC_GAS = Law(
    "polytropic_gas", _draw_polytropic_gas, described_by=("gas_spring", "accumulator", "preload_offset")
)


@compiled
def branch_force(force: float, travel: float, T0_2: float, k_2: float) -> float:
    """Return the force [N] of a second elasto-plastic element after a travel of the rod to one side [m].

    The library has this effect; a verdict names it where alone it leaves nothing.

    Equation: dF_2/dt = k_2 dx/dt, |F_2| <= T0_2 (Maxwell slip)     Source: Iwan 1966, J. Appl. Mech. 33(4)
    """
    return min(T0_2, max(-T0_2, force + k_2 * travel))


def _draw_second_branch(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    slips = strength * scale.force
    return {"T0_2": slips, "k_2": slips / (float(rng.uniform(0.05, 0.3)) * scale.stroke)}


SECOND_BRANCH = Law("second_branch", _draw_second_branch, described_by=("second_branch",))


@compiled
def hysteresis_rate(z: float, speed: float, x_h: float, sigma: float) -> float:
    """Return the rate [1/s] of the hysteretic variable of Bouc and Wen, of which 1 is the ultimate force.

    The library has this effect; a verdict names it where alone it leaves nothing.

    Equation: x_h dz/dt = v - beta |v| |z| z - gamma v z^2, beta = sigma, gamma = 1 - sigma
    Source: Wen 1976, J. Eng. Mech. Div. ASCE 102(2), n = 2, A = beta + gamma = 1
    """
    return (speed - sigma * abs(speed) * abs(z) * z - (1.0 - sigma) * speed * z * z) / x_h


def _draw_bouc_wen(rng: Generator, scale: Scale, strength: float) -> dict[str, float]:
    travel = _log_uniform(rng, 0.05, 0.3) * scale.stroke
    return {"F_h": strength * scale.force, "x_h": travel, "sigma": float(rng.uniform(0.5, 2.0))}


BOUC_WEN = Law("bouc_wen", _draw_bouc_wen, described_by=("bouc_wen", "second_branch"))

# In the order in which cases hide them, which a seed depends on.
OUTSIDE = by_name(
    *(FREQUENCY_DEPENDENT, THIXOTROPY, POSITION_GROOVES, TWO_STAGE_BLOW_OFF, FRAME_STICK_SLIP, VISCOELASTIC_MOUNT),
    *(AERATION, LATE_FILLING, CUBIC_SPRING, SMOOTH_PIPE, POLYTROPIC_GAS, SECOND_BRANCH, BOUC_WEN),
)
"""Every law outside the library."""
