"""Stages of a config that follow one another in memory: for many runs of which each differs a little."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pzd.artefacts import Artefact, Diagnosed, Identified, Rides, Rig
from pzd.config import RunConfig, setting_in_use
from pzd.pipeline.dependencies import block_of, is_artefact
from pzd.pipeline.execution import Pipeline
from pzd.pipeline.stages import Stage, stages

Made = TypeVar("Made", Rig, Identified, Diagnosed, Rides)


@dataclass
class InMemory(Pipeline):
    """A pipeline whose artefacts are handed on as they are, and written nowhere.

    No report is made of them, which alone tells what the preflight finds: the records are not examined.
    """

    artefacts: dict[str, Artefact] = field(default_factory=dict)
    """By folder."""

    def through(self, last: str) -> Mapping[str, Artefact]:
        """Every artefact up to a stage, by its folder; those that are known already are not made again."""
        for stage in self.stages[: [stage.name for stage in self.stages].index(last) + 1]:
            if stage.folder not in self.artefacts:
                self.artefacts[stage.folder] = self.made(stage)
        return self.artefacts

    def of(self, kind: type[Made]) -> Made:
        """An artefact that was made."""
        found = self.artefacts[kind.folder]
        if not isinstance(found, kind):
            raise TypeError(f"{kind.folder} holds {type(found).__name__}")
        return found

    def read_back(self, kind: type[Artefact]) -> Artefact:
        """An artefact that a stage asks for."""
        return self.artefacts[kind.folder]

    def _argument(self, name: str, annotation: Any) -> Any:
        """What a parameter of a stage is given."""
        return False if name == "preflight" else super()._argument(name, annotation)

    def setting(self) -> str | None:
        """The setting in use."""
        return setting_in_use(self.config.setting, [entry.setting for entry in self.of(Rig).entries])


def unaffected(before: RunConfig, now: RunConfig) -> tuple[Stage, ...]:
    """The stages that make the same of two configs, from the first one on.

    Parameters
    ----------
    before, now : of which the second differs in some values
    """
    kept: list[Stage] = []
    for stage, other in zip(stages(before), stages(now), strict=False):
        if stage.name != other.name or _taken(stage, before) != _taken(other, now):
            break
        kept.append(stage)
    return tuple(kept)


def _taken(stage: Stage, config: RunConfig) -> Sequence[Any]:
    """What a stage takes of a config."""
    found: list[Any] = [config.control]
    for name, annotation in stage.takes.items():
        if not is_artefact(annotation) and (block := block_of(config, annotation)):
            found.append(block[1])
        elif name in ("seed", "setting"):
            found.append(getattr(config, name))
    return found
