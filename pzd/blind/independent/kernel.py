"""Integrates the laws: oil spring and flow in series, what stands beside them, and a mount that may slip.

Equation: F = k dz(x - u - y), R(dy/dt) = F for the characteristic R of the flow, classical Runge-Kutta in fixed steps
                                                                Source: Kutta 1901

It shares no line with `pzd.damper`: the flow is found from the force by bracketing, not in closed form.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

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
    _march()(time, *motion, *base, parameters, np.zeros((6, 5)), force)
    return force


@cache
def _march() -> Any:
    """The march as machine code; compiled once in a process, when a case is drawn."""
    import numba

    def machine_code(function: Any) -> Any:
        return numba.njit(error_model="numpy", nogil=True)(function)

    side_factor = machine_code(asymmetry.side_factor)
    orifice = machine_code(orifice_quadratic.pressure_force)
    yield_force = machine_code(rounded_yield.yield_force)
    viscous = machine_code(shear_thinning.viscous_force)
    opening = machine_code(relief_valve.opening_force)
    relief_flow = machine_code(relief_valve.flow_beyond)
    play = machine_code(lash.spring_extension)
    branch_force = machine_code(second_branch.next_force)
    stop = machine_code(end_stop.force)
    gas = machine_code(gas_spring.force)
    inertia = machine_code(fluid_inertia.force)
    preload = machine_code(preload_offset.force)
    stribeck = machine_code(stribeck_friction.force)
    bypass_factor = machine_code(frequency_dependent.damping_factor)
    spool_rate = machine_code(frequency_dependent.spool_rate)
    structure_factor = machine_code(thixotropy.friction_factor)
    structure_rate = machine_code(thixotropy.structure_rate)
    groove_factor = machine_code(position_grooves.damping_factor)
    stages_flow = machine_code(two_stage_blow_off.flow_beyond)
    slips = machine_code(frame_stick_slip.slips)
    slip_rate = machine_code(frame_stick_slip.slip_rate)
    bushing = machine_code(viscoelastic_mount.force)
    relaxation_rate = machine_code(viscoelastic_mount.relaxation_rate)
    fading = machine_code(aeration.damping_factor)
    late = machine_code(late_filling.spring_extension)
    hardening = machine_code(cubic_spring.force)
    duct = machine_code(smooth_pipe.pressure_force)
    charge = machine_code(polytropic_gas.force)

    @machine_code
    def resistance(w: float, T0: float, C: float, p: Parameters) -> float:
        force = yield_force(w, T0, p.w_s) + viscous(w, C, p.n) + orifice(w, p.q)
        return force + duct(w, p.duct) if p.duct > 0.0 else force

    @machine_code
    def closed_flow(force: float, T0: float, C: float, p: Parameters) -> float:
        """Flow speed at which the resistance is a force >= 0: bracketed, then the Illinois rule."""
        if p.w_s <= 0.0 and force <= T0:
            return 0.0
        if p.w_s <= 0.0 and p.n == 1.0 and p.q == 0.0 and p.duct == 0.0:
            return (force - T0) / C
        low, high = 0.0, force / C + 1e-9
        below = (T0 if p.w_s <= 0.0 else 0.0) - force
        above = resistance(high, T0, C, p) - force
        while above < 0.0:
            low, below = high, above
            high *= 2.0
            above = resistance(high, T0, C, p) - force
        side = 0
        for _ in range(100):
            w = (low * above - high * below) / (above - below)
            off = resistance(w, T0, C, p) - force
            if abs(off) <= 1e-10 * force or high - low <= 1e-14 * high:
                return w
            if off > 0.0:
                high, above = w, off
                if side == 1:
                    below *= 0.5
                side = 1
            else:
                low, below = w, off
                if side == -1:
                    above *= 0.5
                side = -1
        return w

    @machine_code
    def flow(force: float, T0: float, C: float, p: Parameters) -> float:
        factor = side_factor(force > 0.0, p.alpha)
        size, T0, C = abs(force), T0 * factor, C * factor
        opens = opening(p.F_r, T0)
        if size > opens:
            w = closed_flow(opens, T0, C, p) + relief_flow(size - opens, p.C_r)
        elif size > p.first_force and p.first_force > T0:
            w = closed_flow(p.first_force, T0, C, p) + stages_flow(
                size, p.first_force, p.first_slope, p.second_force, p.second_slope
            )
        else:
            w = closed_flow(size, T0, C, p)
        return math.copysign(w, force)

    @machine_code
    def spring(e: float, k: float, p: Parameters) -> float:
        if p.gap > 0.0:
            return k * late(e, p.gap)
        return k * play(e, p.delta)

    @machine_code
    def rates(s: Any, x: float, t: float, T0: float, C: float, k: float, slipping: bool, p: Parameters, out: Any) -> None:
        """Rates of oil, mount, spool, structure and bushing."""
        force = spring(x - s[1] - s[0], k, p)
        if p.structure > 0.0:
            T0 *= structure_factor(s[3], p.structure)
        if p.bypass > 0.0:
            C *= bypass_factor(s[2], p.bypass, p.bypass_force)
        if p.groove > 0.0:
            C *= groove_factor(x, p.groove, p.groove_end, p.groove_run_out)
        if p.fade > 0.0:
            C *= fading(t, p.fade, p.fade_time)
        w = flow(force, T0, C, p)
        out[0] = w
        out[1] = slip_rate(force - p.mount_stiffness * s[1], p.mount_stiffness, p.mount_slides) if slipping else 0.0
        out[2] = spool_rate(force, s[2], p.bypass_lag)
        out[3] = structure_rate(s[3], w, p.rebuilding, p.breakdown)
        out[4] = relaxation_rate(x, s[4], p.bushing_time)

    @machine_code
    def march(
        time: Any, x: Any, v: Any, a: Any, T0: Any, C: Any, k: Any, p: Parameters, work: Any, force: Any
    ) -> None:
        s, moved, r1, r2, r3, r4 = work[0], work[1], work[2], work[3], work[4], work[5]
        s[0], s[3], s[4] = x[0], 1.0, x[0]
        slipping, beside = False, 0.0
        steps = force.size - 1
        for j in range(steps + 1):
            i = 2 * j
            oil = spring(x[i] - s[1] - s[0], k[i], p)
            total = oil + beside + stop(x[i], p.k_e, p.x_e) + gas(x[i], p.k_g) + inertia(a[i], p.m) + preload(p.F_0)
            total += stribeck(v[i], p.F_s, p.v_s) + bushing(x[i], s[4], p.bushing_stiffness)
            total += hardening(x[i], p.cubic) + charge(x[i], p.charge, p.column)
            force[j] = total
            if j == steps:
                break
            h = time[i + 2] - time[i]
            slipping = slips(oil - p.mount_stiffness * s[1], slipping, p.mount_holds, p.mount_slides)
            rates(s, x[i], time[i], T0[i], C[i], k[i], slipping, p, r1)
            for n in range(5):
                moved[n] = s[n] + 0.5 * h * r1[n]
            rates(moved, x[i + 1], time[i + 1], T0[i + 1], C[i + 1], k[i + 1], slipping, p, r2)
            for n in range(5):
                moved[n] = s[n] + 0.5 * h * r2[n]
            rates(moved, x[i + 1], time[i + 1], T0[i + 1], C[i + 1], k[i + 1], slipping, p, r3)
            for n in range(5):
                moved[n] = s[n] + h * r3[n]
            rates(moved, x[i + 2], time[i + 2], T0[i + 2], C[i + 2], k[i + 2], slipping, p, r4)
            for n in range(5):
                s[n] += h / 6.0 * (r1[n] + 2.0 * r2[n] + 2.0 * r3[n] + r4[n])
            if p.T0_2 > 0.0:
                beside = branch_force(beside, x[i + 1] - x[i], p.T0_2, p.k_2)
                beside = branch_force(beside, x[i + 2] - x[i + 1], p.T0_2, p.k_2)

    return march
