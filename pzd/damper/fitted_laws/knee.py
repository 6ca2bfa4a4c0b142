"""Passive road and race damper: bleed, knee and blow-off, each of its own in rebound and in compression.

Law: the flow curve is T0 + C (1 + beta) w + q_reb w^2 in rebound and T0 + C (1 - beta) w + q_comp w^2 in compression
(bleed) up to the force of the knee; from there on it has the slope of the blow-off. Range: knees at 0.05 to 0.3 m/s;
the bleed is two to ten times as steep as the blow-off where shims open, and flatter where a port chokes; through a jet
or a needle it is all but square, through a slot or the notch of a shim all but straight. A stack of shims lifts off
little by little: the knee is then round, as if it opened over forces spread by up to a third of the knee force.
"""

from __future__ import annotations

from math import inf, sqrt

from pzd.damper.effect import LARGEST_DAMPING, LARGEST_FORCE, LARGEST_SQUARE, Effect, Parameter, Search

NO_KNEE = LARGEST_FORCE
"""Knee force of a direction without a knee [N]: no damper reaches it."""

STEEPEST = 1.0 - 1e-6
"""Largest share: the straight part of a bleed that is all but square is next to nothing beside the other's."""

KNEE_FORCES = ("F_reb", "F_comp")
"""Parameters that say at which force a knee lies."""
CHANGE_TOGETHER = (
    ("F_reb", "C_reb"),
    ("F_reb", "C_reb", "s_reb"),
    ("F_comp", "C_comp"),
    ("F_comp", "C_comp", "s_comp"),
    ("C", "beta", "q_reb"),
    ("C", "beta", "q_comp"),
    ("C", "beta", "q_reb", "q_comp"),
    ("C", "beta", "q_reb", "F_reb", "C_reb", "s_reb"),
    ("C", "beta", "q_comp", "F_comp", "C_comp", "s_comp"),
    ("C", "beta", "q_reb", "q_comp", *KNEE_FORCES, "C_reb", "C_comp", "s_reb", "s_comp"),
)
"""Sets of parameters that one cause changes together: the shims of one side (knee and blow-off), the bleed of one side
or of both, everything on one side, or everything at once, as a thinner oil does. C is that of the element."""

_SHARE = Search(lambda _: 1.0, (0.0,))
_FORCES = Search(lambda s: s.force, (0.3,), logarithmic=True)
_SLOPES = Search(lambda s: s.damping, (0.4,), logarithmic=True)
_SQUARES = Search(lambda s: s.force / s.speed**2, (0.05,))
_SPREADS = Search(lambda s: s.force, (0.05,))

EFFECT = Effect(
    name="knee",
    place="flow",
    law="C times (1 + beta sign(F)), + (q_reb or q_comp) w^2; beyond max(F_reb or F_comp, T0) slope C_reb or C_comp, "
    "opening over forces spread by s_reb or s_comp",
    parameters=(
        Parameter("beta", "-", 0.0, -STEEPEST, STEEPEST, "share by which the bleed of rebound is steeper", _SHARE),
        Parameter("F_reb", "N", inf, 0.0, NO_KNEE, "force of the knee in rebound", _FORCES),
        Parameter("C_reb", "N s/m", 0.0, 1.0e-3, LARGEST_DAMPING, "blow-off slope in rebound", _SLOPES),
        Parameter("F_comp", "N", inf, 0.0, NO_KNEE, "force of the knee in compression", _FORCES),
        Parameter("C_comp", "N s/m", 0.0, 1.0e-3, LARGEST_DAMPING, "blow-off slope in compression", _SLOPES),
        Parameter(
            "q_reb", "N s2/m2", 0.0, 0.0, LARGEST_SQUARE, "square part of the bleed in rebound", _SQUARES, optional=True
        ),
        Parameter(
            "q_comp",
            "N s2/m2",
            0.0,
            0.0,
            LARGEST_SQUARE,
            "square part of the bleed in compression",
            _SQUARES,
            optional=True,
        ),
        Parameter(
            "s_reb", "N", 0.0, 0.0, LARGEST_FORCE, "spread of the knee force in rebound", _SPREADS, optional=True
        ),
        Parameter(
            "s_comp", "N", 0.0, 0.0, LARGEST_FORCE, "spread of the knee force in compression", _SPREADS, optional=True
        ),
    ),
    source="bleed and blow-off stages of a shimmed piston; Dixon 2007, The Shock Absorber Handbook",
    tests=(
        ({"side": 1.0, "beta": 0.25}, 1.25),
        ({"side": -1.0, "beta": 0.25}, 0.75),
        ({"T0": 40.0, "side": 1.0, "F_reb": 300.0, "F_comp": 120.0}, 300.0),
        ({"T0": 40.0, "side": -1.0, "F_reb": 300.0, "F_comp": 20.0}, 40.0),
        ({"side": -1.0, "C_reb": 900.0, "C_comp": 500.0}, 500.0),
        ({"w": 0.1, "side": 1.0, "q_reb": 6000.0, "q_comp": 2000.0}, 60.0),
        ({"w": 0.1, "side": -1.0, "q_reb": 6000.0, "q_comp": 2000.0}, 20.0),
        ({"side": 1.0, "s_reb": 60.0, "s_comp": 20.0}, 60.0),
        ({"side": -1.0, "s_reb": 60.0, "s_comp": 20.0}, 20.0),
    ),
)


