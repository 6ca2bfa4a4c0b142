"""Tests of a damper, from arrays or from files, and the records that the stages take."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from typing_extensions import override

from pzd.artefacts import Rig
from pzd.front.arguments import control_of, in_python, label, numbers
from pzd.front.results import Result, new_axes
from pzd.quantities import (
    ACCELERATION,
    CHANNELS,
    DISPLACEMENT,
    FORCE,
    PRESSURE,
    TEMPERATURE,
    TIME,
    VELOCITY,
    VOLTAGE,
    Control,
)
from pzd.record import Array, Record
from pzd.rig.config import FilesEntry, Limits
from pzd.rig.preflight import PreflightRecord, examined
from pzd.schema.errors import Advice, Advised, DataError, UserError
from pzd.schema.yamlfile import document_of
from pzd.schema.yamltree import compose

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

UNNAMED = "test"
"""Name of a test that was given none; among several it becomes `test-1`, `test-2` and so on."""

FEWEST = 2
"""Samples of a test."""


def _kept(prepared: PreflightRecord) -> PreflightRecord:
    """Return the same record, whose channels nobody changes in place: they were checked, and belong together."""
    for quantity in CHANNELS:
        channel = getattr(prepared.record, quantity.name)
        if channel is not None:
            channel.flags.writeable = False
    return prepared


def _as_argument(advice: Advice) -> str | None:
    """Return advice about a file as what to pass here; None where an array needs none."""
    match advice.key:
        case "sign":
            return f"pass {advice.quantity}=-{advice.quantity}{advice.when and f' {advice.when}'}"
        case "rate_Hz":
            return "pass time in seconds, which are numbers of samples over samples a second"
        case "columns":
            return "pass each as the other"
        case "split":
            return "make a pzd.Test of each part"
        case "units" if advice.value != "s":
            return f"pass {advice.quantity} in SI, not in {advice.value}"
    return None


class Test(Result):
    """One test of a damper on a rig, in SI units and degC, extension (rebound) positive.

    It is checked as a file of a rig is, so that a faulty test is refused where it is made.
    """

    __test__: ClassVar[bool] = False  # pytest collects what is called Test

    @in_python
    def __init__(
        self,
        time: Any,
        displacement: Any,
        force: Any,
        voltage: Any = None,
        temperature: Any = None,
        velocity: Any = None,
        setting: str | None = None,
        name: str | None = None,
        *,
        acceleration: Any = None,
        pressure: Any = None,
    ) -> None:
        """Check the arrays of a test, and derive velocity and acceleration where they are not given.

        Parameters
        ----------
        time : (n,) strictly increasing [s]
        displacement : (n,) extension of the damper [m]
        force : (n,) force of the damper, F v > 0 where it dissipates [N]
        voltage : control signal of the valve, a number or (n,), in the unit that `control` of the stages states
        temperature : of the damper, a number or (n,) [degC]
        velocity : (n,) rate of extension, where it was recorded [m/s]
        setting : of the damper, such as "gap 0.25 mm"
        name : of the test; `test-1`, `test-2` and so on by default
        acceleration : (n,) second derivative of the extension, where it was recorded [m/s2]
        pressure : a number or (n,), carried and not used [Pa]

        Raises
        ------
        TypeError : when something is no array of numbers
        ValueError : when the test cannot be used, for what a file would be refused for
        """
        from pzd.rig.files.reading import from_arrays

        for argument, given in (("setting", setting), ("name", name)):
            if given is not None and not isinstance(given, str):
                raise TypeError(f"{argument}: must be text (got {type(given).__name__})")
        clock = numbers("time", time)
        if clock.size < FEWEST:
            raise ValueError(f"time: a test needs {FEWEST} samples at least (got {clock.size})")
        channels: dict[Any, Array | float] = {TIME: clock}
        for quantity, values in ((DISPLACEMENT, displacement), (FORCE, force)):
            channels[quantity] = numbers(quantity.name, values, clock.size)
        for quantity, values in ((VELOCITY, velocity), (ACCELERATION, acceleration)):
            if values is not None:
                channels[quantity] = numbers(quantity.name, values, clock.size)
        for quantity, values in ((VOLTAGE, voltage), (TEMPERATURE, temperature), (PRESSURE, pressure)):
            if (found := label(quantity.name, values, clock.size)) is not None:
                channels[quantity] = found
        try:
            self.source = _kept(from_arrays(name or UNNAMED, channels, setting, Limits(), Control()))
            """The record as it was prepared, with its cycles."""
        except DataError as error:
            raise DataError(
                message.worded(_as_argument) if isinstance(message, Advised) else message for message in error.messages
            ) from None

    @classmethod
    def of(cls, prepared: PreflightRecord) -> Self:
        """Return the test of a record that was read from a file."""
        made = cls.__new__(cls)
        made.source = _kept(prepared)
        return made

    @property
    def record(self) -> Record:
        """The record that the stages take."""
        return self.source.record

    @property
    def name(self) -> str:
        """Name of the test."""
        return self.record.name

    @property
    def setting(self) -> str | None:
        """Setting of the damper."""
        return self.record.setting

    @property
    def time(self) -> Array:
        """(n,) [s]."""
        return self.record.time

    @property
    def displacement(self) -> Array:
        """(n,) extension of the damper [m]."""
        return self.record.displacement

    @property
    def velocity(self) -> Array:
        """(n,) rate of extension, as recorded or derived without differencing samples [m/s]."""
        return self.record.velocity

    @property
    def acceleration(self) -> Array:
        """(n,) second derivative of the extension [m/s2]."""
        return self.record.acceleration

    @property
    def force(self) -> Array:
        """(n,) [N]."""
        return self.record.force

    @property
    def voltage(self) -> Array | None:
        """(n,) control signal; None where there is none."""
        return self.record.voltage

    @property
    def temperature(self) -> Array | None:
        """(n,) [degC]; None where none was recorded."""
        return self.record.temperature

    @property
    def pressure(self) -> Array | None:
        """(n,) [Pa]; None where none was recorded."""
        return self.record.pressure

    @cached_property
    def findings(self) -> tuple[str, ...]:
        """What looks wrong in the test, in words; nothing of it is corrected."""
        from pzd.rig.preflight import findings

        return tuple(
            f"{one.check}: {one.where}: {one.size:.3g} {one.unit}; {one.follows}" for one in findings(self.source)
        )

    def prepared(self, name: str, limits: Limits, control: Control) -> PreflightRecord:
        """Return the record under a name, on a stand with these limits and with this control signal."""
        known = self.source
        record = known.record if known.record.name == name else replace(known.record, name=name)
        return replace(known, record=record, limits=limits, control=control)

    @override
    def lines(self) -> list[str]:
        record, cycles = self.record, self.source.cycles
        at = [f"{word} {value:.4g}{unit}" for word, value, unit in self._labels() if value is not None]
        moves = f"{cycles.count:g} cycles of {cycles.frequency:.4g} Hz" if cycles else "a motion that does not repeat"
        stroke, speed = 1e3 * np.ptp(record.displacement), np.max(np.abs(record.velocity))
        forces = f"force {record.force.min():.4g} to {record.force.max():.4g} N"
        return [
            f"Test {self.name}: {record.time.size} samples at {record.rate:.4g} Hz, {moves}",
            f"  stroke {stroke:.4g} mm, speed up to {speed:.3g} m/s, {forces}",
            f"  {', '.join(([self.setting] if self.setting else []) + at) or 'no setting, voltage or temperature'}",
            *(f"  {finding}" for finding in self.findings),
        ]

    def _labels(self) -> tuple[tuple[str, float | None, str], ...]:
        return (
            ("voltage", self.record.median_voltage(), ""),
            ("temperature", self.record.median_temperature(), " degC"),
        )

    @override
    def to_frame(self) -> pd.DataFrame:
        """Return the channels under the canonical names of their columns."""
        import pandas as pd

        channels = {q.column: getattr(self.record, q.name) for q in CHANNELS}
        return pd.DataFrame({name: values for name, values in channels.items() if values is not None})

    @override
    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw force over velocity."""
        ax = new_axes(ax)
        ax.plot(self.velocity, self.force, linewidth=0.8, label=self.name)
        ax.set(xlabel=VELOCITY.label, ylabel=FORCE.label, title=self.name)
        return ax


