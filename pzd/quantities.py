"""Physical quantities, each declared once: name, symbol, unit and meaning.

CSV headers, axis labels, config keys and the docs are made from this list, so a
quantity cannot carry two names or two units.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s2], one g by definition."""

# Units as spelled inside a column name or a JSON key; others stand as they are.
_SPELLED = {
    "m/s": "m_per_s",
    "m/s2": "m_per_s2",
    "m/s3": "m_per_s3",
    "N s/m": "Ns_per_m",
    "N/m": "N_per_m",
}


@dataclass(frozen=True)
class Quantity:
    """One measured or computed quantity."""

    name: str
    """Name in code and column names."""
    symbol: str
    """Symbol in the paper and in axis labels."""
    unit: str
    """SI, but for temperature in degC; empty for a pure number."""
    meaning: str

    @property
    def column(self) -> str:
        """Header of the CSV column, e.g. ``velocity_m_per_s``."""
        return f"{self.name}_{_SPELLED.get(self.unit, self.unit)}" if self.unit else self.name

    @property
    def label(self) -> str:
        """Label of an axis, e.g. ``velocity v [m/s]``."""
        return f"{self.name.replace('_', ' ')} {self.symbol} [{self.unit or '-'}]"


TIME = Quantity("time", "t", "s", "time; may start anywhere")
DISPLACEMENT = Quantity("displacement", "x", "m", "extension of the damper, rebound positive")
VELOCITY = Quantity("velocity", "v", "m/s", "rate of extension, rebound positive")
ACCELERATION = Quantity("acceleration", "a", "m/s2", "second derivative of the extension")
FORCE = Quantity("force", "F", "N", "damper force; F v > 0 dissipates")
VOLTAGE = Quantity("voltage", "U", "V", "control signal of the valve")
TEMPERATURE = Quantity("temperature", "T", "degC", "temperature of the damper")
PRESSURE = Quantity("pressure", "p", "Pa", "chamber pressure, carried and not used")

FRICTION = Quantity("T0", "T0", "N", "dry friction force of the Bingham element")
DAMPING = Quantity("C", "C", "N s/m", "damping coefficient of the Bingham element")
STIFFNESS = Quantity("k", "k", "N/m", "stiffness of the oil spring of the Bingham element")

BINGHAM = (FRICTION, DAMPING, STIFFNESS)
"""The parameters of the Bingham element, in the order in which they are fitted and written."""

CHANNELS = (TIME, DISPLACEMENT, VELOCITY, ACCELERATION, FORCE, VOLTAGE, TEMPERATURE, PRESSURE)
"""The canonical columns of a rig record, in the order in which they are written, named as the fields of `Record`; the
first five are in every file."""


_VOLTAGE_ALONE = re.compile(rf"(?<![\w.-])(?i:{VOLTAGE.name})(?=s?\b(?!-|\.\w))")
"""As a word, and not as a part of the name of a policy, a column or a file."""


def _as_begun(said: str, name: str) -> str:
    """Return a name with a capital where another word has one."""
    return name.capitalize() if said[0].isupper() else name


@dataclass(frozen=True)
class Control:
    """The control signal of the valve: a voltage unless the config says otherwise."""

    name: str = VOLTAGE.name
    unit: str = VOLTAGE.unit

    @property
    def quantity(self) -> Quantity:
        """Quantity of the control signal, for labels and column names."""
        if self == Control():
            return VOLTAGE
        return Quantity(self.name, self.name, self.unit, "control signal of the valve")

    def own_unit(self, unit: str) -> str:
        """Return a unit under this control: V becomes the unit of the control signal."""
        return self.unit if unit == VOLTAGE.unit else unit

    def told(self, text: str) -> str:
        """Return a text in which this control signal stands where it says voltage.

        Examples
        --------
        >>> Control("current", "A").told("less than at the best fixed voltage (best_fixed_voltage)")
        'less than at the best fixed current (best_fixed_voltage)'
        >>> Control("current", "A").told("Voltage 2 A of voltage-step.csv and voltage.csv. The voltages:")
        'Current 2 A of voltage-step.csv and voltage.csv. The currents:'
        """
        name = self.name.replace("_", " ")
        return text if self == Control() else _VOLTAGE_ALONE.sub(lambda said: _as_begun(said[0], name), text)

    def renamed(self, column: str) -> str:
        """Return the name of a canonical column under this control: voltage_1_V -> current_1_A."""
        if VOLTAGE.name not in column or self == Control():
            return column
        return column.replace(VOLTAGE.name, self.name).removesuffix(f"_{VOLTAGE.unit}") + (
            f"_{_SPELLED.get(self.unit, self.unit)}" if column.endswith(f"_{VOLTAGE.unit}") else ""
        )
