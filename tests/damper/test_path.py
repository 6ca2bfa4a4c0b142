"""The general path: against independent solvers, convergence in the tolerance, energies, and the steady limit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from pzd.damper.compiled.kernels import K, row_of
from pzd.damper.compose import TOLERANCE, integrated_force, respond, static_force, steady_force
from pzd.damper.element import element_force
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.damper.parameter_rows import constant_rows, element_rows
from pzd.damper.path import DEFLECTION, NO_VARIABLES, SPEED, STATES, advance, march, sensitivities_to
from pzd.damper.regimes import TimeStep, spring_energy, spring_force, whole_step
from pzd.diagnosis.fit.likelihood import SIMULATION_TOLERANCE

STEP = 1e-3
TIME = np.arange(600) * STEP
PLAIN = Damper(
    base=(
        BaseRow(voltage_V=0.0, T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),
        BaseRow(voltage_V=150.0, T0_N=1300.0, C_Ns_per_m=2500.0, k_N_per_m=4e5),
    )
)
FLOWS = [
    {"orifice_quadratic": {"q": 3000.0}},
    {"shear_thinning": {"n": 0.6}},
    {"rounded_yield": {"w_s": 0.02}},
    {"asymmetry": {"alpha": 0.2}},
    {"relief_valve": {"F_r": 900.0, "C_r": 400.0}},
    {"lash": {"delta": 4e-4}},
    {"lash": {"delta": (2e-4, 9e-4), "at_voltage_V": (0.0, 150.0)}},
    {"lash": {"delta": 4e-4}, "rounded_yield": {"w_s": 0.03}, "orifice_quadratic": {"q": 2000.0}},
    {"shear_thinning": {"n": 0.8}, "relief_valve": {"F_r": 900.0, "C_r": 400.0}, "asymmetry": {"alpha": -0.1}},
    {"cavitation": {"d_c": 2e-3, "F_c": 80.0}},
    {"cavitation": {"d_c": (-2e-3, -1e-3), "F_c": (80.0, 200.0), "at_voltage_V": (0.0, 150.0)}},
    {"frame_compliance": {"d_f": 1e-3, "F_f": 80.0}},
    {"mount_play": {"delta": 5e-4, "F_m": 120.0}},
    {"frame_compliance": {"d_f": (2e-3, 1e-3), "F_f": (80.0, 200.0), "at_voltage_V": (0.0, 150.0)}},
    {
        "lash": {"delta": 4e-4},
        "cavitation": {"d_c": 1e-3, "F_c": 80.0},
        "frame_compliance": {"d_f": 1e-3, "F_f": 200.0},
        "relief_valve": {"F_r": 900.0, "C_r": 400.0},
    },
    {"rounded_yield": {"w_s": 0.005}, "shear_thinning": {"n": 0.9}},
]


NOTHING = sensitivities_to(NO_VARIABLES, np.zeros((1, 0)))
NEUTRAL_ROW = tuple(constant_rows(1.0, 1.0, 1.0, {})[0][0, 3:])
"""Columns of a parameter row behind T0, C and k, without any effect."""


def sine(voltage: np.ndarray | float, frequency: float = 3.0, amplitude: float = 0.02) -> Motion:
    """A sine under a given voltage."""
    omega = 2 * np.pi * frequency
    x = amplitude * np.sin(omega * TIME)
    v = amplitude * omega * np.cos(omega * TIME)
    return Motion(TIME, x, v, -(omega**2) * x, np.broadcast_to(np.asarray(voltage, float), TIME.shape).copy())


def with_effects(effects: dict) -> Damper:
    """The plain damper with several effects."""
    damper = PLAIN
    for name, values in effects.items():
        damper = damper.with_effect(name, values)
    return damper


def squeezed(e: float, d: float, half: float) -> float:
    """What is left of a deflection behind something that takes d s/(|s| + half) of it."""
    return brentq(lambda s: s + d * s / (abs(s) + half) - e, -abs(e), abs(e), xtol=1e-18, rtol=1e-14) if e else 0.0


def jointed(e: float, play: float, free: float) -> float:
    """What is left of a deflection behind a joint that is free at an extension of the oil spring, to a side above 0."""

    def passed(s: float) -> float:
        return 0.5 * play * (1.0 + np.clip((s - free) / (0.02 * free), -1.0, 1.0))

    return brentq(lambda s: s + passed(s) - e, -abs(e) - play, abs(e) + play, xtol=1e-18, rtol=1e-14) if e else 0.0


def independent(damper: Damper, motion: Motion, until: int) -> np.ndarray:
    """dF/dt written out by hand and integrated by LSODA piece by piece, w(F) found by bracketing."""
    values = {name: v for effect in damper.effects.values() for name, v in effect.items()}
    q, n, ws = values.get("q", 0.0), values.get("n", 1.0), values.get("w_s", 0.0)
    alpha, play = values.get("alpha", 0.0), np.broadcast_to(damper.effects.get("lash", {}).get("delta", 0.0), 2)
    joint = damper.effects.get("mount_play", {"delta": 0.0, "F_m": 1.0})
    F_r, C_r = values.get("F_r", np.inf), values.get("C_r", 1.0)
    pocket, mount = (
        [np.broadcast_to(values.get(name, neutral), 2) for name, neutral in pair]
        for pair in ((("d_c", 0.0), ("F_c", 1.0)), (("d_f", 0.0), ("F_f", 1.0)))
    )

    def parameters(u: float) -> tuple[float, float, float]:
        share = u / 150.0
        return 300 + 1000 * share, 2700 - 200 * share, 2e5 + 2e5 * share

    def at(nodes: np.ndarray, u: float) -> float:
        return float(nodes[0] + (nodes[1] - nodes[0]) * u / 150.0)

    def extension(e: float, u: float) -> float:
        """Extension of the oil stiffness: the free play is taken up first, then pocket and mount are squeezed."""
        e = np.sign(e) * max(abs(e) - at(play, u) / 2, 0.0)
        d, k = at(pocket[0], u), parameters(u)[2]
        e = squeezed(e, abs(d) * (d * e > 0.0), at(pocket[1], u) / k)
        return jointed(squeezed(e, at(mount[0], u), at(mount[1], u) / k), joint["delta"], joint["F_m"] / k)

    def speed(F: float, T0: float, C: float) -> float:
        side = 1 + alpha * np.sign(F)

        def curve(w: float) -> float:
            friction = T0 * side * (np.tanh(w / ws) if ws else 1.0)
            return friction + C * side * 0.3 * (w / 0.3) ** n + q * w * w

        def inverse(force: float) -> float:
            return 0.0 if force <= curve(0.0) else brentq(lambda w: curve(w) - force, 0.0, 50.0, xtol=1e-15, rtol=1e-15)

        bound = max(F_r, T0 * side)
        return inverse(min(abs(F), bound)) + max(abs(F) - bound, 0.0) / C_r

    def rate(t: float, e: np.ndarray, i: int) -> list[float]:
        share = (t - motion.time[i]) / STEP
        voltage = motion.voltage[i] + share * (motion.voltage[i + 1] - motion.voltage[i])
        T0, C, k = parameters(voltage)
        F = k * extension(e[0], voltage)
        half = 0.5 * (motion.velocity[i + 1] - motion.velocity[i])
        u = (motion.displacement[i + 1] - motion.displacement[i]) / STEP + half * (2 * share - 1)
        return [u - np.sign(F) * speed(F, T0, C)]

    e, forces = 0.0, [0.0]
    for i in range(until - 1):
        run = solve_ivp(rate, motion.time[i : i + 2], [e], "RK45", rtol=1e-9, atol=1e-13, args=(i,), max_step=STEP / 4)
        e = run.y[0, -1]
        forces.append(parameters(motion.voltage[i + 1])[2] * extension(e, motion.voltage[i + 1]))
    return np.array(forces)


@pytest.mark.parametrize("effects", FLOWS, ids="+".join)
def test_an_oil_spring_that_is_a_thousand_times_as_stiff_a_sample_later_gives_a_force(effects: dict) -> None:
    """Linear over the step, k was extrapolated below zero before it: a search crashed with what came of it."""
    rows = tuple(row.model_copy(update={"k_N_per_m": k}) for row, k in zip(PLAIN.base, (1e5, 5e9), strict=True))
    damper = with_effects(effects).model_copy(update={"base": rows})
    motion = sine(np.where(TIME < 0.3, 0.0, 150.0), 4.0, 0.015)
    settled = sine(150.0, 4.0, 0.015)
    late = TIME > 0.3 + 0.25  # a quarter period has passed, and with it what was stored
    force = respond(damper, motion)
    assert np.all(np.isfinite(force))
    np.testing.assert_allclose(force[late], respond(damper, settled)[late], rtol=0, atol=1e-3 * np.max(np.abs(force)))


@pytest.mark.parametrize("effects", FLOWS, ids="+".join)
@pytest.mark.parametrize("voltage", [60.0, "moving"])
def test_agrees_with_an_independent_solver(effects: dict, voltage: float | str) -> None:
    motion = sine(75 + 70 * np.sin(2 * np.pi * 2.3 * TIME) if voltage == "moving" else voltage, 4.0, 0.015)
    damper = with_effects(effects)
    truth = independent(damper, motion, 200)  # beyond the second reversal
    ours = respond(damper, motion)[:200]
    assert np.max(np.abs(ours - truth)) <= 2e-6 * np.max(np.abs(truth))


def test_a_moving_stiffness_agrees_with_a_restarted_high_order_solver_to_1e_9() -> None:
    motion = sine(75 + 70 * np.sin(2 * np.pi * 2.3 * TIME))
    e, forces = 0.0, [0.0]
    for i in range(399):
        mean = (motion.displacement[i + 1] - motion.displacement[i]) / STEP
        half = 0.5 * (motion.velocity[i + 1] - motion.velocity[i])
        share0, share1 = motion.voltage[i] / 150, motion.voltage[i + 1] / 150

        def state(t, i=i, share0=share0, share1=share1) -> tuple[float, float, float]:
            s = share0 + (share1 - share0) * (t - motion.time[i]) / STEP
            return 300 + 1000 * s, 2700 - 200 * s, 2e5 + 2e5 * s

        def rate(t, y, i=i, mean=mean, half=half, state=state) -> list[float]:
            T0, C, k = state(t)
            u = mean + half * (2 * (t - motion.time[i]) / STEP - 1)
            return [u - np.sign(y[0]) * max(k * abs(y[0]) - T0, 0.0) / C]

        run = solve_ivp(rate, motion.time[i : i + 2], [e], "DOP853", rtol=1e-13, atol=1e-17, max_step=STEP / 4)
        e = run.y[0, -1]
        forces.append(state(motion.time[i + 1])[2] * e)
    ours = respond(PLAIN, motion)[:400]
    assert np.max(np.abs(ours - forces)) <= 1e-9 * np.max(np.abs(forces))


def test_a_stiffness_that_follows_the_voltage_changes_the_force_visibly() -> None:
    jumping = np.where((TIME // 0.05) % 2 == 0, 20.0, 140.0)
    force = respond(PLAIN, sine(jumping))
    jumps = np.flatnonzero(np.diff(jumping))
    assert np.max(np.abs(np.diff(force)[jumps])) > 5 * np.median(np.abs(np.diff(force)))


def motions(rng: np.random.Generator) -> dict[str, Motion]:
    """A sine, the same so small that the oil mostly sticks, and one that turns round in every other step."""
    wild = np.cumsum(rng.normal(0.0, 1e-4, TIME.size))
    even, flat = sine(0.0), np.zeros_like(TIME)
    small = Motion(TIME, 0.02 * even.displacement, 0.02 * even.velocity, flat)
    return {"sine": even, "small": small, "wild": Motion(TIME, wild, np.gradient(wild, STEP), flat)}


@pytest.mark.parametrize("kind", ["sine", "small", "wild"])
@pytest.mark.parametrize("uneven", [False, True], ids=["even", "uneven"])
def test_the_closed_form_and_the_march_agree_to_1e_9_of_peak(kind: str, uneven: bool, rng: np.random.Generator) -> None:
    motion = motions(rng)[kind]
    steps = STEP * (rng.uniform(0.5, 1.5, TIME.size - 1) if uneven else np.ones(1))
    for size in ((1.0, 1.0, 1.0), (0.0, 1.0, 1.0), (0.1, 0.03, 3.0), (3.0, 1.0, 0.1)):
        T0, C, k = np.array([400.0, 2500.0, 4e5]) * size * rng.uniform(0.5, 2.0, 3)
        rows, _ = constant_rows(T0, C, k, {})
        closed = integrated_force(rows, motion, steps, 100.0, TOLERANCE)
        marched = march(motion.displacement, motion.velocity, steps, rows, 100.0, TOLERANCE)
        np.testing.assert_allclose(closed, marched, rtol=0, atol=1e-9 * np.max(np.abs(marched)))


def cut(coarse: Motion, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity of the same motion, every step cut in as many parts."""
    share = np.arange(parts) / parts
    u0 = np.diff(coarse.displacement) / STEP - 0.5 * np.diff(coarse.velocity)
    bend = np.diff(coarse.velocity)[:, None] * share
    inside = coarse.displacement[:-1, None] + STEP * share * (u0[:, None] + 0.5 * bend)
    x = np.append(inside.ravel(), coarse.displacement[-1])
    return x, np.append((coarse.velocity[:-1, None] + bend).ravel(), coarse.velocity[-1])


