"""Identification and diagnosis on tests in memory: the stages of the command line, with the same defaults."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from typing_extensions import override

from pzd.artefacts import Diagnosed, Diagnosis, Identified, ParameterRow, Rig, identified_damper
from pzd.front.arguments import as_python_errors, control_of, in_python, jobs_of
from pzd.front.dampers import Damper
from pzd.front.pipelines import pipeline_on
from pzd.front.results import Result, frame_of, new_axes
from pzd.quantities import FORCE, VELOCITY, Control

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from pzd.damper.model import Damper as Model
    from pzd.pipeline.execution import InMemory
    from pzd.record import Array, Record


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Result):
    """The Bingham parameters of every condition, and the damper that has them."""

    behind: InMemory
    """The pipeline, with its artefacts."""

    @property
    def identified(self) -> Identified:
        """The artefact of the stage."""
        return self.behind.of(Identified)

    @property
    def control(self) -> Control:
        """The control signal."""
        return self.behind.run.control

    @property
    def parameters(self) -> pd.DataFrame:
        """T0, C and k with 95 % intervals, a row a condition of every setting: the columns of parameters.csv."""
        return frame_of(self.identified.rows, ParameterRow, self.control)

    @cached_property
    def damper(self) -> Damper:
        """The damper of the setting in use.

        Raises
        ------
        ValueError : when there are several settings and none was chosen
        """
        with as_python_errors():
            setting = self.behind.setting()
        return Damper.of(identified_damper(self.identified, setting), self.control, self.behind)

    @override
    def lines(self) -> list[str]:
        from pzd.report import tables

        found = tables.parameters(self.identified.rows, self.control).without("rmse_N").lines("  ")
        laws = [line for knee in tables.knee(self.identified.knees, self.control) for line in knee.lines("  ")]
        return ["Identified parameters, with 95 % intervals", *found, *laws]

    @override
    def to_frame(self) -> pd.DataFrame:
        """Return `parameters`."""
        return self.parameters

    @override
    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the measured and the simulated force of every test of the setting in use over velocity."""
        ax, model, setting = new_axes(ax), self.damper.model, self.behind.setting()
        records = [record for record in self.behind.of(Rig).records if record.setting == setting]
        for number, record in enumerate(records):
            names = ("measured", "simulated") if number == 0 else (None, None)
            ax.plot(record.velocity, record.force, color="0.6", linewidth=0.8, label=names[0])
            ax.plot(record.velocity, simulated(model, record), color="C0", linewidth=0.8, label=names[1])
        ax.set(xlabel=VELOCITY.label, ylabel=FORCE.label)
        ax.legend()
        return ax


def simulated(model: Model, record: Record) -> Array:
    """Compute the (n,) force of a damper along a record, from the force recorded at its first sample [N]."""
    from pzd.damper.compose import respond
    from pzd.damper.motion import Motion

    return respond(model, Motion.of(record), float(record.force[0]))


@in_python
def identify(
    tests: Any,
    setting: str | None = None,
    control: Any = ("voltage", "V"),
    law: str = "bingham",
    *,
    seed: int = 1,
    jobs: int = 1,
    **keys_of_the_block: Any,
) -> Identification:
    """Identify the Bingham parameters T0, C and k of every condition of every setting, with intervals and status.

    Parameters
    ----------
    tests : one or several `Test`
    setting : the one whose damper is wanted, where there are several
    control : name and unit of the control signal
    law : bingham, knee or auto
    seed : of the evolutionary search
    jobs : processes; the numbers do not depend on it
    keys_of_the_block : further keys of `identify` in a config

    Raises
    ------
    TypeError : when an argument is of the wrong type
    ValueError : when a key is none that a config may have, or the tests do not go together
    """
    block = {"law": law, **keys_of_the_block}
    made = pipeline_on(tests, control_of(control), setting, seed=seed, identify=block)
    made.jobs = jobs_of(jobs)
    made.through("identify")
    if setting is not None:
        made.setting()  # refuses one that no test has
    return Identification(made)


