"""Model descriptions of FMI 2.0 and 3.0, and the shared library of an FMU."""

from __future__ import annotations

import logging
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from xml.sax.saxutils import quoteattr

from pzd.export.content import Content
from pzd.export.dynamics import OF_THE_RIG, VARIABLES, Dynamics, no_exchange, start_values, states_of
from pzd.quantities import ACCELERATION, DISPLACEMENT, FORCE, TEMPERATURE, TIME, VELOCITY, Quantity
from pzd.schema.errors import FilesError

IDENTIFIER = "damper"
"""Name of the model in C, and of the library."""
Causality = Literal["input", "output", "parameter", "independent", "local"]
INDICATORS = 5
"""Event indicators, those of `sources/element.h`: yield and relief valve to either side, and the turn of the rod."""
_UNITS: Mapping[str, Mapping[str, float]] = {
    "s": {"s": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "A": {"A": 1},
    "degC": {"K": 1, "offset": 273.15},
    "1": {},
}
"""Units by the exponents of the base units."""


@dataclass(frozen=True)
class Variable:
    """One variable of the FMU."""

    name: str
    reference: int
    """Its place in `VARIABLES`; states, rates and indicators stand behind them."""
    causality: Causality
    unit: str
    meaning: str
    start: float | None = None
    nominal: float | None = None
    rate_of: int | None = None
    """Reference of the state whose rate it is."""


def equations(content: Content, dynamics: Dynamics) -> tuple[Variable, ...]:
    """Return the states and their rates, one after the other; none where there is no model exchange.

    Parameters
    ----------
    content : the damper
    dynamics : the same, laid out
    """
    found = list[Variable]()
    for state in () if no_exchange(content.damper) else states_of(content.damper, dynamics):
        place, unit = len(VARIABLES) + len(found), "m"
        meaning = "elastic deflection of the oil spring"
        if state.of is not None:
            unit, meaning = content.control.quantity.unit, f"control signal behind {state.of.name}"
        found.append(Variable(state.name, place, "local", unit, meaning, nominal=state.nominal))
        rate = Variable(f"{state.name}_rate", place + 1, "local", f"{unit}/s", f"rate of {state.name}", rate_of=place)
        found.append(rate)
    return tuple(found)


def variables(content: Content, dynamics: Dynamics) -> tuple[Variable, ...]:
    """Return the variables; an input only where the force of the damper depends on it.

    Parameters
    ----------
    content : the damper
    dynamics : the same, laid out
    """
    start = start_values(content, dynamics)
    found = [
        _input("displacement", DISPLACEMENT, 0.0, "; carried on with the velocity"),
        _input("velocity", VELOCITY, 0.0),
        Variable("force", _reference("force"), "output", FORCE.unit, "damper force, positive in rebound"),
        _parameter("initial_force", FORCE, 0.0, "force of the oil spring at the start"),
        _parameter("zero", DISPLACEMENT, start["START_ZERO"], "displacement that effects count from"),
    ]
    if content.controlled:
        found.append(_input("signal", content.control.quantity, start["START_SIGNAL"]))
    if dynamics.depends_on_temperature:
        found.append(_input("temperature", TEMPERATURE, start["START_TEMPERATURE"]))
    if dynamics.depends_on_acceleration:
        found.append(_input("acceleration", ACCELERATION, 0.0))
    return tuple(sorted(found, key=lambda one: one.reference))


def _reference(place: str) -> int:
    return VARIABLES.index(place)


def _input(place: str, quantity: Quantity, start: float, more: str = "") -> Variable:
    meaning = f"{quantity.meaning}{more}, held over a step"
    return Variable(quantity.name, _reference(place), "input", quantity.unit, meaning, start)


def _parameter(name: str, quantity: Quantity, start: float, meaning: str) -> Variable:
    return Variable(name, _reference(name), "parameter", quantity.unit, meaning, start)


def description(content: Content) -> str:
    """Describe the model in a line."""
    carried = [name for name in content.damper.effects if name not in OF_THE_RIG]
    rig = [name for name in content.damper.effects if name in OF_THE_RIG]
    text = f"Bingham element with oil spring{', ' if carried else ''}{', '.join(carried)}; {content.origin}"
    return f"{text}; without {', '.join(rig)} of the rig" if rig else text


def fmi2(content: Content, dynamics: Dynamics, token: str, sources: Sequence[str]) -> str:
    """Write modelDescription.xml of FMI 2.0.

    Parameters
    ----------
    content : the damper
    dynamics : the same, laid out
    token : by which the library knows the description
    sources : names of the files to compile
    """
    solved = equations(content, dynamics)
    found = (*variables(content, dynamics), *solved)
    output = next(place for place, one in enumerate(found, 1) if one.causality == "output")
    places = {one.reference: place for place, one in enumerate(found, 1)}
    states = ("canGetAndSetFMUstate", "canSerializeFMUstate", "canNotUseMemoryManagementFunctions")
    files = ("<SourceFiles>", *(_alone("File", {"name": name}) for name in sources), "</SourceFiles>")
    derived = (*states, "providesDirectionalDerivative")
    exchange = (_open("ModelExchange", _abilities(*derived)), *files, "</ModelExchange>") if solved else ()
    steps = ("canHandleVariableCommunicationStepSize", "canInterpolateInputs")
    cosimulation = (_open("CoSimulation", _abilities(*steps, *derived)), *files, "</CoSimulation>")

    def real_of(one: Variable) -> str:
        rate = {} if one.rate_of is None else {"derivative": str(places[one.rate_of])}
        return _alone("Real", _number(one) | rate)

    def unknowns(kind: str, among: Iterable[int]) -> str:
        listed = "".join(_alone("Unknown", {"index": str(place)}) for place in among)
        return f"<{kind}>{listed}</{kind}>"

    scalars = (_open("ScalarVariable", _attributes(one)) + real_of(one) + "</ScalarVariable>" for one in found)
    rates = [places[one.reference] for one in solved if one.rate_of is not None]
    structure = (
        unknowns("Outputs", [output]),
        *([unknowns("Derivatives", rates)] if rates else []),
        unknowns("InitialUnknowns", [output, *(places[one.reference] for one in solved)]),
    )
    head = {"guid": token} | ({"numberOfEventIndicators": str(INDICATORS)} if solved else {})
    return _description_of(content, "2.0", head, (*exchange, *cosimulation, *_units(found)), scalars, structure)


def fmi3(content: Content, dynamics: Dynamics, token: str) -> str:
    """Write modelDescription.xml of FMI 3.0.

    Parameters
    ----------
    content : the damper
    dynamics : the same, laid out
    token : by which the library knows the description
    """
    time = Variable(TIME.name, _reference("time"), "independent", TIME.unit, "simulated time")
    solved = equations(content, dynamics)
    first = len(VARIABLES) + len(solved)
    indicators = [
        Variable(f"indicator_{i + 1}", first + i, "local", "1", "changes its sign where an equation bends or jumps")
        for i in range(INDICATORS if solved else 0)
    ]
    found = (*variables(content, dynamics), *solved, *indicators, time)
    output = next(one.reference for one in found if one.causality == "output")
    states = ("canGetAndSetFMUState", "canSerializeFMUState", "providesDirectionalDerivatives")
    exchange = [_alone("ModelExchange", _abilities("needsCompletedIntegratorStep", *states))] if solved else []
    cosimulation = _alone("CoSimulation", _abilities("canHandleVariableCommunicationStepSize", *states))

    def float_of(one: Variable) -> str:
        rate = {} if one.rate_of is None else {"derivative": str(one.rate_of)}
        return _alone("Float64", _attributes(one) | _number(one) | rate)

    def unknowns(kind: str, among: Iterable[int]) -> list[str]:
        return [_alone(kind, {"valueReference": str(reference)}) for reference in among]

    structure = (
        *unknowns("Output", [output]),
        *unknowns("ContinuousStateDerivative", [one.reference for one in solved if one.rate_of is not None]),
        *unknowns("InitialUnknown", [output, *(one.reference for one in solved)]),
        *unknowns("EventIndicator", [one.reference for one in indicators]),
    )
    token_of, interfaces = {"instantiationToken": token}, (*exchange, cosimulation, *_units(found))
    return _description_of(content, "3.0", token_of, interfaces, map(float_of, found), structure)


def _description_of(
    content: Content,
    version: str,
    token: Mapping[str, str],
    definitions: Iterable[str],
    variables: Iterable[str],
    structure: Iterable[str],
) -> str:
    """Put a model description together."""
    head = {"fmiVersion": version, "modelName": content.name, **token, "description": description(content)}
    head |= {"generationTool": content.origin, "variableNamingConvention": "flat"}
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        _open("fmiModelDescription", head),
        *definitions,
        '<LogCategories><Category name="logStatusError"/></LogCategories>',
        *("<ModelVariables>", *variables, "</ModelVariables>"),
        *("<ModelStructure>", *structure, "</ModelStructure>"),
        "</fmiModelDescription>",
    ]
    return "\n".join(lines) + "\n"


