"""Runs of a config, as `pzd run` makes them, and what lies in their folders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from typing_extensions import override

from pzd.artefacts import Artefact, ComfortRow, Diagnosed, Diagnosis, Identified, ParameterRow, Rig, SummaryRow
from pzd.front.arguments import as_python_errors, in_python, jobs_of
from pzd.front.dampers import Damper
from pzd.front.results import Result, frame_of, new_axes
from pzd.schema.errors import ConfigError

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from pzd.pipeline.execution import InMemory
    from pzd.pipeline.run_summary import RunSummary
    from pzd.runs import Run


@dataclass(frozen=True, eq=False, repr=False)
class FinishedRun(Result):
    """The numbers of a run, read from its folder."""

    run: Run
    found: RunSummary

    @property
    def folder(self) -> Path:
        """Where the run lies."""
        return self.run.folder

    @property
    def page(self) -> Path | None:
        """The report's page."""
        return self.found.page

    @property
    def marks(self) -> tuple[str, ...]:
        """Why the results are not to be trusted; empty where they are."""
        return self.found.marks

    @property
    def stale(self) -> dict[str, str]:
        """Why results are not those of the config as it is today, by stage."""
        return dict(self.found.stale)

    @cached_property
    def parameters(self) -> pd.DataFrame:
        """The rows of parameters.csv."""
        return frame_of(self.found.parameters, ParameterRow, self.found.control)

    @property
    def diagnosis(self) -> Diagnosis | None:
        """The verdict, with `.verdict`, `.effects`, `.confidence` and so on; None where diagnose has not run."""
        return self.found.diagnosis

    @cached_property
    def damper(self) -> Damper:
        """The adopted damper; its `force` predicts that of any motion.

        Raises
        ------
        ValueError : when diagnose has not run
        """
        diagnosed, behind = self._diagnosed
        return Damper.of(diagnosed.damper, self.found.control, behind)

    @cached_property
    def baseline(self) -> Damper:
        """The damper before diagnose, as identified.

        Raises
        ------
        ValueError : when diagnose has not run
        """
        diagnosed, behind = self._diagnosed
        return Damper.of(diagnosed.baseline, self.found.control, behind)

    @cached_property
    def _diagnosed(self) -> tuple[Diagnosed, InMemory]:
        """Both dampers, and the pipeline that they were found in."""
        from pzd.config import load as load_config
        from pzd.front.pipelines import pipeline_of
        from pzd.runs import CONFIG

        if self.found.mounted is not None:
            raise ValueError(f"{self.folder}: no rig was measured; Damper.from_curve makes a damper of its curve")
        if self.found.diagnosis is None:
            raise ValueError(f"{self.folder}: diagnose has not run; pzd.run makes it")
        with as_python_errors():
            config = load_config(self.folder / CONFIG)
            rig, identified, diagnosed = self.run.read(Rig), self.run.read(Identified), self.run.read(Diagnosed)
        made: dict[str, Artefact] = {Rig.folder: rig, Identified.folder: identified, Diagnosed.folder: diagnosed}
        return diagnosed, pipeline_of(config, made)

    @cached_property
    def summary(self) -> pd.DataFrame:
        """The rows of summary.csv, a ride each."""
        return frame_of(self.found.summary, SummaryRow, self.found.control)

    @cached_property
    def comfort(self) -> pd.DataFrame:
        """The rows of comfort.csv, a measure of a ride each."""
        return frame_of(self.found.comfort, ComfortRow, self.found.control)

    @override
    def lines(self) -> list[str]:
        found = self.found.diagnosis
        verdict = [f"  {found.verdict}: {', '.join(found.effects) or 'no effect'}; {found.reason}"] if found else []
        return [
            f"Run {self.folder}: {len(self.found.parameters)} conditions, {len(self.found.summary)} rides",
            *verdict,
            *(f"  not to be trusted: {mark}" for mark in self.marks),
            *(f"  stale: {stage}: {reason}" for stage, reason in self.stale.items()),
            f"  report: {self.page or 'not written yet'}",
        ]

    @override
    def to_frame(self) -> pd.DataFrame:
        """Return `summary` where there are rides, else `parameters`."""
        return (self.summary if self.found.summary else self.parameters).copy()

    @override
    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw acceleration at K against wheel load of every ride; without rides T0 over the control signal."""
        ax = new_axes(ax)
        if self.found.summary:
            for policy, rows in self.summary.groupby("policy", sort=False):
                ax.plot(rows["rms_wheel_load_N"], rows["rms_aK_m_per_s2"], "o", label=policy)
            ax.set(xlabel="wheel load, r.m.s. [N]", ylabel="acceleration at K, r.m.s. [m/s2]")
            ax.legend()
        else:
            key = self.found.control.renamed("voltage_V")
            ax.plot(self.parameters[key], self.parameters["T0_N"], "o")
            ax.set(xlabel=self.found.control.quantity.label, ylabel="T0 [N]")
        return ax


@in_python
def run(
    config: str | PathLike[str],
    runs: str | PathLike[str] = "runs",
    overrides: Sequence[str] = (),
    *,
    until: str = "run",
    force: bool = False,
    jobs: int = 1,
) -> FinishedRun:
    """Bring the run of a config up to date, as `pzd run` does, and return its numbers.

    Parameters
    ----------
    config : the YAML file
    runs : folder of all results
    overrides : any number of ``a.b=VALUE``
    until : the last stage; every one by default
    force : whether every stage runs although it is fresh
    jobs : processes that a stage may use

    Raises
    ------
    ValueError : when config or records are wrong; with every place
    OSError : when files cannot be read or written
    """
    from pzd.pipeline.command import execute, opened
    from pzd.pipeline.run_summary import summary_with_stale
    from pzd.pipeline.stages import stages

    if isinstance(overrides, str) or not all(isinstance(one, str) for one in overrides):
        raise TypeError(f"overrides: must be a list such as ['seed=2'] (got {overrides!r})")
    given = opened(_path("config", config), _path("runs", runs), overrides)
    names = ["run", *(stage.name for stage in stages(given.config))]
    if until not in names:
        raise ValueError(f"until: must be one of {', '.join(names)} (got {until!r})")
    execute(given, until, force=force, jobs=jobs_of(jobs), say=lambda _: None)
    return FinishedRun(given.run, summary_with_stale(given))


@in_python
def load(folder: str | PathLike[str]) -> FinishedRun:
    """Return the numbers of a run from its folder, such as runs/quickstart.

    Parameters
    ----------
    folder : of the run

    Raises
    ------
    ValueError : when it holds no run, or a file of it is at fault
    """
    from pzd.config import control_of
    from pzd.pipeline.run_summary import summary_of
    from pzd.runs import CONFIG, Run
    from pzd.schema.yamlfile import read_yaml

    path = _path("folder", folder)
    found = summary_of(path)
    written = path / CONFIG
    if not written.is_file():
        raise ConfigError(f"{path}: this folder holds no run")
    return FinishedRun(Run(path, written, control_of(read_yaml(written).data)), found)


def _path(name: str, given: Any) -> Path:
    if not isinstance(given, str | PathLike):
        raise TypeError(f"{name}: must be a path (got {type(given).__name__})")
    return Path(given)
