"""The blocks `table` and `damper` of the config."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

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


class OneDamper(Frozen):
    """A damper that is known already: by a measured curve of force over velocity, or from the run of its rig."""

    curve: str | None = Field(default=None, min_length=1)
    """File with a table of force over velocity, relative to the folder of this config. One column of force, one for
    each value of the control signal, a column with that value, or one column for rebound and one for compression."""
    run: str | None = Field(default=None, min_length=1)
    """Instead of a curve: folder of the run of a rig, e.g. `../runs/front`, whose damper is taken as diagnose handed
    it on."""
    sign: Literal[1, -1] | None = None
    """Of the velocities of the curve: 1 where positive ones extend the damper (rebound), -1 where they compress it.
    Needed, unless rebound and compression have columns of their own."""
    columns: dict[str, str] = Field(default={})
    """Quantity -> header in the file of the curve, where its headers do not tell: `velocity`, `force`, `rebound`,
    `compression`, or the control signal."""
    units: dict[str, str] = Field(default={})
    """Quantity -> unit in the file, where its headers do not tell: `velocity`, `force` or the control signal."""
    voltages_V: Annotated[tuple[float, ...], Field(min_length=1)] | None = None
    """Control signal of each column of force, in their order, where the headers do not tell."""

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if self.curve is not None and self.run is not None:
            raise ValueError("say one of curve and run")
        if self.run is not None and self.reading:
            raise ValueError(f"{self.reading[0]}: says how to read a curve, and run takes none; take it away")
        return self

    @property
    def reading(self) -> tuple[str, ...]:
        """The keys given that say how a curve is read."""
        return tuple(key for key in ("sign", "columns", "units", "voltages_V") if getattr(self, key))


class DamperConfig(OneDamper):
    """The dampers of the car in place of a rig: the same one at both axles, or one at each."""

    front: OneDamper | None = None
    """Damper of axle 1, which leads."""
    rear: OneDamper | None = None
    """Damper of axle 2, which follows."""

    @model_validator(mode="after")
    def _at_the_axles(self) -> Self:
        alone = self.curve is not None or self.run is not None
        if alone == (self.front is not None and self.rear is not None) or (self.front is None) != (self.rear is None):
            raise ValueError("say curve or run for both axles, or front and rear with one of them each")
        if not alone and self.reading:
            raise ValueError(f"{self.reading[0]}: belongs to front and rear here; move it there")
        for name, one in (("front", self.front), ("rear", self.rear)):
            if one is not None and one.curve is None and one.run is None:
                raise ValueError(f"{name}: say one of curve and run")
        return self

    def axles(self) -> tuple[tuple[str, OneDamper], ...]:
        """Return the damper of axle 1, and of axle 2 where it is another one, each with its place in the config."""
        if self.front is None or self.rear is None:
            return (("damper", self),)
        return ("damper.front", self.front), ("damper.rear", self.rear)