def build_description(sources: Sequence[str]) -> str:
    """Write buildDescription.xml of FMI 3.0: how the sources are compiled."""
    files = "".join(_alone("SourceFile", {"name": name}) for name in sources)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
        f'<BuildConfiguration modelIdentifier="{IDENTIFIER}"><SourceFileSet language="C99">{files}</SourceFileSet>'
        "</BuildConfiguration>\n</fmiBuildDescription>\n"
    )


def _abilities(*names: str) -> dict[str, str]:
    return {"modelIdentifier": IDENTIFIER} | dict.fromkeys(names, "true")


def _attributes(one: Variable) -> dict[str, str]:
    fixed = {"parameter": "fixed"}.get(one.causality, "continuous")
    found = {"name": one.name, "valueReference": str(one.reference), "description": one.meaning}
    found |= {"causality": one.causality, "variability": fixed}
    initial = {"output": "calculated", "local": "calculated", "parameter": "exact"}.get(one.causality)
    return found | ({"initial": initial} if initial else {})


def _number(one: Variable) -> dict[str, str]:
    numbers = {"start": one.start, "nominal": one.nominal}
    return {"unit": one.unit} | {name: repr(float(value)) for name, value in numbers.items() if value is not None}


def _units(found: Sequence[Variable]) -> list[str]:
    names = list(dict.fromkeys(one.unit for one in found))
    defined = [
        _open("Unit", {"name": name})
        + (_alone("BaseUnit", {k: str(v) for k, v in _UNITS[name].items()}) if name in _UNITS else "")
        + "</Unit>"
        for name in names
    ]
    return ["<UnitDefinitions>", *defined, "</UnitDefinitions>"]


