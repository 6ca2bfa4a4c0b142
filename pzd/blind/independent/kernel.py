"""The damper of the second generator: Bingham parameters over the control signal, and the laws integrated in time.

Equation: F = k dz(x - u - y), R(dy/dt) = F for the characteristic R of the flow and a mount that slips by u, classical
Runge-Kutta in fixed steps                                      Source: Kutta 1901

It shares no line with `pzd.damper`: the flow is found from the force by bracketing, not in closed form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pzd.blind.independent import laws, outside
from pzd.compiled import compiled
from pzd.record import Array


@dataclass(frozen=True)
class BinghamTable:
    """Bingham parameters at every value of the control signal, linear between."""

    values: tuple[float, ...]
    """Of the control signal [V]."""
    T0: tuple[float, ...]
    """[N]"""
    C: tuple[float, ...]
    """[N s/m]"""
    k: tuple[float, ...]
    """[N/m]"""

    def at(self, signal: Array) -> tuple[Array, Array, Array]:
        """Return (n,) T0, C and k at (n,) values of the control signal."""
        T0, C, k = (np.asarray(np.interp(signal, self.values, row)) for row in (self.T0, self.C, self.k))
        return T0, C, k


class Parameters(NamedTuple):
    """Every parameter of the laws; each default leaves its law out."""

    alpha: float = 0.0
    alpha_C: float = 0.0
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
    F_g: float = 0.0
    L: float = 1.0
    d_c: float = 0.0
    F_c: float = 1.0
    d_f: float = 0.0
    F_f: float = 1.0
    F_h: float = 0.0
    x_h: float = 1.0
    sigma: float = 0.5


# States of the integration: flow [m], slip of the mount [m], low-passed force on the spool [N], structure of the fluid,
# relaxed extension of the bushing [m], hysteretic variable of Bouc and Wen [-].
_FLOW, _MOUNT, _SPOOL, _STRUCTURE, _BUSHING, _HYSTERESIS = range(6)
_STATES = 6
_CLOSE = 1e-10
"""Share of the force to which the flow is found: far below the 1e-5 that the longest step costs."""


def integrated(
    time: Array, motion: tuple[Array, Array, Array], base: tuple[Array, Array, Array], parameters: Parameters
) -> Array:
    """Integrate the damper from rest in the middle of its stroke; return the force at every second instant of a grid.

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
    """Return the force [N] that the closed valve takes at a flow speed > 0 [m/s]."""
    force = laws.yield_force(w, T0, p.w_s) + laws.viscous_force(w, C, p.n) + laws.orifice_force(w, p.q)
    return force + outside.duct_force(w, p.duct) if p.duct > 0.0 else force


@compiled
def _closed_flow(force: float, T0: float, C: float, p: Parameters) -> float:
    """Return the flow speed [m/s] at which the closed valve takes a force >= 0 [N].

    Method: bracketing, then regula falsi by the Illinois rule           Source: Dowell and Jarratt 1971, BIT 11
    """
    sharp = p.w_s <= 0.0
    if sharp and force <= T0:
        return 0.0
    if sharp and p.n == 1.0 and p.q == 0.0 and p.duct == 0.0:
        return (force - T0) / C
    # the force off by so much at both ends of the bracket
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
        # Illinois rule: the end that stays twice in a row counts half, so that the bracket closes from both sides
        if off > 0.0:
            high, above, below = w, off, below * (0.5 if last == 1 else 1.0)
            last = 1
        else:
            low, below, above = w, off, above * (0.5 if last == -1 else 1.0)
            last = -1
    return w


@compiled
def _flow(force: float, T0: float, C: float, p: Parameters) -> float:
    """Return the flow speed [m/s], with its sign, that a force drives through the valves."""
    factor = laws.direction_factor(force > 0.0, p.alpha)
    size, friction, damping = abs(force), T0 * factor, C * factor * laws.shim_factor(force > 0.0, p.alpha_C)
    opens = laws.relief_opening(p.F_r, friction)
    if size > opens:
        w = _closed_flow(opens, friction, damping, p) + laws.relief_flow(size - opens, p.C_r)
    elif size > p.first_force > friction:
        w = _closed_flow(p.first_force, friction, damping, p)
        w += outside.blow_off_flow(size, p.first_force, p.first_slope, p.second_force, p.second_slope)
    else:
        w = _closed_flow(size, friction, damping, p)
    return math.copysign(w, force)


@compiled
def _spring_force(deflection: float, k: float, p: Parameters) -> float:
    """Return the force [N] of the oil spring, behind a play, a pocket and a mount."""
    e = outside.late_extension(deflection, p.gap) if p.gap > 0.0 else laws.dead_zone(deflection, p.delta)
    if p.d_c != 0.0:
        e = laws.spring_behind_pocket(e, k, p.d_c, p.F_c)
    if p.d_f > 0.0:
        e = laws.spring_behind_mount(e, k, p.d_f, p.F_f)
    return k * e


