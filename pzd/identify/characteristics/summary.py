"""What the tests of a rig show without any model, condition by condition."""

from __future__ import annotations

from collections.abc import Sequence

from pzd.artefacts.characteristics import Characteristics
from pzd.identify.characteristics.as_it_stands import as_it_stands
from pzd.identify.characteristics.continuous_velocity import continuous_velocity
from pzd.identify.characteristics.gas_and_friction import gas_and_friction
from pzd.identify.characteristics.peak_velocity import peak_velocity
from pzd.identify.characteristics.recognition import speed_tests
from pzd.identify.characteristics.step_response import step_responses
from pzd.identify.characteristics.warm_up import warm_up
from pzd.record import Condition, Record


def characteristics(constant: Sequence[Condition], moving: Sequence[Record]) -> Characteristics:
    """Peak- and continuous-velocity plots, gas force, friction and warm-up of every condition, the response to steps.

    A record that is none of these is told as it stands.

    Parameters
    ----------
    constant : the conditions, in each of which the control signal stands still
    moving : the records in which it moves
    """
    found = [(condition, [(r, test) for r in condition.records for test in speed_tests(r)]) for condition in constant]
    peaks = tuple(row for condition, tests in found for row in peak_velocity(condition, tests))
    steps = step_responses(moving)
    warm = tuple(row for condition in constant for row in warm_up(condition))
    recognised = {row.record for rows in (peaks, steps, warm) for row in rows}
    return Characteristics(
        peak_velocity=peaks,
        continuous_velocity=tuple(row for condition, tests in found for row in continuous_velocity(condition, tests)),
        gas_and_friction=gas_and_friction(peaks),
        steps=steps,
        warm_up=warm,
        as_it_stands=as_it_stands(constant, moving, recognised),
    )
