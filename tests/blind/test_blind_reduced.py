"""The benchmark in small: 60 cases of a seed that is never scored, with floors that a broken naming misses.

Chances by the binomial law, for the some 17 visible single effects in tests of two frequencies or more: a naming
that is right in 90 % falls below 75 % with probability 0.02, one that is right in half of them reaches it with
0.03. One that names something in 1 % of the some 15 cases without an effect does so twice with probability 0.01.
One that leaves 92 % of the some 11 visible outsiders unexplained falls below 70 % with probability 0.01.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from pzd.blind.case import Scored
from pzd.blind.rates import Rate, false_name, right, visible, wrong_name
from pzd.quantities import Control
from pzd.schema.validate import read_json

CASES = 60
NEVER_SCORED = 20261121
"""One of the seeds that rules are tuned on, so that no scored one is used up."""
pytestmark = pytest.mark.ci

Command = Callable[..., "subprocess.CompletedProcess[str]"]


def test_a_small_benchmark_names_what_is_there(pzd: Command, root: Path, tmp_path: Path) -> None:
    values = {"cases": CASES, "seed": NEVER_SCORED, "tuning": "true"}
    given = [part for key, value in values.items() for part in ("--set", f"blind.{key}={value}")]
    said = pzd("blind", root / "configs" / "blind.yaml", "--runs", tmp_path, *given)
    assert said.returncode == 0, said.stdout + said.stderr
    scored = sorted(tmp_path.glob("blind/blind/seed-*/scored/*.json"))
    cases = [read_json(path, Scored, Control()) for path in scored]
    assert len(cases) == CASES
    assert [case.failure for case in cases if case.failure] == [], said.stdout

    seen = [c for c in cases if c.kind == "single" and c.truth and visible(c) and not c.one_frequency]
    assert len(seen) >= 12
    assert (Rate.of(seen, right).share or 0.0) >= 0.75, said.stdout
    assert Rate.of(seen, wrong_name).hits <= 2, said.stdout
    assert Rate.of([c for c in cases if c.kind == "none"], false_name).hits <= 1, said.stdout
    outside = [c for c in cases if c.kind == "outside" and visible(c)]
    assert (Rate.of(outside, lambda c: c.verdict == "unexplained").share or 0.0) >= 0.7, said.stdout