@dataclass(frozen=True, eq=False, repr=False)
class Finding(Result):
    """What the identified damper lacks, how sure that is, and the damper with it added."""

    behind: InMemory
    """The pipeline, with its artefacts."""

    @property
    def diagnosed(self) -> Diagnosed:
        """The artefact of the stage."""
        return self.behind.of(Diagnosed)

    @property
    def diagnosis(self) -> Diagnosis:
        """The verdict as data."""
        return self.diagnosed.diagnosis

    @property
    def control(self) -> Control:
        """The control signal."""
        return self.behind.run.control

    @property
    def verdict(self) -> str:
        """`named`, `ambiguous`, `none` or `unexplained`."""
        return self.diagnosis.verdict

    @property
    def effects(self) -> list[str]:
        """The effects of the adopted damper, best first."""
        return list(self.diagnosis.effects)

    @property
    def confidence(self) -> float | None:
        """Probability that the verdict holds; None where it states none."""
        return self.diagnosis.confidence

    @property
    def rivals(self) -> list[str]:
        """What explains the tests as well."""
        return list(self.diagnosis.rivals)

    @property
    def reason(self) -> str:
        """Why, in a sentence."""
        return self.diagnosis.reason

    @property
    def parameters(self) -> pd.DataFrame:
        """Parameters of the adopted effects with 95 % intervals, a row a value."""
        import pandas as pd

        at = self.control.renamed("at_voltage_V")
        columns = ("effect", "parameter", "value", "low95", "high95", "unit", at)
        rows = [
            (effect, name, *estimate[:3], value.unit, voltage)
            for effect, values in self.diagnosis.parameters.items()
            for name, value in values.items()
            for estimate, voltage in zip(value.estimates, value.at_voltage_V or (None,), strict=True)
        ]
        found = pd.DataFrame(rows, columns=list(columns))
        return found.astype(dict.fromkeys(("value", "low95", "high95", at), float))

    @cached_property
    def damper(self) -> Damper:
        """The adopted damper, unchanged where nothing is missing."""
        return Damper.of(self.diagnosed.damper, self.control, self.behind)

    @cached_property
    def baseline(self) -> Damper:
        """The damper before, as identified."""
        return Damper.of(self.diagnosed.baseline, self.control, self.behind)

    def as_dict(self) -> dict[str, Any]:
        """Return the content of diagnosis.json."""
        from pzd.schema.validate import plain_data

        data: dict[str, Any] = plain_data(self.diagnosis, self.control)
        return data

    @override
    def lines(self) -> list[str]:
        from pzd.report.diagnosis_text import diagnosis_lines

        return diagnosis_lines(self.diagnosis, self.control, hypotheses=self.diagnosed.hypotheses)

    @override
    def to_frame(self) -> pd.DataFrame:
        """Return `parameters`."""
        return self.parameters

    @override
    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the loop that the baseline misses most: measured, baseline, and adopted damper where it is another."""
        ax, setting = new_axes(ax), self.behind.setting()
        records = [record for record in self.behind.of(Rig).records if record.setting == setting]
        before = [simulated(self.diagnosed.baseline, record) for record in records]
        missed = [float(np.mean((record.force - force) ** 2)) for record, force in zip(records, before, strict=True)]
        worst = int(np.argmax(missed))
        record = records[worst]
        ax.plot(record.velocity, record.force, color="0.6", label="measured")
        ax.plot(record.velocity, before[worst], color="C3", linewidth=0.9, label="baseline")
        if self.effects:
            after = simulated(self.diagnosed.damper, record)
            ax.plot(record.velocity, after, color="C0", linewidth=0.9, label=f"with {', '.join(self.effects)}")
        ax.set(xlabel=VELOCITY.label, ylabel=FORCE.label, title=f"{record.name}: {self.verdict}")
        ax.legend()
        return ax


@in_python
def diagnose(
    tests: Any,
    setting: str | None = None,
    control: Any = ("voltage", "V"),
    limits: Any = None,
    *,
    identify: Any = None,
    seed: int = 1,
    jobs: int = 1,
    **keys_of_the_block: Any,
) -> Finding:
    """Find what the identified damper lacks, name it where the tests allow, and return the damper with it added.

    Parameters
    ----------
    tests : one or several `Test`
    setting : the one to diagnose, where there are several
    control : name and unit of the control signal
    limits : what the stand can do, for the next test: keys of `rig.limits`
    identify : keys of `identify` in a config, for the parameters behind
    seed : of the evolutionary search of identify
    jobs : processes; the numbers do not depend on it
    keys_of_the_block : keys of `diagnose` in a config

    Raises
    ------
    TypeError : when an argument is of the wrong type
    ValueError : when a key is none that a config may have, or the tests do not go together
    """
    blocks: dict[str, Any] = {"identify": identify or {}, "diagnose": keys_of_the_block}
    made = pipeline_on(tests, control_of(control), setting, limits, seed=seed, **blocks)
    made.jobs = jobs_of(jobs)
    made.setting()
    made.through("diagnose")
    return Finding(made)
