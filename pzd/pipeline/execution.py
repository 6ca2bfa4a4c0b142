"""Runs the stages that are out of date, as make would, and says of each why it runs or does not."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pzd.artefacts import Artefact, Diagnosed, Identified, MountedDampers, Rides, Rig, Table, worst
from pzd.config import RunConfig, setting_in_use
from pzd.parallel.processes import Listener, no_listener
from pzd.pipeline.dependencies import block_of, changes, dependencies, is_artefact, key_of, setting_of
from pzd.pipeline.stages import Stage, stages
from pzd.quantities import Control
from pzd.runs import Run, StageFolder
from pzd.schema.errors import UserError, counted
from pzd.schema.yamlfile import yaml_text

Say = Callable[[str], None]


@dataclass
class Pipeline:
    """One config, its run, and how the command wants it done."""

    config: RunConfig
    run: Run
    stages: Sequence[Stage]
    say: Say
    """Takes a line about each stage."""
    progress: Listener = no_listener
    """Hears how far a stage has come."""
    jobs: int = 1
    """Processes that a stage may use, where it can use several."""
    marks: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Why the results so far are not to be trusted, by folder."""
    _in_hand: dict[str, tuple[dict[str, str], Artefact]] = field(default_factory=dict)
    """Artefacts that were read back, or that read back as they are, by folder, with the hashes of their files."""
    _compiles: bool = False
    """Whether the ride's kernels may still have to be compiled, which a second core can do meanwhile."""

    def execute(self, target: str, forced: Sequence[str] = ()) -> tuple[str, ...]:
        """Run every stage up to the target that is stale.

        Parameters
        ----------
        target : name of the last stage
        forced : stages that run even when they are fresh

        Returns
        -------
        the marks of all these stages: why their results are not to be trusted

        Raises
        ------
        UserError : what the user can mend; the stage at fault leaves what was there before
        """
        wanted = self.stages[: [stage.name for stage in self.stages].index(target) + 1]
        self._compiles = any(stage.function.__module__ == "pzd.simulate.stage" for stage in wanted)
        for number, stage in enumerate(wanted):
            self._execute_stage(stage, force=stage.name in forced)
            if number == 0:  # the records are sound: see that it is clear which setting is meant
                self.run.write_config(yaml_text(self.config, self.run.control))
                if any("setting" in later.takes for later in wanted):
                    self.setting()
        return tuple(dict.fromkeys(mark for marks in self.marks.values() for mark in marks))

    def _execute_stage(self, stage: Stage, *, force: bool) -> None:
        inputs = dependencies(stage, self.config, self.run, self._carried(stage, ()))
        state = self.run.stage_folder(stage.folder)
        reason = "forced" if force else stale(state, inputs)
        if reason is None:
            self.marks[stage.folder] = self._marks_as_it_stands(stage, state)
            self._say(stage, f"fresh: nothing it depends on has changed{_edited(' and kept', state)}")
            return
        self._say(stage, f"runs: {reason}{_edited(', kept beside the new as .edited-HASH', state)}")
        self._run(stage, inputs)

    def stale_stages(self) -> dict[str, str]:
        """Why the results of each stage are not what it would make today, by its name; nothing is run or written."""
        reasons: dict[str, str] = {}
        results: set[str] = set()
        for stage in self.stages:
            state = self.run.stage_folder(stage.folder)
            if state.manifest:
                results.add(stage.name)
            reason = self._why_stale(stage, state) or self._made_from_stale(stage, reasons)
            if reason is not None:
                reasons[stage.name] = reason
        return {name: reason for name, reason in reasons.items() if name in results}

    def _why_stale(self, stage: Stage, state: StageFolder) -> str | None:
        try:
            self.marks[stage.folder] = self._marks_as_it_stands(stage, state)
            return stale(state, dependencies(stage, self.config, self.run, self._carried(stage, ())))
        except UserError as error:
            return f"it would be refused: {'; '.join(error.messages)}"

    def _made_from_stale(self, stage: Stage, reasons: Mapping[str, str]) -> str | None:
        needed = {kind.folder for kind in stage.takes.values() if is_artefact(kind)}
        makers = [maker.name for maker in self.stages if maker.folder in needed and maker.name in reasons]
        return f"it is made from {' and '.join(makers)}" if makers else None

    def _run(self, stage: Stage, inputs: dict[str, str]) -> None:
        if self._compiles:
            from pzd.simulate.compiled_ahead import in_background
            from pzd.simulate.policies import policies

            ridden = (policies()[name] for name in self.config.simulate.policies or ())
            in_background(("ride", "prediction") if any(policy.aim == "predict" for policy in ridden) else ("ride",))
            self._compiles = False
        begun = time.monotonic()
        artefact = self.made(stage)
        marks = self._carried(stage, self._untrusted(artefact))
        seconds = time.monotonic() - begun
        self.run.write(stage.name, artefact, inputs, key_of(inputs), marks, seconds, self.jobs)
        self.marks[stage.folder] = marks
        self._say(stage, f"done in {seconds:.1f} s: {self.run.folder / stage.folder}")
        if isinstance(artefact, Rig):
            self._in_hand[stage.folder] = self.run.outputs(stage.folder), artefact.as_read()
            self._say_findings(stage, artefact)

    def made(self, stage: Stage) -> Artefact:
        """Return what a stage makes of its inputs, written nowhere."""
        return stage.function(**stage.fixed, **{name: self._argument(name, kind) for name, kind in stage.takes.items()})

    def _argument(self, name: str, annotation: Any) -> Any:
        """Return what a parameter of a stage is given; artefacts are what their files hold, however they were made."""
        if is_artefact(annotation):
            return self.read_back(annotation)
        if block := block_of(self.config, annotation):
            return block[1]
        if annotation is Control:
            return self.run.control
        if name == "setting":
            return self.setting()
        given = {"seed": self.config.seed, "folder": self.run.config.parent}
        return (given | {"jobs": self.jobs, "progress": self.progress, "preflight": True, "described": True})[name]

    def setting(self) -> str | None:
        """Return the setting in use, by the config and the records of the run."""
        return setting_of(self.config, self.run)

    def read_back(self, kind: type[Artefact]) -> Artefact:
        """Return an artefact as its files have it: read and checked once, and again where they have changed since.

        The records are as they were written, to the last bit, and by far the most there is to read.
        """
        now = self.run.outputs(kind.folder)
        files, artefact = self._in_hand.get(kind.folder, ({}, None))
        if artefact is None or files != now:
            artefact = self.run.read(kind, self.jobs)
            self._in_hand[kind.folder] = (now, artefact)
        return artefact

    def _marks_as_it_stands(self, stage: Stage, state: StageFolder) -> tuple[str, ...]:
        """Return the marks of the manifest, or of the artefact itself where it was edited, which checks it too."""
        if state.edited:
            artefact = self.read_back(stage.makes)
            return self._carried(stage, (*self._untrusted(artefact), *self._not_followed(artefact, state)))
        return state.manifest.marks if state.manifest else ()

    def _not_followed(self, artefact: Artefact, state: StageFolder) -> tuple[str, ...]:
        """Return which rides do not follow a table that was edited by hand: those on the law of the damper itself."""
        with_law = isinstance(artefact, MountedDampers) and not artefact.by_curve
        if not (self.config.car and "dynamic" in self.config.simulate.fidelities):
            return ()
        if not (isinstance(artefact, Table) or with_law):
            return ()
        files = ", ".join(f"{artefact.folder}/{name}" for name in state.edited)
        follow = "rides at the fidelity table follow it, and those at dynamic have the damper's own law"
        return (f"{files} edited by hand: {follow}",)

    def _untrusted(self, artefact: Artefact) -> tuple[str, ...]:
        """Why an artefact is not to be trusted as it stands, in the units of the config."""
        reasons = getattr(artefact, "untrusted", None)
        return reasons(self.run.control) if reasons else ()

    def _carried(self, stage: Stage, own: Sequence[str]) -> tuple[str, ...]:
        """Return a stage's own marks behind those of what it was made from."""
        before = [self.marks.get(kind.folder, ()) for kind in stage.takes.values() if is_artefact(kind)]
        return tuple(dict.fromkeys([mark for marks in before for mark in marks] + list(own)))

    def _say_findings(self, stage: Stage, rig: Rig) -> None:
        """Say how much the preflight finds, and the gravest: all later numbers are of these records."""
        found = [(entry.name, finding) for entry in rig.entries for finding in entry.findings]
        if found:
            name, gravest = worst(found)
            such = f"{name}: {gravest.check}: {gravest.where}"
            self._say(
                stage, f"{counted(len(found), 'finding')}, {such}; pzd check {self.run.config} prints what follows"
            )

    def _say(self, stage: Stage, line: str) -> None:
        self.say(f"{stage.name:<10} {line}")