@in_python
def read(
    path: str | PathLike[str] | Iterable[str | PathLike[str]], control: Any = ("voltage", "V"), **entry: Any
) -> list[Test]:
    """Read the tests of rig files, as an entry of `rig.files` in a config does.

    Parameters
    ----------
    path : path or glob pattern, or several of them, seen from where you stand
    control : name and unit of the control signal that the files record
    entry : keys of an entry: columns, units, constants, sign, pattern, setting, rate_Hz, split, layout and so on

    Returns
    -------
    the tests, sorted by path

    Raises
    ------
    TypeError : when an argument is of the wrong type
    ValueError : when no file matches, or one cannot be used; with every place, and the call that the headers suggest
    """
    from pzd.rig.files.reading import read as read_files

    if hasattr(path, "columns"):
        raise TypeError(
            "path: a table is read by pzd.Test(time=..., displacement=..., force=...), a column each, in SI units "
            f"(got {type(path).__name__})"
        )
    given: list[Any] = [path] if isinstance(path, str | PathLike) or not isinstance(path, Iterable) else list(path)
    wrong = [type(one).__name__ for one in given if not isinstance(one, str | PathLike)]
    if wrong:
        raise TypeError(f"path: must be a path, a pattern such as data/*.csv, or a list of them (got {wrong[0]})")
    if not given:
        raise ValueError("path: no file is named (got an empty list)")
    signal = control_of(control)
    where = {"source": f"the path is seen from {Path.cwd()}"}
    if configs := [fspath(one) for one in given if Path(one).suffix in (".yaml", ".yml")]:
        raise ValueError(f"path: a config, and no rig file; pzd.run({configs[0]!r}) runs it (got {configs[0]!r})")
    entries = tuple(document_of({**where, **entry, "path": fspath(one)}).validated(FilesEntry, signal) for one in given)
    try:
        return [Test.of(make()) for make in read_files(entries, Limits(), signal, Path())]
    except DataError as error:
        if entry or not (guess := _guessed_call(entries)):
            raise
        raise DataError([*error.messages, guess]) from None


