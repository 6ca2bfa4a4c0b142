"""A ride of the half-car on a damper in memory, as the stage simulate computes it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from typing_extensions import override

from pzd.artefacts import Diagnosed, Rides, SummaryRow, WeightedRow
from pzd.front.arguments import in_python, jobs_of
from pzd.front.dampers import CurveDamper, Damper, table_stage
from pzd.front.pipelines import config_of
from pzd.front.results import Result, new_axes
from pzd.quantities import Control

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

SINE = {"kind": "sine", "frequency_Hz": 2.25, "amplitude_m": 0.02}
"""The road that is called sine: the first of Makowski and Knap 2021, section 5."""


@dataclass(frozen=True, eq=False, repr=False)
class CarRide(Result):
    """One ride: its comfort, its history, and its numbers in a line."""

    rides: Rides
    """The artefact, of one case."""
    control: Control

    @property
    def row(self) -> SummaryRow:
        """The line of summary.csv."""
        return self.rides.summary[0]

    @property
    def weighted(self) -> WeightedRow:
        """The line of weighted.csv: the measures of ISO 2631-1:1997 by Wk at K."""
        return self.rides.weighted[0]

    @property
    def a_w(self) -> float:
        """Weighted r.m.s. acceleration at K by ISO 2631-1:1997, Wk [m/s2]."""
        return self.weighted.a_w_m_per_s2

    @cached_property
    def history(self) -> pd.DataFrame:
        """The history of the ride, under the columns of its file; a column without values is left out."""
        import pandas as pd

        columns = self.rides.rides[0].columns
        return pd.DataFrame({self.control.renamed(name): values for name, values in columns.items()})

    @cached_property
    def summary(self) -> pd.Series[Any]:
        """The line of summary.csv."""
        import pandas as pd

        return pd.Series(self.row.model_dump(), name=self.row.case)

    @override
    def lines(self) -> list[str]:
        row, ridden = self.row, self.rides.ridden[0]
        return [
            f"Ride {row.case}: a_w {self.a_w:.4g} m/s2 at {row.point} (ISO 2631-1:1997, Wk)",
            (
                f"  peak |a_K| {row.peak_abs_aK_m_per_s2:.4g} m/s2, wheel load {row.rms_wheel_load_N:.4g} N r.m.s., "
                f"deflection up to {1e3 * row.peak_deflection_m:.4g} mm"
            ),
            f"  from {ridden.from_s:g} to {ridden.to_s:g} s, {row.outside_table:.0%} of it faster than was tested",
        ]

    @override
    def to_frame(self) -> pd.DataFrame:
        """Return the line of summary.csv with that of weighted.csv behind it."""
        import pandas as pd

        return pd.DataFrame([{**self.row.model_dump(), **self.weighted.model_dump()}])

    @override
    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the acceleration at K over time."""
        ax = new_axes(ax)
        ax.plot(self.history["time_s"], self.history["a_K_m_per_s2"], linewidth=0.8)
        ax.set(xlabel="time t [s]", ylabel="acceleration at K [m/s2]", title=self.row.case)
        return ax


@in_python
def ride(
    damper: Any,
    road: Any = "sine",
    policy: Any = "passive",
    car: Any = "makowski2021",
    fidelity: Any = "dynamic",
    voltage: float | None = None,
    duration: Any = 16.0,
    *,
    seed: int = 1,
    jobs: int = 1,
    **keys_of_the_block: Any,
) -> CarRide:
    """Ride the half-car over a road on a damper.

    Parameters
    ----------
    damper : the damper at both axles, or a pair, front (axle 1) and rear; where one is known by its measured curve the
        ride goes by the tables of both, whatever the fidelity says
    road : "sine" (2.25 Hz, 0.02 m), the kind of another one whose keys all have defaults, or its block in a config,
        such as {"kind": "sine", "frequency_Hz": 4.5}
    policy : how the dampers are controlled, as in `simulate.policies`
    car : name of a car, or its block in a config
    fidelity : ideal, table or dynamic
    voltage : of the policy passive, and of the valves before the ride; by default the known one nearest to 0
    duration : length of the ride [s]; on a road that goes on and on it is judged after the first 8 s, or its first half
    seed : of roads that are drawn
    jobs : rides at the same time, where a policy tries several
    keys_of_the_block : further keys of `simulate` in a config

    Raises
    ------
    TypeError : when an argument is of the wrong type
    ValueError : when a value is none that a config may have, or the damper cannot be ridden so
    """
    from pzd.simulate.config import SimulateConfig
    from pzd.simulate.stage import simulate, simulate_on_axles

    axles = tuple(damper) if isinstance(damper, tuple | list) else (damper,)
    wrong = next((type(one).__name__ for one in axles if not isinstance(one, Damper)), None)
    if wrong is not None or len(axles) not in (1, 2):
        raise TypeError(f"damper: must be a pzd.Damper, or a pair of them, front and rear (got {wrong or len(axles)})")
    front = axles[0]
    if any(one.control != front.control for one in axles):
        raise ValueError("damper: front and rear have control signals of other names or units; give both the same")
    for name, value in (("policy", policy), ("fidelity", fidelity)):
        if not isinstance(value, str):
            raise TypeError(f"{name}: must be text (got {type(value).__name__})")
    settle = SimulateConfig.model_fields["settle_s"].default
    block: dict[str, Any] = {
        "roads": [SINE if road == "sine" else {"kind": road} if isinstance(road, str) else road],
        "policies": [policy],
        "car": {"model": car} if isinstance(car, str) else car,
        "fidelities": [fidelity],
        "passive_voltage_V": voltage,
        "duration_s": duration,
    }
    if not isinstance(duration, int | float):
        raise TypeError(f"duration: must be a number (got {type(duration).__name__})")
    if duration <= settle:
        block["settle_s"] = round(0.5 * duration, 3)
    config = config_of(front.control, simulate={**block, **keys_of_the_block}, seed=seed).simulate
    if len(axles) == 1 and not isinstance(front, CurveDamper):
        alone = Diagnosed.undiagnosed(front.model)
        return CarRide(simulate(config, alone, table_stage(front, {}), seed, Path(), jobs_of(jobs)), front.control)
    mounted = [(None if isinstance(one, CurveDamper) else one.model, table_stage(one, {})) for one in axles]
    return CarRide(simulate_on_axles(config, mounted, seed, Path(), jobs_of(jobs)), front.control)
