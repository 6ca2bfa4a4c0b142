"""The damper with its dynamics in C: the laws and the march that pzd computes with, and its parameters as constants.

`sources/element.c` puts both together. Nothing is said a second time: `laws` translates the compiled functions of
`pzd.damper`, so that an effect added there, or one of a user's own, is exported too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from uuid import UUID

import numpy as np
from numpy.typing import ArrayLike

from pzd.damper import compose, flow, path, regimes
from pzd.damper.compiled import kernels
from pzd.damper.compiled.columns import DRIVE, PARALLEL, STROKE_AND_FLOW, acting, columns_of
from pzd.damper.compiled.kernels import T0, C, K
from pzd.damper.compose import BRANCHES, TOLERANCE
from pzd.damper.confounders import module_of
from pzd.damper.effect import ELEMENT, Effect, arguments, functions
from pzd.damper.model import Damper
from pzd.damper.parameter_rows import MATERIAL_FACTORS, drive_row_of, element_rows, nodes_of
from pzd.export.content import Content
from pzd.export.translation import Translation, UntranslatableError, number
from pzd.record import Array
from pzd.schema.errors import ConfigError

# --- C as text ---

_SOURCES = Path(__file__).with_name("sources")
_WIDTH = 8
"""Numbers in a line."""


def source(content: Content, name: str) -> bytes:
    """Read a file of `sources/` and put the origin of the damper before it."""
    return (head(content) + (_SOURCES / name).read_text(encoding="utf-8")).encode()


def head(content: Content) -> str:
    """Return the comment that begins every file."""
    return f"/* {content.origin.replace('*/', '* /')} */\n"


def single(value: float) -> str:
    """Write a constant of single precision, to the nine digits that tell one from the next."""
    return f"{_pointed(f'{float(np.float32(value)):.9g}')}f"


def real(value: float) -> str:
    """Write a constant of the precision that `sources/real.h` chooses."""
    return "R_INFINITY" if math.isinf(value) else f"R({float(value)!r})"


def array(kind: str, name: str, values: ArrayLike, written: Callable[[float], str]) -> str:
    """Write a constant array of any number of axes.

    Parameters
    ----------
    kind : type in C
    name : in C
    values : numbers
    written : writes one number as a constant
    """
    numbers = np.asarray(values, dtype=np.float64)
    sizes = "".join(f"[{size}]" for size in numbers.shape)
    return f"static const {kind} {name}{sizes} = {_braces(numbers, written)};\n"


def _braces(values: np.ndarray, written: Callable[[float], str]) -> str:
    if values.ndim > 1:
        return "{" + ",\n".join(_braces(part, written) for part in values) + "}"
    words = [written(value) for value in values]
    return "{" + ",\n ".join(", ".join(words[i : i + _WIDTH]) for i in range(0, len(words), _WIDTH)) + "}"


def _pointed(text: str) -> str:
    return text if any(mark in text for mark in ".en") else f"{text}.0"


# --- The laws, in C ---

SHARED: tuple[Callable[..., object], ...] = (
    *(path.advance, path.off_the_limits, regimes.deflection_at, regimes.spring_force, compose.advance_branches),
    *(kernels.follow_voltage, kernels.parallel_force, kernels.branches_follow, kernels.branch_force),
    *(flow.flow_speed, flow.breakaway, flow.relief, regimes.over_yield),
)
"""Functions of pzd that `sources/element.c` calls; what these call is translated with them."""


SINGLE_TOLERANCE = 3e-6
"""Admissible error of a piece in single precision, as a share of the force: 25 roundings, as many as a piece makes."""
_SINGLES = {"pzd.damper.regimes._DIFFERENCE": 0.03}
"""Constants of the march that single precision needs otherwise: over this share of a step, with moving parameters, the
rounding of a force is within the tolerance of its change."""


@cache
def laws() -> tuple[str, str]:
    """Write `laws.h` and `laws.c`: every law of the damper and the march along its path, as pzd computes them.

    Raises
    ------
    ConfigError : when a law uses what C has no counterpart for
    """
    written = Translation(ROW, kernels, frozenset([path.Sensitivities]), _SINGLES)
    try:
        for function in SHARED:
            written.add(function)
        material, rates = _material(written), _drive_rates(written)
    except UntranslatableError as error:
        raise ConfigError(f"{error}; write the law in numbers, `math` and `if` alone") from error
    sizes = {"ROW": ROW, "STATES": path.STATES, "DRIVES": max(len(acting("drive")), 1), "BRANCHES": max(BRANCHES, 1)}
    head = "".join(
        (
            "/* The laws of the damper and the path through them, translated from those that pzd computes with. */\n",
            '#ifndef LAWS_H\n#define LAWS_H\n\n#include "real.h"\n\n',
            *(f"#define {name} {size}\n" for name, size in sizes.items()),
            f"#define TOLERANCE {number(TOLERANCE, SINGLE_TOLERANCE)} /* of a piece, as a share of the force */\n\n",
            "typedef struct { real at[ROW]; } row;\n",
            written.types(),
            "\nreal least(real one, real other);\nreal most(real one, real other);\n",
            written.prototypes(shared=True),
            *(f"{line};\n" for line in (material + rates).splitlines() if line[:1] not in "{} "),
            "\n#endif\n",
        )
    )
    parts = (_EXTREMES, written.prototypes(shared=False), written.definitions(), material + rates)
    return head, '#include "laws.h"\n\n' + "\n".join(parts)


_EXTREMES = """real least(real one, real other)
{
    return other < one ? other : one;
}

