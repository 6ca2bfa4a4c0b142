"""C: the table for a control unit, with its inverse and the comfort law, and the damper with its dynamics.

The one is in single precision, without state; the other in double or single. Neither allocates memory.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pzd.export.content import Content
    from pzd.record import Record

NAME = "c"


def files(content: Content) -> Files:
    """Write header and source, and the data that the source includes.

    Raises
    ------
    ConfigError : when the table has fewer than two control signals, or empty cells
    """
    from pzd.export.dynamics import source
    from pzd.schema.errors import ConfigError

    if not content.adjustable:
        raise ConfigError(
            f"--to {NAME}: the table has no second control signal, so that there is nothing for a unit to set; "
            "--to mat holds its force over velocity"
        )
    names = ("damper.h", "damper.c")
    return {name: source(content, name) for name in names} | {"damper_data.h": _data(content).encode()}


def _data(content: Content) -> str:
    """Write the table and the car as constants."""
    import numpy as np

    from pzd.export.dynamics import array, head, single
    from pzd.simulate.control.demand import TIE_BREAKS

    content.full_grid(NAME)
    car, first = content.car, content.lookups[0]
    forces = [np.stack([at.rebound[:, :-1], at.compression[:, :-1]], axis=1) for at in content.lookups]
    temperatures = [t or 0.0 for t in content.temperatures]
    sizes = {
        "TEMPERATURES": len(temperatures),
        "SIGNALS": first.voltages.size,
        "SPEEDS": first.speeds.size - 1,
        "HELD": int(content.clamped),
        **{name.upper(): number for name, number in TIE_BREAKS.items()},
        "TIE_BREAK": TIE_BREAKS[content.tie_break],
    }
    return "".join(
        (
            head(content),
            "#ifndef DAMPER_DATA_H\n#define DAMPER_DATA_H\n\n",
            *(f"#define DAMPER_{name} {size}\n" for name, size in sizes.items()),
            "\n/* Temperatures [degC], control signals, speeds [m/s], and forces [N] by them:\n",
            " * at each temperature and signal first rebound, then compression. */\n",
            array("float", "TEMPERATURES", temperatures, single),
            array("float", "SIGNALS", first.voltages, single),
            array("float", "SPEEDS", first.speeds[:-1], single),
            array("float", "FORCES", np.stack(forces), single),
            "\n/* The car: acceleration at K by the force of each axle D [1/kg], stiffness of its springs [N/m],\n",
            " * extension of a damper over deflection of its suspension, and number of dampers at each axle. */\n",
            array("float", "FORCE_TO_COMFORT", car.force_to_comfort(), single),
            array("float", "SPRING_STIFFNESS", car.stiffnesses, single),
            array("float", "MOTION_RATIO", car.motion_ratios, single),
            array("float", "DAMPERS", car.dampers, single),
            "\n#endif\n",
        )
    )


# --- The damper with its dynamics ---


def dynamic_files(content: Content) -> Files:
    """Write the sources of the damper with its dynamics, and a program that runs it along a sampled motion.

    Raises
    ------
    ConfigError : when an effect of the user's own has a law that C cannot hold
    """
    from pzd.export.dynamics import Dynamics, element_files, source

    element, _ = element_files(content, Dynamics.of(content.damper))
    return element | {"run.c": source(content, "run.c")}


def certified(content: Content, records: Sequence[Record], versions: Mapping[str, str]) -> Files:
    """Write the same with the certificate of either precision on the records of the run.

    Raises
    ------
    ConfigError : when an effect of the user's own has a law that C cannot hold
    FilesError : when there is no compiler, or it refuses the sources
    """
    from pzd.export.certificate import NAME as CERTIFICATE
    from pzd.export.certificate import by_program, certificate

    found = dynamic_files(content)
    run, of = by_program(found), "element.c, double precision"
    single, of_single = by_program(found, SINGLE), "element.c, single precision"
    return {
        **found,
        CERTIFICATE: certificate(content, of, records, run, False, versions),
        f"single-{CERTIFICATE}": certificate(content, of_single, records, single, False, versions),
    }


def lookup_files(content: Content) -> Files:
    """Write the same with the path of the element as a look-up over a fixed step.

    Raises
    ------
    ConfigError : when an effect of the user's own has a law that C cannot hold, or the table has empty cells
    """
    from pzd.export.lookup import lookup_data, lookup_path

    content.full_grid(LOOKUP)
    return {**dynamic_files(content), "lookup_data.h": lookup_data(content, lookup_path(content)).encode()}


LOOKUP = "c-lookup"
SINGLE = "-DDAMPER_SINGLE"
"""What builds the sources in single precision."""

FORMATS = (
    Format(NAME, "table, inverse and comfort law for a control unit", files, adjustable=True),
    Format(
        "c-dynamics",
        "the damper with its dynamics in C, double or single precision",
        dynamic_files,
        certified=certified,
        dynamics=True,
    ),
    Format(
        LOOKUP,
        "the same for a real-time target: a look-up over a fixed step of 1 ms, its largest error told",
        lookup_files,
        dynamics=True,
    ),
)