def test_cutting_every_step_in_eight_changes_nothing(rng: np.random.Generator) -> None:
    coarse = motions(rng)["wild"]
    x, v = cut(coarse, 8)
    whole = element_force(coarse.displacement, STEP, 300.0, 2700.0, 2e5, 0.0, coarse.velocity)
    fine = element_force(x, STEP / 8, 300.0, 2700.0, 2e5, 0.0, v)
    np.testing.assert_allclose(fine[::8], whole, rtol=0, atol=1e-9 * np.max(np.abs(whole)))


@pytest.mark.parametrize("effects", [*FLOWS[:3], FLOWS[7], FLOWS[8], FLOWS[-1]], ids="+".join)
def test_a_force_that_settles_within_a_fraction_of_a_step_is_followed(effects: dict) -> None:
    """C/k is a twentieth of the step and less, as in a slow test of a stiff damper; cut in 64, no piece is stiff."""
    hard = with_effects(effects)
    base = tuple(row.model_copy(update={"k_N_per_m": 6e7}) for row in hard.base)
    rows = element_rows(hard.model_copy(update={"base": base}), np.array([60.0]), None)
    motion = sine(60.0)
    stiff = march(motion.displacement, motion.velocity, np.array([STEP]), rows, 0.0, 1e-8)
    x, v = cut(motion, 64)
    fine = march(x, v, np.array([STEP / 64]), rows, 0.0, 1e-8)[::64]
    assert np.max(np.abs(stiff - fine)) <= 1e-6 * np.max(np.abs(fine))


