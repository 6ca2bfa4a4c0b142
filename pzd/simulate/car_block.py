"""The `car` of the `simulate` block: one of the library, and whatever is to be different from it."""

from __future__ import annotations

from dataclasses import replace

from pydantic import Field, field_validator, model_validator

from pzd.schema.model import Frozen
from pzd.simulate.car import HalfCar
from pzd.simulate.cars import cars

Pair = tuple[float, float]


class CarBlock(Frozen):
    """The car: one of the library, and whatever is to be different from it."""

    name: str | None = None
    """What the report calls it. By default the name of the model, or `own` where a value differs from it."""
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
    unsprung_mass_kg: Pair | None = None
    """Mass m1, m2 of the wheels of each axle with what moves with them. Without it the wheels have none, and follow
    the road."""
    tyre_stiffness_N_per_m: Pair | None = None
    """Stiffness of the tyres of each axle, all of them together."""
    tyre_damping_Ns_per_m: Pair | None = None
    """Damping of the tyres of each axle; by default none."""

    @field_validator("model")
    @classmethod
    def _in_library(cls, name: str) -> str:
        if name not in cars():
            raise ValueError(f"no car is called {name}; there are {', '.join(sorted(cars()))}")
        return name

    @field_validator(
        "spring_stiffness_N_per_m", "motion_ratio", "dampers_per_axle", "unsprung_mass_kg", "tyre_stiffness_N_per_m"
    )
    @classmethod
    def _positive(cls, pair: Pair | None) -> Pair | None:
        if pair is not None and min(pair) <= 0.0:
            raise ValueError(f"both must be above zero (got {pair[0]:g}, {pair[1]:g})")
        return pair

    @field_validator("tyre_damping_Ns_per_m")
    @classmethod
    def _not_negative(cls, pair: Pair | None) -> Pair | None:
        if pair is not None and min(pair) < 0.0:
            raise ValueError(f"neither may be below zero (got {pair[0]:g}, {pair[1]:g})")
        return pair

    @model_validator(mode="after")
    def _wheels_on_tyres(self) -> CarBlock:
        car = self.car()
        if car.wheels_have_mass != (min(car.tyre_stiffnesses) > 0.0):
            missing = "tyre_stiffness_N_per_m" if car.wheels_have_mass else "unsprung_mass_kg"
            raise ValueError(f"wheels with mass stand on tyres: give {missing} as well, or neither")
        if self.tyre_damping_Ns_per_m is not None and not car.wheels_have_mass:
            raise ValueError("tyre_damping_Ns_per_m: wheels without mass have no tyres; give unsprung_mass_kg as well")
        return self

    @model_validator(mode="after")
    def _comfort_point_in_the_car(self) -> CarBlock:
        car = self.car()
        low, high = -car.distances[0] - car.wheelbase, car.distances[1] + car.wheelbase
        if not low <= car.comfort_point <= high:
            raise ValueError(
                f"x_K_m must lie within the car, no farther than its wheelbase beyond an axle: "
                f"from {low:.4g} to {high:.4g} m (got {car.comfort_point:g})"
            )
        return self

    def car(self) -> HalfCar:
        """The car of the library with what the config changes; it keeps its name only where that is nothing."""
        known = cars()[self.model]
        built = HalfCar(
            name=known.name,
            mass=_first(self.mass_kg, known.mass),
            pitch_inertia=_first(self.pitch_inertia_kgm2, known.pitch_inertia),
            distances=(_first(self.a1_m, known.distances[0]), _first(self.a2_m, known.distances[1])),
            stiffnesses=self.spring_stiffness_N_per_m or known.stiffnesses,
            comfort_point=_first(self.x_K_m, known.comfort_point),
            motion_ratios=self.motion_ratio or known.motion_ratios,
            dampers=self.dampers_per_axle or known.dampers,
            unsprung_masses=self.unsprung_mass_kg or known.unsprung_masses,
            tyre_stiffnesses=self.tyre_stiffness_N_per_m or known.tyre_stiffnesses,
            tyre_dampings=self.tyre_damping_Ns_per_m or known.tyre_dampings,
        )
        return replace(built, name=self.name or (known.name if built == known else "own"))


def _first(given: float | None, known: float) -> float:
    return known if given is None else given
