"""What the stand sets beside the motion: the voltage over a test, and how the damper warms."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from pzd.record import Array
from pzd.schema.model import Frozen


class Steps(Frozen):
    """A voltage that steps through levels, over and over."""

    kind: Literal["steps"]
    """A stepped voltage."""
    voltages_V: tuple[float, ...] = Field(min_length=2)
    """The levels, one after the other."""
    dwell_s: float = Field(default=1.0, gt=0.0)
    """Time from one step to the next."""
    rise_s: float = Field(default=0.002, gt=0.0)
    """Time that the supply takes from one level to the next, linearly; shorter than dwell_s."""

    @model_validator(mode="after")
    def _rises_in_time(self) -> Steps:
        if self.rise_s >= self.dwell_s:
            raise ValueError("rise_s must be shorter than dwell_s")
        return self

    def name(self, unit: str) -> str:
        """`steps-0-150V`."""
        return f"steps-{'-'.join(f'{level:g}' for level in self.voltages_V)}{unit}"

    def at(self, time: Array, duration: float) -> Array:
        """(n,) voltage; the first level before 0."""
        levels = np.array(self.voltages_V)
        number = np.maximum(np.floor(time / self.dwell_s), 0.0).astype(int)
        now, last = levels[number % levels.size], levels[np.maximum(number - 1, 0) % levels.size]
        share = np.clip((time - number * self.dwell_s) / self.rise_s, 0.0, 1.0)
        return np.asarray(last + (now - last) * share)


class Ramp(Frozen):
    """A voltage that rises or falls evenly over the whole test."""

    kind: Literal["ramp"]
    """A ramped voltage."""
    start_voltage_V: float
    """Voltage at the beginning, and before."""
    end_voltage_V: float
    """Voltage at the end."""

    def name(self, unit: str) -> str:
        """`ramp-0-150V`."""
        return f"ramp-{self.start_voltage_V:g}-{self.end_voltage_V:g}{unit}"

    def at(self, time: Array, duration: float) -> Array:
        """(n,) voltage over a test of the given length [s]."""
        return np.interp(time, [0.0, duration], [self.start_voltage_V, self.end_voltage_V])


class Warming(Frozen):
    """A damper that the work done warms, as one lump.

    Equation: C_h dT/dt = F v - G (T - T_ambient)           Source: heat balance
    """

    kind: Literal["warming"]
    """A temperature that rises with the work done."""
    start_degC: float = Field(gt=-273.15)
    """Temperature when the recording begins."""
    ambient_degC: float | None = Field(default=None, gt=-273.15)
    """Temperature of the surroundings; by default the same."""
    heat_capacity_J_per_K: float = Field(default=1900.0, gt=0.0)
    """C_h; 1900 J/K is 3 kg of steel and 0.3 l of oil."""
    loss_W_per_K: float = Field(default=3.0, ge=0.0)
    """G, by convection and through the clamps."""

    def name(self) -> str:
        """`warming-22degC`."""
        return f"warming-{self.start_degC:g}degC"


Voltage = float | Annotated[Steps | Ramp, Field(discriminator="kind")]
"""What a test does with the voltage: one constant number, or a programme."""
Temperature = float | Warming
"""What a test does with the temperature: one constant number, or warming."""


def voltage_over(programme: Voltage, time: Array, duration: float) -> Array:
    """(n,) voltage of a programme over a test of the given length [s]."""
    return np.full(time.size, programme) if isinstance(programme, float | int) else programme.at(time, duration)
