"""The forces outside the library do what their formulas say, and no effect of the library can stand in for them."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.blind.case import NoiseFreeRecord
from pzd.blind.hide import gap_after_refit
from pzd.blind.outside import FORMS, Envelope
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.hypotheses.shapes import SHAPES
from pzd.record import Array

STROKE, FREQUENCY = 0.02, 2.0
SPEED = 2.0 * np.pi * FREQUENCY * STROKE
ENVELOPE = Envelope(STROKE, SPEED)
MIDDLE = {name: {key: 0.5 * (low + high) for key, (low, high) in form.ranges.items()} for name, form in FORMS.items()}
MIDDLE |= {"tapered_rod": {"side": 1.0}, "even_spring": {"side": 1.0}}


def sine(cycles: int = 3, stroke: float = STROKE, frequency: float = FREQUENCY, step: float = 1e-3) -> Motion:
    t = np.arange(0.0, cycles / frequency, step)
    w = 2.0 * np.pi * frequency
    return Motion(t, stroke * np.sin(w * t), stroke * w * np.cos(w * t), -stroke * w**2 * np.sin(w * t))


def force(name: str, motion: Motion) -> Array:
    return FORMS[name].shape(motion, ENVELOPE, MIDDLE[name])


@pytest.mark.parametrize("name", FORMS)
def test_a_form_gives_a_force_of_about_one(name: str) -> None:
    assert 0.3 < np.max(np.abs(force(name, sine()))) <= 2.0 + 1e-9


@pytest.mark.parametrize("name", FORMS)
def test_a_form_is_described_by_shapes_that_are_tried(name: str) -> None:
    named = FORMS[name].named_shapes
    assert named
    assert {*named} <= {shape.name for shape in SHAPES}


def test_position_damping_vanishes_at_the_middle_and_dissipates() -> None:
    motion = sine()
    found = force("position_damping", motion)
    assert found[0] == 0.0
    assert np.all(found * motion.velocity >= 0.0)


def test_a_tapered_rod_and_an_even_spring_do_no_work_over_a_cycle() -> None:
    motion = sine(cycles=2)
    for name in ("tapered_rod", "even_spring"):
        assert abs(np.mean(force(name, motion) * motion.velocity)) < 1e-3 * SPEED


def test_a_covered_port_brakes_beyond_it_alone() -> None:
    motion = sine()
    found = force("covered_port", motion)
    assert np.max(np.abs(found[motion.displacement < -0.2 * STROKE])) < 1e-6
    fast = (motion.displacement > 0.2 * STROKE) & (np.abs(motion.velocity) > 0.3 * SPEED)
    assert np.allclose(np.abs(found[fast]), 1.0, atol=1e-3)


def test_a_ripple_returns_after_its_length() -> None:
    length = MIDDLE["ripple"]["length"] * STROKE
    x = np.linspace(-STROKE, 0.0, 50)
    zero = np.zeros(50)
    here, true_row = (force("ripple", Motion(zero, place, zero, zero)) for place in (x, x + length))
    assert np.allclose(here, true_row, atol=1e-9)


def test_rubber_dissipates_the_same_at_any_speed() -> None:
    slow, fast = (sine(frequency=f, cycles=3) for f in (0.5, 2.0))
    per_cycle = [np.trapezoid(force("rubber", m), m.displacement) for m in (slow, fast)]
    assert per_cycle[0] == pytest.approx(per_cycle[1], rel=0.02)
    assert per_cycle[0] > 0.0


def test_aeration_starts_from_nothing_and_grows() -> None:
    motion = sine(cycles=8)
    found = np.abs(force("aeration", motion))
    cycle = round(1.0 / FREQUENCY / 1e-3)
    assert found[0] == 0.0
    assert np.max(found[-cycle:]) > 2.0 * np.max(found[:cycle])


@pytest.mark.parametrize("name", FORMS)
def test_the_motion_alone_decides_and_not_how_often_it_is_sampled(name: str) -> None:
    usual, finer = force(name, sine(step=1e-3)), force(name, sine(step=2.5e-4))[::4]
    assert np.max(np.abs(usual - finer[: usual.size])) < 5e-3


PLAIN = Damper(base=(BaseRow(T0_N=500.0, C_Ns_per_m=3000.0, k_N_per_m=3e5),))
MOTIONS = [sine(stroke=s, frequency=f) for s, f in ((0.01, 2.0), (0.02, 2.0), (0.02, 1.0))]


def hidden(damper: Damper) -> list[NoiseFreeRecord]:
    return [NoiseFreeRecord(motion, force, force) for motion in MOTIONS for force in (respond(damper, motion),)]


def test_nothing_hidden_leaves_no_visible_gap_wherever_the_search_starts() -> None:
    start = Damper(base=(BaseRow(T0_N=420.0, C_Ns_per_m=3500.0, k_N_per_m=2.5e5),))
    assert gap_after_refit(hidden(PLAIN), start) < 1e-4


def test_the_visible_gap_of_an_orifice_falls_with_it() -> None:
    gaps = [
        gap_after_refit(hidden(PLAIN.with_effect("orifice_quadratic", {"q": q})), PLAIN) for q in (4000.0, 1000.0, 0.0)
    ]
    assert gaps[0] > 0.005
    assert gaps[0] > 2.0 * gaps[1] > 0.0
    assert gaps[2] < 1e-6


def test_a_known_effect_leaves_no_visible_gap() -> None:
    damper = PLAIN.with_effect("asymmetry", {"alpha": 0.1})
    assert gap_after_refit(hidden(damper), PLAIN) > 0.02
    assert gap_after_refit(hidden(damper), damper) < 1e-6
