"""What a block of the config must give to be a road."""

from __future__ import annotations

from abc import abstractmethod
from pathlib import Path

from pzd.schema.model import Frozen
from pzd.simulate.profile import Profile


class Road(Frozen):
    """A road under the wheels; each kind is one file in `roads/` with `kind` of its own."""

    kind: str
    """Which road."""
    label: str | None = None
    """Name of the road in the names of cases; by default made from kind and size."""

    @property
    def name(self) -> str:
        """How cases call this road."""
        return self.label or self.own_name()

    @abstractmethod
    def own_name(self) -> str:
        """The name made from kind and size."""

    @abstractmethod
    def profile(self, vehicle_speed: float, distance: float, seed: int, folder: Path) -> Profile:
        """The road as the car meets it.

        Parameters
        ----------
        vehicle_speed : [m/s]
        distance : length of the ride [m]
        seed : of the run, for roads that are drawn
        folder : of the config, for roads that are read

        Returns
        -------
        height over distance
        """
