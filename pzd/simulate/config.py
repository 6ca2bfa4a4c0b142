"""The `simulate` block of the config: the car, its roads, how the dampers are controlled, and how it is computed."""

from __future__ import annotations

import operator
from dataclasses import replace
from functools import reduce
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from pzd.artefacts import History
from pzd.schema.errors import InsideError
from pzd.schema.model import Frozen
from pzd.simulate.cars import cars
from pzd.simulate.policies import TieBreak, policies
from pzd.simulate.policies.best_found import BestFound
from pzd.simulate.policies.clipped_lqr import ClippedLqr
from pzd.simulate.policies.comfort_predictive import ComfortPredictive
from pzd.simulate.policies.skyhook import SkyhookAdd
from pzd.simulate.roads import Road, roads
from pzd.simulate.roads.sine import Sine
from pzd.simulate.vehicle.car import HalfCar

# --- `sensors` and `supply`: what the controller sees, and what becomes of the voltage that it asks for ---


class SensorNoise(Frozen):
    """White noise of the sensors, by its standard deviation in a sample."""

    deflection_m: float = Field(default=0.0, ge=0.0)
    """Of the deflection of each suspension."""
    deflection_rate_m_per_s: float = Field(default=0.0, ge=0.0)
    """Of its rate."""
    heave_m: float = Field(default=0.0, ge=0.0)
    """Of the height of the body."""
    pitch_rad: float = Field(default=0.0, ge=0.0)
    """Of its angle."""
    heave_rate_m_per_s: float = Field(default=0.0, ge=0.0)
    """Of the speed of the body."""
    pitch_rate_rad_per_s: float = Field(default=0.0, ge=0.0)
    """Of its angular speed."""
    acceleration_m_per_s2: float = Field(default=0.0, ge=0.0)
    """Of the acceleration of the body, at the centre of gravity and at K."""


class Sensors(Frozen):
    """What the controller measures of the ride; by default everything, exactly and without delay."""

    period_s: float | None = Field(default=None, gt=0.0)
    """A sample is taken this often, and held until the next. By default in every control period."""
    delay_s: float = Field(default=0.0, ge=0.0)
    """The controller acts on what was this long ago."""
    noise: SensorNoise = SensorNoise()
    """White noise of every sample."""
    seed: int = Field(default=1, ge=0)
    """Of the noise; every policy meets the same."""


class Supply(Frozen):
    """How the voltage that the controller asks for is set; by default exactly and without delay."""

    step: float | None = Field(default=None, gt=0.0)
    """Distance of the values that can be set, in the unit of the control signal."""
    slew_per_s: float | None = Field(default=None, gt=0.0)
    """Largest change of the control signal in a second, in its unit: what the inductance of a coil leaves."""
    power_W: float | None = Field(default=None, gt=0.0)
    """Of the supply of one axle, to charge or discharge what `capacitance_F` is: a piezo stack."""
    capacitance_F: float | None = Field(default=None, gt=0.0)
    """Of the stacks of one axle together."""

    @model_validator(mode="after")
    def _power_charges_something(self) -> Supply:
        if (self.power_W is None) != (self.capacitance_F is None):
            missing = "power_W" if self.power_W is None else "capacitance_F"
            raise ValueError(f"a supply is limited by power_W and capacitance_F together; give {missing} as well")
        return self


