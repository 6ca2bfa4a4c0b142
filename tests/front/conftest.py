"""A damper with something hidden in it, and its tests: as arrays, and as files of a rig."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import pzd

RATE = 500.0
SECONDS = 4.0
MOTIONS = ((1.0, 0.01), (1.0, 0.03), (2.0, 0.03))
"""Frequency [Hz] and amplitude [m] of the sines."""


@pytest.fixture(scope="session")
def hidden() -> pzd.Damper:
    """A damper whose control signal is a current, with an orifice that no Bingham element has."""
    base = [
        {"current_A": 0.0, "T0_N": 300, "C_Ns_per_m": 2700, "k_N_per_m": 2e5},
        {"current_A": 1.5, "T0_N": 800, "C_Ns_per_m": 3000, "k_N_per_m": 3.7e5},
    ]
    return pzd.Damper(base, {"orifice_quadratic": {"q": 2500.0}}, control=("current", "A"))


@pytest.fixture(scope="session")
def arrays(hidden: pzd.Damper, generator_for) -> list[dict[str, object]]:
    """Arguments of `pzd.Test`, one mapping a test; the current is a number, the temperature an array."""
    rng = generator_for("tests of the front door")
    time = np.arange(round(RATE * SECONDS)) / RATE
    found = []
    for current in (0.0, 1.5):
        for n, (frequency, amplitude) in enumerate(MOTIONS):
            displacement = amplitude * np.sin(2.0 * np.pi * frequency * time)
            force = hidden.force(time, displacement, voltage=current) + 5.0 * rng.standard_normal(time.size)
            measured = displacement + 2e-6 * rng.standard_normal(time.size)
            warm = np.full(time.size, 22.0)
            labels = {"voltage": current, "temperature": warm, "setting": "new", "name": f"r{n}-{current:g}A"}
            found.append({"time": time, "displacement": measured, "force": force, **labels})
    return found


@pytest.fixture(scope="session")
def tests(arrays: list[dict[str, object]]) -> list[pzd.Test]:
    """The same as tests."""
    return [pzd.Test(**each) for each in arrays]


@pytest.fixture(scope="session")
def rig_files(arrays: list[dict[str, object]], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as files of a rig in millimetres and kilonewtons, current and setting in their names."""
    folder = tmp_path_factory.mktemp("rig")
    for each in arrays:
        table = pd.DataFrame(
            {
                "t": each["time"],
                "pos": 1000.0 * each["displacement"],
                "load": each["force"] / 1000.0,
                "temperature_degC": each["temperature"],
            }
        )
        table.to_csv(folder / f"{each['name']}-new.csv", index=False)
    return folder
