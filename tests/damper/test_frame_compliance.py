"""The hardening mount: its distinction by short strokes, and a linear frame as a smaller k."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.rig.stand.frame import force_in_frame

K = 2e5
STUCK = Damper(base=(BaseRow(T0_N=800.0, C_Ns_per_m=2700.0, k_N_per_m=K),))
MOUNT = {"d_f": 1.0e-3, "F_f": 80.0}


def sine(amplitude: float) -> Motion:
    """Three cycles at 1 Hz."""
    time = np.linspace(0.0, 3.0, 3001)
    w = 2.0 * np.pi
    x, v = amplitude * np.sin(w * time), amplitude * w * np.cos(w * time)
    return Motion(time, x, v, -(w**2) * x, None)


def secant(damper: Damper, amplitude: float) -> float:
    """Largest force over the amplitude of a stroke on which nothing slips [N/m]."""
    force = respond(damper, sine(amplitude))
    assert np.max(np.abs(force)) < 800.0
    return float(np.max(force) / amplitude)


def test_strokes_without_slip_distinguish_a_frame_from_a_softer_k_and_a_free_play() -> None:
    mount, play = STUCK.with_effect("frame_compliance", MOUNT), STUCK.with_effect("lash", {"delta": 2.0e-3})
    softer = Damper(base=(STUCK.base[0].model_copy(update={"k_N_per_m": 0.3 * K}),))
    assert secant(mount, 1e-6) == pytest.approx(1.0 / (1.0 / K + MOUNT["d_f"] / MOUNT["F_f"]), rel=2e-3)
    assert secant(mount, 4e-3) > 2.0 * secant(mount, 5e-4)
    assert secant(softer, 4e-3) == pytest.approx(secant(softer, 5e-4), rel=1e-9)
    assert secant(play, 5e-4) == 0.0
    force = respond(mount, sine(4e-3))
    np.testing.assert_allclose(force, -respond(mount, sine(-4e-3)), rtol=0, atol=1e-9)


@pytest.mark.parametrize("frame", [1e5, 2e6])
def test_a_linear_frame_is_a_smaller_k_and_no_effect(frame: float) -> None:
    """F = k e, x - y = e + F/k_f, so F = k k_f/(k + k_f) (x - y), always; not so with a spring beside."""
    softer = Damper(base=(STUCK.base[0].model_copy(update={"k_N_per_m": K * frame / (K + frame)}),))
    for amplitude in (1e-3, 2e-2):
        motion = sine(amplitude)
        force = force_in_frame(STUCK, motion, frame)
        np.testing.assert_allclose(force, respond(softer, motion), rtol=0, atol=1e-6 * np.max(np.abs(force)))
        spring = {"k_g": 2e4}
        behind = force_in_frame(STUCK.with_effect("gas_spring", spring), motion, frame)
        beside = respond(softer.with_effect("gas_spring", spring), motion)
        assert np.max(np.abs(behind - beside)) > 1e-3 * np.max(np.abs(behind))


def test_where_it_gives_far_more_than_it_hardens_over_it_is_the_linear_frame() -> None:
    """d_f and F_f to infinity at F_f/d_f = k_f."""
    frame, motion = 1e6, sine(2e-2)
    mount = STUCK.with_effect("frame_compliance", {"d_f": 0.1, "F_f": 0.1 * frame})
    force = respond(mount, motion)
    np.testing.assert_allclose(force, force_in_frame(STUCK, motion, frame), rtol=0, atol=0.02 * np.max(force))
