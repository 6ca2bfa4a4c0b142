"""A measured vibration rated as `pzd rate` does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from typing_extensions import override

from pzd.comfort.rating import Rating, as_data, rated, rows_of, same_in
from pzd.front.arguments import in_python, numbers
from pzd.front.results import Result, new_axes
from pzd.record import Array

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False, repr=False)
class RatedVibration(Result):
    """The measures of ISO 2631-1:1997 of one record; of several axes each is (m,) in their order."""

    rating: Rating
    """All that was computed."""

    @property
    def a_w(self) -> float | Array:
        """Weighted r.m.s. acceleration [m/s2]."""
        return self._of("a_w")

    @property
    def a_v(self) -> float:
        """Vibration total value over the axes, by the factors k for comfort [m/s2]."""
        return self.rating.a_v

    @property
    def mtvv(self) -> float | Array:
        """Maximum transient vibration value [m/s2]."""
        return self._of("mtvv")

    @property
    def vdv(self) -> float | Array:
        """Vibration dose value of the record [m/s^1.75]."""
        return self._of("vdv")

    @property
    def crest_factor(self) -> float | Array:
        """Weighted peak over weighted r.m.s."""
        return self._of("crest_factor")

    @property
    def msdv(self) -> float | None:
        """Motion sickness dose value of the vertical axis [m/s^1.5]; None where it has none."""
        return self.rating.msdv

    def _of(self, name: str) -> float | Array:
        values = [float(np.asarray(row[name], dtype=np.float64)) for row in rows_of(self.rating)]
        return values[0] if len(values) == 1 else np.array(values)

    def as_dict(self) -> dict[str, object]:
        """Return what `pzd rate --json` prints of a file."""
        return as_data(self.rating)

    @override
    def lines(self) -> list[str]:
        return rating_lines(self.rating)

    @override
    def to_frame(self) -> pd.DataFrame:
        """Return a row for each axis."""
        import pandas as pd

        frame = pd.DataFrame(rows_of(self.rating))
        return frame.assign(a_v=self.a_v, msdv=np.nan if self.msdv is None else self.msdv)

    @override
    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the weighted acceleration of each axis over time."""
        ax = new_axes(ax)
        for one in self.rating.axes:
            time = np.arange(one.weighted.size) / self.rating.rate
            label = f"{one.axis}, {one.direction.weighting.name}: a_w {one.measures.a_w:.3g} m/s2"
            ax.plot(time, one.weighted, linewidth=0.8, label=label)
        ax.set(xlabel="time t [s]", ylabel="weighted acceleration [m/s2]")
        ax.legend()
        return ax


def rating_lines(rating: Rating) -> list[str]:
    """Return a rating as lines of text."""
    found = [f"ISO 2631-1:1997, {rating.position}, {rating.duration:.4g} s at {rating.rate:.4g} Hz"]
    for one in rating.axes:
        m = one.measures
        found.append(
            f"  {one.axis} ({one.direction.weighting.name}): a_w {m.a_w:.4g} m/s2, MTVV {m.mtvv:.4g} m/s2, "
            f"VDV {m.vdv:.4g} m/s^1.75, crest factor {m.crest:.3g}"
            + (f"; MTVV and VDV count, {' and '.join(m.beyond)}" if m.beyond else "")
        )
    if len(rating.axes) > 1:
        found.append(f"  vibration total value a_v {rating.a_v:.4g} m/s2")
    if rating.msdv is not None:
        found.append(f"  motion sickness dose MSDV {rating.msdv:.4g} m/s^1.5")
    if (health := rating.health) is not None:
        a8, vdv = health.by_directive
        zones = ", ".join(f"{where} {name} m/s2" for name, where in health.zones.items())
        found += [
            f"  {health.hours:g} h a day: A(8) {health.a8:.4g} m/s2, {a8}; VDV {health.vdv:.4g} m/s^1.75, {vdv}",
            f"  health guidance caution zone (two readings): {zones}",
        ]
    return [*found, *(f"  {note}" for note in rating.notes)]


@in_python
def rate(
    acceleration: Any,
    rate_Hz: Any,
    axis: Any = "z",
    position: Any = "seat",
    unit: Any = "m/s2",
    hours: Any = 8.0,
) -> RatedVibration:
    """Rate a measured vibration by ISO 2631-1:1997; gravity and other constants do not count.

    Parameters
    ----------
    acceleration : (n,), or (n, m) with a column for each axis, evenly sampled
    rate_Hz : sampling rate [Hz]
    axis : x, y or z; xyz or several of them in the order of the columns; rx, ry, rz for rotations at the seat
    position : seat, back, feet, standing, lying or head
    unit : m/s2 or g; rotations in rad/s2
    hours : of exposure per day, for A(8) and the daily dose

    Raises
    ------
    TypeError : when an argument is of the wrong type
    ValueError : when there is no such axis, position or unit, or the record cannot be rated
    """
    for name, value in (("position", position), ("unit", unit)):
        if not isinstance(value, str):
            raise TypeError(f"{name}: must be text (got {type(value).__name__})")
    for name, value in (("rate_Hz", rate_Hz), ("hours", hours)):
        if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
            raise TypeError(f"{name}: must be a number (got {type(value).__name__})")
    axes = axes_of(axis)
    shape = np.shape(acceleration)
    if len(shape) == 2 and shape[1] == len(axes):
        values = np.asarray(acceleration)
        columns = [numbers(f"acceleration {one}", values[:, n]) for n, one in enumerate(axes)]
    elif len(axes) > 1:
        raise ValueError(f"acceleration: must be (n, {len(axes)}), a column an axis, {', '.join(axes)} (got {shape})")
    else:
        columns = [numbers("acceleration", acceleration)]
    return RatedVibration(rated(same_in(unit, np.column_stack(columns)), float(rate_Hz), axes, position, float(hours)))


def axes_of(axis: Any) -> tuple[str, ...]:
    """Return the axes that "z", "xyz", "x,y" or ["x", "z"] name.

    Raises
    ------
    TypeError : when it is no text
    """
    if isinstance(axis, Sequence) and not isinstance(axis, str) and all(isinstance(one, str) for one in axis):
        return tuple(axis)
    if not isinstance(axis, str):
        raise TypeError(f"axis: must be text, such as z or xyz (got {type(axis).__name__})")
    if "," in axis:
        return tuple(one.strip() for one in axis.split(","))
    return tuple(axis) if set(axis) <= set("xyz") and axis else (axis,)