# --- `car`: one of the library, and whatever is to be different from it ---

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]


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
    spring_stiffness_N_per_m: tuple[Positive, Positive] | None = None
    """Spring stiffness k1, k2 at the axles."""
    x_K_m: float | None = None
    """Place of point K, where comfort is judged: from the centre of gravity, positive towards axle 2."""
    motion_ratio: tuple[Positive, Positive] | None = None
    """Extension of a damper over deflection of its suspension, per axle."""
    dampers_per_axle: tuple[Positive, Positive] | None = None
    """Number of dampers that act at each axle."""
    unsprung_mass_kg: tuple[Positive, Positive] | None = None
    """Mass m1, m2 of the wheels of each axle with what moves with them. Without it the wheels have none, and follow
    the road."""
    tyre_stiffness_N_per_m: tuple[Positive, Positive] | None = None
    """Stiffness of the tyres of each axle, all of them together."""
    tyre_damping_Ns_per_m: tuple[NotNegative, NotNegative] | None = None
    """Damping of the tyres of each axle; by default none."""

    @field_validator("model")
    @classmethod
    def _in_library(cls, name: str) -> str:
        if name not in cars():
            raise ValueError(f"no car is called {name}; there are {', '.join(sorted(cars()))}")
        return name

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
        """Return the car of the library with what the config changes; it keeps its name only where that is nothing."""
        known, (a1, a2) = cars()[self.model], cars()[self.model].distances
        given: dict[str, Any] = {
            "mass": self.mass_kg,
            "pitch_inertia": self.pitch_inertia_kgm2,
            "distances": (a1 if self.a1_m is None else self.a1_m, a2 if self.a2_m is None else self.a2_m),
            "stiffnesses": self.spring_stiffness_N_per_m,
            "comfort_point": self.x_K_m,
            "motion_ratios": self.motion_ratio,
            "dampers": self.dampers_per_axle,
            "unsprung_masses": self.unsprung_mass_kg,
            "tyre_stiffnesses": self.tyre_stiffness_N_per_m,
            "tyre_dampings": self.tyre_damping_Ns_per_m,
        }
        built = replace(known, **{name: value for name, value in given.items() if value is not None})
        return replace(built, name=self.name or (known.name if built == known else "own"))


# --- The whole block ---

Fidelity = Literal["ideal", "table", "dynamic"]

if TYPE_CHECKING:
    RoadBlock = Road
else:
    RoadBlock = Annotated[reduce(operator.or_, roads().values()), Field(discriminator="kind")]

KM_PER_H = 1.0 / 3.6
"""[m/s]"""
DEFAULT_CONTROLLED = "comfort"
"""The policy that the report sets beside the others where the config does not say."""

_UNFIT = (
    "damps the motion of wheels with mass, and those of this car have none; give simulate.car unsprung_mass_kg and "
    "tyre_stiffness_N_per_m, or leave it out"
)
"""Why a policy that fits wheels with mass alone cannot be ridden on the paper's car."""


