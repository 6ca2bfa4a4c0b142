"""The FMUs, validated and run by FMPy and driven by hand, do what our own damper does under the same held inputs."""

from __future__ import annotations

import ctypes
import io
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from exported_dampers import DAMPERS, EXPORTED, content_of

from pzd.damper.compose import respond
from pzd.damper.effects import library
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.export.content import Content
from pzd.export.dynamics import OF_THE_RIG, Dynamics, data_of
from pzd.export.formats import Files, formats
from pzd.schema.errors import FilesError

GCC = shutil.which("gcc")
needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not installed: apt-get install gcc")
STRICT = ("-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wno-unused-parameter")
STEPS = 1500
INPUTS = ("displacement", "velocity", "acceleration", "voltage", "temperature")
RAMP, BEHIND_A_LAG = 1e-12, 1e-10
"""Time in which our own simulation, whose inputs move linearly, goes from one held input to the next [s]. The rod of a
rigid damper may go 1e-15 m too far in the first, a millionth of a newton; longer ones show where it creeps afterwards.
The law of a lag divides by the step, so that a shorter one than the second shows its rounding."""


QUICK = ("plain", "all")
"""Those for the gate: the element, and every effect. Each is compiled."""


@dataclass(frozen=True)
class Held:
    """Inputs held over steps of any size; every array is (n,), the displacement that at the start of each step."""

    step: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    voltage: np.ndarray
    temperature: np.ndarray

    def motion(self, damper: Damper) -> tuple[Motion, np.ndarray]:
        """The same for our own simulation, and the samples at the end of each step."""
        n, start = self.step.size, np.concatenate([[0.0], np.cumsum(self.step)])
        ramp = BEHIND_A_LAG if "valve_lag" in damper.effects else RAMP
        time = np.column_stack([start[:-1] + ramp, start[1:]]).ravel()
        time[0] = 0.0
        gone = np.column_stack([np.append(0.0, np.full(n - 1, ramp)), self.step]) * self.velocity[:, np.newaxis]
        twice = {name: np.repeat(getattr(self, name), 2) for name in INPUTS[1:]}
        controlled = damper.base[0].voltage_V is not None
        return Motion(
            time,
            (self.displacement[:, np.newaxis] + gone).ravel(),
            twice["velocity"],
            twice["acceleration"],
            twice["voltage"] if controlled else None,
            twice["temperature"] if controlled else None,
        ), np.arange(1, 2 * n, 2)


