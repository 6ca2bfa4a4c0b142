"""The `simulate` block of the config: the car, its roads, how the dampers are controlled, and how it is computed."""

from __future__ import annotations

import operator
from functools import reduce
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, field_validator, model_validator

from pzd.schema.model import Frozen
from pzd.simulate.car import HalfCar
from pzd.simulate.cars import cars
from pzd.simulate.policies import policies
from pzd.simulate.road import Road
from pzd.simulate.roads import roads
from pzd.simulate.roads.sine import Sine

Fidelity = Literal["ideal", "table", "dynamic"]
TieBreak = Literal["smallest", "equal_share", "largest"]

if TYPE_CHECKING:
    RoadBlock = Road
else:
    RoadBlock = Annotated[reduce(operator.or_, roads().values()), Field(discriminator="kind")]

Pair = tuple[float, float]


class CarBlock(Frozen):
    """The car: one of the library, and whatever is to be different from it."""

    model: str = "makowski2021"
    """Name of the car in the library."""
    mass_kg: float | None = Field(default=None, gt=0.0)
    """Body mass m."""
    pitch_inertia_kgm2: float | None = Field(default=None, gt=0.0)
    """Moment of inertia J_y about the centre of gravity."""
    a1_m: float | None = Field(default=None, gt=0.0)
    """Distance from the centre of gravity to axle 1, which leads."""
    a2_m: float | None = Field(default=None, gt=0.0)
    """Distance from the centre of gravity to axle 2, which follows."""
    spring_stiffness_N_per_m: Pair | None = None
    """Spring stiffness k1, k2 at the axles."""
    x_K_m: float | None = None
    """Place of point K, where comfort is judged: from the centre of gravity, positive towards axle 2."""
    motion_ratio: Pair | None = None
    """Extension of a damper over deflection of its suspension, per axle."""
    dampers_per_axle: Pair | None = None
    """Number of dampers that act at each axle."""

    @field_validator("model")
    @classmethod
    def _in_library(cls, name: str) -> str:
        if name not in cars():
            raise ValueError(f"no car is called {name}; there are {', '.join(sorted(cars()))}")
        return name

    @field_validator("spring_stiffness_N_per_m", "motion_ratio", "dampers_per_axle")
    @classmethod
    def _positive(cls, pair: Pair | None) -> Pair | None:
        if pair is not None and min(pair) <= 0.0:
            raise ValueError(f"both must be above zero (got {pair[0]:g}, {pair[1]:g})")
        return pair

    def car(self) -> HalfCar:
        """The car of the library with what the config changes."""
        known = cars()[self.model]
        return HalfCar(
            name=known.name,
            mass=_first(self.mass_kg, known.mass),
            pitch_inertia=_first(self.pitch_inertia_kgm2, known.pitch_inertia),
            distances=(_first(self.a1_m, known.distances[0]), _first(self.a2_m, known.distances[1])),
            stiffnesses=self.spring_stiffness_N_per_m or known.stiffnesses,
            comfort_point=_first(self.x_K_m, known.comfort_point),
            motion_ratios=self.motion_ratio or known.motion_ratios,
            dampers=self.dampers_per_axle or known.dampers,
        )


def _first(given: float | None, known: float) -> float:
    return known if given is None else given


