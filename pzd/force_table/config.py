"""The `table` block of the config."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

from pzd.artefacts.table import Neighbours, neighbours
from pzd.schema.errors import ConfigError
from pzd.schema.model import Frozen


class TableConfig(Frozen):
    """How the identified damper becomes a table of force over voltage and velocity."""

    outside: Literal["clamp", "error", "model"] = "model"
    """Beyond the speeds that the rig reached: hold the last force, leave the cells empty (a ride
    that needs them is refused), or go on with the identified law, marked `inside` = 0."""
    unreachable: Literal["empty", "clamp"] = "empty"
    """A force of the inverse that no voltage gives, in a gap between tested voltages where `outside` is `error`:
    an empty cell, or the voltage that comes nearest."""
    speed_max_m_per_s: float = Field(default=1.0, gt=0.0, le=10.0)
    """Largest speed of the table, what the car may need; never less than the rig reached."""
    speed_points: int = Field(default=24, ge=2, le=1000)
    """Speeds between 0 and the largest, spaced by their square root, so that they lie dense near 0."""
    voltages_V: Annotated[tuple[float, ...], Field(min_length=1)] | None = None
    """Voltages of the table; by default those of the damper's parameters and effects."""
    temperatures_degC: Annotated[tuple[float, ...], Field(min_length=1)] | None = None
    """Temperatures of the table; by default those of the damper's parameters, or with
    `temperature_drift` five from the lowest to the highest that the rig saw."""
    tolerance: float = Field(default=1e-3, gt=0.0, le=0.1)
    """Nodes are added until the line between two of them keeps to the law within this share of the
    largest force."""
    force_levels: int = Field(default=41, ge=2, le=1000)
    """Force levels of the inverse at each speed, evenly from the least to the largest force there."""
    settings: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    """Settings between tested ones, such as `gap 0.2 mm` between `gap 0.15 mm` and `gap 0.25 mm`, for which
    `settings.csv` holds the force, linear in the number."""

    def between(self, tested: Sequence[str | None]) -> tuple[Neighbours, ...]:
        """Return the wanted settings, each with its neighbours among the tested ones.

        Parameters
        ----------
        tested : the settings of the rig's records

        Raises
        ------
        ConfigError : when one has no neighbours, with every such place
        """
        found, faults = [], []
        for place, wanted in enumerate(self.settings or ()):
            try:
                found.append(neighbours(wanted, tested))
            except ValueError as error:
                faults.append(f"table.settings.{place}: {error}")
        if faults:
            raise ConfigError(faults)
        return tuple(found)
