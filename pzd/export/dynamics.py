"""The damper with its dynamics as constants in C: parameters over temperature and control signal, linear between.

`sources/element.c` carries the damper from these constants; what it carries exactly is listed in `CARRIED`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from uuid import UUID

import numpy as np
from numpy.typing import ArrayLike

from pzd.damper.compiled.columns import NEUTRAL, acting, columns_of, value_of
from pzd.damper.effect import ELEMENT
from pzd.damper.model import Damper
from pzd.damper.parameter_rows import bingham_parameters, nodes_of
from pzd.export.content import Content
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


def double(value: float) -> str:
    """Write a constant of double precision."""
    return repr(float(value)).replace("inf", "INFINITY")


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


# --- The damper as constants ---

CARRIED = (
    *("accumulator", "asymmetry", "end_stop", "fluid_inertia", "gas_spring", "lash", "orifice_quadratic"),
    *("piezo_hysteresis", "preload_offset", "relief_valve", "knee", "second_branch", "stribeck_friction"),
    "temperature_drift",
)
"""Effects whose path under held inputs is a closed form, piece by piece; `sources/element.c` holds them."""
VARIABLES = (
    *("displacement", "velocity", "signal", "temperature", "force", "initial_force", "zero", "time", "acceleration"),
)
"""Variables of `sources/model.c`, in the order of the value references of an FMU."""
OF_THE_RIG = tuple(effect.name for effect in acting("sensor"))
"""Effects of the channels of a rig, which the damper itself does not have."""
PLAY = ("piezo_hysteresis", "r")
"""Effect and parameter of the play of the drive, which acts on the control signal and is no column."""
COLUMNS = tuple(
    (effect, parameter) for effect, parameter in NEUTRAL if effect in CARRIED and (effect, parameter) != PLAY
)
"""Effect and parameter of each column of a row behind T0, C and k."""


@dataclass(frozen=True, eq=False)
class Dynamics:
    """A damper that `sources/element.c` can carry exactly."""

    temperatures: Array
    """(t,) rising [degC]; a single 0 where the damper has no axis of temperature."""
    signals: Array
    """(m,) rising, the effective control signal; a single 0 where there is none."""
    rows: Array
    """(t, m, columns) T0, C and k without drift, then `COLUMNS`; linear between, held beyond."""
    play: float
    """Half-width of the play of the drive, in units of the control signal."""
    reference: float
    """T_ref of the drift, the lowest temperature without one [degC]."""
    depends_on_temperature: bool
    depends_on_acceleration: bool

    @classmethod
    def of(cls, damper: Damper, name: str) -> Dynamics:
        """Lay out a damper.

        Parameters
        ----------
        damper : with its effects
        name : of the format

        Raises
        ------
        ConfigError : when it has an effect that is not carried exactly, or is rigid or without damping
        """
        others = [effect for effect in damper.effects if effect not in (*CARRIED, *OF_THE_RIG)]
        if others:
            raise ConfigError(
                f"--to {name}: {', '.join(others)} of the damper has no closed form under held inputs and cannot be "
                "carried exactly; a table, as --to mat writes, holds its steady force"
            )
        if any(math.isinf(row.k_N_per_m) or row.C_Ns_per_m == 0.0 for row in damper.base):
            raise ConfigError(
                f"--to {name}: follows the load of the oil spring, which takes a number for k and a C above 0: write "
                "them into k_N_per_m and C_Ns_per_m of 3-diagnose/damper.yaml (got a rigid damper, or one without "
                "damping)"
            )
        drifts = [effect.name for effect in acting("material") if effect.name in damper.effects]
        still = damper.model_copy(update={"effects": {k: v for k, v in damper.effects.items() if k not in drifts}})
        known = sorted({row.temperature_degC for row in damper.base if row.temperature_degC is not None})
        at_temperatures: list[float | None] = [*known] or [None]
        temperatures, reference = np.array(known or [0.0]), damper.reference_temperature_degC
        signals = nodes_of(damper, at_temperatures[0]).voltages
        # drift is left out of the rows: element.c applies it at the temperature of each step
        extra = np.broadcast_to(columns_of(damper, COLUMNS, signals), (signals.size, len(COLUMNS)))
        bases = [
            np.broadcast_to(bingham_parameters(still, signals, T), (signals.size, len(ELEMENT)))
            for T in at_temperatures
        ]
        return cls(
            temperatures,
            signals,
            np.stack([np.hstack([base, extra]) for base in bases]),
            value_of(damper, *PLAY),
            float(temperatures[0]) if reference is None else reference,
            len(known) > 1 or bool(drifts),
            "fluid_inertia" in damper.effects,
        )


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
    columns = [*ELEMENT, *(f"{effect}_{parameter}" for effect, parameter in COLUMNS)]
    numbers = {"PLAY": dynamics.play, "REFERENCE_TEMPERATURE": dynamics.reference, **start_values(content, dynamics)}
    sizes = {"TEMPERATURE_NODES": dynamics.temperatures.size, "SIGNAL_NODES": dynamics.signals.size}
    body = "".join(
        (
            f"enum {{ {', '.join(VARIABLES).upper()}, VARIABLES }};\n",
            f"enum {{ {', '.join(columns).upper()}, COLUMNS }};\n",
            *(f"#define {name} {size}\n" for name, size in sizes.items()),
            *(f"#define {name} {double(number)}\n" for name, number in numbers.items()),
            array("double", "TEMPERATURES", dynamics.temperatures, double),
            array("double", "SIGNALS", dynamics.signals, double),
            array("double", "ROWS", dynamics.rows, double),
        )
    )
    token = str(UUID(bytes=sha256(f"{content.origin}\n{content.name}\n{body}".encode()).digest()[:16]))
    guard = "#ifndef ELEMENT_DATA_H\n#define ELEMENT_DATA_H\n#include <math.h>\n"
    return f'{head(content)}{guard}#define TOKEN "{token}"\n{body}#endif\n', token
