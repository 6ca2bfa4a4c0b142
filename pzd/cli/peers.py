"""The command that compares the adopted damper with other models, of one damper or of several."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pzd.cli.options import Call, on_config
from pzd.cli.output import exit_code
from pzd.schema.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pzd.artefacts.diagnosis import PeerComparison
    from pzd.quantities import Control

More = Annotated[
    list[Path] | None,
    typer.Argument(metavar="[CONFIG]...", help="More configs: one table of all their dampers.", show_default=False),
]


@on_config("jobs", "as_json")
def peers(call: Call, more: More = None) -> int:
    """Compare the adopted damper with published models and a black box, on tests and voltages that no fit has seen."""
    from pzd.artefacts.diagnosis import PeerComparison
    from pzd.report import tables
    from pzd.schema.validate import plain_data

    calls = _of_each_config(call, more or [])
    compared = [_compared(each) for each in calls]
    marks = [
        f"{each.config}: {mark}" if more else mark
        for each, (_, own) in zip(calls, compared, strict=True)
        for mark in own
    ]
    each_found = [(each.opened.run, found) for each, (found, _) in zip(calls, compared, strict=True)]
    if not more:
        ((run, found),) = each_found
        if call.output.as_json:
            call.output.say_json(plain_data({**vars(found), "not_to_be_trusted": marks}, run.control))
        call.output.say(*comparison_lines(found, run.control), f"tables: {run.folder / PeerComparison.folder}")
        return exit_code(marks)
    if call.output.as_json:
        dampers = {run.folder.name: plain_data(vars(found), run.control) for run, found in each_found}
        call.output.say_json({"dampers": dampers, "not_to_be_trusted": marks})
    table = tables.peer_summary([(run.folder.name, row) for run, found in each_found for row in found.summary])
    call.output.say(f"{table.title}:", *table.lines("  "))
    for run, found in each_found:
        call.output.say(
            *(f"{run.folder.name}: {line}" for line in _notes(found)), f"tables: {run.folder / PeerComparison.folder}"
        )
    return exit_code(marks)


def _of_each_config(call: Call, more: Sequence[Path]) -> list[Call]:
    """Return a call for each config, all of them read before the first one runs.

    Raises
    ------
    ConfigError : when one is wrong, or two would write into one folder
    """
    calls = [call, *(replace(call, config=path) for path in more)]
    owners: dict[Path, Path] = {}
    for each in calls:
        folder = each.opened.run.folder
        if folder in owners:
            raise ConfigError(
                f"{each.config}: its results would lie in {folder}, as those of {owners[folder]} do; "
                "give each config once, or rename one of them"
            )
        owners[folder] = each.config
    return calls


def _compared(call: Call) -> tuple[PeerComparison, tuple[str, ...]]:
    """Bring a run up to date as far as diagnose, compare, write it, and return it with what is not to be trusted."""
    from pzd.artefacts import Diagnosed, Identified, Rig
    from pzd.artefacts.diagnosis import PeerComparison
    from pzd.diagnosis.peer_comparison import compare_with_peers
    from pzd.pipeline.dependencies import setting_of

    given, run = call.opened, call.opened.run
    marks = call.execute("diagnose")
    with given.placed(), run.locked("pzd peers"):
        found = compare_with_peers(
            run.read(Rig, call.jobs), run.read(Identified), run.read(Diagnosed), setting_of(given.config, run)
        )
        run.write_extra(PeerComparison.folder, lambda folder: found.write(folder, run.control))
    return found, marks


def comparison_lines(found: PeerComparison, control: Control) -> Iterator[str]:
    """Yield the tables: every held-out test, these by control signal, held-out voltages, parameters, and all together.

    Parameters
    ----------
    found : the comparison
    control : the control signal, for its name and unit
    """
    from pzd.report import tables

    first, *others = tables.peers(found, control)
    yield from (f"{first.title}:", *first.lines("  "))
    for table in others:
        yield from ("", f"{table.title}:", *table.lines("  "))
    yield from _notes(found)


def _notes(found: PeerComparison) -> Iterator[str]:
    """Yield what the tables do not say."""
    if found.moving:
        yield f"not compared, for the control signal moves: {', '.join(found.moving)}"
    if found.unstable:
        yield f"narx is unstable in free run, its force was held at a bound: {', '.join(found.unstable)}"


COMMANDS = (peers,)
