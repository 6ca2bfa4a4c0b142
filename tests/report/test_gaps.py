"""The gap of the report: what hangs on how a record began is no part of it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pzd.record import Record
from pzd.report.gaps import of_record


def test_a_force_that_differs_only_until_the_motion_has_turned_leaves_no_gap() -> None:
    time = np.arange(2000) / 500.0
    x, v = 0.02 * np.sin(2 * np.pi * time), 0.04 * np.pi * np.cos(2 * np.pi * time)
    force = 1000.0 * np.sign(v)
    record = Record("sine", None, time, x, v, -((2 * np.pi) ** 2) * x, force)
    begun_elsewhere = np.where(time < 0.1, 0.0, force)
    context: Any = SimpleNamespace(simulated=lambda _: (0.9 * force, begun_elsewhere))
    assert of_record(context, record) == pytest.approx((0.01, 0.0), abs=1e-12)
