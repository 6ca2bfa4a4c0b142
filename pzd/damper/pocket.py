"""What is squeezed by a force, and by no more than its own length: a pocket of gas, a rubber mount.

Equation: e = s + d s/(s + s_d), for s >= 0: Boyle's law of a pocket of length d at a static force p A, s_d = p A/k;
below 0 it goes on straight. e is the elastic deflection, s = F/k the extension of the oil spring behind it.

Plain functions: `pzd.compiled` makes machine code of them with the laws that call them.
"""

from __future__ import annotations

import math


def deflection_with(extension: float, length: float, half: float) -> float:
    """Deflection e [m] of both at an extension of the oil spring [m].

    Parameters
    ----------
    extension : s of the oil spring, to the side of the pocket [m]
    length : of the pocket, d [m]
    half : extension of the oil spring at which the pocket has half its length, s_d > 0 [m]
    """
    return extension * (1.0 + length / half) if extension <= 0.0 else extension * (1.0 + length / (extension + half))


def extension_behind(deflection: float, length: float, half: float) -> float:
    """Extension of the oil spring s [m] at a deflection of both [m]: the same solved for s, without cancellation."""
    if deflection <= 0.0:
        return deflection / (1.0 + length / half)
    b = half + length - deflection
    root = math.sqrt(b * b + 4.0 * half * deflection)
    return 2.0 * half * deflection / (b + root) if b > 0.0 else 0.5 * (root - b)


def extension_slope(deflection: float, length: float, half: float) -> float:
    """Derivative of the extension by the deflection [-]."""
    s = max(extension_behind(deflection, length, half), 0.0)
    return 1.0 / (1.0 + length * half / ((s + half) * (s + half)))