@pytest.mark.parametrize("effects", [*FLOWS[:3], FLOWS[7]], ids="+".join)
@pytest.mark.parametrize("moving", [False, True], ids=["standing", "moving"])
def test_a_scheme_of_fixed_steps_is_of_order_five(effects: dict, moving: bool) -> None:
    """From a deflection at which the flow curve bends; where it is straight the method is exact."""
    first, last = (row_of(element_rows(with_effects(effects), np.array([u]), None)[0]) for u in (60.0, 70.0))
    start = {1: 8e-3, 3: 5e-3}[len(effects)] if [*effects] != ["rounded_yield"] else 3e-3
    long, unlimited = 8e-3, 1e9

    def after(steps: int) -> float:
        state, share = np.array([start, 0.0]), np.linspace(0.0, 1.0, steps + 1)
        u = 0.2 + 0.1 * share
        rows = [tuple(a + s * (b - a) if a != b else a for a, b in zip(first, last, strict=True)) for s in share]
        for i in range(steps):
            ends = (rows[i], rows[i + 1]) if moving else (first, first)
            advance(state, TimeStep(long / steps, u[i], u[i + 1], *ends, moving), unlimited, NOTHING, 0)
        return float(state[DEFLECTION])

    truth = after(512)
    coarse, fine = (abs(after(steps) - truth) for steps in (1, 8))
    assert np.log(coarse / fine) / np.log(8.0) > 4.8


