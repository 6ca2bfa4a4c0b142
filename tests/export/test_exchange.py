"""The FMUs for model exchange: integrated by CVode, the solver of SUNDIALS, they do what our own damper does."""

from __future__ import annotations

import io
import math
import shutil
import zipfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from exported_dampers import EXPORTED, base, content_of, with_effects

from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.export.dynamics import OF_THE_RIG, Dynamics, no_exchange, states_of
from pzd.export.formats import Files, formats

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed: pip install fmpy")
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed: apt-get install gcc")
SOLVED = {name: damper for name, damper in EXPORTED.items() if no_exchange(damper) is None}
SOLVED["all but the play"] = with_effects(
    EXPORTED["all"].without_effects("piezo_hysteresis", "second_branch"), second_branch={"T0_2": 150.0, "k_2": 6e4}
)
QUICK = ("plain", "all but the play")
RATE, SHOWN = 8000.0, 16
"""Samples a second of the inputs, between which the importer interpolates; every how many the force is compared."""
FORCE = 4


@pytest.fixture(autouse=True)
def inputs_at_every_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let FMPy set the inputs where CVode asks for rates: it sets them where it asks for indicators alone."""
    from fmpy.sundials import CVodeSolver

    plain = CVodeSolver.f

    def f(self: Any, t: float, *rest: Any) -> int:
        self.input.apply(t)
        return int(plain(self, t, *rest))

    monkeypatch.setattr(CVodeSolver, "f", f)


@cache
def files(name: str) -> Files:
    """The FMUs of a damper."""
    return formats()["fmu"].files(content_of(SOLVED[name]))


def motion() -> Motion:
    """A sine that turns four times, while control signal and temperature move."""
    time = np.arange(round(RATE) + 1) / RATE
    w, amplitude = 4.0 * math.pi, 0.02
    x, v = amplitude * np.sin(w * time), amplitude * w * np.cos(w * time)
    return Motion(time, x, v, -w * w * x, 75.0 + 75.0 * np.sin(9.0 * time), 20.0 + 10.0 * time)


def inputs(path: Path, moved: Motion) -> np.ndarray:
    """The motion as the FMU names its inputs."""
    columns = {
        "displacement_m": moved.displacement,
        "velocity_m_per_s": moved.velocity,
        "acceleration_m_per_s2": moved.acceleration,
        "voltage_V": moved.voltage,
        "temperature_degC": moved.temperature,
    }
    names = [one.name for one in fmpy.read_model_description(path).modelVariables if one.causality == "input"]
    given = {name: next(values for key, values in columns.items() if key.startswith(name)) for name in names}
    found = np.zeros(moved.time.size, dtype=[("time", float), *((name, float) for name in names)])
    found["time"] = moved.time
    for name, values in given.items():
        found[name] = values
    return found


def written(name: str, version: int, folder: Path) -> Path:
    """The FMU of a damper, which FMPy finds valid."""
    from fmpy.validation import validate_fmu

    path = folder / f"{version}.fmu"
    path.write_bytes(files(name)[f"my-run-fmi{version}.fmu"])
    assert validate_fmu(path) == []
    return path


def forces(path: Path, given: np.ndarray, tolerance: float, **more: Any) -> np.ndarray:
    """Forces at every `SHOWN`-th sample, by CVode."""
    found = fmpy.simulate_fmu(
        path,
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=tolerance,
        output_interval=SHOWN / RATE,
        stop_time=float(given["time"][-1]),
        input=given,
        output=["force"],
        record_events=False,
        **more,
    )
    return np.asarray(found["force"])


@needs_gcc
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.ci) for name in SOLVED]
)
def test_a_solver_comes_to_our_force_as_far_as_its_tolerance_goes(name: str, version: int, tmp_path: Path) -> None:
    damper, moved = SOLVED[name], motion()
    if damper.base[0].voltage_V is None:
        moved = Motion(moved.time, moved.displacement, moved.velocity, moved.acceleration)
    ours = respond(damper.without_effects(*OF_THE_RIG), moved)[::SHOWN]
    path = written(name, version, tmp_path)
    given = inputs(path, motion())
    errors = [float(np.max(np.abs(forces(path, given, at) - ours))) for at in (1e-5, 1e-8)]
    peak = float(np.max(np.abs(ours)))
    assert errors[0] <= 1e-3 * peak
    assert errors[1] <= 3e-6 * peak
    assert errors[1] < 0.3 * errors[0]


@needs_gcc
@pytest.mark.parametrize("version", [2, 3])
def test_a_switched_signal_and_an_initial_force_are_taken(version: int, tmp_path: Path) -> None:
    time = np.array([0.0, 0.1, 0.1, 0.25])
    given = np.zeros(4, dtype=[(name, float) for name in ("time", "displacement", "velocity", "voltage")])
    given["time"], given["velocity"], given["displacement"] = time, 0.02, 0.02 * time
    given["voltage"] = [0.0, 0.0, 150.0, 150.0]
    path = written("plain", version, tmp_path)
    found = forces(path, given, 1e-9, start_values={"initial_force": 200.0})
    shown = np.linspace(0.0, 0.25, found.size)
    t = np.sort(np.concatenate([np.linspace(0.0, 0.25, 4001), [0.1 - 1e-10], shown]))
    t = t[np.append(True, np.diff(t) > 1e-12)]
    still = np.zeros(t.size)
    steady = Motion(t, 0.02 * t, still + 0.02, still, np.where(t < 0.1 - 1e-12, 0.0, 150.0), still + 22.0)
    ours = np.interp(shown, t, respond(SOLVED["plain"], steady, 200.0))
    assert found[0] == pytest.approx(200.0, rel=1e-9)
    away = np.abs(shown - 0.1) > 1e-6  # the force jumps there
    np.testing.assert_allclose(found[away], ours[away], atol=1e-5 * np.max(ours))


def instance(name: str, version: int, folder: Path) -> Iterator[Any]:
    """An instance for model exchange in its continuous mode."""
    from fmpy import fmi2, fmi3

    path = written(name, version, folder)
    description = fmpy.read_model_description(path)
    one = {2: fmi2.FMU2Model, 3: fmi3.FMU3Model}[version](
        guid=description.guid,
        unzipDirectory=fmpy.extract(path, unzipdir=folder / f"fmi{version}"),
        modelIdentifier=description.modelExchange.modelIdentifier,
        instanceName="it",
    )
    one.instantiate()
    if version == 2:
        one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    yield one
    one.exitInitializationMode()
    one.enterContinuousTimeMode()
    yield one
    one.terminate()
    one.freeInstance()


@needs_gcc
@pytest.mark.parametrize("version", [2, 3])
def test_derivatives_of_rates_and_force_by_states_are_those_of_the_equations(version: int, tmp_path: Path) -> None:
    opened = instance("lagged", version, tmp_path)
    one = next(opened)
    put = one.setReal if version == 2 else one.setFloat64
    put([0, 1, 2, 5], [0.0, 0.3, 50.0, 400.0])
    one = next(opened)
    deflection, rate, signal, signal_rate = 9, 10, 11, 12
    k, C, tau = 2e5, 1000.0, 0.01
    derivative = {
        (FORCE, deflection): k,
        (rate, deflection): -k / C,  # de/dt = u - (F - T0)/C in slip
        (rate, 1): 1.0,
        (signal_rate, 2): 1.0 / tau,
        (signal_rate, signal): -1.0 / tau,
        (rate, signal): 2.0 / C,  # T0 rises by 2 N a volt
    }
    for (unknown, known), slope in derivative.items():
        found = one.getDirectionalDerivative([unknown], [known], [1.0])[0]
        assert found == pytest.approx(slope, rel=1e-5), (unknown, known)
    next(opened, None)


SOLVED["lagged"] = Damper(
    base=base((0.0, None, 100.0, 1000.0, 2e5), (100.0, None, 300.0, 1000.0, 2e5)), effects={"valve_lag": {"tau": 0.01}}
)


def test_each_effect_of_the_drive_has_a_state_and_its_nominal_value() -> None:
    found = states_of(SOLVED["lagged"], Dynamics.of(SOLVED["lagged"]))
    assert [(one.name, one.nominal) for one in found] == [
        ("deflection", pytest.approx((300.0 + 1000.0) / 2e5)),
        ("valve_lag_signal", 100.0),
    ]


@needs_gcc
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("play", "piezo_hysteresis follows the rate of the control signal"),
        ("beside", "second_branch changes with the control signal"),
    ],
)
def test_what_no_rate_describes_leaves_co_simulation_alone_and_says_why(
    name: str, reason: str, caplog: pytest.LogCaptureFixture
) -> None:
    written = formats()["fmu"].files(content_of(EXPORTED[name]))
    assert f"without model exchange: {reason}" in caplog.text
    for data in written.values():
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            description = ET.fromstring(archive.read("modelDescription.xml"))
        assert description.find("CoSimulation") is not None
        assert description.find("ModelExchange") is None
