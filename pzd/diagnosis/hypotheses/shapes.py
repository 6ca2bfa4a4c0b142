"""Shapes for the regression of a residual: the expression of each, the unit of its coefficient, and its physics.

One entry per shape; adding one means adding an entry, and `law` where an effect file can hold it. Expressions are in
the symbols of the paper: x from the middle of the stroke, v and a of the rod, F the predicted force, U the control
signal, T the temperature, t the time since the test began. The method is the force surface of Masri and Caughey 1979,
J. Appl. Mech. 46, with the sparse choice of terms of Brunton, Proctor and Kutz 2016, PNAS 113.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.record import CONSTANT_SHARE, SAME_TEMPERATURE, Array

# --- Signals along a test, and columns that take more than one expression


LENGTHS = tuple(float(x) for x in np.geomspace(0.2, 1.5, 42))
"""Wave lengths that are tried [half strokes].

Reason: 5 % apart, so that the shortest stays within a quarter of a wave over the stroke; a longer one is a spring."""
PLACES = tuple(float(x) for x in np.linspace(-0.9, 0.9, 37))
"""Positions that are tried [half strokes from the middle]: a sixth of `SPOT` apart."""
SPOT = 0.3
"""Half width of a position with friction of its own [half strokes].

Reason: a narrower one shows as well, and makes no difference to a ride."""
WIDTHS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6)
"""Half widths of the play that are tried [half strokes]."""
TIMES_S = (0.003, 0.01, 0.03, 0.1, 0.3)
"""Time constants of the lag that are tried [s], in half decades."""
SHORTEST_RISE = 0.5
"""Shortest time constant of damping that changes while a test runs [s]; doubled up to `LONGEST_RISE`."""
LONGEST_RISE = 8.0


@dataclass(frozen=True, eq=False)
class Signals:
    """Signals along one test, of which shapes are made."""

    t: Array
    """(n,) time since the test began [s]."""
    x: Array
    v: Array
    a: Array
    F: Array
    U: Array
    """(n,) 0 where there is none."""
    T: Array
    """(n,) temperature from that of the setting [K]; 0 where there is none."""
    half_stroke: float
    """Of all tests [m]."""

    @property
    def force_rate(self) -> Array:
        """(n,) dF/dt [N/s]."""
        return np.gradient(self.F, self.t)


Columns = Callable[[Signals], Iterator[tuple[float | None, Array]]]
"""Function that yields the value of the searched parameter (None without one) and (n, k) columns, one per coefficient.
"""


def waves(s: Signals) -> Iterator[tuple[float | None, Array]]:
    """Yield sine and cosine over the position for each wave length [m]."""
    for length in (share * s.half_stroke for share in LENGTHS):
        phase = 2.0 * np.pi * s.x / length
        yield length, np.column_stack([np.sin(phase), np.cos(phase)])


def at_a_place(s: Signals) -> Iterator[tuple[float | None, Array]]:
    """Yield a triangle of friction around each position [m], of height one."""
    for place in (share * s.half_stroke for share in PLACES):
        yield place, (np.sign(s.v) * np.maximum(1.0 - np.abs(s.x - place) / (SPOT * s.half_stroke), 0.0))[:, None]


def behind_play(s: Signals) -> Iterator[tuple[float | None, Array]]:
    """Yield the force through a play of each half width [m], at most one."""
    for half_width in (share * s.half_stroke for share in WIDTHS):
        yield half_width, (play(s.x, half_width) / half_width)[:, None]


def play(x: Array, half_width: float) -> Array:
    """Compute (n,) by how far the rod is ahead of what it drags behind a play of that half width [m].

    Equation: e_i = clip(e_(i-1) + x_i - x_(i-1), -r, r)     Source: Visintin 1994, Differential Models of Hysteresis

    Examples
    --------
    >>> play(np.array([0.0, 1.0, 2.0, 1.5]), 1.0).tolist()
    [0.0, 1.0, 1.0, 0.5]
    """
    ahead, found = 0.0, np.empty(x.size)
    for i, step in enumerate(np.diff(x, prepend=x[0]).tolist()):
        ahead = min(max(ahead + step, -half_width), half_width)
        found[i] = ahead
    return found


def lagging(s: Signals) -> Iterator[tuple[float | None, Array]]:
    """Yield the velocity after a first-order lag less the velocity itself: what the lag takes off the damping."""
    from scipy.signal import lfilter

    step = float(np.median(np.diff(s.t)))
    for tau in TIMES_S:
        share = step / (tau + step)
        behind = lfilter([share], [1.0, share - 1.0], s.v, zi=[(1.0 - share) * s.v[0]])[0]
        yield tau, (behind - s.v)[:, None]


def while_running(s: Signals) -> Iterator[tuple[float | None, Array]]:
    """Yield the velocity times a share that grows from 0 towards 1 while a test runs, for each time constant [s]."""
    tau = SHORTEST_RISE
    while tau <= LONGEST_RISE:
        yield tau, (-np.expm1(-s.t / tau) * s.v)[:, None]
        tau *= 2.0


def signals_of(cleaned: CleanedRecord, force: Array, temperature: float | None, half_stroke: float) -> Signals:
    """Return the signals along one test.

    Parameters
    ----------
    cleaned : the test, its displacement cleaned and counted from the middle of the stroke
    force : (n,) predicted force [N]
    temperature : median of all tests [degC]; None where none was recorded
    half_stroke : of all tests [m]
    """
    record = cleaned.record
    own = record.median_temperature()
    T = 0.0 if own is None or temperature is None else own - temperature
    U = np.zeros(force.size) if record.voltage is None else record.voltage
    if cleaned.constant and record.voltage is not None:
        U = np.full(force.size, record.median_voltage())
    return Signals(
        t=record.time - record.time[0],
        x=record.displacement,
        v=record.velocity,
        a=record.acceleration,
        F=force,
        U=U,
        T=np.full(force.size, T),
        half_stroke=half_stroke,
    )


# --- The table of shapes


Needs = Literal["control", "temperature"]


@dataclass(frozen=True)
class Shape:
    """One shape of a residual."""

    name: str
    """The expression behind the coefficient."""
    unit: str
    """Unit of the coefficient."""
    physics: str
    """Physics that has this shape."""
    source: str
    columns: Columns
    parameter: str | None = None
    """Symbol of the parameter that is searched beside the coefficient."""
    parameter_unit: str = ""
    needs: Needs | None = None
    """What must differ in the tests."""
    law: str | None = None
    """The shape as Python of x, v and a, with `math` alone, where a parallel force can have it; of two coefficients the
    second law stands behind a semicolon."""
    per_control: bool = False
    """Whether it is another shape in proportion to the control signal."""
    width: float | None = None
    """Half width of its position [half strokes]."""
    library: tuple[str, ...] = ()
    """Effects of the library that have this shape."""
    below_zero: str = ""
    """Physics of a negative coefficient, where what has the shape knows none; no effect of the library has that."""

    def physics_of(self, coefficient: float) -> str:
        """Return what has the shape with a coefficient of this sign."""
        return self.below_zero if self.below_zero and coefficient < 0.0 else self.physics

    def library_of(self, coefficient: float) -> tuple[str, ...]:
        """Return the effects of the library that have the shape with a coefficient of this sign."""
        return () if self.below_zero and coefficient < 0.0 else self.library


def _shape(
    name: str,
    unit: str,
    physics: str,
    source: str,
    function: Callable[[Signals], Array],
    law: str | None = None,
    needs: Needs | None = None,
    library: tuple[str, ...] = (),
    below_zero: str = "",
) -> Shape:
    """Return a shape of one column, without a searched parameter."""

    def columns(s: Signals) -> Iterator[tuple[float | None, Array]]:
        yield None, np.asarray(function(s))[:, None]

    return Shape(name, unit, physics, source, columns, law=law, needs=needs, library=library, below_zero=below_zero)


_DIXON = "Dixon 2007, The Shock Absorber Handbook"
_FRICTION = "Armstrong-Helouvry, Dupont and Canudas de Wit 1994, Automatica 30(7)"
_STRUT = "Yabuta, Hidaka and Fukushima 1981, Vehicle System Dynamics 10: friction by side force"
_DUYM = "Duym 2000, Vehicle System Dynamics 33"
_PIN = "Milwitzky and Cook 1953, NACA Report 1154: metering pin"
_SIGN = "math.copysign(1.0, v)"

_BY_POSITION = "damping that depends on position"
SHAPES: tuple[Shape, ...] = (
    # ---- damping and friction by position
    _shape("|x| v", "N s/m2", f"{_BY_POSITION}, alike at both ends, as bypass grooves give", _DIXON,
           lambda s: np.abs(s.x) * s.v, "abs(x) * v"),
    _shape("x^2 v", "N s/m3", f"{_BY_POSITION}, alike at both ends, as bypass grooves that taper give", _DIXON,
           lambda s: s.x**2 * s.v, "x * x * v"),
    _shape("x v", "N s/m2", f"{_BY_POSITION}, from one end to the other, as a metering pin gives", _PIN,
           lambda s: s.x * s.v, "x * v"),
    _shape("|x| |v| v", "N s2/m3", "an orifice that narrows to both ends of the stroke", _PIN,
           lambda s: np.abs(s.x * s.v) * s.v, "abs(x * v) * v"),
    _shape("x |v| v", "N s2/m3", "an orifice that narrows from one end of the stroke to the other", _PIN,
           lambda s: s.x * np.abs(s.v) * s.v, "x * abs(v) * v"),
    _shape("|x| sign v", "N/m", "friction that rises to both ends, as a bent rod gives", _STRUT,
           lambda s: np.abs(s.x) * np.sign(s.v), f"abs(x) * {_SIGN}"),
    _shape("x^2 sign v", "N/m2", "friction that rises steeply to both ends, or is less at the middle", _STRUT,
           lambda s: s.x**2 * np.sign(s.v), f"x * x * {_SIGN}"),
    _shape("x sign v", "N/m", "friction that is larger at one end, as a side load or a covered port gives", _STRUT,
           lambda s: s.x * np.sign(s.v), f"x * {_SIGN}"),
    Shape("sign v about x_p", "N", "friction at one place of the stroke, as a dent or a tight guide gives", _STRUT,
          at_a_place, "x_p", "m", width=SPOT, law=f"max(1.0 - abs(x - {{parameter}}) / {{width}}, 0.0) * {_SIGN}"),
    # ---- forces by position alone
    _shape("x", "N/m", "a spring beside the element, as a gas charge gives", _DIXON, lambda s: s.x, "x",
           library=("gas_spring",)),
    _shape("x^2", "N/m2", "a spring that pushes the same way on both sides, as compressed gas does", _DIXON,
           lambda s: s.x**2, "x * x"),
    _shape("|x|", "N/m", "a spring that pushes the same way on both sides, bent at the middle", _DIXON,
           lambda s: np.abs(s.x), "abs(x)"),
    _shape("x^3", "N/m3", "a spring that hardens to both ends, as rubber stops or mounts give", _DIXON,
           lambda s: s.x**3, "x * x * x", library=("end_stop",), below_zero="a spring that softens to both ends"),
    Shape("sin 2 pi x/lambda", "N", "a force that waves over the position: cogging of magnets, a thread, a wavy guide",
          "Hendershot and Miller 1994, Design of Brushless Permanent-Magnet Motors: cogging", waves, "lambda", "m",
          law="math.sin(2.0 * math.pi * x / {parameter});math.cos(2.0 * math.pi * x / {parameter})"),
    # ---- forces by speed and acceleration
    _shape("1", "N", "a constant force, as a gas charge gives", _DIXON,
           lambda s: np.ones(s.x.size), "1.0", library=("preload_offset",)),
    _shape("|v|", "N s/m", "damping that differs between rebound and compression", _DIXON,
           lambda s: np.abs(s.v), "abs(v)", library=("asymmetry", "viscous_asymmetry")),
    _shape("v^2", "N s2/m2", "an orifice that differs between rebound and compression", _DIXON,
           lambda s: s.v**2, "v * v", library=("asymmetry",)),
    _shape("|v| v", "N s2/m2", "an orifice", "Merritt 1967, Hydraulic Control Systems", lambda s: np.abs(s.v) * s.v,
           "abs(v) * v", library=("orifice_quadratic",),
           below_zero="damping that rises less than the speed does, as a valve gives that opens"),
    _shape("sign v", "N", "dry friction of seal or guide, behind no spring", _FRICTION,
           lambda s: np.sign(s.v), _SIGN, library=("stribeck_friction",),
           below_zero="friction that turns round later than the rod, as a part of T0 does behind a soft seat"),
    _shape("a", "kg", "a mass: the oil column, or the stand's own", _DIXON, lambda s: s.a, "a",
           library=("fluid_inertia",),
           below_zero="a spring that stiffens with the frequency, as rubber does, or a force that comes late"),
    _shape("a |v|", "kg s/m", "a force that differs between speeding up and slowing down", _DUYM,
           lambda s: s.a * np.abs(s.v), "a * abs(v)"),
    _shape("|a| v", "N s3/m2", "damping that rises with the acceleration", _DUYM,
           lambda s: np.abs(s.a) * s.v, "abs(a) * v"),
    # ---- forces by the force, and by what came before
    _shape("|F|", "-", "a force that differs between rebound and compression", _DIXON, lambda s: np.abs(s.F),
           library=("asymmetry",)),
    _shape("|F| F", "1/N", "a force that grows faster or slower than the model, as a crooked load cell shows",
           "VDI/VDE 2638: characteristics of load cells", lambda s: np.abs(s.F) * s.F),
    _shape("x F", "1/m", "the whole force changes from one end of the stroke to the other", _PIN, lambda s: s.x * s.F),
    _shape("|x| F", "1/m", "the whole force changes to both ends of the stroke", _DIXON, lambda s: np.abs(s.x) * s.F),
    _shape("|F| sign v", "-", "friction that goes with the load, as a side force gives", _STRUT,
           lambda s: np.abs(s.F) * np.sign(s.v), below_zero="friction that is less under load"),
    _shape("dF/dt", "s", "a force that comes late or early", _DUYM, lambda s: s.force_rate, library=("sensor_delay",)),
    _shape("|dF/dt|", "s", "a force that comes late one way alone", _DUYM, lambda s: np.abs(s.force_rate)),
    Shape("(v behind a lag - v)", "N s/m",
          "damping that comes late, as a softer oil spring or mount gives, or a frequency-selective valve that closes "
          "with the time in a stroke", _DUYM, lagging, "tau", "s",
          below_zero="damping that comes early, as a stiffer oil spring gives, or a frequency-selective valve that "
          "opens with the time in a stroke"),
    Shape("(x behind a play)/r", "N", "a spring that slips, whatever the speed, as a rubber seat does",
          "Al-Bender, Lampaert and Swevers 2005, IEEE Trans. Automatic Control 50(11)", behind_play, "r", "m",
          library=("second_branch",)),
    Shape("(1 - exp(-t/tau)) v", "N s/m", "damping that changes while a test runs, as air in the oil gives",
          _DUYM, while_running, "tau", "s"),
    _shape("T v", "N s/(m K)", "damping that changes with the temperature", _DIXON, lambda s: s.T * s.v,
           needs="temperature", library=("temperature_drift",)),
    _shape("T sign v", "N/K", "friction that changes with the temperature", _DIXON, lambda s: s.T * np.sign(s.v),
           needs="temperature", library=("temperature_drift",)),
)  # fmt: skip
"""All shapes; those of x, v and a with one coefficient are tried a second time in proportion to the control signal."""

IN_ONE_UNIT = {
    "N": "-", "-": "N", "N/m": "m", "N/m2": "m2", "N/m3": "m3", "N s/m": "m/s", "N s/m2": "m2/s", "N s/m3": "m3/s",
    "N s2/m2": "m2/s2", "N s2/m3": "m3/s2", "N s3/m2": "m2/s3", "kg": "m/s2", "kg s/m": "m2/s3", "1/N": "N2",
    "1/m": "N m", "s": "N/s", "N s/(m K)": "K m/s", "N/K": "K",
}  # fmt: skip
"""Unit of a shape by that of its coefficient: both together are a force."""


def shapes_of(signals: Sequence[Signals]) -> tuple[Shape, ...]:
    """Return the shapes that the tests can show.

    Parameters
    ----------
    signals : those of every test
    """
    U = np.array([float(np.median(s.U)) for s in signals])
    T = np.array([float(np.median(s.T)) for s in signals])
    moves = any(float(np.ptp(s.U)) > 0.0 for s in signals)
    several = {
        "control": moves or float(np.ptp(U)) > CONSTANT_SHARE * float(np.max(np.abs(U))),
        "temperature": float(np.ptp(T)) > SAME_TEMPERATURE,
    }
    usable = [shape for shape in SHAPES if shape.needs is None or several[shape.needs]]
    by_control = [_by_control(shape) for shape in usable if shape.law and shape.parameter is None]
    return (*usable, *(by_control if several["control"] else ()))


def _by_control(shape: Shape) -> Shape:
    """Return a shape in proportion to the control signal."""

    def columns(s: Signals) -> Iterator[tuple[float | None, Array]]:
        yield from ((value, s.U[:, None] * found) for value, found in shape.columns(s))

    return replace(
        shape,
        name=f"U {shape.name}",
        unit=f"{shape.unit}/V",
        physics=f"{shape.physics}, in proportion to the control signal",
        below_zero=shape.below_zero and f"{shape.below_zero}, in proportion to the control signal",
        columns=columns,
        per_control=True,
    )