def _guessed_call(entries: Sequence[FilesEntry]) -> str:
    """Return how files would be read by a guess from their headers, as a call to check; empty where nothing tells."""
    from pzd.rig.config import matching
    from pzd.rig.files.guess import guessed

    paths = sorted({path for one in entries for path in matching(Path(), one.path)})
    try:
        lines = guessed(paths)
    except UserError:
        return ""
    config = compose("\n".join(lines), Path(), DataError).data()
    found = config["rig"]["files"]
    named = [one.pop("path") for one in found]
    keys = found[0]
    if not keys or any(one != keys for one in found):
        return ""
    if "control" in config:
        keys["control"] = tuple(config["control"].values())
    path = repr(named[0] if len(named) == 1 else named)
    call = ", ".join((path, *(f"{key}={value!r}" for key, value in keys.items())))
    return f"as the headers suggest, to be checked and filled in where it says None: pzd.read({call})"


def rig_of(tests: Any, limits: Limits, control: Control, called: str = "tests") -> Rig:
    """Return the artefact of the rig that the stages take.

    Parameters
    ----------
    tests : a `Test`, or several
    limits : of the stand
    control : the control signal
    called : name of the argument, for messages

    Raises
    ------
    TypeError : when it is no test
    ValueError : when there is none, or two are called the same
    """
    hint = "make one with pzd.Test(time, displacement, force, ...), or read files with pzd.read(path)"
    if isinstance(tests, Test):
        tests = [tests]
    if (
        isinstance(tests, str | Mapping)
        or hasattr(tests, "dtype")
        or hasattr(tests, "columns")
        or not isinstance(tests, Iterable)
    ):
        raise TypeError(f"{called}: must be a list of pzd.Test; {hint} (got {type(tests).__name__})")
    given = list(tests)
    wrong = next((type(one).__name__ for one in given if not isinstance(one, Test)), None)
    if wrong is not None:
        raise TypeError(f"{called}: must be a list of pzd.Test; {hint} (got a list with {wrong})")
    if not given:
        raise ValueError(f"{called}: there is no test; {hint} (got an empty list)")
    unnamed = sum(test.name == UNNAMED for test in given)
    names, number = [], 0
    for test in given:
        number += test.name == UNNAMED
        names.append(f"{UNNAMED}-{number}" if test.name == UNNAMED and unnamed > 1 else test.name)
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise ValueError(
            f"{called}: two tests are called {twice[0]}; give each a name of its own, pzd.Test(..., name=...)"
        )
    made = [test.prepared(name, limits, control) for test, name in zip(given, names, strict=True)]
    return examined([partial(_itself, one) for one in made], jobs=1).as_read()


def _itself(prepared: PreflightRecord) -> PreflightRecord:
    return prepared
