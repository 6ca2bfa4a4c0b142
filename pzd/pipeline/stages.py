"""The stages in order; the signature of a stage's function is its declaration."""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from pzd.artefacts import Artefact, Rides
from pzd.config import RunConfig

LAST = "report"
"""The stage that `pzd run` brings up to date."""


@dataclass(frozen=True)
class Stage:
    """One stage: its name as a command, and its function."""

    name: str
    function: Callable[..., Artefact]
    fixed: Mapping[str, Any] = field(default_factory=dict)
    """Arguments that depend neither on the config nor on another stage."""

    @cached_property
    def takes(self) -> Mapping[str, Any]:
        """What the function asks for: the annotation of every parameter that is not fixed."""
        hints = typing.get_type_hints(self.function)
        return {name: hints[name] for name in inspect.signature(self.function).parameters if name not in self.fixed}

    @cached_property
    def makes(self) -> type[Artefact]:
        """The artefact that the function returns."""
        made: type[Artefact] = typing.get_type_hints(self.function)["return"]
        return made

    @property
    def folder(self) -> str:
        """Where in the run its artefact stands."""
        return self.makes.folder


def stages(config: RunConfig) -> tuple[Stage, ...]:
    """Return the stages of a config, first to last."""
    from pzd.diagnosis.stage import diagnose
    from pzd.force_table.mounted import tabulate_mounted
    from pzd.force_table.stage import tabulate
    from pzd.identification.stage import identify
    from pzd.report.stage import report
    from pzd.rig.stage import ingest, synthesise
    from pzd.simulate.config import SimulateConfig
    from pzd.simulate.stage import simulate, simulate_mounted

    not_simulated = {"simulate": SimulateConfig(), "rides": Rides()}
    if config.rig is None:
        from pzd.report.mounted import report_mounted  # heavy: not for runs of a rig that are fresh

        mounted = (Stage("simulate", simulate_mounted), Stage(LAST, report_mounted))
        on_curve = (Stage(LAST, report_mounted, not_simulated),)
        return (Stage("table", tabulate_mounted), *(mounted if config.car else on_curve))
    ridden = (Stage("simulate", simulate), Stage(LAST, report))
    not_ridden = (Stage(LAST, report, not_simulated),)
    return (
        Stage("synthesise", synthesise) if config.rig.virtual else Stage("ingest", ingest),
        Stage("identify", identify),
        Stage("diagnose", diagnose),
        Stage("table", tabulate),
        *(ridden if config.car else not_ridden),
    )
