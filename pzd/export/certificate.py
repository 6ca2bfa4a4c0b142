"""What was exported, run beside pzd on the same samples: the largest difference of the force, and where it stands.

Both take the motion as it was sampled. FMI 2.0 and C are given inputs that go linearly from sample to sample, as
`pzd.damper.compose.respond` has them; FMI 3.0 has no derivatives of inputs, so that there each is held over its step,
on both sides.
"""

from __future__ import annotations

import ctypes
import json
import platform
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pzd.damper.compose import TOLERANCE, respond
from pzd.damper.motion import Motion
from pzd.export.content import Content
from pzd.export.dynamics import ELEMENT_SOURCES, OF_THE_RIG, VARIABLES, Dynamics
from pzd.export.fmi import IDENTIFIER, compiler
from pzd.record import Array, Record, Rows
from pzd.schema.errors import FilesError

NAME = "certificate.json"
ALIKE = 1e-6
"""Largest difference, as a share of the peak, of the same force: a thousand pieces at their tolerance."""
_RAMP = 1e-11
"""Time in which an input that is held goes from one value to the next in `respond`, where inputs are linear [s]: no
valve follows it, the rod of a rigid damper goes no way in it that its force shows, and it is more than the rounding of
hours."""

Run = Callable[[Content, Motion], Array]
"""Returns the (n,) force [N] of what was exported at the samples of a motion."""


# --- The motion that both are given ---


def steps_of(motion: Motion) -> tuple[Array, Array, Array]:
    """Return the (n - 1,) steps [s] and the extension speed at the start and the end of each [m/s]."""
    steps = np.diff(motion.time)
    mean, half = np.diff(motion.displacement) / steps, 0.5 * np.diff(motion.velocity)
    return steps, mean - half, mean + half


def held(motion: Motion) -> tuple[Motion, Rows]:
    """Return the motion with its inputs held over each step, for `respond`, and the samples at the end of each step."""
    steps = np.diff(motion.time)
    speed = np.diff(motion.displacement) / steps
    since = motion.time - motion.time[0]
    time = np.column_stack([since[:-1] + _RAMP, since[1:]]).ravel()
    time[0] = 0.0
    gone = np.column_stack([np.append(0.0, np.full(steps.size - 1, _RAMP)), steps]) * speed[:, np.newaxis]
    x = (motion.displacement[:-1, np.newaxis] + gone).ravel()
    voltage, temperature = (None if c is None else np.repeat(c[:-1], 2) for c in (motion.voltage, motion.temperature))
    acceleration = np.repeat(motion.acceleration[:-1], 2)
    return Motion(time, x, np.repeat(speed, 2), acceleration, voltage, temperature), np.arange(1, 2 * steps.size, 2)


def _columns(content: Content, motion: Motion) -> Mapping[str, Array]:
    """Return the inputs of the damper at the samples, by the names of `VARIABLES`."""
    dynamics = Dynamics.of(content.damper)
    found = {"displacement": motion.displacement, "velocity": motion.velocity}
    if dynamics.depends_on_acceleration:
        found["acceleration"] = motion.acceleration
    if content.controlled and motion.voltage is not None:
        found["signal"] = motion.voltage
    if dynamics.depends_on_temperature and motion.temperature is not None:
        found["temperature"] = motion.temperature
    return found


# --- C ---


def by_program(sources: Mapping[str, bytes], *flags: str) -> Run:
    """Return what compiles the sources, with `run.c`, and runs the program.

    Raises
    ------
    FilesError : when there is no compiler, or it refuses them
    """

    def run(content: Content, motion: Motion) -> Array:
        steps, first, last = steps_of(motion)
        columns, still = _columns(content, motion), np.zeros(motion.time.size)
        order = ("displacement", "velocity", "acceleration", "signal", "temperature")
        at_samples = np.column_stack([columns.get(name, still) for name in order])
        lines = [at_samples[0], *np.column_stack([steps, first, last, at_samples[1:]])]
        text = "\n".join(" ".join(map(repr, line.tolist())) for line in lines)
        with _folder(sources) as place:
            command = [compiler(), "-std=c99", "-O2", "-ffp-contract=off", *flags, "run.c", *ELEMENT_SOURCES]
            _called([*command, "-o", "run", "-lm"], place, "")
            return np.array(_called([str(place / "run")], place, text).split(), dtype=np.float64)

    return run


