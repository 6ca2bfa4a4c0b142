"""A delay is found where there is one, and a damper without the oil spring is not taken for a late sensor."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.artefacts import Finding, RecordEntry
from pzd.damper.element import element_force
from pzd.record import Array, Record
from pzd.rig.config import Limits
from pzd.rig.preflight import PreflightRecord, force, reference
from pzd.rig.preflight.force import delay, explain_offsets
from pzd.rig.preflight.reference import ReferenceFit, Section
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics

TIME = np.arange(8000) * 1e-3


def measured(x: Array, recorded: Array) -> PreflightRecord:
    run = cycles(TIME, x)
    clean = kinematics(TIME, x, run)
    return PreflightRecord(
        Record("a", None, TIME, x, clean.velocity, clean.acceleration, recorded), run, clean, Limits()
    )


def random_motion(rng: np.random.Generator) -> Array:
    hertz = np.fft.rfftfreq(2 * TIME.size, 1e-3)
    spectrum = rng.standard_normal(hertz.size) * np.exp(2j * np.pi * rng.random(hertz.size)) / np.maximum(hertz, 0.3)
    x = np.fft.irfft(np.where((hertz > 0.3) & (hertz < 12.0), spectrum, 0.0), 2 * TIME.size)[: TIME.size]
    return np.asarray(0.012 * x / np.abs(x).max())


@pytest.mark.parametrize("rounded_at", [0.005, 0.01, 0.02, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("motion", ["1 Hz", "2 Hz", "5 Hz", "random"])
def test_a_rigid_damper_with_sigmoid_friction_is_not_late(
    motion: str, rounded_at: float, rng: np.random.Generator
) -> None:
    x = random_motion(rng) if motion == "random" else 0.01 * np.sin(2.0 * np.pi * float(motion[0]) * TIME)
    v = np.gradient(x, TIME)
    for noise in (0.0, 5.0):
        damping = 900.0 * v + 200.0 * np.tanh(v / rounded_at) + noise * rng.standard_normal(TIME.size)
        assert list(delay(measured(x, damping))) == []


@pytest.mark.parametrize(("late", "at_edge"), [(0.08, False), (0.12, True)])
def test_a_delay_at_the_edge_of_the_search_is_told_as_such(
    late: float, at_edge: bool, rng: np.random.Generator
) -> None:
    x = random_motion(rng)
    force = np.interp(TIME - late, TIME, element_force(x, 1e-3, 200.0, 900.0, 4e5))
    (told,) = delay(measured(x, force))
    assert ("at the edge of the search: it may be more" in told.where) == at_edge
    assert told.size == pytest.approx(0.1 if at_edge else late, abs=5e-3)


def test_delays_are_looked_for_only_where_the_element_leaves_something(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    x = 0.01 * np.sin(2.0 * np.pi * 2.0 * TIME)
    other = 500.0 * rng.standard_normal(TIME.size)
    asked: list[int] = []
    search = reference.fit_element

    def counted(section: Section, forces: Array) -> ReferenceFit:
        asked.append(len(forces))
        return search(section, forces)

    for module in (force, reference):
        monkeypatch.setattr(module, "fit_element", counted)
    assert list(delay(measured(x, element_force(x, 1e-3, 300.0, 2500.0, 2e5)))) == []
    assert asked == [1]  # the undelayed fit alone
    list(delay(measured(x, other)))
    assert asked[2:] == [61, *[21] * (len(asked) - 3)]


def explained(offsets: list[float], speeds: list[float] | None = None) -> list[str]:
    """What the preflight says of tests with these offsets, at speeds in no order with them unless some are given."""
    given = speeds or [0.1 * (1 + n % 3) for n in range(len(offsets))]
    entries = [
        RecordEntry(
            name=f"test {n}",
            setting=None,
            voltage_V=None,
            temperature_degC=None,
            rate_Hz=500.0,
            cycles=6.0,
            velocity_rms_m_per_s=given[n],
            force_rms_N=100.0 * (1 + n % 3),
            findings=(Finding(check="offset", where="force", size=size, unit="N", follows="at first"),),
        )
        for n, size in enumerate(offsets)
    ]
    return [entry.findings[0].follows for entry in explain_offsets(tuple(entries))]


def test_the_middle_of_two_groups_of_offsets_is_no_usual_one() -> None:
    """No file has it, and taken out it would leave two wrong offsets."""
    assert explained([-149.8, -149.8, -149.9, -79.9, -79.9, -79.8]) == ["at first"] * 6
    told = explained([-149.8, -149.8, -149.9, -149.7, -149.8, -20.0])
    assert told[5].startswith("-149.8 N is usual in this setting: a tare that changed")


@pytest.mark.parametrize("gas", [8000.0, -8000.0])
def test_a_steady_force_towards_rebound_asks_which_way_is_rebound(gas: float) -> None:
    """A gas pushes the rod out; where both signs are turned it seems to pull it in."""
    falls = [gas * (1.0 - 0.05 * n) for n in range(6)]
    for told in (explained([gas] * 6), explained(falls, [0.1 * (1 + n) for n in range(6)])):
        assert all("in all 6 records of this setting, as a preload or a gas force is" in each for each in told)
        assert all(("which way is rebound" in each) is (gas > 0.0) for each in told)


def test_an_offset_that_comes_with_the_speed_alone_is_no_gas() -> None:
    told = explained([20.0 * n for n in range(1, 7)], [0.1 * n for n in range(1, 7)])
    assert all(each.startswith("it goes with the speed of the test, as where rebound is unlike") for each in told)


def test_a_test_whose_control_signal_moves_says_nothing_of_an_offset() -> None:
    entries = tuple(
        RecordEntry(
            name=f"test {n}",
            setting=None,
            voltage_V=1.0,
            temperature_degC=None,
            rate_Hz=500.0,
            cycles=6.0,
            control_moves=n == 4,
            findings=() if n == 4 else (Finding(check="offset", where="force", size=-200.0, unit="N", follows=""),),
        )
        for n in range(5)
    )
    told = [entry.findings[0].follows for entry in explain_offsets(entries) if entry.findings]
    assert all("alike in all 4 records of this setting, as a preload or a gas force is" in each for each in told)