def bleed_factor(side: float, beta: float) -> float:
    """Factor on C for the sign of the force."""
    return 1.0 + beta * side


def opens_at(T0: float, side: float, F_reb: float, F_comp: float) -> float:
    """Force [N] of the knee for the sign of the force."""
    return max(F_reb if side > 0.0 else F_comp, T0)


def with_seal(force: float, friction: float) -> float:
    """Force [N] of a knee where a seal rubs by so much more [N]: it rubs beside the oil, and the force holds it."""
    return force if force >= NO_KNEE else max(force + friction, 0.0)


def slope_beyond(side: float, C_reb: float, C_comp: float) -> float:
    """Slope [N s/m] beyond it."""
    return C_reb if side > 0.0 else C_comp


def spread(side: float, s_reb: float, s_comp: float) -> float:
    """Spread of the forces [N] about it at which shims lift off, for the sign of the force; see `pzd.damper.flow`."""
    return s_reb if side > 0.0 else s_comp


def extra_force(w: float, side: float, q_reb: float, q_comp: float) -> float:
    """Force [N] of the square part of the bleed at a flow speed w >= 0 [m/s]."""
    return (q_reb if side > 0.0 else q_comp) * w * w


def extra_slope(w: float, side: float, q_reb: float, q_comp: float) -> float:
    """Compute its derivative by w [N s/m]."""
    return 2.0 * (q_reb if side > 0.0 else q_comp) * w


def extra_speed(force: float, C: float, side: float, q_reb: float, q_comp: float) -> float:
    """Flow speed w [m/s] at which C w and the square part together take a force >= 0 [N]."""
    return 2.0 * force / (C + sqrt(C * C + 4.0 * (q_reb if side > 0.0 else q_comp) * force))


def mean_bleed(rebound: float, compression: float) -> float:
    """C of the element [N s/m] from the straight bleed of either direction [N s/m]."""
    return 0.5 * (rebound + compression)


def parameters_of(
    bleed: tuple[float, float],
    square: tuple[float, float],
    knee_force: tuple[float | None, float | None],
    blow_off: tuple[float | None, float | None],
    spread: tuple[float, float] = (0.0, 0.0),
) -> dict[str, float]:
    """Parameters of the law by name, from those of rebound and of compression.

    Parameters
    ----------
    bleed : straight parts C [N s/m]
    square : square parts q [N s2/m2]
    knee_force : with the friction [N]; None or infinite without a knee
    blow_off : slopes beyond it [N s/m]; None without a knee, where the bleed goes on
    spread : of the knee forces [N]; 0 for a sharp knee
    """
    forces = [NO_KNEE if force is None else min(force, NO_KNEE) for force in knee_force]
    slopes = [own if beyond is None else beyond for own, beyond in zip(bleed, blow_off, strict=True)]
    return {
        "beta": (bleed[0] - bleed[1]) / (bleed[0] + bleed[1]),
        "F_reb": forces[0],
        "C_reb": slopes[0],
        "F_comp": forces[1],
        "C_comp": slopes[1],
        "q_reb": square[0],
        "q_comp": square[1],
        "s_reb": spread[0],
        "s_comp": spread[1],
    }
