"""The command that rates measured accelerations by ISO 2631-1:1997."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from pzd.cli.options import Json, Quiet, Verbose
from pzd.cli.output import DONE, Output
from pzd.schema.errors import ConfigError

RideFiles = Annotated[
    list[Path] | None,
    typer.Argument(metavar="FILE...", help="Files of a ride.", show_default=False),
]
Axis = Annotated[str, typer.Option("--axis", metavar="z|xyz", help="Axes: x, y, z, xyz, or rx, ry, rz at the seat.")]
Position = Annotated[str, typer.Option("--position", metavar="NAME", help="seat, back, feet, standing, lying or head.")]
Unit = Annotated[str | None, typer.Option("--unit", metavar="UNIT", help="m/s2 or g, where the headers do not say it.")]
Columns = Annotated[
    list[str] | None,
    typer.Option(
        "--column",
        metavar="AXIS=HEADER",
        help="The column of an axis, or of the time (time=HEADER); can be given again.",
        show_default=False,
    ),
]
Rate = Annotated[
    float | None, typer.Option("--rate", metavar="HZ", help="Samples a second, where no column holds the time.")
]
Hours = Annotated[float, typer.Option("--hours", metavar="H", help="Hours of exposure a day, for A(8).")]
Beside = Annotated[
    Path | None,
    typer.Option("--beside", metavar="RUN", help="Print the simulated rides of a run, such as runs/quickstart, too."),
]
Conformance = Annotated[
    bool,
    typer.Option("--conformance", help="Print how closely the weightings keep to the standard instead."),
]


def rate(
    files: RideFiles = None,
    axis: Axis = "z",
    position: Position = "seat",
    unit: Unit = None,
    column: Columns = None,
    rate_hz: Rate = None,
    hours: Hours = 8.0,
    beside: Beside = None,
    conformance: Conformance = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Rate measured accelerations of a ride by ISO 2631-1:1997 and Directive 2002/44/EC."""
    from pzd.comfort.rating import as_data, rated
    from pzd.comfort.recorded import read_ride
    from pzd.front.vibration import axes_of, rating_lines

    output = Output(quiet=quiet, verbose=verbose, as_json=as_json)
    if conformance:
        return _conformance(output)
    if not files:
        raise ConfigError("pzd rate: name the files of a ride, or say --conformance; see pzd rate --help")
    axes, named = axes_of(axis), _columns(column or [])
    found: list[dict[str, Any]] = []
    for path in files:
        record = read_ride(path, axes, unit, named, rate_hz)
        rating = rated(record.acceleration, record.rate, axes, position, hours)
        found.append({"file": path.as_posix(), "columns": list(record.columns), **as_data(rating)})
        output.say(f"{path}: {', '.join(record.columns)}", *(f"  {line}" for line in rating_lines(rating)))
    simulated = _simulated(beside) if beside is not None else []
    for ride in simulated:
        output.say("{case}: a_w {a_w:.4g} m/s2, MTVV {mtvv:.4g} m/s2, VDV {vdv:.4g} m/s^1.75, simulated".format(**ride))
    if as_json:
        rides = {"simulated": simulated} if beside is not None else {}
        output.say_json(found[0] | rides if len(found) == 1 else {"files": found} | rides)
    return DONE


def _columns(given: list[str]) -> dict[str, str]:
    pairs = [one.partition("=") for one in given]
    for name, equals, header in pairs:
        if not (name and equals and header):
            raise ConfigError(f"--column: must read AXIS=HEADER, or time=HEADER (got {name}{equals}{header})")
    return {name: header for name, _, header in pairs}


def _simulated(folder: Path) -> list[dict[str, Any]]:
    """Return the weighted measures of every ride of a run."""
    from pzd.artefacts import Rides, WeightedRow
    from pzd.pipeline.run_summary import summary_of
    from pzd.schema.csvfile import read_rows

    run = summary_of(folder)
    if not run.summary:
        raise ConfigError(f"--beside {folder}: this run has no rides; give one that has")
    rows = read_rows(run.folder / Rides.folder / "weighted.csv", WeightedRow, run.control)
    return [
        {
            "case": row.case,
            "point": row.point,
            "weighting": row.weighting,
            "a_w": row.a_w_m_per_s2,
            "mtvv": row.MTVV_m_per_s2,
            "vdv": row.VDV_m_per_s1_75,
            "crest_factor": row.peak_m_per_s2 / row.a_w_m_per_s2 if row.a_w_m_per_s2 else 0.0,
        }
        for row in rows
    ]


def _conformance(output: Output) -> int:
    from pzd.comfort.conformance import checks, page

    if output.as_json:
        output.say_json([vars(check) for check in checks()])
    output.say(*page())
    return DONE


COMMANDS = (rate,)