class SimulateConfig(Frozen):
    """The ride: by default that of section 5 of the paper."""

    car: CarBlock = CarBlock()
    """The half-car."""
    vehicle_speed_km_per_h: float = Field(default=90.0, gt=0.0)
    """Speed of the car; axle 2 meets the road (a1 + a2) / speed after axle 1."""
    roads: tuple[RoadBlock, ...] = Field(default=(Sine(frequency_Hz=2.25), Sine(frequency_Hz=4.5)), min_length=1)
    """The roads, each a ride of its own."""
    policies: tuple[str, ...] | None = Field(default=None, min_length=1)
    """How the dampers are controlled. By default `constant`, `best_constant_c`, `passive`,
    `best_fixed_voltage` and `comfort`; on a rig without a control signal `constant` and `passive`."""
    controlled: str | None = None
    """The policy that the report sets beside the others, one that controls. By default the only such one of
    `policies`, or `comfort`; where there are several others, the config must say which."""
    fidelities: tuple[Fidelity, ...] = Field(default=("ideal", "table", "dynamic"), min_length=1)
    """How a demanded force comes about: `ideal` at once; `table` by the voltage that the table gives for
    it; `dynamic` by that voltage, the lag of the valve and the damper's own dynamics."""
    constant_damping_Ns_per_m: float = Field(default=4500.0, gt=0.0)
    """c of the policy `constant`, per axle."""
    passive_voltage_V: float | None = None
    """Voltage of the policy `passive`, and of every valve before the ride, within those of the table. By
    default that of the table which is nearest to 0."""
    comfort_predictive: ComfortPredictive = ComfortPredictive()
    """Parameters of the policy `comfort_predictive`."""
    clipped_lqr: ClippedLqr = ClippedLqr()
    """Parameters of the policy `clipped_lqr`."""
    best_found: BestFound = BestFound()
    """Parameters of the policy `best_found`."""
    skyhook_add: SkyhookAdd = SkyhookAdd()
    """Parameters of the policy `skyhook_add`."""
    response_speed_m_per_s: float = Field(default=0.2, gt=0.0)
    """Speed at which the response of the damper's force to a step of voltage is computed."""
    bounds: Literal["coefficients", "table"] | None = None
    """What bounds the forces Omega(V) that `ideal` may demand: [c_min V, c_max V], or the damper's own table
    between its lowest and highest voltage. By default the table, unless `c_min_Ns_per_m` and
    `c_max_Ns_per_m` are given. `table` and `dynamic` are always bounded by the table."""
    c_min_Ns_per_m: float | None = Field(default=None, ge=0.0)
    """Smallest damping coefficient of an axle."""
    c_max_Ns_per_m: float | None = Field(default=None, gt=0.0)
    """Largest damping coefficient of an axle."""
    tie_break: TieBreak = "equal_share"
    """Which of the forces that make |a_K| smallest, where there are many: the smallest (Euclidean norm),
    the same share of each damper's range, or the largest."""
    temperature_degC: float | None = None
    """Temperature of the dampers during the ride, within those of the table; by default its lowest."""
    control_period_s: float = Field(default=0.001, gt=0.0)
    """The voltage is set this often; `ideal` acts at every instant."""
    sensors: Sensors = Sensors()
    """What the controller sees at the fidelities `table` and `dynamic`; by default all, exactly and at once."""
    supply: Supply = Supply()
    """What becomes of the voltage that it asks for there; by default it is set exactly and at once."""
    valve_response_s: float = Field(default=0.0039, ge=0.0)
    """Time constant of the valve in `dynamic` where the damper has no `valve_lag` of its own: 0.0039 s
    reaches 90 % in the 9 ms that the paper states."""
    integration_step_s: float = Field(default=0.001, gt=0.0)
    """Largest step of integration, cut as `tolerance` asks; peaks and r.m.s. are taken at its ends."""
    tolerance: float = Field(default=1e-8, gt=0.0)
    """Largest local error of a step, as a share of the motion: a_w is then off by less than 1e-6 of itself."""
    duration_s: float = Field(default=16.0, gt=0.0)
    """Length of each ride; on a single bump or step long enough for the motion to die away."""
    settle_s: float = Field(default=8.0, ge=0.0)
    """On roads that go on and on, peaks and r.m.s. are taken after this time. On a single bump or step they
    are taken from the moment when axle 1 meets it until the motion has died away."""
    output_rate_Hz: float = Field(default=500.0, gt=0.0)
    """Rate of the written histories; every other number is taken from every step."""
    histories: History = "csv"
    """How the history of each ride is written: `csv`, `parquet` (half the size, with `pip install pzd[formats]`)
    or `none`, where the numbers are enough; the report then draws no acceleration over time."""
    keep: Literal["drawn", "all"] = "drawn"
    """Which histories are written: those that the report draws (the adopted damper, at the fidelity nearest to a car
    that was ridden over the road), or those of all rides."""

    @field_validator("policies")
    @classmethod
    def _known_policies(cls, names: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for number, name in enumerate(names or ()):
            if name not in policies():
                raise InsideError(f"no policy is called {name}; there are {', '.join(sorted(policies()))}", number)
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
        self._policies_fit_the_car()
        self._bounds_consistent()
        self._controlled_consistent()
        if self.settle_s >= self.duration_s:
            raise ValueError("settle_s must be shorter than duration_s")
        for field in ("control_period_s", "duration_s", "settle_s"):
            self._whole(field, getattr(self, field), "integration_step_s")
        if "comfort_predictive" in (self.policies or ()):
            self._whole("comfort_predictive.hold_s", self.comfort_predictive.hold_s, "control_period_s", least=1)
        self._whole("1 / output_rate_Hz", 1.0 / self.output_rate_Hz, "integration_step_s")
        self._electronics_consistent()
        return self

    def _electronics_consistent(self) -> None:
        given = "sensors" if self.sensors != Sensors() else "supply" if self.supply != Supply() else None
        if given and set(self.fidelities) == {"ideal"}:
            raise ValueError(f"{given}: ideal forces need neither sensors nor a supply; ride table or dynamic as well")
        sampled = self.sensors.period_s or self.control_period_s
        for name, time in (("period_s", sampled), ("delay_s", self.sensors.delay_s)):
            self._whole(f"sensors.{name}", time, "control_period_s")

    def _policies_fit_the_car(self) -> None:
        for number, name in enumerate(self.policies or ()):
            if policies()[name].fits == "wheels with mass" and not self.car.car().wheels_have_mass:
                raise ValueError(f"policies.{number}: {name} {_UNFIT}")

    def _bounds_consistent(self) -> None:
        given = (self.c_min_Ns_per_m is not None, self.c_max_Ns_per_m is not None)
        if given[0] != given[1] or (self.bounds == "coefficients" and not all(given)):
            raise ValueError("bounds by coefficients need both c_min_Ns_per_m and c_max_Ns_per_m")
        if self.bounds == "table" and any(given):
            raise ValueError("bounds: table leaves no use for c_min_Ns_per_m and c_max_Ns_per_m; leave one of them out")
        if self.coefficients is not None and self.coefficients[1] < self.coefficients[0]:
            raise ValueError("c_max_Ns_per_m must be at least c_min_Ns_per_m")

    def _controlled_consistent(self) -> None:
        names = [name for name in self.policies or () if policies()[name].controlled]
        if self.controlled is not None:
            known = [name for name, policy in policies().items() if policy.controlled]
            if self.controlled not in known:
                raise ValueError(f"controlled: {self.controlled} does not control; these do: {', '.join(known)}")
            if self.controlled not in (names or [DEFAULT_CONTROLLED]):
                raise ValueError(f"controlled: {self.controlled} is none of policies")
        elif len(names) > 1 and DEFAULT_CONTROLLED not in names:
            raise ValueError(f"controlled: say which one the report is about: {', '.join(names)}")

    @property
    def vehicle_speed(self) -> float:
        """Speed of the car [m/s]."""
        return self.vehicle_speed_km_per_h * KM_PER_H

    @property
    def coefficients(self) -> tuple[float, float] | None:
        """c_min and c_max [N s/m] where they bound the forces of `ideal`; None where the table does."""
        if self.c_min_Ns_per_m is None or self.c_max_Ns_per_m is None:
            return None
        return self.c_min_Ns_per_m, self.c_max_Ns_per_m

    def by_tables(self) -> SimulateConfig:
        """Return the block for dampers that are known by their tables alone: `table` in the place of `dynamic`."""
        fidelities = tuple(dict.fromkeys("table" if one == "dynamic" else one for one in self.fidelities))
        return self.model_copy(update={"fidelities": fidelities})

    def is_controlled(self, policy: str) -> bool:
        """Tell whether a policy is the controlled one that the report sets beside the others."""
        names = [name for name in self.policies or () if policies()[name].controlled]
        return policy == (self.controlled or (names[0] if len(names) == 1 else DEFAULT_CONTROLLED))

    def own_block(self, policy: str) -> Frozen:
        """Return the parameters of a policy's own; an empty block where it has none."""
        found = getattr(self, policy, None)
        return found if isinstance(found, Frozen) else Frozen()

    def _whole(self, name: str, time: float, of: str, least: int = 0) -> None:
        count, unit = time / getattr(self, of), "periods" if of == "control_period_s" else "steps"
        if abs(count - round(count)) > 1e-6 * max(count, 1.0) or round(count) < least:
            raise ValueError(f"{name} must be a whole number of {of} (got {count:g} {unit})")
