"""Starting values are read off the characteristic where the element really shows them."""

from __future__ import annotations

import numpy as np
import pytest
from fresh_truths import TABLE_2, acceptance_test, sine_test, with_noise

from pzd.identification.bingham_fit import Bingham, Objective, graphical_start, grid_starts
from pzd.identification.prepared_record import prepare
from pzd.identification.strokes_and_loops import force_at_rest


def test_friction_is_where_the_flank_meets_zero_speed_and_not_the_force_there() -> None:
    truth = TABLE_2[0.0]
    record = sine_test(truth, 2.0, 0.03)
    start = graphical_start([prepare(record)])
    assert force_at_rest(record.velocity[2000:], record.force[2000:], closed=False) == pytest.approx(474.0, abs=3.0)
    assert start.friction == pytest.approx(truth.friction, rel=0.1)


def test_the_pre_slip_slope_is_the_stiffness() -> None:
    for truth in TABLE_2.values():
        assert graphical_start([prepare(sine_test(truth, 2.0, 0.03))]).stiffness == pytest.approx(
            truth.stiffness, rel=1e-3
        )


@pytest.mark.parametrize("draw", range(6))
def test_graphical_and_grid_starts_lie_near_the_truth(draw, rng: np.random.Generator) -> None:
    truth, records = acceptance_test(rng)
    objective = Objective(tuple(prepare(with_noise(r, rng)) for r in records))
    for start in (graphical_start(objective.prepared), grid_starts(objective)[0]):
        np.testing.assert_allclose(np.log(start), np.log(truth), atol=np.log(2.0))


def test_a_rigid_damper_without_a_pre_slip_branch_still_gets_positive_starts() -> None:
    record = sine_test(Bingham(1e-3, 1000.0, 1e9), 1.0, 0.02)
    assert min(graphical_start([prepare(record)])) > 0.0
