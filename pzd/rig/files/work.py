"""The work that a test does on the damper: over a whole test it is positive, or a sign is wrong."""

from __future__ import annotations

import numpy as np

from pzd.record import Array
from pzd.rig.files.fixture import Freed
from pzd.rig.files.splitting import Test
from pzd.schema.errors import DataError


def refuse_negative_work(test: Test, freed: Freed) -> None:
    """Refuse a test over which the damper does work on the rig.

    Parameters
    ----------
    test : the test, for its place
    freed : displacement and force of the damper, a known fixture taken out

    Raises
    ------
    DataError : unless only a steady force over a net displacement makes the work negative
    """
    x, force = freed.displacement, freed.force
    work, without_mean = work_done(x, force), work_done(x, force - force.mean())
    if work >= 0.0 or without_mean >= 0.0:
        return
    what = f"the damper does work on the rig over the whole test, {work:.4g} J"
    raise DataError(f"{test.place(0)}: {what}: force or displacement has the wrong sign; say sign: {{force: -1}}")


def work_done(x: Array, force: Array) -> float:
    """Work that the rig does on the damper over a record [J].

    Equation: W = integral of F dx                    Source: definition, by the trapezoidal rule
    """
    return float(0.5 * np.sum((force[1:] + force[:-1]) * np.diff(x)))
