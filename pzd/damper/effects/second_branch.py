"""A further elasto-plastic element parallel to the first (Maxwell slip): a spring that slips at a force of its own.

Law: dF_2/dt = k_2 dx/dt, |F_2| <= T0_2, whatever the speed. Softer than the oil stiffness, it makes the shelf that
measured magneto-rheological dampers show behind a reversal, T0_2/k_2 wide on either side: range 0.3-10 mm, T0_2 up to a
quarter of the peak. Two tests distinguish its nearest neighbours. At an amplitude below T0_2/k_2 it is a spring and
dissipates nothing: `rounded_yield` dissipates at every amplitude, `lash` shows no force at all. And one speed at two
amplitudes: a shelf with the same width in millimetres in both is this one, one with the same width in m/s is a
rounded yield. A larger or smaller k bends the whole way to T0, not its second part alone.
"""

from __future__ import annotations

from pzd.damper.effect import Effect, Parameter, Search

_T0_2_SEARCH = Search(lambda s: s.force, (0.05, 0.2))
_K_2_SEARCH = Search(lambda s: s.force / s.stroke, (1.0, 5.0, 20.0), logarithmic=True)

EFFECT = Effect(
    name="second_branch",
    place="branch",
    law="dF_2/dt = k_2 dx/dt, |F_2| <= T0_2",
    parameters=(
        Parameter("T0_2", "N", 0.0, 0.0, 1.0e6, "force at which the branch slips", _T0_2_SEARCH, with_friction=True),
        Parameter(
            "k_2", "N/m", 1.0e5, 1.0, 1.0e9, "stiffness of the branch before it slips", _K_2_SEARCH, with_friction=True
        ),
    ),
    source="Iwan 1966, J. Appl. Mech. 33(4); generalized Maxwell slip: Al-Bender, Lampaert and Swevers 2005, "
    "IEEE Trans. Automatic Control 50(11)",
    tests=(
        ({"deflection": 0.0, "travel": 1.0e-3, "T0_2": 100.0, "k_2": 5.0e4}, 1.0e-3),
        ({"deflection": 1.5e-3, "travel": 1.0e-3, "T0_2": 100.0, "k_2": 5.0e4}, 2.0e-3),
        ({"deflection": 2.0e-3, "travel": -5.0e-3, "T0_2": 100.0, "k_2": 5.0e4}, -2.0e-3),
        ({"deflection": 1.5e-3, "k_2": 5.0e4}, 75.0),
    ),
    imitates=True,
    named_alone=True,
    never_named="whatever slips at a force of its own has its shelf: a lip, a rubber seat, the yield of a fluid or a "
    "mount; which of these it stands for, the force does not show",
)


def advance(deflection: float, travel: float, T0_2: float, k_2: float) -> float:
    """Elastic deflection [m] after a travel of the rod to one side [m]."""
    most = T0_2 / k_2
    return max(-most, min(most, deflection + travel))


def law(deflection: float, k_2: float) -> float:
    """Force [N] parallel to the element at an elastic deflection [m]."""
    return k_2 * deflection


def rate(deflection: float, side: float, T0_2: float, k_2: float) -> float:
    """Compute the derivative of the deflection by the travel to a side [-]: 1 before slip, 0 in slip."""
    return 0.0 if side * deflection >= T0_2 / k_2 else 1.0
