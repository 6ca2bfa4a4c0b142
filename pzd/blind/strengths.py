"""How strong a hidden effect is: found from the size that it shall have, between nothing and the most."""

from __future__ import annotations

from collections.abc import Callable

from pzd.damper.effect import Strength

Values = dict[str, float]

_HALVINGS = 14  # of the strength: to a ten-thousandth of the most


def of_size(strength: Strength, size_at: Callable[[Values], float], wanted: float) -> Values:
    """The parameters at which an effect has a size, or its most where that is smaller.

    Parameters
    ----------
    strength : the parameters at each strength, see `pzd.damper.effect.Strength`
    size_at : how much an effect with these parameters changes the force; it rises with the strength
    wanted : the size
    """
    low, high = 0.0, 1.0
    if size_at(strength(high)) <= wanted:
        return strength(high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if size_at(strength(middle)) > wanted else (middle, high)
    return strength(high)
