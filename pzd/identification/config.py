"""The `identify` block of the config."""

from __future__ import annotations

import itertools
from typing import Literal

from pydantic import Field, field_validator

from pzd.record import SAME_TEMPERATURE
from pzd.schema.model import Frozen
from pzd.signals.nuisance import NuisanceConfig


class GroupConfig(Frozen):
    """Grouping of constant records into conditions."""

    voltage_V: float | None = Field(default=None, ge=0.0)
    """Largest spread of the control signal inside one condition; empty for 2 % of the rig's scale."""
    temperature_degC: float = Field(default=SAME_TEMPERATURE, ge=0.0)
    """Largest spread of temperature inside one condition."""


class EvolutionaryConfig(Frozen):
    """The search of `method: evolutionary`, in the terms of scipy's differential_evolution."""

    population: int = Field(default=15, ge=5)
    """Members of the population per parameter."""
    generations: int = Field(default=300, ge=1)
    """Largest number of generations."""
    tolerance: float = Field(default=1e-2, gt=0.0)
    """The search ends when the criterion's spread over the population is this share of its mean."""


class IdentifyConfig(Frozen):
    """Identification of the Bingham parameters."""

    law: Literal["bingham", "knee", "auto"] = "bingham"
    """Which damper is handed on. `bingham`: one T0 and C, what it lacks is named by diagnose. `knee`, for passive road
    and race dampers: bleed, knee and blow-off of rebound and of compression, with seal friction and gas; what it misses
    is named by diagnose too. `auto`: `knee` where it predicts whole tests kept back better beyond chance; where effects
    beside one T0 and C predict them far better still, diagnose hands on these."""
    method: Literal["separable", "evolutionary"] = "separable"
    """`separable`: grid and least squares with the stiffness solved linearly; `evolutionary`: as the paper's
    genetic algorithm. Both minimise the same criterion (4)."""
    group: GroupConfig = GroupConfig()
    """Which constant records are one condition."""
    nodes: tuple[float, ...] | None = Field(default=None, min_length=1)
    """Voltages (or other control values) at which records with moving voltage are fitted, parameters being
    piecewise linear in between; empty for the constant voltages, or where there are fewer than two, the levels
    that the voltage dwells on."""
    nuisance: NuisanceConfig = NuisanceConfig()
    """What may differ from test to test, which intervals allow for; `diagnose.nuisance` judges the gap by its own."""
    evolutionary: EvolutionaryConfig = EvolutionaryConfig()
    """Settings of `method: evolutionary`."""

    @field_validator("nodes")
    @classmethod
    def _rising(cls, nodes: tuple[float, ...] | None) -> tuple[float, ...] | None:
        if nodes is not None and any(after <= before for before, after in itertools.pairwise(nodes)):
            raise ValueError("nodes must rise from one to the next")
        return nodes