def test_behind_an_open_relief_valve_moving_parameters_cost_no_order() -> None:
    """Its slope stands in the method's derivative; with the shut valve's there, a step needed twelve pieces."""
    opened = with_effects({"relief_valve": {"F_r": 900.0, "C_r": 400.0}})
    first, last = (row_of(element_rows(opened, np.array([u]), None)[0]) for u in (60.0, 70.0))

    def after(steps: int) -> float:
        state, share = np.array([8e-3, 0.0]), np.linspace(0.0, 1.0, steps + 1)
        rows = [tuple(a + s * (b - a) if a != b else a for a, b in zip(first, last, strict=True)) for s in share]
        u = 0.2 + 0.1 * share
        for i in range(steps):
            advance(state, TimeStep(4e-3 / steps, u[i], u[i + 1], rows[i], rows[i + 1], True), 1e9, NOTHING, 0)
        return float(state[DEFLECTION])

    truth = after(256)
    coarse, fine = (abs(after(steps) - truth) for steps in (1, 4))
    assert np.log(coarse / fine) / np.log(4.0) > 4.5


@pytest.mark.parametrize("effects", [*FLOWS[:4], FLOWS[-1]], ids="+".join)
def test_at_the_tolerance_of_the_diagnosis_the_force_is_right_to_1e_6_of_peak(effects: dict) -> None:
    motion, damper = sine(40.0), with_effects(effects)
    truth = respond(damper, motion, tolerance=1e-12)
    ours = respond(damper, motion, tolerance=SIMULATION_TOLERANCE)
    assert np.max(np.abs(ours - truth)) <= 1e-6 * np.max(np.abs(truth))