def held_inputs(rng: np.random.Generator) -> Held:
    """Steps of 0.1 to 20 ms with every kind of velocity: smooth, jumping, standing still, and turning round."""
    step = 10.0 ** rng.uniform(-4.0, -1.7, STEPS)
    time = np.cumsum(step)
    velocity = 0.3 * np.sin(7.0 * time) + 0.1 * np.sin(41.0 * time)
    velocity[::7] = rng.normal(0.0, 0.4, velocity[::7].size)
    velocity[::31] = 0.0
    displacement = np.concatenate([[0.001], 0.001 + np.cumsum(velocity * step)[:-1]])
    velocity = np.where(np.abs(displacement) > 0.05, -np.sign(displacement) * np.abs(velocity), velocity)
    displacement = np.concatenate([[0.001], 0.001 + np.cumsum(velocity * step)[:-1]])
    voltage = np.repeat(rng.uniform(-20.0, 170.0, STEPS // 5), 5)
    temperature = np.repeat(rng.uniform(10.0, 70.0, STEPS // 20), 20)
    return Held(step, displacement, velocity, rng.normal(0.0, 20.0, STEPS), voltage, temperature)


@cache
def exported(name: str) -> tuple[Content, Files]:
    """One of the exact dampers, and its FMUs."""
    content = content_of(EXPORTED[name])
    return content, formats()["fmu"].files(content)


def inputs_of(name: str, held: Held) -> tuple[list[int], list[list[float]]]:
    """Value references of the inputs, and what is set before each step."""
    content, _ = exported(name)
    columns = {0: held.displacement, 1: held.velocity}
    columns |= {2: held.voltage} if content.controlled else {}
    columns |= {3: held.temperature} if Dynamics.of(content.damper).depends_on_temperature else {}
    columns |= {8: held.acceleration} if "fluid_inertia" in content.damper.effects else {}
    return list(columns), np.column_stack(list(columns.values())).tolist()


def slave_of(version: int, name: str, folder: Path, **given: Any) -> Any:
    """An instance by FMPy, which validates the FMU first, before its initialisation."""
    fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed: pip install fmpy")
    from fmpy import fmi2, fmi3
    from fmpy.validation import validate_fmu

    path = folder / f"my-run-fmi{version}.fmu"
    path.write_bytes(exported(name)[1][path.name])
    assert validate_fmu(path) == []
    description = fmpy.read_model_description(path)
    slave = {2: fmi2.FMU2Slave, 3: fmi3.FMU3Slave}[version](
        guid=description.guid,
        unzipDirectory=fmpy.extract(path, unzipdir=folder / f"fmi{version}"),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="it",
    )
    slave.instantiate(**given)
    if version == 2:
        slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    return slave


def run_by_fmpy(version: int) -> Callable[[str, Held, Path], np.ndarray]:
    """Forces at the end of each step by FMPy."""

    def run(name: str, held: Held, folder: Path) -> np.ndarray:
        slave = slave_of(version, name, folder)
        put, got = (slave.setReal, slave.getReal) if version == 2 else (slave.setFloat64, slave.getFloat64)
        references, given = inputs_of(name, held)
        put(references, given[0])
        slave.exitInitializationMode()
        forces, time = [], 0.0
        for step, values in zip(held.step, given, strict=True):
            put(references, values)
            slave.doStep(currentCommunicationPoint=time, communicationStepSize=step)
            time += step
            forces.append(got([4])[0])
        slave.terminate()
        slave.freeInstance()
        return np.array(forces)

    return run


def run_by_hand(name: str, held: Held, folder: Path) -> np.ndarray:
    """The same through the functions of FMI 3.0, without any other tool."""
    with zipfile.ZipFile(io.BytesIO(exported(name)[1]["my-run-fmi3.fmu"])) as archive:
        token = ET.fromstring(archive.read("modelDescription.xml")).attrib["instantiationToken"].encode()
        (member,) = [name for name in archive.namelist() if name.startswith("binaries/")]
        shared = ctypes.CDLL(archive.extract(member, tempfile.mkdtemp(dir=folder)))
    real, size, pointer, flag = ctypes.c_double, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_bool
    begin = shared.fmi3InstantiateCoSimulation
    begin.restype = pointer
    begin.argtypes = [*[ctypes.c_char_p] * 3, *[flag] * 4, pointer, size, *[pointer] * 3]
    shared.fmi3EnterInitializationMode.argtypes = [pointer, flag, real, real, flag, real]
    shared.fmi3ExitInitializationMode.argtypes = shared.fmi3FreeInstance.argtypes = [pointer]
    shared.fmi3DoStep.argtypes = [pointer, real, real, flag, *[pointer] * 4]
    shared.fmi3SetFloat64.argtypes = shared.fmi3GetFloat64.argtypes = [pointer, pointer, size, pointer, size]
    nothing = (None, False, False, False, False, None, 0, None, None, None)
    assert begin(b"it", b"another token", *nothing) is None
    one = begin(b"it", token, *nothing)
    assert shared.fmi3EnterInitializationMode(one, False, 0.0, 0.0, False, 0.0) == 0
    flags, reached, force, wanted = (flag * 3)(), (real * 1)(), (real * 1)(), (ctypes.c_uint32 * 1)(4)
    places, forces, time = [ctypes.addressof(flags) + n for n in range(3)], [], 0.0
    inputs, given = inputs_of(name, held)
    count, references = len(inputs), (ctypes.c_uint32 * len(inputs))(*inputs)
    for i, step in enumerate(held.step):
        assert shared.fmi3SetFloat64(one, references, count, (real * count)(*given[i]), count) == 0
        assert i > 0 or shared.fmi3ExitInitializationMode(one) == 0
        assert shared.fmi3DoStep(one, time, step, True, *places, reached) == 0
        assert shared.fmi3GetFloat64(one, wanted, 1, force, 1) == 0
        time = reached[0]
        forces.append(force[0])
    shared.fmi3FreeInstance(one)
    return np.array(forces)


RUNS: dict[str, Callable[[str, Held, Path], np.ndarray]] = {
    "FMPy, FMI 2.0": run_by_fmpy(2),
    "FMPy, FMI 3.0": run_by_fmpy(3),
    "by hand": run_by_hand,
}


@needs_gcc
@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.ci) for name in EXPORTED]
)
def test_the_force_is_that_of_our_own_simulation(name: str, run: str, tmp_path: Path, rng: np.random.Generator) -> None:
    damper, held = EXPORTED[name], held_inputs(rng)
    found = RUNS[run](name, held, tmp_path)
    motion, ends = held.motion(damper)
    rigless = {effect: values for effect, values in damper.effects.items() if effect not in OF_THE_RIG}
    ours = respond(damper.model_copy(update={"effects": rigless}), motion)[ends]
    assert ours.size == STEPS >= 1000
    assert np.max(np.abs(found - ours)) <= 1e-6 * np.max(np.abs(ours))


@needs_gcc
def test_a_constant_signal_is_the_closed_form_of_the_element(tmp_path: Path, rng: np.random.Generator) -> None:
    damper = EXPORTED["plain"]
    held = replace(held_inputs(rng), voltage=np.full(STEPS, 100.0), temperature=np.full(STEPS, 22.0))
    motion, ends = held.motion(damper)
    ours = respond(damper, motion)[ends]
    found = run_by_hand("plain", held, tmp_path)
    assert np.max(np.abs(found - ours)) <= 1e-7 * np.max(np.abs(ours))


def cut(held: Held, parts: int) -> Held:
    """The same inputs over steps of so many parts."""
    share = np.arange(STEPS * parts) % parts * np.repeat(held.step, parts) / parts
    many = {field: np.repeat(getattr(held, field), parts) for field in INPUTS}
    moved = many.pop("displacement") + share * many["velocity"]
    return Held(np.repeat(held.step, parts) / parts, moved, **many)


def forces_in_parts(name: str, held: Held, parts: int, folder: Path) -> np.ndarray:
    """Forces at the end of each step, of which each is made in so many parts."""
    return run_by_hand(name, cut(held, parts), folder)[parts - 1 :: parts]


@needs_gcc
@pytest.mark.parametrize("name", ["plain", "all but the lag"])
def test_the_size_of_the_step_adds_no_error_while_the_inputs_are_held(
    name: str, tmp_path: Path, rng: np.random.Generator
) -> None:
    held = held_inputs(rng)
    whole, pieces = (forces_in_parts(name, held, parts, tmp_path) for parts in (1, 5))
    assert np.max(np.abs(whole - pieces)) <= 1e-6 * np.max(np.abs(whole))


@needs_gcc
def test_behind_a_lag_the_error_falls_with_the_square_of_the_step(tmp_path: Path, rng: np.random.Generator) -> None:
    held = held_inputs(rng)
    coarse, middle, fine = (forces_in_parts("lag", held, parts, tmp_path) for parts in (8, 16, 32))
    order = np.log2(np.sqrt(np.mean((coarse - middle) ** 2) / np.mean((middle - fine) ** 2)))
    assert 1.7 < order < 2.3


def test_the_dampers_have_every_effect_of_the_library() -> None:
    assert {effect for damper in EXPORTED.values() for effect in damper.effects} >= set(library())


@needs_gcc
@pytest.mark.parametrize("version", [2, 3])
def test_the_sources_compile_without_a_warning(version: int, tmp_path: Path) -> None:
    with zipfile.ZipFile(io.BytesIO(exported("all")[1][f"my-run-fmi{version}.fmu"])) as archive:
        archive.extractall(tmp_path)
    sources = sorted((tmp_path / "sources").glob("*.c"))
    assert [path.name for path in sources] == ["element.c", f"fmi{version}.c", "laws.c", "model.c"]
    command = [str(GCC), *STRICT, "-fsanitize=address,undefined", "-shared", "-fPIC", *map(str, sources), "-o", "it.so"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@needs_gcc
def test_the_core_runs_without_a_fault_of_memory_or_arithmetic(tmp_path: Path, rng: np.random.Generator) -> None:
    held = held_inputs(rng)
    with zipfile.ZipFile(io.BytesIO(exported("all")[1]["my-run-fmi2.fmu"])) as archive:
        archive.extractall(tmp_path)
    (tmp_path / "sources" / "main.c").write_text(MAIN)
    flags = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
    command = [str(GCC), *STRICT, *flags, "main.c", "model.c", "element.c", "laws.c", "-o", "it", "-lm"]
    subprocess.run(command, cwd=tmp_path / "sources", check=True)
    columns = (held.step, *(getattr(held, name) for name in INPUTS))
    text = "\n".join(" ".join(map(repr, row)) for row in np.column_stack(columns).tolist())
    done = subprocess.run([tmp_path / "sources" / "it"], input=text, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    found = np.array(done.stdout.split(), dtype=float)
    np.testing.assert_allclose(found, run_by_hand("all", held, tmp_path), rtol=1e-9, atol=1e-6)


MAIN = r"""
#include <stdio.h>
#include "model.h"
int main(void)
{
    static const unsigned inputs[] = {DISPLACEMENT, VELOCITY, ACCELERATION, SIGNAL, TEMPERATURE}, output[] = {FORCE};
    model m;
    double step, value[5], time = 0.0, force;
    model_reset(&m, 0);
    while (scanf("%lf %lf %lf %lf %lf %lf", &step, &value[0], &value[1], &value[2], &value[3], &value[4]) == 6) {
        if (model_set(&m, inputs, 5, value) != NULL)
            return 1;
        if (!m.running)
            model_start(&m);
        if (model_step(&m, time, step) != NULL || model_get(&m, output, 1, &force) != NULL)
            return 1;
        time += step;
        printf("%.17g\n", force);
    }
    return 0;
}
"""


@needs_gcc
def test_an_fmu_is_the_same_bytes_twice_and_names_version_and_config() -> None:
    content, written = exported("all")
    assert written == formats()["fmu"].files(replace(content))
    for data in written.values():
        assert content.origin.encode() in data
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            texts = [name for name in archive.namelist() if not name.startswith("binaries/") and "build" not in name]
            assert all(content.origin.encode() in archive.read(name) for name in texts)


def test_another_damper_has_another_token() -> None:
    contents = [content_of(DAMPERS[name]) for name in ("plain", "warm")]
    assert len({data_of(one, Dynamics.of(one.damper))[1] for one in contents}) == 2


def test_without_a_compiler_the_sources_are_all_there_is_and_that_is_said(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("pzd.export.fmi.shutil.which", lambda _: None)
    for data in formats()["fmu"].files(content_of(DAMPERS["plain"])).values():
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            assert not any(name.startswith("binaries/") for name in archive.namelist())
            assert "sources/element.c" in archive.namelist()
    assert caplog.text.count("there is no C compiler") == len(caplog.records) == 1


@needs_gcc
@pytest.mark.parametrize(
    ("system", "machine", "without"), [("linux", "aarch64", ["2.0"]), ("freebsd14", "amd64", ["2.0", "3.0"])]
)
def test_a_version_that_has_no_library_on_this_machine_is_said(
    system: str, machine: str, without: list[str], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("pzd.export.fmi.sys.platform", system)
    monkeypatch.setattr("pzd.export.fmi.platform.machine", lambda: machine)
    written = formats()["fmu"].files(content_of(DAMPERS["plain"]))
    told = [f"pzd builds no library for FMI {version} on {system} {machine}" for version in without]
    assert [record.getMessage().partition(":")[0] for record in caplog.records] == told
    for version in ("2.0", "3.0"):
        with zipfile.ZipFile(io.BytesIO(written[f"my-run-fmi{version[0]}.fmu"])) as archive:
            assert any(name.startswith("binaries/") for name in archive.namelist()) == (version not in without)


@needs_gcc
def test_sources_that_the_compiler_refuses_are_said_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pzd.export.fmi._FLAGS", ("-std=none",))
    with pytest.raises(FilesError, match="does not compile the sources of the FMU; mend or remove it") as refused:
        formats()["fmu"].files(content_of(DAMPERS["plain"]))
    assert len(refused.value.messages) == 1
    assert "\n" not in refused.value.messages[0]


def test_a_damper_without_a_control_signal_or_temperature_has_no_such_input() -> None:
    with zipfile.ZipFile(io.BytesIO(exported("passive")[1]["my-run-fmi2.fmu"])) as archive:
        description = archive.read("modelDescription.xml").decode()
    assert "voltage" not in description
    assert 'name="temperature"' not in description


@needs_gcc
@pytest.mark.parametrize("version", [2, 3])
def test_a_state_that_was_kept_or_written_out_goes_on_as_it_did(version: int, tmp_path: Path) -> None:
    slave = slave_of(version, "all", tmp_path)
    put, got = (slave.setReal, slave.getReal) if version == 2 else (slave.setFloat64, slave.getFloat64)
    kept, written = ("FMUstate", "deSerializeFMUstate") if version == 2 else ("FMUState", "deserializeFMUState")
    keep, take, free, write = (getattr(slave, f"{verb}{kept}") for verb in ("get", "set", "free", "serialize"))
    read = getattr(slave, written)
    slave.exitInitializationMode()

    def forces(start: float) -> list[float]:
        found = []
        for i in range(5):
            slave.doStep(currentCommunicationPoint=start + 0.01 * i, communicationStepSize=0.01)
            found += got([4])
        return found

    put([1, 2], [0.2, 60.0])
    forces(0.0)
    state = keep()
    text = write(state)
    first = forces(0.05)
    take(state)
    assert forces(0.05) == first
    again = read(text)
    take(again)
    assert forces(0.05) == first
    assert first[0] != first[-1]
    for one in (state, again):
        free(one)
    slave.terminate()
    slave.freeInstance()


@needs_gcc
@pytest.mark.parametrize("version", [2, 3])
def test_the_derivatives_of_the_force_are_those_of_the_laws_beside_the_element(version: int, tmp_path: Path) -> None:
    slave = slave_of(version, "beside", tmp_path)
    put = slave.setReal if version == 2 else slave.setFloat64
    displacement, velocity, force, acceleration = 0, 1, 4, 8
    x, v, F_s, v_s = 0.009, 0.03, 120.0, 0.05
    put([displacement, velocity, acceleration], [x, v, 2.0])
    slave.exitInitializationMode()
    gas = 250.0 * 1.3 / 0.04 * (1.0 + (x - 0.004) / 0.04) ** -2.3  # of the accumulator
    away = (x - 0.004 - 0.004) / 0.03  # from the middle of the zone of another damping
    zone = 250.0 * np.exp(-(away**2))
    slopes = {
        displacement: 3000.0 + gas - 2.0 * away / 0.03 * zone * v,
        velocity: -2.0 * v / v_s**2 * F_s * np.exp(-((v / v_s) ** 2)) + zone,
        acceleration: 12.0,
    }
    for known, slope in slopes.items():
        assert slave.getDirectionalDerivative([force], [known], [2.0])[0] == pytest.approx(2.0 * slope, rel=1e-6)
    both = slave.getDirectionalDerivative([force], list(slopes), [1.0, -1.0, 0.5])[0]
    expected = slopes[displacement] - slopes[velocity] + 0.5 * slopes[acceleration]
    assert both == pytest.approx(expected, rel=1e-6)
    for unknowns, knowns in (([velocity], [displacement]), ([force], [force])):
        with pytest.raises(Exception, match="failed with status 3"):
            slave.getDirectionalDerivative(unknowns, knowns, [1.0])
    slave.terminate()
    slave.freeInstance()


@needs_gcc
@pytest.mark.parametrize("version", [2, 3])
def test_a_fault_of_the_caller_is_an_error_and_not_a_number(version: int, tmp_path: Path) -> None:
    slave = slave_of(version, "plain", tmp_path)
    put = slave.setReal if version == 2 else slave.setFloat64
    put([5, 6], [10.0, 0.0])
    slave.exitInitializationMode()
    for references, values in (([5], [10.0]), ([4], [1.0]), ([99], [1.0]), ([1], [float("nan")])):
        with pytest.raises(Exception, match="failed with status 3"):
            put(references, values)
    with pytest.raises(Exception, match="failed with status 3"):
        slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=-1.0)
    slave.terminate()
    slave.freeInstance()


@needs_gcc
@pytest.mark.parametrize("version", [2, 3])
def test_a_fault_of_the_caller_is_told(version: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    slave = slave_of(version, "plain", tmp_path)
    slave.exitInitializationMode()
    with pytest.raises(Exception, match="failed with status 3"):
        slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=-1.0)
    slave.freeInstance()
    assert capsys.readouterr().out == "[ERROR] a step must be finite and above 0\n"


@needs_gcc
def test_a_fault_is_told_in_the_name_of_the_instance(tmp_path: Path) -> None:
    fmi2 = pytest.importorskip("fmpy.fmi2", reason="FMPy is not installed: pip install fmpy")
    told: list[tuple[bytes, bytes]] = []
    logger = fmi2.fmi2CallbackLoggerTYPE(lambda _, name, status, category, message: told.append((name, message)))
    # Callbacks of its own: FMPy's default ones, once overwritten, cannot be put back, since a field that was read is
    # a view of the structure; whatever faults later in this process would call a function that is gone.
    slave = slave_of(2, "plain", tmp_path, callbacks=fmi2.fmi2CallbackFunctions(logger=logger))
    with pytest.raises(Exception, match="failed with status 3"):
        slave.setReal([4], [1.0])
    slave.freeInstance()
    assert told == [(b"it", b"no variable of this value reference can be set")]


@needs_gcc
def test_the_time_that_was_reached_is_known_and_no_step_is_pending(tmp_path: Path) -> None:
    slave = slave_of(2, "plain", tmp_path)
    slave.exitInitializationMode()
    slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.25)
    ok, discarded, answered = 0, 2, {}
    kinds = {"": ctypes.c_int, "Real": ctypes.c_double, "Integer": ctypes.c_int, "Boolean": ctypes.c_int}
    for name, kind in {**kinds, "String": ctypes.c_char_p}.items():
        ask = getattr(slave.dll, f"fmi2Get{name}Status")
        for asked in range(4):
            value = kind(1) if kind is not ctypes.c_char_p else kind()
            status = ask(ctypes.c_void_p(slave.component), asked, ctypes.byref(value))
            assert status in (ok, discarded)
            answered |= {(name, asked): value.value} if status == ok else {}
    slave.freeInstance()
    last_successful_time, terminated = 2, 3
    assert answered == {("Real", last_successful_time): 0.25, ("Boolean", terminated): 0}