class SimulateConfig(Frozen):
    """The ride: by default that of section 5 of the paper."""

    car: CarBlock = CarBlock()
    """The half-car."""
    vehicle_speed_km_per_h: float = Field(default=90.0, gt=0.0)
    """Speed of the car; axle 2 meets the road (a1 + a2) / speed after axle 1."""
    roads: tuple[RoadBlock, ...] = Field(default=(Sine(frequency_Hz=2.25), Sine(frequency_Hz=4.5)), min_length=1)
    """The roads, each a ride of its own."""
    policies: tuple[str, ...] | None = Field(default=None, min_length=1)
    """How the dampers are controlled. By default `constant` and `comfort`; on a rig without a control
    signal `constant` and `passive`."""
    fidelities: tuple[Fidelity, ...] = Field(default=("ideal", "table", "dynamic"), min_length=1)
    """How a demanded force comes about: `ideal` at once; `table` by the voltage that the table gives for
    it; `dynamic` by that voltage, the lag of the valve and the damper's own dynamics."""
    constant_damping_Ns_per_m: float = Field(default=4500.0, gt=0.0)
    """c of the policy `constant`, per axle."""
    passive_voltage_V: float = 0.0
    """Voltage of the policy `passive`, and of every valve before the ride."""
    response_speed_m_per_s: float = Field(default=0.2, gt=0.0)
    """Speed at which the response of the damper's force to a step of voltage is computed."""
    bounds: Literal["coefficients", "table"] = "coefficients"
    """What bounds the forces Omega(V) that `ideal` may demand: [c_min V, c_max V], or the table between its
    lowest and highest voltage. `table` and `dynamic` are always bounded by the table."""
    c_min_Ns_per_m: float = Field(default=750.0, ge=0.0)
    """Smallest damping coefficient of an axle."""
    c_max_Ns_per_m: float = Field(default=45000.0, gt=0.0)
    """Largest damping coefficient of an axle."""
    tie_break: TieBreak = "equal_share"
    """Which of the forces that make |a_K| smallest, where there are many: the smallest (Euclidean norm),
    the same share of each damper's range, or the largest."""
    temperature_degC: float | None = None
    """Temperature of the dampers during the ride; by default the lowest of the table."""
    control_period_s: float = Field(default=0.001, gt=0.0)
    """The voltage is set this often; `ideal` acts at every instant."""
    valve_response_s: float = Field(default=0.0039, ge=0.0)
    """Time constant of the valve in `dynamic` where the damper has no `valve_lag` of its own: 0.0039 s
    reaches 90 % in the 9 ms that the paper states."""
    integration_step_s: float = Field(default=0.001, gt=0.0)
    """Largest step of integration, cut as `tolerance` asks; peaks and r.m.s. are taken at its ends."""
    tolerance: float = Field(default=1e-9, gt=0.0)
    """Largest local error of a step, as a share of the motion."""
    duration_s: float = Field(default=16.0, gt=0.0)
    """Length of each ride."""
    settle_s: float = Field(default=8.0, ge=0.0)
    """Peaks and r.m.s. are taken after this time."""
    output_rate_Hz: float = Field(default=500.0, gt=0.0)
    """Rate of the written histories; peaks and r.m.s. are taken from every step."""

    @field_validator("policies")
    @classmethod
    def _known_policies(cls, names: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for name in names or ():
            if name not in policies():
                raise ValueError(f"no policy is called {name}; there are {', '.join(sorted(policies()))}")
        return names

    @model_validator(mode="after")
    def _consistent(self) -> SimulateConfig:
        names = [road.name for road in self.roads]
        double = sorted({name for name in names if names.count(name) > 1})
        if double:
            raise ValueError(f"roads: two are called {', '.join(double)}; give each a label of its own")
        for field in ("policies", "fidelities"):
            listed = getattr(self, field) or ()
            if len(set(listed)) < len(listed):
                raise ValueError(f"{field}: one is named twice")
        if self.c_max_Ns_per_m < self.c_min_Ns_per_m:
            raise ValueError("c_max_Ns_per_m must be at least c_min_Ns_per_m")
        if self.settle_s >= self.duration_s:
            raise ValueError("settle_s must be shorter than duration_s")
        for field in ("control_period_s", "duration_s", "settle_s"):
            self._whole_steps(field, getattr(self, field))
        self._whole_steps("1 / output_rate_Hz", 1.0 / self.output_rate_Hz)
        return self

    def _whole_steps(self, name: str, time: float) -> None:
        steps = time / self.integration_step_s
        if abs(steps - round(steps)) > 1e-6 * max(steps, 1.0):
            raise ValueError(f"{name} must be a whole number of integration_step_s (got {steps:g} steps)")