def test_whatever_flow_effects_meet_the_force_is_right_at_the_tolerance_of_the_diagnosis(
    rng: np.random.Generator,
) -> None:
    """A yield that rounds within millimetres a second, a fluid that hardly thins: the flow curve has a cusp there."""
    for _ in range(40):
        friction, damping = rng.uniform(50.0, 400.0), rng.uniform(300.0, 4000.0)
        stiffness, w_s, thinned = np.exp(rng.uniform(np.log([5e4, 5e-4, 0.01]), np.log([2e6, 0.1, 0.6])))
        laws = {
            "rounded_yield": {"w_s": w_s},
            "shear_thinning": {"n": 1.0 - thinned},
            "orifice_quadratic": {"q": rng.uniform(300.0, 8000.0)},
            "asymmetry": {"alpha": rng.uniform(-0.4, 0.4)},
            "relief_valve": {"F_r": rng.uniform(1.1, 3.0) * friction, "C_r": 0.3 * damping},
            "lash": {"delta": rng.uniform(1e-5, 1e-3)},
        }
        meeting = {name: laws[name] for name in rng.choice(list(laws), rng.integers(2, 5), replace=False)}
        base = (BaseRow(T0_N=friction, C_Ns_per_m=damping, k_N_per_m=stiffness),)
        damper = Damper(base=base, effects=meeting)
        motion = sine(0.0, float(np.exp(rng.uniform(np.log(0.3), np.log(5.0)))), rng.uniform(0.005, 0.03))
        truth = respond(damper, motion, tolerance=1e-11)
        ours = respond(damper, motion, tolerance=SIMULATION_TOLERANCE)
        assert np.max(np.abs(ours - truth)) <= 2e-6 * np.max(np.abs(truth)), damper


