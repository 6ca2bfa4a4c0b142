"""A measured curve of force over velocity is a damper: in its table, in a ride, under either sign."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import pzd

mpl.use("Agg")

VELOCITY = np.array([-1.0, -0.5, -0.1, 0.0, 0.1, 0.5, 1.0])
FORCE = np.array([-700.0, -450.0, -200.0, 0.0, 400.0, 1200.0, 2000.0])
"""Softer in compression than in rebound, as of most road cars."""


def test_the_curve_passes_through_its_points_and_goes_on_straight() -> None:
    damper = pzd.Damper.from_curve(VELOCITY, FORCE)
    np.testing.assert_allclose(damper.curve(VELOCITY), FORCE, atol=1e-9)
    np.testing.assert_allclose(damper.curve([1.5, 2.0, -2.0]), [2800.0, 3600.0, -1200.0])
    fine = damper.curve(np.linspace(-1.5, 1.5, 601))
    assert np.all(np.diff(fine) > 0.0)
    assert isinstance(damper, pzd.Damper)
    assert damper.effects == {}


def test_either_sign_of_the_file_gives_the_same_damper() -> None:
    expected = pzd.Damper.from_curve(VELOCITY, FORCE).curve(VELOCITY)
    for velocity, force in ((-VELOCITY, -FORCE), (VELOCITY, -FORCE), (VELOCITY[::-1], -FORCE[::-1])):
        turned = pzd.Damper.from_curve(velocity, force, sign=-1)
        np.testing.assert_allclose(turned.curve(VELOCITY), expected, atol=1e-9)


def test_the_table_keeps_to_the_curve_within_its_tolerance() -> None:
    damper = pzd.Damper.from_curve(VELOCITY, FORCE)
    frame = pzd.table(damper).to_frame()
    np.testing.assert_allclose(frame["force_N"], damper.curve(frame["velocity_m_per_s"]), atol=1e-9)
    middles = 0.5 * (frame["velocity_m_per_s"].to_numpy()[1:] + frame["velocity_m_per_s"].to_numpy()[:-1])
    lines = 0.5 * (frame["force_N"].to_numpy()[1:] + frame["force_N"].to_numpy()[:-1])
    assert np.max(np.abs(lines - damper.curve(middles))) < 1e-3 * 2000.0
    assert set(VELOCITY) <= set(frame["velocity_m_per_s"])
    short = pzd.table(pzd.Damper.from_curve(0.3 * VELOCITY, FORCE)).to_frame()
    assert set(short["inside"][short["velocity_m_per_s"].abs() > 0.31]) == {0}


def test_a_straight_curve_rides_as_the_viscous_damper_that_it_is() -> None:
    by_curve = pzd.ride(pzd.Damper.from_curve([-1.0, 1.0], [-2500.0, 2500.0]), duration=6.0)
    by_law = pzd.ride(pzd.Damper({"T0_N": 0.0, "C_Ns_per_m": 2500.0, "k_N_per_m": 1e9}), fidelity="table", duration=6.0)
    assert by_curve.a_w == pytest.approx(by_law.a_w, rel=1e-9)
    assert by_curve.summary["fidelity"] == "table"
    assert by_curve.summary["energy_error"] == pytest.approx(0.0, abs=1e-6)


def test_a_damper_turned_over_shifts_the_mean_position_of_the_body() -> None:
    """Hard in rebound pulls the body down, hard in compression lifts it: the mean tells which way it was mounted."""
    means = [
        float(pzd.ride(pzd.Damper.from_curve(VELOCITY, force)).history["z_m"][4000:].mean())
        for force in (FORCE, -FORCE[::-1])
    ]
    assert means[0] < -1e-3 < 1e-3 < means[1]


def test_curves_by_a_control_signal_are_linear_between_and_can_be_controlled() -> None:
    damper = pzd.Damper.from_curve(VELOCITY, np.column_stack([2.0 * FORCE, FORCE]), voltage=[100.0, 0.0])
    assert damper.voltages == (0.0, 100.0)
    np.testing.assert_allclose(damper.curve(VELOCITY, voltage=50.0), 1.5 * FORCE, atol=1e-9)
    np.testing.assert_allclose(damper.curve([0.1, 0.1], voltage=[0.0, 100.0]), [400.0, 800.0])
    with pytest.raises(ValueError, match="voltage: the damper depends on it"):
        damper.curve([0.1])
    controlled = pzd.ride(damper, policy="comfort", duration=6.0)
    assert controlled.history["voltage_1_V"].nunique() > 2
    assert controlled.a_w < pzd.ride(damper, voltage=0.0, duration=6.0).a_w


def test_its_force_along_a_motion_has_no_memory() -> None:
    damper = pzd.Damper.from_curve(pd.Series(VELOCITY), FORCE.tolist())
    time = np.arange(2000) / 1000.0
    force = damper.force(time, 0.02 * np.sin(2.0 * np.pi * time))
    np.testing.assert_allclose(force, damper.curve(0.04 * np.pi * np.cos(2.0 * np.pi * time)), atol=0.5)
    assert "7 points" in repr(damper)
    assert len(damper.to_frame()) == 7
    assert damper.plot(Figure().subplots()).lines


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"force": -FORCE}, ValueError, "sign=-1"),
        ({"velocity": VELOCITY + 2.0}, ValueError, "below and above 0"),
        ({"velocity": np.abs(VELOCITY)}, ValueError, "stands twice"),
        ({"force": FORCE[:-1]}, ValueError, "as many as the first array"),
        ({"sign": 0}, ValueError, "1 or -1"),
        ({"force": np.column_stack([FORCE, FORCE])}, ValueError, "2 columns for 1"),
        ({"voltage": [0.0, 1.0]}, ValueError, "1 columns for 2"),
        ({"force": np.column_stack([FORCE, FORCE]), "voltage": [1.0, 1.0]}, ValueError, "stands twice"),
        ({"velocity": [0.0], "force": [0.0]}, ValueError, "2 points"),
        ({"velocity": 1e3 * VELOCITY}, ValueError, "mm/s"),
        ({"force": "curve.csv"}, TypeError, "array of numbers"),
        ({"force": np.where(VELOCITY > 0.4, np.nan, FORCE)}, ValueError, "no finite number"),
    ],
)
def test_what_is_no_curve_is_refused(change, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        pzd.Damper.from_curve(**{"velocity": VELOCITY, "force": FORCE, **change})


def test_a_force_in_another_unit_is_warned_of() -> None:
    with pytest.warns(UserWarning, match="N or kN"):
        pzd.Damper.from_curve(VELOCITY, 5e-4 * FORCE)


# ---------------------------------------------------------------- front and rear


def viscous(c: float) -> pzd.Damper:
    return pzd.Damper({"T0_N": 200.0, "C_Ns_per_m": c, "k_N_per_m": 3e5})


@pytest.mark.parametrize("fidelity", ["table", "dynamic"])
def test_a_pair_of_equal_dampers_rides_as_one_at_both_axles(fidelity: str) -> None:
    keys = {"fidelity": fidelity, "duration": 4.0}
    one, pair = pzd.ride(viscous(2500.0), **keys), pzd.ride((viscous(2500.0), viscous(2500.0)), **keys)
    assert pair.a_w == one.a_w
    pd.testing.assert_frame_equal(pair.history, one.history, check_exact=True)


@pytest.mark.parametrize("fidelity", ["table", "dynamic"])
def test_each_axle_has_the_force_of_its_own_damper(fidelity: str) -> None:
    """At high speed the force of each axle over its rate is that of its damper: 2 to 1, and 1 to 2 the other way."""
    soft, hard = viscous(1500.0), viscous(4500.0)
    front, rear = (pzd.ride(pair, fidelity=fidelity, duration=4.0) for pair in ((hard, soft), [soft, hard]))
    for ride, harder in ((front, 1), (rear, 2)):
        slopes = {}
        for axle in (1, 2):
            rate, force = ride.history[f"deflection_rate_{axle}_m_per_s"], ride.history[f"damper_force_{axle}_N"]
            fast = rate.abs() > 0.5 * rate.abs().max()
            slopes[axle] = float((force[fast] * rate[fast]).sum() / (rate[fast] ** 2).sum())
        assert slopes[harder] > 2.0 * slopes[3 - harder]
        assert abs(ride.summary["energy_error"]) < 1e-6
    assert front.a_w != rear.a_w


def test_a_curve_and_a_law_may_ride_together_by_their_tables() -> None:
    straight = pzd.Damper.from_curve([-1.0, 1.0], [-2500.0, 2500.0])
    law = pzd.Damper({"T0_N": 0.0, "C_Ns_per_m": 2500.0, "k_N_per_m": 1e9})
    mixed, alone = pzd.ride((straight, law), duration=4.0), pzd.ride(law, fidelity="table", duration=4.0)
    assert mixed.a_w == pytest.approx(alone.a_w, rel=1e-9)


@pytest.mark.parametrize(
    ("pair", "keys", "error", "words"),
    [
        ((viscous(1e3), 3), {}, TypeError, "front and rear"),
        ((viscous(1e3),) * 3, {}, TypeError, "front and rear"),
        ((viscous(1e3), pzd.Damper.from_curve(VELOCITY, FORCE, voltage=1.0)), {}, ValueError, "has a control signal"),
        (
            (viscous(1e3), pzd.Damper.from_curve(VELOCITY, FORCE, control=("current", "A"))),
            {},
            ValueError,
            "other names",
        ),
    ],
)
def test_a_pair_that_cannot_ride_is_refused(pair, keys, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        pzd.ride(pair, duration=4.0, **keys)
