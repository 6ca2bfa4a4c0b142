"""Integrates the laws: oil spring and flow in series, what stands beside them, and a mount that may slip.

Equation: F = k dz(x - u - y), R(dy/dt) = F for the characteristic R of the flow, classical Runge-Kutta in fixed steps
                                                                Source: Kutta 1901

It shares no line with `pzd.damper`: the flow is found from the force by bracketing, not in closed form.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pzd.blind.independent.laws import (
    asymmetry,
    end_stop,
    fluid_inertia,
    gas_spring,
    lash,
    orifice_quadratic,
    preload_offset,
    relief_valve,
    rounded_yield,
    second_branch,
    shear_thinning,
    stribeck_friction,
)
from pzd.blind.independent.outside import (
    aeration,
    cubic_spring,
    frame_stick_slip,
    frequency_dependent,
    late_filling,
    polytropic_gas,
    position_grooves,
    smooth_pipe,
    thixotropy,
    two_stage_blow_off,
    viscoelastic_mount,
)
from pzd.compiled import compiled
from pzd.record import Array


class Parameters(NamedTuple):
    """Every parameter of the laws; each default leaves its law out."""

    alpha: float = 0.0
    q: float = 0.0
    w_s: float = 0.0
    n: float = 1.0
    F_r: float = math.inf
    C_r: float = 1.0
    delta: float = 0.0
    T0_2: float = 0.0
    k_2: float = 1.0
    k_e: float = 0.0
    x_e: float = 1.0
    k_g: float = 0.0
    m: float = 0.0
    F_0: float = 0.0
    F_s: float = 0.0
    v_s: float = 1.0
    bypass: float = 0.0
    bypass_lag: float = 1.0
    bypass_force: float = 1.0
    structure: float = 0.0
    rebuilding: float = 1.0
    breakdown: float = 0.0
    groove: float = 0.0
    groove_end: float = 0.0
    groove_run_out: float = 1.0
    first_force: float = math.inf
    first_slope: float = 1.0
    second_force: float = math.inf
    second_slope: float = 1.0
    mount_stiffness: float = 1.0
    mount_holds: float = math.inf
    mount_slides: float = math.inf
    bushing_stiffness: float = 0.0
    bushing_time: float = 1.0
    fade: float = 0.0
    fade_time: float = 1.0
    gap: float = 0.0
    cubic: float = 0.0
    duct: float = 0.0
    charge: float = 0.0
    column: float = 1.0


# The laws as machine code.
_side_factor = compiled(asymmetry.side_factor)
_orifice = compiled(orifice_quadratic.pressure_force)
_yield_force = compiled(rounded_yield.yield_force)
_viscous = compiled(shear_thinning.viscous_force)
_opening_force = compiled(relief_valve.opening_force)
_relief_flow = compiled(relief_valve.flow_beyond)
_play = compiled(lash.spring_extension)
_branch_force = compiled(second_branch.next_force)
_stop = compiled(end_stop.force)
_gas_spring = compiled(gas_spring.force)
_inertia = compiled(fluid_inertia.force)
_preload = compiled(preload_offset.force)
_stribeck = compiled(stribeck_friction.force)
_bypass_factor = compiled(frequency_dependent.damping_factor)
_spool_rate = compiled(frequency_dependent.spool_rate)
_structure_factor = compiled(thixotropy.friction_factor)
_structure_rate = compiled(thixotropy.structure_rate)
_groove_factor = compiled(position_grooves.damping_factor)
_stages_flow = compiled(two_stage_blow_off.flow_beyond)
_slips = compiled(frame_stick_slip.slips)
_slip_rate = compiled(frame_stick_slip.slip_rate)
_bushing = compiled(viscoelastic_mount.force)
_relaxation_rate = compiled(viscoelastic_mount.relaxation_rate)
_fading = compiled(aeration.damping_factor)
_late = compiled(late_filling.spring_extension)
_hardening = compiled(cubic_spring.force)
_duct = compiled(smooth_pipe.pressure_force)
_charge = compiled(polytropic_gas.force)

_STATES = 5
"""Oil, mount, spool, structure, bushing."""
_CLOSE = 1e-10
"""Share of the force to which the flow is found."""


def integrated(
    time: Array, motion: tuple[Array, Array, Array], base: tuple[Array, Array, Array], parameters: Parameters
) -> Array:
    """Force of the damper at every second instant of a fine grid.

    Parameters
    ----------
    time : (2 n + 1,) evenly spaced [s]; two intervals make one step
    motion : (2 n + 1,) extension from the middle of the stroke, speed and acceleration, in SI
    base : (2 n + 1,) T0, C and k at the control signal and temperature of each instant, in SI
    parameters : of the laws

    Returns
    -------
    (n + 1,) force [N]
    """
    force = np.empty(time.size // 2 + 1)
    _march(time, *motion, *base, parameters, np.zeros((6, _STATES)), force)
    return force


@compiled
def _resistance(w: float, T0: float, C: float, p: Parameters) -> float:
    """Force [N] that the closed valve takes at a flow speed > 0 [m/s]."""
    force = _yield_force(w, T0, p.w_s) + _viscous(w, C, p.n) + _orifice(w, p.q)
    return force + _duct(w, p.duct) if p.duct > 0.0 else force


@compiled
def _closed_flow(force: float, T0: float, C: float, p: Parameters) -> float:
    """Flow speed [m/s] at which the closed valve takes a force >= 0 [N]: bracketed, then the Illinois rule."""
    sharp = p.w_s <= 0.0
    if sharp and force <= T0:
        return 0.0
    if sharp and p.n == 1.0 and p.q == 0.0 and p.duct == 0.0:
        return (force - T0) / C
    low, below = 0.0, (T0 if sharp else 0.0) - force
    high = force / C + 1e-9
    above = _resistance(high, T0, C, p) - force
    while above < 0.0:
        low, below, high = high, above, 2.0 * high
        above = _resistance(high, T0, C, p) - force
    last, w = 0, high
    for _ in range(100):
        w = (low * above - high * below) / (above - below)
        off = _resistance(w, T0, C, p) - force
        if abs(off) <= _CLOSE * force or high - low <= 1e-14 * high:
            break
        if off > 0.0:
            high, above, below = w, off, below * (0.5 if last == 1 else 1.0)
            last = 1
        else:
            low, below, above = w, off, above * (0.5 if last == -1 else 1.0)
            last = -1
    return w


@compiled
def _flow(force: float, T0: float, C: float, p: Parameters) -> float:
    """Flow speed [m/s], with its sign, that a force drives through the valves."""
    factor = _side_factor(force > 0.0, p.alpha)
    size, friction, damping = abs(force), T0 * factor, C * factor
    opens = _opening_force(p.F_r, friction)
    if size > opens:
        w = _closed_flow(opens, friction, damping, p) + _relief_flow(size - opens, p.C_r)
    elif size > p.first_force > friction:
        w = _closed_flow(p.first_force, friction, damping, p)
        w += _stages_flow(size, p.first_force, p.first_slope, p.second_force, p.second_slope)
    else:
        w = _closed_flow(size, friction, damping, p)
    return math.copysign(w, force)


@compiled
def _oil_force(deflection: float, k: float, p: Parameters) -> float:
    """Force [N] of the oil spring."""
    return k * (_late(deflection, p.gap) if p.gap > 0.0 else _play(deflection, p.delta))


@compiled
def _parallel_force(x: float, v: float, a: float, relaxed: float, p: Parameters) -> float:
    """Force [N] beside the oil spring that remembers nothing but what has relaxed in the bushing."""
    force = _stop(x, p.k_e, p.x_e) + _gas_spring(x, p.k_g) + _inertia(a, p.m) + _preload(p.F_0)
    force += _stribeck(v, p.F_s, p.v_s) + _bushing(x, relaxed, p.bushing_stiffness)
    return force + _hardening(x, p.cubic) + _charge(x, p.charge, p.column)


@compiled
def _rates(
    s: Array, x: float, t: float, T0: float, C: float, k: float, slipping: bool, p: Parameters, out: Array
) -> None:
    """Fill in the rates of the states."""
    force = _oil_force(x - s[1] - s[0], k, p)
    friction, damping = T0, C
    if p.structure > 0.0:
        friction *= _structure_factor(s[3], p.structure)
    if p.bypass > 0.0:
        damping *= _bypass_factor(s[2], p.bypass, p.bypass_force)
    if p.groove > 0.0:
        damping *= _groove_factor(x, p.groove, p.groove_end, p.groove_run_out)
    if p.fade > 0.0:
        damping *= _fading(t, p.fade, p.fade_time)
    w = _flow(force, friction, damping, p)
    out[0] = w
    out[1] = _slip_rate(force - p.mount_stiffness * s[1], p.mount_stiffness, p.mount_slides) if slipping else 0.0
    out[2] = _spool_rate(force, s[2], p.bypass_lag)
    out[3] = _structure_rate(s[3], w, p.rebuilding, p.breakdown)
    out[4] = _relaxation_rate(x, s[4], p.bushing_time)


@compiled
def _moved(s: Array, rate: Array, h: float, out: Array) -> None:
    for n in range(s.size):
        out[n] = s[n] + h * rate[n]


@compiled
def _march(
    time: Array,
    x: Array,
    v: Array,
    a: Array,
    T0: Array,
    C: Array,
    k: Array,
    p: Parameters,
    work: Array,
    force: Array,
) -> None:
    """Fill in the force: four rates a step, from the middle of the stroke with all structure built."""
    s, moved, r1, r2, r3, r4 = work[0], work[1], work[2], work[3], work[4], work[5]
    s[0], s[3], s[4] = x[0], 1.0, x[0]
    slipping, branch = False, 0.0
    for j in range(force.size):
        i = 2 * j
        oil = _oil_force(x[i] - s[1] - s[0], k[i], p)
        force[j] = oil + branch + _parallel_force(x[i], v[i], a[i], s[4], p)
        if j == force.size - 1:
            break
        h, m, e = time[i + 2] - time[i], i + 1, i + 2
        slipping = _slips(oil - p.mount_stiffness * s[1], slipping, p.mount_holds, p.mount_slides)
        _rates(s, x[i], time[i], T0[i], C[i], k[i], slipping, p, r1)
        _moved(s, r1, 0.5 * h, moved)
        _rates(moved, x[m], time[m], T0[m], C[m], k[m], slipping, p, r2)
        _moved(s, r2, 0.5 * h, moved)
        _rates(moved, x[m], time[m], T0[m], C[m], k[m], slipping, p, r3)
        _moved(s, r3, h, moved)
        _rates(moved, x[e], time[e], T0[e], C[e], k[e], slipping, p, r4)
        for n in range(s.size):
            s[n] += h / 6.0 * (r1[n] + 2.0 * r2[n] + 2.0 * r3[n] + r4[n])
        if p.T0_2 > 0.0:
            branch = _branch_force(branch, x[m] - x[i], p.T0_2, p.k_2)
            branch = _branch_force(branch, x[e] - x[m], p.T0_2, p.k_2)