@pytest.mark.parametrize("friction", [0.0, *(10.0 ** np.arange(-14.0, 1.0, 0.25))])
def test_an_element_without_friction_is_solved(friction: float) -> None:
    """An orifice too small to be seen sends the element through the march, which has to find where 1e-12 N sticks."""
    motion = sine(0.0, frequency=5.0, amplitude=0.015)
    row = BaseRow(voltage_V=None, T0_N=friction, C_Ns_per_m=4550.0, k_N_per_m=184041.0)
    alone, marched = (
        respond(Damper(base=(row,), effects=effects), motion, 100.0, SIMULATION_TOLERANCE)
        for effects in ({}, {"orifice_quadratic": {"q": 1e-6}})
    )
    np.testing.assert_allclose(marched, alone, atol=2e-6)


def test_a_piece_that_overflows_is_cut() -> None:
    """On the flank of a yield that is hardly rounded, while T0 falls; taken as it came, no force was left.

    Of a sharp yield it differs by what the oil creeps below T0, in proportion to w_s.
    """
    w_s, speed = 1.3247e-5, np.array([-0.0122971, -0.0143870])
    elements = ((67.26775, 5521.146, 1975385.0), (66.96300, 5520.318, 1975370.0))
    rounded, sharp = (
        np.vstack([constant_rows(*element, effects)[0] for element in elements])
        for effects in ({"rounded_yield": {"w_s": w_s}}, {})
    )
    x, step = np.array([0.0, 2e-3 * speed.mean()]), np.array([2e-3])
    one, other = (march(x, speed, step, rows, -67.51003131, 1e-7) for rows in (rounded, sharp))
    assert one[1] == pytest.approx(other[1], rel=1e-3)


@pytest.mark.parametrize("effects", FLOWS[:3], ids="+".join)
def test_the_error_falls_with_the_tolerance(effects: dict) -> None:
    damper, motion = with_effects(effects), sine(40.0)
    truth = respond(damper, motion, tolerance=1e-12)
    errors = [np.max(np.abs(respond(damper, motion, tolerance=t) - truth)) for t in (1e-3, 1e-9)]
    assert errors[1] <= max(1e-2 * errors[0], 1e-6 * np.max(np.abs(truth)))


def test_the_parabola_inside_a_step_makes_a_sampled_sine_four_hundred_times_better() -> None:
    coarse = sine(0.0)
    fine_time = np.arange(599 * 64 + 1) * STEP / 64
    omega = 2 * np.pi * 3.0
    x, v = 0.02 * np.sin(omega * fine_time), 0.02 * omega * np.cos(omega * fine_time)
    truth = respond(PLAIN, Motion(fine_time, x, v, v, 0 * v))[::64]
    bent = np.max(np.abs(respond(PLAIN, coarse) - truth))
    flat = Motion(TIME, coarse.displacement, 0 * TIME, 0 * TIME, coarse.voltage)
    straight = np.max(np.abs(respond(PLAIN, flat) - truth))
    assert bent * 400 < straight


