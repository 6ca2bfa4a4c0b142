"""The commands for beginners: a config from rig files, what a config may hold, which effects there are."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from pzd.cli.exits import DONE
from pzd.cli.layout import aligned
from pzd.cli.machine import effects_as_data
from pzd.cli.options import Json, Verbose
from pzd.cli.output import Output

RigFiles = Annotated[list[Path], typer.Argument(metavar="FILE...", help="Rig files to make a config for.")]

LayoutName = Annotated[
    str | None, typer.Option("--layout", metavar="NAME", help="Read the files by this layout, or refuse.")
]


def init(files: RigFiles, layout: LayoutName = None, verbose: Verbose = False) -> int:
    """Print a config for rig files: by the layout that fits, else guessed from the headers."""
    from pzd.config import EDITORS, SCHEMA
    from pzd.rig.files.guess import guessed
    from pzd.schema.errors import ConfigError

    output = Output(quiet=False, verbose=verbose)
    absent = [path for path in files if not path.is_file()]
    if absent:
        raise ConfigError(map(_absent, absent))
    output.say(f"{EDITORS}{SCHEMA.as_uri()}", *guessed(files, layout))
    return DONE


def _absent(path: Path) -> str:
    if path.is_dir():
        endings = Counter(file.suffix for file in path.iterdir() if file.is_file() and file.suffix)
        ending = max(endings, key=lambda one: endings[one], default=".csv")
        return f"{path}: this is a folder; name the files in it, e.g. {path}/*{ending}"
    return f"{path}: no such file; check the path"


def schema(verbose: Verbose = False) -> int:
    """Print the JSON schema of a config."""
    from pzd.config import RunConfig

    Output(quiet=False, verbose=verbose).say_json(RunConfig.model_json_schema())
    return DONE


def effects(as_json: Json = False, verbose: Verbose = False) -> int:
    """Print the library of effects."""
    from pzd.damper.effects import library

    output = Output(quiet=False, verbose=verbose)
    if as_json:
        output.say_json(effects_as_data(library().values()))
        return DONE
    head = ["effect", "place", "parameter", "unit", "from", "to", "off at", "law"]
    rows = [
        [effect.name, effect.place, p.name, p.unit, f"{p.low:g}", f"{p.high:g}", f"{p.neutral:g}", effect.law]
        for effect in library().values()
        for p in effect.parameters
    ]
    output.say(*aligned([head, *rows]))
    return DONE


COMMANDS = (init, schema, effects)
