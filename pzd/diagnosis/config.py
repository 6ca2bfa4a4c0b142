"""The blocks `diagnose` and `changes` of the config."""

from __future__ import annotations

from pydantic import Field, field_validator, model_validator

from pzd.damper.effect import ELEMENT
from pzd.damper.effects import library
from pzd.damper.fitted_laws import knee
from pzd.schema.model import Frozen, nearest
from pzd.signals.measures import SIGNIFICANCE, VISIBLE
from pzd.signals.nuisance import NuisanceConfig


class PeakForceBand(Frozen):
    """A point of a master curve: force at a peak velocity, with its limits."""

    velocity_m_per_s: float = Field(gt=0.0)
    """Peak velocity of a test; the force is linear between those of the tests."""
    rebound_N: tuple[float, float]
    """Smallest and largest force in rebound."""
    compression_N: tuple[float, float]
    """Smallest and largest force in compression, which is negative."""
    voltage_V: float | None = None
    """Control signal of the tests; empty for all."""

    @field_validator("rebound_N", "compression_N")
    @classmethod
    def _rising(cls, limits: tuple[float, float]) -> tuple[float, float]:
        return _rising_limits(limits)

    def limits(self, direction: str) -> tuple[float, float]:
        """Return the limits of `rebound` or `compression` [N]."""
        return self.rebound_N if direction == "rebound" else self.compression_N


class ChangesConfig(Frozen):
    """What `pzd changes --over` lets pass."""

    tolerance: dict[str, tuple[float, float]] = Field(default_factory=dict)
    """Smallest and largest value by quantity: `T0`, `C`, `k`, or effect and parameter as in `gas_spring.k_g`, or of the
    knee law, as `knee.F_reb`."""
    peak_force: tuple[PeakForceBand, ...] = ()
    """Points of a master curve of peak force over peak velocity, each with a band."""

    @field_validator("tolerance")
    @classmethod
    def _known_quantities(cls, tolerance: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        effects = [*library().values(), knee.EFFECT]  # the friction of a seal is T0
        known = {*ELEMENT, *(f"{e.name}.{p.name}" for e in effects for p in e.parameters)}
        for name, limits in tolerance.items():
            if name not in known:
                near = nearest(name, known)
                hint = f"; did you mean {near}?" if near else "; name T0, C, k or effect.parameter"
                raise ValueError(f"no quantity is called {name}{hint}")
            _rising_limits(limits)
        return tolerance


def _rising_limits(limits: tuple[float, float]) -> tuple[float, float]:
    if limits[0] > limits[1]:
        raise ValueError(f"the first limit must be below the second (got {limits[0]:g}, {limits[1]:g})")
    return limits


class DiagnoseConfig(Frozen):
    """When simulation and measurement count as disagreeing, and when an effect is adopted."""

    significance: float = Field(default=SIGNIFICANCE, gt=0.0, lt=1.0)
    """A gap is believed when noise alone would show it less often than this."""
    visible: float = Field(default=VISIBLE, ge=0.0, le=0.1)
    """A gap smaller than this share of the peak force (r.m.s.) counts as nothing missing; an effect that moves the
    force by less is not adopted."""
    negligible: float = Field(default=0.001, ge=0.0, le=0.1)
    """Below this share of the peak force no further effect is looked for."""
    unexplained_share: float = Field(default=0.3, gt=0.0, le=1.0)
    """What may remain of the gap (r.m.s.) under the verdicts `named` and `ambiguous`."""
    adopt_bic: float = Field(default=-20.0, le=0.0)
    """An effect pays when it changes the Bayesian information criterion by at most this."""
    rival_bic: float = Field(default=10.0, ge=0.0)
    """Effects whose criterion lies within this of the best are its rivals; so is none where a strength is no more than
    the root of it in its own errors."""
    most_effects: int = Field(default=3, ge=1, le=5)
    """Most effects adopted one after another."""
    most_added: int = Field(default=3, ge=0, le=5)
    """Most effects added beside them, where a gap has no name, with which kept-back tests are predicted better."""
    most_evaluations: float = Field(default=1e10, gt=0.0)
    """Forces (one a sample) that the search may compute before it ends with what it knows and says so. It is work, not
    time, so that the same tests give the same result. One takes 0.1 to 3 us on one core."""
    force: tuple[str, ...] = ()
    """Effects that are adopted whatever the data say; see `pzd effects`."""
    forbid: tuple[str, ...] = ()
    """Effects that are never adopted."""
    nuisance: NuisanceConfig = NuisanceConfig()
    """What may differ from test to test without being an effect."""

    @field_validator("force", "forbid")
    @classmethod
    def _known(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        unknown = [name for name in names if name not in library()]
        if unknown:
            raise ValueError(f"no effect is called {', '.join(unknown)}; there is {', '.join(library())}")
        if len(set(names)) < len(names):
            raise ValueError("one is named twice")
        return names

    @model_validator(mode="after")
    def _not_both(self) -> DiagnoseConfig:
        both = sorted({*self.force} & {*self.forbid})
        if both:
            raise ValueError(f"force and forbid contradict each other on {', '.join(both)}")
        return self
