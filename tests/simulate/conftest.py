"""Rides with as little as a test needs to say."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from simulate_dampers import damper_after_table_2, table_of

from pzd.artefacts import Table
from pzd.damper.model import Damper
from pzd.paper.published import published
from pzd.simulate.compiled_ahead import wait
from pzd.simulate.config import SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.ride.model import dynamic_damper_of, grid_of
from pzd.simulate.ride.outcome import Outcome
from pzd.simulate.ride.riding import ride_case
from pzd.simulate.roads import Way
from pzd.simulate.study.plan import Case


@pytest.fixture(scope="session", autouse=True)
def ride_compiled(kernels_compiled_once: None) -> None:
    """What a test calls of the ride by itself waits for its kernels as a ride does."""
    wait()


@pytest.fixture(scope="session")
def damper() -> Damper:
    return damper_after_table_2()


@pytest.fixture(scope="session")
def table(damper: Damper) -> Table:
    return table_of(damper)


Rider = Callable[..., Outcome]


@pytest.fixture(scope="session")
def ride(damper: Damper, table: Table) -> Rider:
    """Ride one case within the paper's bounds; `generic` takes constant damping through the generic integrator.

    The last rides are remembered: several tests look at the same one.
    """

    @lru_cache(maxsize=30)
    def ridden(policy: str, fidelity: str, road: int, on: str, generic: bool, block: str) -> Outcome:
        config = SimulateConfig.model_validate_json(block)
        case = Case(config.roads[road], policies()[policy], fidelity, plain=False)
        profile = case.road.profile(Way(config.vehicle_speed, config.vehicle_speed * config.duration_s, 1, Path()))
        if generic:
            profile = replace(profile, coefficients=np.zeros(6))  # a level spline beside the sine
        dynamic = dynamic_damper_of(Damper.model_validate_json(on), 22.0, config.valve_response_s)
        return ride_case(config, case, profile, grid_of(table, None), dynamic, ends=False)

    def go(
        policy: str = "comfort",
        fidelity: str = "ideal",
        road: int = 0,
        on: Damper = damper,
        generic: bool = False,
        **given: object,
    ) -> Outcome:
        paper = {} if given.get("bounds") == "table" else {"c_min_Ns_per_m": 750.0, "c_max_Ns_per_m": 45000.0}
        return ridden(policy, fidelity, road, on.model_dump_json(), generic, json.dumps({**paper, **given}))

    return go


@pytest.fixture(scope="session")
def printed() -> dict[str, float]:
    """The numbers that the paper prints, by id."""
    return {row.id: row.number for row in published().values() if row.kind != "claim"}
