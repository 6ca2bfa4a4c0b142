"""What changed between two states of a damper, from tests in memory, as `pzd changes` finds it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from typing_extensions import override

from pzd.artefacts import Identified, Rig
from pzd.artefacts.changes import Changes
from pzd.front.arguments import control_of, in_python, jobs_of
from pzd.front.pipelines import pipeline_on
from pzd.front.results import Result, new_axes
from pzd.quantities import FORCE, VELOCITY, Control

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from pzd.diagnosis.changes.comparison import Compared

BEFORE, AFTER = "before", "after"
"""Names of the states, where their settings have no names that differ."""


@dataclass(frozen=True, eq=False, repr=False)
class ComparedStates(Result):
    """What changed between two states, what did not, and what cannot be told apart."""

    compared: Compared
    """All that was found, with the curves behind it."""
    control: Control

    @property
    def found(self) -> Changes:
        """The content of the JSON that `pzd changes` writes."""
        return self.compared.changes

    @property
    def verdict(self) -> str:
        """`changed`, `unchanged`, `ambiguous` or `unexplained`."""
        return self.found.verdict

    @property
    def reason(self) -> str:
        """Why, in a sentence."""
        return self.found.reason

    @property
    def rivals(self) -> list[str]:
        """What explains the difference as well."""
        return list(self.found.rivals)

    @cached_property
    def changes(self) -> pd.DataFrame:
        """What changed, a row a quantity, the largest share first; of several control values each has a row."""
        import pandas as pd

        at = self.control.renamed("at_voltage_V")
        columns = ("name", "parameter", "of", "unit", "from", "to", "low95", "high95", at, "share", "reason")
        rows = []
        for change in self.found.changes:
            nodes = change.at_voltage_V or (None,)
            lists = [
                values if isinstance(values, tuple) else (values,) * len(nodes)
                for values in (change.from_, change.to, change.low95, change.high95)
            ]
            for values in zip(*lists, nodes, strict=True):
                head = (change.name, change.parameter, change.of, change.unit)
                rows.append((*head, *values, change.share, change.reason))
        found = pd.DataFrame(rows, columns=list(columns))
        return found.astype(dict.fromkeys(("from", "to", "low95", "high95", at, "share"), float))

    def as_dict(self) -> dict[str, Any]:
        """Return the content of the JSON that `pzd changes` writes."""
        from pzd.schema.validate import plain_data

        data: dict[str, Any] = plain_data(self.found, self.control)
        return data

    @override
    def lines(self) -> list[str]:
        from pzd.report.changes_text import changes_lines

        return list(changes_lines(self.found, self.control))

    @override
    def to_frame(self) -> pd.DataFrame:
        """Return `changes`."""
        return self.changes.copy()

    @override
    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the loops of the motion whose force changed most: before, after, and with what explains it."""
        ax = new_axes(ax)
        cycles = self.compared.cycles
        if cycles:
            worst = max(cycles, key=lambda cycle: float(abs(cycle.force_after - cycle.force_before).max()))
            ax.plot(worst.velocity, worst.force_before, color="0.6", label=self.found.from_)
            ax.plot(worst.velocity, worst.force_after, color="C3", label=self.found.to)
            explained = worst.force_before + worst.explained
            ax.plot(worst.velocity, explained, color="C0", linestyle="--", label="explained")
            ax.legend()
        ax.set(xlabel=VELOCITY.label, ylabel=FORCE.label, title=self.verdict)
        return ax


@in_python
def changes(
    tests_before: Any,
    tests_after: Any,
    control: Any = ("voltage", "V"),
    *,
    limits: Any = None,
    identify: Any = None,
    diagnose: Any = None,
    seed: int = 1,
    jobs: int = 1,
) -> ComparedStates:
    """Say what changed between two states of a damper, by name, with size and interval.

    Parameters
    ----------
    tests_before, tests_after : one or several `Test` each, of one setting each
    control : name and unit of the control signal
    limits : what the stand can do: keys of `rig.limits`
    identify, diagnose : keys of these blocks in a config
    seed : of the evolutionary search of identify
    jobs : processes; the numbers do not depend on it

    Raises
    ------
    TypeError : when an argument is of the wrong type
    ValueError : when a key is none that a config may have, or the tests cannot be compared
    """
    from pzd.diagnosis.changes.comparison import changes_between
    from pzd.diagnosis.changes.state import State, diagnosed_state

    signal = control_of(control)
    blocks: dict[str, Any] = {"identify": identify or {}, "diagnose": diagnose or {}}
    states, made = [], []
    for called, tests in (("tests_before", tests_before), ("tests_after", tests_after)):
        one = pipeline_on(tests, signal, None, limits, called, seed=seed, **blocks)
        one.jobs = jobs_of(jobs)
        one.setting()  # refuses several
        one.through("identify")
        made.append(one)
    settings = [one.setting() for one in made]
    named = None not in settings and settings[0] != settings[1]
    for one, setting, name in zip(made, settings, settings if named else (BEFORE, AFTER), strict=True):
        states.append(State.of(str(name), one.of(Rig), one.of(Identified), setting, signal))
    first, config = made[0], made[1].config
    diagnosed = diagnosed_state(
        states[0],
        first.of(Rig),
        first.of(Identified),
        settings[0],
        config.diagnose,
        config.identify,
        config.measured_rig,
        signal,
        jobs_of(jobs),
    )
    return ComparedStates(changes_between(diagnosed, states[1], config.diagnose, config.identify, signal), signal)
