"""A damper as the front door hands it out: its force along a motion, its steady curve, and its table."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import wraps
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np
from typing_extensions import override

from pzd.artefacts import Diagnosed, ForceRow, Table
from pzd.damper.model import BaseRow
from pzd.damper.model import Damper as Model
from pzd.front.arguments import Given, control_of, in_python, label, numbers
from pzd.front.pipelines import config_of, pipeline_of
from pzd.front.results import Result, frame_of, new_axes
from pzd.quantities import BINGHAM, FORCE, VELOCITY, Control
from pzd.record import Array
from pzd.schema.errors import ConfigError
from pzd.schema.yamlfile import document_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from pzd.damper.curve import ForceCurve
    from pzd.damper.motion import Motion
    from pzd.pipeline.execution import InMemory

_DRAWN = 401
"""Velocities of a drawn curve, evenly spaced: 0 is one of them."""
_FASTEST = 1.0
"""Up to which speed a curve is drawn where nothing was tested [m/s]."""
_BEYOND_NOISE = 20.0
"""Standard deviations of its noise by which cleaning may move a sample of a displacement.

Reason: five were seen at most on measured motions, ten where a clock jitters; a step has hundreds."""


def named_by_control(function: Callable[Given, Array]) -> Callable[Given, Array]:
    """Let a method of a damper take the control signal by its own name as well: `force(t, x, current=0.5)`."""

    @wraps(function)
    def called(*args: Given.args, **kwargs: Given.kwargs) -> Array:
        own = cast("Damper", args[0]).control.name
        if own in kwargs and "voltage" not in kwargs:
            kwargs["voltage"] = kwargs.pop(own)
        return function(*args, **kwargs)

    return called


FEWEST_MOVED = 5
"""Samples of a motion: fewer have no speed that could be told from noise."""
BEYOND_KNOWN = 0.02
"""Share of the span of a control signal or temperature by which a value may lie beyond: a recorded one has noise."""


class Damper(Result):
    """A damper: the Bingham element over the control signal and temperature, and its effects."""

    @in_python
    def __init__(
        self,
        base: Any,
        effects: Mapping[str, Any] | None = None,
        reference_temperature_degC: float | None = None,
        zero_m: float = 0.0,
        control: Any = ("voltage", "V"),
    ) -> None:
        """Make a damper of known parameters, as `damper:` of a virtual rig has them.

        Parameters
        ----------
        base : rows of T0_N, C_Ns_per_m, k_N_per_m, each with voltage_V and temperature_degC where there are several; a
            list of mappings, or a DataFrame such as `to_frame` returns
        effects : parameters of each effect by its name, see `pzd effects`
        reference_temperature_degC : of `temperature_drift`
        zero_m : displacement from which `end_stop` and `gas_spring` count
        control : name and unit of the control signal

        Raises
        ------
        ValueError : when a value is none that a damper has
        """
        if isinstance(base, Mapping):
            base = [base]
        if hasattr(base, "columns"):
            base = [row.dropna().to_dict() for _, row in base.astype(object).iterrows()]
        data = {"base": base, "effects": effects or {}, "zero_m": zero_m}
        data["reference_temperature_degC"] = reference_temperature_degC
        signal = control_of(control)
        self.control = signal
        """The control signal."""
        self.model = document_of(data).validated(Model, signal)
        """The damper as data, which the stages take."""
        self.behind: InMemory | None = None
        """The pipeline that it was found in, whose records say what was tested; None for known parameters."""

    @classmethod
    def of(cls, model: Model, control: Control, behind: InMemory | None = None) -> Self:
        """Return the damper of a stage.

        Parameters
        ----------
        model : the damper
        control : the control signal
        behind : the pipeline that it was found in, whose records say what was tested
        """
        made = cls.__new__(cls)
        made.model, made.control, made.behind = model, control, behind
        return made

    @classmethod
    @in_python
    def from_curve(
        cls, velocity: Any, force: Any, voltage: Any = None, sign: Any = 1, control: Any = ("voltage", "V")
    ) -> CurveDamper:
        """Make a damper of a measured curve of force over velocity.

        It has no oil spring: `ride` rides it as it stands, and its voltage acts at once. Between the points the force
        is monotone where they are; beyond them it goes on along the last straight line, which counts as outside.

        Parameters
        ----------
        velocity : (n,) from compression to rebound [m/s]
        force : (n,), or (n, m) with a column for each of the m voltages [N]
        voltage : (m,) values of the control signal; a number for one curve
        sign : 1 where extension (rebound) is positive; -1 where compression is, in velocity and force, or in the force
            alone where it has the sign opposite to that of the velocity
        control : name and unit of the control signal

        Raises
        ------
        TypeError : when something is no array of numbers
        ValueError : when they are no curve of a damper
        """
        from pzd.damper.curve import curve_of
        from pzd.rig.files.refusals import HIGHEST_SPEED
        from pzd.rig.preflight.sense import FORCES

        if isinstance(sign, bool) or sign not in (1, -1):
            raise ValueError(f"sign: must be 1 or -1 (got {sign!r})")
        v, signal = numbers("velocity", velocity), control_of(control)
        if (fastest := float(np.max(np.abs(v), initial=0.0))) > HIGHEST_SPEED:
            raise ValueError(
                f"velocity: {fastest:g} m/s, above {HIGHEST_SPEED:g} m/s; are these mm/s, or is it the force?"
            )
        values = None if voltage is None else numbers("voltage", np.atleast_1d(voltage))
        shape = np.shape(force)
        if len(shape) == 2 and shape[0] == v.size:
            columns = np.asarray(force)
            forces = np.column_stack([numbers("force", columns[:, n], v.size) for n in range(shape[1])])
        else:
            forces = numbers("force", force, v.size)[:, np.newaxis]
        count = 1 if values is None else values.size
        if forces.shape[1] != count:
            raise ValueError(
                f"force: {forces.shape[1]} columns for {count} values of the {signal.name}; give one for each"
            )
        made = CurveDamper(curve_of(v, forces, values, int(sign)), signal)
        if not FORCES[0] <= (largest := float(np.max(np.abs(forces)))) <= FORCES[1]:
            warnings.warn(
                f"force: {largest:.3g} N at most, {FORCES[0]:g} to {FORCES[1]:g} N is usual: check the unit (N or kN)",
                stacklevel=2,
            )
        return made

    @property
    def effects(self) -> dict[str, dict[str, float | tuple[float, ...]]]:
        """Parameters of each effect by its name."""
        return {name: dict(values) for name, values in self.model.effects.items()}

    @property
    def voltages(self) -> tuple[float, ...]:
        """Values of the control signal at which its parameters are known, rising; none without a control signal."""
        return tuple(sorted({row.voltage_V for row in self.model.base if row.voltage_V is not None}))

    @property
    def temperatures(self) -> tuple[float, ...]:
        """Temperatures at which its parameters are known, rising [degC]."""
        return tuple(sorted({row.temperature_degC for row in self.model.base if row.temperature_degC is not None}))

    @in_python
    @named_by_control
    def force(
        self,
        time: Any,
        displacement: Any,
        voltage: Any = None,
        temperature: Any = None,
        velocity: Any = None,
        *,
        as_recorded: bool = True,
    ) -> Array:
        """Compute the force along a motion, with the oil spring, from a damper that is relaxed at the first sample.

        Parameters
        ----------
        time : (n,) strictly increasing [s]
        displacement : (n,) extension [m]
        voltage : control signal, a number or (n,), by its own name too (`current=0.5`); may be left out where the
            damper was identified at a single one
        temperature : a number or (n,) [degC]; by default the lowest at which the damper is known
        velocity : (n,) rate of extension [m/s]; without it the displacement is taken as measured: it is cleaned of its
            noise, where that leaves no step or corner out, and the rate comes of it, as for a record
        as_recorded : whether it is the force that the stand of the tests would record, with its `sensor_delay` where
            the damper has that; False for the force at the rod, as a car feels it

        Returns
        -------
        (n,) force [N]

        Raises
        ------
        TypeError, ValueError : when an argument is no such array, time does not increase, or the voltage is missing
        """
        return self._force_along((time, displacement, velocity), voltage, temperature, as_recorded=as_recorded)

    def _force_along(self, path: tuple[Any, Any, Any], voltage: Any, temperature: Any, *, as_recorded: bool) -> Array:
        """Compute the force along time, displacement and velocity."""
        from pzd.damper.compose import respond, sensors_of

        time, displacement, velocity = path
        model = self.model if as_recorded else self.model.without_effects(*sensors_of(self.model))
        return respond(model, self.motion(time, displacement, voltage, temperature, velocity))

    def motion(self, time: Any, displacement: Any, voltage: Any, temperature: Any, velocity: Any) -> Motion:
        """Return a motion with control signal and temperature, as `force` takes them."""
        from pzd.damper.motion import Motion
        from pzd.record import clock_fault
        from pzd.rig.files.refusals import LONGEST_STROKE
        from pzd.signals.cycles import cycles
        from pzd.signals.kinematics import kinematics
        from pzd.signals.measures import noise_beside_motion

        t = numbers("time", time)
        if t.size < FEWEST_MOVED:
            raise ValueError(f"time: a motion needs {FEWEST_MOVED} samples at least (got {t.size})")
        if fault := clock_fault(t):
            raise ValueError(f"time: index {fault[0]}: {fault[1]}")
        x = numbers("displacement", displacement, t.size)
        if np.ptp(x) > LONGEST_STROKE:
            raise ValueError(
                f"displacement: a stroke of {np.ptp(x):.4g} m, above {LONGEST_STROKE:g} m; are these millimetres?"
            )
        v = None if velocity is None else numbers("velocity", velocity, t.size)
        clean = kinematics(t, x, cycles(t, x))
        channels = [
            self._channel(name, value, t.size) for name, value in (("voltage", voltage), ("temperature", temperature))
        ]
        if v is not None:  # a motion that is known
            return Motion(t, x, v, clean.acceleration, *channels)
        # A stiff oil spring turns micrometres of noise into newtons; but a step is none, though cleaning rounds it off.
        left = float(np.max(np.abs(x - clean.displacement)))
        kept = x if left > _BEYOND_NOISE * noise_beside_motion(x) else clean.displacement
        return Motion(t, kept, clean.velocity, clean.acceleration, *channels)

    @in_python
    @named_by_control
    def curve(self, velocity: Any, voltage: Any = None, temperature: float | None = None) -> Array:
        """Compute the force at steady velocities, as the table of force holds it.

        A force that is there at rest, such as a gas force, is not in it; at v = 0 it is that of a slow extension.

        Parameters
        ----------
        velocity : (n,) rate of extension [m/s]
        voltage : control signal, a number or (n,), by its own name too
        temperature : [degC]; by default the lowest at which the damper is known

        Returns
        -------
        (n,) force [N]

        Raises
        ------
        TypeError, ValueError : when an argument is no such array, or the voltage is missing
        """
        from pzd.damper.compose import steady_force

        v = numbers("velocity", velocity)
        u, warm = self._label("voltage", voltage, v.size), self._label("temperature", temperature, 1)
        return np.asarray(steady_force(self.model, u, None if warm is None else float(np.max(warm)), v))

    def _channel(self, name: str, value: Any, size: int) -> Array | None:
        given = self._label(name, value, size)
        return None if given is None else np.full(size, given) if isinstance(given, float) else given

    def _label(self, name: str, value: Any, size: int) -> Array | float | None:
        """Return a control signal or a temperature, the only or lowest known one where none is given."""
        known = self.voltages if name == "voltage" else self.temperatures
        called = self.control.name if name == "voltage" else name
        if value is not None:
            found = label(called, value, size)
            _warn_beyond(called, found, known, self.control.unit if name == "voltage" else "degC")
            return found
        if name == "voltage" and len(known) > 1:
            listed = ", ".join(f"{each:g}" for each in known)
            raise ValueError(
                f"{called}: the damper depends on it; give one, it is known at {listed} {self.control.unit}"
            )
        return known[0] if known else None

    def _reached(self) -> float:
        """Return up to which speed the curve is drawn [m/s]: that of the records behind it."""
        from pzd.artefacts import Rig

        records = self.behind.of(Rig).records if self.behind is not None else ()
        return max((float(np.max(np.abs(record.velocity))) for record in records), default=_FASTEST)

    @override
    def lines(self) -> list[str]:
        rows = self.model.base
        effects = [
            f"  {name}: {', '.join(f'{key} = {_shown(value)}' for key, value in values.items())}"
            for name, values in self.model.effects.items()
        ]
        at = [f"{len(self.voltages)} values of the {self.control.name}"] if len(self.voltages) > 1 else []
        at += [f"{len(self.temperatures)} temperatures"] if len(self.temperatures) > 1 else []
        head = f"Damper, {' and '.join(at)}" if at else "Damper"
        spans = [
            f"{parameter.symbol} {_span([getattr(row, parameter.column) for row in rows])} {parameter.unit}"
            for parameter in BINGHAM
        ]
        if all(np.isinf(row.k_N_per_m) for row in rows):
            spans[-1] = "k infinite (no oil spring)"
        return [f"{head}: {', '.join(spans)}", *effects]

    @override
    def to_frame(self) -> pd.DataFrame:
        """Return T0, C and k by control signal and temperature."""
        return frame_of(self.model.base, BaseRow, self.control)

    @override
    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the steady force over velocity, a line for each control signal."""
        ax = new_axes(ax)
        fastest = self._reached()
        for voltage in self.voltages or (None,):
            for side in (-1.0, 1.0):  # the friction jumps at rest
                v = side * np.linspace(0.0, fastest, _DRAWN // 2)
                shown = f"{voltage:g} {self.control.unit}" if voltage is not None and side > 0.0 else None
                colour = ax.lines[-1].get_color() if side > 0.0 else None
                ax.plot(v, self.curve(v, voltage), color=colour, label=shown)
        ax.set(xlabel=VELOCITY.label, ylabel=FORCE.label)
        if self.voltages:
            ax.legend()
        return ax


class CurveDamper(Damper):
    """A damper that is known by its measured curve alone, see `Damper.from_curve`."""

    def __init__(self, measured: ForceCurve, control: Control) -> None:
        """Keep a curve."""
        self.control, self.behind, self.measured = control, None, measured

    @property
    @override
    def effects(self) -> dict[str, dict[str, float | tuple[float, ...]]]:
        return {}

    @property
    @override
    def voltages(self) -> tuple[float, ...]:
        return tuple(self.measured.voltages.tolist()) if self.measured.has_voltage else ()

    @property
    @override
    def temperatures(self) -> tuple[float, ...]:
        return ()

    @override
    def _reached(self) -> float:
        return float(np.max(np.abs(self.measured.velocity)))

    @override
    def _force_along(self, path: tuple[Any, Any, Any], voltage: Any, temperature: Any, *, as_recorded: bool) -> Array:
        """Compute the force of the curve at the velocity of the motion."""
        time, displacement, velocity = path
        motion = self.motion(time, displacement, None, None, velocity)
        return self.curve(motion.velocity, voltage)

    @override
    @in_python
    @named_by_control
    def curve(self, velocity: Any, voltage: Any = None, temperature: float | None = None) -> Array:
        v = numbers("velocity", velocity)
        u = self._label("voltage", voltage, v.size)
        return self.measured.at(v, 0.0 if u is None else u)

    @override
    def lines(self) -> list[str]:
        low, high = self.measured.velocity[[0, -1]]
        at = f", {len(self.voltages)} values of the {self.control.name}" if self.voltages else ""
        return [f"Damper by its measured curve: {self.measured.velocity.size} points, {low:g} to {high:g} m/s{at}"]

    @override
    def to_frame(self) -> pd.DataFrame:
        """Return the points, a row each."""
        import pandas as pd

        key = self.control.renamed("voltage_V")
        rows = [
            {key: voltage, VELOCITY.column: v, FORCE.column: force}
            for n, voltage in enumerate(self.voltages or (np.nan,))
            for v, force in zip(self.measured.velocity, self.measured.force[:, n], strict=True)
        ]
        return pd.DataFrame(rows)


def _warn_beyond(called: str, given: Array | float | None, known: tuple[float, ...], unit: str) -> None:
    """Warn where a control signal or temperature lies outside what the damper is known at."""
    if given is None or not known:
        return
    low, high = known[0], known[-1]
    margin = BEYOND_KNOWN * max(high - low, abs(high), abs(low))
    least, most = float(np.min(given)), float(np.max(given))
    if least < low - margin or most > high + margin:
        where = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        worst = most if most > high + margin else least
        warnings.warn(
            f"{called}: {worst:g} {unit} lies beyond what the damper is known at, {where} {unit}; its parameters are "
            "those at the end",
            stacklevel=2,
        )


def _shown(value: float | tuple[float, ...]) -> str:
    return f"{value:.4g}" if isinstance(value, float | int) else f"[{', '.join(f'{each:.4g}' for each in value)}]"


def _span(values: list[float]) -> str:
    low, high = min(values), max(values)
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


# --- The table ---


@dataclass(frozen=True, eq=False, repr=False)
class ForceTable(Result):
    """Force over control signal and velocity, as the stage table makes it."""

    table: Table
    """The artefact."""
    control: Control = field(default_factory=Control)

    @override
    def lines(self) -> list[str]:
        rows, notes = self.table.force, self.table.notes
        nodes = [len({getattr(row, name) for row in rows}) for name in ("temperature_degC", "voltage_V")]
        nodes_of = f"{nodes[1]} of {self.control.name}, {nodes[0]} of temperature"
        return [
            f"Table of force: {len(rows)} rows, {nodes_of}, tested up to {notes.reached_m_per_s:.3g} m/s",
            *(f"  not in it: {line}" for line in notes.lost),
            *(f"  {line}" for line in notes.not_monotone),
        ]

    @override
    def to_frame(self) -> pd.DataFrame:
        """Return the rows of force.csv."""
        return frame_of(self.table.force, ForceRow, self.control)

    @override
    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw force over velocity, a line for each control signal at the lowest temperature."""
        ax, frame = new_axes(ax), self.to_frame()
        key = self.control.renamed("voltage_V")
        frame = frame[frame["temperature_degC"].fillna(0.0) == frame["temperature_degC"].fillna(0.0).min()]
        for voltage, rows in frame.groupby(key, dropna=False):
            ax.plot(rows["velocity_m_per_s"], rows["force_N"], label=f"{voltage:g} {self.control.unit}")
        ax.set(xlabel=VELOCITY.label, ylabel=FORCE.label)
        if frame[key].notna().any():
            ax.legend()
        return ax


@in_python
def table(damper: Damper, **keys_of_the_block: Any) -> ForceTable:
    """Tabulate the force of a damper over control signal and velocity.

    Parameters
    ----------
    damper : of `identify` or `diagnose`, with what their tests reached; or one of known parameters
    keys_of_the_block : keys of `table` in a config

    Raises
    ------
    TypeError : when it is no damper
    ValueError : when a key is none that a config may have
    """
    return ForceTable(table_stage(damper, dict(keys_of_the_block)), damper.control)


def table_stage(damper: Any, keys: Mapping[str, Any]) -> Table:
    """Return the artefact of the stage table for a damper.

    Raises
    ------
    TypeError : when it is no damper
    ConfigError : when a key is none that a config may have
    """
    from pzd.force_table.stage import untested_table

    if not isinstance(damper, Damper):
        raise TypeError(
            f"damper: must be a pzd.Damper, such as found.damper of pzd.diagnose (got {type(damper).__name__})"
        )
    block = config_of(damper.control, table=keys).table
    if isinstance(damper, CurveDamper):
        from pzd.force_table.measured_curve import table_of_curve

        return table_of_curve(block, damper.measured)
    if damper.behind is None:
        return untested_table(block, damper.model, damper.control)
    behind = damper.behind
    config = behind.config.model_copy(update={"table": block})
    known = {folder: made for folder, made in behind.artefacts.items() if folder != Table.folder}
    found = known.get(Diagnosed.folder)
    if not isinstance(found, Diagnosed) or found.damper is not damper.model:
        known[Diagnosed.folder] = Diagnosed.undiagnosed(damper.model)
    made = pipeline_of(config, known).through("table")[Table.folder]
    if not isinstance(made, Table):
        raise ConfigError("table: no table was made")
    return made