def _open(tag: str, attributes: Mapping[str, str]) -> str:
    return f"<{tag}{''.join(f' {name}={quoteattr(value)}' for name, value in attributes.items())}>"


def _alone(tag: str, attributes: Mapping[str, str]) -> str:
    return f"{_open(tag, attributes)[:-1]}/>"


# --- The shared library, the same bytes each time ---

log = logging.getLogger(__name__)

# no fused multiply-add, so that every machine rounds alike
_FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off")
_PLATFORMS = {
    ("linux", "x86_64"): ("linux64", "x86_64-linux"),
    ("linux", "aarch64"): (None, "aarch64-linux"),
    ("darwin", "x86_64"): ("darwin64", "x86_64-darwin"),
    ("darwin", "arm64"): ("darwin64", "aarch64-darwin"),
}
"""Folder of the library in an FMU of FMI 2.0, where there is one, and of FMI 3.0."""


def folders() -> tuple[str | None, str | None]:
    """Return the folder of the library in an FMU of FMI 2.0 and of FMI 3.0; None, with a warning, where it has none."""
    machine = (sys.platform, platform.machine())
    found = _PLATFORMS.get(machine, (None, None))
    without = [version for version, folder in zip(("2.0", "3.0"), found, strict=True) if folder is None]
    if _found_compiler() is None:
        found, without = (None, None), []
        log.warning("there is no C compiler (gcc or cc): the FMUs hold their sources and no library")
    for version in without:
        log.warning("pzd builds no library for FMI %s on %s %s: that FMU holds its sources alone", version, *machine)
    return found


def suffix() -> str:
    """Return the ending of a shared library on this machine."""
    return ".dylib" if sys.platform == "darwin" else ".so"


def compiled_library(sources: Mapping[str, bytes], to_compile: Sequence[str]) -> bytes:
    """Compile the library.

    Parameters
    ----------
    sources : every file by name
    to_compile : those of them that are compiled

    Raises
    ------
    FilesError : when there is no compiler, or it refuses them
    """
    chosen = compiler()
    # the id of a build would differ from build to build
    linked = ["-Wl,--build-id=none"] if sys.platform == "linux" else []
    with tempfile.TemporaryDirectory() as place:
        for name, data in sources.items():
            (Path(place) / name).write_bytes(data)
        command = [chosen, *_FLAGS, *linked, *to_compile, "-o", "library", "-lm"]
        done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)  # noqa: S603  # our own sources
        if done.returncode:
            said = " ".join(done.stderr.split()) or f"exit code {done.returncode}"
            raise FilesError(f"{chosen}: it does not compile the sources of the FMU; mend or remove it ({said})")
        return (Path(place) / "library").read_bytes()


def compiler() -> str:
    """Return the C compiler.

    Raises
    ------
    FilesError : when there is none
    """
    found = _found_compiler()
    if found is None:
        raise FilesError("there is no C compiler (gcc or cc); install one")
    return found


def _found_compiler() -> str | None:
    return shutil.which("gcc") or shutil.which("cc")