@pytest.mark.parametrize("effects", [{}, *FLOWS], ids=lambda e: "+".join(e) or "plain")
def test_the_work_of_the_rod_is_stored_dissipated_or_done_by_the_valve(effects: dict) -> None:
    motion = sine(75 + 70 * np.sin(2 * np.pi * 2.3 * TIME))
    rows = element_rows(with_effects(effects), motion.voltage, None)
    state, work, dissipated, valve = np.zeros(STATES), 0.0, 0.0, 0.0
    points, weights = np.polynomial.legendre.leggauss(3)
    shares = np.concatenate([(part + 0.5 * (1.0 + points)) / 12 for part in range(12)])
    for i in range(350):  # more than a cycle
        p0, p1 = row_of(rows[i]), row_of(rows[i + 1])
        mean = (motion.displacement[i + 1] - motion.displacement[i]) / STEP
        half = 0.5 * (motion.velocity[i + 1] - motion.velocity[i])
        for share, w in zip(shares, np.tile(weights / 24, 12), strict=True):  # Gauss' rule on parts of the step
            middle = tuple(a + share * (b - a) if a != b else a for a, b in zip(p0, p1, strict=True))
            probe, u = state.copy(), mean + half * (2 * share - 1)
            advance(probe, TimeStep(share * STEP, mean - half, u, p0, middle, True), TOLERANCE, NOTHING, i)
            e = probe[DEFLECTION]
            force = spring_force(e, middle)
            work += w * STEP * force * u
            dissipated += w * STEP * abs(force) * probe[SPEED]
            valve += w * (spring_energy(e, p1, p1[K]) - spring_energy(e, p0, p0[K]))
        advance(state, TimeStep(STEP, mean - half, mean + half, p0, p1, True), TOLERANCE, NOTHING, i)
    wound = np.linspace(0.0, state[DEFLECTION], 2001)
    stored = np.trapezoid([spring_force(e, row_of(rows[350])) for e in wound], wound)
    assert dissipated > 0.0
    assert abs(stored + dissipated - valve - work) <= 1e-6 * dissipated


@pytest.mark.parametrize("effects", [{}, *FLOWS], ids=lambda e: "+".join(e) or "plain")
def test_a_long_stroke_at_constant_speed_ends_at_the_steady_force(effects: dict) -> None:
    damper = with_effects(effects)
    for speed in (-0.4, -0.02, 0.05, 0.6):
        x = speed * TIME * 5
        moving = np.full_like(x, speed)
        long = Motion(TIME * 5, x, moving, 0 * x, np.full_like(x, 100.0))
        assert respond(damper, long)[-1] == pytest.approx(float(steady_force(damper, 100.0, None, speed)), rel=1e-6)


def test_at_rest_the_steady_force_has_two_sides_and_a_preload_is_left_to_the_balance() -> None:
    damper = PLAIN.with_effect("preload_offset", {"F_0": 50.0})
    np.testing.assert_allclose(steady_force(damper, 0.0, None, np.array([-0.0, 0.0])), [-300.0, 300.0])
    assert static_force(damper, 0.0) == 50.0
    beside = {"gas_spring": {"k_g": 3e3}, "fluid_inertia": {"m": 9.0}, "stribeck_friction": {"F_s": 80.0, "v_s": 0.04}}
    assert static_force(with_effects(beside), 0.0) == 0.0
    by_voltage = PLAIN.with_effect("preload_offset", {"F_0": (50.0, 90.0), "at_voltage_V": (0.0, 100.0)})
    np.testing.assert_allclose(static_force(by_voltage, np.array([0.0, 25.0, 100.0])), [50.0, 60.0, 90.0])


def test_a_missing_voltage_is_an_error() -> None:
    motion = sine(0.0)
    blind = Motion(motion.time, motion.displacement, motion.velocity, motion.acceleration)
    with pytest.raises(ValueError, match="depends on the voltage"):
        respond(PLAIN, blind)


@pytest.mark.parametrize("friction", [0.0, 1e-9, 0.05, 3.0])
def test_a_stick_that_begins_on_its_edge_finds_the_far_edge(friction: float, rng: np.random.Generator) -> None:
    weak = Damper(base=(BaseRow(T0_N=friction, C_Ns_per_m=2816.0, k_N_per_m=1.64e5),))
    x = np.cumsum(rng.normal(0.0, 1e-4, 600))
    ours = march(x, np.zeros(1), np.array([STEP]), element_rows(weak, None, None), 0.0, TOLERANCE)
    exact = element_force(x, STEP, friction, 2816.0, 1.64e5)
    np.testing.assert_allclose(ours, exact, rtol=0, atol=1e-8 * np.max(np.abs(exact)))