@compiled
def _parallel_force(x: float, v: float, a: float, relaxed: float, p: Parameters) -> float:
    """Return the force [N] in parallel with the oil spring, but for branches, which have a memory."""
    force = (
        laws.end_stop_force(x, p.k_e, p.x_e)
        + laws.gas_spring_force(x, p.k_g)
        + laws.inertia_force(a, p.m)
        + laws.preload_force(p.F_0)
    )
    force += laws.stribeck_force(v, p.F_s, p.v_s) + outside.bushing_force(x, relaxed, p.bushing_stiffness)
    if p.F_g > 0.0:
        force += laws.accumulator_force(x, p.F_g, p.L)
    return force + outside.cubic_force(x, p.cubic) + outside.gas_charge_force(x, p.charge, p.column)


@compiled
def _rates(
    s: Array, x: float, v: float, t: float, T0: float, C: float, k: float, slipping: bool, p: Parameters, out: Array
) -> None:
    """Compute the rates of the states into `out`."""
    force = _spring_force(x - s[_MOUNT] - s[_FLOW], k, p)
    friction, damping = T0, C
    if p.structure > 0.0:
        friction *= outside.structure_factor(s[_STRUCTURE], p.structure)
    if p.bypass > 0.0:
        damping *= outside.bypass_factor(s[_SPOOL], p.bypass, p.bypass_force)
    if p.groove > 0.0:
        damping *= outside.groove_factor(x, p.groove, p.groove_end, p.groove_run_out)
    if p.fade > 0.0:
        damping *= outside.aeration_factor(t, p.fade, p.fade_time)
    w = _flow(force, friction, damping, p)
    out[_FLOW] = w
    out[_MOUNT] = (
        outside.slip_rate(force - p.mount_stiffness * s[_MOUNT], p.mount_stiffness, p.mount_slides) if slipping else 0.0
    )
    out[_SPOOL] = outside.spool_rate(force, s[_SPOOL], p.bypass_lag)
    out[_STRUCTURE] = outside.structure_rate(s[_STRUCTURE], w, p.rebuilding, p.breakdown)
    out[_BUSHING] = outside.relaxation_rate(x, s[_BUSHING], p.bushing_time)
    out[_HYSTERESIS] = outside.hysteresis_rate(s[_HYSTERESIS], v, p.x_h, p.sigma) if p.F_h > 0.0 else 0.0


@compiled
def _moved(s: Array, rate: Array, h: float, out: Array) -> None:
    """Compute the states after a time h at a constant rate into `out`."""
    for n in range(s.size):
        out[n] = s[n] + h * rate[n]


@compiled
def _march(
    time: Array, x: Array, v: Array, a: Array, T0: Array, C: Array, k: Array, p: Parameters, work: Array, force: Array
) -> None:
    """Compute the force at every second instant: four rates a step, all structure built at the start."""
    s, moved, r1, r2, r3, r4 = work[0], work[1], work[2], work[3], work[4], work[5]
    s[_FLOW], s[_STRUCTURE], s[_BUSHING] = x[0], 1.0, x[0]
    slipping, branch = False, 0.0
    for j in range(force.size):
        i = 2 * j
        spring = _spring_force(x[i] - s[_MOUNT] - s[_FLOW], k[i], p)
        force[j] = spring + branch + p.F_h * s[_HYSTERESIS] + _parallel_force(x[i], v[i], a[i], s[_BUSHING], p)
        if j == force.size - 1:
            break
        h, m, e = time[i + 2] - time[i], i + 1, i + 2  # the step, its middle and its end
        slipping = outside.mount_slips(spring - p.mount_stiffness * s[_MOUNT], slipping, p.mount_holds, p.mount_slides)
        _rates(s, x[i], v[i], time[i], T0[i], C[i], k[i], slipping, p, r1)
        _moved(s, r1, 0.5 * h, moved)
        _rates(moved, x[m], v[m], time[m], T0[m], C[m], k[m], slipping, p, r2)
        _moved(s, r2, 0.5 * h, moved)
        _rates(moved, x[m], v[m], time[m], T0[m], C[m], k[m], slipping, p, r3)
        _moved(s, r3, h, moved)
        _rates(moved, x[e], v[e], time[e], T0[e], C[e], k[e], slipping, p, r4)
        for n in range(s.size):
            s[n] += h / 6.0 * (r1[n] + 2.0 * r2[n] + 2.0 * r3[n] + r4[n])
        if p.T0_2 > 0.0:
            branch = outside.branch_force(branch, x[m] - x[i], p.T0_2, p.k_2)
            branch = outside.branch_force(branch, x[e] - x[m], p.T0_2, p.k_2)
