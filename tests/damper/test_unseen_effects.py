"""An effect is one file: five unknown ones, put into a copy of the package, act everywhere and are named."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import pzd

UNSEEN = Path(__file__).with_name("unseen")
EFFECTS = ("choked_port", "hardening_spring", "slew_limit", "detent", "dahl_friction")

pytestmark = pytest.mark.ci


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., str]:
    """Run Python in a copy of the package with the five effect files added and nothing else changed."""
    folder = tmp_path_factory.mktemp("unseen")
    shutil.copytree(Path(pzd.__file__).parent, folder / "pzd", ignore=shutil.ignore_patterns("__pycache__"))
    for name in EFFECTS:
        shutil.copy(UNSEEN / f"{name}.py", folder / "pzd" / "damper" / "effects")
    environment = {**os.environ, "PYTHONPATH": str(folder), "XDG_CACHE_HOME": str(folder / "cache")}

    def python(*arguments: str) -> str:
        done = subprocess.run(
            [sys.executable, *arguments], env=environment, cwd=folder, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    return python


@pytest.fixture(scope="module")
def acts(run: Callable[..., str]) -> dict[str, dict[str, float]]:
    """What each effect changes on the stand, in a frame, in a table and in a ride."""
    found: dict[str, dict[str, float]] = json.loads(run(str(UNSEEN / "try_unseen.py"), "acts"))
    return found


def test_a_damper_without_effects_is_the_same_although_two_effects_share_a_letter(
    acts: dict[str, dict[str, float]],
) -> None:
    sys.path.insert(0, str(UNSEEN))
    try:
        from try_unseen import plain_force
    finally:
        sys.path.remove(str(UNSEEN))
    assert acts["plain"] == plain_force()


@pytest.mark.parametrize("name", EFFECTS)
def test_an_unseen_effect_acts_on_the_stand_and_in_the_car(name: str, acts: dict[str, dict[str, float]]) -> None:
    assert acts[name]["stand"] > 0.02
    assert acts[name]["frame"] > 0.02
    assert acts[name]["ride"] > 0.01


def test_the_table_carries_what_steady_slip_shows(acts: dict[str, dict[str, float]]) -> None:
    assert acts["choked_port"]["steady"] > 0.1
    assert acts["dahl_friction"]["steady"] > 0.05
    steady = {"choked_port", "dahl_friction"}
    assert {name: acts[name]["steady"] for name in EFFECTS if name not in steady} == dict.fromkeys(
        ("hardening_spring", "slew_limit", "detent"), 0.0
    )


@pytest.mark.parametrize("name", EFFECTS)
def test_an_unseen_effect_is_solved_as_another_solver_does(name: str, acts: dict[str, dict[str, float]]) -> None:
    # A supply that saturates inside a sampling interval of 1 ms is known to that interval only.
    assert acts[name]["error"] < (5e-3 if name == "slew_limit" else 3e-6)


def test_a_bent_spring_and_a_frame_share_the_deflection(acts: dict[str, dict[str, float]]) -> None:
    assert acts["hardening_spring"]["frame_error"] < 2e-4


@pytest.mark.parametrize("name", EFFECTS)
def test_no_energy_is_lost_in_a_ride(name: str, acts: dict[str, dict[str, float]]) -> None:
    # The lag behind the supply takes its voltage as linear over a control period, also in the one where it arrives.
    assert acts[name]["energy"] < (1e-3 if name == "slew_limit" else 1e-6)


def test_the_unseen_effects_are_listed(run: Callable[..., str]) -> None:
    listed = {line.split()[0] for line in run("-m", "pzd", "effects").splitlines()}
    assert set(EFFECTS) <= listed


@pytest.mark.parametrize("name", EFFECTS)
def test_an_unseen_effect_is_hidden_fitted_and_named(name: str, run: Callable[..., str]) -> None:
    found: dict[str, Any] = json.loads(run(str(UNSEEN / "try_unseen.py"), "named", name))
    assert found["hideable"]
    assert found["size"] == pytest.approx(0.1, rel=0.05)
    assert found["failure"] is None
    assert (found["verdict"], found["effects"]) == ("named", [name]), found["reason"]
    for parameter, hidden in found["hidden"].items():
        assert found["parameters"][parameter]["value"] == pytest.approx(hidden, rel=0.1)
