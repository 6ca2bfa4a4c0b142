"""The commands for beginners: a config from rig files, what a config may hold, which effects there are."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pzd.cli.options import Json, Verbose
from pzd.cli.output import DONE, Output

if TYPE_CHECKING:
    from pzd.damper.effect import Effect

RigFiles = Annotated[list[Path], typer.Argument(metavar="FILE...", help="Rig files to make a config for.")]

LayoutName = Annotated[
    str | None, typer.Option("--layout", metavar="NAME", help="Read the files by this layout, or refuse.")
]


def init(files: RigFiles, layout: LayoutName = None, verbose: Verbose = False) -> int:
    """Print a config for rig files: by the layout that fits, else guessed from the headers."""
    from pzd.config import EDITORS, SCHEMA
    from pzd.rig.files.guess import guessed
    from pzd.schema.errors import ConfigError, no_file

    output = Output(verbose=verbose)
    absent = [path for path in files if not path.is_file()]
    if absent:
        raise ConfigError(f"{path}: {no_file(path)}" for path in absent)
    output.say(f"{EDITORS}{SCHEMA.as_uri()}", *guessed(files, layout))
    return DONE


def schema(verbose: Verbose = False) -> int:
    """Print the JSON schema of a config."""
    from pzd.config import RunConfig

    Output(verbose=verbose).say_json(RunConfig.model_json_schema())
    return DONE


Propose = Annotated[
    Path | None,
    typer.Option(
        "--propose",
        metavar="RUN",
        help="Write the best hypothesis of a run, such as runs/quickstart, as an effect file instead.",
    ),
]
Out = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Folder of that file; by default that of PZD_EFFECTS, else `effects`."),
]


def effects(propose: Propose = None, out: Out = None, as_json: Json = False, verbose: Verbose = False) -> int:
    """Print the library of effects."""
    from pzd.damper.effects import library
    from pzd.report import tables

    output = Output(verbose=verbose, as_json=as_json and propose is None)
    if propose is not None:
        return _propose(propose, out, output)
    if as_json:
        output.say_json([_effect_as_data(effect) for effect in library().values()])
    output.say(*tables.effects(library().values()).lines())
    return DONE


def _effect_as_data(effect: Effect) -> dict[str, Any]:
    """Return an effect as plain data; a limit that there is not is null."""
    parameters = [
        {"name": p.name, "unit": p.unit, "meaning": p.meaning}
        | {end: value if math.isfinite(value := getattr(p, end)) else None for end in ("low", "high", "neutral")}
        for p in effect.parameters
    ]
    return {"name": effect.name, "place": effect.place, "law": effect.law, "parameters": parameters}


def _propose(run: Path, out: Path | None, output: Output) -> int:
    """Write the best hypothesis of a run as an effect file, over none that is there."""
    from pzd.diagnosis.hypotheses import proposal_of
    from pzd.own_effects import VARIABLE, own_folder
    from pzd.pipeline.run_summary import summary_of
    from pzd.schema.errors import ConfigError

    found = summary_of(run)
    largest = max((abs(row.voltage_V) for row in found.parameters if row.voltage_V is not None), default=1.0)
    proposal = proposal_of(found.hypotheses.alone, run.as_posix(), largest)
    folder = out or own_folder() or Path("effects")
    file = folder / f"{proposal.name}.py"
    if os.path.lexists(file):  # a link to nowhere would be written through
        raise ConfigError(f"{file}: there is a file of that name, which is not written over; move it, or give --out")
    folder.mkdir(parents=True, exist_ok=True)
    file.write_text(proposal.text, encoding="utf-8", newline="\n")
    output.say(*(f"passed over: {why}" for why in proposal.passed_over))
    output.say(f"effect: {file}, {proposal.row.physics}")
    output.say(f"to force it: say `diagnose: {{force: [{proposal.name}]}}` in the config, and set {VARIABLE}={folder}")
    return DONE


COMMANDS = (init, schema, effects)
