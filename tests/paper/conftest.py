"""The chain of configs/paper.yaml without its diagnosis: the plain Bingham damper rides."""

from __future__ import annotations

from pathlib import Path

import pytest

from pzd.artefacts import Diagnosed, Diagnosis, Identified, ReferenceRow, Rides, Rig, base_of
from pzd.config import RunConfig, load
from pzd.force_table.stage import force_table
from pzd.identification.stage import identify
from pzd.paper.published import published
from pzd.quantities import Control
from pzd.report.reference import compared
from pzd.report.ride_comfort import assess, rated
from pzd.report.run_numbers import RunNumbers
from pzd.rig.stage import synthesise
from pzd.simulate.stage import simulate


@pytest.fixture(scope="package")
def config(root: Path) -> RunConfig:
    return load(root / "configs" / "paper.yaml")


@pytest.fixture(scope="package")
def rig(config: RunConfig, root: Path) -> Rig:
    return synthesise(config.rig, config.seed, Control(), root / "configs")


@pytest.fixture(scope="package")
def identified(config: RunConfig, rig: Rig) -> Identified:
    return identify(config.identify, rig, config.seed)


@pytest.fixture(scope="package")
def rides(config: RunConfig, rig: Rig, identified: Identified) -> Rides:
    damper = base_of(identified.rows, config.setting)
    diagnosed = Diagnosed(Diagnosis.model_construct(), damper, damper)
    table = force_table(config.table, rig, diagnosed, Control(), config.setting)
    of_the_paper = config.simulate.model_copy(update={"policies": ("constant", "comfort")})  # the paper knows no other
    return simulate(of_the_paper, diagnosed, table, config.seed, Path())


@pytest.fixture(scope="package")
def beside(config: RunConfig, identified: Identified, rides: Rides) -> dict[str, ReferenceRow]:
    comfort = tuple(row for ride in rated(rides) for row in assess(ride, config.report))
    found = compared(tuple(published().values()), RunNumbers(identified, rides, comfort, config.simulate, Control()))
    return {row.id: row for row in found}