@contextmanager
def _folder(files: Mapping[str, bytes]) -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as place:
        for name, data in files.items():
            (Path(place) / name).parent.mkdir(parents=True, exist_ok=True)
            (Path(place) / name).write_bytes(data)
        yield Path(place)


def _called(command: Sequence[str], place: Path, given: str) -> str:
    done = subprocess.run(command, cwd=place, input=given, capture_output=True, text=True, check=False)  # noqa: S603  # our own sources
    if done.returncode:
        said = " ".join(done.stderr.split()) or f"exit code {done.returncode}"
        raise FilesError(f"{command[0]}: it does not compile or run the sources; mend or remove it ({said})")
    return done.stdout


# --- FMI, through the functions of the library itself ---

_REAL, _SIZE, _POINTER = ctypes.c_double, ctypes.c_size_t, ctypes.c_void_p


class _Callbacks(ctypes.Structure):
    """Of FMI 2.0; none is called."""

    _fields_ = [
        (name, _POINTER) for name in ("logger", "allocate", "free", "finished", "environment")
    ]  # as ctypes wants it


@dataclass(frozen=True)
class _Instance:
    """One instance of the library of an FMU."""

    library: ctypes.CDLL
    version: int
    damper: ctypes.c_void_p

    def call(self, name: str, *arguments: Any) -> None:
        """Call a function of FMI.

        Raises
        ------
        FilesError : when it does not end well
        """
        if getattr(self.library, f"fmi{self.version}{name}")(self.damper, *arguments):
            raise FilesError(f"the library of the FMU refuses {name}")

    def put(self, values: Mapping[str, float]) -> None:
        """Set variables."""
        self.call("SetReal" if self.version == 2 else "SetFloat64", *self._listed(values))

    def put_rates(self, rates: Mapping[str, float]) -> None:
        """Set the first derivatives of inputs, which FMI 2.0 takes."""
        references, count, values, *_ = self._listed(rates)
        self.call("SetRealInputDerivatives", references, count, (ctypes.c_int * len(rates))(*[1] * len(rates)), values)

    def force(self) -> float:
        """Return the force [N]."""
        references, count, values, *more = self._listed({"force": 0.0})
        self.call("GetReal" if self.version == 2 else "GetFloat64", references, count, values, *more)
        return float(values[0])

    def step(self, time: float, step: float) -> None:
        """Go on by a step [s]."""
        if self.version == 2:
            self.call("DoStep", _REAL(time), _REAL(step), 0)
            return
        flags, reached = (ctypes.c_bool * 3)(), _REAL()
        places = [_POINTER(ctypes.addressof(flags) + i) for i in range(3)]
        self.call("DoStep", _REAL(time), _REAL(step), ctypes.c_bool(False), *places, ctypes.byref(reached))

    def _listed(self, values: Mapping[str, float]) -> tuple[Any, ...]:
        count = len(values)
        references = (ctypes.c_uint * count)(*[VARIABLES.index(name) for name in values])
        listed = (references, _SIZE(count), (_REAL * count)(*values.values()))
        return listed if self.version == 2 else (*listed, _SIZE(count))


@contextmanager
def _instance(library: bytes, version: int, token: str) -> Iterator[_Instance]:
    """Make an instance that is ready for its start values.

    Raises
    ------
    FilesError : when the library makes none
    """
    with _folder({IDENTIFIER: library}) as place:
        loaded = ctypes.CDLL(str(place / IDENTIFIER))
        name, guid = IDENTIFIER.encode(), token.encode()
        callbacks = _Callbacks()
        off, given = ctypes.c_bool(False), tuple[Any, ...]()
        if version == 2:
            begin, given = loaded.fmi2Instantiate, (name, 1, guid, b"", ctypes.byref(callbacks), 0, 0)
        else:
            begin = loaded.fmi3InstantiateCoSimulation
            given = (name, guid, b"", off, off, off, off, None, _SIZE(0), None, None, None)
        begin.restype = _POINTER
        damper = begin(*given)
        if not damper:
            raise FilesError("the library of the FMU makes no instance")
        one = _Instance(loaded, version, _POINTER(damper))
        try:
            if version == 2:
                one.call("SetupExperiment", 0, _REAL(0.0), _REAL(0.0), 0, _REAL(0.0))
                one.call("EnterInitializationMode")
            else:
                one.call("EnterInitializationMode", off, _REAL(0.0), _REAL(0.0), off, _REAL(0.0))
            yield one
        finally:
            getattr(loaded, f"fmi{version}FreeInstance")(one.damper)


