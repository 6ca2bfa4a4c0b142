"""A spring that stiffens over the whole stroke: a progressive mount, or the load frame.

Law: k_3 x^3. Near the ends of the stroke it looks like `end_stop`, which begins at a place.
"""

from __future__ import annotations

from pzd.damper.effect import Effect, Parameter, Search

_SEARCH = Search(lambda s: s.force / s.stroke**3, (0.0,))

EFFECT = Effect(
    name="cubic_spring",
    place="parallel",
    law="k_3 x^3",
    parameters=(
        Parameter("k_3", "N/m3", 0.0, -1.0e12, 1.0e12, "stiffness over the square of the displacement", _SEARCH),
    ),
    needs_displacement_zero=True,
    source="Duffing 1918, Erzwungene Schwingungen bei veraenderlicher Eigenfrequenz",
    tests=(({"x": -0.02, "v": 0.0, "a": 0.0, "k_3": 1.0e6}, -8.0),),
)


def law(x: float, v: float, a: float, k_3: float) -> float:
    """Force [N] parallel to the element at a displacement x [m]."""
    return k_3 * x * x * x
