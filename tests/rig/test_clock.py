"""Stamps of few digits: the clock behind them is found, and a clock that wavers is left as it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from written_files import lines, run, write

from pzd.damper.element import element_force
from pzd.record import Array

AMPLITUDE, FREQUENCY = 0.02, 1.0


def recorded(time: Array, stamps: Array) -> list[str]:
    """The lines of a file: a sine as it was at some moments [s], beside what the clock says of them."""
    x = AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * time)
    force = element_force(x, float(np.median(np.diff(time))), 300.0, 2700.0, 2e5)
    return lines({"time_s": stamps, "displacement_m": x, "force_N": force, "voltage_V": np.full(time.size, 100.0)})


@pytest.mark.parametrize("rate", [512.0, 300.0, 700.0])
@pytest.mark.parametrize("down", [np.round, np.floor], ids=["rounded", "cut off"])
def test_a_speed_derived_over_rounded_stamps_is_that_of_the_clock_behind_them(
    tmp_path: Path, rate: float, down: np.ufunc
) -> None:
    """Left as they are, stamps of 1 ms scatter the speed of a 512 Hz record by 2 % and more."""
    time = np.arange(4000) / rate
    write(tmp_path / "a.csv", recorded(time, down(time * 1e3) / 1e3))
    rig = run(tmp_path)
    (record,) = rig.records
    inside = slice(100, -100)
    about = record.time - record.time[0]
    assert np.max(np.abs(about - time)) < 1e-4
    speed = 2.0 * np.pi * FREQUENCY * AMPLITUDE
    exact = speed * np.cos(2.0 * np.pi * FREQUENCY * time)
    assert np.max(np.abs(record.velocity - exact)[inside]) < 1e-3 * speed
    (said,) = [row for row in rig.ingested if row.step == "clock"]
    assert said.was == "stamps rounded to 0.001 s"
    assert said.became.startswith(f"a regular clock of {rate:.4g}")


@pytest.mark.parametrize("clock", ["even", "wavers", "gap", "two rates"])
def test_a_clock_that_is_not_rounded_is_left_as_it_is(tmp_path: Path, clock: str, rng: np.random.Generator) -> None:
    time = np.arange(2000) / 500.0
    if clock == "wavers":
        time = time + 2e-4 * rng.uniform(-1.0, 1.0, time.size)
    elif clock == "gap":
        time[1000:] += 0.002
    elif clock == "two rates":
        time[1000:] = time[1000] + np.arange(1000) / 400.0
    write(tmp_path / "a.csv", recorded(time, time))
    rig = run(tmp_path)
    np.testing.assert_allclose(rig.records[0].time, time, atol=1e-8)
    assert not [row for row in rig.ingested if row.step == "clock"]
