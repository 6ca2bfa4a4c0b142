"""The pocket: its distinction from a free play and an asymmetry by a slow sine."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper.compose import respond, steady_force
from pzd.damper.effects.cavitation import inverse, law, slope
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion

PLAIN = Damper(base=(BaseRow(T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),))
POCKET = {"d_c": 2.0e-3, "F_c": 80.0}
SAMPLES = 2000


def last_cycle(effects: dict[str, dict[str, float]], middle: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Speed and force over the last of three cycles of a slow sine."""
    time = np.linspace(0.0, 6.0, 3 * SAMPLES + 1)
    w = np.pi
    x, v = middle + 0.02 * np.sin(w * time), 0.02 * w * np.cos(w * time)
    force = respond(PLAIN.model_copy(update={"effects": effects}), Motion(time, x, v, -(w**2) * x, None))
    return v[-SAMPLES:], force[-SAMPLES:]


def even_part(force: np.ndarray) -> float:
    """Largest even harmonic as a share of the first."""
    size = np.abs(np.fft.rfft(force))
    return float(np.max(size[2:40:2]) / size[1])


def test_even_harmonics_distinguish_a_pocket_from_a_free_play_at_any_zero() -> None:
    for middle in (0.0, 0.013):
        assert even_part(last_cycle({"lash": {"delta": 2.0e-3}}, middle)[1]) < 1e-6
        assert even_part(last_cycle({"frame_compliance": {"d_f": 1.0e-3, "F_f": 80.0}}, middle)[1]) < 1e-6
    assert even_part(last_cycle({"cavitation": POCKET})[1]) > 0.01


def test_the_plateaus_distinguish_a_pocket_from_an_asymmetry() -> None:
    """Where the speed is largest the oil has long been slipping: both ways alike, with a pocket; apart, without."""

    def both_ways(effects: dict[str, dict[str, float]]) -> float:
        v, force = last_cycle(effects)
        return float(-force[np.argmax(v)] / force[np.argmin(v)])

    assert both_ways({"cavitation": POCKET}) == pytest.approx(1.0, abs=1e-3)
    assert both_ways({"asymmetry": {"alpha": 0.05}}) == pytest.approx(1.05 / 0.95, rel=1e-3)
    for speed in (-0.3, 0.3):
        plain, pocket = (
            steady_force(damper, None, None, speed) for damper in (PLAIN, PLAIN.with_effect("cavitation", POCKET))
        )
        assert pocket == plain


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_cavitation_is_a_boyle_pocket_on_its_side_and_rigid_on_the_other(side: float) -> None:
    """The pocket of length d_c at a pressure p_c has the length d_c p_c/p under p, and p - p_c presses on A."""
    k, area, pressure = 2e5, 1e-3, 8e4
    for force in (0.0, 10.0, 100.0, 2000.0):
        squeezed = 2e-3 - 2e-3 * pressure / (pressure + force / area)
        total = side * (force / k + squeezed)
        assert law(total, side, k, side * 2e-3, pressure * area) == pytest.approx(side * force / k, abs=1e-15)
        assert law(total, side, k, -side * 2e-3, pressure * area) == total


@pytest.mark.parametrize("d_c", [-3e-3, 1e-9, 2e-3])
def test_law_and_slope_of_a_pocket_are_those_of_its_inverse_to_rounding(d_c: float) -> None:
    for k, F_c in ((2e5, 0.02), (2e5, 20.0), (2e5, 2e5), (1e13, 200.0)):
        for e in (-1e-2, -1e-4, -1e-9, 1e-9, 1e-4, 1e-2):
            for side in (-1.0, 1.0):  # the other side too: a free play before it is looked for there
                s = law(e, side, k, d_c, F_c)
                assert inverse(s, side, k, d_c, F_c) == pytest.approx(e, rel=1e-12)
                step = 1e-6 * e
                rise = (law(e + step, side, k, d_c, F_c) - law(e - step, side, k, d_c, F_c)) / (2.0 * step)
                assert rise == pytest.approx(slope(e, side, k, d_c, F_c), rel=1e-4)
