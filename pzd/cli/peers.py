"""The command that compares the adopted damper with published models."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.cli.options import Call, on_config
from pzd.cli.output import exit_code

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pzd.artefacts.diagnosis import PeerComparison
    from pzd.quantities import Control


@on_config("jobs", "as_json")
def peers(call: Call) -> int:
    """Compare the adopted damper with published models, on tests and voltages that no fit has seen."""
    from pzd.artefacts import Diagnosed, Identified, Rig
    from pzd.artefacts.diagnosis import PeerComparison
    from pzd.diagnosis.peer_comparison import compare_with_peers
    from pzd.pipeline.dependencies import setting_of
    from pzd.schema.validate import plain_data

    given, run = call.opened, call.opened.run
    marks = call.execute("diagnose")
    with given.placed(), run.locked("pzd peers"):
        found = compare_with_peers(
            run.read(Rig, call.jobs), run.read(Identified), run.read(Diagnosed), setting_of(given.config, run)
        )
        run.write_extra(PeerComparison.folder, lambda folder: found.write(folder, run.control))
    if call.output.as_json:
        call.output.say_json(plain_data({**vars(found), "not_to_be_trusted": marks}, run.control))
    call.output.say(*comparison_lines(found, run.control), f"tables: {run.folder / PeerComparison.folder}")
    return exit_code(marks)


def comparison_lines(found: PeerComparison, control: Control) -> Iterator[str]:
    """Yield the tables: every held-out test, these by control signal and in all, held-out voltages, and parameters.

    Parameters
    ----------
    found : the comparison
    control : the control signal, for its name and unit
    """
    from pzd.report import tables

    *compared, parameters = tables.peers(found, control)
    for table in compared:
        yield from (f"{table.title}:", *table.lines("  "), "")
    yield from (f"{parameters.title}:", *parameters.lines("  "))
    if found.moving:
        yield f"not compared, for the control signal moves: {', '.join(found.moving)}"


COMMANDS = (peers,)
