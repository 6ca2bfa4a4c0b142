"""A measured friction damper at three tensions of its band: its friction rises, its backlash does not."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest


@pytest.mark.ci
def test_the_friction_of_a_banded_damper_rises_with_the_tension_and_its_backlash_does_not(
    pzd_here: Callable[..., CompletedProcess[str]], root: Path, shared: Path, tmp_path: Path
) -> None:
    if not (shared / "data" / "brfd-friction").is_dir():
        pytest.skip("measured data absent: brfd-friction")
    text = (root / "configs" / "brfd.yaml").read_text(encoding="utf-8").replace("../../shared", shared.as_posix())
    (tmp_path / "brfd.yaml").write_text(text, encoding="utf-8")
    done = pzd_here("changes", "brfd.yaml", "--over", "22 lb,25 lb,70 lb", "--json", cwd=tmp_path)
    assert done.returncode in (0, 4), done.stderr  # C of a friction damper is undetermined
    rows = {row["name"]: row for row in json.loads(done.stdout)["over"]}
    low, middle, high = rows["T0"]["values"]
    assert low < middle < high
    assert "lash" not in rows
