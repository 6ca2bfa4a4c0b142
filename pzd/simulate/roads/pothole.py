"""A pothole: a hole with a level bottom and cosine edges, with finite curvature everywhere."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator
from typing_extensions import override

from pzd.record import Array
from pzd.simulate.road.unevenness import Unevenness, flanked


class Pothole(Unevenness):
    """A hole: -d / 2 (1 - cos(pi s / e)) over the edge e, then level at the depth d, and up again over an edge."""

    kind: Literal["pothole"] = "pothole"
    """A hole."""
    height_m: float = Field(default=-0.05, lt=0.0)
    """Its bottom, below zero."""
    length_m: float = Field(default=0.8, gt=0.0)
    """Length along the road, with both edges."""
    edge_m: float = Field(default=0.2, gt=0.0)
    """Length of each edge: the footprint of a tyre rolls over a sharp one about so softly."""

    @model_validator(mode="after")
    def _edges_fit(self) -> Pothole:
        if 2.0 * self.edge_m > self.length_m:
            raise ValueError(f"edge_m: two edges are longer than length_m (got {self.edge_m:g} of {self.length_m:g} m)")
        return self

    @override
    def own_name(self) -> str:
        return f"pothole-{-self.height_m:g}m"

    @override
    def shape(self, along: Array) -> Array:
        return flanked(along, self.edge_m / self.length_m)


ROAD = Pothole
