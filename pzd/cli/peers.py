"""The command that sets the damper handed on beside published models."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.cli.output import CORES, DONE, RUNS, UNTRUSTED, Config, Jobs, Json, Output, Quiet, Runs, Set, Verbose, complain
from pzd.cli.text_tables import aligned, filled, number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pzd.artefacts.diagnosis import PeerComparison, PeerParameterRow, PeerRow
    from pzd.quantities import Control


def peers(
    config: Config,
    runs: Runs = RUNS,
    overrides: Set = None,
    jobs: Jobs = CORES,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Set the damper handed on beside published models, on tests and voltages that no fit has seen."""
    from pzd.artefacts import Diagnosed, Identified, Rig
    from pzd.artefacts.diagnosis import PeerComparison
    from pzd.diagnosis.peer_comparison import compare_with_peers
    from pzd.pipeline.command import execute, opened
    from pzd.pipeline.dependencies import setting_of
    from pzd.schema.validate import plain_data

    output = Output(quiet=quiet, verbose=verbose)
    given = opened(config, runs, overrides or ())
    run, told = given.run, Output(quiet=quiet or as_json, verbose=verbose)
    marks = execute(given, "diagnose", force=False, jobs=jobs, say=told.say, progress=told.progress)
    with given.placed(), run.locked("pzd peers"):
        found = compare_with_peers(
            run.read(Rig, jobs), run.read(Identified), run.read(Diagnosed), setting_of(given.config, run)
        )
        run.write_extra(PeerComparison.folder, lambda folder: found.write(folder, run.control))
    if as_json:
        output.say_json(plain_data({**vars(found), "not_to_be_trusted": marks}, run.control))
    else:
        output.say(*comparison_lines(found, run.control))
        output.say(f"tables: {run.folder / PeerComparison.folder}")
    complain(f"not to be trusted: {mark}" for mark in marks)
    return UNTRUSTED if marks else DONE


def comparison_lines(found: PeerComparison, control: Control) -> Iterator[str]:
    """The tables: every test kept back, these by control signal and in all, what was left out, and the parameters.

    Parameters
    ----------
    found : the comparison
    control : the control signal, for its name and unit
    """
    kept_back = [row for row in found.rows if row.kept_back == "test"]
    pooled = [row for row in kept_back if row.record is None]
    sections = {
        "tests kept back": [row for row in kept_back if row.record is not None],
        f"tests kept back, by {control.name}": [row for row in pooled if row.voltage_V is not None],
        "all tests kept back": [row for row in pooled if row.voltage_V is None],
        "left out, predicted from its neighbours": [row for row in found.rows if row.kept_back == "voltage"],
    }
    for title, rows in sections.items():
        if rows:
            yield f"{title}:"
            yield from aligned(_table(rows, found.models, control), "  ")
            yield ""
    yield "peers, fitted to all tests:"
    yield from aligned(_parameters(found.parameters, control), "  ")
    if found.moving:
        yield f"not compared, for the control signal moves: {', '.join(found.moving)}"


def _table(rows: Sequence[PeerRow], models: Sequence[str], control: Control) -> list[list[str]]:
    """A line a test, the models side by side."""
    head = ["setting", f"{control.name} [{control.unit}]", "test"]
    head += [f"{figure} {model}" for figure in ("W_s", "R2") for model in models]
    lines: dict[tuple[str, ...], dict[str, PeerRow]] = {}
    for i, row in enumerate(rows):
        place = (str(i // len(models)), number(row.setting), number(row.voltage_V), number(row.record))
        lines.setdefault(place, {})[row.model] = row
    cells = [
        [*place[1:], *(number(by[m].W_s) for m in models), *(_share(by[m].R2) for m in models)]
        for place, by in lines.items()
    ]
    return filled(head, cells, 3)


def _share(value: float | None) -> str:
    """R2 to as many places as tell 0.994 from 0.996."""
    return number(None) if value is None else f"{value:.4f}"


def _parameters(rows: Sequence[PeerParameterRow], control: Control) -> list[list[str]]:
    """A line a model and voltage."""
    head = ["setting", f"{control.name} [{control.unit}]", "model", "parameters", "fit"]
    lines: dict[tuple[str, ...], list[str]] = {}
    for row in rows:
        model = f"{row.model}, {row.form}" if row.form else row.model
        place = number(row.setting), number(row.voltage_V), model, row.status
        unit = "" if row.unit == "-" else f" {row.unit}"
        lines.setdefault(place, []).append(f"{row.parameter} = {number(row.value)}{unit}")
    return filled(head, [[*place[:3], ", ".join(values), place[3]] for place, values in lines.items()], 2)


COMMANDS = (peers,)