def _edited(what_becomes: str, state: StageFolder) -> str:
    return f"; edited by hand{what_becomes}: {', '.join(state.edited)}" if state.edited else ""


def stale(state: StageFolder, inputs: dict[str, str]) -> str | None:
    """Why a stage must run, in words; None where it need not."""
    if state.manifest is None:
        return "it has no result yet"
    if state.missing:
        return f"{', '.join(state.missing)} missing"
    if state.manifest.key != key_of(inputs):
        return changes(state.manifest.inputs, inputs) or "its manifest was edited"
    return None


# --- In memory, without files: for many runs of which each differs a little

Made = TypeVar("Made", Rig, Identified, Diagnosed, Rides)


@dataclass
class InMemory(Pipeline):
    """A pipeline whose artefacts are handed on as they are, and written nowhere.

    No report is made of them, which alone tells what the preflight finds: the records are not examined.
    """

    artefacts: dict[str, Artefact] = field(default_factory=dict)
    """By folder."""
    described: bool = True
    """Whether the tests are described without a model too, for who looks at more than the parameters."""

    def through(self, last: str) -> Mapping[str, Artefact]:
        """Every artefact up to a stage, by its folder; those that are known already are not made again."""
        for stage in self.stages[: [stage.name for stage in self.stages].index(last) + 1]:
            if stage.folder not in self.artefacts:
                self.artefacts[stage.folder] = self.made(stage)
        return self.artefacts

    def of(self, kind: type[Made]) -> Made:
        """Return an artefact that was made."""
        found = self.artefacts[kind.folder]
        if not isinstance(found, kind):
            raise TypeError(f"{kind.folder} holds {type(found).__name__}")
        return found

    def read_back(self, kind: type[Artefact]) -> Artefact:
        """Return an artefact that a stage asks for."""
        return self.artefacts[kind.folder]

    def _argument(self, name: str, annotation: Any) -> Any:
        """Return what a parameter of a stage is given."""
        own = {"preflight": False, "described": self.described}
        return own[name] if name in own else super()._argument(name, annotation)

    def setting(self) -> str | None:
        """Return the setting in use."""
        return setting_in_use(self.config.setting, [entry.setting for entry in self.of(Rig).entries])


def unaffected(before: RunConfig, now: RunConfig) -> tuple[Stage, ...]:
    """Return the stages that make the same of two configs, from the first one on.

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
    """Return what a stage takes of a config."""
    found: list[Any] = [config.control]
    for name, annotation in stage.takes.items():
        if not is_artefact(annotation) and (block := block_of(config, annotation)):
            found.append(block[1])
        elif name in ("seed", "setting"):
            found.append(getattr(config, name))
    return found