def by_library(library: bytes, version: int, token: str) -> Run:
    """Return what steps through a motion with the library of an FMU.

    Parameters
    ----------
    library : the shared library
    version : of FMI, 2 or 3
    token : by which the library knows its description
    """

    def run(content: Content, motion: Motion) -> Array:
        columns = _columns(content, motion)
        steps, first, last = steps_of(motion)
        if version == 3:
            first = last = np.diff(motion.displacement) / steps
        rates = {name: np.diff(values) / steps for name, values in columns.items() if name != "displacement"}
        rates["velocity"] = (last - first) / steps
        with _instance(library, version, token) as one:
            one.put({name: values[0] for name, values in columns.items()})
            one.call("ExitInitializationMode")
            forces = [one.force()]
            for i, step in enumerate(steps):
                one.put({name: values[i] for name, values in columns.items()} | {"velocity": first[i]})
                if version == 2:
                    one.put_rates({name: values[i] for name, values in rates.items()})
                one.step(float(motion.time[i]), float(step))
                if version == 2:
                    one.put({name: values[i + 1] for name, values in columns.items()})
                forces.append(one.force())
        return np.array(forces)

    return run


# --- The certificate ---


@dataclass(frozen=True)
class Difference:
    """How far two forces along one motion are apart."""

    record: str
    samples: int
    peak_N: float
    difference_N: float
    at_s: float
    """Where it is largest."""

    @property
    def share(self) -> float:
        """Largest difference as a share of the peak."""
        return self.difference_N / self.peak_N if self.peak_N else 0.0


def difference(content: Content, name: str, motion: Motion, run: Run, inputs_held: bool) -> Difference:
    """Run what was exported beside pzd.

    Parameters
    ----------
    content : the damper
    name : of the motion
    motion : the samples
    run : runs what was exported
    inputs_held : whether it holds its inputs over a step
    """
    damper = content.damper.without_effects(*OF_THE_RIG)
    found = run(content, motion)
    if inputs_held:
        steady, ends = held(motion)
        ours, found, time = respond(damper, steady)[ends], found[1:], motion.time[1:]
    else:
        ours, time = respond(damper, motion), motion.time
    apart = np.abs(found - ours)
    worst = int(np.argmax(np.where(np.isfinite(apart), apart, np.inf)))
    return Difference(name, motion.time.size, float(np.max(np.abs(ours))), float(apart[worst]), float(time[worst]))


def certificate(
    content: Content, of: str, records: Sequence[Record], run: Run, inputs_held: bool, versions: Mapping[str, str]
) -> bytes:
    """Write the certificate of what was exported, on the records of the run.

    Parameters
    ----------
    content : the damper
    of : name of the file that was run
    records : of the run
    run : runs it
    inputs_held : whether it holds its inputs over a step
    versions : of pzd and its libraries
    """
    found = [difference(content, record.name, Motion.of(record), run, inputs_held) for record in records]
    worst = max(found, key=lambda one: one.share)
    text = {
        "of": of,
        "from": content.origin,
        "beside": "pzd.damper.compose.respond",
        "inputs": "held over each step" if inputs_held else "linear from sample to sample",
        "tolerance_of_a_piece": TOLERANCE,
        "largest_difference": _entry(worst),
        "same": worst.share <= ALIKE,
        "same_up_to_share_of_peak": ALIKE,
        "records": [_entry(one) for one in found],
        "versions": {**versions, "compiler": _called([compiler(), "--version"], Path.cwd(), "").partition("\n")[0]},
        "machine": f"{platform.system()} {platform.machine()}",
    }
    return (json.dumps(text, indent=2) + "\n").encode()


def _entry(one: Difference) -> dict[str, str | float]:
    return {
        "record": one.record,
        "samples": one.samples,
        "peak_N": one.peak_N,
        "difference_N": one.difference_N,
        "share_of_peak": one.share,
        "at_s": one.at_s,
    }