def test_a_step_from_one_edge_of_the_smooth_flow_past_the_other_is_cut_at_both(rng: np.random.Generator) -> None:
    valve, parts, long = {"relief_valve": {"F_r": 1000.0, "C_r": 500.0}}, 64, 4e-3
    draws = zip(
        rng.uniform(500.0, 1000.0, 500), rng.uniform(-1800.0, 1800.0, 500), rng.uniform(-1.0, 1.0, 500), strict=True
    )
    for friction, force, speed in draws:
        rows, _ = constant_rows(friction, 2700.0, 4e5, valve)
        x = np.linspace(0.0, speed * long, parts + 1)
        whole = march(x[[0, -1]], np.full(2, speed), np.array([long]), rows, force, TOLERANCE)[-1]
        fine = march(x, np.full(parts + 1, speed), np.array([long / parts]), rows, force, TOLERANCE)[-1]
        assert whole == pytest.approx(fine, abs=1e-9 * 1800.0)


@pytest.mark.parametrize("stiffness", [2e4, 2e5, 2e7])
def test_a_step_with_moving_parameters_converges_with_order_four(stiffness: float) -> None:
    """Stiff or soft: the error of the polynomial of a whole step falls with the fourth power of its length."""
    first, last = (300.0, 2700.0, stiffness, *NEUTRAL_ROW), (420.0, 2300.0, 1.3 * stiffness, *NEUTRAL_ROW)
    errors = [abs(in_parts(first, last, parts) - marched_step(first, last)) * stiffness / 900.0 for parts in (1, 2, 4)]
    assert errors[0] < 1e-3
    assert errors[2] < 1e-10 or np.log2(errors[0] / errors[2]) / 2 > 3.7, errors


def test_a_step_with_moving_parameters_is_cut_where_its_error_exceeds_the_tolerance(rng) -> None:
    """Of rows that move by up to a half in one step, those taken at once are as exact as those that are cut."""
    taken = 0
    for _ in range(300):
        stiffness, spread = 10 ** rng.uniform(4, 7), 10 ** rng.uniform(-4, -0.3)
        first = (300.0, 2700.0, stiffness, *NEUTRAL_ROW)
        last = tuple(a * (1 + spread * rng.uniform(-1, 1)) for a in first[:3]) + NEUTRAL_ROW
        end, _ = whole_step(900.0 / stiffness, TimeStep(STEP, 0.3, 0.5, first, last, True), TOLERANCE)
        if np.isfinite(end):
            taken += 1
            assert abs(end - marched_step(first, last)) * stiffness < TOLERANCE * 900.0
    assert 50 < taken < 300


def in_parts(first: tuple, last: tuple, parts: int) -> float:
    """Elastic deflection [m] after a step from 0.3 to 0.5 m/s that is taken in equal parts."""
    end = 900.0 / first[2]
    for i in range(parts):
        begin, until = i / parts, (i + 1) / parts
        p, q = (
            tuple(a + (b - a) * at if a != b else a for a, b in zip(first, last, strict=True)) for at in (begin, until)
        )
        end, _ = whole_step(end, TimeStep(STEP / parts, 0.3 + 0.2 * begin, 0.3 + 0.2 * until, p, q, True), np.inf)
    return end


def marched_step(first: tuple, last: tuple) -> float:
    """The same by pieces whose length follows from their error."""
    state = np.array([900.0 / first[2], 0.0])
    advance(state, TimeStep(STEP, 0.3, 0.5, first, last, True), 1e-11, NOTHING, 0)
    return state[DEFLECTION]
