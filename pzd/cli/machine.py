"""What `--json` prints of a run: the numbers that people see, under the names that the files have."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pzd.damper.effect import Effect, Parameter
    from pzd.pipeline.run_summary import RunSummary


def run_as_data(run: RunSummary) -> dict[str, Any]:
    """The numbers of a run as plain data, the control under its own name."""
    from pzd.schema.jsonfile import plain_data

    numbers = {
        "run": run.folder.as_posix(),
        "stale": run.stale,
        "not_to_be_trusted": run.marks,
        "characteristics": vars(run.characteristics),
        "knee": vars(run.knees),
        "parameters": run.parameters,
        "diagnosis": run.diagnosis,
        "settings": run.settings,
        "settings_left_out": run.settings_left_out,
        "hypotheses": run.hypotheses.rows,
        "rides": run.summary,
        "assumed": run.assumed,
        "comfort": run.comfort,
        "report": run.page.as_posix() if run.page else None,
    }
    data: dict[str, Any] = plain_data(numbers, run.control)
    return data


def effects_as_data(effects: Iterable[Effect]) -> list[dict[str, Any]]:
    """The library as plain data; a limit that there is not is null."""
    return [
        {"name": e.name, "place": e.place, "law": e.law, "parameters": [_parameter(p) for p in e.parameters]}
        for e in effects
    ]


def _parameter(parameter: Parameter) -> dict[str, Any]:
    limits = {"low": parameter.low, "high": parameter.high, "neutral": parameter.neutral}
    finite = {name: value if math.isfinite(value) else None for name, value in limits.items()}
    return {"name": parameter.name, "unit": parameter.unit, "meaning": parameter.meaning} | finite
