"""The `sensors` and the `supply` of the `simulate` block: what the controller sees, and what becomes of its voltage."""

from __future__ import annotations

from pydantic import Field, model_validator

from pzd.schema.model import Frozen


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
    """What the controller sees of the ride: without a word all, exactly and at once."""

    period_s: float | None = Field(default=None, gt=0.0)
    """A sample is taken this often, and held until the next. By default in every control period."""
    delay_s: float = Field(default=0.0, ge=0.0)
    """The controller acts on what was this long ago."""
    noise: SensorNoise = SensorNoise()
    """White noise of every sample."""
    seed: int = Field(default=1, ge=0)
    """Of the noise; every policy meets the same."""


class Supply(Frozen):
    """What becomes of the voltage that the controller asks for: without a word it is set, exactly and at once."""

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