real most(real one, real other)
{
    return other > one ? other : one;
}
"""


def _material(written: Translation) -> str:
    """Write the row of the element at a temperature: the factors on T0, C and k, and none of them at its limit."""
    lines = []
    for effect in acting("material"):
        for name, law in functions(effect, module_of(effect)).items():
            own = {p.name: f"own[{MATERIAL.index((effect.name, p.name))}]" for p in effect.parameters}
            given = ", ".join(
                {**own, "temperature": "temperature", "reference": "reference"}[a] for a in arguments(law)
            )
            lines.append(f"p.at[{MATERIAL_FACTORS[name]}] *= {written.add(law)}({given});")
    limits = f"const real_real moved = {written.add(path.off_the_limits)}(p.at[{T0}], p.at[{C}], p.at[{K}]);"
    lines += [limits, f"p.at[{C}] = moved.at0;", f"p.at[{K}] = moved.at1;", "return p;"]
    body = "".join(f"    {line}\n" for line in lines)
    return f"row material(row p, const real *own, real temperature, real reference)\n{{\n{body}}}\n\n"


def _drive_rates(written: Translation) -> str:
    """Write the rates of the effective signals, one behind another, while the control signal stands at a value."""
    lines = []
    for i, effect in enumerate(acting("drive")):
        law = functions(effect, module_of(effect))["rate"]
        given = {p.name: f"p[{DRIVE.index((effect.name, p.name))}]" for p in effect.parameters}
        acts = " || ".join(f"{given[p.name]} != {number(p.neutral)}" for p in effect.parameters)
        given |= {"effective": f"state[{i}]", "now": "now", "rate": "R(0.0)"}
        called = f"{written.add(law)}({', '.join(given[a] for a in arguments(law))})"
        lines += [f"if ({acts}) {{", f"    rates[{i}] = {called};", f"    now = state[{i}];", "}"]
    body = "".join(f"    {line}\n" for line in lines)
    return f"void drive_rates(real now, const real *state, const real *p, real *rates)\n{{\n{body}}}\n\n"


# --- The damper as constants ---

ROW = len(ELEMENT) + len(STROKE_AND_FLOW)
"""Numbers in a row of the element."""
MATERIAL = tuple((effect.name, p.name) for effect in acting("material") for p in effect.parameters)
"""Columns of the material, which act at the temperature of each step."""
VARIABLES = (
    *("displacement", "velocity", "signal", "temperature", "force", "initial_force", "zero", "time", "acceleration"),
)
"""Variables of `sources/model.c`, in the order of the value references of an FMU."""
OF_THE_RIG = tuple(effect.name for effect in acting("sensor"))
"""Effects of the channels of a rig, which the damper itself does not have."""


@dataclass(frozen=True, eq=False)
class Dynamics:
    """A damper as `sources/element.c` takes it."""

    temperatures: Array
    """(t,) rising [degC]; a single 0 where the damper has no axis of temperature."""
    signals: Array
    """(m,) rising, the effective control signal; a single 0 where there is none."""
    rows: Array
    """(t, m, columns) T0, C and k without drift, then stroke and flow, parallel and material; linear between, held
    beyond."""
    drive: Array
    """(d,) row of the drive."""
    reference: float
    """T_ref of the drift, the lowest temperature without one [degC]."""
    depends_on_temperature: bool
    depends_on_acceleration: bool

    @classmethod
    def of(cls, damper: Damper) -> Dynamics:
        """Lay out a damper with its effects."""
        drifts = [effect.name for effect in acting("material") if effect.name in damper.effects]
        still = damper.without_effects(*drifts)
        known = sorted({row.temperature_degC for row in damper.base if row.temperature_degC is not None})
        at_temperatures: list[float | None] = [*known] or [None]
        temperatures, reference = np.array(known or [0.0]), damper.reference_temperature_degC
        signals = nodes_of(damper, at_temperatures[0]).voltages
        # drift is left out of the rows: element.c applies it at the temperature of each step
        rows = [element_rows(still, signals, T) for T in at_temperatures]
        beside = [columns_of(damper, columns, signals) for columns in (PARALLEL, MATERIAL)]
        return cls(
            temperatures,
            signals,
            np.stack([_beside(signals.size, row, *beside) for row in rows]),
            drive_row_of(damper),
            float(temperatures[0]) if reference is None else reference,
            len(known) > 1 or bool(drifts),
            "fluid_inertia" in damper.effects,
        )


def _beside(count: int, *parts: Array) -> Array:
    """Put rows side by side, each as often as there are nodes."""
    return np.hstack([np.broadcast_to(part, (count, part.shape[1])) for part in parts])


# --- Continuous states, for model exchange ---


@dataclass(frozen=True)
class State:
    """A continuous state of the damper."""

    name: str
    place: int
    """In the row of `element_rates`: the deflection of the oil spring, then the drive."""
    nominal: float
    """Its size in use, by which a solver takes its tolerance."""
    of: Effect | None = None
    """Of the drive; None for that of the element."""


def states_of(damper: Damper, dynamics: Dynamics) -> tuple[State, ...]:
    """Return the continuous states: the deflection of the oil spring, and the signal behind each effect of the drive.

    The branches have none: `sources/model.c` takes their closed form over the way of the rod since it last turned.
    """
    friction, damping, stiffness = (dynamics.rows[..., column].ravel() for column in (T0, C, K))
    damps, spring = path.off_the_limits(friction, damping, stiffness)
    found = [State("deflection", 0, float(np.max((friction + damps) / spring)))]
    signal = float(np.max(np.abs(dynamics.signals))) or 1.0
    for i, effect in enumerate(acting("drive")):
        if _is_on(effect, damper):
            found.append(State(f"{effect.name}_signal", 1 + i, signal, effect))
    return tuple(found)


def _is_on(effect: Effect, damper: Damper) -> bool:
    """Return whether an effect of a damper acts."""
    given = damper.effects.get(effect.name, {})
    return any(np.any(np.asarray(given.get(p.name, p.neutral)) != p.neutral) for p in effect.parameters)


def no_exchange(damper: Damper) -> str | None:
    """Return why a damper has no equations of state for model exchange; None where it has them.

    A signal that follows another one's rate has none: what comes into the damper is the signal, not its rate.
    """
    for effect in acting("drive"):
        if _is_on(effect, damper):
            law = functions(effect, module_of(effect))["rate"]
            given = {p.name: damper.effects[effect.name].get(p.name, p.neutral) for p in effect.parameters}
            rates = [
                law(**{a: (given | {"effective": 0.0, "now": now, "rate": 1.0})[a] for a in arguments(law)})
                - law(**{a: (given | {"effective": 0.0, "now": now, "rate": 0.0})[a] for a in arguments(law)})
                for now in (*given.values(), 0.0)
            ]
            if any(rates):
                return f"{effect.name} follows the rate of the control signal, which a solver does not give"
    for effect in acting("branch"):
        values = [damper.effects.get(effect.name, {}).get(p.name, p.neutral) for p in effect.parameters]
        if _is_on(effect, damper) and any(isinstance(one, tuple) and len(set(one)) > 1 for one in values):
            return f"{effect.name} changes with the control signal, by whose way its memory goes"
    return None


def start_values(content: Content, dynamics: Dynamics) -> Mapping[str, float]:
    """Return start values of inputs and parameters by their name in C."""
    nearest = float(dynamics.signals[np.argmin(np.abs(dynamics.signals))])
    return {"START_SIGNAL": nearest, "START_TEMPERATURE": dynamics.reference, "START_ZERO": content.damper.zero_m}


def data_of(content: Content, dynamics: Dynamics) -> tuple[str, str]:
    """Write the constants, and the token by which an FMU and its description know each other.

    Parameters
    ----------
    content : the damper
    dynamics : the same, laid out
    """
    numbers = {"REFERENCE_TEMPERATURE": dynamics.reference, **start_values(content, dynamics)}
    sizes = {"TEMPERATURE_NODES": dynamics.temperatures.size, "SIGNAL_NODES": dynamics.signals.size}
    sizes |= {"PARALLEL": len(PARALLEL), "COLUMNS": dynamics.rows.shape[2]}
    states = () if no_exchange(content.damper) else states_of(content.damper, dynamics)
    sizes |= {"CONTINUOUS": len(states)}
    kept = states or (State("none", 0, 1.0),)  # C has no empty arrays
    body = "".join(
        (
            f"enum {{ {', '.join(VARIABLES).upper()}, VARIABLES }};\n",
            *(f"#define {name} {size}\n" for name, size in sizes.items()),
            *(f"#define {name} {real(value)}\n" for name, value in numbers.items()),
            f"#define DRIVE {{{', '.join(map(real, dynamics.drive))}}}\n",
            "/* Each row: T0 [N], C [N s/m], k [N/m], then by effect and parameter:\n",
            *(f" * {' '.join(line)}\n" for line in _lines([*STROKE_AND_FLOW, *PARALLEL, *MATERIAL])),
            " */\n",
            array("real", "TEMPERATURES", dynamics.temperatures, real),
            array("real", "SIGNALS", dynamics.signals, real),
            array("real", "ROWS", dynamics.rows, real),
            array("int", "STATE_PLACES", [one.place for one in kept], lambda place: str(int(place))),
            array("double", "STATE_NOMINALS", [one.nominal for one in kept], lambda nominal: repr(float(nominal))),
        )
    )
    token = str(UUID(bytes=sha256(f"{content.origin}\n{content.name}\n{body}{laws()}".encode()).digest()[:16]))
    guard = '#ifndef ELEMENT_DATA_H\n#define ELEMENT_DATA_H\n#include "real.h"\n'
    return f'{head(content)}{guard}#define TOKEN "{token}"\n{body}#endif\n', token


def _lines(columns: Sequence[tuple[str, str]]) -> Iterator[list[str]]:
    """Yield the names of columns, so many a line."""
    names = [f"{effect}.{parameter}" for effect, parameter in columns]
    yield from (names[i : i + _WIDTH // 2] for i in range(0, len(names), _WIDTH // 2))


ELEMENT_SOURCES = ("element.c", "laws.c")
"""What is compiled for the damper with its dynamics."""


def element_files(content: Content, dynamics: Dynamics) -> tuple[dict[str, bytes], str]:
    """Return the sources of the damper with its dynamics by name, and its token.

    Parameters
    ----------
    content : the damper
    dynamics : the same, laid out
    """
    data, token = data_of(content, dynamics)
    declarations, definitions = ((head(content) + text).encode() for text in laws())
    found = {name: source(content, name) for name in ("element.h", "element.c", "real.h")}
    return found | {"laws.h": declarations, "laws.c": definitions, "element_data.h": data.encode()}, token
